"""The predictor: dead reckoning against SciPy, and flights with a late fix that equal those without the delay."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from quadstep import Mission, fly
from quadstep.control.geometric import Geometric
from quadstep.control.indi import Indi
from quadstep.control.predictor import ImuSample, MeasuredMotion, Predicting, predicted, predicting
from quadstep.control.registry import controllers
from quadstep.interfaces.closed_loop import Outcome
from quadstep.interfaces.controller import Measured
from quadstep.io.errors import UserError
from quadstep.numbers import Vector, vector
from tests.random_samples import UP, any_vector, rotation_of

PERIOD, GRAVITY = 0.002, 9.7


def known_of(random):
    attitude = Rotation.from_rotvec(random.normal(0.0, 1.0, 3)).as_quat()
    return MeasuredMotion(any_vector(random, 1.0), any_vector(random, 2.0), Vector(map(float, np.roll(attitude, 1))))


def reckoned(known, steps):
    """Through (rates, force, seconds), each held, the force in the attitude half-way."""
    position, velocity, rotation = np.array(list(known.position)), np.array(list(known.velocity)), rotation_of(known.attitude)
    for rates, force, h in steps:
        half = Rotation.from_rotvec(0.5 * h * rates).as_matrix()
        acceleration = rotation @ half @ force - GRAVITY * UP
        position = position + h * velocity + acceleration * h**2 / 2.0
        velocity = velocity + h * acceleration
        rotation = rotation @ half @ half
    return position, velocity, rotation


def same(found, wanted, tolerance=1e-12):
    np.testing.assert_allclose(list(found.position), wanted[0], atol=tolerance)
    np.testing.assert_allclose(list(found.velocity), wanted[1], atol=tolerance)
    np.testing.assert_allclose(rotation_of(found.attitude), wanted[2], atol=tolerance)
    assert found.attitude.norm() == pytest.approx(1.0, abs=1e-14)


@pytest.mark.parametrize("late", [0.0, 0.004])
@pytest.mark.parametrize("age", [0.0, 0.003, 0.0074, 0.013])
def test_it_goes_through_the_samples_since(age, late):
    """Times on a grid, but the last sample comes 1 ms after the one before it, as for a slower loop between two samples."""
    random = np.random.default_rng(5)
    times = [0.990, 0.992, 0.994, 0.996, 0.998, 1.000, 1.001]
    samples = [ImuSample(any_vector(random, 3.0), any_vector(random, 9.0), t) for t in times]
    known = known_of(random)
    steps, left = [], max(0.0, age - late)
    for older, newer in zip(samples[-2::-1], samples[:0:-1], strict=True):
        h = min(left, newer.time - older.time)
        rates, force = (np.mean([list(older[k]), list(newer[k])], axis=0) for k in (0, 1))
        steps.insert(0, (rates, force, h))
        left -= h
    steps.append((np.array(list(samples[-1].rates)), np.array(list(samples[-1].force)), min(age, late)))
    same(predicted(samples[:-1], samples[-1], known, age, late, GRAVITY), reckoned(known, steps))


def test_it_follows_the_equations_of_motion():
    def rates(t):
        return np.array([3.0 * np.sin(20.0 * t), 2.0 * np.cos(15.0 * t), 1.0 + t])

    def force(t):
        return np.array([np.sin(9.0 * t), np.cos(11.0 * t), 10.0 + 2.0 * np.sin(7.0 * t)])

    def motion(t, x):
        rotation = x[6:].reshape(3, 3)
        hat = np.cross(np.eye(3), rates(t))
        return np.concatenate([x[3:6], rotation @ force(t) - GRAVITY * UP, (rotation @ hat).ravel()])

    known = known_of(np.random.default_rng(2))
    begin = np.concatenate([list(known.position), list(known.velocity), rotation_of(known.attitude).ravel()])
    end = solve_ivp(motion, (0.96, 1.0), begin, rtol=1e-10, atol=1e-12).y[:, -1]
    samples = [ImuSample(Vector(rates(t)), Vector(force(t)), t) for t in 1.0 - PERIOD * np.arange(20, -1, -1)]
    found = predicted(samples[:-1], samples[-1], known, 0.04, 0.0, GRAVITY)
    same(found, (end[:3], end[3:6], end[6:].reshape(3, 3)), 2e-5)


def test_it_goes_no_further_back_than_to_the_start():
    known, sample = (
        known_of(np.random.default_rng(4)),
        ImuSample(any_vector(np.random.default_rng(1), 3.0), vector(0.0, 0.0, 9.0), 0.0),
    )
    for late in (0.0, 0.02):
        same(predicted((sample,) * 5, sample, known, 0.02, late, GRAVITY), reckoned(known, []))


FLIGHT = {
    "vehicle": {"preset": "research-2.6kg"},
    "path": {"type": "circle", "radius": 2.0, "period": 5.0, "centre": [0.0, 0.0, 5.0], "turns": 50.0, "ramp": 3.0},
    "simulation": {"duration": 6.0},
    "score_from": 3.0,
}
LATE = {"latency": 0.02, "fix_period": 0.004}


def flight(kind, sensors, **changes):
    return fly(Mission(**{**FLIGHT, **changes}, controller={"type": kind}, sensors=sensors))


@pytest.mark.parametrize("kind", ["geometric", "pid", "flatness", "indi"])
def test_a_late_fix_is_as_good_as_one_that_is_not(kind):
    there, late, ahead = (flight(kind, one) for one in ({}, LATE, {**LATE, "predictor": True}))
    np.testing.assert_allclose(ahead.rows[:, 1:4], there.rows[:, 1:4], atol=2e-4)
    assert np.abs(late.rows[:, 1:4] - there.rows[:, 1:4]).max() > 5e-3


def test_loops_at_any_rate_are_told_what_is_predicted():
    clock = {"duration": 4.0, "control_period": 0.004, "guidance_period": 0.01}
    sensors = {"latency": 0.04, "fix_period": 0.02, "imu_period": 0.002, "predictor": True}
    there, ahead = (flight("pid", one, simulation=clock, score_from=1.0) for one in ({"imu_period": 0.002}, sensors))
    np.testing.assert_allclose(ahead.rows[:, 1:4], there.rows[:, 1:4], atol=5e-4)


NOISY = {**LATE, "position_noise": 0.002, "gyro_noise": 0.002}
ESTIMATED = {"estimator": True, "imu_latency": 0.004}
COVERING = [("pid", NOISY), ("flatness", ESTIMATED), ("indi", NOISY)]
OTHERS = [("pid", ESTIMATED), ("flatness", NOISY), ("indi", ESTIMATED)]


@pytest.mark.parametrize(("kind", "sensors"), [*COVERING, *(pytest.param(*one, marks=pytest.mark.thorough) for one in OTHERS)])
def test_engines_agree(kind, sensors):
    mission = Mission(**{**FLIGHT, "simulation": {"duration": 0.3}, "score_from": 0.0}, controller={"type": kind},
                      sensors={**sensors, "predictor": True})  # fmt: skip
    lanes, floats = fly(mission), fly(mission, engine="python")
    assert lanes.outcome is Outcome.COMPLETED
    np.testing.assert_array_equal(lanes.rows, floats.rows)


def plan(kind="geometric", **sensors):
    return Mission(**FLIGHT, controller={"type": kind}, sensors={"predictor": True, **sensors}).plan()


def test_a_controller_is_told_what_it_asks_for_and_no_more():
    asked = []

    class Curious(Geometric):
        def law(self, memory, measured, reference, gains, t, period):
            asked.append(measured)
            return super().law(memory, measured, reference, gains, t, period)

    built = plan(**LATE)
    wrapped = predicting(Curious)(Curious(), 3, 0.0, 9.81)
    zero, level = vector(0.0, 0.0, 0.0), vector(1.0, 0.0, 0.0, 0.0)
    told = Measured(zero, zero, level, zero, 20.0, zero, vector(0.0, 0.0, 9.81), age=0.02)
    memory = wrapped.start(told, built.parameters.gains)
    assert len(memory.past) == 3
    wrapped.law(memory, told, built.loop.reference(0.0, built.parameters), built.parameters.gains, 0.1, PERIOD)
    assert len(asked[0].specific_force) == 0
    assert np.isnan(asked[0].age)
    assert wrapped.also_measures == ("specific_force", "age")
    assert predicting(Indi).also_measures == ("specific_force", "rotor_speeds", "age")


def test_its_memory_is_as_long_as_a_fix_can_be_old():
    assert plan().loop.controller.samples == 0
    assert plan(**LATE).loop.controller.samples == 11  # 20 ms, and the fix is 2 ms older before the next comes
    assert plan(latency=0.02, imu_latency=0.004).loop.controller.samples == 8
    assert plan(estimator=True, imu_latency=0.004).loop.controller.samples == 0
    assert plan(estimator=True, imu_latency=0.004).loop.controller.board_late == 0.004


def test_another_controller_in_its_place_has_the_predictor_too():
    built = plan(**LATE)
    other = built.with_controller(controllers(Measured)["pid"](), ())
    assert isinstance(other.loop.controller, Predicting)
    assert type(other.loop.controller.flown) is controllers(Measured)["pid"]
    assert other.loop.controller.unwrapped is other.loop.controller.flown


def test_a_function_of_the_users_flies_with_it(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.py").write_text(
        "def controller(t, measured, reference):\n"
        "    push = 9.81 + 10.0 * (reference.position[2] - measured.position[2]) - 5.0 * measured.velocity[2]\n"
        "    return 2.644 * push, tuple(-0.2 * measured.rates)\n"
    )
    climb = {"type": "step", "start": [0.0, 0.0, 2.0], "end": [0.0, 0.0, 3.0], "duration": 2.0}
    there, late, ahead = (
        flight("mine.py:controller", one, path=climb, simulation={"duration": 2.0}, score_from=0.0)
        for one in ({}, LATE, {**LATE, "predictor": True})
    )
    np.testing.assert_allclose(ahead.column("z"), there.column("z"), atol=2e-4)
    assert np.abs(late.column("z") - there.column("z")).max() > 2e-3


def test_more_samples_than_it_can_go_through_are_refused():
    with pytest.raises(UserError, match=r"sensors.predictor: .* 150 controller samples.* at most 128"):
        plan(latency=0.3)
