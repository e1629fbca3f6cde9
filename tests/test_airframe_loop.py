"""The closed loop of a real vehicle: equal on every engine, each part at its own rate, with its latency and noise."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from quadstep.engines.eager import fly_floats
from quadstep.engines.fly import fly, fly_all
from quadstep.interfaces.closed_loop import Clock, Outcome
from quadstep.interfaces.controller import Command
from quadstep.numbers import Vector, flatten, leaf_names, rebuild, vector
from quadstep.numbers.rotations import yaw_pitch_roll
from quadstep.vehicle.airframe_plant import derivative, efficiencies, mass_properties, voltage
from quadstep.vehicle.allocation import allocate
from quadstep.vehicle.multirotor import Spun
from quadstep.vehicle.rigid_body import AirframeState
from tests.airframe_loops import (
    CONTROLLERS,
    ESTIMATED,
    EVERYTHING,
    GRAVITY,
    MASS,
    NEAR,
    PLAIN,
    SENSORS,
    STILL,
    SpyGains,
    everything,
    on_floats,
    on_lanes,
    plan,
    shown,
    spied,
    ticks_of,
)
from tests.array_flights import fly_arrays

# Engines


def worst(log, other, within):
    """Columns that differ by more than `within` of their largest value, or of 1."""
    assert (log.outcome, log.ended, list(log.columns)) == (other.outcome, other.ended, list(other.columns))
    assert log.rows.shape == other.rows.shape
    off = np.abs(log.rows - other.rows).max(axis=0) / np.maximum(np.abs(other.rows).max(axis=0), 1.0)
    return {name: value for name, value in zip(log.columns, off, strict=True) if not value <= within}


def flown(*usual, alone=False):
    """Every controller, some with the estimator too, which none knows of. An ordinary run has those in `usual` and, if
    `alone`, every controller without the estimator, except those that `tests/test_control_engines.py` flies on every engine.
    """
    kinds = [(name, estimator) for name in CONTROLLERS for estimator in ((False, True) if name in ESTIMATED else (False,))]
    ordinary = {*usual, *((name, False) for name in CONTROLLERS if alone and name not in ("mpc", "mppi"))}
    return pytest.mark.parametrize(
        ("controller", "estimator"),
        [pytest.param(*one, marks=() if one in ordinary else pytest.mark.thorough) for one in kinds],
    )


SOON = {
    "events": [{"type": "payload", "time": 0.02, "mass": 0.3, "position": [0.0, 0.02, -0.05]},
        {"type": "centre-of-gravity", "time": 0.01, "until": 0.05, "shift": [0.005, 0.0, 0.0]},
        {"type": "rotor", "time": 0.04, "rotor": 2, "efficiency": 0.9}],
    "wind": {**EVERYTHING["wind"], "gust": {"velocity": [0.0, 3.0, 0.0], "start": 0.02, "length": 0.04}},
}  # fmt: skip
"""Everything, but early: the events begin and end, and the gust does, within 0.06 s."""


@flown(("geometric", True), ("indi", True), alone=True)
def test_lanes_and_arrays_fly_what_floats_fly_with_everything_on(controller, estimator):
    rows = 21 if estimator else 11  # past the last event
    one = everything(controller, estimator, simulation={"duration": 0.01 * (rows - 1)}, **SOON)
    floats = on_floats(one)
    assert floats.outcome is Outcome.COMPLETED
    assert len(floats.rows) == rows
    lanes = on_lanes([one])[0]
    assert worst(lanes, floats, 0.0) == {}
    np.testing.assert_array_equal(flatten(lanes.final), [float(leaf) for leaf in flatten(floats.final)])  # NaN: not said
    others = [everything(controller, estimator, seed=seed, **SOON) for seed in (5, 3)]
    last = 60 if estimator else 15  # arrays are slow; what is late is 11 ticks late, the first events at ticks 5 and 10
    arrays = fly_arrays(one.loop, [o.parameters for o in others], [o.start for o in others], one.ticks._replace(last=last))
    cut = floats._replace(rows=floats.rows[: last // one.ticks.log + 1], ended=last * one.ticks.step)
    assert worst(arrays[1], cut, 0.0) == {}
    assert not np.array_equal(arrays[0].rows, arrays[1].rows)


@flown(("rotation-backstepping", False), ("backstepping", True), ("state-space-backstepping", False))
def test_single_precision_stays_near_double(controller, estimator):
    one = everything(controller, estimator)
    assert worst(on_lanes([one], double=False)[0], on_lanes([one])[0], NEAR.get(controller, 1e-5)) == {}


@pytest.mark.parametrize("double", [True, False], ids=["f64", "f32"])
@pytest.mark.parametrize("controller", ["rotation-backstepping"])
def test_a_flight_is_the_same_to_the_bit_in_any_batch(controller, double):
    def batch(seeds):
        vehicle = EVERYTHING["vehicle"]
        return on_lanes(
            [everything(controller, seed=seed, vehicle={**vehicle, "mass": MASS + 0.01 * seed}) for seed in seeds], double
        )

    alone = {seed: batch([seed])[0] for seed in (3, 8, 21)}
    assert len({log.rows.tobytes() for log in alone.values()}) == 3
    for seeds in ([8, 3, 21], [1, 2, 3, 4, 5, 6, 7, 8, 21]):
        for seed, log in zip(seeds, batch(seeds), strict=True):
            if seed in alone:
                assert log.rows.tobytes() == alone[seed].rows.tobytes()
                assert flatten(log.final) == flatten(alone[seed].final)


def test_it_flies_vehicles_of_other_shapes():
    vehicle = {"preset": "research-2.6kg", "layout": "hexa-x", "rotor": {"fastest": 700.0}}
    log = on_floats(plan(vehicle=vehicle, start={"position": [0.01, 0.0, 5.0]}))
    forces = log.table(*(f"f{i}" for i in range(1, 7)))
    assert log.rows.shape[1] == len(log.columns)
    assert list(log.columns).index("f6") + 1 == list(log.columns).index("wind_x")
    assert forces.sum(axis=1) == pytest.approx(MASS * GRAVITY, rel=0.05)
    assert log.column("x")[-1] < 0.01


# Seeds

NOTHING_HAPPENS = {"wind": {**EVERYTHING["wind"], "gust": None}, "events": []}


def test_seeds_change_the_noise_and_nothing_else():
    first, second = everything("geometric", seed=1), everything("geometric", seed=2)
    assert (first.loop, first.ticks, flatten(first.start)) == (second.loop, second.ticks, flatten(second.start))
    pairs = zip(leaf_names(first.parameters), flatten(first.parameters), flatten(second.parameters), strict=True)
    assert {name.partition(".")[0] for name, one, other in pairs if one != other} == {"key"}
    quiet = {"wind": {"mean": [4.0, 1.0, 0.0]}, "sensors": {"latency": 0.02}, "simulation": {"duration": 0.05}, "events": []}
    logs = [on_floats(plan(EVERYTHING, seed=seed, **quiet)) for seed in (1, 2)]
    assert logs[0].rows.tobytes() == logs[1].rows.tobytes()


def test_every_seed_has_noise_and_turbulence_of_its_own_and_keeps_them():
    short = {"simulation": {"duration": 0.05, "log_period": 0.002}, **NOTHING_HAPPENS}
    first, second, again = (on_floats(everything("geometric", seed=seed, **short)) for seed in (1, 2, 1))
    assert first.rows.tobytes() == again.rows.tobytes()
    for names in (("x_m", "y_m", "z_m"), ("wind_x", "wind_y", "wind_z"), ("x", "y", "z")):
        assert (np.abs(first.table(*names)[1:] - second.table(*names)[1:]) > 0.0).all()


def test_the_noise_of_a_seed_is_the_same_under_every_controller():
    noise = {"position_noise": 0.01, "gyro_noise": 0.01}
    setting = {"sensors": noise, "simulation": {"duration": 0.05}, **NOTHING_HAPPENS}
    logs = [on_floats(plan(EVERYTHING, controller={"type": name}, **setting)) for name in ("geometric", "pid")]
    assert not np.array_equal(logs[0].column("x"), logs[1].column("x"))
    errors, winds = ([log.table(*names) for log in logs] for names in (("x_m", "y_m", "z_m"), ("wind_x", "wind_y", "wind_z")))
    errors = [error - log.table("x", "y", "z") for error, log in zip(errors, logs, strict=True)]
    np.testing.assert_allclose(errors[0], errors[1], atol=1e-15)
    assert errors[0].std() == pytest.approx(0.01, rel=0.5)
    np.testing.assert_array_equal(winds[0], winds[1])


# Rates and order

RATES = {"step": 0.001, "control_period": 0.004, "guidance_period": 0.012, "air_period": 0.02, "log_period": 0.001}


def seen_rates(memory, measured):
    return measured.rates


def told_positions(memory, measured):
    """Along x: as the position loop was told, as the attitude loop is now."""
    return vector(memory.told[0], measured.position[0], memory.guided_at)


def changes(columns):
    """Rows at which something changes."""
    return np.flatnonzero(np.any(np.diff(columns, axis=0) != 0.0, axis=1)) + 1


def test_the_loops_run_at_their_own_rates_the_position_loop_first():
    log = on_floats(spied(simulation={**RATES, "duration": 0.1}))
    k = ticks_of(log, 0.001)
    np.testing.assert_array_equal(shown(log)[:, 0], k // 4 * 4 // 12 + 1)
    np.testing.assert_array_equal(shown(log)[:, 1], k // 4 + 1)
    np.testing.assert_allclose(shown(log)[:, 2], k // 4 * 4 // 12 * 0.012, atol=1e-12)


def test_the_sensors_and_the_air_run_at_their_own_rates():
    sensors = {"gyro_noise": 0.01, "position_noise": 0.01, "imu_period": 0.002, "fix_period": 0.006}
    wind = {"mean": [5.0, 0.0, 0.0], "turbulence": {"intensity": "light"}}
    simulation = {**RATES, "control_period": 0.001, "duration": 0.2}
    log = on_floats(spied(seen_rates, sensors=sensors, wind=wind, simulation=simulation))
    assert set(changes(log.table("x_m", "y_m", "z_m"))) == set(range(6, 201, 6))
    assert set(changes(shown(log))) == set(range(2, 201, 2))
    wind = log.table("wind_x", "wind_y", "wind_z")
    assert set(changes(wind)) == set(range(20, 201, 20))
    gusts = np.diff(wind[::20], axis=0)
    assert (gusts.min(axis=0) < 0.0).all()
    assert (gusts.max(axis=0) > 0.0).all()


def test_perfect_sensors_tell_both_loops_where_the_vehicle_is_now():
    moving = {"velocity": [3.0, 0.0, 0.0]}
    log = on_floats(spied(told_positions, start=moving, simulation={**RATES, "control_period": 0.001, "duration": 0.05}))
    x, k = log.column("x"), ticks_of(log, 0.001)
    np.testing.assert_array_equal(shown(log)[:, 1], x)
    np.testing.assert_array_equal(shown(log)[:, 0], x[k // 12 * 12])
    np.testing.assert_array_equal(log.column("x_m"), x)


@pytest.mark.parametrize(("fix", "latency"), [(0.002, 0.02), (0.004, 0.022), (0.01, 0.02), (0.01, 0.004), (0.004, 0.0)])
def test_what_the_controller_is_told_is_late(fix, latency):
    sensors = {"fix_period": fix, "latency": latency}
    simulation = {"duration": 0.1, "log_period": 0.002}
    log = on_floats(spied(start={"velocity": [3.0, -2.0, 1.0]}, sensors=sensors, simulation=simulation))
    every, late = round(fix / 0.002), round(latency / 0.002)
    spoken_of = np.maximum(ticks_of(log) // every * every - late, 0)
    for axis in "xyz":
        np.testing.assert_array_equal(log.column(f"{axis}_m"), log.column(axis)[spoken_of])
    assert log.column("x")[-1] - log.column("x_m")[-1] == pytest.approx(3.0 * (late + 50 % every) * 0.002)


def test_the_gyro_is_late_by_its_own_latency():
    gains = SpyGains(torque=vector(0.1, -0.2, 0.05))
    sensors = {"imu_period": 0.004, "imu_latency": 0.008}
    log = on_floats(spied(seen_rates, gains, sensors=sensors, simulation={"duration": 0.1, "log_period": 0.002}))
    spoken_of = np.maximum(ticks_of(log) // 2 * 2 - 4, 0)
    np.testing.assert_array_equal(shown(log), log.table("p", "q", "r")[spoken_of])
    assert (np.abs(shown(log)[-1]) > 0.01).all()


# Rotors and what becomes of a command


def told_of_the_rotors(memory, measured):
    return vector(measured.thrust, measured.torque[0], measured.torque[2])


def test_a_controller_is_told_what_the_limits_left_of_its_last_command():
    gains = SpyGains(thrust=70.0, torque=vector(1.0, 0.0, 3.0))
    one = spied(told_of_the_rotors, gains, simulation={"duration": 0.02, "log_period": 0.002})
    log = on_floats(one)
    _, thrust, torque = allocate(one.loop.plant.geometry, one.parameters.allocation, 70.0, gains.torque)
    assert thrust < 70.0
    assert torque[2] < 3.0
    np.testing.assert_array_equal(shown(log)[0], 0.0)
    np.testing.assert_allclose(shown(log)[1:], np.tile([thrust, torque[0], torque[2]], (10, 1)), rtol=1e-15)
    np.testing.assert_array_equal(log.table("u", "tau_x", "tau_y", "tau_z"), np.tile([70.0, 1.0, 0.0, 3.0], (11, 1)))
    np.testing.assert_array_equal(log.table("u_a", "tau_x_a", "tau_z_a")[:-1], shown(log)[1:])


def test_the_rotors_come_to_make_what_was_asked_for_with_their_lag():
    log = on_floats(spied(gains=SpyGains(thrust=30.0)))
    speeds = np.sqrt(log.table("f1", "f2", "f3", "f4"))
    first, last = math.sqrt(MASS * GRAVITY / 4.0), math.sqrt(30.0 / 4.0)
    t = log.column("t")
    np.testing.assert_allclose(speeds, np.tile(last + (first - last) * np.exp(-t / 0.04), (4, 1)).T, rtol=1e-7)


def test_the_vehicle_flies_as_a_solver_says_under_the_same_held_commands():
    """Wind that is steady and no event within a sample, so that everything but the state is held."""
    setting = {
        "wind": {"mean": [4.0, -3.0, 1.0]},
        "events": [{"type": "payload", "time": 0.008, "mass": 0.4, "position": [0.05, 0.02, -0.1]}],
        "start": {"attitude": [0.3, 0.02, -0.03], "rates": [0.1, -0.2, 0.3], "velocity": [0.2, 0.1, -0.1]},
        "vehicle": {"preset": "research-2.6kg", "ground": 4.9, "effects": {"battery": True, "ground": True}},
        "simulation": {"duration": 0.032, "step": 0.001, "control_period": 0.004, "log_period": 0.004},
    }
    setting["simulation"] |= {"guidance_period": 0.004, "air_period": 0.004}
    one = plan(controller={"type": "geometric"}, **setting)
    log, airframe = on_floats(one), one.parameters.airframe
    names = ("x", "y", "z", "v_x", "v_y", "v_z", "q_w", "q_x", "q_y", "q_z", "p", "q", "r")
    forces = log.table("f1", "f2", "f3", "f4")
    states = np.column_stack([log.table(*names), np.sqrt(forces / airframe.rotor.thrust)])
    assert len(states) == 9
    now = np.append(states[0], 0.0)
    events, wind, effects = one.parameters.events, vector(4.0, -3.0, 1.0), one.loop.plant.effects
    for k in range(8):
        u, *tau = log.table("u", "tau_x", "tau_y", "tau_z")[k].tolist()
        wanted, _, _ = allocate(one.loop.plant.geometry, one.parameters.allocation, u, Vector(tau))
        properties, share = mass_properties(airframe, events, 0.004 * k + 1e-6), efficiencies(events, 4, 0.0)
        assert properties.mass == (MASS if k < 2 else pytest.approx(MASS + 0.4))

        def rate(_, leaves, properties=properties, share=share, wanted=wanted):
            state = rebuild(one.start, iter(leaves.tolist()))
            return flatten(derivative(one.loop.plant.geometry, airframe, properties, share, state, wanted, wind, effects))

        now = solve_ivp(rate, (0.0, 0.004), now, method="DOP853", rtol=1e-10, atol=1e-12).y[:, -1]
        np.testing.assert_allclose(states[k + 1], now[:-1], rtol=1e-7, atol=1e-8)
    charge = log.final.state.charge
    assert charge == pytest.approx(now[-1], rel=1e-6)


def test_wind_is_that_of_the_middle_of_a_step():
    """So what it adds in a period of its swing is the sum of its middles; that of the starts would be off by half a step."""
    wind = {"swing": [0.5, 0.0, 0.0], "swing_frequency": 2.0 * math.pi / 0.2}
    vehicle = {**PLAIN["vehicle"], "drag": {"parasitic": [0.0] * 3, "rotor": [1e-4, 1e-4, 0.0]}, "effects": {"drag": True}}
    setting = {"vehicle": vehicle, "wind": wind, "simulation": {"step": 0.01, "duration": 0.2, "log_period": 0.01}}
    setting["simulation"] |= {"control_period": 0.01}
    log = on_floats(spied(**setting))
    speed = math.sqrt(MASS * GRAVITY / 4.0 / 1.9e-5)
    pull = 4.0 * 1e-4 * speed / MASS  # of air at rest, per speed [1/s]
    middles = 0.5 * np.sin(2.0 * math.pi / 0.2 * (log.column("t")[:-1] + 0.005))
    expected = [0.0]
    for middle in middles:
        expected.append(middle + (expected[-1] - middle) * math.exp(-pull * 0.01))
    np.testing.assert_allclose(log.column("v_x"), expected, atol=1e-7)
    assert np.abs(log.column("v_x")).max() > 1e-3


def test_the_attitude_stays_a_unit_quaternion():
    clock = dict.fromkeys(("step", "control_period", "guidance_period", "air_period", "log_period"), 0.01)
    log = on_floats(spied(start={"rates": [40.0, 30.0, -20.0]}, simulation={**clock, "duration": 0.3}))
    np.testing.assert_allclose(np.linalg.norm(log.table("q_w", "q_x", "q_y", "q_z"), axis=1), 1.0, atol=1e-15)


# Events


def test_a_payload_pulls_from_its_time_until_its_end():
    event = {"type": "payload", "time": 0.05, "until": 0.08, "mass": 0.661, "position": [0.0, 0.0, -0.1]}
    log = on_floats(spied(events=[event], simulation={"duration": 0.12, "log_period": 0.002}))
    acceleration = np.diff(log.column("v_z")) / 0.002
    k = ticks_of(log)[:-1]
    loaded = (k >= 25) & (k < 40)
    np.testing.assert_allclose(acceleration[loaded], -GRAVITY * 0.661 / (MASS + 0.661), rtol=1e-9)
    np.testing.assert_allclose(acceleration[~loaded], 0.0, atol=1e-9)


def test_a_centre_of_gravity_that_moves_ahead_tips_the_vehicle_forward_from_its_time_on():
    event = {"type": "centre-of-gravity", "time": 0.05, "shift": [0.01, 0.0, 0.0]}
    log = on_floats(spied(events=[event], simulation={"duration": 0.12, "log_period": 0.002}))
    q, k = log.column("q"), ticks_of(log)
    np.testing.assert_allclose(q[k <= 25], 0.0, atol=1e-12)
    np.testing.assert_allclose(np.diff(q)[25:] / 0.002, MASS * GRAVITY * 0.01 / 0.03, rtol=1e-3)


def test_a_rotor_that_loses_efficiency_lets_its_corner_down_from_its_time_on():
    event = {"type": "rotor", "time": 0.05, "rotor": 1, "efficiency": 0.8}
    log = on_floats(spied(events=[event], simulation={"duration": 0.12, "log_period": 0.002}))
    rates, k = log.table("p", "q", "r"), ticks_of(log)
    np.testing.assert_allclose(rates[k <= 25], 0.0, atol=1e-12)
    lost = 0.2 * MASS * GRAVITY / 4.0
    arm = 0.225 / math.sqrt(2.0)  # front left, turning clockwise
    expected = [-lost * arm / 0.03, lost * arm / 0.03, -lost * 0.016 / 0.05]
    np.testing.assert_allclose((rates[27] - rates[25]) / 0.004, expected, rtol=1e-3)


def test_a_controller_lifts_a_payload_and_takes_its_weight():
    event = {"type": "payload", "time": 0.2, "mass": 0.3, "position": [0.0, 0.0, -0.05]}
    clock = {"step": 0.005, "control_period": 0.005, "guidance_period": 0.01, "duration": 2.5}
    log = on_floats(plan(EVERYTHING, wind={}, sensors={}, events=[event], simulation=clock, path={**STILL, "duration": 2.5}))
    u, t = log.column("u_a"), log.column("t")
    assert u[(t > 0.1) & (t < 0.2)] == pytest.approx(MASS * GRAVITY, rel=0.01)
    assert u[-1] == pytest.approx((MASS + 0.3) * GRAVITY, rel=0.01)


# How flights end

FALLING = {
    "vehicle": {**PLAIN["vehicle"], "ground": 0.1, "rotor": {"slowest": 0.0}},
    "path": {**STILL, "start": [0.0, 0.0, 0.4], "end": [0.0, 0.0, 0.4]},
    "start": {"hovering": False},
    "simulation": {"log_period": 0.01},
}
NO_THRUST = SpyGains(thrust=0.0)
HIGH = {**STILL, "start": [0.0, 0.0, 50.0], "end": [0.0, 0.0, 50.0]}
ENDINGS = {
    "crashed": (Outcome.CRASHED, 0.248, spied(base=FALLING, gains=NO_THRUST)),  # sqrt(2 0.3 / g) = 0.2473 s
    "off path": (Outcome.OFF_PATH, 0.202, spied(base=FALLING, gains=NO_THRUST, path=HIGH, limits={"distance": 0.2})),
    "not finite": (Outcome.NOT_FINITE, 0.1, spied(base=FALLING, gains=SpyGains(breaks=0.0999), path=HIGH)),
    "spinning": (
        Outcome.SPINNING,
        0.0,
        spied(base=FALLING, gains=NO_THRUST, path=HIGH, start={"rates": [0.0, -9.0, 0.0]}, limits={"rate": 8.99}),
    ),
    "completed": (Outcome.COMPLETED, 0.3, spied(base=FALLING, gains=NO_THRUST, path=HIGH)),
}
EVERY_ENGINE = {
    "floats": lambda plans: [fly_floats(one.loop, one.parameters, one.start, one.ticks) for one in plans],
    "arrays": lambda plans: fly_arrays(
        plans[0].loop, [one.parameters for one in plans], [one.start for one in plans], plans[0].ticks
    ),
    "lanes": on_lanes,
    "f32 lanes": lambda plans: on_lanes(plans, double=False),
}


@pytest.mark.parametrize("engine", EVERY_ENGINE)
def test_a_lost_flight_ends_with_its_reason_and_time_and_harms_no_other(engine):
    logs = EVERY_ENGINE[engine]([one for _, _, one in ENDINGS.values()])
    for (outcome, ended, _), log in zip(ENDINGS.values(), logs, strict=True):
        assert log.outcome is outcome
        assert log.ended == pytest.approx(ended, abs=1e-6)
        assert np.isfinite(log.rows).all()
        assert len(log.rows) == math.ceil(round(ended / 0.01, 6)) + (outcome is Outcome.COMPLETED)
    alone = EVERY_ENGINE[engine]([ENDINGS["completed"][2]])[0]
    assert alone.rows.tobytes() == logs[-1].rows.tobytes()


def test_a_vehicle_that_is_turned_ever_faster_ends_once_its_rate_passes_the_limit():
    gains = SpyGains(torque=vector(0.0, 0.0, 0.1))
    log = on_floats(spied(gains=gains, limits={"rate": 0.3}, simulation={"log_period": 0.002, "duration": 0.3}))
    rate = log.column("r")
    assert log.outcome is Outcome.SPINNING
    assert 0.1 < log.ended < 0.3
    assert rate.max() < 0.3
    assert 2.0 * rate[-1] - rate[-2] >= 0.3
    assert log.ended == pytest.approx(log.column("t")[-1] + 0.002)


def test_a_flight_that_ends_by_a_broken_sample_keeps_the_command_before_it():
    log = on_floats(ENDINGS["not finite"][2])
    assert log.final.command.thrust == MASS * GRAVITY


def test_plans_of_many_vehicles_and_seeds_fly_together_and_come_back_in_order():
    names = ("hummingbird", "crazyflie", "hummingbird")
    setting = {"sensors": {"position_noise": 0.001}, "simulation": {"duration": 0.05}}
    plans = [spied(vehicle={"preset": name}, seed=seed, **setting) for seed, name in enumerate(names, 1)]
    logs = fly_all(plans)
    assert len({log.rows.tobytes() for log in logs}) == 3
    for one, log in zip(plans, logs, strict=True):
        assert log.rows.tobytes() == fly(one).rows.tobytes()


# The log


def test_a_row_holds_what_its_column_names_say():
    one = everything("geometric", simulation={"duration": 0.5})
    cycle = one.loop.start(one.start, one.parameters)
    state = AirframeState(
        position=vector(1.0, 2.0, 3.0),
        velocity=vector(4.0, 5.0, 6.0),
        attitude=vector(0.8, 0.36, -0.48, 0.0),
        rates=vector(7.0, 8.0, 9.0),
        speeds=vector(300.0, 400.0, 500.0, 600.0),
        charge=100.0,
    )
    command = Command(
        thrust=11.0,
        torque=vector(0.1, 0.2, 0.3),
        desired_attitude=vector(0.4, 0.5, 0.6),
        r1=vector(1.0, 2.0, 2.0),
        r2=vector(2.0, 3.0, 6.0),
        weight_norms=vector(8.0, 9.0),
    )
    cycle = cycle._replace(state=state, command=command, held=Spun(state.speeds, 12.0, vector(0.7, 0.8, 0.9)))
    row = dict(zip(one.loop.columns, one.loop.row(cycle, one.parameters, 0.25), strict=True))

    def holds(names, values):
        assert [row[name] for name in names.split()] == pytest.approx(list(values), abs=1e-14)

    reference = one.loop.path.reference(0.25, one.parameters.path)
    holds("t x y z v_x v_y v_z", [0.25, 1, 2, 3, 4, 5, 6])
    holds("q_w q_x q_y q_z p q r", [0.8, 0.36, -0.48, 0.0, 7, 8, 9])
    holds("yaw pitch roll", yaw_pitch_roll(state.attitude))
    holds("x_d y_d z_d heading_d", [*reference.position, reference.yaw])
    holds("x_m y_m z_m", one.loop.measurement(cycle, one.parameters).position)
    holds("yaw_d pitch_d roll_d u tau_x tau_y tau_z", [0.4, 0.5, 0.6, 11, 0.1, 0.2, 0.3])
    holds("u_a tau_x_a tau_y_a tau_z_a", [12, 0.7, 0.8, 0.9])
    holds("f1 f2 f3 f4", 1.9e-5 * np.array([300.0, 400.0, 500.0, 600.0]) ** 2)
    swing = math.sin(9.0 * 0.25)
    gust = 3.0 * 0.5 * (1.0 - math.cos(2.0 * math.pi * 0.15 / 0.4))
    holds("wind_x wind_y wind_z", [4.0 + swing, 1.0 + gust, 0.5 * swing])  # the turbulence has not begun
    holds("voltage norm_W1 norm_W2 norm_r1 norm_r2", [voltage(one.parameters.airframe, state), 8, 9, 3, 7])
    assert 13.0 < row["voltage"] < 16.8
    assert dict(zip(plan().loop.columns, plan().loop.row(cycle, plan().parameters, 0.0), strict=True))["voltage"] == 0.0


def test_the_clock_of_a_task_tells_its_own_period():
    told = {}
    sensors = {**SENSORS, "imu_period": 0.002, "estimator": True}
    one = plan(EVERYTHING, sensors=sensors, simulation={"duration": 0.5, "control_period": 0.004})
    cycle = one.loop.start(one.start, one.parameters)
    assert [task.name for task in one.loop.tasks] == ["air", "sensing", "fix", "guide", "law"]
    for task, every in zip(one.loop.tasks, one.ticks.every, strict=True):
        told[task.name] = round(every * one.ticks.step, 9)
        cycle, _ = task.run(cycle, one.parameters, Clock(0.0, 0.0, told[task.name]))
    assert told == {"air": 0.01, "sensing": 0.002, "fix": 0.01, "guide": 0.01, "law": 0.004}
