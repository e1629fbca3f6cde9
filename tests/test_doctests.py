"""The examples in the docstrings of the Python interface run as shown."""

import doctest
from importlib import import_module
from pathlib import Path

import pytest

import quadstep

FRONTS = ("quadstep.control", "quadstep.world.paths", "quadstep.world.pieces", "quadstep.numbers")
"""Packages whose names are public, beside `quadstep` itself."""

MODULES = (
    "quadstep", "quadstep.studies.interface", "quadstep.io.errors", "quadstep.mission.schema", "quadstep.mission.read",
    "quadstep.engines.engine", "quadstep.metrics.registry",
    "quadstep.numbers.functions", "quadstep.numbers.vectors", "quadstep.numbers.structure", "quadstep.interfaces.plant",
    "quadstep.world.air",
    "quadstep.numbers.scan", "quadstep.interfaces.log", "quadstep.own", "quadstep.numbers.elementary", *FRONTS,
)  # fmt: skip


@pytest.mark.parametrize("name", MODULES)
def test_examples_run_as_shown(name, monkeypatch):
    monkeypatch.chdir(Path(__file__).parent.parent)
    assert doctest.testmod(import_module(name)).failed == 0


def test_every_public_name_is_of_a_module_whose_examples_run_and_says_what_it_is():
    for front in (quadstep, *map(import_module, FRONTS)):
        for name in front.__all__:
            one = getattr(front, name)
            if (
                callable(one)
                and one.__module__.startswith("quadstep.")
                and not one.__module__.startswith(("quadstep.control.", "quadstep.interfaces.controller"))
            ):
                assert one.__module__ in MODULES, name
                assert one.__doc__, name
