"""Every sign through the complete chain, for every preset: what a command, a path, a wind does to the vehicle as it flies.

Attitudes are judged by where the matrix of the logged quaternion puts the body's axes: x forward, y left, z up.
"""

from functools import cache

import numpy as np
import pytest
from scipy.optimize import fsolve
from scipy.spatial.transform import Rotation

from quadstep.control.registry import STOCK, controllers
from quadstep.engines.fly import fly_all
from quadstep.interfaces.closed_loop import Outcome
from quadstep.interfaces.controller import Measured
from quadstep.mission.listings import load_preset
from quadstep.mission.multirotor import MultirotorMission
from quadstep.numbers import Vector
from quadstep.numbers.rotations import rotation_vector
from quadstep.vehicle.allocation import allocate
from quadstep.vehicle.rigid_body import Effects
from tests.airframes import at, fly
from tests.flights import array

PRESETS = ["crazyflie", "hummingbird", "x500", "research-2.6kg", "paper"]
AXES = ["roll", "pitch", "yaw"]
JUDGED_ELSEWHERE = ("mpc", "mppi", "raptor", *STOCK)
"""Those that hover only nearly: by noise, by a few iterations, as they were trained, or with another vehicle's gains."""

CONTROLLERS = [name for name in controllers(Measured) if name not in JUDGED_ELSEWHERE]
PACE = {"paper": 8.0}
"""How many times slower than the others a vehicle turns."""

PLACE = np.array([1.0, -2.0, 5.0])
FORWARD, LEFT, UP = np.eye(3)


# From a torque to a finite rotation


@pytest.mark.parametrize("preset", PRESETS)
@pytest.mark.parametrize(("axis", "arm", "goes"), [(0, LEFT, UP), (1, FORWARD, -UP), (2, FORWARD, LEFT)], ids=AXES)
@pytest.mark.parametrize("sign", [1.0, -1.0], ids=["+", "-"])
def test_a_torque_commanded_turns_the_vehicle_about_that_axis_as_the_right_hand_says(preset, axis, arm, goes, sign):
    geometry, _, vehicle, allocation, *_ = load_preset(preset).build()
    seconds, inertia = 0.2 * PACE.get(preset, 1.0), vehicle.inertia[axis]
    turn = sign * 0.1 * np.eye(3)[axis]  # rad
    torque = 2.0 * inertia * turn / seconds**2
    weight = vehicle.mass * vehicle.gravity
    speeds, thrust, made = allocate(geometry, allocation, weight, Vector(torque.tolist()))
    assert (thrust, list(made)) == (weight, torque.tolist())
    setting = {"vehicle": vehicle, "geometry": geometry, "effects": Effects(gyroscopic=True, drag=False)}
    turned = fly(at(speeds=speeds), list(speeds), seconds, step=seconds / 50, **setting)
    np.testing.assert_allclose(array(rotation_vector(turned.attitude)), turn, atol=1e-5)
    matrix = Rotation.from_quat(np.roll(array(turned.attitude), -1)).as_matrix()
    assert sign * (matrix @ arm) @ goes == pytest.approx(np.sin(0.1), abs=1e-5)


# From a path to the vehicle, compiled


def mission(preset, controller="geometric", move=(0.0, 0.0, 0.0), turn=0.0, seconds=1.0, **parts):
    """From rest to rest, in a time and over a distance that suit the vehicle."""
    pace = PACE.get(preset, 1.0)
    end = PLACE + 0.1 * pace * np.array(move)
    path = {"type": "minimum-jerk", "start": PLACE.tolist(), "end": end.tolist(), "duration": pace * seconds}
    return MultirotorMission.model_validate(
        {
            "vehicle": {"preset": preset},
            "path": {**path, "yaw_end": turn},
            "controller": {"type": controller},
            "simulation": {"duration": pace * seconds},
            **parts,
        }
    )


SLOW = ("dynamic-linearisation", "h-infinity-linearisation", "loop-shaping")
"""Laws whose default gains take more than a second to get there."""


@cache
def flown(preset, controller):
    """Logs of flights by name, flown together: one structure, compiled once."""
    ways = {"stay": {}, "turn left": {"turn": 0.3}, "turn right": {"turn": -0.3}}
    for name, direction in {"forward": FORWARD, "left": LEFT, "up": UP}.items():
        ways |= {name: {"move": tuple(direction)}, f"not {name}": {"move": tuple(-direction)}}
    seconds = 2.0 if preset == "crazyflie" or controller in SLOW else 1.0
    logs = fly_all([mission(preset, controller, seconds=seconds, **way).plan() for way in ways.values()])
    assert all(log.outcome is Outcome.COMPLETED for log in logs)
    return dict(zip(ways, logs, strict=True))


def axes(log):
    """Body axes in the world, shape (samples, 3, 3), the axis last."""
    return Rotation.from_quat(np.roll(log.table("q_w", "q_x", "q_y", "q_z"), -1, axis=1)).as_matrix()


USUAL = ("indi", "state-space-backstepping", "planned-lqr", "pid", "loop-shaping", "backstepping")
"""Of the laws, those whose signs `tests/test_control_real_vehicles.py` does not have, and one of each family that it has."""

CHAINS = [(preset, "geometric") for preset in PRESETS]
OTHERS = [
    pytest.param("research-2.6kg", name, marks=() if name in USUAL else pytest.mark.thorough) for name in CONTROLLERS[1:]
]
EVERY_CHAIN = pytest.mark.parametrize(("preset", "controller"), [*CHAINS, *OTHERS], ids=lambda name: name)


