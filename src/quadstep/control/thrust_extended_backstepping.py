"""Backstepping through the thrust's rate: Mahony, Hamel, Dzul (1999) and Mahony, Hamel (2005), the paper's [26] and [13].

The paper turns the wanted force into thrust and tilt, and its proof loses the force that is missing while the vehicle still
leans. Here the force itself is a state, driven through the thrust's second rate and the tilting torques, so that backstepping
is exact over all four integrators. With e1 = p - p_d, e0 its integral, and further errors e2, e3, e4 of velocity, specific
force and its rate,

    V = 1/2 (k_0 |e0|^2 + sum_i |e_i|^2 / c^(i - 1)),    V_dot = -sum_i k_i |e_i|^2 / c^(i - 1).

The papers have c = 1: their errors drive each other at 1 rad/s, however slow the vehicle.
"""

from dataclasses import dataclass
from typing import NamedTuple

from quadstep.control.thrust_extension import Push, driving, motion
from quadstep.control.wanted_attitude import project
from quadstep.interfaces.controller import Command, Controller, Measured
from quadstep.interfaces.gain import believed, gain, given, usual
from quadstep.interfaces.reference import Reference
from quadstep.numbers import Number, Vector, vector


class ThrustExtendedGains(NamedTuple):
    """The vehicle parameters that the controller assumes; gains of each error, in x, y, z."""

    mass: Number = believed("mass")
    inertia: Vector = believed("inertia")
    gravity: Number = given(lambda model: model.gravity)
    most_thrust: Number = given(lambda model: model.most_thrust)
    integral: Vector = gain(
        usual((22.0, 22.0, 2.5), 2), "1/s^2", "gain of the integral of the position error", key="k_0", zero=True
    )
    position: Vector = gain(usual((1.5, 1.5, 4.0), 1), "1/s", "gain of e1, of position", key="k_1")
    velocity: Vector = gain(usual((1.8, 1.8, 8.0), 1), "1/s", "gain of e2, of velocity", key="k_2")
    force: Vector = gain(usual((1.7, 1.7, 12.0), 1), "1/s", "gain of e3, of the specific force", key="k_3")
    force_rate: Vector = gain(usual((23.0, 23.0, 20.0), 1), "1/s", "gain of e4, of the rate of the specific force", key="k_4")
    coupling: Number = gain(usual(1.0, 2), "1/s^2", "weight of each error against the next; the papers' is 1", key="c")
    integral_bound: Number = gain(5.0, "m s", "bound on the integral of the position error")
    heading: Number = gain(usual(30.0, 2, "yaw"), "1/s^2", "stiffness of the heading", key="k_psi")
    turning: Number = gain(usual(10.0, 1, "yaw"), "1/s", "damping of the heading", key="k_r")


class ThrustExtendedMemory(NamedTuple):
    """push: the extended thrust. integral: of the position error [m s]."""

    push: Push
    integral: Vector


class BacksteppingErrors(NamedTuple):
    """e1 [m], e2 [m/s], e3 [m/s^2], e4 [m/s^3], and the snap that they ask for [m/s^4]."""

    position: Vector
    velocity: Vector
    force: Vector
    force_rate: Vector
    snap: Vector


def backstepped(
    gains: ThrustExtendedGains, integral: Vector, measured: Measured, reference: Reference, force: Vector, force_rate: Vector
) -> BacksteppingErrors:
    """The errors, each of what the one before it asks for, and the snap. The rates of an error follow from the errors:

    e1' = e2 - k_1 e1 - k_0 e0,    e2' = e3 - c e1 - k_2 e2,    e3' = e4 - c e2 - k_3 e3.
    """
    k_0, k_1, k_2, k_3, k_4 = gains.integral, gains.position, gains.velocity, gains.force, gains.force_rate
    c = gains.coupling
    e1 = measured.position - reference.position
    e1_d = measured.velocity - reference.velocity
    e2 = e1_d + k_1 * e1 + k_0 * integral
    wanted_rate = reference.acceleration - k_1 * e1_d - k_0 * e1  # of the wanted velocity
    e3 = force - (vector(0.0, 0.0, gains.gravity) + wanted_rate - c * e1 - k_2 * e2)
    e2_d = e3 - c * e1 - k_2 * e2
    e1_dd = e2_d - k_1 * e1_d - k_0 * e1
    wanted_jerk = reference.jerk - k_1 * e1_dd - k_0 * e1_d
    wanted_force_rate = wanted_jerk - c * e1_d - k_2 * e2_d
    e4 = force_rate - (wanted_force_rate - c * e2 - k_3 * e3)
    e3_d = e4 - c * e2 - k_3 * e3
    e2_dd = e3_d - c * e1_d - k_2 * e2_d
    e1_ddd = e2_dd - k_1 * e1_dd - k_0 * e1_d
    wanted_snap = reference.snap - k_1 * e1_ddd - k_0 * e1_dd
    wanted_change = wanted_snap - c * e1_dd - k_2 * e2_dd
    return BacksteppingErrors(e1, e2, e3, e4, wanted_change - c * e2_d - k_3 * e3_d - c * e3 - k_4 * e4)


@dataclass(frozen=True)
class ThrustExtendedBackstepping(Controller):
    """Position and attitude in one, at the attitude loop's rate."""

    name = "thrust-extended-backstepping"
    label = "backstepping through the thrust's rate"
    source = "Mahony, Hamel, Dzul 1999; Mahony, Hamel 2005"
    Gains = ThrustExtendedGains

    def start(self, measured: Measured, gains: ThrustExtendedGains) -> ThrustExtendedMemory:
        return ThrustExtendedMemory(Push(gains.gravity, 0.0), vector(0.0, 0.0, 0.0))

    def law(
        self,
        memory: ThrustExtendedMemory,
        measured: Measured,
        reference: Reference,
        gains: ThrustExtendedGains,
        t: Number,
        period: Number,
    ) -> tuple[Command, ThrustExtendedMemory]:
        """One sample: the snap that backstepping asks for, and the inputs that make it."""
        now = motion(measured, memory.push)
        errors = backstepped(gains, memory.integral, measured, reference, now.force, now.force_rate)
        made = driving(memory.push, errors.snap, measured, reference, gains, period)
        command = Command(
            thrust=made.thrust,
            torque=made.torque,
            r1=-errors.velocity,
            r2=-measured.rates,
        )
        return command, ThrustExtendedMemory(
            made.push, project(memory.integral + period * errors.position, gains.integral_bound)
        )
