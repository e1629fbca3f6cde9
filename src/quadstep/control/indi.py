"""Incremental nonlinear dynamic inversion: Smeur, Chu, de Croon (2016, doi 10.2514/1.G001490) of the attitude; Tal and
Karaman, "Accurate tracking of aggressive quadrotor trajectories using incremental nonlinear dynamic inversion and differential
flatness" (2018) of both loops.

What was felt already holds every force and torque that nobody modelled. The law only says by how much to change what the
rotors make, both filtered alike (index f) so that they are equally old:

    force  = m (a_wanted + g e3) + (made_f - m felt_f),     torque = made_f + J (W_dot_wanted - W_dot_f)

`indi` feels with the accelerometer and knows from the rotors' speeds what they make. `indi-velocity` has neither: it
differentiates the velocity, and believes that the rotors follow their commands with a lag of first order.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

from quadstep.control.vectoring import (
    ZERO,
    AchievedCommand,
    BelievedBody,
    Pull,
    Turn,
    at_rest,
    attitude_for,
    commanded,
    errors_to,
    followed,
    force_for,
    lagged,
    of_speeds,
    pulled,
    turned,
    up_axis,
)
from quadstep.interfaces.controller import Command, Controller, Measured
from quadstep.interfaces.gain import gain, given, usual
from quadstep.interfaces.plant import Reference
from quadstep.numbers import Number, Vector, vector
from quadstep.numbers.rotations import rotation_matrix


class IndiGains(NamedTuple):
    """The vehicle parameters that the controller assumes, and its gains.

    per_speed [N s^2], mixing [1, m]: as in `Model`, thrust over squared speed, and thrust and torque over each rotor's thrust.
    """

    body: BelievedBody
    pull: Pull
    turn: Turn
    force_filter: Number = gain(usual(10.5, 1), "rad/s", "cut-off of the filters of applied and measured force")
    torque_filter: Vector = gain(
        usual((31.0, 31.0, 31.0), 1, "body"), "rad/s", "cut-off of the two-stage filters of torque and angular acceleration"
    )
    per_speed: Number = given(lambda model: model.per_speed)
    mixing: tuple[Vector, ...] = given(lambda model: model.mixing)


class IndiMemory(NamedTuple):
    """made: by the rotors. All else is filtered. pushed: their force over mass, felt: the specific force [m/s^2], world, or
    the velocity [m/s]. Each once and twice: rates [rad/s] and torque [N m], body axes.
    """

    made: AchievedCommand
    pushed: Vector
    felt: Vector
    rates: tuple[Vector, Vector]
    torque: tuple[Vector, Vector]


@dataclass(frozen=True)
class Indi(Controller):
    """Runs both loops at the attitude loop's rate, with accelerometer and rotor speeds."""

    name = "indi"
    label = "INDI"
    source = "Smeur, Chu, de Croon 2016; Tal and Karaman 2018"
    Gains = IndiGains
    also_measures: ClassVar[tuple[str, ...]] = ("specific_force", "rotor_speeds")
    defaults: ClassVar[Mapping[str, object]] = {
        "pull.stiffness": usual(15.8, 2),
        "pull.damping": usual(6.8, 1),
        "turn.stiffness": usual((148.0, 148.0, 70.0), 2, "body"),
        "turn.damping": usual((24.9, 24.9, 15.0), 1, "rate"),
    }

    def start(self, measured: Measured, gains: IndiGains) -> IndiMemory:
        """At rest: the weight was made and felt."""
        weight, rates = vector(0.0, 0.0, gains.body.gravity), measured.rates
        felt = weight if feels(measured) else measured.velocity
        return IndiMemory(at_rest(gains.body), weight, felt, (rates, rates), (ZERO, ZERO))

    def enter(self, measured: Measured, reference: Reference, gains: IndiGains) -> IndiMemory:
        """All filters have settled."""
        made, rates, rotation = commanded(measured), measured.rates, rotation_matrix(measured.attitude)
        pushed = (made.thrust / gains.body.mass) * up_axis(rotation)
        late = measured.velocity - (1.0 / gains.force_filter) * reference.acceleration
        felt = rotation @ measured.specific_force if feels(measured) else late
        return IndiMemory(made, pushed, felt, (rates, rates), (made.torque, made.torque))

    def law(
        self, memory: IndiMemory, measured: Measured, reference: Reference, gains: IndiGains, t: Number, period: Number
    ) -> tuple[Command, IndiMemory]:
        body, axis = gains.body, up_axis(rotation_matrix(measured.attitude))
        made = self.made(memory, measured, gains, t, period)
        share = followed(gains.force_filter, period)
        pushed = memory.pushed + share * ((made.thrust / body.mass) * axis - memory.pushed)
        if feels(measured):
            felt = memory.felt + share * (rotation_matrix(measured.attitude) @ measured.specific_force - memory.felt)
            missing = pushed - felt
        else:
            felt = memory.felt + share * (measured.velocity - memory.felt)
            missing = pushed - (gains.force_filter * (measured.velocity - felt) + vector(0.0, 0.0, body.gravity))
        force = force_for(pulled(measured, reference, gains.pull) + missing, body)

        attitude = attitude_for(force, reference, body.mass)
        errors = errors_to(attitude, measured)
        turn_share = Vector(followed(rate, period) for rate in gains.torque_filter)
        rates, torque = twice(memory.rates, measured.rates, turn_share), twice(memory.torque, made.torque, turn_share)
        turning = (rates[1] - memory.rates[1]) * (1.0 / period)
        command = Command(force @ axis, torque[1] + body.inertia * (turned(errors, gains.turn) - turning), attitude.angles)
        return command, IndiMemory(made, pushed, felt, rates, torque)

    def made(self, memory: IndiMemory, measured: Measured, gains: IndiGains, t: Number, period: Number) -> AchievedCommand:
        if len(measured.rotor_speeds):
            return of_speeds(measured.rotor_speeds, gains.per_speed, gains.mixing)
        return lagged(memory.made, measured, gains.body.lag, t, period)


@dataclass(frozen=True)
class IndiVelocity(Indi):
    """INDI without accelerometer and rotor speeds: it differentiates velocity and assumes the rotors' lag."""

    name = "indi-velocity"
    label = "INDI, no accelerometer"
    also_measures = ()
    defaults: ClassVar[Mapping[str, object]] = {
        "pull.stiffness": usual(13.5, 2),
        "pull.damping": usual(7.9, 1),
        "turn.stiffness": usual((118.0, 118.0, 67.0), 2, "body"),
        "turn.damping": usual((29.5, 29.5, 13.4), 1, "rate"),
        "force_filter": usual(13.0, 1),
        "torque_filter": usual((9.0, 9.0, 15.1), 1, "body"),
    }


def feels(measured: Measured) -> bool:
    """Whether there is an accelerometer, which is structure."""
    return len(measured.specific_force) > 0


def twice(filtered: tuple[Vector, Vector], value: Vector, share: Vector) -> tuple[Vector, Vector]:
    """A low-pass filter after another, one period on."""
    once = filtered[0] + share * (value - filtered[0])
    return once, filtered[1] + share * (once - filtered[1])
