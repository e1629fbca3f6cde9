"""Controllers of real vehicles as laws: signs by finite rotations, rates by differences, limits, and when they learn."""

import math
from itertools import product
from operator import attrgetter
from pathlib import Path

import mpmath
import numpy as np
import pytest
from scipy.linalg import solve_continuous_are

from quadstep import fly, fly_all
from quadstep.control.filters import FilteredAttitude, LedAttitude, led_acceleration, led_filter
from quadstep.control.lqr import regulator, spectral_factor
from quadstep.control.rotation_backstepping import RotationBackstepping
from quadstep.control.vectoring import (
    clearly,
    desired_attitude,
    project,
    project_weights,
    shrink,
    tilted_within,
    up_axis,
    vee_error,
    within,
)
from quadstep.interfaces.closed_loop import Outcome
from quadstep.interfaces.controller import Measured
from quadstep.interfaces.plant import Reference
from quadstep.metrics.registry import flight_metrics
from quadstep.mission.derived import section_of
from quadstep.mission.listings import load_preset
from quadstep.mission.multirotor import MultirotorMission
from quadstep.numbers import Matrix, Vector, vector
from quadstep.numbers.rotations import IDENTITY, cross, from_rotation_vector, from_yaw_pitch_roll, rotation_matrix

ZERO = vector(0.0, 0.0, 0.0)
HERE = Reference(ZERO, ZERO, ZERO, 0.0, 0.0)
FAMILIES = ("indi-velocity", "geometric-l1", "geometric-adaptive", "adrc", "super-twisting", "flatness")
KINDS = (
    "geometric", "pid", "lqr", "rotation-backstepping", *FAMILIES, "thrust-extended-backstepping", "dynamic-linearisation",
    "h-infinity-linearisation", "loop-shaping", "nested-saturation", "hedged-backstepping", "hedged-inversion",
    "filtered-backstepping", "backstepping",
)  # fmt: skip
EXTENDED = ("thrust-extended-backstepping", "dynamic-linearisation", "h-infinity-linearisation", "loop-shaping")
"""Those whose thrust is a state, or follows from one: a sample changes its rate."""

EVERY = pytest.mark.parametrize("kind", KINDS)


def mission(kind="rotation-backstepping", vehicle="research-2.6kg", **content):
    path = {"type": "step", "start": [0.0, 0.0, 5.0], "end": [0.0, 0.0, 5.0], "duration": 6.0}
    controller = {"type": kind, **content.pop("controller", {})}
    return MultirotorMission.model_validate(
        {"vehicle": {"preset": vehicle}, "path": path, "controller": controller, **content}
    )


def asked(kind, measured=None, reference=HERE, samples=1, begin=None, **changes):
    """The command of the last of some samples, the measurement held, and the memory after it. begin: the attitude before."""
    plan = mission(kind).plan()
    law, gains = plan.loop.controller, plan.parameters.gains
    weight = plan.parameters.airframe.mass * 9.81
    known = measured or Measured(ZERO, ZERO, IDENTITY, ZERO, weight, ZERO)._replace(**changes)
    memory = law.start(known._replace(attitude=begin, rates=ZERO) if begin else known, gains)
    command = None
    for k in range(samples):
        if k % 5 == 0:
            memory = law.guide(memory, known, reference, gains, 0.002 * k, 0.01)
        command, memory = law.law(memory, known, reference, gains, 0.002 * k, 0.002)
        known = known._replace(thrust=command.thrust, torque=command.torque)
    return command, memory


@EVERY
def test_at_rest_on_the_path_it_asks_for_the_weight_and_no_torque(kind):
    command, _ = asked(kind)
    assert command.thrust == pytest.approx(2.644 * 9.81, rel=1e-9)
    assert list(command.torque) == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)


@EVERY
def test_it_turns_back_against_a_small_turn_about_any_axis(kind):
    for axis, sign in product(range(3), (1.0, -1.0)):
        turn = Vector(sign * 0.05 if i == axis else 0.0 for i in range(3))
        command, _ = asked(kind, begin=IDENTITY, attitude=from_rotation_vector(turn))
        torque = list(command.torque)
        assert sign * torque[axis] < 0.0, (axis, sign)
        assert all(abs(torque[other]) < 0.2 * abs(torque[axis]) for other in range(3) if other != axis), (axis, sign)


