"""Shell completion: the scripts, and the words they request."""

import os
import subprocess
import sys

import pytest

from tests.commands import quadstep
from tests.needs import BASH, FISH, ZSH, needs


@pytest.fixture
def path(tmp_path):
    """A folder of commands in which `quadstep` is this package."""
    command = tmp_path / "quadstep"
    command.write_text(f'#!/bin/sh\nexec {sys.executable} -m quadstep "$@"\n')
    command.chmod(0o755)
    return f"{tmp_path}{os.pathsep}{os.environ['PATH']}"


def asked(shell, script, path):
    """What a shell prints that runs a script."""
    environment = {**os.environ, "PATH": path, "TERM": "dumb"}
    arguments = {"bash": ["--norc", "-c"], "zsh": ["-f", "-c"], "fish": ["--no-config", "-c"]}[shell]
    done = subprocess.run([shell, *arguments, script], env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


@needs(BASH)
def test_bash_completes_commands_and_options(path):
    script = """
    eval "$(quadstep completion bash)"
    COMP_WORDS=(quadstep ca); COMP_CWORD=1; _quadstep_completion quadstep; echo "${COMPREPLY[@]}"
    COMP_WORDS=(quadstep fly --ov); COMP_CWORD=2; _quadstep_completion quadstep; echo "${COMPREPLY[@]}"
    """
    assert asked("bash", script, path) == ["campaign", "--overwrite"]


@needs(ZSH)
def test_zsh_takes_its_script(path):
    asked("zsh", 'autoload -U compinit; compinit -u -D; eval "$(quadstep completion zsh)"; whence _quadstep_completion', path)


@needs(FISH)
def test_fish_completes_commands(path):
    found = asked("fish", 'quadstep completion fish | source; complete --do-complete "quadstep ca"', path)
    assert found[0] == "campaign"


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_every_script_asks_quadstep(shell):
    run = quadstep("completion", shell)
    assert run.code == 0
    assert f"_QUADSTEP_COMPLETE=complete_{shell}" in run.out


def test_another_shell_is_refused():
    run = quadstep("completion", "tcsh")
    assert run.refused
    assert "bash" in run.err
