"""Payloads and faults: their weight, their times, and the direction of their effect."""

import numpy as np
import pytest

from quadstep import Mission
from quadstep import fly as fly_mission
from quadstep.mission.listings import load_preset
from quadstep.numbers import vector
from quadstep.vehicle.airframe_plant import Events, Payload, RotorFault, efficiencies, mass_properties
from quadstep.vehicle.rigid_body import Effects
from tests.airframes import airframe, at, attitude_matrix, fly, hover_speed, rate_of
from tests.flights import array

VEHICLE = airframe()
HOVER = hover_speed(VEHICLE)


def brute_inertia(points):
    """(mass, centre, inertia about it) of point masses."""
    masses, places = np.array([m for m, _ in points]), np.array([p for _, p in points])
    centre = masses @ places / masses.sum()
    inertia = sum(m * (d @ d * np.eye(3) - np.outer(d, d)) for m, d in zip(masses, places - centre, strict=True))
    return masses.sum(), centre, inertia


def bare(vehicle):
    """Six point masses with the vehicle's mass and inertia."""
    x, y, z = array(vehicle.inertia)
    spread = np.sqrt(np.array([y + z - x, z + x - y, x + y - z]) / 2 / (vehicle.mass / 3))
    return [(vehicle.mass / 6, sign * r * axis) for r, axis in zip(spread, np.eye(3), strict=True) for sign in (1, -1)]


def test_mass_centre_and_inertia_are_those_of_all_the_point_masses():
    events = Events(
        (
            Payload(0.0, 5.0, 0.3, vector(0.1, -0.2, 0.05)),
            Payload(2.0, 9.0, 0.1, vector(-0.3, 0.1, -0.2)),
            Payload(8.0, 9.0, 7.0, vector(1.0, 1.0, 1.0)),
        )
    )
    for t, present in [
        (-0.1, ()),
        (0.0, (0,)),
        (1.9, (0,)),
        (2.0, (0, 1)),
        (4.9, (0, 1)),
        (5.0, (1,)),
        (8.5, (1, 2)),
        (9.0, ()),
    ]:
        points = bare(VEHICLE) + [(events.payloads[i].mass, array(events.payloads[i].position)) for i in present]
        mass, centre, inertia = brute_inertia(points)
        got = mass_properties(VEHICLE, events, t)
        assert got.mass == pytest.approx(mass)
        np.testing.assert_allclose(array(got.offset), centre, atol=1e-15)
        np.testing.assert_allclose(array(got.inertia), inertia, atol=1e-14)


def test_without_payloads_the_vehicle_is_as_it_is():
    got = mass_properties(VEHICLE, Events(), 3.0)
    assert got.mass == 0.8
    assert array(got.offset).tolist() == [0, 0, 0]
    assert array(got.inertia).tolist() == np.diag([0.006, 0.008, 0.011]).tolist()


@pytest.mark.parametrize(
    ("place", "arm"), [((0.1, 0, 0), (0, 1)), ((-0.1, 0, 0), (0, -1)), ((0, 0.1, 0), (1, 1)), ((0, -0.1, 0), (1, -1))]
)
def test_a_payload_pulls_its_side_down(place, arm):
    axis, sign = arm
    events = Events((Payload(0.0, 9.0, 0.1, vector(*map(float, place))),))
    end = fly(at(speeds=[HOVER] * 4), HOVER, 0.2, events=events)
    r = attitude_matrix(end)
    assert sign * r[2, axis] < -0.05
    assert abs(r[2, 1 - axis]) < 1e-9
    assert end.velocity[2] < -0.1


def test_a_payload_does_not_turn_a_vehicle_that_falls_freely():
    events = Events((Payload(0.0, 9.0, 0.3, vector(0.1, 0.2, -0.1)),))
    got = rate_of(at(), 0.0, events=events)
    np.testing.assert_allclose(array(got.rates), 0.0, atol=1e-12)
    np.testing.assert_allclose(array(got.velocity), [0, 0, -9.81], atol=1e-12)