@EVERY
def test_it_damps_a_rate_about_any_axis(kind):
    for axis in range(3):
        command, _ = asked(kind, begin=IDENTITY, rates=Vector(0.3 if i == axis else 0.0 for i in range(3)))
        assert list(command.torque)[axis] < 0.0, axis


@EVERY
def test_a_heading_that_turns_as_its_path_is_not_braked(kind):
    turning = [HERE._replace(yaw_rate=rate) for rate in (0.0, 0.3)]
    braked, free = (asked(kind, reference=one, rates=vector(0.0, 0.0, 0.3))[0].torque[2] for one in turning)
    assert braked < 0.0
    assert abs(free) < 0.01 * abs(braked)  # a command filter is a sample ahead


@pytest.mark.parametrize(("kind", "gain"), [("pid", "rate"), ("loop-shaping", "rate_loop.proportional")])
def test_a_turning_heading_is_fed_forward_about_the_wanted_axis_or_the_body_s(kind, gain):
    plan, attitude = mission(kind).plan(), from_rotation_vector(vector(0.3, -0.2, 0.1))
    turning, still = (asked(kind, reference=HERE._replace(yaw_rate=rate), attitude=attitude)[0].torque for rate in (0.4, 0.0))
    about = vector(0.0, 0.0, 0.4)  # the wanted attitude is level here
    wanted = about if kind == "pid" else rotation_matrix(attitude).T @ about
    torque = plan.parameters.airframe.inertia * attrgetter(gain)(plan.parameters.gains) * wanted
    assert list(turning - still) == pytest.approx(list(torque), rel=1e-9)


@pytest.mark.parametrize("kind", ["rotation-backstepping", "hedged-backstepping"])
def test_the_gyroscopic_moment_is_fed_forward(kind):
    rates, inertia = vector(2.0, -1.0, 0.7), mission(kind).plan().parameters.airframe.inertia
    there, back = (asked(kind, begin=IDENTITY, rates=sign * rates)[0].torque for sign in (1.0, -1.0))
    assert np.allclose(list(0.5 * (there + back)), list(cross(rates, inertia * rates)), rtol=1e-9)


@EVERY
def test_it_pushes_harder_below_the_path_and_while_sinking(kind):
    weight, samples = 2.644 * 9.81, 100 if kind in EXTENDED else 1
    assert asked(kind, samples=samples, position=vector(0.0, 0.0, -0.2))[0].thrust > weight + 0.15
    if kind != "loop-shaping":  # it knows no velocity
        assert asked(kind, samples=samples, velocity=vector(0.0, 0.0, -0.3))[0].thrust > weight + 0.15
    assert asked(kind, samples=samples, position=vector(0.0, 0.0, 0.2))[0].thrust < weight - 0.15


@EVERY
def test_it_leans_towards_the_path_at_any_heading(kind):
    astray = {"super-twisting": 0.25, "loop-shaping": 0.12}  # which take roots axis by axis, and so bend the way there
    for yaw in (0.0, 1.0, 2.5, -2.0, 9.0):
        there = from_yaw_pitch_roll(vector(yaw, 0.0, 0.0))
        reference = HERE._replace(yaw=yaw)
        command, _ = asked(kind, reference=reference, samples=60, attitude=there, position=vector(0.0, -0.3, 0.0))
        lean = rotation_matrix(there) @ command.torque  # world axes: to move towards +y the vehicle rolls about -x
        assert lean[0] < 0.0, yaw
        assert abs(lean[1]) < astray.get(kind, 0.1) * abs(lean[0]), yaw


ANY_ATTITUDE = [(0.0, 0.0, 3.1), (0.3, 0.0, -2.9), (2.0, 1.4, 0.5), (0.0, -1.5, 0.0)]
NEAR_LEVEL = [attitude for attitude in ANY_ATTITUDE if abs(attitude[2]) < 2.0]
"""For laws that are linear about hover: not turned over."""

LINEAR, ON_ANGLES = ("lqr", "planned-lqr"), ("backstepping", "nested-saturation")
"""Laws about hover; laws on Euler angles, which are singular when the vehicle points straight up or down."""


