"""How a flight ends: as an outcome with a time, on every engine, without a NaN in its rows and without harm to others."""

import dataclasses
import math

import numpy as np
import pytest

from quadstep.engines.eager import fly_floats
from quadstep.engines.kernel import fly_lanes
from quadstep.engines.loop import Cycle, Loop
from quadstep.interfaces.closed_loop import Outcome, Ticks
from quadstep.interfaces.controller import Command
from quadstep.interfaces.plant import Reference
from quadstep.numbers import Matrix, flatten, vector
from quadstep.vehicle.in_space import COLUMNS
from quadstep.vehicle.lagrange import AttainedCommand, Lagrange, Limits
from quadstep.vehicle.paper import Disturbance, Rotors
from tests.array_flights import fly_arrays
from tests.flights import CASE_1, NESTED, array, gains, nested_gains, parameters, random_state, same, state, vehicle

TICKS = Ticks(0.004, (1,), 5, 1000)
REST = Reference(same(0.0), same(0.0), same(0.0), 0.0, 0.0)
LIMITED = parameters(limits=Limits(distance=10.0, rate=20.0, pitch=1.5))
FINE = Command(9.81, same(0.0))


def sampled(motion, command):
    """The cycle after a sample."""
    return Cycle(motion, (), (), None, command, AttainedCommand(command.thrust, command.torque))


EVERY_ENGINE = {
    "floats": fly_floats,
    "arrays": lambda loop, numbers, start, ticks: fly_arrays(loop, [numbers], [start], ticks)[0],
    "lanes": lambda loop, numbers, start, ticks: fly_lanes(loop, [numbers], [start], ticks)[0],
    "f32 lanes": lambda loop, numbers, start, ticks: fly_lanes(loop, [numbers], [start], ticks, double=False)[0],
}
ENGINES = pytest.mark.parametrize("engine", EVERY_ENGINE)


@pytest.mark.parametrize(("motion", "outcome"), [
    (state(), Outcome.COMPLETED),
    (state(position=(5.7, 5.7, 5.7)), Outcome.COMPLETED),
    (state(position=(5.8, 5.8, 5.8)), Outcome.OFF_PATH),
    (state(attitude=(9.0, 1.49, 9.0)), Outcome.COMPLETED),
    (state(attitude=(0, 1.51, 0)), Outcome.SINGULAR),
    (state(attitude=(0, -1.51, 0)), Outcome.SINGULAR),
    (state(rates=(19.9, -19.9, 19.9)), Outcome.COMPLETED),
    (state(rates=(20.1, 0, 0)), Outcome.SPINNING),
    (state(rates=(0, -20.1, 0)), Outcome.SPINNING),
    (state(rates=(0, 0, 20.1)), Outcome.SPINNING),
    (state(position=(math.inf, 0, 0)), Outcome.NOT_FINITE),
    (state(position=(0, math.nan, 0)), Outcome.NOT_FINITE),
    (state(attitude=(0, math.nan, 0)), Outcome.NOT_FINITE),
    (state(rates=(math.inf, 0, 0)), Outcome.NOT_FINITE),
])  # fmt: skip
def test_a_sample_ends_a_flight_at_its_limits(motion, outcome):
    assert Outcome(int(Lagrange().outcome(LIMITED, motion, FINE, REST))) is outcome


@pytest.mark.parametrize("command", [
    Command(math.nan, same(0.0)),
    Command(math.inf, same(0.0)),
    Command(-math.inf, same(0.0)),
    Command(9.81, vector(0.0, math.nan, 0.0)),
    Command(9.81, vector(0.0, 0.0, -math.inf)),
])  # fmt: skip
def test_a_command_that_is_not_finite_ends_a_flight(command):
    assert Outcome(int(Lagrange().outcome(LIMITED, state(), command, REST))) is Outcome.NOT_FINITE


@pytest.mark.parametrize("engine", [pytest.param("floats", marks=pytest.mark.thorough), "lanes", "f32 lanes"])
def test_case_1_in_three_seconds_diverges_at_the_same_time_on_every_engine(engine):
    """On arrays too, beside a neighbour: further down."""
    log = EVERY_ENGINE[engine](CASE_1, parameters(3.0), state(), TICKS)
    assert log.outcome is Outcome.SPINNING
    assert log.ended == pytest.approx(2.128, abs=0.009)
    assert np.isfinite(log.rows).all()
    assert log.column("t")[-1] < log.ended <= log.column("t")[-1] + 0.0201


@ENGINES
def test_a_flight_that_starts_on_its_side_is_singular_at_once(engine):
    log = EVERY_ENGINE[engine](CASE_1, parameters(), state(attitude=(0, math.pi / 2, 0)), TICKS._replace(last=10))
    assert log.outcome is Outcome.SINGULAR
    assert log.ended == 0.0
    assert log.rows.shape == (0, len(COLUMNS))


