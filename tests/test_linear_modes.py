"""Modes of a linear loop: which stay as they are, how that is told from slow ones, and the states that take part in them."""

from types import SimpleNamespace

import numpy as np
import pytest

from quadstep import Mission
from quadstep.linear.analysis import analyse_rest
from quadstep.linear.modes import GONE, Modes, Pole, scales
from quadstep.linear.states import Pose, in_words, short
from quadstep.linear.tables import of_poles, pole_rows

HOLD = {"type": "step", "start": [0.0, 0.0, 2.0], "end": [0.0, 0.0, 2.0], "duration": 5.0}

TUNED = {
    "type": "geometric", "k_x": 102.587, "k_v": 8.48851, "k_i": 40.1959, "k_R": [479.881, 479.881, 124.414],
    "k_Omega": [79.481, 79.481, 38.6051], "integral_bound": 0.963032,
}  # fmt: skip
"""As `quadstep tune` found them: rotor speeds and metres make slopes of 3e4."""


@pytest.mark.parametrize(
    ("preset", "controller"),
    [("crazyflie", {"type": "indi"}), ("crazyflie", {"type": "geometric-l1"}), ("x500", TUNED)],
    ids=lambda one: one if isinstance(one, str) else one["type"],
)
def test_slow_modes_are_not_taken_for_deviations_that_stay(preset, controller):
    analysis = analyse_rest(Mission(vehicle={"preset": preset}, path=HOLD, controller=controller)).analysis
    assert analysis.holds
    assert np.abs(np.linalg.eigvals(analysis.loop.map) - 1.0).min() > 1e-3
    assert analysis.poles[0].real < -0.3


def test_the_integral_of_a_tuned_law_is_its_slowest_mode():
    analysis = analyse_rest(Mission(vehicle={"preset": "x500"}, path=HOLD, controller=TUNED)).analysis
    assert all(set(pole.states) <= {f"integral.{i}" for i in range(3)} for pole in analysis.poles[:3])
    assert pole_rows(analysis.poles, analysis.in_words)[0][-1].startswith("the law's integral along ")


def test_what_keeps_its_value_is_counted_and_is_not_felt():
    """By the map alone: a base of what it leaves as it is, followed through each tick of a period."""
    nets = {"type": "rotation-backstepping", "nets": {"neurons": 3}}
    analysis = analyse_rest(Mission(vehicle={"preset": "hummingbird"}, path=HOLD, controller=nets)).analysis
    modes, rows = Modes(analysis.loop), analysis.loop.period.pose.rows
    kept = len(analysis.loop.map) - np.linalg.matrix_rank(modes.balanced - np.eye(len(modes.balanced)), tol=modes.error)
    stay = modes.staying.T * modes.units[:, None]
    assert stay.shape[1] == kept == sum(not pole.frequency for pole in analysis.poles) > 10
    for tick in analysis.loop.period.ticks:
        assert np.abs(rows @ stay).max() < 1e-6 * np.abs(stay).max()
        stay = tick.step @ (tick.tasks @ stay)
    assert stay == pytest.approx(modes.staying.T * modes.units[:, None], abs=1e-9 * np.abs(stay).max())
    assert of_poles(analysis).startswith(f"{kept} modes neither grow nor decay, without effect on x, y, z and yaw: ")
    assert pole_rows(analysis.poles, analysis.in_words)[0][:2] == ["0", ""]
    counted, gone = sum(2 - (one.imaginary == 0.0) for one in analysis.poles), (np.abs(modes.factors) <= GONE).sum()
    assert counted + gone == len(modes.factors) == len(analysis.loop.period.names)
    assert f"poles.csv lists all except {gone} that decay within one period." in of_poles(analysis)


def test_a_real_pole_that_rounding_splits_is_shown_as_real():
    slow, swinging = (pole_rows([Pole(-1.939, imaginary, ("position.1",))], ", ".join)[0] for imaginary in (3e-14, 0.2))
    assert (slow[0], swinging[0]) == ("-1.939", "-1.939 ± 0.2j")


def test_a_growing_pole_has_no_damping():
    assert pole_rows([Pole(1.5, 1.0, ("position.1",))], ", ".join) == [["1.5 ± 1j", "", "position.1"]]