def test_hanging_a_payload_below_the_centre_needs_more_thrust_and_nothing_else():
    events = Events((Payload(0.0, 9.0, 0.2, vector(0.0, 0.0, -0.3)),))
    speed = HOVER * np.sqrt(1.25)
    got = rate_of(at(speeds=[speed] * 4), speed, events=events, effects=Effects())
    np.testing.assert_allclose(array(got.velocity), 0.0, atol=1e-12)
    np.testing.assert_allclose(array(got.rates), 0.0, atol=1e-12)


def test_faults_begin_at_their_time_and_multiply_on_one_rotor():
    events = Events(faults=(RotorFault(1.0, 2.0, 0.8), RotorFault(3.0, 2.0, 0.5), RotorFault(2.0, 0.0, 0.9)))
    for t, wanted in [(0.9, (1, 1, 1, 1)), (1.0, (1, 1, 0.8, 1)), (2.5, (0.9, 1, 0.8, 1)), (3.0, (0.9, 1, 0.4, 1))]:
        assert array(efficiencies(events, 4, t)).tolist() == pytest.approx(wanted)
    assert array(efficiencies(Events(), 6, 1.0)).tolist() == [1] * 6


FALTERING = {"type": "rotor", "time": 0.5, "rotor": 1, "efficiency": 0.5}


def hovering(*events, metrics=()):
    path = {"type": "step", "start": [0.0, 0.0, 5.0], "end": [0.0, 0.0, 5.0], "duration": 4.0}
    return fly_mission(
        Mission(vehicle={"preset": "x500"}, path=path, events=events, metrics=metrics,
                controller={"type": "rotation-backstepping"})
    )  # fmt: skip


def test_a_failing_rotors_logged_thrust_is_what_it_makes():
    """The logged thrusts, not those of whole rotors, carry the weight and give the momentum."""
    flight = hovering(FALTERING)
    weight = load_preset("x500").mass * 9.81
    made, whole = flight.table("f1", "f2", "f3", "f4"), flight.table("f1_whole", "f2_whole", "f3_whole", "f4_whole")
    t, q_x, q_y, v_z = flight.table("t", "q_x", "q_y", "v_z").T
    before, upward = t < 0.499, 1.0 - 2.0 * (q_x**2 + q_y**2)
    needed = weight * (t[-1] + (v_z[-1] - v_z[0]) / 9.81)
    assert np.trapezoid(made.sum(axis=1) * upward, t) == pytest.approx(needed, rel=0.01)
    assert np.trapezoid(whole.sum(axis=1) * upward, t) > 1.15 * needed
    np.testing.assert_array_equal(made[before], whole[before])
    np.testing.assert_array_equal(made[~before], whole[~before] * [0.5, 1.0, 1.0, 1.0])


def test_energy_and_the_margin_count_the_speed_of_a_failing_rotor():
    flight, sound = hovering(FALTERING, metrics=["energy"]), hovering(metrics=["energy"])
    forces = flight.table("f1_whole", "f2_whole", "f3_whole", "f4_whole")
    power = (forces**1.5).sum(axis=1)
    hover = (sound.table("f1", "f2", "f3", "f4") ** 1.5).sum(axis=1)
    ratio = np.trapezoid(power, flight.column("t")) / np.trapezoid(hover, sound.column("t"))
    assert ratio > 1.1
    assert flight.metrics()["energy[J]"] / sound.metrics()["energy[J]"] == pytest.approx(ratio, rel=1e-3)
    most = float(load_preset("x500").build().allocation.most)
    assert flight.metrics()["largest_thrust_share"] == pytest.approx(forces.sum(axis=1).max() / (4.0 * most), rel=1e-9)
    assert not [name for name in sound.columns if name.endswith("_whole")]