@ENGINES
def test_a_flight_from_far_off_its_path_ends_at_once(engine):
    log = EVERY_ENGINE[engine](CASE_1, parameters(), state(position=(0, 0, 101)), TICKS._replace(last=10))
    assert (log.outcome, log.ended) == (Outcome.OFF_PATH, 0.0)


@ENGINES
@pytest.mark.filterwarnings("ignore:overflow")
def test_numbers_too_large_end_a_flight_without_an_exception(engine):
    wild = parameters(gains=gains(gain_1=same(1e200)))
    log = EVERY_ENGINE[engine](CASE_1, wild, state(velocity=(1e120, 0, 0)), TICKS._replace(last=100))
    assert log.outcome is Outcome.NOT_FINITE
    assert np.isfinite(log.rows).all()


@pytest.mark.parametrize("engine", ["floats", "arrays", "lanes"])
def test_a_flight_that_has_ended_stays_as_it_was_even_if_its_path_comes_by_later(engine):
    numbers, start = parameters(1.0, end=(8, 0, 0), limits=Limits(5.0, 100.0, 1.5)), state((6, 0, 0), (1, 0, 0))
    log = EVERY_ENGINE[engine](CASE_1, numbers, start, Ticks(0.004, (1,), 5, 250))
    assert (log.outcome, log.ended) == (Outcome.OFF_PATH, 0.0)
    np.testing.assert_array_equal(flatten(log.final), flatten(CASE_1.start(start, numbers)))


@pytest.mark.parametrize("batch", [fly_arrays, fly_lanes])
def test_a_flight_that_has_ended_stays_as_it_was_while_its_neighbour_flies_on(batch):
    numbers = [parameters(1.0, end=(8, 0, 0), limits=Limits(limit, 100.0, 1.5)) for limit in (5.0, 50.0)]
    start = state((6, 0, 0), (1, 0, 0))
    ended, flying = batch(CASE_1, numbers, [start] * 2, Ticks(0.004, (1,), 5, 250))
    assert (ended.outcome, ended.ended) == (Outcome.OFF_PATH, 0.0)
    assert flying.ended > 0.5
    np.testing.assert_array_equal(flatten(ended.final), flatten(CASE_1.start(start, numbers[0])))


@pytest.mark.parametrize("engine", ["floats", "arrays", "lanes"])
def test_rows_between_two_samples_are_cut_where_they_stop_being_finite(engine):
    torn = parameters(disturbance=Disturbance(0.0, same(0.0), same(1e200)))
    log = EVERY_ENGINE[engine](CASE_1, torn, state(), Ticks(0.004, (50,), 1, 100))
    assert log.outcome is Outcome.NOT_FINITE
    assert log.ended == pytest.approx(0.2)
    assert 0 < len(log.rows) < 10
    assert np.isfinite(log.rows).all()


def test_a_flight_that_diverges_changes_no_neighbour_and_no_neighbour_changes_it():
    numbers = [parameters(duration) for duration in (10.0, 3.0, 6.0, 2.0, 5.0, 3.0, 8.0)]
    starts = [state()] * 6 + [state(attitude=(0, math.pi / 2, 0))]
    together = fly_lanes(CASE_1, numbers, starts, TICKS)
    outcomes = [log.outcome for log in together]
    assert outcomes[0] is outcomes[2] is outcomes[4] is Outcome.COMPLETED
    assert outcomes[6] is Outcome.SINGULAR
    assert Outcome.COMPLETED not in (outcomes[1], outcomes[3], outcomes[5])
    for one, start, log in zip(numbers, starts, together, strict=True):
        alone = fly_lanes(CASE_1, [one], [start], TICKS)[0]
        assert (alone.outcome, alone.ended) == (log.outcome, log.ended)
        assert alone.rows.tobytes() == log.rows.tobytes()
        assert np.isfinite(log.rows).all()


def test_on_arrays_a_flight_that_diverges_changes_no_neighbour():
    ticks = TICKS._replace(last=560)
    together = fly_arrays(CASE_1, [parameters(3.0), parameters(6.0)], [state()] * 2, ticks)
    alone = fly_floats(CASE_1, parameters(6.0), state(), ticks)
    assert [log.outcome for log in together] == [Outcome.SPINNING, Outcome.COMPLETED]
    assert together[0].ended == pytest.approx(2.128, abs=0.009)
    assert np.isfinite(together[0].rows).all()
    assert together[0].column("t")[-1] < together[0].ended <= together[0].column("t")[-1] + 0.0201
    np.testing.assert_array_equal(together[1].rows, alone.rows)


def test_a_batch_of_flights_that_all_end_at_once_has_no_rows():
    logs = fly_lanes(CASE_1, [parameters()] * 3, [state(rates=(0, 0, 1e4))] * 3, TICKS)
    assert [(log.outcome, log.ended, len(log.rows)) for log in logs] == [(Outcome.SPINNING, 0.0, 0)] * 3


