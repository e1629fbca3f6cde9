"""The whole vehicle: against sums written out here over vectors, for every effect, any geometry, any kind of number."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from quadstep.numbers import Vector, flatten, vector
from quadstep.vehicle.airframe_plant import Events, Payload, RotorFault, specific_force, voltage
from quadstep.vehicle.rigid_body import Effects, Geometry, Mount
from quadstep.vehicle.rotor import Battery, Drag
from tests.airframes import ALL, NONE, PLUS, UP, airframe, at, attitude_matrix, hover_speed, random_attitude, rate_of, rotor
from tests.flights import array

TILTED = Geometry(
    tuple(
        Mount(
            (0.3 * math.cos(i), 0.2 * math.sin(i), 0.02 * i - 0.05),
            (math.sin(0.4 * i) * math.cos(2 * i), math.sin(0.4 * i) * math.sin(2 * i), math.cos(0.4 * i)),
            (-1) ** (i // 2),
        )
        for i in range(7)
    )
)
"""Seven rotors at many heights, the last ones pushing sideways and down."""

EVENTS = Events(
    (Payload(0.5, 2.0, 0.15, vector(0.1, -0.05, -0.2)), Payload(0.0, 0.9, 9.0, vector(1.0, 1.0, 1.0))),
    (RotorFault(0.3, 2.0, 0.7), RotorFault(5.0, 1.0, 0.1)),
)
WIND = np.array([3.0, -4.0, 0.5])


def cases(geometry, count=20, seed=3):
    rng = np.random.default_rng(seed)
    n = len(geometry.mounts)
    for _ in range(count):
        state = at(
            rng.uniform(0.1, 0.8, 3), 5 * rng.normal(size=3), random_attitude(rng), 3 * rng.normal(size=3),
            rng.uniform(200, 900, n), rng.uniform(0, 8000),
        )  # fmt: skip
        yield state, rng.uniform(-100, 1300, n)


def expected(geometry, vehicle, state, wanted, effects, events, wind, t):
    """(acceleration, rate of the body rates, rates of the rotors, current), by forces and torques about the centre."""
    r = Rotation.from_quat(array(state.attitude), scalar_first=True).as_matrix()
    omega, speeds = array(state.rates), array(state.speeds)
    parts = [(vehicle.mass, np.zeros(3), np.diag(array(vehicle.inertia)))]
    parts += [(p.mass, array(p.position), np.zeros((3, 3))) for p in events.payloads if p.start <= t < p.end]
    mass = sum(m for m, _, _ in parts)
    centre = sum(m * place for m, place, _ in parts) / mass
    inertia = sum(i + m * ((d := place - centre) @ d * np.eye(3) - np.outer(d, d)) for m, place, i in parts)
    one, battery, air = vehicle.rotor, vehicle.battery, vehicle.drag
    fastest, current = one.fastest, 0.0
    if effects.battery:
        power = sum(one.torque * w**3 for w in speeds) / battery.efficiency
        opened = battery.full - (battery.full - battery.empty) * state.charge / battery.capacity
        volts = max(np.roots([1.0, -opened, battery.resistance * power]))
        fastest, current = one.fastest * volts / battery.full, power / volts
    gaps = np.minimum(np.maximum(wanted, one.slowest), fastest) - speeds
    speed_rates = np.where(gaps > 0, gaps / one.rise, gaps / one.fall)

    through_air = r.T @ (array(state.velocity) - wind)
    pushes = []  # (place, force, torque)
    if effects.drag:
        pushes.append((np.zeros(3), -np.linalg.norm(through_air) * array(air.parasitic) * through_air, np.zeros(3)))
    momentum = np.zeros(3)
    for i, mount in enumerate(geometry.mounts):
        place, axis, w = np.array(mount.position), np.array(mount.axis), speeds[i]
        share = math.prod(f.efficiency for f in events.faults if f.rotor == i and t >= f.start)
        lift, reaction = one.thrust * w**2, one.torque * w**2
        force, turn = np.zeros(3), np.zeros(3)
        if effects.drag:
            v = through_air + np.cross(omega, place)
            along = (v @ axis) * axis
            lift += air.translational_lift * (v - along) @ (v - along)
            force -= w * (air.rotor[0] * (v - along) + air.rotor[2] * along)
            turn += air.flapping * w * np.cross(v, axis)
        if effects.ground:
            height = max((array(state.position) + r @ place)[2] - vehicle.ground, 0.5 * one.radius)
            lift /= 1 - (one.radius / (4 * height)) ** 2
        force, turn = share * (force + lift * axis), share * (turn - mount.spin * reaction * axis)
        if effects.gyroscopic:
            turn = turn - mount.spin * one.inertia * speed_rates[i] * axis
            momentum += mount.spin * one.inertia * w * axis
        pushes.append((place, force, turn))
    force = sum(f for _, f, _ in pushes)
    torque = sum(np.cross(place - centre, f) + turn for place, f, turn in pushes)
    alpha = np.linalg.solve(inertia, torque - np.cross(omega, inertia @ omega + momentum))
    of_centre = r @ force / mass - [0, 0, vehicle.gravity]
    of_origin = of_centre - r @ (np.cross(alpha, centre) + np.cross(omega, np.cross(omega, centre)))
    return of_origin, alpha, speed_rates, current


def switched(**on):
    return Effects(**{**dict.fromkeys(("battery", "ground", "gyroscopic", "drag"), False), **on})


@pytest.mark.parametrize("geometry", [PLUS, TILTED], ids=["plus", "tilted"])
@pytest.mark.parametrize(
    "effects",
    [NONE, ALL, Effects(), switched(battery=True), switched(ground=True), switched(gyroscopic=True), switched(drag=True)],
    ids=["none", "all", "default", "battery", "ground", "gyroscopic", "drag"],
)
@pytest.mark.parametrize("t", [0.0, 1.0, 3.0])
def test_rates_are_those_of_forces_and_torques_about_the_centre_of_gravity(geometry, effects, t):
    vehicle = airframe(ground=-0.1)
    for state, wanted in cases(geometry):
        got = rate_of(state, wanted, vehicle, geometry, EVENTS, effects, WIND, t)
        linear, angular, speed_rates, current = expected(geometry, vehicle, state, wanted, effects, EVENTS, WIND, t)
        np.testing.assert_allclose(array(got.velocity), linear, rtol=1e-10, atol=1e-10)
        np.testing.assert_allclose(array(got.rates), angular, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(array(got.speeds), speed_rates, rtol=1e-12)
        assert got.charge == pytest.approx(current, rel=1e-12)
        assert array(got.position).tolist() == array(state.velocity).tolist()


def test_the_attitude_turns_at_the_body_rates():
    for state, wanted in cases(PLUS):
        got = rate_of(state, wanted)
        h = 1e-6
        ahead = state._replace(attitude=state.attitude + h * got.attitude)
        turned = Rotation.from_rotvec(h * array(state.rates)).as_matrix()
        np.testing.assert_allclose(attitude_matrix(state).T @ attitude_matrix(ahead), turned, atol=1e-9)
        assert got.attitude @ state.attitude == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("axis", [UP, (1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.48, 0.6, 0.64), (-0.8, 0.36, 0.48), (0, 0, -1)])
def test_a_rotors_frame_is_right_handed_with_its_axis_last(axis):
    frame = array(Mount((0.1, 0.2, 0.3), axis, 1).frame)
    np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(frame) == pytest.approx(1.0)
    np.testing.assert_allclose(frame[2], axis)


def test_what_is_off_is_not_computed_even_where_its_numbers_are_missing():
    nan = math.nan
    missing = airframe(
        rotor=rotor(inertia=nan, radius=nan), drag=Drag(Vector([nan] * 3), Vector([nan] * 3), nan, nan),
        battery=Battery(*[nan] * 5), ground=nan,
    )  # fmt: skip
    state, wanted = next(cases(PLUS))
    got = rate_of(state._replace(charge=nan), wanted, missing, effects=NONE, wind=(nan, nan, nan))
    assert flatten(got) == flatten(rate_of(state, wanted, effects=NONE))


def test_a_vehicle_hovers_where_its_thrust_is_its_weight():
    for geometry in (PLUS, Geometry(tuple(mount for mount in PLUS.mounts for _ in (0, 1)))):
        vehicle = airframe()
        n = len(geometry.mounts)
        speed = hover_speed(vehicle, n)
        assert n * vehicle.rotor.thrust * speed**2 == pytest.approx(vehicle.mass * vehicle.gravity)
        got = rate_of(at(speeds=[speed] * n), speed, vehicle, geometry, effects=Effects(gyroscopic=True, drag=True))
        np.testing.assert_allclose(flatten(got), 0.0, atol=1e-12)
        above = rate_of(at(speeds=[1.05 * speed] * n), speed, vehicle, geometry)
        assert above.velocity[2] == pytest.approx(9.81 * (1.05**2 - 1))


def test_specific_force_is_what_an_accelerometer_feels():
    hovering = at(speeds=[hover_speed(airframe())] * 4)
    got = specific_force(airframe(), hovering, rate_of(hovering, 0.0))
    np.testing.assert_allclose(array(got), [0, 0, 9.81], atol=1e-12)
    falling = at(attitude=(0.5, 0.5, 0.5, 0.5), velocity=(1, 2, 3))
    np.testing.assert_allclose(array(specific_force(airframe(), falling, rate_of(falling, 0.0))), 0.0, atol=1e-12)
    on_its_side = at(attitude=(math.sqrt(0.5), math.sqrt(0.5), 0, 0))  # y up
    held = rate_of(on_its_side, 0.0)._replace(velocity=vector(0.0, 0.0, 0.0))
    np.testing.assert_allclose(array(specific_force(airframe(), on_its_side, held)), [0, 9.81, 0], atol=1e-12)
    for state, wanted in cases(PLUS, 5):  # thrust, whatever the attitude
        lift = sum(8e-6 * w * w for w in state.speeds) / 0.8
        got = specific_force(airframe(), state, rate_of(state, wanted))
        np.testing.assert_allclose(array(got), [0, 0, lift], atol=1e-10)


def test_an_accelerometer_off_the_centre_of_gravity_feels_the_turning():
    ahead = Events((Payload(0.0, 9.0, 0.8, vector(0.2, 0.0, 0.0)),))  # centre 0.1 m ahead
    spinning = at(rates=(0, 0, 5.0))
    felt = specific_force(airframe(), spinning, rate_of(spinning, 0.0, events=ahead))
    np.testing.assert_allclose(array(felt), [0.1 * 25.0, 0, 0], atol=1e-12)  # pulled towards the centre


def test_voltage_for_the_log_is_that_of_the_battery_under_load():
    vehicle = airframe()
    state = at(speeds=(500, 600, 700, 800), charge=4000.0)
    power = 1.5e-7 * sum(w**3 for w in (500, 600, 700, 800)) / 0.8
    volts = voltage(vehicle, state)
    assert volts + 0.03 * power / volts == pytest.approx(11.3, rel=1e-12)
    rate = rate_of(state, 0.0, vehicle, effects=ALL)
    assert rate.charge == pytest.approx(power / volts, rel=1e-12)
