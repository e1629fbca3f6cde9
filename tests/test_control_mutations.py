"""The tests of every controller notice when its law is changed: of three mutants spread over its file one of the first two
makes them fail, and in `make thorough` most of the three.

`python -m tests.mutants` tries all mutants of a file, which takes long.
"""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from quadstep import control
from quadstep.control.registry import BUILT_IN
from tests import mutants
from tests.needs import POLICY, needs
from tests.patience import PATIENCE

FAMILIES = ("tests/test_control_families.py",)
AIRFRAME = ("tests/test_control_real_vehicles.py", "-k", "not any_attitude and not small_and_large")
CLASSICS = ("tests/test_control_classics.py",)
LINEARISED = ("tests/test_control_h_infinity.py",)
EXTENDED = ("tests/test_control_thrust_extension.py",)
PLANAR = ("tests/test_planar.py",)
CRAZYFLIE = ("tests/test_control_crazyflie.py",)
ELSEWHERE = {
    "adrc": FAMILIES,
    "cascaded_pid": CLASSICS,
    "crazyflie_mellinger": CRAZYFLIE,
    "crazyflie_pid": CRAZYFLIE,
    "completed_backstepping": ("tests/test_theory.py",),
    "dynamic_linearisation": EXTENDED,
    "geometric": CLASSICS,
    "geometric_adaptive": FAMILIES,
    "geometric_l1": FAMILIES,
    "h_infinity_linearisation": LINEARISED,
    "indi": FAMILIES,
    "loop_shaping": LINEARISED,
    "lqr": AIRFRAME,
    "paper_on_airframe": ("tests/test_paper_on_airframe.py",),
    "planar_linearisation": PLANAR,
    "planar_pd": PLANAR,
    "rotation_backstepping": AIRFRAME,
    "state_space_backstepping": ("tests/test_control_state_space.py",),
    "super_twisting": FAMILIES,
    "thrust_extended_backstepping": EXTENDED,
}
"""Where the tests of a law are not in a file of its name."""

TRIES = 3

TRIED = """
import importlib, json, sys
from tests.mutants import outcomes
name, all_of_them, first, every, *tests = sys.argv[1:]
survived = []
for one, seen in outcomes(importlib.import_module(f"quadstep.control.{name}"), slice(int(first), None, int(every)), *tests):
    if not seen:
        survived.append(f"{one.function}: {one.was} -> {one.now}")
    elif not int(all_of_them):
        break
print(json.dumps(survived))
"""


def source(name):
    return Path(control.__path__[0], f"{name}.py").read_text(encoding="utf-8")


MODULES = sorted(
    name
    for name in {place.partition(".")[0] for laws in BUILT_IN.values() for place in laws.values()}
    if mutants.mutants(source(name))
)
"""Those with something to change: a law can be another one's with gains of its own, and has no functions then."""


@pytest.mark.parametrize("all_of_them", [False, pytest.param(True, marks=pytest.mark.thorough)], ids=["one", "all"])
@pytest.mark.parametrize("name", [pytest.param(one, marks=needs(POLICY) if one == "raptor" else ()) for one in MODULES])
def test_most_changes_of_a_law_are_noticed(name, all_of_them):
    count = len(mutants.mutants(source(name)))
    every = -(-count // TRIES)
    tests = ELSEWHERE.get(name, (f"tests/test_control_{name}.py",))
    run = subprocess.run(
        [sys.executable, "-c", TRIED, name, str(int(all_of_them)), str(every // 2), str(every), *tests],
        capture_output=True, text=True, check=True, timeout=PATIENCE, cwd=Path(__file__).parents[1],
    )  # fmt: skip
    survived = json.loads(run.stdout)
    assert len(survived) <= 1, survived
