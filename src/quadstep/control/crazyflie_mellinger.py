"""The Crazyflie's Mellinger controller (firmware 2026.08; Mellinger, Kumar 2011).

With errors e of position and velocity, the force and the moment wanted are

    F = m (a_d + g e3) + kp e + kd e_dot + ki I(e)
    M = -kR e_R + kw e_w + ki_m I(-e_R) + kd_omega e_w_dot,    e_R = vee(R_d^T R - R^T R_d)

M, and F along the body's axis times `massThrust`, are counts of 1/65535 of a rotor's thrust. The force believes the firmware's
own mass; integrals are clipped. All at 500 Hz.
"""

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

from quadstep.control.mixers import FULL, OnQuarters, crazyflie_thrusts
from quadstep.control.vectoring import ZERO, boxed, desired_attitude, up_axis
from quadstep.interfaces.controller import Controller, Measured, RotorThrusts
from quadstep.interfaces.gain import parameter
from quadstep.interfaces.plant import Reference
from quadstep.numbers import Matrix, Number, Vector, clip, vector, where
from quadstep.numbers.rotations import quaternion_of, rotation_matrix, yaw_pitch_roll

GRAVITY = 9.81
"""The firmware's own [m/s^2]."""

MOST_TURN = 32000.0
"""Of each moment [counts]."""


class MellingerParameters(NamedTuple):
    """Group `ctrlMel`."""

    mass: Number = parameter("ctrlMel.mass", 0.029, "kg", "mass assumed by the law", zero=False, tunable=False)
    mass_thrust: Number = parameter("ctrlMel.massThrust", 132000.0, "counts/N", "counts of thrust per newton", zero=False)
    kp_xy: Number = parameter("ctrlMel.kp_xy", 0.4, "N/m", "P gain of the horizontal position")
    kd_xy: Number = parameter("ctrlMel.kd_xy", 0.2, "N s/m", "D gain of the horizontal position")
    ki_xy: Number = parameter("ctrlMel.ki_xy", 0.05, "N/(m s)", "I gain of the horizontal position")
    range_xy: Number = parameter("ctrlMel.i_range_xy", 2.0, "m s", "limit of the horizontal integral", tunable=False)
    kp_z: Number = parameter("ctrlMel.kp_z", 1.25, "N/m", "P gain of the height")
    kd_z: Number = parameter("ctrlMel.kd_z", 0.4, "N s/m", "D gain of the height")
    ki_z: Number = parameter("ctrlMel.ki_z", 0.05, "N/(m s)", "I gain of the height")
    range_z: Number = parameter("ctrlMel.i_range_z", 0.4, "m s", "limit of the height's integral", tunable=False)
    kr_xy: Number = parameter("ctrlMel.kR_xy", 70000.0, "counts", "P gain of roll and pitch")
    kw_xy: Number = parameter("ctrlMel.kw_xy", 20000.0, "counts s", "P gain of the roll and pitch rates")
    ki_m_xy: Number = parameter("ctrlMel.ki_m_xy", 0.0, "counts/s", "I gain of roll and pitch")
    range_m_xy: Number = parameter("ctrlMel.i_range_m_xy", 1.0, "s", "limit of roll's and pitch's integrals", tunable=False)
    kr_z: Number = parameter("ctrlMel.kR_z", 60000.0, "counts", "P gain of yaw")
    kw_z: Number = parameter("ctrlMel.kw_z", 12000.0, "counts s", "P gain of the yaw rate")
    ki_m_z: Number = parameter("ctrlMel.ki_m_z", 500.0, "counts/s", "I gain of yaw")
    range_m_z: Number = parameter("ctrlMel.i_range_m_z", 1500.0, "s", "limit of yaw's integral", tunable=False)
    kd_omega: Number = parameter("ctrlMel.kd_omega_rp", 200.0, "counts s^2", "D gain of the roll and pitch rates")


class CrazyflieMellingerGains(NamedTuple):
    """The firmware's parameters, and the thrust of a rotor at full command [N]."""

    law: MellingerParameters
    full_thrust: Number = FULL


