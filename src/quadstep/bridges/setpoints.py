"""A mission's path as setpoints of MAVLink, for a vehicle that flies in its own simulator or hangar: nothing else is sent.

No command leaves here: neither arming nor a change of mode.
"""

import time
from collections.abc import Callable, Iterable
from enum import StrEnum
from typing import NamedTuple, Protocol, cast

from quadstep.bridges.link import refuse_strange
from quadstep.control.vectoring import desired_attitude
from quadstep.engines.fly import FlightPlan
from quadstep.interfaces.plant import Reference
from quadstep.io.doors import optional
from quadstep.io.errors import UserError
from quadstep.numbers import vector
from quadstep.numbers.rotations import quaternion_of
from quadstep.vehicle.multirotor import Multirotor

HEARTBEAT_WAIT = 10.0
"""Seconds in which the vehicle is to be heard."""

SLOWEST, FASTEST = 2.0, 200.0
"""Rates of setpoints [Hz]; autopilots leave offboard flight below 2 Hz."""

HOLD = 10.0
"""Seconds for which the last point of the path is sent after it, at rest."""

MOST_HOLD = 3600.0

POSITION_MASK = 0x000
"""Position, velocity, acceleration, yaw and its rate are all asked."""

ATTITUDE_MASK, RATES_MASK = 0b0000_0111, 0b1000_0000
"""What of SET_ATTITUDE_TARGET is ignored: the rates, or the attitude."""

LOCAL_NED = 1

ARDUPILOT, OPTIONS, THRUST = 3, "GUID_OPTIONS", 8
"""ArduPilot in a heartbeat; the parameter, and its bit with which it takes the thrust of SET_ATTITUDE_TARGET for a thrust."""

ADDRESSES = "udpin:HOST:PORT, udpout:HOST:PORT, tcp:HOST:PORT"


class SetpointKind(StrEnum):
    POSITION = "position"
    ATTITUDE = "attitude"
    RATES = "rates"


class Sender(Protocol):
    """Messages as pymavlink packs and sends them."""

    def set_position_target_local_ned_send(self, *fields: float) -> None: ...
    def set_attitude_target_send(self, *fields: float | tuple[float, ...]) -> None: ...
    def command_long_send(self, *fields: float) -> None: ...
    def heartbeat_send(self, *fields: int) -> None: ...
    def param_request_read_send(self, system: int, component: int, name: bytes, index: int) -> None: ...


class VehicleMessage(Protocol):
    """A message of a vehicle; which fields it has depends on its type."""

    autopilot: int
    custom_mode: int
    base_mode: int
    param_id: str
    param_value: float
    param_type: int
    x: float
    y: float
    z: float
    severity: int
    text: str
    command: int
    result: int

    def get_type(self) -> str: ...
    def get_srcSystem(self) -> int: ...  # noqa: N802 (pymavlink's)


class Connection(Protocol):
    """What of pymavlink's connection is used."""

    target_system: int
    target_component: int
    mav: Sender

    def wait_heartbeat(self, blocking: bool = True, timeout: float | None = None) -> VehicleMessage | None: ...
    def recv_match(self) -> VehicleMessage | None: ...
    def close(self) -> None: ...


class Setpoint(NamedTuple):
    """In axes of autopilots: north, east, down; front, right, down. thrust: 0 to 1."""

    position: tuple[float, float, float]
    velocity: tuple[float, float, float]
    acceleration: tuple[float, float, float]
    yaw: float
    yaw_rate: float
    attitude: tuple[float, float, float, float]
    rates: tuple[float, float, float]
    thrust: float


def setpoint(plan: FlightPlan, reference: Reference) -> Setpoint:
    """The setpoint of a reference: the attitude and the rates whose thrust makes its acceleration, without drag."""
    p = plan.parameters
    mass, gravity = float(p.airframe.mass), float(p.airframe.gravity)
    force = mass * (reference.acceleration + vector(0.0, 0.0, gravity))
    wanted = desired_attitude(force, mass * reference.jerk, mass * reference.snap, reference.yaw, reference.yaw_rate)
    w, x, y, z = (float(one) for one in quaternion_of(wanted.rotation))
    roll, pitch, yaw = (float(one) for one in wanted.rates)
    full = float(p.allocation.most) * len(cast(Multirotor, plan.loop.plant).geometry.mounts)

    def turned(v: Iterable[float]) -> tuple[float, float, float]:
        a, b, c = (float(one) for one in v)
        return a, -b, -c

    return Setpoint(
        turned(reference.position), turned(reference.velocity), turned(reference.acceleration),
        -float(reference.yaw), -float(reference.yaw_rate), (w, x, -y, -z), (roll, -pitch, -yaw), float(force.norm()) / full,
    )  # fmt: skip


