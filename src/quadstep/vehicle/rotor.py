"""Rotors: how their speeds follow the commands, the sag of their battery, and the total force and torque on the body.

Effects of moving air are drag of body and rotors, translational lift, flapping, and ground effect. The
formulas are those of RotorPy 3.0.0 (Folk, Paulos and Kumar 2023), but flapping has the opposite sign: there a positive
coefficient tips a vehicle towards where it flies.
"""

from collections.abc import Iterable
from typing import NamedTuple

from quadstep.numbers import Matrix, Number, Vector, clip, maximum, sqrt, total, vector, where
from quadstep.numbers.rotations import cross
from quadstep.vehicle.rigid_body import Effects, Mount


class Drag(NamedTuple):
    """Coefficients.

    parasitic: C, on the square of the airspeed, along body axes [N s^2/m^2]. rotor: (k_d, k_d, k_z) of one rotor, in its disc
    and along its axis [N s^2/(m rad)]. flapping: k_flap [N m s^2/(m rad)]. translational_lift: k_h [N s^2/m^2].
    """

    parasitic: Vector
    rotor: Vector
    flapping: Number
    translational_lift: Number


def parasitic_drag(drag: Drag, air: Vector) -> Vector:
    """Force on the body [N]: -|v| C v, v its velocity through the air `air` [m/s]; body axes."""
    return drag.parasitic * (-air.norm() * air)


def hub_drag(drag: Drag, frame: Matrix, flow: Vector) -> Vector:
    """Force on a rotor's hub [N]: -K w v, with K = diag(k_d, k_d, k_z) in the rotor's axes; body axes.

    frame: the rotor's axes as rows. flow: w v, the rotor's speed times the velocity of its hub through the air [m rad/s^2].
    """
    return -(frame.T @ (drag.rotor * (frame @ flow)))


def translational_lift(drag: Drag, frame: Matrix, air: Vector) -> Number:
    """Thrust that a rotor gains by moving across the air [N]: k_h (v_x^2 + v_y^2), v in the rotor's axes.

    frame: these as rows. air: v, velocity of the hub through the air [m/s], body axes.
    """
    x, y, _ = frame @ air
    return drag.translational_lift * (x * x + y * y)


def ground_effect(height: Number, radius: Number) -> Number:
    """Thrust over thrust far from the ground: 1 / (1 - (R / 4z)^2) (Cheeseman and Bennett 1955), z held above R / 2.

    height: of the rotor above the ground [m]. The ratio is 4/3 at most and fades as z^-2: 1.016 at 2 R, 1.0006 at 10 R.
    """
    held = maximum(height, 0.5 * radius)
    square = 16.0 * (held * held)
    return square / (square - radius * radius)


class Battery(NamedTuple):
    """full, empty: open-circuit voltage at either end [V]. capacity [C]. resistance [Ohm]. efficiency: motors and ESCs [-]."""

    full: Number
    empty: Number
    capacity: Number
    resistance: Number
    efficiency: Number


def electrical_power(battery: Battery, torque: Number, speeds: Vector) -> Number:
    """Power of the rotors [W]: sum of k_m w^3 over the efficiency, also with a fault. torque: k_m [N m s^2]; speeds
    [rad/s].
    """
    return (torque / battery.efficiency) * total((speed * speed) * speed for speed in speeds)


def open_circuit(battery: Battery, charge: Number) -> Number:
    """Open-circuit voltage after drawing `charge` [C], falling linearly from full to empty [V].

    Past empty it keeps falling, to a tenth of `empty`.
    """
    slope = (battery.empty - battery.full) / battery.capacity
    return maximum(battery.full + slope * charge, 0.1 * battery.empty)


def terminal_voltage(battery: Battery, charge: Number, power: Number) -> Number:
    """Voltage V under a load of `power` [W]: the larger root of V^2 - V_oc V + R P = 0 [V].

    A battery cannot supply more than V_oc^2 / (4 R); for a larger load its voltage is V_oc / 2.
    """
    open_voltage = open_circuit(battery, charge)
    return 0.5 * (open_voltage + sqrt(maximum(open_voltage * open_voltage - 4.0 * battery.resistance * power, 0.0)))


NOTHING = vector(0.0, 0.0, 0.0)


class RotorParameters(NamedTuple):
    """Parameters that all rotors of a vehicle share.

    thrust [N s^2]: k_f, thrust over speed squared. torque [N m s^2]: k_m, torque over speed squared. inertia: J_r, rotor and
    motor bell about the axis [kg m^2]. rise, fall: time constants [s]. slowest, fastest: of a rotor [rad/s]. radius [m].
    """

    thrust: Number
    torque: Number
    inertia: Number
    rise: Number
    fall: Number
    slowest: Number
    fastest: Number
    radius: Number


class RotorState(NamedTuple):
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


def speed_rate(rotor: RotorParameters, speed: Number, wanted: Number, fastest: Number) -> Number:
    """Rate of a rotor's speed [rad/s^2] towards the commanded one, which is limited to the slowest and `fastest` [rad/s].

    A first-order lag, with `rise` if the rotor is too slow and `fall` if it is too fast.
    """
    gap = clip(wanted, rotor.slowest, fastest) - speed
    return gap * where(gap > 0.0, 1.0 / rotor.rise, 1.0 / rotor.fall)


def rotor_loads(
    rotor: RotorParameters, drag: Drag, rotors: Iterable[tuple[Mount, RotorState]], effects: Effects
) -> RotorLoads:
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
