"""Geometric control with an L1 adaptive loop: Wu, Cheng, Zhao, Gahlawat, Ackerman, Lakshmanan, Yang, Yu, Hovakimyan, "L1Quad:
L1 adaptive augmentation of geometric control for agile quadrotors with performance guarantees" (2023, arXiv 2302.07208).

A predictor runs beside velocity and body rates, A = -a its gain, s what the model does not know:

    v^_dot = f R e3 / m - g e3 + s_v + A v~,    W^_dot = J^-1 (tau - W x J W) + s_w + A W~,    v~ = v^ - v,  W~ = W^ - W

At every sample the piecewise-constant law takes s = -Phi^-1 exp(A T) v~, Phi = A^-1 (exp(A T) - I). What rotors can undo
(along the thrust axis, and about all three) passes a low-pass filter, the torque's twice, and is subtracted. What acts across
the thrust axis no rotor can undo; the paper leaves it to the position loop. Here it is filtered too and the vehicle tilts
against it, unless `tilt_cutoff` is 0.

The authors name US patent 8,712,559 for this law; written from the paper.
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
    accelerations,
    angular_of,
    at_rest,
    attitude_for,
    boxed,
    commanded,
    errors_to,
    followed,
    force_for,
    lagged,
    pulled,
    push_against,
    torque_for,
    turned,
    up_axis,
)
from quadstep.interfaces.controller import Command, Controller, Measured
from quadstep.interfaces.gain import gain, usual
from quadstep.interfaces.plant import Reference
from quadstep.numbers import Number, Vector, exp
from quadstep.numbers.rotations import rotation_matrix


class GeometricL1Gains(NamedTuple):
    """The vehicle parameters that the controller assumes, and its gains."""

    body: BelievedBody
    pull: Pull
    turn: Turn
    pole: Number = gain(5.0, "1/s", "decay rate of the velocity predictor's error, -A_s", symbol="a_v", low=0.5, high=50.0)
    turn_pole: Number = gain(10.0, "1/s", "decay rate of the rate predictor's error, -A_s", symbol="a_w", low=0.5, high=50.0)
    thrust_cutoff: Number = gain(usual(8.8, 1), "rad/s", "cut-off of the thrust-compensation filter", zero=True)
    tilt_cutoff: Number = gain(usual(4.4, 1), "rad/s", "cut-off of the tilt-compensation filter", zero=True)
    turn_cutoff: Vector = gain(
        usual((5.8, 5.8, 5.9), 1, "body"), "rad/s", "cut-off of both torque-compensation filters", zero=True
    )
    bound: Number = gain(15.0, "m/s^2", "largest estimate along an axis", tunable=False)
    turn_bound: Number = gain(150.0, "rad/s^2", "largest estimate about an axis", tunable=False)


class GeometricL1Memory(NamedTuple):
    """velocity [m/s], rates [rad/s]: predicted, drawn to what was measured as A asks. unknown [m/s^2], turning [rad/s^2]: s.
    along: of the first what thrust undoes [m/s^2]; across: what tilting does, world. about: of the second, after one filter
    and after both. made: by the rotors.
    """

    velocity: Vector
    rates: Vector
    unknown: Vector
    turning: Vector
    along: Number
    across: Vector
    about: tuple[Vector, Vector]
    made: AchievedCommand


def adapted(error: Vector, pole: Number, period: Number) -> Vector:
    """-Phi^-1 exp(A T) error, A = -pole."""
    decay = exp(-(pole * period))
    return (-(pole * decay / (1.0 - decay))) * error


@dataclass(frozen=True)
class GeometricL1(Controller):
    """All loops in one, at the attitude loop's rate, which is the sample time of the estimate."""

    name = "geometric-l1"
    label = "geometric + L1"
    source = "Wu et al. 2023"
    Gains = GeometricL1Gains
    defaults: ClassVar[Mapping[str, object]] = {
        "pull.stiffness": usual(13.0, 2),
        "pull.damping": usual(5.12, 1),
        "turn.stiffness": usual((139.0, 139.0, 70.0), 2, "body"),
        "turn.damping": usual((23.1, 23.1, 15.0), 1, "rate"),
    }

    def start(self, measured: Measured, gains: GeometricL1Gains) -> GeometricL1Memory:
        """The predictor where the vehicle is; nothing unknown."""
        made = at_rest(gains.body)
        return GeometricL1Memory(measured.velocity, measured.rates, ZERO, ZERO, 0.0, ZERO, (ZERO, ZERO), made)

    def enter(self, measured: Measured, reference: Reference, gains: GeometricL1Gains) -> GeometricL1Memory:
        """The unknown is what the present command makes up for; all filters have settled."""
        body, axis = gains.body, up_axis(rotation_matrix(measured.attitude))
        unknown = boxed(-push_against(measured, reference, body), gains.bound)
        turning = boxed(-angular_of(measured.torque, measured, body), gains.turn_bound)
        undone = axis @ unknown
        return GeometricL1Memory(
            velocity=measured.velocity,
            rates=measured.rates,
            unknown=unknown,
            turning=turning,
            along=undone,
            across=unknown - undone * axis,
            about=(turning, turning),
            made=commanded(measured),
        )

    def law(
        self, memory: GeometricL1Memory, measured: Measured, reference: Reference, gains: GeometricL1Gains,
        t: Number, period: Number,
    ) -> tuple[Command, GeometricL1Memory]:  # fmt: skip
        memory = self.estimated(memory, measured, gains, t, period)
        body, axis = gains.body, up_axis(rotation_matrix(measured.attitude))
        force = force_for(pulled(measured, reference, gains.pull) - memory.across, body)
        attitude = attitude_for(force, reference, body.mass)
        errors = errors_to(attitude, measured)
        torque = torque_for(turned(errors, gains.turn) - memory.about[1], measured, body)
        return Command(force @ axis - body.mass * memory.along, torque, attitude.angles), memory

    def estimated(
        self, memory: GeometricL1Memory, measured: Measured, gains: GeometricL1Gains, t: Number, period: Number
    ) -> GeometricL1Memory:
        """What is predicted for time t [s], what follows from it, and the filters a period [s] later."""
        body, axis = gains.body, up_axis(rotation_matrix(measured.attitude))
        made = lagged(memory.made, measured, body.lag, t, period)
        pushed, spun = accelerations(made, measured, body)
        velocity = memory.velocity + period * (pushed + memory.unknown)
        rates = memory.rates + period * (spun + memory.turning)
        off, off_r = velocity - measured.velocity, rates - measured.rates
        unknown = boxed(adapted(off, gains.pole, period), gains.bound)
        turning = boxed(adapted(off_r, gains.turn_pole, period), gains.turn_bound)
        undone, turn_share = axis @ unknown, Vector(followed(cutoff, period) for cutoff in gains.turn_cutoff)
        across, tilt_share = unknown - undone * axis, followed(gains.tilt_cutoff, period)
        once, twice = memory.about
        once = once + turn_share * (turning - once)
        return GeometricL1Memory(
            velocity=velocity - (period * gains.pole) * off,
            rates=rates - (period * gains.turn_pole) * off_r,
            unknown=unknown,
            turning=turning,
            along=memory.along + followed(gains.thrust_cutoff, period) * (undone - memory.along),
            across=memory.across + tilt_share * (across - memory.across),
            about=(once, twice + turn_share * (once - twice)),
            made=made,
        )
