"""Good missions: every path and controller is built with the documented defaults; warnings come exactly when due."""

import math

import pytest

from quadstep.control.backstepping import Backstepping
from quadstep.control.nested_saturation import NestedSaturation
from quadstep.engines.fly import fingerprint
from quadstep.interfaces.closed_loop import Ticks
from quadstep.interfaces.learning import random_input_weights
from quadstep.interfaces.plant import Kinematics
from quadstep.mission.read import check_mission
from quadstep.vehicle.lagrange import Limits
from quadstep.world.paths import MinimumJerk, Orbit
from quadstep.world.pieces import Piecewise

LINE = {"type": "minimum-jerk", "end": [1.0, 2.0, 3.0], "duration": 4.0}


def plan(**sections):
    return check_mission({"path": LINE, **sections}, "test").plan()


def backstepping(**keys):
    return plan(controller={"type": "backstepping", **keys})


def nested(**keys):
    return plan(controller={"type": "nested-saturation", **keys})


def reference(path, t):
    flight = plan(path=path)
    return flight.loop.path.reference(t, flight.parameters.path)


def test_a_path_alone_makes_the_papers_vehicle_under_the_papers_controller():
    flight = plan()
    vehicle, disturbance = flight.parameters.vehicle, flight.parameters.disturbance
    assert (vehicle.mass, list(vehicle.inertia), vehicle.gravity) == (1.0, [5.0, 5.0, 5.0], 9.81)
    assert (vehicle.rotors.arm, vehicle.rotors.moment) == (0.25, 0.05)
    assert flight.loop.plant.kinematics is Kinematics.STANDARD
    assert not flight.loop.plant.rotor_limits
    assert (disturbance.scale, *disturbance.force, *disturbance.torque) == (1.0, *[0.0] * 6)
    assert flight.parameters.limits == Limits(100.0, 100.0, 1.57)
    assert flight.ticks == Ticks(0.002, (1,), 5, 2000)
    assert flight.warnings == ()


def test_the_default_gains_are_those_of_the_template():
    flight = plan()
    gains = flight.parameters.gains
    assert isinstance(flight.loop.controller, Backstepping)
    assert (gains.mass, gains.gravity, gains.filter_frequency) == (1.0, 9.81, 100.0)
    diagonals = (gains.slope_1, gains.gain_1, gains.integral_1, gains.slope_2, gains.gain_2, gains.integral_2)
    assert [list(d) for d in diagonals] == [[value] * 3 for value in (1.0, 3.0, 0.2, 15.0, 250.0, 10.0)]
    assert (gains.force_net.learning_rate, gains.force_net.damping) == (5.0, 0.01)
    assert (gains.torque_net.learning_rate, gains.torque_net.damping) == (5.0, 0.01)
    assert gains.learning_start == 0.0
    assert [list(row) for row in gains.weights_1] == [list(row) for row in gains.weights_2] == [[0.0] * 3] * 10
    assert [list(row) for row in gains.force_net.input_weights] == [list(row) for row in random_input_weights(1, 1, 10, 12)]
    assert [list(row) for row in gains.torque_net.input_weights] == [list(row) for row in random_input_weights(1, 2, 10, 9)]


def test_the_default_gains_of_the_reference_controller_are_those_of_its_scripts():
    flight = nested()
    gains = flight.parameters.gains
    assert isinstance(flight.loop.controller, NestedSaturation)
    assert (gains.mass, gains.gravity, list(gains.inertia)) == (1.0, 9.81, [5.0] * 3)
    assert list(gains.altitude) == [3.0, 0.5]
    assert list(gains.yaw) == [2.374, 0.08]
    assert list(gains.bounds) == [2.0, 1.0, 0.2, 0.1]


