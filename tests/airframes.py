"""Small builders of real vehicles, shared by the tests."""

import numpy as np

from quadstep.engines.loop import runge_kutta_4
from quadstep.numbers import vector
from quadstep.numbers.rotations import rotation_matrix
from quadstep.vehicle.airframe_plant import Airframe, Events, derivative, efficiencies, mass_properties
from quadstep.vehicle.rigid_body import AirframeState, Effects, Geometry, Mount, renormalised
from quadstep.vehicle.rotor import Battery, Drag, RotorParameters
from tests.flights import array, column

ARM = 0.15
UP = (0.0, 0.0, 1.0)
FRONT, LEFT, REAR, RIGHT = range(4)
PLUS = Geometry(
    tuple(Mount(place, UP, spin) for place, spin in zip(
        ((ARM, 0.0, 0.0), (0.0, ARM, 0.0), (-ARM, 0.0, 0.0), (0.0, -ARM, 0.0)), (1, -1, 1, -1), strict=True
    ))
)  # fmt: skip
"""Front, left, rear, right; front and rear turn counter-clockwise seen from above."""

ALL = Effects(battery=True, ground=True, gyroscopic=True, drag=True)
NONE = Effects(battery=False, ground=False, gyroscopic=False, drag=False)
NOTHING = vector(0.0, 0.0, 0.0)
NO_DRAG = Drag(NOTHING, NOTHING, 0.0, 0.0)


def rotor(**changes):
    return RotorParameters(8e-6, 1.5e-7, 5e-5, 0.03, 0.05, 0.0, 1000.0, 0.12)._replace(**changes)


def drag():
    return Drag(column((0.02, 0.03, 0.05)), column((1e-4, 1e-4, 2e-4)), 3e-6, 2e-3)


def airframe(**changes):
    battery = Battery(12.6, 10.0, 8000.0, 0.03, 0.8)
    return Airframe(0.8, column((0.006, 0.008, 0.011)), 9.81, rotor(), drag(), battery, 0.0)._replace(**changes)


def hover_speed(vehicle, rotors=4):
    return float(np.sqrt(vehicle.mass * vehicle.gravity / (rotors * vehicle.rotor.thrust)))


def at(position=(0, 0, 10), velocity=(0, 0, 0), attitude=(1, 0, 0, 0), rates=(0, 0, 0), speeds=(0, 0, 0, 0), charge=0.0):
    parts = (column(part) for part in (position, velocity, attitude, rates, speeds))
    return AirframeState(*parts, charge=charge)


def random_attitude(rng):
    q = rng.normal(size=4)
    return q / np.linalg.norm(q)


def rate_of(state, wanted, vehicle=None, geometry=PLUS, events=None, effects=NONE, wind=(0, 0, 0), t=0.0):
    """The derivative of a vehicle whose rotors are told to turn at `wanted`: one speed for all, or one for each."""
    vehicle, events = vehicle or airframe(), events or Events()
    count = len(geometry.mounts)
    speeds = column(np.broadcast_to(wanted, count))
    share = efficiencies(events, count, t)
    return derivative(geometry, vehicle, mass_properties(vehicle, events, t), share, state, speeds, column(wind), effects)


def fly(state, wanted, seconds, step=0.002, **setting):
    """The state after a flight with the rotors told to turn at `wanted`."""
    for _ in range(round(seconds / step)):
        state = renormalised(runge_kutta_4(lambda now: rate_of(now, wanted, **setting), state, step))
    return state


def attitude_matrix(state):
    """R as an array, body to world."""
    return array(rotation_matrix(state.attitude))


def momenta(properties, motion, spin=(0, 0, 0)):
    """(linear momentum, angular momentum about the centre of gravity, kinetic energy without the rotors'), world axes."""
    r, omega, c = attitude_matrix(motion), array(motion.rates), array(properties.offset)
    velocity = array(motion.velocity) + r @ np.cross(omega, c)
    turning = array(properties.inertia) @ omega
    energy = 0.5 * properties.mass * velocity @ velocity + 0.5 * omega @ turning
    return properties.mass * velocity, r @ (turning + np.array(spin)), energy