def serve(
    plan: FlightPlan, connect: str, kind: SetpointKind, rate: float, hold: float, progress: Callable[[float], None],
    heard: Callable[[], None] = lambda: None,
) -> int:  # fmt: skip
    """Send the path of a plan once, in its own time, then its last point at rest for `hold` [s]; the number of setpoints.

    progress: of the time [s] after each. heard: called once a vehicle was heard.

    Raises UserError for an address that cannot be opened, a vehicle that is not heard, and where pymavlink is absent.
    """
    if not isinstance(plan.loop.plant, Multirotor):
        raise UserError("serve-setpoints needs a mission for a real vehicle (docs/vehicles.md)")
    link = mavlink(connect, "--connect", "`quadstep serve-setpoints`")
    try:
        beat = link.wait_heartbeat(timeout=HEARTBEAT_WAIT)
        if beat is None:
            raise UserError(f"--connect {connect}: no heartbeat from a vehicle within {HEARTBEAT_WAIT:g} s")
        if beat.autopilot == ARDUPILOT and kind is not SetpointKind.POSITION:
            refuse_climb_rate(link, kind)
        heard()
        return stream(plan, link, kind, rate, hold, progress)
    finally:
        link.close()


def refuse_climb_rate(link: Connection, kind: SetpointKind) -> None:
    """Asks an ArduPilot how it takes a thrust. Raises UserError where, as by default, it would take it for a climb rate."""
    asked, options = time.monotonic(), None
    while options is None and time.monotonic() - asked < HEARTBEAT_WAIT:
        link.mav.param_request_read_send(link.target_system, link.target_component, OPTIONS.encode(), -1)
        until = time.monotonic() + 0.5
        while options is None and time.monotonic() < until:
            message = link.recv_match()
            if message is None:
                time.sleep(0.01)
            elif message.get_type() == "PARAM_VALUE" and message.param_id == OPTIONS:
                options = int(message.param_value)
    if options is None:
        raise UserError(f"--kind {kind}: ArduPilot did not say its {OPTIONS}, so a thrust may be a climb rate to it")
    if not options & THRUST:
        said = f"--kind {kind}: ArduPilot takes the thrust for a climb rate, as {OPTIONS} is {options}"
        raise UserError(f"{said}; set it to {options | THRUST}, or use --kind position")


def check_place(connect: str, option: str) -> None:
    """Refuses what is no address of pymavlink's. option: that names it. Raises UserError."""
    if "/" in connect:  # a device
        return
    try:
        refuse_strange(connect, 2, ADDRESSES)
    except UserError as error:
        raise UserError(f"{option} {error}") from None
    kind, *host_and_port = connect.split(":")
    if kind not in ("udpin", "udpout", "tcp") or len(host_and_port) != 2 or not host_and_port[1].isdecimal():
        raise UserError(f"{option} {connect}: cannot be opened; allowed over a network: {ADDRESSES}")


def mavlink(connect: str, option: str, command: str) -> Connection:
    """An open connection of pymavlink's. option, command: that ask for it, for errors.

    Raises UserError for an address that cannot be opened, where pymavlink is absent, and later where the other side hangs up.
    """
    mavutil = optional(command, "pymavlink.mavutil")
    check_place(connect, option)
    try:
        link = mavutil.mavlink_connection(connect, source_system=255, retries=1)  # more tries would be printed
    except ModuleNotFoundError as error:  # pymavlink takes what it does not know for a serial port, which needs pyserial
        text = f"cannot be opened: serial ports need the module {error.name}; allowed over a network: {ADDRESSES}"
        raise UserError(f"{option} {connect}: {text}") from None
    except Exception as error:  # pymavlink raises what it comes upon, ValueError, OSError and its own
        said = (isinstance(error, OSError) and error.strerror) or error
        raise UserError(f"{option} {connect}: cannot be opened: {said}") from None

    def hung_up() -> None:
        raise UserError(f"{option} {connect}: the other side closed the connection")

    link.handle_eof = link.handle_disconnect = hung_up  # pymavlink prints, and goes on
    return cast(Connection, link)


def send(link: Connection, kind: SetpointKind, time: float, one: Setpoint) -> None:
    """Send a setpoint. time: its stamp [s]."""
    stamp, target = round(1e3 * time), (link.target_system, link.target_component)
    if kind is SetpointKind.POSITION:
        link.mav.set_position_target_local_ned_send(
            stamp, *target, LOCAL_NED, POSITION_MASK,
            *one.position, *one.velocity, *one.acceleration, one.yaw, one.yaw_rate,
        )  # fmt: skip
    else:
        mask = ATTITUDE_MASK if kind is SetpointKind.ATTITUDE else RATES_MASK
        link.mav.set_attitude_target_send(stamp, *target, mask, one.attitude, *one.rates, one.thrust)


def at_rest(reference: Reference) -> Reference:
    """A reference's place and heading, without motion."""
    still = vector(0.0, 0.0, 0.0)
    return Reference(reference.position, still, still, reference.yaw, 0.0, still, still, 0.0)


def stream(
    plan: FlightPlan, link: Connection, kind: SetpointKind, rate: float, hold: float, progress: Callable[[float], None]
) -> int:
    duration, started, count = plan.ticks.last * plan.ticks.step, time.monotonic(), 0
    while count / rate <= duration + hold:
        at = count / rate
        time.sleep(max(0.0, started + at - time.monotonic()))
        reference = plan.loop.path.reference(min(at, duration), plan.parameters.path)
        one = setpoint(plan, reference if at <= duration else at_rest(reference))
        send(link, kind, at, one)
        count += 1
        progress(at)
    return count