@pytest.mark.parametrize("gain", ["Lambda1", "K_r1", "K_i1", "Lambda2", "K_r2", "K_i2"])
def test_one_number_stands_for_three_equal_gains(gain):
    assert fingerprint([backstepping(**{gain: 7})]) == fingerprint([backstepping(**{gain: [7.0, 7.0, 7.0]})])
    assert fingerprint([backstepping(**{gain: 7.0})]) != fingerprint([backstepping(**{gain: [7.0, 7.0, 7.5]})])


def test_one_number_stands_for_three_equal_inertias():
    assert list(plan(vehicle={"inertia": 2}).parameters.vehicle.inertia) == [2.0, 2.0, 2.0]


def test_inertia_at_the_limit_of_the_triangle_inequality_is_a_flat_body_and_allowed():
    assert list(plan(vehicle={"inertia": [1.0, 2.0, 3.0]}).parameters.vehicle.inertia) == [1.0, 2.0, 3.0]
    assert list(plan(vehicle={"inertia": [0.1, 0.2, 0.3]}).parameters.vehicle.inertia) == [0.1, 0.2, 0.3]


def test_whole_numbers_are_taken_for_floats():
    flight = plan(vehicle={"mass": 2, "gravity": 10}, path={**LINE, "end": [1, 2, 3], "duration": 4})
    assert (flight.parameters.vehicle.mass, flight.parameters.vehicle.gravity) == (2.0, 10.0)


def test_the_controller_believes_the_vehicles_mass_unless_told_otherwise():
    assert plan(vehicle={"mass": 1.5}).parameters.gains.mass == 1.5
    told = plan(vehicle={"mass": 1.5}, controller={"type": "backstepping", "mass": 1.2}).parameters
    assert (told.vehicle.mass, told.gains.mass) == (1.5, 1.2)
    told = plan(vehicle={"inertia": 2.0}, controller={"type": "nested-saturation", "inertia": [1, 2, 3]}).parameters
    assert (list(told.vehicle.inertia), list(told.gains.inertia)) == ([2.0] * 3, [1.0, 2.0, 3.0])


def test_nets_that_are_off_never_start_and_late_ones_start_late():
    assert backstepping(nets={"enabled": False}).parameters.gains.learning_start == math.inf
    assert backstepping(nets={"enabled": False, "start": 2.0}).parameters.gains.learning_start == math.inf
    assert backstepping(nets={"start": 2.0}).parameters.gains.learning_start == 2.0


def test_rotor_limits_are_off_until_given():
    flight = plan(vehicle={"rotors": {"limits": [0, 8]}})
    assert flight.loop.plant.rotor_limits
    assert (flight.parameters.vehicle.rotors.minimum, flight.parameters.vehicle.rotors.maximum) == (0.0, 8.0)


def test_printed_kinematics_reach_the_plant_and_the_reference_controller():
    flight = plan(vehicle={"kinematics": "printed"}, controller={"type": "nested-saturation"})
    assert flight.loop.plant.kinematics is Kinematics.PRINTED
    assert flight.loop.controller == NestedSaturation(Kinematics.PRINTED)


def test_the_start_follows_the_path_where_it_is_left_out():
    path = {"type": "circle", "radius": 2.0, "period": 8.0, "ramp": 0.0, "centre": [1.0, 1.0, 1.0], "yaw": 0.3}
    start = plan(path=path).start
    assert list(start.position) == pytest.approx([3.0, 1.0, 1.0])
    assert list(start.velocity) == pytest.approx([0.0, math.pi / 2, 0.0])
    assert list(start.attitude) == [0.3, 0.0, 0.0]
    assert list(start.rates) == [0.0, 0.0, 0.0]


def test_the_start_is_as_given():
    given = {"position": [1, 2, 3], "velocity": [4, 5, 6], "attitude": [0.7, 0.8, 0.9], "rates": [10, 11, 12]}
    start = plan(start=given).start
    assert [list(part) for part in start] == [[1, 2, 3], [4, 5, 6], [0.7, 0.8, 0.9], [10, 11, 12]]


