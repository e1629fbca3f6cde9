"""Whatever arrives at an autopilot's socket: a flight goes on, or is lost with the reason; nothing waits without end."""

import contextlib
import math
import socket
import threading

import pytest

from quadstep.bridges.ardupilot import ArduPilot
from quadstep.bridges.link import Address, ConnectionLost, SensorSample
from quadstep.bridges.px4 import Px4
from tests.autopilots import PULSES, free_port
from tests.needs import package

package("pymavlink")

from pymavlink.dialects.v20 import common  # noqa: E402 (skipped without)

SAMPLE = SensorSample(0.0, (0.0,) * 3, (0.0,) * 3, (1.0, 0.0, 0.0, 0.0), (0.0,) * 3, (0.0, 0.0, -9.8))


@contextlib.contextmanager
def met_by_ardupilot():
    """A link that has met a program that speaks as ArduPilot does, its socket, and its address."""
    port = free_port()
    link = ArduPilot(Address("127.0.0.1", port), first_wait=2.0, wait=0.1)
    with contextlib.closing(link), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.sendto(PULSES.pack(18458, 400, 0, *[1000] * 16), ("127.0.0.1", port))
        link.meet(SAMPLE)
        yield link, other, ("127.0.0.1", port)


def test_ardupilot_is_heard_whoever_else_sends():
    with met_by_ardupilot() as (link, other, where), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        for content in (b"", b"what?", PULSES.pack(18458, 400, 7, *[2000] * 16), b"\\0" * 4096):
            stranger.sendto(content, where)
        other.sendto(PULSES.pack(18458, 400, 1, *[1500] * 16), where)
        assert link.exchange(SAMPLE)[:4] == [0.5] * 4


@pytest.mark.parametrize("content", [b"", b"what?", PULSES.pack(1, 400, 1, *[1500] * 16)], ids=["empty", "short", "magic"])
def test_garbage_from_ardupilot_in_flight_loses_the_flight(content):
    with met_by_ardupilot() as (link, other, where):
        other.sendto(content, where)
        with pytest.raises(ConnectionLost, match="malformed packet"):
            link.exchange(SAMPLE)


def test_an_ardupilot_that_repeats_itself_is_not_waited_for_without_end():
    with met_by_ardupilot() as (link, other, where):
        stop = threading.Event()

        def repeat():
            while not stop.is_set():
                other.sendto(PULSES.pack(18458, 400, 0, *[1500] * 16), where)
                stop.wait(0.001)

        thread = threading.Thread(target=repeat)
        thread.start()
        try:
            with pytest.raises(ConnectionLost, match="ArduPilot s"):
                link.exchange(SAMPLE)
        finally:
            stop.set()
            thread.join()


@contextlib.contextmanager
def joined_by_px4():
    """A link that a program has connected to, and that program's socket."""
    link = Px4(Address("127.0.0.1", free_port(socket.SOCK_STREAM)), first_wait=2.0, wait=0.1)
    with contextlib.closing(link), socket.create_connection(link.where) as other:
        link.peer, _ = link.server.accept()
        yield link, other


@pytest.mark.parametrize(("sent", "said"), [
    (lambda mav: b"GET / HTTP/1.1\\r\\n" * 40, "does not speak MAVLink"),
    (lambda mav: mav.hil_actuator_controls_encode(1, [math.nan] * 16, 1, 0).pack(mav), "controls that are not numbers"),
    (lambda mav: mav.hil_actuator_controls_encode(1, [math.inf] * 16, 1, 0).pack(mav), "controls that are not numbers"),
    (lambda mav: b"", "PX4 stopped sending"),
    (lambda mav: mav.heartbeat_encode(2, 12, 0, 0, 0).pack(mav) * 50, "PX4 stopped sending"),
    (lambda mav: mav.hil_actuator_controls_encode(1, [0.5] * 16, 1, 0).pack(mav)[:-3], "PX4 stopped sending"),
], ids=["http", "nan", "infinite", "nothing", "heartbeats", "half a message"])  # fmt: skip
def test_garbage_from_px4_in_flight_loses_the_flight(sent, said):
    with joined_by_px4() as (link, other):
        other.sendall(sent(common.MAVLink(None, srcSystem=1, srcComponent=1)))
        with pytest.raises(ConnectionLost, match=said):
            link.exchange(SAMPLE)
