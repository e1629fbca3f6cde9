"""What the README shows works as shown."""

import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np

import quadstep
from quadstep.control.registry import BUILT_IN, controllers
from quadstep.interfaces.closed_loop import Outcome
from quadstep.linear.grade import grade
from quadstep.mission.read import check_mission
from tests.golden import FILE as GOLDEN

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")


def block(language: str) -> str:
    """The only listing in a language."""
    (found,) = re.findall(rf"```{language}\n(.*?)```", README, re.DOTALL)
    return found


def test_the_readme_is_short_and_names_the_two_commands():
    assert len(README.splitlines()) < 120
    assert all(f"\n    make {command} " in README for command in ("reproduce", "test"))


def test_its_mission_flies_as_it_says():
    mission = check_mission(tomllib.loads(block("toml")), "README.md")
    flight = quadstep.fly(mission)
    assert flight.outcome is Outcome.COMPLETED
    ended, rmse = flight.column("t")[-1], 1e3 * flight.metrics()["position_rmse[m]"]
    found = grade(mission)
    (phase,) = (one.text(one.value) for one in found.measures if one.what == "phase")
    text = " ".join(README.split())
    assert f"completed {ended:.1f} s with a position RMSE of {rmse:.1f} mm" in text
    assert f"its loop is {found.word}, with a phase margin of {phase.replace('°', ' degrees')}" in text
    distance = np.linalg.norm(flight.table("x_d", "y_d", "z_d") - flight.table("x", "y", "z"), axis=1)
    assert flight.column("t")[distance.argmax()] == 1.0
    assert f"The error is largest, {1e3 * distance.max():.0f} mm, one second after the start" in text
    assert f"From 6 s on it is about {1e3 * distance[flight.column('t') >= 6.0].mean():.0f} mm" in text
    still = quadstep.fly(mission.with_({"wind.mean": [0.0, 0.0, 0.0], "vehicle.effects.drag": False}))
    assert f"the RMSE is {1e3 * still.metrics()['position_rmse[m]']:.2f} mm" in text


def test_its_python_runs(tmp_path):
    (tmp_path / "mission.toml").write_text(block("toml"))
    done = subprocess.run([sys.executable, "-c", block("python")], cwd=tmp_path, check=True, capture_output=True, text=True)
    assert done.stdout.startswith("COMPLETED")
    assert (tmp_path / "position.png").is_file()


def test_its_links_lead_somewhere():
    for target in re.findall(r"\]\(([^)]+)\)", README):
        assert (ROOT / target).is_file(), target


def test_what_it_says_to_download_is_what_the_makefile_says():
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    for amount in ("106 MB", "350 MB", "375 MB", "1.1 GB"):
        assert amount in README
        assert amount in makefile


def test_there_are_as_many_controllers_as_it_says():
    names = {name for measures in BUILT_IN for name in controllers(measures)}
    assert len(names) > 20
    assert "more than twenty controllers" in " ".join(README.split())


def test_its_verdicts_on_the_paper_are_those_of_the_study():
    verdicts = list(json.loads(GOLDEN.read_text(encoding="utf-8"))["verdicts"].values())
    hold, fail = (verdicts.count(one) for one in ("holds", "fails"))
    said = f"{hold} of its {len(verdicts)} claims hold, {fail} fail, {len(verdicts) - hold - fail} are undecided"
    assert said in README
    assert said in (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
