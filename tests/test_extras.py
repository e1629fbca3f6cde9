"""What is said where a command needs more than the core is what pip can install, whether or not quadstep is on an index."""

import subprocess
import sys
import tomllib
from importlib import metadata
from pathlib import Path

import pytest

from quadstep.io import doors
from quadstep.io.doors import EXTRAS, missing_extra, requirements
from tests.patience import PATIENCE

DECLARED = tomllib.loads((Path(__file__).parent.parent / "pyproject.toml").read_text())["project"]["optional-dependencies"]


COMMANDS = ("studies.campaign", "studies.comparison", "studies.envelope", "studies.rare", "studies.tuning", "studies.study",
            "proofs.verify")  # fmt: skip
"""Packages that need an extra."""

READERS = {"quadstep.identify.logs.blackbox", "quadstep.identify.logs.mcap_file", "quadstep.numbers.symbols"}
"""Modules elsewhere that are loaded where an extra's package is used."""

WITHOUT = f"""
import importlib, pkgutil, sys
sys.modules.update(dict.fromkeys({[*EXTRAS]}))
import quadstep
for module in pkgutil.walk_packages(quadstep.__path__, "quadstep."):
    if not module.name.partition(".")[2].startswith({COMMANDS}) and not module.name.endswith("__main__"):
        try:
            importlib.import_module(module.name)
        except ImportError:
            print(module.name)
"""


def absent(name):
    return ModuleNotFoundError(f"No module named {name!r}", name=name)


@pytest.mark.parametrize("extra", ["campaign", "verify", "rotorpy"])
def test_requirements_are_those_of_pyproject(extra):
    assert sorted(requirements(extra)) == sorted(DECLARED[extra])


def test_an_extra_made_of_another_names_all_its_packages():
    wanted = [one for one in DECLARED["cluster"] if not one.startswith("quadstep[")] + DECLARED["campaign"]
    assert sorted(requirements("cluster")) == sorted(wanted)


@pytest.mark.parametrize("package", EXTRAS)
def test_every_package_is_one_of_its_extra_or_comes_with_one(package):
    brought_by = {"mpmath": "sympy", "mcap_ros2": "mcap-ros2-support", "lz4": "mcap", "zstandard": "mcap"}
    comes_with = {**brought_by, "h5py": "foundation-policy"}.get(package, package.replace("_", "-"))
    assert any(one.startswith(comes_with) for one in requirements(EXTRAS[package]))


def test_the_line_names_command_package_and_what_to_run():
    said = str(missing_extra("`quadstep tune`", absent("scipy.stats")))
    wanted = "'cma>=4' 'pyarrow>=18' 'scipy>=1.14' 'tomlkit>=0.13'"
    assert said == f"`quadstep tune` needs scipy; install it: {sys.executable} -m pip install {wanted}"


def test_where_quadstep_is_not_installed_the_package_itself_is_named(monkeypatch):
    def unknown(name):
        raise metadata.PackageNotFoundError(name)

    monkeypatch.setattr(doors, "requires", unknown)
    assert str(missing_extra("x", absent("ray"))).endswith("pip install ray")


def test_what_is_missing_beside_extras_is_no_matter_of_the_user():
    with pytest.raises(ModuleNotFoundError, match="numpy"):
        missing_extra("x", absent("numpy"))


def test_all_else_loads_with_the_core_alone():
    run = subprocess.run([sys.executable, "-c", WITHOUT], capture_output=True, text=True, check=True, timeout=PATIENCE)
    assert set(run.stdout.split()) == READERS
