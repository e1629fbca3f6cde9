"""The tests of every controller notice when its law is changed: of three mutants spread over its file two make them fail.

`python -m tests.mutants` tries all mutants of a file, which takes long.
"""

import os
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import pytest

from quadstep.control.registry import BUILT_IN
from tests.mutants import mutants, survivors
from tests.mutations import source
from tests.needs import POLICY, needs

FAMILIES = ("tests/test_control_families.py",)
QUICK = "not any_attitude and not small_and_large and not blow_it_off"
AIRFRAME = ("tests/test_control_enter.py", "tests/test_control_real_vehicles.py", "-k", QUICK)
CRAZYFLIE = ("tests/test_control_crazyflie.py",)
CLASSICS = ("tests/test_control_classics.py",)
LINEARISED = ("tests/test_control_h_infinity.py",)
EXTENDED = ("tests/test_control_thrust_extension.py",)
PLANAR = ("tests/test_planar.py",)
ELSEWHERE = {
    "adrc": FAMILIES,
    "cascaded_pid": CLASSICS,
    "crazyflie_mellinger": CRAZYFLIE,
    "crazyflie_pid": CRAZYFLIE,
    "ardupilot_cascade": ("tests/test_control_ardupilot.py",),
    "px4_cascade": ("tests/test_control_px4.py",),
    "completed_backstepping": ("tests/test_theory.py",),
    "dynamic_linearisation": EXTENDED,
    "geometric": CLASSICS,
    "geometric_adaptive": FAMILIES,
    "geometric_l1": FAMILIES,
    "h_infinity_linearisation": LINEARISED,
    "indi": FAMILIES,
    "loop_shaping": LINEARISED,
    "lqr": ("tests/test_control_planned_lqr.py", *AIRFRAME),
    "paper_on_airframe": ("tests/test_paper_on_airframe.py",),
    "planar": PLANAR,
    "rotation_backstepping": AIRFRAME,
    "state_space_backstepping": ("tests/test_control_state_space.py",),
    "super_twisting": FAMILIES,
    "thrust_extended_backstepping": EXTENDED,
}
"""Where the tests of a law are not in a file of its name."""

TRIES = 3


def mutants_of(name):
    return mutants(source(f"control.{name}"))


MODULES = sorted(
    name for name in {place.partition(".")[0] for laws in BUILT_IN.values() for place in laws.values()} if mutants_of(name)
)
"""Those with something to change: a law can be another one's with gains of its own, and has no functions then."""


@pytest.fixture(scope="module")
def apart():
    """A process of its own, which loads once what the tests of every mutant need."""
    root = Path(__file__).parents[1]
    with ProcessPoolExecutor(1, get_context("spawn"), os.chdir, (root,)) as pool:
        yield pool


@pytest.mark.parametrize("name", [pytest.param(one, marks=needs(POLICY) if one == "raptor" else ()) for one in MODULES])
def test_most_changes_of_a_law_are_noticed(name, apart):
    every = -(-len(mutants_of(name)) // TRIES)
    chosen = slice(every // 2, every * TRIES, every)
    tests = ELSEWHERE.get(name, (f"tests/test_control_{name}.py",))
    survived = apart.submit(partial(survivors, f"control.{name}", chosen, *tests, enough=TRIES - 1)).result()
    assert len(survived) <= 1, survived