def test_a_start_at_zero_is_not_taken_for_one_left_out():
    path = {**LINE, "start": [5.0, 5.0, 5.0], "yaw_start": 1.0}
    start = plan(path=path, start={"position": [0, 0, 0], "attitude": [0, 0, 0], "velocity": [0, 0, 0]}).start
    assert [list(part) for part in start] == [[0.0] * 3] * 4


def test_the_clock_is_as_given_and_the_path_gives_the_duration():
    clock = {"duration": 10, "step": 0.001, "control_period": 0.004, "log_period": 0.1}
    assert plan(simulation=clock).ticks == Ticks(0.001, (4,), 100, 10000)
    assert plan(simulation={"step": 0.001}).ticks.last == 4000


def test_periods_that_only_round_off_keeps_from_being_multiples_are_taken():
    assert plan(simulation={"step": 0.1, "control_period": 0.3, "log_period": 0.7}).ticks[1:3] == ((3,), 7)


def test_the_disturbance_is_as_given():
    disturbance = plan(disturbance={"scale": 0, "force": [1, 2, 3], "torque": [4, 5, 6]}).parameters.disturbance
    assert (disturbance.scale, *disturbance.force, *disturbance.torque) == (0.0, 1, 2, 3, 4, 5, 6)


def test_minimum_jerk_goes_from_start_to_end_and_stays():
    path = {**LINE, "start": [0.5, 0.0, 0.0], "yaw_end": 1.0}
    assert isinstance(plan(path=path).loop.path, MinimumJerk)
    assert list(reference(path, 0.0).position) == [0.5, 0.0, 0.0]
    assert list(reference(path, 9.0).position) == pytest.approx([1.0, 2.0, 3.0])
    assert reference(path, 9.0).yaw == pytest.approx(1.0)
    assert list(reference({"type": "minimum-jerk", "end": [1, 0, 0], "duration": 1}, 0.0).position) == [0.0, 0.0, 0.0]


def test_waypoints_are_met_at_their_times():
    places = [(0.0, [0, 0, 0], 0.0), (2.0, [1, 0, 2], 0.5), (3.0, [1, 1, 2], 0.0), (6.0, [0, 0, 1], -1.0)]
    path = {"type": "waypoints", "waypoints": [{"t": t, "position": place, "yaw": yaw} for t, place, yaw in places]}
    assert isinstance(plan(path=path).loop.path, Piecewise)
    assert plan(path=path).ticks.last == 3000
    for t, place, yaw in places:
        assert list(reference(path, t).position) == pytest.approx(place, abs=1e-9)
        assert reference(path, t).yaw == pytest.approx(yaw, abs=1e-9)
    for t in (0.0, 6.0, 8.0):
        assert reference(path, t).velocity.norm() == pytest.approx(0.0, abs=1e-9)


def test_yaw_of_a_waypoint_is_zero_where_left_out():
    path = {"type": "waypoints", "waypoints": [{"t": 0, "position": [0, 0, 0]}, {"t": 1, "position": [1, 0, 0]}]}
    assert reference(path, 0.5).yaw == 0.0


def test_a_circle_has_its_radius_period_and_sense():
    path = {"type": "circle", "radius": 2.0, "period": 8.0, "ramp": 0.0}
    assert isinstance(plan(path=path).loop.path, Orbit)
    assert list(reference(path, 2.0).position) == pytest.approx([0.0, 2.0, 0.0])
    assert list(reference(path, 8.0).position) == pytest.approx([2.0, 0.0, 0.0])
    assert list(reference({**path, "clockwise": True}, 2.0).position) == pytest.approx([0.0, -2.0, 0.0])


def test_two_turns_and_a_ramp_of_three_seconds_are_the_default_of_closed_paths():
    assert plan(path={"type": "circle", "radius": 1.0, "period": 8.0}).ticks.last == round((16 + 1.5) / 0.002)
    path = {"type": "figure-eight", "length": 4.0, "width": 2.0, "period": 8.0}
    assert plan(path=path).ticks.last == round((16 + 1.5) / 0.002)
    assert reference(path, 0.0).velocity.norm() == 0.0
    assert plan(path={**path, "turns": 1.0, "ramp": 0.0}).ticks.last == 4000


