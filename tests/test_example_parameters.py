"""The example's workflow for GitHub, whose steps run as they stand in a repository with a change of the parameters."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from quadstep.io.parameter_files import CrazyflieYaml

WORKFLOW = Path(__file__).parent.parent / "examples" / "parameters.yml"


def steps():
    """The shell of its steps, less the installation."""
    said = [
        step["run"]
        for step in yaml.safe_load(WORKFLOW.read_text(encoding="utf-8"))["jobs"]["what-if"]["steps"]
        if "run" in step
    ]
    given = {"${{ github.base_ref }}": "main", "${{ github.event.pull_request.number }}": "7", "--page": "--flights 2"}
    for name, value in given.items():
        said = [text.replace(name, value) for text in said]
    return [text for text in said if not text.startswith("pip install")]


def test_a_change_that_says_nothing_is_commented_too(tmp_path):
    assert commented(tmp_path, 200.0).endswith(
        "saved.yaml: no parameter of crazyflie-pid, crazyflie-mellinger differs between it and before.yaml\n"
    )


@pytest.mark.thorough
def test_a_change_of_parameters_is_commented(tmp_path):
    told = commented(tmp_path, 100.0)
    assert told.startswith("pr comment 7 --body-file comment.md\nWith pid_rate.roll_kp = 100 (200 before) ")
    assert "| fail in gusts | 0 % | 0 % |" in told
    assert "\n| at rest | " in told
    assert (tmp_path / "here" / "out" / "report.html").is_file()


def commented(tmp_path, after):
    """What the workflow comments on a change of a gain from 200."""
    origin, here, tools = tmp_path / "origin", tmp_path / "here", tmp_path / "tools"
    parameters = {"pid_rate.roll_kp": 200.0, "pid_rate.pitch_kp": 200.0}

    def git(*words):
        subprocess.run(["git", "-c", "user.name=a", "-c", "user.email=a@b", *words], check=True, capture_output=True)

    def commit(folder, value, more=""):
        text = CrazyflieYaml.write({"pid_rate.roll_kp": value}, parameters) + more
        (folder / "saved.yaml").write_text(text, encoding="utf-8")
        git("-C", str(folder), "add", "saved.yaml")
        git("-C", str(folder), "commit", "-m", f"roll_kp {value}")

    git("init", "-b", "main", str(origin))
    commit(origin, 200.0)
    git("clone", str(origin), str(here))
    commit(here, after, "# the same\n")
    tools.mkdir()
    (tools / "gh").write_text('#!/bin/sh\necho "$@" > told\ncat comment.md >> told\n', encoding="utf-8")
    (tools / "gh").chmod(0o755)
    own = Path(sys.executable).parent
    environment = {**os.environ, "PATH": os.pathsep.join([str(tools), str(own), os.environ["PATH"]])}
    for step in steps():
        subprocess.run(
            ["bash", "-e", "-o", "pipefail", "-c", step], cwd=here, env=environment, check=True, capture_output=True
        )
    return (here / "told").read_text(encoding="utf-8")
