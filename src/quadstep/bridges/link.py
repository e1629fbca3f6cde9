"""The link to an autopilot through a socket: each sample it sends sensor data and receives rotor speeds."""

import math
import signal
import socket
import threading
from collections.abc import Callable, Iterable
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from quadstep.io.errors import UserError
from quadstep.mission.own_controller import FIRST_WAIT
from quadstep.numbers import Vector
from quadstep.numbers.rotations import rotation_matrix

HERE = "127.0.0.1"

STOPPING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
"""Ctrl-C, and requests to end."""


class Address(NamedTuple):
    host: str
    port: int

    def __str__(self) -> str:
        return f"{self.host}:{self.port}"


def refuse_strange(text: str, colons: int, allowed: str) -> None:
    """Refuses an address with spaces or of IPv6. colons: as many as an address may have. Raises UserError."""
    if any(sign.isspace() for sign in text):
        raise UserError(f"{text!r}: should have no spaces; allowed: {allowed}")
    if text.count(":") > colons or "[" in text:
        raise UserError(f"{text}: IPv6 is not supported; allowed: {allowed}, HOST a name or an IPv4 address")


def address(text: str, usual: int) -> Address:
    """The address that a text means. usual: the port where none is said. Raises UserError."""
    refuse_strange(text, 1, "PORT or HOST:PORT")
    host, _, port = text.rpartition(":") if ":" in text else ("", "", text) if text.isdigit() else (text, "", "")
    if port and not (port.isascii() and port.isdigit() and 0 < int(port) < 65536):
        raise UserError(f"{text}: the port should be a number from 1 to 65535; allowed: PORT or HOST:PORT")
    return Address(host or HERE, int(port) if port else usual)


def datagrams(where: Address) -> socket.socket:
    """A socket that hears datagrams there. Raises UserError where the port is in use."""
    found = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        found.bind(where)
    except OSError as error:
        found.close()
        raise UserError(f"{where}: cannot listen there: {error.strerror or error}") from None
    return found


GRAVITY = 9.80665

STANDING = 600.0
"""Seconds of its own time that an autopilot may leave the vehicle on the ground before it lifts it."""

WAIT = 5.0
"""Seconds that an autopilot may be silent in flight."""


SHORTEST = 1e-6
"""Seconds that a socket waits where no time is left: 0 would mean that it never waits."""


class SensorSample(NamedTuple):
    """What sensors say, in the axes of autopilots: north, east, down; front, right, down.

    time [s]. position [m], velocity [m/s]: world. attitude: (w, x, y, z), body to world. rates [rad/s], force: specific force
    [m/s^2], body.
    """

    time: float
    position: tuple[float, float, float]
    velocity: tuple[float, float, float]
    attitude: tuple[float, float, float, float]
    rates: tuple[float, float, float]
    force: tuple[float, float, float]

    def standing(self, time: float) -> "SensorSample":
        """At rest on level ground at this place and heading."""
        w, _, _, z = self.attitude
        size = math.hypot(w, z) or 1.0
        still = (0.0, 0.0, 0.0)
        return SensorSample(time, self.position, still, (w / size, 0.0, 0.0, z / size), still, (0.0, 0.0, -GRAVITY))

    def into_body(self, vector: tuple[float, float, float]) -> tuple[float, float, float]:
        """A vector of the world in body axes."""
        x, y, z = rotation_matrix(Vector(self.attitude)).T @ Vector(vector)
        return x, y, z


class ConnectionLost(Exception):  # noqa: N818 (it is no error of ours)
    """The autopilot stopped sending or closed the connection in flight."""


class AutopilotLink(Protocol):
    """A connection to an autopilot. period: from one sample to the next while the vehicle stands [s]."""

    period: float

    def meet(self, sample: SensorSample) -> None:
        """Wait until it is there. sample: standing at the start. Raises UserError where it does not come."""
        ...

    def exchange(self, sample: SensorSample) -> list[float]:
        """Tell a sample, and get the outputs, 0 to 1. Raises Lost, for a malformed packet too."""
        ...

    def close(self) -> None: ...


class GroundStation(Protocol):
    """Who leads the autopilot: told of each sample before the autopilot is."""

    def why(self) -> str:
        """Why it does not reach the autopilot; empty where it does."""
        ...

    def stand(self, sample: SensorSample) -> str:
        """One on the ground; what it waits for, which may be empty. Raises UserError, and Lost."""
        ...

    def fly(self, sample: SensorSample) -> None:
        """One in the air, with the flight's time. Raises Lost."""
        ...

    def close(self) -> None: ...