def test_a_figure_eight_has_its_length_and_width_in_its_plane():
    path = {"type": "figure-eight", "length": 4.0, "width": 2.0, "period": 8.0, "ramp": 0.0, "centre": [1.0, 2.0, 3.0]}
    assert list(reference(path, 2.0).position) == pytest.approx([3.0, 2.0, 3.0])
    assert list(reference(path, 1.0).position) == pytest.approx([1.0 + math.sqrt(2), 3.0, 3.0])
    assert list(reference({**path, "plane": "vertical"}, 1.0).position) == pytest.approx([1.0 + math.sqrt(2), 2.0, 4.0])


@pytest.mark.parametrize("kind", ["circle", "figure-eight"])
def test_yaw_turns_along_a_closed_path(kind):
    size = {"radius": 1.0} if kind == "circle" else {"length": 2.0, "width": 1.0}
    path = {"type": kind, **size, "period": 8.0, "ramp": 0.0, "yaw": 0.5, "yaw_rate": 0.1}
    assert reference(path, 3.0).yaw == pytest.approx(0.8)
    assert reference(path, 3.0).yaw_rate == pytest.approx(0.1)


@pytest.mark.parametrize(("axis", "name"), list(enumerate("xyz")))
def test_the_theorem_asks_for_k_r1_above_m_lambda1_axis_by_axis(axis, name):
    slopes = [2.0, 2.0, 2.0]
    for gain, warned in ((3.1, False), (3.0, True), (2.9, True)):
        gains = [9.0, 9.0, 9.0]
        gains[axis] = gain
        flight = plan(vehicle={"mass": 1.5}, controller={"type": "backstepping", "Lambda1": slopes, "K_r1": gains})
        assert len(flight.warnings) == warned
        if warned:
            assert all(part in flight.warnings[0] for part in ("K_r1", f"({name})", "m Lambda1 = 3", "Theorem 5.1"))


@pytest.mark.parametrize(("axis", "name"), list(enumerate(["psi", "theta", "phi"])))
def test_the_theorem_asks_for_k_r2_above_j_m_times_the_largest_lambda2(axis, name):
    for gain, warned in ((240.1, False), (240.0, True), (1.0, True)):
        gains = [900.0, 900.0, 900.0]
        gains[axis] = gain
        controller = {"type": "backstepping", "Lambda2": [10.0, 20.0, 15.0], "K_r2": gains}
        flight = plan(vehicle={"inertia": [5.0, 6.0, 4.0]}, controller=controller)
        assert len(flight.warnings) == warned
        if warned:
            assert all(part in flight.warnings[0] for part in ("K_r2", f"({name})", "240", "Theorem 5.1"))


def test_the_condition_counts_with_the_mass_that_flies_not_the_one_the_controller_assumes():
    assert len(backstepping(mass=3.0).warnings) == 0
    controller = {"type": "backstepping", "mass": 1.0}
    assert len(plan(vehicle={"mass": 2.9}, controller=controller).warnings) == 0
    assert len(plan(vehicle={"mass": 3.0}, controller=controller).warnings) == 3


@pytest.mark.parametrize("index", [0, 1, 2])
def test_nested_bounds_must_each_be_twice_the_next(index):
    bounds = [8.0, 4.0, 2.0, 1.0]
    assert nested(bounds=bounds).warnings == ()
    bounds[: index + 1] = [bound * 0.99 for bound in bounds[: index + 1]]
    (warning,) = nested(bounds=bounds).warnings
    assert f"b_{index + 1} " in warning
    assert f"b_{index + 2} " in warning


def test_a_name_may_be_any_printable_text():
    for name in ("[red]x[/red]", "$\\alpha$", "<script>", "飛行", ""):
        assert check_mission({"name": name, "path": LINE}, "test").name == name
