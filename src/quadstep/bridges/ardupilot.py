"""ArduPilot's JSON interface: it sends 16 pulse widths over UDP, and waits for the state that they lead to.

Its simulator is started by its user with `--model JSON:<host of quadstep>`; quadstep answers on port 9002.
"""

import struct
from time import monotonic

from quadstep.bridges.link import SHORTEST, WAIT, Address, ConnectionLost, SensorSample, datagrams
from quadstep.io.errors import UserError
from quadstep.mission.own_controller import FIRST_WAIT

PORT = 9002
PACKET = struct.Struct("<HHI16H")
"""Magic number, rate that it would like [Hz], count, pulse widths [us]."""

STATE = (
    '\n{"timestamp":%r,"imu":{"gyro":[%r,%r,%r],"accel_body":[%r,%r,%r]},"position":[%r,%r,%r],'
    '"quaternion":[%r,%r,%r,%r],"velocity":[%r,%r,%r]}\n'
)
"""What it is told, a line of JSON: written by hand in a fifth of the time of `json.dumps`, which was most of a sample's."""

MAGIC = 18458
LOW, HIGH = 1000.0, 2000.0
"""Pulse widths of a motor that stands and of one at its limit [us]."""


class ArduPilot:
    """A link to ArduPilot. Raises UserError where the port is in use."""

    period = 0.001

    def __init__(self, where: Address, first_wait: float = FIRST_WAIT, wait: float = WAIT) -> None:
        self.where, self.first_wait, self.wait = where, first_wait, wait
        self.peer: tuple[str, int] | None = None
        self.pulses: tuple[int, ...] = ()
        self.count = -1
        self.socket = datagrams(where)

    def meet(self, sample: SensorSample) -> None:
        try:
            self._hear(self.first_wait)
        except ConnectionLost:
            raise UserError(
                f"nothing from ArduPilot on {self.where} for {self.first_wait:g} s; start its simulator with --model JSON"
            ) from None

    def exchange(self, sample: SensorSample) -> list[float]:
        at, turning = (*sample.position, *sample.attitude, *sample.velocity), (*sample.rates, *sample.force)
        assert self.peer, "meet() knows it"
        self.socket.sendto((STATE % (sample.time, *turning, *at)).encode(), self.peer)
        self._hear(self.wait)
        return [(pulse - LOW) / (HIGH - LOW) for pulse in self.pulses]

    def _hear(self, wait: float) -> None:
        """Wait for the next pulse widths; once ArduPilot is known, only from it. Raises Lost, and UserError for another
        program instead of it.
        """
        until = monotonic() + wait
        while True:
            self.socket.settimeout(max(until - monotonic(), SHORTEST))
            try:
                data, peer = self.socket.recvfrom(4096)
            except (TimeoutError, ConnectionError):
                raise ConnectionLost("ArduPilot stopped sending") from None
            if monotonic() > until:
                raise ConnectionLost("ArduPilot sent nothing new")
            if self.peer and peer != self.peer:
                continue
            if len(data) != PACKET.size or PACKET.unpack(data)[0] != MAGIC:
                said = f"sent a malformed packet of {len(data)} bytes; ArduPilot's packets have {PACKET.size}"
                raise ConnectionLost(f"ArduPilot {said}") if self.peer else UserError(f"{peer[0]}:{peer[1]} {said}")
            _, _, count, *pulses = PACKET.unpack(data)
            if count != self.count:  # a repeated packet is an old one
                self.peer, self.count, self.pulses = peer, count, tuple(pulses)
                return

    def close(self) -> None:
        self.socket.close()
