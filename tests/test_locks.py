"""The core's lock file is the part of the whole one that the core needs; neither names an address."""

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).parent.parent


def pins(name):
    """Each pinned requirement with its hashes."""
    text = (ROOT / "requirements" / name).read_text().replace("\\\n", " ")
    lines = [line.split("--hash=") for line in text.splitlines() if line.strip() and not line.startswith("#")]
    return {line[0].strip(): {part.strip() for part in line[1:]} for line in lines}


def names(pinned):
    return {requirement.partition("==")[0] for requirement in pinned}


def test_every_pin_has_hashes_and_no_file_an_address():
    for name, fewest in (("pip.lock", 1), ("core.lock", 20), ("dev.lock", 60), ("docs.lock", 20)):
        assert len(pins(name)) >= fewest
        assert all(re.fullmatch(r"[a-z0-9.-]+==[^ ]+( ; .+)?", requirement) for requirement in pins(name))
        assert all(hashes and all(one.startswith("sha256:") for one in hashes) for hashes in pins(name).values())
        assert "//" not in (ROOT / "requirements" / name).read_text()


def test_the_core_is_pinned_as_in_the_whole():
    assert pins("core.lock").items() <= pins("dev.lock").items()


def test_the_core_is_what_pyproject_depends_on_and_no_more():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    wanted = {
        re.match("[a-z-]+", one)[0] for one in project["project"]["dependencies"] + project["dependency-groups"]["build"]
    }
    assert wanted <= names(pins("core.lock"))
    heavy = {"ray", "mujoco", "rotorpy", "playwright", "pyarrow", "scipy", "sympy", "pytest", "nvidia-cuda-nvcc-cu12"}
    assert not heavy & names(pins("core.lock"))
    assert heavy <= names(pins("dev.lock"))


def test_the_documentation_is_pinned_beside_the_whole():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    wanted = {re.match("[a-z-]+", one)[0] for one in project["dependency-groups"]["docs"]}
    docs, whole = pins("docs.lock"), pins("dev.lock")
    assert wanted <= names(docs)
    assert all(requirement in whole for requirement in docs if requirement.partition("==")[0] in names(whole))
