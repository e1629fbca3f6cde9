"""The pilot of an autopilot: a MAVLink ground station that arms it, takes off and sends a mission's path. It follows the
clock of the samples that the autopilot is given, so it keeps pace with the flight.
"""

import math
import struct
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from time import sleep
from typing import NamedTuple

from quadstep.bridges.link import ConnectionLost, SensorSample
from quadstep.bridges.setpoints import Connection, Setpoint, SetpointKind, VehicleMessage, at_rest, mavlink, send, setpoint
from quadstep.engines.fly import FlightPlan
from quadstep.io.errors import UserError


class Station(NamedTuple):
    """How an autopilot is led. connect: where it speaks MAVLink, as pymavlink writes it. mode: in which it follows setpoints.

    requested, reported: that mode in MAV_CMD_DO_SET_MODE and as `custom_mode` of a heartbeat. climbs: whether setpoints
    alone lift it, sent before it changes its mode. bytewise: whether whole parameters are sent as the bytes of a float.
    """

    name: str
    connect: str
    mode: str
    requested: int
    reported: int
    climbs: bool
    bytewise: bool


STATIONS = {
    "ardupilot": Station("ArduPilot", "tcp:127.0.0.1:5760", "GUIDED", 4, 4, climbs=False, bytewise=False),
    "px4": Station("PX4", "udpin:127.0.0.1:14540", "OFFBOARD", 6, 6 << 16, climbs=True, bytewise=True),
}

RISE = 1.0
"""How far the vehicle rises before it is sent the path [m]."""

RISEN = 0.9 * RISE
"""From here on it counts as risen [m]: an autopilot is slow over the last of it."""

RATE, POLL = 50.0, 100.0
"""Of setpoints, and of looking for messages [Hz]."""

AGAIN = 1.0
"""Seconds of the autopilot's time after which it is asked again."""

READY = 180.0
"""Seconds of simulated time that an autopilot may take to be heard and to lift off: ArduPilot's estimator alone takes 42."""

ANSWER = 10.0
"""Seconds of simulated time in which it may answer what its parameters are."""

NEAR = 0.02
"""Relative difference at which a parameter still matches: the hover's thrust is learnt."""

WARNING = 4
"""Least of MAVLink's severities that is told of; lower numbers are worse."""

SET_MODE, ARM, TAKEOFF, SET_INTERVAL = 176, 400, 22, 511
"""MAV_CMD."""

LOCAL_POSITION, ARMED, REAL32 = 32, 128, 9
"""A message's number, a flag of `base_mode`, and MAV_PARAM_TYPE of a float."""

RESULTS = {1: "temporarily rejected", 2: "denied", 3: "unsupported", 4: "failed"}
"""MAV_RESULT other than accepted and in progress."""


