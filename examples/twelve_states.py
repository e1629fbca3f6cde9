"""The QUAD benchmark of the ARCH competition (verification of nonlinear systems): twelve states, and a law for its height.

Beard, "Quadrotor dynamics and control" (2008): position in the world, velocity in the body, angles (roll, pitch, yaw), body
rates. The thrust acts along the body's z axis, down; the height h is measured upwards.
"""

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

from quadstep.own import Controller, Model, Number, Outcome, Plant, Vector, believed, cos, gain, given, sin, vector, where

ZERO = vector(0.0, 0.0, 0.0)


class Numbers(NamedTuple):
    """Of the vehicle."""

    mass: Number = gain(1.4, "kg", "mass")
    gravity: Number = gain(9.81, "m/s^2", "gravity")
    inertia: Number = gain(0.054, "kg m^2", "about the x and the y axis")
    yaw_inertia: Number = gain(0.104, "kg m^2", "about the z axis")


class Limits(NamedTuple):
    """When a flight counts as lost."""

    distance: Number = gain(1000.0, "m", "from the origin")


class State(NamedTuple):
    """position: north, east, height [m]. velocity [m/s], rates [rad/s]: body axes. attitude: roll, pitch, yaw [rad]."""

    position: Vector
    velocity: Vector
    attitude: Vector
    rates: Vector


class Push(NamedTuple):
    """thrust [N], torques about x and y [N m]."""

    thrust: Number
    roll: Number
    pitch: Number


@dataclass(frozen=True)
class TwelveStates(Plant):
    """The plant."""

    name: ClassVar = "twelve-states"
    Numbers: ClassVar = Numbers
    Limits: ClassVar = Limits
    measures: ClassVar = State
    axes: ClassVar = ("x", "y", "z")
    efforts: ClassVar = {"thrust": "N", "roll": "N m", "pitch": "N m"}
    columns: ClassVar = {
        "t": "s",
        **dict.fromkeys(("x", "y", "z", "x_d", "y_d", "z_d"), "m"),
        **efforts,
    }

    def model(self, n):
        return Model(n.mass, vector(n.inertia, n.inertia, n.yaw_inertia), n.gravity, most_thrust=100.0, rotors=4)

    def begin(self, n, wanted):
        return State(ZERO, ZERO, ZERO, ZERO)

    def rest(self, state, p):
        return Push(0.0, 0.0, 0.0), ZERO

    def actuate(self, p, command):
        return vector(command.thrust, command.roll, command.pitch)

    def rate(self, p, state, held, wind, time):
        body, (u, v, w), (roll, pitch, yaw), (a, b, c) = p.vehicle, state.velocity, state.attitude, state.rates
        thrust, torque_x, torque_y = held
        sr, cr, sp, cp, sy, cy = sin(roll), cos(roll), sin(pitch), cos(pitch), sin(yaw), cos(yaw)
        across = sr * v + cr * w  # along the level line of the pitched body
        turn = (sr * b + cr * c) / cp
        gyroscopic = (body.inertia - body.yaw_inertia) / body.inertia
        return State(
            position=vector(
                cy * (cp * u + sp * across) - sy * (cr * v - sr * w),
                sy * (cp * u + sp * across) + cy * (cr * v - sr * w),
                sp * u - cp * across,
            ),
            velocity=vector(
                c * v - b * w - body.gravity * sp,
                a * w - c * u + body.gravity * cp * sr,
                b * u - a * v + body.gravity * cp * cr - thrust / body.mass,
            ),
            attitude=vector(a + sp * turn, cr * b - sr * c, turn),
            rates=vector(
                gyroscopic * (b * c) + torque_x / body.inertia, -gyroscopic * (a * c) + torque_y / body.inertia, 0.0 * c
            ),
        )

    def outcome(self, p, state, command, reference):
        far = p.limits.distance * p.limits.distance
        return where(state.position @ state.position < far, 0.0, float(Outcome.OFF_PATH))

    def error(self, state, reference):
        return reference.position - state.position

    def inputs(self, held):
        return held

    def row(self, p, state, measured, command, held, reference, wind, time):
        return [time, *state.position, *reference.position, *held]


class Gains(NamedTuple):
    """Of the law."""

    mass: Number = believed("mass")
    gravity: Number = given(lambda model: model.gravity)
    height: Number = gain(10.0, "N/m", "of the height's error")
    sink: Number = gain(3.0, "N s/m", "of the velocity downwards")


@dataclass(frozen=True)
class Height(Controller):
    """The benchmark's law: a height, and level."""

    name: ClassVar = "height"
    Gains: ClassVar = Gains
    measures: ClassVar = State

    def law(self, memory, measured, reference, gains, t, period):
        climb = gains.height * (reference.position[2] - measured.position[2]) + gains.sink * measured.velocity[2]
        (roll, pitch, _), (a, b, _) = measured.attitude, measured.rates
        return Push(gains.mass * gains.gravity + climb, -roll - a, -pitch - b), memory
