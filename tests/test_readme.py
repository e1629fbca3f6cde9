"""What the README shows works as shown."""

import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

from quadstep.campaign.run import fly_campaign
from quadstep.flight.closed_loop import Outcome
from quadstep.flight.engines import fly
from quadstep.mission.read import check_mission

ROOT = Path(__file__).parent.parent


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)


def run(*arguments: str, folder: Path = ROOT) -> str:
    return subprocess.run([sys.executable, *arguments], cwd=folder, check=True, capture_output=True, text=True).stdout


def test_missions_of_the_readme_fly_to_their_end():
    texts = [text for text in blocks("toml") if "[path]" in text]
    assert len(texts) == 2
    for text in texts:
        assert fly(check_mission(tomllib.loads(text), "README.md").plan()).outcome is Outcome.COMPLETED


def test_the_campaign_of_the_readme_flies(tmp_path):
    (tmp_path / "mission.toml").write_text(next(text for text in blocks("toml") if "Around the tower" in text))
    (tmp_path / "campaign.toml").write_text(next(text for text in blocks("toml") if "[vary]" in text))
    done = fly_campaign(tmp_path / "campaign.toml", tmp_path / "out", flights=64)
    assert done.summary.flights == 64
    assert 0.0 < done.summary.success.value < 1.0


def test_python_of_the_readme_runs(tmp_path):
    code = next(block for block in blocks("python") if "read_mission" in block)
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    assert run("-c", code, folder=tmp_path).startswith("COMPLETED")
    assert (tmp_path / "position.png").is_file()


def test_own_controller_of_the_readme_is_the_one_in_examples_and_flies():
    shown = next(block for block in blocks("python") if "CascadedPD" in block)
    example = (ROOT / "examples" / "own_controller.py").read_text()
    body = [line.strip() for line in shown.splitlines() if "=" in line and "def " not in line]
    assert len(body) > 4
    assert all(line in example for line in body)
    lines = run("examples/own_controller.py").splitlines()
    errors = [float(re.search(r"RMSE ([0-9.e+-]+) mm", line).group(1)) for line in lines]
    assert len(errors) == 2
    assert max(errors) < 50.0
