"""Exact linearisation by dynamic feedback, the paper's [20], with a sliding-mode observer of what pushes the vehicle, its [6].

Mistler, Benallegue, M'Sirdi (2001): with the thrust's rate a state, position is a chain of four integrators, which a linear
law places the poles of. Mokhtari, Benallegue, Orlov (2006) add sliding-mode observers; here the one of the velocity is a
super-twisting observer (Davila, Fridman, Levant 2005), whose second state is the disturbance's acceleration.
"""

from dataclasses import dataclass
from typing import NamedTuple

from quadstep.control.super_twisting import smooth_root, smooth_sign
from quadstep.control.thrust_extended_backstepping import Push, driving, motion
from quadstep.control.vectoring import project
from quadstep.interfaces.controller import Command, Controller, Measured
from quadstep.interfaces.gain import believed, gain, given, usual
from quadstep.interfaces.plant import Reference
from quadstep.numbers import Number, Vector, vector

LAYER = 0.1
"""Velocity error [m/s] within which the observer is nearly linear."""


class DynamicLinearisationGains(NamedTuple):
    """Assumed vehicle parameters; gains of the chain of integrators and of the observer, in x, y, z."""

    mass: Number = believed("mass")
    inertia: Vector = believed("inertia")
    gravity: Number = given(lambda model: model.gravity)
    most_thrust: Number = given(lambda model: model.most_thrust)
    position: Vector = gain(usual(36.7, 4), "1/s^4", "gain of the position error", key="k_0")
    velocity: Vector = gain(usual(196.0, 3), "1/s^3", "gain of the velocity error", key="k_1")
    acceleration: Vector = gain(usual(78.0, 2), "1/s^2", "gain of the acceleration error", key="k_2")
    jerk: Vector = gain(usual(11.9, 1), "1/s", "gain of the jerk error", key="k_3")
    observer: Vector = gain(
        usual(1.37, 1), "m^0.5/s^1.5", "super-twisting observer: gain on the square root of its error", key="l_1"
    )
    drift: Vector = gain(usual(0.73, 2), "m/s^3", "super-twisting observer: gain on the sign of its error", key="l_2")
    bound: Number = gain(8.0, "m/s^2", "largest estimated disturbance acceleration")
    heading: Number = gain(usual(30.0, 2, "yaw"), "1/s^2", "stiffness of the heading", key="k_psi")
    turning: Number = gain(usual(10.0, 1, "yaw"), "1/s", "damping of the heading", key="k_r")


class DynamicLinearisationMemory(NamedTuple):
    """push: the extended thrust. velocity [m/s], disturbance [m/s^2]: observed, world axes."""

    push: Push
    velocity: Vector
    disturbance: Vector


@dataclass(frozen=True)
class DynamicLinearisation(Controller):
    """Position, attitude and observer in one, at the attitude loop's rate."""

    name = "dynamic-linearisation"
    label = "exact linearisation by dynamic feedback"
    source = "Mistler, Benallegue, M'Sirdi 2001; Mokhtari, Benallegue, Orlov 2006"
    Gains = DynamicLinearisationGains

    def start(self, measured: Measured, gains: DynamicLinearisationGains) -> DynamicLinearisationMemory:
        return DynamicLinearisationMemory(Push(gains.gravity, 0.0), measured.velocity, vector(0.0, 0.0, 0.0))

    def law(
        self, memory: DynamicLinearisationMemory, measured: Measured, reference: Reference,
        gains: DynamicLinearisationGains, t: Number, period: Number,
    ) -> tuple[Command, DynamicLinearisationMemory]:  # fmt: skip
        """One sample: the wanted snap, and the inputs that make it."""
        now = motion(measured, memory.push)
        off = measured.velocity - memory.velocity
        falling = now.force - vector(0.0, 0.0, gains.gravity)
        acceleration = falling + memory.disturbance
        snap = (
            reference.snap
            + gains.jerk * (reference.jerk - now.force_rate)
            + gains.acceleration * (reference.acceleration - acceleration)
            + gains.velocity * (reference.velocity - measured.velocity)
            + gains.position * (reference.position - measured.position)
        )
        made = driving(memory.push, snap, measured, reference, gains, period)
        following = DynamicLinearisationMemory(
            push=made.push,
            velocity=memory.velocity + period * (acceleration + gains.observer * smooth_root(off, LAYER)),
            disturbance=project(memory.disturbance + period * (gains.drift * smooth_sign(off, LAYER)), gains.bound),
        )
        return Command(made.thrust, made.torque), following
