"""The example's action for GitHub, whose steps run as they stand in a repository with a change of the parameters."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from tests.missions import EXAMPLES

REPOSITORY = EXAMPLES / "parameters"


def read(path):
    return yaml.safe_load((REPOSITORY / path).read_text(encoding="utf-8"))


def steps(here):
    """The action's steps, less the installation: shell and environment, with what GitHub puts in place of ${{ ... }}."""
    (call,) = [one for one in read(".github/workflows/parameters.yml")["jobs"]["what-if"]["steps"] if one["uses"] == "./"]
    action = read("action.yml")
    values = {name: one.get("default") for name, one in action["inputs"].items()} | call["with"] | {"flights": 2}
    values = {f"inputs.{name}": str(value) for name, value in values.items()}
    values |= {"github.base_ref": "main", "github.event.pull_request.number": "7", "github.token": ""}
    for step in action["runs"]["steps"][1:]:
        given = {name: values[word.removeprefix("${{ ").removesuffix(" }}")] for name, word in step["env"].items()}
        yield step["run"], given | {"GITHUB_ACTION_PATH": str(here)}


def commented(tmp_path, change):
    """What is commented on a change of the file's text by a function."""
    origin, here, tools = tmp_path / "origin", tmp_path / "here", tmp_path / "tools"

    def git(folder, *words):
        command = ["git", "-C", str(folder), "-c", "user.name=a", "-c", "user.email=a@b", *words]
        subprocess.run(command, check=True, capture_output=True)

    shutil.copytree(REPOSITORY, origin)
    git(origin, "init", "-b", "main")
    git(origin, "add", ".")
    git(origin, "commit", "-m", "parameters")
    git(tmp_path, "clone", str(origin), str(here))
    file = here / "x500.params"
    file.write_text(change(file.read_text(encoding="utf-8")), encoding="utf-8")
    tools.mkdir()
    (tools / "gh").write_text('#!/bin/sh\necho "$@" > comment.txt\ncat comment.md >> comment.txt\n', encoding="utf-8")
    (tools / "gh").chmod(0o755)
    path = os.pathsep.join([str(tools), str(Path(sys.executable).parent), os.environ["PATH"]])
    for shell, given in steps(here):
        subprocess.run(
            ["bash", "-e", "-o", "pipefail", "-c", shell],
            cwd=here,
            env={**os.environ, **given, "PATH": path},
            check=True,
            capture_output=True,
        )
    return (here / "comment.txt").read_text(encoding="utf-8").splitlines()


def test_a_change_that_changes_no_parameter_gets_the_reason(tmp_path):
    first, reason = commented(tmp_path, lambda text: "# the same\n" + text)
    assert first == "pr comment 7 --body-file comment.md"
    assert reason == "x500.params: no parameter of px4-cascade differs between it and before.params"


@pytest.mark.thorough
def test_a_change_gets_margins_and_failure_rates_before_and_after(tmp_path):
    lines = commented(tmp_path, lambda text: text.replace("MC_ROLLRATE_P	0.150000005960464478", "MC_ROLLRATE_P	0.3"))
    assert lines[1].startswith("With MC_ROLLRATE_P = 0.3 (0.15 before) ")
    assert lines[3:5] == ["| | before | after |", "|---|---|---|"]
    assert lines[5].startswith("| at rest | sound: smallest gain margin 14.4 dB ")
    assert " | fragile: phase margin " in lines[5]
    assert " (less than 30.0°)" in lines[5]
    assert not any(line.startswith("Warning") for line in lines)
    assert lines[6] == "| failed in gusts | 0 % (0 to 84.2) | 0 % (0 to 84.2) |"
    assert (tmp_path / "here" / "out" / "page.html").is_file()