@pytest.mark.parametrize("kind", [kind for kind in (*KINDS, "planned-lqr") if kind not in ON_ANGLES])
def test_on_the_rotation_group_it_recovers_from_any_attitude(kind):
    path = {"type": "step", "start": [0.0, 0.0, 50.0], "end": [0.0, 0.0, 50.0], "duration": 15.0}
    setting = {"path": path, "simulation": {"duration": 15.0}}
    attitudes = NEAR_LEVEL if kind in LINEAR else ANY_ATTITUDE
    starts = [{"attitude": list(attitude), "rates": [0.2, -0.3, 0.1]} for attitude in attitudes]
    logs = fly_all([mission(kind, "hummingbird", start=start, **setting).plan() for start in starts])
    for attitude, log in zip(attitudes, logs, strict=True):
        assert log.outcome is Outcome.COMPLETED, attitude
        assert np.abs(log.table("roll", "pitch")[-1]).max() < 0.1, attitude


def test_the_desired_attitude_and_its_rates_are_those_of_finite_differences():
    def force(t):
        return Vector((3.0 * math.sin(1.3 * t), 2.0 * math.cos(0.7 * t), 9.0 + math.sin(2.0 * t)))

    def yaw(t):
        return 0.4 + 0.8 * t

    def difference(f, t, h):
        return [(a - b) / (2.0 * h) for a, b in zip(f(t + h), f(t - h), strict=True)]

    def wanted(t, h=1e-4):
        rate = Vector(difference(force, t, h))
        change = Vector((a - 2.0 * b + c) / h**2 for a, b, c in zip(force(t + h), force(t), force(t - h), strict=True))
        return desired_attitude(force(t), rate, change, yaw(t), 0.8)

    t, h = 0.9, 1e-5
    now = wanted(t)
    rotation = np.array([list(row) for row in now.rotation])
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(list(up_axis(now.rotation)), list(force(t) * (1.0 / force(t).norm())), atol=1e-12)
    assert rotation[:, 0] @ [-math.sin(yaw(t)), math.cos(yaw(t)), 0.0] == pytest.approx(0.0, abs=0.35)
    ahead, behind = (np.array([list(row) for row in wanted(t + d).rotation]) for d in (h, -h))
    spin = rotation.T @ (ahead - behind) / (2.0 * h)
    np.testing.assert_allclose([spin[2, 1], spin[0, 2], spin[1, 0]], list(now.rates), atol=1e-6)
    np.testing.assert_allclose(difference(lambda s: wanted(s).rates, t, 1e-4), list(now.acceleration), atol=1e-4)


def test_the_geometric_torque_feeds_forward_a_turn_seen_from_a_turning_body():
    command, _ = asked("geometric", reference=HERE._replace(yaw_rate=0.5), rates=vector(0.2, 0.0, 0.0))
    assert list(command.torque)[1] == pytest.approx(0.03 * 0.2 * 0.5)  # J (0 - Omega x Omega_c) about y


def test_the_pid_does_not_integrate_what_it_cannot_have():
    def integral(gap, samples):
        return asked("pid", samples=samples, position=vector(0.0, 0.0, -gap))[1].outer.integral[2]

    plan = mission("pid", controller={"most_speed": 100.0}).plan()
    law, gains = plan.loop.controller, plan.parameters.gains
    far = Measured(vector(0.0, 0.0, -20.0), ZERO, IDENTITY, ZERO, 26.0, ZERO)
    memory = law.start(far, gains)
    for _ in range(200):
        memory = law.guide(memory, far, HERE, gains, 0.0, 0.01)
    assert memory.outer.force[2] == pytest.approx(0.95 * gains.outer.most_thrust)
    assert memory.outer.integral[2] < 0.0  # pulled back, where 2 s of this error would have made it bounded at 15
    assert integral(0.05, 200) > integral(0.05, 50) > 0.0


def test_the_pid_keeps_to_the_largest_speed_along_an_axis_and_the_largest_tilt():
    def force_and_speed(**keys):
        plan = mission("pid", controller=keys).plan()
        law, gains = plan.loop.controller, plan.parameters.gains
        behind = Measured(vector(-0.8, 0.1, 0.0), ZERO, IDENTITY, ZERO, 26.0, ZERO)
        outer, g = law.guide(law.start(behind, gains), behind, HERE, gains, 0.0, 0.01).outer, gains.outer
        made = np.array(list(outer.force)) / g.mass - [0.0, 0.0, g.gravity]
        asked = list(outer.integral / 0.01)  # I of the error, and twice what is made less P of the error
        error = (asked - 2.0 * made) / (np.array(list(g.velocity_integral)) - 2.0 * np.array(list(g.velocity)))
        return outer.force, list(error), list(g.position)

    force, speed, gain = force_and_speed(most_speed=100.0)
    assert speed[:2] == pytest.approx([0.8 * gain[0], -0.1 * gain[1]])
    assert math.hypot(force[0], force[1]) > 0.3 * force[2]
    lower, slower, _ = force_and_speed(most_speed=100.0, axis_speed=0.6, most_tilt=0.2)
    assert slower[:2] == pytest.approx([0.6, -0.1 * gain[1]])
    assert math.atan(math.hypot(lower[0], lower[1]) / lower[2]) == pytest.approx(0.2)
    assert lower[2] == force[2]
    assert list(force_and_speed(most_speed=100.0, most_tilt=20.0)[0]) == list(force)  # no tilt is larger than a right angle