class Pilot:
    """A ground station in lockstep with a flight.

    plan: whose path is sent. frame, curve: parameters by name that the autopilot should have: it is not armed with another
    frame, and another thrust curve is told of. told: of that, and of lift-off.
    """

    def __init__(
        self, station: Station, where: str, plan: FlightPlan, frame: Mapping[str, float],
        curve: Mapping[str, float], say: Callable[[str], None],
    ) -> None:  # fmt: skip
        self.station, self.where, self.plan, self.say = station, where or station.connect, plan, say
        self.frame, self.wanted = frame, {**frame, **curve}
        self.duration = plan.ticks.last * plan.ticks.step
        self.link: Connection | None = None
        self.closed, self.failed = False, ""
        self.found: dict[str, float] = {}
        self.mode: int | None = None
        self.armed = self.checked = self.risen = False
        self.local: tuple[float, float, float] | None = None
        self.offset = (0.0, 0.0, 0.0)
        self.start: SensorSample | None = None
        self.reason = ""
        self.next: dict[str, float] = {}
        self.heard_at = math.nan
        self.thread = threading.Thread(target=self._connect, daemon=True)
        self.thread.start()

    def _connect(self) -> None:
        """Until it succeeds, beside the flight: ArduPilot's simulator starts once somebody has come, and perhaps after us."""
        while not self.closed:
            try:
                self.link = mavlink(self.where, "--pilot-connect", "`quadstep fly --pilot`")
            except UserError as error:
                self.failed = str(error)
                sleep(0.1)
            else:
                break
        if self.closed and self.link:
            self.link.close()

    def why(self) -> str:
        """Why it is not connected; empty where it is."""
        return "" if self.link else self.failed

    def close(self) -> None:
        self.closed = True
        if self.link:
            self.link.close()

    def stand(self, sample: SensorSample) -> str:
        """One step towards lift-off, on the ground; gives what it waits for. Raises UserError, and Lost."""
        time, name = sample.time, self.station.name
        self.start = sample
        if not self._due("poll", time, 1.0 / POLL):
            return ""
        self._hear(time)
        doing = self._prepare(time)
        if doing and time - (0.0 if math.isnan(self.heard_at) else self.heard_at) > READY:
            why = self.reason or self.why()
            after = f"still {doing} after {READY:g} s of simulated time"
            raise UserError(f"{name} at {self.where}: {after}{': ' if why else ''}{why}")
        return f"{name}: {doing}" + (f" ({self.reason})" if self.reason else "")

    def _prepare(self, time: float) -> str:
        """What it waits for; asks for that now and then."""
        link, station = self.link, self.station
        if not link or self.mode is None:
            return "not heard"
        self._show(time)
        if not self._checked(time):
            return "without known parameters"
        if self.local is None:
            if self._due("position", time, AGAIN):
                self._command(SET_INTERVAL, LOCAL_POSITION, 1e6 / POLL)
            return "without a position"
        assert self.start
        self.offset = tuple(at - of for at, of in zip(self.local, self.start.position, strict=True))  # type: ignore[assignment]
        if station.climbs and self._due("setpoint", time, 1.0 / RATE):
            north, east, down = self._setpoint(0.0).position
            self._send(time, self._setpoint(0.0, still=True)._replace(position=(north, east, down - RISE)))
        if self.mode != station.reported:
            if self._due("mode", time, AGAIN):
                self._command(SET_MODE, 1, station.requested)
            return f"not in mode {station.mode}"
        if not self.armed:
            if self._due("arm", time, AGAIN):
                self._command(ARM, 1)
            return "not armed"
        if not station.climbs and self._due("takeoff", time, AGAIN):
            self._command(TAKEOFF, 0, 0, 0, 0, 0, 0, RISE)
        return "not lifted off"

    def _checked(self, time: float) -> bool:
        """Whether all is said about its parameters. Raises UserError for another frame than the vehicle's."""
        if self.checked:
            return True
        missing = [name for name in self.wanted if name not in self.found]
        if missing and time - self.heard_at < ANSWER:
            if self._due("parameters", time, AGAIN) and self.link:
                for name in missing:
                    self.link.mav.param_request_read_send(*self._target(), name.encode(), -1)
            return False
        self.checked = True
        other = {
            name: found
            for name, found in self.found.items()
            if not math.isclose(found, self.wanted[name], rel_tol=NEAR, abs_tol=1e-4)
        }

        def listed(names: list[str]) -> str:
            return ", ".join(f"{name} is {self.found[name]:g}, should be {self.wanted[name]:g}" for name in names)

        wrong = [name for name in other if name in self.frame]
        if wrong:
            raise UserError(f"{self.station.name} has a different frame from the mission's vehicle: {listed(wrong)}")
        if other:
            self.say(f"warning: {self.station.name}'s thrust curve is not the vehicle's: {listed(list(other))}")
        if missing:
            self.say(f"warning: {self.station.name} did not report its {', '.join(missing)}")
        return True

    def fly(self, sample: SensorSample) -> None:
        """One step in the air. sample: its time is the flight's. Raises Lost where the autopilot no longer follows."""
        assert self.start
        if sample.time == 0.0:
            self.next.clear()
            self.say(f"{self.station.name} lifted off after {self.start.time:.1f} s of simulated time")
        if not self._due("poll", sample.time, 1.0 / POLL):
            return
        self._hear(sample.time)
        if self.mode != self.station.reported or not self.armed:
            did = f"left mode {self.station.mode}" if self.armed else "disarmed"
            raise ConnectionLost(f"{self.station.name} {did}{': ' if self.reason else ''}{self.reason}")
        assert self.link
        self.risen |= self.station.climbs or self.start.position[2] - sample.position[2] >= RISEN
        with self._connected():
            self._show(sample.time)
            if self.risen and self._due("setpoint", sample.time, 1.0 / RATE):  # ArduPilot's take-off would end with a setpoint
                self._send(sample.time, self._setpoint(sample.time))

    def _setpoint(self, time: float, still: bool = False) -> Setpoint:
        reference = self.plan.loop.path.reference(min(time, self.duration), self.plan.parameters.path)
        return setpoint(self.plan, at_rest(reference) if still or time > self.duration else reference)

    def _send(self, time: float, one: Setpoint) -> None:
        x, y, z = (at + more for at, more in zip(one.position, self.offset, strict=True))
        assert self.link
        send(self.link, SetpointKind.POSITION, time, one._replace(position=(x, y, z)))

    def _due(self, what: str, time: float, every: float) -> bool:
        """Whether something is to be done again, once every so many seconds."""
        due = self.next.get(what, time)
        if time < due - 1e-9:
            return False
        self.next[what] = max(due, time - every) + every
        return True

    def _target(self) -> tuple[int, int]:
        assert self.link
        return self.link.target_system, self.link.target_component

    def _show(self, time: float) -> None:
        """That there is a ground station."""
        if self._due("heartbeat", time, AGAIN):
            assert self.link
            self.link.mav.heartbeat_send(6, 8, 0, 0, 0)

    def _command(self, number: int, *parameters: float) -> None:
        assert self.link
        self.link.mav.command_long_send(*self._target(), number, 0, *parameters, *(0.0,) * (7 - len(parameters)))

    def _hear(self, time: float) -> None:
        """Take in the messages that have come. Raises Lost where the connection is gone."""
        if not self.link:
            return
        with self._connected():
            while (message := self.link.recv_match()) is not None:
                if message.get_srcSystem() == self.link.target_system or message.get_type() == "HEARTBEAT":
                    self._take(message, time)

    @contextmanager
    def _connected(self) -> Iterator[None]:
        """Raises Lost where the connection goes."""
        try:
            yield
        except (OSError, UserError):
            raise ConnectionLost(f"{self.station.name} closed the MAVLink connection {self.where}") from None

    def _take(self, message: VehicleMessage, time: float) -> None:
        kind = message.get_type()
        if kind == "HEARTBEAT" and message.autopilot != 8:  # not a ground station
            self.heard_at = time if math.isnan(self.heard_at) else self.heard_at
            self.mode, self.armed = message.custom_mode, bool(message.base_mode & ARMED)
        elif kind == "PARAM_VALUE" and message.param_id in self.wanted:
            self.found[message.param_id] = value_of(message, self.station.bytewise)
        elif kind == "LOCAL_POSITION_NED":
            self.local = message.x, message.y, message.z
        elif kind == "STATUSTEXT" and message.severity <= WARNING:
            self.reason = " ".join(message.text.split())
        elif kind == "COMMAND_ACK":
            self._answered(message.command, message.result)

    def _answered(self, command: int, result: int) -> None:
        asked = {SET_MODE: "the mode", ARM: "arming", TAKEOFF: "the take-off"}.get(command)
        if asked and result in RESULTS:
            self.reason = self.reason or f"{asked} was {RESULTS[result]}"
        elif asked and result == 0:
            self.reason = ""
            if command == SET_MODE:
                self.mode = self.station.reported
            self.armed |= command == ARM
            if command == TAKEOFF:
                self.next["takeoff"] = math.inf


def value_of(message: VehicleMessage, bytewise: bool) -> float:
    """The value of a PARAM_VALUE. bytewise: whether whole numbers are sent as the bytes of a float."""
    if bytewise and message.param_type != REAL32:
        return float(struct.unpack("<i", struct.pack("<f", message.param_value))[0])
    return float(message.param_value)
