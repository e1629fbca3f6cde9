"""The listings of docs/python.md run, from the top down, and print what is shown there."""

import re
import shutil
from pathlib import Path

import pytest

from tests.needs import package

ROOT = Path(__file__).parent.parent
LISTINGS = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "python.md").read_text(), re.DOTALL)


@pytest.fixture
def elsewhere(tmp_path, monkeypatch):
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_listings_run_from_the_top_down(elsewhere, capsys):
    package("pandas")
    names = {}
    for listing in LISTINGS:
        exec(compile(listing, "docs/python.md", "exec"), names)
    printed = capsys.readouterr().out
    assert printed.startswith("<Flight 'Around the mast': completed 17.5 s, position RMSE ")
    assert "<Flight 'Flight': lost (off_path) at" in printed
    assert printed.endswith("Mission: path.radius: should be greater than 0, not -2.0 m\n")
    rmse = [float(text) for text in re.findall(r"m/s: ([0-9.]+) mm", printed)]
    assert rmse == sorted(rmse)
    assert len(rmse) == 4
    assert names["recorded"].outcome.name == "COMPLETED"
    assert (names["flight"].outcome.name, names["flight"].ended) == ("COMPLETED", 17.5)
    assert (elsewhere / "attitude.png").is_file()
    assert (elsewhere / "out" / "mast" / "flight.csv").is_file()