def test_a_force_keeps_its_height_where_its_tilt_is_limited():
    assert list(tilted_within(vector(3.0, 4.0, 10.0), 0.5)) == [3.0, 4.0, 10.0]
    x, y, z = tilted_within(vector(30.0, -40.0, 10.0), math.atan(0.5))
    assert z == 10.0
    assert (x, y) == pytest.approx((3.0, -4.0))
    steep = within(vector(500.0, 0.0, -5.0), 10.0)
    assert list(tilted_within(steep, 1.5)) == list(steep)


def test_the_error_of_lee_is_the_sine_of_a_turn_about_one_axis():
    for axis in range(3):
        turn = Vector(0.4 if i == axis else 0.0 for i in range(3))
        error = vee_error(rotation_matrix(IDENTITY), rotation_matrix(from_rotation_vector(turn)))
        assert list(error) == pytest.approx([math.sin(0.4) if i == axis else 0.0 for i in range(3)])


def test_a_force_is_kept_within_reach_and_height_goes_first():
    assert list(within(vector(1.0, 2.0, 3.0), 10.0)) == [1.0, 2.0, 3.0]
    x, y, z = within(vector(30.0, -40.0, 8.0), 10.0)
    assert z == 8.0
    assert (x, y) == pytest.approx((3.6, -4.8))
    assert list(within(vector(0.0, 0.0, -5.0), 10.0)) == [0.0, 0.0, 1.0]


CHAINS = {
    "level": ([1.0, 1.0, 9.81, 1.0], [40.0, 40.0, 4.0, 1.0, 0.3], 0.002),
    "climb": ([1.0, 1.0], [20.0, 40.0, 4.0], 1.0),
    "turn": ([1.0], [40.0, 4.0], 0.4),
    "one state": ([], [9.0], 4.0),
    "weights far apart": ([0.5, 2.0, 1.62, 3.0], [300.0, 0.02, 4.0, 0.01, 1.0], 0.5),
}


@pytest.mark.parametrize("name", CHAINS)
def test_the_regulator_solves_the_riccati_equation(name):
    links, weights, price = CHAINS[name]
    a, b = np.diag(links, 1) if links else np.zeros((1, 1)), np.eye(len(weights))[-1]
    p = solve_continuous_are(a, b[:, None], np.diag(weights), np.array([[price]]))
    gains = regulator(links, weights, price)
    np.testing.assert_allclose(gains, b @ p / price, rtol=1e-10)
    assert np.linalg.eigvals(a - np.outer(b, gains)).real.max() < 0.0


@pytest.mark.parametrize("decades", [1.0, 6.0, 18.0])
def test_gains_are_right_to_the_last_digits_whatever_the_weights(decades):
    random = np.random.default_rng(4)
    for _ in range(6):
        even = (10.0 ** random.uniform(-decades, decades, 5)).tolist()
        with mpmath.workdps(200):
            coefficients = [even[i] * (-1) ** i for i in reversed(range(5))]
            squares = mpmath.polyroots([-1, *coefficients], 2000, extraprec=2000)
            wanted = [mpmath.mpf(1)]
            for square in squares:
                root = -mpmath.sqrt(square)
                root = root if mpmath.re(root) < 0 else -root
                wanted = [high - root * low for high, low in zip([0, *wanted], [*wanted, 0], strict=True)]
            wanted = [float(mpmath.re(v)) for v in wanted[:-1]]
        np.testing.assert_allclose(spectral_factor(even), wanted, rtol=2e-15)


def towards_a_turn(filtered):
    """The filter's acceleration towards 0.6 rad about y, its frequency 10 rad/s."""
    command = LedAttitude(from_rotation_vector(vector(0.0, 0.6, 0.0)), ZERO, ZERO)
    return led_acceleration(filtered, command, vector(100.0, 100.0, 100.0), vector(20.0, 20.0, 20.0))


