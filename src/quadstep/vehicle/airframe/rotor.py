"""Rotors: how their speeds follow the commands, and the total force and torque that they exert on the body."""

from collections.abc import Iterable
from typing import NamedTuple

from quadstep.numbers import Number, Vector, clip, vector, where
from quadstep.numbers.rotations import cross
from quadstep.vehicle.airframe.aerodynamics import Drag, hub_drag, translational_lift
from quadstep.vehicle.airframe.geometry import Effects, Mount

NOTHING = vector(0.0, 0.0, 0.0)


class Rotor(NamedTuple):
    """Parameters that all rotors of a vehicle share.

    thrust: k_f [N s^2]. torque: k_m [N m s^2]. inertia: J_r, rotor and motor bell about the axis [kg m^2]. rise, fall: time
    constants [s]. slowest, fastest [rad/s]. radius [m].
    """

    thrust: Number
    torque: Number
    inertia: Number
    rise: Number
    fall: Number
    slowest: Number
    fastest: Number
    radius: Number


class Turning(NamedTuple):
    """The state of one rotor.

    speed: w [rad/s]. rate: of w [rad/s^2]. share: of its forces, left after a fault [-]. cushion: factor of the ground on its
    thrust [-]. air: velocity of its hub through the air [m/s], body axes.
    """

    speed: Number
    rate: Number
    share: Number
    cushion: Number
    air: Vector


class RotorLoads(NamedTuple):
    """Effect of all rotors, body axes. force [N]; torque about the body's origin [N m]; spin: angular momentum [N m s]."""

    force: Vector
    torque: Vector
    spin: Vector


def speed_rate(rotor: Rotor, speed: Number, wanted: Number, fastest: Number) -> Number:
    """Rate of a rotor's speed [rad/s^2] towards the commanded one, which is limited to the slowest and `fastest` [rad/s].

    A first-order lag, with `rise` if the rotor is too slow and `fall` if it is too fast.
    """
    gap = clip(wanted, rotor.slowest, fastest) - speed
    return gap * where(gap > 0.0, 1.0 / rotor.rise, 1.0 / rotor.fall)


def rotor_loads(rotor: Rotor, drag: Drag, rotors: Iterable[tuple[Mount, Turning]], effects: Effects) -> RotorLoads:
    """Sums over the rotors, each at r with axis a, turning at w, its hub moving by v through the air.

    Force: (k_f w^2 + k_h |v across a|^2) a - w K v. Torque: r x force - s (k_m w^2 + J_r w_dot) a + k_flap w v x a. Spin:
    J_r s w a. s is the mount's spin, K = diag(k_d, k_d, k_z) in the rotor's axes. A fault scales all but what J_r does.

    Flapping blades rise at the front, a quarter turn after they advance against the air, so they tip the vehicle back.
    """
    force = levers = reaction = spin_up = spin = flapping = NOTHING
    for mount, (speed, rate, share, cushion, air) in rotors:
        frame, turn = mount.frame, float(mount.spin)
        axis = frame.rows[2]
        turning = share * speed
        square = turning * speed
        thrust, push = rotor.thrust * square, NOTHING
        if effects.drag:
            flow = turning * air
            thrust = thrust + share * translational_lift(drag, frame, air)
            push = hub_drag(drag, frame, flow)
            flapping = flapping + cross(flow, axis)
        push = push + (cushion * thrust) * axis
        force = force + push
        levers = levers + cross(Vector(mount.position), push)
        reaction = reaction + (turn * square) * axis
        if effects.gyroscopic:
            spin_up = spin_up + (turn * rate) * axis
            spin = spin + (turn * speed) * axis
    torque = levers - rotor.torque * reaction
    if effects.drag:
        torque = torque + drag.flapping * flapping
    if effects.gyroscopic:
        torque = torque - rotor.inertia * spin_up
        spin = rotor.inertia * spin
    return RotorLoads(force, torque, spin)