@pytest.mark.parametrize("engine", ["floats", "arrays", "lanes"])
def test_a_nan_from_the_nets_ends_a_flight_with_rotor_limits_too(engine):
    loop = dataclasses.replace(CASE_1, plant=Lagrange(rotor_limits=True))
    broken = gains(weights_1=Matrix([same(math.nan)] * 10))
    numbers = parameters(gains=broken, vehicle=vehicle(rotors=Rotors(0.25, 0.02, 0.0, 6.0)))
    log = EVERY_ENGINE[engine](loop, numbers, state(), TICKS._replace(last=50))
    assert log.outcome is Outcome.NOT_FINITE
    assert np.isfinite(log.rows).all()


def test_rotor_limits_hold_every_logged_rotor_thrust():
    limited = Loop(Lagrange(rotor_limits=True), CASE_1.path, CASE_1.controller)
    numbers = parameters(5.0, vehicle=vehicle(rotors=Rotors(0.25, 0.02, 1.0, 4.0)))
    free, held = (fly_lanes(loop, [numbers], [state()], TICKS)[0].table("f1", "f2", "f3", "f4") for loop in (CASE_1, limited))
    assert free.max() > 4.5
    assert held.min() >= 1.0 - 1e-9
    assert held.max() <= 4.0 + 1e-9


def test_a_row_holds_what_its_column_names_say():
    motion, numbers = random_state(np.random.default_rng(91)), parameters(vehicle=vehicle((5, 8, 12), mass=1.3))
    command = Command(
        thrust=11.0,
        torque=vector(0.1, 0.2, 0.3),
        desired_attitude=vector(0.4, 0.5, 0.6),
        r1=vector(1.0, 2.0, 2.0),
        r2=vector(2.0, 3.0, 6.0),
        stored=7.0,
        weight_norms=vector(8.0, 9.0),
    )
    row = dict(zip(COLUMNS, CASE_1.row(sampled(motion, command), numbers, 4.0), strict=True))
    wanted = np.concatenate([array(part) for part in motion])
    names = ["x", "y", "z", "x_dot", "y_dot", "z_dot", "psi", "theta", "phi", "psi_dot", "theta_dot", "phi_dot"]
    assert [row[name] for name in names] == wanted.tolist()
    path = CASE_1.path.reference(4.0, numbers.path)
    assert [row[name] for name in ("x_d", "y_d", "z_d")] == array(path.position).tolist()
    assert [row[name] for name in ("psi_d", "theta_d", "phi_d")] == [0.4, 0.5, 0.6]
    assert [row[name] for name in ("t", "u", "tau_psi", "tau_theta", "tau_phi")] == [4.0, 11.0, 0.1, 0.2, 0.3]
    assert (row["norm_W1"], row["norm_W2"], row["norm_r1"], row["norm_r2"]) == (8.0, 9.0, 3.0, 7.0)
    mean, yaw, pitch, roll = 11 / 4, 0.1 / 0.08, 0.2 / 0.5, 0.3 / 0.5
    forces = [mean + roll + yaw, mean - pitch - yaw, mean - roll + yaw, mean + pitch - yaw]
    np.testing.assert_allclose([row[f"f{i}"] for i in (1, 2, 3, 4)], forces)


def test_logged_lyapunov_function_is_eq_55_without_the_ideal_weights():
    motion = state(attitude=(0.3, 0.4, -0.2))
    command = Command(9.81, same(0.0), r1=vector(1.0, 2.0, 2.0), r2=vector(1.0, -2.0, 3.0), stored=7.0)
    row = CASE_1.row(sampled(motion, command), parameters(vehicle=vehicle(mass=2.0)), 0.0)
    s, r2 = np.sin(0.4), np.array([1, -2, 3])
    j = 5 * np.array([[1, 0, -s], [0, 1, 0], [-s, 0, 1]])
    assert row[list(COLUMNS).index("lyapunov")] == pytest.approx(0.5 * 2 * 9 + 0.5 * r2 @ j @ r2 + 7.0)


def test_outcomes_of_a_long_flight_do_not_depend_on_how_it_is_sliced():
    ticks = Ticks(0.02, (1,), 100, 100_400)  # more than one slice
    numbers = parameters(gains=nested_gains())
    told = []
    logs = fly_lanes(NESTED, [numbers] * 2, [state(), state(attitude=(0, math.pi / 2, 0))], ticks, told.append)
    assert sum(told) == 100_401
    assert told == [0, 100_000, 401]  # compiled, then flown
    assert [log.outcome for log in logs] == [Outcome.COMPLETED, Outcome.SINGULAR]
    np.testing.assert_allclose(logs[0].column("t"), 2.0 * np.arange(1005), atol=1e-9)
    np.testing.assert_allclose(logs[0].table("x", "y", "z")[-1], [20, 5, 10], atol=1e-3)
