"""PX4's interface of simulators: MAVLink over TCP in lockstep. PX4 connects, is sent HIL_SENSOR, answers actuator controls.

Its simulation is started by its user (`make px4_sitl none_iris`); quadstep listens on port 4560 before that.
"""

import math
import socket
from time import monotonic
from typing import Protocol, cast

from quadstep.bridges.link import SHORTEST, WAIT, Address, ConnectionLost, SensorSample
from quadstep.io.doors import optional
from quadstep.io.errors import UserError
from quadstep.mission.own_controller import FIRST_WAIT

PORT = 4560

LATITUDE, LONGITUDE, HEIGHT = 47.397742, 8.545594, 488.0
"""Of the world's origin [deg, deg, m]: PX4's own."""

METRES_A_DEGREE = 111_319.49
FIELD = (0.215, 0.0096, 0.4289)
"""The magnetic field there, north, east, down [gauss]."""

EVERYTHING = 0x1FFF
"""All fields of HIL_SENSOR are new."""

GPS_EVERY = 0.1
"""Seconds from one HIL_GPS to the next."""

PRESSURE_NOISE, FIELD_NOISE, WARMTH_NOISE = 0.01, 0.0005, 0.01
"""Largest of sensors that are never still [hPa, gauss, deg C]: PX4 calls one that repeats its value stale."""


def shake(count: int, stream: int) -> float:
    """Noise from -1 to 1, the same in every flight: the fractional parts of multiples of irrational numbers."""
    return 2.0 * ((count * IRRATIONALS[stream]) % 1.0) - 1.0


IRRATIONALS = tuple(math.sqrt(one) for one in (2.0, 3.0, 5.0, 7.0, 11.0))


class Message(Protocol):
    """A message of MAVLink, as far as it is asked here."""

    controls: list[float]

    def get_type(self) -> str: ...


class Px4:
    """A link to PX4. Raises UserError where the port is in use, and where pymavlink is not installed."""

    period = 0.004

    def __init__(self, where: Address, first_wait: float = FIRST_WAIT, wait: float = WAIT) -> None:
        common = optional("flying under PX4", "pymavlink.dialects.v20.common")
        self.where, self.first_wait, self.wait = where, first_wait, wait
        self.mav = common.MAVLink(self, srcSystem=1, srcComponent=51)
        self.mav.robust_parsing = True
        self.peer: socket.socket | None = None
        self.gps_at = -math.inf
        self.behind = 0.0
        self.count = 0
        self.server = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        self.server.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            self.server.bind(where)
            self.server.listen(1)
        except OSError as error:
            self.server.close()
            raise UserError(f"{where}: cannot listen there: {error.strerror or error}") from None

    def write(self, data: bytes) -> None:
        assert self.peer
        try:
            self.peer.sendall(data)
        except OSError:
            raise ConnectionLost("PX4 closed the connection") from None

    def meet(self, sample: SensorSample) -> None:
        """PX4 connects, and starts to answer after some samples at rest."""
        self.server.settimeout(self.first_wait)
        try:
            self.peer, _ = self.server.accept()
        except TimeoutError:
            raise UserError(f"no PX4 connected to {self.where} in {self.first_wait:g} s; start its simulation") from None
        self.server.close()  # whoever connects while this flight lasts is refused, and not kept for after it
        self.peer.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        for number in range(round(self.first_wait / self.period)):
            self.behind = number * self.period
            try:
                self._tell(sample)
                if self._hear(0.02) is not None:
                    self.behind += self.period  # a time stamp is never repeated: PX4's clock would stand still
                    return
            except ConnectionLost as error:
                raise UserError(f"{error} before the flight") from None
        raise UserError(f"PX4 on {self.where} sent no actuator controls")

    def exchange(self, sample: SensorSample) -> list[float]:
        self._tell(sample)
        controls = self._hear(self.wait)
        if controls is None:
            raise ConnectionLost("PX4 stopped sending")
        return controls

    def _tell(self, sample: SensorSample) -> None:
        """The sensors, and now and then the satellites."""
        time = 1_000_000 + round(1e6 * (sample.time + self.behind))
        north, east, down = sample.position
        height = HEIGHT - down
        pressure = 1013.25 * (1.0 - 2.25577e-5 * height) ** 5.25588  # hPa, of the standard atmosphere
        self.count += 1
        shaken = [shake(self.count, stream) for stream in range(5)]
        field = [one + FIELD_NOISE * by for one, by in zip(sample.into_body(FIELD), shaken, strict=False)]
        pressure, warmth = pressure + PRESSURE_NOISE * shaken[3], 15.0 + WARMTH_NOISE * shaken[4]
        self.mav.hil_sensor_send(time, *sample.force, *sample.rates, *field, pressure, 0.0, height, warmth, EVERYTHING)
        if time * 1e-6 - self.gps_at >= GPS_EVERY:
            self.gps_at = time * 1e-6
            latitude = LATITUDE + north / METRES_A_DEGREE
            longitude = LONGITUDE + east / (METRES_A_DEGREE * math.cos(math.radians(LATITUDE)))
            speed = math.hypot(sample.velocity[0], sample.velocity[1])
            course = math.degrees(math.atan2(sample.velocity[1], sample.velocity[0])) % 360.0
            self.mav.hil_gps_send(
                time, 3, round(1e7 * latitude), round(1e7 * longitude), round(1e3 * height), 100, 100, round(100 * speed),
                *(round(100 * one) for one in sample.velocity), round(100 * course), 12,
            )  # fmt: skip

    def _hear(self, wait: float) -> list[float] | None:
        """The next actuator controls; None where none come in time, whatever else does. Raises Lost."""
        assert self.peer
        until = monotonic() + wait
        while (left := until - monotonic()) > 0.0:
            self.peer.settimeout(max(left, SHORTEST))
            try:
                data = self.peer.recv(4096)
            except TimeoutError:
                return None
            except OSError:
                data = b""
            if not data:
                raise ConnectionLost("PX4 closed the connection")
            for message in cast(list[Message], self.mav.parse_buffer(data) or []):
                if message.get_type() == "BAD_DATA":
                    raise ConnectionLost(f"the program that connected to {self.where} does not speak MAVLink")
                if message.get_type() == "HIL_ACTUATOR_CONTROLS":
                    if not all(map(math.isfinite, message.controls)):
                        raise ConnectionLost("PX4 sent controls that are not numbers")
                    return [float(one) for one in message.controls]
        return None

    def close(self) -> None:
        if self.peer:
            self.peer.close()
        self.server.close()