class PilotFunction:
    """The function that a flight asks: 17 numbers of a sample in, a share of full speed for each rotor out.

    connect: makes a new link for each flight, given how long to wait for it [s]. order: of the vehicle's rotors in its
    answers. last: the last one, in the vehicle's order. lost: why the last flight ended before its
    time; empty where it did not. told: of what is waited for. pilot: makes who leads the autopilot; None where its user does.
    kept: whether Ctrl-C or a request to end only ends the flight in the air, since its log is kept; else it raises as ever.
    """

    def __init__(self, connect: Callable[[float], AutopilotLink], order: tuple[int, ...] = ()) -> None:
        self.connect, self.order, self.rotors, self.lost = connect, order, 0, ""
        self.last: list[float] = []
        self.first_wait = FIRST_WAIT
        self.say: Callable[[str], None] = lambda _: None
        self.link: AutopilotLink | None = None
        self.pilot: Callable[[], GroundStation] | None = None
        self.station: GroundStation | None = None
        self.kept = self._interrupted = False
        self._before: dict[int, object] = {}
        self.stood = 0.0
        self._asked, self._answer = b"", [0.0]

    def begin(self, sample: SensorSample, rotors: int, lift: float) -> None:
        """Before a flight: wait until the autopilot is there, and let the vehicle stand until the autopilot lifts it.

        lift: the sum of the squares of the rotors' shares that carries the weight. Raises UserError.
        """
        self.end()
        self.rotors, self.lost, self._asked, self.stood, self.last = rotors, "", b"", 0.0, [0.0] * rotors
        self.link = self.connect(self.first_wait)
        try:
            self.say("waiting for the autopilot")
            self.station = self.pilot() if self.pilot else None
            try:
                self.link.meet(sample.standing(0.0))
            except UserError as error:
                why = self.station.why() if self.station else ""
                raise UserError(f"{error}{'; ' if why else ''}{why}") from None
            self.stand(self.link, sample, lift)
            self._hold()
        except BaseException:
            self.end()
            raise

    def stand(self, link: AutopilotLink, sample: SensorSample, lift: float) -> None:
        """On the ground until the rotors carry the weight. The flight's clock starts then; the autopilot's goes on."""
        doing = "standing until the autopilot takes off"
        for count in range(round(STANDING / link.period)):
            time = count * link.period
            try:
                doing = (self.station and self.station.stand(sample.standing(time))) or doing
                if count % round(1.0 / link.period) == 0:
                    self.say(f"{doing}: {time:.0f} s of simulated time")
                shares = self.within(link.exchange(sample.standing(time)))
            except ConnectionLost as error:
                raise UserError(f"{error} after {time:g} s on the ground, before it took off") from None
            self.stood = time + link.period
            if sum(one * one for one in shares) >= lift:
                return
        raise UserError(
            f"the autopilot did not take off within {STANDING:g} s of simulated time; arm it and command a takeoff"
        )

    def within(self, outputs: list[float]) -> list[float]:
        """The rotors' shares of full speed, in the vehicle's order."""
        shares = [min(max(one, 0.0), 1.0) for one in outputs[: self.rotors]]
        self.last = [shares[self.order.index(rotor)] for rotor in range(len(shares))] if self.order else shares
        return self.last

    def _hold(self) -> None:
        """From now on `STOPPING` are a flag: an exception at any instruction of a call from compiled code would be lost."""
        self._interrupted = False
        if self.kept and threading.current_thread() is threading.main_thread():
            heeded = [number for number in STOPPING if signal.getsignal(number) is not signal.SIG_IGN]
            self._before = {number: signal.signal(number, self._interrupt) for number in heeded}

    def _interrupt(self, _number: int, _frame: object) -> None:
        self._interrupted = True

    def end(self) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)  # type: ignore[arg-type]
        self._before = {}
        for one in (self.link, self.station):
            if one:
                one.close()
        self.link = self.station = None

    def __call__(self, inputs: NDArray[np.float64]) -> list[float]:
        question = inputs.tobytes()
        if question == self._asked:  # lanes fill up a block with one flight
            return self._answer
        sample = sample_of(inputs)
        self._asked = question
        outputs: list[float] = []
        if self._interrupted:
            self.lost = self.lost or f"Interrupted at {sample.time:g} s"
        try:
            if self.station and not self.lost:
                self.station.fly(sample)
            if self.link and not self.lost:
                outputs = self.link.exchange(sample._replace(time=self.stood + sample.time))
        except ConnectionLost as error:
            self.lost = f"{error} at {sample.time:g} s"
        shares = self.within(outputs)
        self._answer = shares if len(shares) == self.rotors else [math.nan] * self.rotors
        return self._answer


def sample_of(inputs: Iterable[float]) -> SensorSample:
    """A sample from our axes, z up and front, left, up."""
    t, px, py, pz, vx, vy, vz, w, x, y, z, p, q, r, fx, fy, fz = (float(one) for one in inputs)
    return SensorSample(t, (px, -py, -pz), (vx, -vy, -vz), (w, x, -y, -z), (p, -q, -r), (fx, -fy, -fz))