class CrazyflieMellingerMemory(NamedTuple):
    """position [m s], attitude [s]: integrals. asked, rates [rad/s]: wanted and measured at the last sample, body axes.

    begun: 1 after the first sample, which has no slope.
    """

    position: Vector
    attitude: Vector
    asked: Vector
    rates: Vector
    begun: Number


def attitude_error(wanted: Matrix, attitude: Matrix) -> Vector:
    """vee(R_d^T R - R^T R_d): twice the sine of a turn, about its axis."""
    a = wanted.T @ attitude
    return vector(a[2, 1] - a[1, 2], a[0, 2] - a[2, 0], a[1, 0] - a[0, 1])


@dataclass(frozen=True)
class CrazyflieMellinger(OnQuarters, Controller[CrazyflieMellingerMemory, Measured, CrazyflieMellingerGains, RotorThrusts]):
    """The firmware's law."""

    name = "crazyflie-mellinger"
    label = "Crazyflie's Mellinger"
    source = "Mellinger, Kumar 2011, as in Crazyflie firmware 2026.08"
    Gains = CrazyflieMellingerGains
    commands = RotorThrusts
    rates: ClassVar = {"law": 0.002}
    parameter_file = "crazyflie"

    def start(self, measured: Measured, gains: CrazyflieMellingerGains) -> CrazyflieMellingerMemory:
        return CrazyflieMellingerMemory(ZERO, ZERO, ZERO, ZERO, 0.0)

    def law(
        self, memory: CrazyflieMellingerMemory, measured: Measured, reference: Reference, gains: CrazyflieMellingerGains,
        t: Number, period: Number,
    ) -> tuple[RotorThrusts, CrazyflieMellingerMemory]:  # fmt: skip
        """One sample. Wanted rates are those of the path, as the firmware's planner of trajectories computes them."""
        g = gains.law
        kp, kd, ki = (vector(xy, xy, z) for xy, z in ((g.kp_xy, g.kp_z), (g.kd_xy, g.kd_z), (g.ki_xy, g.ki_z)))
        kr, kw, ki_m = (vector(xy, xy, z) for xy, z in ((g.kr_xy, g.kr_z), (g.kw_xy, g.kw_z), (g.ki_m_xy, g.ki_m_z)))
        weight = vector(0.0, 0.0, GRAVITY)
        away = reference.position - measured.position
        position = boxed(memory.position + period * away, vector(g.range_xy, g.range_xy, g.range_z))
        force = g.mass * (reference.acceleration + weight) + kp * away + ki * position
        force = force + kd * (reference.velocity - measured.velocity)
        wanted = desired_attitude(force, ZERO, ZERO, reference.yaw, 0.0).rotation
        attitude = rotation_matrix(measured.attitude)
        error = attitude_error(wanted, attitude)
        planned = desired_attitude(reference.acceleration + weight, reference.jerk, ZERO, reference.yaw, 0.0)
        asked = vector(planned.rates[0], planned.rates[1], planned.rotation[2, 2] * reference.yaw_rate)
        change = memory.begun * ((asked - memory.asked) - (measured.rates - memory.rates)) / period
        turned = boxed(memory.attitude - period * error, vector(g.range_m_xy, g.range_m_xy, g.range_m_z))
        moment = ki_m * turned - kr * error + kw * (asked - measured.rates) + vector(g.kd_omega, g.kd_omega, 0.0) * change
        thrust = g.mass_thrust * (force @ up_axis(attitude))
        lifts = where(thrust > 0.0, 1.0, 0.0)  # without thrust the motors rest, and integrals begin anew
        roll, pitch, yaw = (lifts * clip(one, -MOST_TURN, MOST_TURN) for one in moment)
        thrusts = crazyflie_thrusts((lifts * thrust, roll, -pitch, yaw), self.rotors, self.mirrored, gains.full_thrust)
        command = RotorThrusts(thrusts, yaw_pitch_roll(quaternion_of(wanted)))
        return command, CrazyflieMellingerMemory(lifts * position, lifts * turned, asked, measured.rates, 1.0)