@pytest.mark.parametrize(
    ("names", "pose", "states", "words"),
    [
        (
            [f"attitude.{i}" for i in range(4)], ("x", "y", "z", "yaw"),
            ("integral.2", "velocity.1", "position.0", "velocity.0", "attitude.2", "rates.2", "observer.gain.1"),
            "the law's integral along z, velocity along x and y, position along x, attitude about y, and 2 more",
        ),
        (["attitude.2"], ("x", "y", "z", "yaw"), ("attitude.0", "rates.2"), "yaw and rate of roll"),
        (["pitch"], ("x", "z"), ("position.1", "pitch"), "position along z and pitch"),
        ([], ("x",), ("weights_1.0", "integral_1.0", "weights_1"), "weights of the first net and the integral of r1 along x"),
        (["q.0"], ("z",), ("rates.0", "attitude.0"), "rates and attitude"),  # of a plant that says no more of them
    ],
)  # fmt: skip
def test_states_are_said_in_words(names, pose, states, words):
    assert in_words(states, names, pose) == words


def loop_of(whole, pose):
    """A loop of one tick."""
    names = tuple(f"state.x.{i}" for i in range(len(whole)))
    tick = SimpleNamespace(tasks=np.eye(len(whole)), step=whole)
    return SimpleNamespace(map=whole, period=SimpleNamespace(ticks=(tick,), pose=Pose(("x",), pose), names=names))


@pytest.mark.parametrize("units", [1.0, 1e7])
@pytest.mark.parametrize(
    ("inner", "held"),
    [
        (np.diag([1.0, 0.9, 0.5]), False),  # nothing acts on the position
        (np.diag([0.9, 1.0, 0.5]), True),  # another state stays
        (np.array([[1.0, 0.01, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.5]]), False),  # it drifts
        (np.array([[1.0 - 1e-4, 0.01, 0.0], [0.0, 1.0 - 1e-4, 0.01], [0.0, 0.0, 1.0 - 1e-4]]), True),  # a slow triple pole
        (np.array([[0.99, 1e3, 0.0], [0.0, 0.99, 1e3], [0.0, 0.0, 0.99]]), True),  # far from normal
        (np.array([[1.0, 0.01, 0.0], [-1e-7, 0.9, 0.0], [0.0, 0.0, 0.5]]), True),  # hardly any stiffness
    ],
)
def test_what_stays_does_not_depend_on_units(inner, held, units):
    scale = np.array([1.0, units, 1.0 / units])
    modes = Modes(loop_of(inner * scale[:, None] / scale, np.array([[1.0, 0.0, 0.0]])))
    assert modes.not_held == (() if held else ("x",))
    assert modes.still.any() == (abs(np.linalg.eigvals(inner) - 1.0).min() < 1e-9)


def test_balancing_takes_no_notice_of_units():
    random = np.random.default_rng(1)
    matrix, units = random.normal(size=(12, 12)), 2.0 ** random.integers(-30, 30, 12)
    seen = matrix * units[:, None] / units
    found = scales(seen)
    assert np.linalg.norm(seen * found / found[:, None]) < 1.5 * np.linalg.norm(matrix)


def test_shares_of_states_do_not_depend_on_units():
    random = np.random.default_rng(2)
    matrix, units = random.normal(size=(6, 6)), 10.0 ** random.integers(-4, 4, 6)
    one, other = (Modes(loop_of(m, np.zeros((1, 6)))) for m in (matrix, matrix * units[:, None] / units))
    order, again = np.argsort(one.factors), np.argsort(other.factors)
    assert one.factors[order] == pytest.approx(other.factors[again])
    assert one.shares[:, order] == pytest.approx(other.shares[:, again], abs=1e-9)
    assert one.shares.sum(axis=0) == pytest.approx(np.ones(6))


def test_each_state_has_a_short_name_of_its_own():
    names = ["state.rates.0", "memory.rates.0", "memory.asked.0", "asked.0", "held.thrust"]
    assert short(names) == ["rates.0", "memory.rates.0", "memory.asked.0", "asked.0", "thrust"]


def test_what_a_law_asked_for_is_called_commanded():
    assert (
        in_words(["asked_torque.0", "asked_thrust"], ["asked_torque.0", "asked_thrust"], [])
        == "commanded torque and commanded thrust"
    )


def test_a_fix_that_is_under_way_is_called_delayed():
    names = ["queued.0.position.1", "queued.2.velocity.2", "queue"]
    assert in_words(names, names, []) == "delayed position, delayed velocity and queue"