def test_the_attitude_filter_is_critically_damped_and_ends_at_its_command():
    filtered = FilteredAttitude(IDENTITY, ZERO, ZERO)
    turned = []
    for _ in range(1000):
        filtered = led_filter(filtered, towards_a_turn(filtered), ZERO, 0.001)
        turned.append(2.0 * math.atan2(filtered.attitude[2], filtered.attitude[0]))
    t = 0.001 * np.arange(1, 1001)
    np.testing.assert_allclose(turned, 0.6 * (1.0 - (1.0 + 10.0 * t) * np.exp(-10.0 * t)), atol=5e-3)


def test_a_hedged_filter_waits_for_a_vehicle_that_cannot_follow():
    free = held = FilteredAttitude(IDENTITY, ZERO, ZERO)
    for _ in range(200):
        free = led_filter(free, towards_a_turn(free), ZERO, 0.001)
        held = led_filter(held, towards_a_turn(held), vector(0.0, 20.0, 0.0), 0.001)
    assert held.attitude[2] < 0.8 * free.attitude[2]


def test_nothing_is_learnt_or_integrated_before_take_off():
    _, idle = asked("rotation-backstepping", Measured(vector(0.3, 0.2, -0.4), ZERO, IDENTITY, ZERO, 0.0, ZERO))
    assert idle.weights_1.norm() == 0.0
    assert idle.integral_1.norm() == 0.0
    assert idle.flying == 0.0
    _, flying = asked("rotation-backstepping", samples=20, position=vector(0.3, 0.2, -0.4))
    assert flying.flying == 1.0
    assert flying.weights_1.norm() > 0.0
    assert flying.integral_1.norm() > 0.0


def test_nothing_is_learnt_from_what_the_rotors_could_not_make():
    plan = mission().plan()
    law, gains = plan.loop.controller, plan.parameters.gains
    low = Measured(vector(0.0, 0.0, -3.0), ZERO, IDENTITY, ZERO, 25.0, ZERO)
    memory = law.guide(law.start(low, gains), low, HERE, gains, 0.0, 0.01)
    command, memory = law.law(memory, low, HERE, gains, 0.0, 0.002)
    short = low._replace(thrust=0.8 * command.thrust, torque=command.torque)
    starved = law.guide(memory, short, HERE, gains, 0.01, 0.01)
    assert starved.weights_1.norm() == memory.weights_1.norm()
    assert list(starved.integral_1) == list(memory.integral_1)
    made = low._replace(thrust=command.thrust, torque=command.torque)
    assert law.guide(memory, made, HERE, gains, 0.01, 0.01).weights_1.norm() > memory.weights_1.norm()
    turned = made._replace(attitude=from_rotation_vector(vector(0.8, 0.0, 0.0)))
    command, memory = law.law(memory, turned, HERE, gains, 0.0, 0.002)
    weak = turned._replace(torque=0.5 * command.torque)
    _, after = law.law(memory, weak, HERE, gains, 0.0, 0.002)
    assert after.weights_2.norm() == memory.weights_2.norm()
    assert list(after.integral_2) == list(memory.integral_2)


def test_weights_and_integrals_keep_their_bounds_under_any_error():
    nets, bounds = {"F1": 5000.0, "F2": 5000.0}, {"weight_bounds": [3.0, 4.0], "integral_bounds": [0.5, 0.3]}
    plan = mission(controller={"nets": nets, **bounds}).plan()
    law, gains = plan.loop.controller, plan.parameters.gains
    off = Measured(vector(1.0, -1.0, -0.5), ZERO, from_rotation_vector(vector(0.2, 0.1, 0.0)), ZERO, 26.0, ZERO)
    memory = law.start(off, gains)
    for _ in range(200):
        memory = law.guide(memory, off, HERE, gains, 0.0, 0.01)
        command, memory = law.law(memory, off, HERE, gains, 0.0, 0.002)
        off = off._replace(thrust=command.thrust, torque=command.torque)
        assert memory.weights_1.norm() <= 3.0 * (1.0 + 1e-12)
        assert memory.weights_2.norm() <= 4.0 * (1.0 + 1e-12)
        assert memory.integral_1.norm() <= 0.5 * (1.0 + 1e-12)
        assert memory.integral_2.norm() <= 0.3 * (1.0 + 1e-12)
    assert memory.weights_1.norm() > 2.0


