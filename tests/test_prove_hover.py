"""`quadstep prove`: hover that is not a stable equilibrium, by enclosed eigenvalues."""

import re
from pathlib import Path

import numpy as np
import pytest

from quadstep import read_mission
from quadstep.io import errors
from quadstep.mission.read import plan_mission
from quadstep.proofs.prove.hover import hover, instability, is_equilibrium, jacobian
from quadstep.proofs.prove.linear_maps import spectrum
from quadstep.proofs.prove.sampled import SampledLoop
from tests.commands import quadstep, write

FAILS = Path(__file__).parent.parent / "examples" / "theorem_fails.toml"


def loop_of(**controller):
    mission = read_mission(FAILS)
    if controller:
        content = mission.model_dump()
        content["controller"].update(controller)
        mission = type(mission).model_validate(content)
    plan = plan_mission(mission, FAILS)
    loop = SampledLoop(plan)
    return loop, hover(mission, plan, loop)


def test_the_example_is_disproved(tmp_path):
    run = quadstep("prove", FAILS)
    assert (run.code, run.err) == (errors.DIVERGED, "")
    for needed in (
        "4 of 82",
        "2.14987 to 2.14988 1/s",
        "The printed conditions of Theorem 5.1 hold here",
        "at least 1 N m s at any attitude",
        "With the coupling of the loops, which they leave out, the proof covers thrusts up to 2.65 N near hover",
        "Hover at the path's end, (20, 5, 10) m, is proved unstable.",
    ):
        assert needed in run.out.replace("\n", " ")


def test_how_far_a_flight_was_off_its_path_holds_the_state_that_ended_it(tmp_path):
    mission = write(
        tmp_path,
        """
        vehicle = { preset = "research-2.6kg" }
        path = { type = "step", end = [0.1, 0.0, 0.0], time = 0.2, duration = 0.3 }
        controller = { type = "geometric" }
        limits = { distance = 0.05 }
        """,
    )
    run = quadstep("prove", mission)
    assert run.code == errors.DIVERGED
    assert re.search(r"x +100\smm\n", run.out)


def test_without_nets_the_rate_is_that_of_the_trial():
    loop, at = loop_of(nets={"enabled": False})
    assert len(loop.places) == 22  # the nets' weights are no states
    found = instability(loop, at)
    assert (found.unstable, found.states) == (4, 22)
    assert found.slowest < 0.4243866 + 1e-7
    assert found.fastest > 0.4243866 - 1e-7
    assert found.fastest - found.slowest < 1e-8


def test_it_is_the_coupling_and_not_the_filter_that_makes_hover_unstable():
    """With a filter twenty times as fast, hover stays unstable: the verdict names the coupling."""
    loop, at = loop_of(filter_frequency=2000.0, nets={"enabled": False})
    assert instability(loop, at).slowest > 0.3


def test_the_jacobian_encloses_differences_of_the_flying_loop():
    loop, at = loop_of(nets={"enabled": False})
    middle, radius = jacobian(loop, at)
    assert radius.max() < 1e-11
    step = 1e-6
    for i in range(len(at.state)):
        ahead, behind = ([x + sign * step * (i == k) for k, x in enumerate(at.state)] for sign in (1.0, -1.0))
        slope = (np.array(loop.step(ahead, at.tick)) - np.array(loop.step(behind, at.tick))) / (2.0 * step)
        assert np.abs(slope - middle[:, i]).max() < 1e-7


def test_the_defaults_hover_stably_as_far_as_this_shows():
    loop, at = loop_of(Lambda2=15.0, K_r2=250.0, nets={"enabled": False})
    assert is_equilibrium(loop, at)
    assert instability(loop, at) is None
    assert spectrum(*jacobian(loop, at)).inside


def test_discs_that_touch_the_circle_prove_nothing():
    middle = np.array([[1.001, 0.0], [0.0, 0.9]])
    assert spectrum(middle, np.full((2, 2), 1e-4)).outside == 1
    assert spectrum(middle, np.full((2, 2), 1e-3)).outside == 0


def test_eigenvalues_of_random_matrices_stay_in_their_discs():
    rng = np.random.default_rng(3)
    for _ in range(20):
        middle, radius = rng.normal(size=(6, 6)), 1e-6 * rng.uniform(size=(6, 6))
        found = spectrum(middle, radius)
        for _ in range(5):
            values = np.linalg.eigvals(middle + radius * rng.choice([-1.0, 1.0], (6, 6)))
            near = np.abs(values[:, None] - found.centres[None]) <= found.radii + 1e-12
            assert near.any(axis=1).all()


@pytest.mark.parametrize("shift", [0.0, 1e-12])
def test_an_equilibrium_is_one_exactly(shift):
    loop, at = loop_of(nets={"enabled": False})
    moved = at._replace(state=[at.state[0] + shift, *at.state[1:]])
    assert is_equilibrium(loop, moved) == (shift == 0.0)