@EVERY_CHAIN
def test_hovering_takes_the_weight_and_nothing_moves(preset, controller):
    log, vehicle = flown(preset, controller)["stay"], load_preset(preset).build().airframe
    thrusts = log.table("f1", "f2", "f3", "f4")
    np.testing.assert_allclose(thrusts.sum(axis=1), vehicle.mass * vehicle.gravity, rtol=1e-6)
    np.testing.assert_allclose(log.table("x", "y", "z"), np.broadcast_to(PLACE, (len(log.rows), 3)), atol=1e-6)
    np.testing.assert_allclose(log.table("v_x", "v_y", "v_z", "p", "q", "r"), 0.0, atol=1e-6)


@EVERY_CHAIN
@pytest.mark.parametrize(("way", "axis", "angle"), [("forward", 0, "pitch"), ("left", 1, "roll")])
def test_to_go_there_it_leans_there_and_brakes_leaning_back(preset, controller, way, axis, angle):
    for name, sign in ((way, 1.0), (f"not {way}", -1.0)):
        log = flown(preset, controller)[name]
        lean = sign * axes(log)[:, axis, 2]  # of body z towards the goal
        logged = sign * (1 if angle == "pitch" else -1) * log.column(angle)
        np.testing.assert_allclose(np.sin(logged), lean, atol=1e-3)
        first = len(lean) // 2
        assert lean[:first].max() > 0.005
        assert lean[first:].min() < -0.005
        assert np.argmax(lean) < np.argmin(lean)
        gone = sign * (log.table("x", "y", "z")[-1] - PLACE)
        goal = 0.1 * PACE.get(preset, 1.0)
        assert gone[axis] == pytest.approx(goal, rel=0.3)
        assert np.abs(np.delete(gone, axis)).max() < 0.1 * goal


@EVERY_CHAIN
def test_to_climb_its_rotors_push_harder_and_to_sink_less(preset, controller):
    weight = load_preset(preset).mass * 9.81
    for name, sign in (("up", 1.0), ("not up", -1.0)):
        log = flown(preset, controller)[name]
        extra = sign * (log.table("f1", "f2", "f3", "f4").sum(axis=1) - weight)
        assert np.argmax(extra) < np.argmin(extra)
        assert extra.max() > 0.002 * weight
        assert sign * (log.column("z")[-1] - PLACE[2]) == pytest.approx(0.1 * PACE.get(preset, 1.0), rel=0.3)


@EVERY_CHAIN
def test_to_turn_left_its_clockwise_rotors_turn_faster_and_the_nose_goes_left(preset, controller):
    spins = np.array([mount.spin for mount in load_preset(preset).geometry().mounts])
    for name, sign in (("turn left", 1.0), ("turn right", -1.0)):
        log = flown(preset, controller)[name]
        nose = axes(log)[:, :, 0]
        assert sign * nose[-1, 1] > 0.1
        assert sign * log.column("yaw")[-1] > 0.1
        assert (sign * log.column("r")).max() > 0.1 / PACE.get(preset, 1.0)
        imbalance = sign * (log.table("f1", "f2", "f3", "f4") @ -spins)
        assert imbalance[: len(imbalance) // 2].max() > 0.0
        assert np.argmax(imbalance) < np.argmin(imbalance)


# In wind: the steady state against the balance of forces


def balance(vehicle, wind):
    """Lean against a level wind along y [rad] and thrust of one rotor [N] with which all forces cancel in hover."""
    drag, rotor, weight = vehicle.drag, vehicle.rotor, vehicle.mass * vehicle.gravity

    def left_over(unknown):
        lean, speed = unknown
        side, up = np.array([np.cos(lean), -np.sin(lean)]), np.array([np.sin(lean), np.cos(lean)])  # body y and z as (y, z)
        flow = -wind * np.array([side[0], up[0]])  # of the vehicle through the air, along body y and z
        size = abs(wind)
        along_y = -size * drag.parasitic[1] * flow[0] - 4 * speed * drag.rotor[1] * flow[0]
        along_z = -size * drag.parasitic[2] * flow[1] - 4 * speed * drag.rotor[2] * flow[1]
        lift = 4 * (rotor.thrust * speed**2 + drag.translational_lift * flow[0] ** 2)
        return along_y * side + (along_z + lift) * up - np.array([0.0, weight])

    lean, speed = fsolve(left_over, [0.0, np.sqrt(weight / (4 * rotor.thrust))], xtol=1e-13)
    return lean, rotor.thrust * speed**2


@pytest.mark.parametrize("preset", ["crazyflie", "hummingbird", "x500", "research-2.6kg"])
def test_in_wind_it_leans_as_far_as_the_forces_balance(preset):
    winds = (4.0, -4.0)
    logs = fly_all([mission(preset, seconds=8.0, wind={"mean": [0.0, wind, 0.0]}).plan() for wind in winds])
    for wind, log in zip(winds, logs, strict=True):
        lean, thrust = balance(load_preset(preset).build().airframe, wind)
        assert np.sign(lean) == -np.sign(wind)
        up = axes(log)[-1, :, 2]
        assert up[1] == pytest.approx(np.sin(lean), rel=1e-3)
        assert up[0] == pytest.approx(0.0, abs=1e-6)
        np.testing.assert_allclose(log.table("f1", "f2", "f3", "f4")[-1].mean(), thrust, rtol=1e-3)
        blown = log.column("y")[: len(log.rows) // 8] - PLACE[1]
        assert np.sign(blown[np.argmax(np.abs(blown))]) == np.sign(wind)  # at first it goes with the wind