def test_projection_shortens_and_does_not_turn():
    assert list(project(vector(3.0, 0.0, 4.0), 1.0)) == pytest.approx([0.6, 0.0, 0.8])
    assert list(project(vector(0.3, 0.0, 0.4), 1.0)) == [0.3, 0.0, 0.4]
    assert project_weights(Matrix([vector(3.0, 4.0), vector(0.0, 0.0)]), 1.0).norm() == pytest.approx(1.0)


@pytest.mark.parametrize("kind", [np.float64, np.float32])
def test_what_is_clearly_within_a_bound_is_not_shortened_by_rounding(kind):
    rng, huge = np.random.default_rng(6), float(np.finfo(kind).max)
    bound = rng.choice([0.0, 1e-30, 1.0, 30.0, 0.1 * huge, huge, np.inf, -1.0], 40_000).astype(kind)
    ratio = rng.choice([0.0, 0.5, 0.9994, 0.9995, 1.0, 1.0 + 1e-7, 2.0, np.nan], 40_000).astype(kind)
    with np.errstate(all="ignore"):
        length = bound * ratio
        holds = clearly(length * length, bound)
        assert np.any(holds & (ratio > 0.999)) and not np.any(holds & (ratio > 0.9996))
        root = np.sqrt(length * length)
        np.testing.assert_array_equal(shrink(root, bound)[holds], 1.0)


def test_nets_make_up_for_a_wind_that_the_controller_knows_nothing_of():
    wind = {"mean": [8.0, 0.0, 0.0]}
    errors = {}
    for on in (True, False):
        flight = mission(controller={"nets": {"enabled": on}}, wind=wind, score_from=3.0)
        errors[on] = flight_metrics(fly(flight.plan()), 3.0)["position_rmse[m]"]
    assert errors[True] < errors[False] / 3.0


def test_loops_are_slower_on_vehicles_that_are():
    paces = {name: load_preset(name).model().agility for name in ("research-2.6kg", "crazyflie", "paper")}
    assert paces["research-2.6kg"] == 1.0
    assert paces["crazyflie"] == pytest.approx(0.043 / (0.072 + 0.003))
    assert 0.1 < paces["paper"] < 0.3
    built = section_of(RotationBackstepping)(type="rotation-backstepping").build(load_preset("crazyflie"), Path())
    assert built.gains.gain_1[0] == pytest.approx(4.9 * paces["crazyflie"])
    assert built.gains.coupling[0] == pytest.approx(31.0 * paces["crazyflie"] ** 2)
    assert built.gains.force_net.learning_rate == pytest.approx(2.5 * paces["crazyflie"] ** 2)


def test_a_part_of_the_nets_keys_leaves_the_others_as_they_were():
    built = mission(controller={"nets": {"neurons": 4}}).plan().parameters.gains
    assert built.force_net.damping == 0.06
    assert len(built.weights_1) == 4


PLACE = [0.0, 0.0, 5.0]
PATHS = {
    "hover": ({"type": "step", "start": PLACE, "end": PLACE, "duration": 6.0}, 1e-3),
    "vertical eight": (
        {
            "type": "figure-eight",
            "plane": "vertical",
            "length": 2.5,
            "width": 1.5,
            "period": 6.283,
            "turns": 9.0,
            "centre": PLACE,
        },
        0.06,
    ),
    "fast circle": ({"type": "circle", "radius": 2.0, "period": 4.0, "turns": 9.0, "ramp": 2.0, "centre": PLACE}, 0.26),
}
"""With the error that is allowed [m]; the circle is flown at 3.1 m/s, which takes a lean of 26 degrees."""


@pytest.mark.parametrize("vehicle", ["research-2.6kg", "crazyflie", "x500"])
@pytest.mark.parametrize("kind", [*FAMILIES, "indi"])
def test_with_usual_gains_it_flies_small_and_large_vehicles(kind, vehicle):
    clock = {"simulation": {"duration": 6.0}, "score_from": 3.0}
    size = {"length": 1.25, "width": 0.75} if vehicle == "crazyflie" else {}  # of its eight
    paths = [{**path, **size} if "plane" in path else path for path, _ in PATHS.values()]
    flights = [mission(kind, vehicle, path=path, **clock) for path in paths]
    for flight, (_, allowed) in zip(fly_all(flights), PATHS.values(), strict=True):
        assert flight.outcome is Outcome.COMPLETED
        assert flight.metrics()["position_rmse[m]"] < allowed
