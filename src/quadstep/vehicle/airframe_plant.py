"""The real vehicle: rotors, air, battery and rigid body together, with a small network for accelerations that the equations
do not explain. Events change it: a payload is picked up or released, a rotor loses efficiency. A fitted vehicle also has
the gains with which predictions follow measurements.
"""

from typing import NamedTuple

from quadstep.numbers import Matrix, Number, Vector, matrix, sigmoid, total, vector, where
from quadstep.numbers.rotations import cross, rotation_matrix
from quadstep.vehicle.allocation import Allocation, allocate
from quadstep.vehicle.rigid_body import AirframeState, Contact, Effects, Geometry, MassProperties, ground_loads, motion_rate
from quadstep.vehicle.rotor import (
    Battery,
    Drag,
    RotorParameters,
    RotorState,
    electrical_power,
    ground_effect,
    hub_drag,
    parasitic_drag,
    rotor_loads,
    speed_rate,
    terminal_voltage,
)


class Observer(NamedTuple):
    """How a prediction uses measurements, and how it continues without them. Pairs: one value for x and y, one for z.

    rates, attitude, velocity: shares of the difference from the measured one taken over at a sample. torque, force: what the
    unexplained angular acceleration [rad/s^2] and specific force [m/s^2] gain a sample from the difference in rates [rad/s]
    and in velocity [m/s]; torque_fade, force_fade [1/s]: their decay rates. trend: the same for an angular acceleration that
    persists.

    The commands of a vehicle under control respond to disturbances that a prediction cannot see, so their torque is trusted in
    only in part (authority) and later (delay [s]), the rates decay to zero (leak [1/s]) and the vehicle to the tilt of an
    acceleration (spring [1/s^2]): path [1/s^2] times the distance to the logged setpoint, at most reach [m/s^2], less drift
    [1/s] times the velocity; its tangent is at most steepest. With 1, 0, 0, 0 a prediction is the vehicle alone.
    """

    rates: Vector
    attitude: Vector
    velocity: Vector
    torque: Vector
    torque_fade: Vector
    trend: Vector
    force: Vector
    force_fade: Vector
    authority: Vector
    leak: Vector
    spring: Number
    path: Number
    drift: Number
    delay: Number
    reach: Number
    steepest: Number


INPUTS, OUTPUTS = 7, 6
"""Velocity through the air and rates in body axes, mean rotor speed; angular acceleration and acceleration in body axes."""


class Residual(NamedTuple):
    """One hidden layer: outputs @ sigmoid(inputs @ x + biases) + offsets, x in SI units.

    inputs: (hidden, 7). biases: (hidden). outputs: (6, hidden). offsets: (6). The first three outputs are an angular
    acceleration [rad/s^2], the others an acceleration [m/s^2].
    """

    inputs: Matrix
    biases: Vector
    outputs: Matrix
    offsets: Vector


def accelerations(net: Residual, air: Vector, rates: Vector, speeds: Vector) -> tuple[Vector, Vector]:
    """Angular acceleration [rad/s^2] and acceleration [m/s^2], body axes.

    air: velocity of the body through the air [m/s], rates [rad/s], both in body axes. speeds: of the rotors [rad/s].
    """
    mean: Number = total(speeds) * (1.0 / len(speeds))
    before = net.inputs @ Vector((*air, *rates, mean)) + net.biases
    found = net.outputs @ Vector(sigmoid(one) for one in before) + net.offsets
    return Vector(found[i] for i in range(3)), Vector(found[i] for i in range(3, 6))


NOTHING = vector(0.0, 0.0, 0.0)


class Airframe(NamedTuple):
    """mass [kg]. inertia: diagonal, about the body's origin, the bare vehicle's centre of gravity [kg m^2]. gravity [m/s^2].

    ground: its height in the world [m]. residual: a `Residual` where it acts. contact: legs, of a vehicle that can stand.
    """

    mass: Number
    inertia: Vector
    gravity: Number
    rotor: RotorParameters
    drag: Drag
    battery: Battery
    ground: Number
    residual: Residual | tuple[()] = ()
    contact: Contact | tuple[()] = ()


