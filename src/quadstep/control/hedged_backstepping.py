"""Adaptive neural backstepping with a target of its own and hedging: `rotation_backstepping.py` with known actuators.

What the paper's law cannot know is left out of what it tracks (Johnson and Kannan 2005, the paper's [17]):

- the target of r1 (Eq. 12) is a reference model of the position, which follows the path as the loop itself would, reduced by
  the force that thrust and attitude do not yet produce;
- the command filter of the attitude knows how the path turns the force, and is reduced by the torque that the lagging rotors
  do not yet produce.

Errors are then free of lags and limits, so gains and learning rates may be several times higher before the loop shakes.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

from quadstep.control.filters import LedAttitude, led_acceleration, led_filter
from quadstep.control.rotation_backstepping import (
    FORCE_INPUTS,
    TORQUE_INPUTS,
    RotationBackstepping,
    RotationGains,
    RotationMemory,
    share_made,
)
from quadstep.control.vectoring import AchievedCommand, attitude_for, commanded, lagged, push_against, up_axis
from quadstep.interfaces.controller import Command, Condition, Controller, Measured
from quadstep.interfaces.gain import given, usual
from quadstep.interfaces.learning import net
from quadstep.interfaces.plant import Model, Reference
from quadstep.numbers import Number, Vector, maximum, vector
from quadstep.numbers.rotations import conjugate, multiply, rotation_matrix


class HedgedBacksteppingGains(NamedTuple):
    """Those of the law. lag: of the rotors [s]."""

    law: RotationGains
    lag: Number = given(lambda model: model.lag)


class HedgedBacksteppingMemory(NamedTuple):
    """law: of the law. place [m], speed [m/s]: of the reference model. made: by the rotors.

    From the position loop to the attitude loop: rates [rad/s] and turning [rad/s^2] of the wanted attitude, in its own axes.
    asked: the acceleration that was wanted of the last sample [m/s^2].
    """

    law: RotationMemory
    place: Vector
    speed: Vector
    made: AchievedCommand
    rates: Vector
    turning: Vector
    asked: Vector


@dataclass(frozen=True)
class HedgedBackstepping(Controller):
    """`guide` is the position loop, `law` the attitude loop."""

    name = "hedged-backstepping"
    label = "adaptive backstepping with hedging"
    source = "docs/theory.md; Johnson and Kannan 2005"
    Gains = HedgedBacksteppingGains
    defaults: ClassVar[Mapping[str, object]] = {
        "law.slope_1": usual(1.72, 1),
        "law.gain_1": usual(7.6, 1),
        "law.slope_2": usual((5.1, 5.1, 5.0), 1, "body"),
        "law.gain_2": usual((23.5, 23.5, 20.0), 1, "rate"),
        "law.coupling": usual((3.3, 3.3, 3.3), 2, "body"),
        "law.filter_frequency": usual((12.7, 12.7, 10.0), 1, "body"),
        "law.force_net": net(1, FORCE_INPUTS, rate=usual(8.0, 2), damping=0.15),
        "law.torque_net": net(2, TORQUE_INPUTS, rate=usual(4.0, 2), damping=0.3),
    }

    def start(self, measured: Measured, gains: HedgedBacksteppingGains) -> HedgedBacksteppingMemory:
        """The reference model where the vehicle is; the rotors carry it."""
        zero = vector(0.0, 0.0, 0.0)
        return HedgedBacksteppingMemory(
            law=LAW.start(measured, gains.law),
            place=measured.position,
            speed=measured.velocity,
            made=AchievedCommand(gains.law.mass * gains.law.gravity, zero),
            rates=zero,
            turning=zero,
            asked=zero,
        )

    def enter(self, measured: Measured, reference: Reference, gains: HedgedBacksteppingGains) -> HedgedBacksteppingMemory:
        started, law = self.start(measured, gains), LAW.enter(measured, reference, gains.law)
        asked = reference.acceleration + push_against(measured, reference, gains.law)
        return started._replace(law=law, made=commanded(measured), asked=asked)

    def guide(
        self, memory: HedgedBacksteppingMemory, measured: Measured, reference: Reference,
        gains: HedgedBacksteppingGains, t: Number, period: Number,
    ) -> HedgedBacksteppingMemory:  # fmt: skip
        """The position loop about the reference model, and the model: e1_dd = -K_r1 e1_dot - Lambda1 (K_r1 - Lambda1) e1."""
        law, flying = gains.law, memory.law.flying
        place = flying * memory.place + (1.0 - flying) * measured.position  # on the ground the model stays where it is
        speed = flying * memory.speed + (1.0 - flying) * measured.velocity
        stiffness = law.slope_1 * (law.gain_1 - law.slope_1)
        model = stiffness * (reference.position - place) + law.gain_1 * (reference.velocity - speed)
        target = reference._replace(position=place, velocity=speed, acceleration=reference.acceleration + model)
        asked, following = LAW.pull(memory.law, measured, target, law, t, period)
        wanted = attitude_for(following.force, reference, law.mass)

        axis = up_axis(rotation_matrix(measured.attitude))
        made = (memory.made.thrust / law.mass) * axis - vector(0.0, 0.0, law.gravity)
        later = speed + (flying * period) * (target.acceleration - (memory.asked - made))
        return memory._replace(
            law=following,
            place=place + period * later,
            speed=later,
            rates=wanted.rates,
            turning=wanted.acceleration,
            asked=asked,
        )

    def law(
        self, memory: HedgedBacksteppingMemory, measured: Measured, reference: Reference,
        gains: HedgedBacksteppingGains, t: Number, period: Number,
    ) -> tuple[Command, HedgedBacksteppingMemory]:  # fmt: skip
        """The attitude loop behind a command filter that is led and hedged."""
        law, before = gains.law, memory.law
        made = lagged(memory.made, measured, maximum(gains.lag, 1e-6), t, period)
        led = LedAttitude(before.wanted, memory.rates, memory.turning)
        frequency = law.filter_frequency
        turn = led_acceleration(before.filtered, led, frequency * frequency, 2.0 * frequency)
        into_body = rotation_matrix(multiply(conjugate(measured.attitude), before.filtered.attitude))
        over = Vector(1.0 / entry for entry in law.inertia)
        hedge = into_body.T @ (over * (before.asked_torque - made.torque))
        filtered = led_filter(before.filtered, turn, hedge, period)
        all_made = share_made((before.asked_torque - measured.torque).norm(), before.asked_torque.norm())
        command, following = LAW.follow(before, measured, filtered, all_made, law, t, period)
        return command, memory._replace(law=following, made=made)

    def conditions(self, gains: HedgedBacksteppingGains, model: Model) -> list[Condition]:
        return list(LAW.conditions(gains.law, model))


LAW = RotationBackstepping()