def derivative(
    geometry: Geometry, airframe: Airframe, properties: MassProperties, efficiency: Vector,
    state: AirframeState, wanted_speeds: Vector, wind: Vector, effects: Effects,
) -> AirframeState:  # fmt: skip
    """Rate of every state with the rotors commanded to turn at `wanted_speeds` [rad/s], in wind [m/s], world axes.

    efficiency: each rotor's share of its forces left after a fault. position, velocity: of the body's origin.
    """
    rotor = airframe.rotor
    rotation = rotation_matrix(state.attitude)
    air = rotation.T @ (state.velocity - wind) if effects.drag else NOTHING
    fastest, current = rotor.fastest, 0.0
    if effects.battery:
        power = electrical_power(airframe.battery, rotor.torque, state.speeds)
        volts = terminal_voltage(airframe.battery, state.charge, power)
        fastest, current = (rotor.fastest / airframe.battery.full) * volts, power / volts

    rotors = []
    for mount, speed, wanted, share in zip(geometry.mounts, state.speeds, wanted_speeds, efficiency, strict=True):
        place, cushion, hub_air = Vector(mount.position), 1.0, NOTHING
        if effects.ground:
            cushion = ground_effect(state.position[2] - airframe.ground + rotation.rows[2] @ place, rotor.radius)
        if effects.drag:
            hub_air = air + cross(state.rates, place)
        rate = speed_rate(rotor, speed, wanted, fastest)
        rotors.append((mount, RotorState(speed, rate, share, cushion, hub_air)))
    loads = rotor_loads(rotor, airframe.drag, rotors, effects)
    force = loads.force + parasitic_drag(airframe.drag, air) if effects.drag else loads.force
    torque = loads.torque
    if airframe.contact:
        held, turned = ground_loads(airframe.contact, geometry, airframe.ground, rotation, state)
        force, torque = force + held, torque + turned
    moved = motion_rate(properties, rotation, state.motion, force, torque, loads.spin, airframe.gravity)
    if airframe.residual:
        through = rotation.T @ (state.velocity - wind)
        turning, pushed = accelerations(airframe.residual, through, state.rates, state.speeds)
        moved = moved._replace(velocity=moved.velocity + rotation @ pushed, rates=moved.rates + turning)
    return AirframeState(*moved, speeds=Vector(turning.rate for _, turning in rotors), charge=current)


def specific_force(airframe: Airframe, state: AirframeState, rate: AirframeState) -> Vector:
    """Specific force at the body's origin [m/s^2], body axes: R^T (acceleration - g). rate: from `derivative`."""
    x, y, z = rate.velocity
    return rotation_matrix(state.attitude).T @ Vector((x, y, z + airframe.gravity))


def voltage(airframe: Airframe, state: AirframeState) -> Number:
    """Voltage of the battery under the present load [V], for the log."""
    power = electrical_power(airframe.battery, airframe.rotor.torque, state.speeds)
    return terminal_voltage(airframe.battery, state.charge, power)


NO_DRAG = vector(0.0, 0.0, 0.0)


def hover_drag(geometry: Geometry, airframe: Airframe, allocation: Allocation) -> Vector:
    """Along body x, y, z, over speed along each and mass [1/s]: the rotors of a vehicle that hovers level."""
    speeds, _, _ = allocate(geometry, allocation, airframe.mass * airframe.gravity, NO_DRAG)
    found = []
    for axis in range(3):
        along = Vector(1.0 if i == axis else 0.0 for i in range(3))
        force = NO_DRAG
        for mount, speed in zip(geometry.mounts, speeds, strict=True):
            force = force + hub_drag(airframe.drag, mount.frame, speed * along)
        found.append((0.0 - force[axis]) / airframe.mass)
    return Vector(found)


class Payload(NamedTuple):
    """A point mass fixed to the body. start, end [s]; mass [kg]; position: body axes, from its origin [m]."""

    start: Number
    end: Number
    mass: Number
    position: Vector


class RotorFault(NamedTuple):
    """From start [s] on a rotor (its index, from 0) gives `efficiency` times the thrust and torque of its speed."""

    start: Number
    rotor: Number
    efficiency: Number


class Events(NamedTuple):
    payloads: tuple[Payload, ...] = ()
    faults: tuple[RotorFault, ...] = ()


def mass_properties(airframe: Airframe, events: Events, t: Number) -> MassProperties:
    """Mass, centre of gravity and inertia at time t [s], by the parallel-axis theorem; the bare vehicle's is the body's
    origin.
    """
    masses = [where(t >= p.start, where(t < p.end, p.mass, 0.0), 0.0) for p in events.payloads]
    x, y, z = airframe.inertia
    diagonal = matrix((x, 0.0, 0.0), (0.0, y, 0.0), (0.0, 0.0, z))
    if not masses:
        return MassProperties(airframe.mass, vector(0.0, 0.0, 0.0), diagonal)
    mass = airframe.mass + total(masses)
    moment = total(m * p.position for m, p in zip(masses, events.payloads, strict=True))
    offset = moment * (1.0 / mass)
    about_origin = diagonal + total(m * point_inertia(p.position) for m, p in zip(masses, events.payloads, strict=True))
    return MassProperties(mass, offset, about_origin - mass * point_inertia(offset))


def point_inertia(r: Vector) -> Matrix:
    """Inertia of a unit point mass at r about the origin: |r|^2 I - r r^T [m^2]."""
    x, y, z = r
    return matrix((y * y + z * z, -x * y, -x * z), (-x * y, x * x + z * z, -y * z), (-x * z, -y * z, x * x + y * y))


def efficiencies(events: Events, count: int, t: Number) -> Vector:
    """Each rotor's factor on thrust and torque at time t [s]."""
    result: list[Number] = [1.0] * count
    for fault in events.faults:
        result = [
            where(t >= fault.start, where(fault.rotor == float(i), factor * fault.efficiency, factor), factor)
            for i, factor in enumerate(result)
        ]
    return Vector(result)
