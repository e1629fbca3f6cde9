"""Fake autopilots that speak the protocols of the real ones: they hold a vehicle where it is, or misbehave."""

import contextlib
import json
import math
import socket
import struct
import threading
from typing import ClassVar

from tests.patience import PATIENCE

CIRCLE = """
vehicle = { preset = "x500" }
path = { type = "circle", centre = [0.0, 0.0, 10.0], radius = 2.0, period = 8.0 }
simulation = { duration = 30.0, control_period = 0.001, step = 0.001 }
"""

HOVERING = """
[vehicle]
preset = "x500"
[path]
type = "step"
start = [0.0, 0.0, 5.0]
end = [0.0, 0.0, 5.0]
duration = {duration}
[wind]
mean = [1.0, 0.0, 0.0]
[simulation]
control_period = {period}
"""
"""A mission that a fake autopilot can fly."""

ABOVE = 0.1
"""Metres from where it stands to where a fake autopilot hovers."""

BOOT = 0.3
"""Seconds of its own time that a fake autopilot lets the vehicle stand before it starts the motors."""

PULSES = struct.Struct("<HHI16H")


def free_port(kind=socket.SOCK_DGRAM):
    with socket.socket(socket.AF_INET, kind) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def listening(port, autopilot=12, options=None):
    """A vehicle that says it is there, over UDP, and its GUID_OPTIONS."""
    from pymavlink import mavutil

    vehicle = mavutil.mavlink_connection(f"udpout:127.0.0.1:{port}", source_system=7)
    stop = threading.Event()

    def beat():
        while not stop.is_set():
            vehicle.mav.heartbeat_send(2, autopilot, 0, 0, 0)
            if options is not None:
                vehicle.mav.param_value_send(b"GUID_OPTIONS", options, 6, 1, 0)
            stop.wait(0.05)

    threading.Thread(target=beat, daemon=True).start()
    return vehicle, stop


GUIDED = {"ardupilot": (4, 4), "px4": (6, 6 << 16)}
"""The mode that follows setpoints, as it is asked for and as it is told."""


class FakeMavlink:
    """What an autopilot says to a ground station, and how it obeys. ORIGIN: of its local frame, in the mission's.

    parameters: by name. refuses: why it does not arm. stuck: whether it keeps its mode. leaves: seconds after take-off at
    which it does not, or hangs_up. deaf: whether it never says anything.
    """

    ORIGIN = (3.0, -2.0, -4.5)

    def __init__(self, name, parameters, refuses="", stuck=False, leaves=math.inf, hangs_up=math.inf, deaf=False):
        self.name, self.refuses, self.stuck, self.leaves, self.deaf = name, refuses, stuck, leaves, deaf
        self.parameters, self.hangs_up = parameters, hangs_up
        self.port = free_port(socket.SOCK_STREAM if name == "ardupilot" else socket.SOCK_DGRAM)
        self.address = f"{'tcp' if name == 'ardupilot' else 'udpin'}:127.0.0.1:{self.port}"
        self.mode, self.armed, self.lifted, self.told = 0, False, False, False
        self.asked, self.setpoints = [], []
        self.beat = self.place = -math.inf
        self.lifted_at = math.inf

    def open(self):
        from pymavlink import mavutil

        kind = "tcpin" if self.name == "ardupilot" else "udpout"
        self.link = mavutil.mavlink_connection(f"{kind}:127.0.0.1:{self.port}", source_system=1)
        return self.link

    def wait(self, stop):
        """As ArduPilot's simulator, which starts once somebody has connected."""
        while self.name == "ardupilot" and not self.deaf and self.link.port is None and not stop.is_set():
            self.link.recv_msg()
            stop.wait(0.01)

    def poll(self, time, position):
        """One step, at its own time. position: of the vehicle, in the mission's frame."""
        if time - self.lifted_at > self.hangs_up and self.link.port:
            self.link.port.close()
            self.deaf = True
        if self.deaf:
            return
        mav = self.link.mav
        if time - self.beat >= 0.1:
            self.beat = time
            if time - self.lifted_at > self.leaves:
                mav.statustext_send(4, b"Radio failsafe")
                self.mode = 9
            mav.heartbeat_send(2, 3 if self.name == "ardupilot" else 12, 1 | (128 if self.armed else 0), self.mode, 4)
        if self.told and time - self.place >= 0.05:
            self.place = time
            local = [at - of for at, of in zip(position, self.ORIGIN, strict=True)]
            mav.local_position_ned_send(round(1e3 * time), *local, 0.0, 0.0, 0.0)
        while (message := self.link.recv_msg()) is not None:
            self.obey(message, time)

    def obey(self, message, time):
        kind, mav = message.get_type(), self.link.mav
        if kind == "PARAM_REQUEST_READ" and message.param_id in self.parameters:
            value = self.parameters[message.param_id]
            whole = (
                self.name == "px4" and value == int(value) and not message.param_id.endswith(("PX", "PY", "PZ", "KM", "FAC"))
            )
            sent = struct.unpack("<f", struct.pack("<i", int(value)))[0] if whole else value
            mav.param_value_send(message.param_id.encode(), sent, 6 if whole else 9, len(self.parameters), 0)
        elif kind == "SET_POSITION_TARGET_LOCAL_NED":
            self.setpoints.append(message)
            if self.name == "px4" and self.armed and not self.lifted:
                self.lifted, self.lifted_at = True, time
        elif kind == "COMMAND_LONG":
            self.asked.append(message.command)
            mav.command_ack_send(message.command, self.result(message, time))

    def result(self, message, time):
        asked, said = GUIDED[self.name]
        if message.command == 511:
            self.told = True
        elif message.command == 176:
            if self.stuck or message.param2 != asked or (self.name == "px4" and not self.setpoints):
                return 2
            self.mode = said
        elif message.command == 400:
            if self.refuses:
                self.link.mav.statustext_send(2, self.refuses.encode())
                return 4
            self.armed = True
        elif message.command == 22:
            if not self.armed or message.param7 != 1.0:
                return 4
            self.lifted, self.lifted_at = True, time
        return 0


class Hover:
    """Outputs that hold the height and level a vehicle: hover, and feedback of attitude, rates, height and climb."""

    def __init__(self, plan):
        p, geometry = plan.parameters, plan.loop.plant.geometry
        self.allocation, self.geometry = p.allocation, geometry
        self.weight = float(p.airframe.mass * p.airframe.gravity)
        self.inertia = [float(one) for one in p.airframe.inertia]
        self.fastest = float(p.airframe.rotor.fastest)
        self.height, self.above = None, ABOVE

    def outputs(self, attitude, rates, down, sinking):
        from quadstep.numbers import Vector
        from quadstep.vehicle.allocation import allocate

        self.height = down - self.above if self.height is None else self.height
        w, x, y, z = attitude
        turn = [2.0 * x, 2.0 * y, 2.0 * z] if w > 0 else [-2.0 * x, -2.0 * y, -2.0 * z]
        torque = [j * (-80.0 * e - 16.0 * r) for j, e, r in zip(self.inertia, turn, rates, strict=True)]
        thrust = self.weight * (1.0 + 0.4 * (down - self.height) + 0.3 * sinking)
        speeds, _, _ = allocate(self.geometry, self.allocation, thrust, Vector((torque[0], -torque[1], -torque[2])))
        return [min(max(speed / self.fastest, 0.0), 1.0) for speed in speeds]


class FakeArduPilot(threading.Thread):
    """Sends pulse widths and reads JSON, in lockstep. silent_after: samples after which it says nothing more. mavlink: who
    lifts it; else it does so by itself.
    """

    def __init__(self, port, hover, silent_after=math.inf, garbage=False, flights=1, mavlink=None):
        super().__init__(daemon=True)
        self.port, self.hover, self.silent_after, self.garbage = port, hover, silent_after, garbage
        self.mavlink = mavlink
        self.seen, self.still = [], True
        self.stop = threading.Event()

    def run(self):
        with contextlib.ExitStack() as opened:
            link = opened.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
            link.settimeout(0.2)
            if self.mavlink:
                opened.enter_context(contextlib.closing(self.mavlink.open()))
                self.mavlink.wait(self.stop)
            outputs = [0.0] * 4
            count = 0
            while not self.stop.is_set() and len(self.seen) < self.silent_after:
                pulses = [round(1000 + 1000 * one) for one in outputs] + [1000] * 12
                packet = b"what?" if self.garbage else PULSES.pack(18458, 400, count, *pulses)
                link.sendto(packet, ("127.0.0.1", self.port))
                try:
                    state = json.loads(link.recv(4096))
                except (TimeoutError, OSError):
                    continue
                count += 1
                if self.seen and state["timestamp"] <= self.seen[-1]["timestamp"]:
                    self.seen.clear()  # "Detected physics reset": the next flight
                    self.hover.height = None
                self.seen.append(state)
                outputs = [0.0] * 4
                if self.mavlink:
                    self.mavlink.poll(state["timestamp"], state["position"])
                if not self.mavlink.lifted if self.mavlink else state["timestamp"] < BOOT:
                    self.still &= state["velocity"] == [0.0] * 3 and abs(state["imu"]["accel_body"][2] + 9.80665) < 1e-9
                    continue
                gyro, q = state["imu"]["gyro"], state["quaternion"]
                outputs = self.hover.outputs(q, gyro, state["position"][2], state["velocity"][2])


class FakePx4(threading.Thread):
    """Connects over TCP, reads HIL_SENSOR and answers HIL_ACTUATOR_CONTROLS. It has no attitude but the one it integrates.

    flights: how often it is started anew. mavlink: who lifts it; else it does so by itself.
    """

    STANDS = (0.1, 0.0, -5.0)
    """Where it believes the vehicle to be, in the mission's frame."""

    def __init__(self, port, hover, silent_after=math.inf, garbage=False, flights=1, mavlink=None):
        super().__init__(daemon=True)
        self.mavlink = mavlink
        self.port, self.hover, self.silent_after, self.garbage, self.flights = port, hover, silent_after, garbage, flights
        self.seen, self.fixes, self.still = [], [], True
        self.stop = threading.Event()

    def run(self):
        for _ in range(self.flights):
            self.fly()

    def fly(self):
        from pymavlink.dialects.v20 import common

        self.hover.height = None
        with contextlib.ExitStack() as opened:
            link = opened.enter_context(self._connected())
            if self.mavlink:
                opened.enter_context(contextlib.closing(self.mavlink.open()))
            if self.garbage:
                link.sendall(b"GET / HTTP/1.1\r\n" * 40)
                self.stop.wait(5.0)
                return
            mav = common.MAVLink(None, srcSystem=1, srcComponent=1)
            mav.robust_parsing = True
            self.turned, self.last, self.first = [0.0, 0.0, 0.0], None, None
            while not self.stop.is_set() and len(self.seen) < self.silent_after:
                try:
                    data = link.recv(4096)
                except OSError:
                    return
                if not data:
                    return
                for message in mav.parse_buffer(data) or []:
                    if message.get_type() == "HIL_GPS":
                        self.fixes.append(message)
                    if message.get_type() == "HIL_SENSOR":
                        self.answer(message, link, mav)
            self.stop.wait(30.0)

    def answer(self, message, link, mav):
        """Actuator controls for a sample, unless its clock stands still."""
        self.seen.append(message)
        time, last = message.time_usec, self.last
        if len(self.seen) >= self.silent_after or (last is not None and time <= last):
            return
        since = 0.0 if last is None else 1e-6 * (time - last)
        self.last, self.first = time, time if self.first is None else self.first
        rates = [message.xgyro, message.ygyro, message.zgyro]
        self.turned = [angle + since * rate for angle, rate in zip(self.turned, rates, strict=True)]
        attitude = (1.0, *(0.5 * angle for angle in self.turned))
        outputs = [0.0] * 4
        if self.mavlink:
            self.mavlink.poll(1e-6 * (time - self.first), self.STANDS)
        if not self.mavlink.lifted if self.mavlink else time - self.first < 1e6 * BOOT:
            self.still &= rates == [0.0] * 3 and abs(message.zacc + 9.80665) < 1e-5
        else:
            outputs = self.hover.outputs(attitude, rates, -message.pressure_alt, 0.0)
        link.sendall(mav.hil_actuator_controls_encode(time, outputs + [0.0] * 12, 128, 1).pack(mav))

    def _connected(self):
        for _ in range(round(PATIENCE / 0.05)):
            try:
                return socket.create_connection(("127.0.0.1", self.port), timeout=5.0)
            except OSError:
                self.stop.wait(0.05)
        raise AssertionError("nobody listens")


FAKES = {"ardupilot": (FakeArduPilot, socket.SOCK_DGRAM), "px4": (FakePx4, socket.SOCK_STREAM)}
"""Each, and its kind of socket."""


class FakeBetaflight(threading.Thread):
    """Hears states and sticks over UDP, answers with motors, and says its settings over MSP; follows rates by P alone.

    settings: bytes of its answers that differ. arms: whether its switch arms it. places: what it has in the place of each
    motor. silent_after: samples after which it says nothing more. off: whether its motors are.
    """

    ANSWERS: ClassVar = {
        1: [0, 1, 46],
        90: [1, 8],
        42: [3, 0],
        111: [7, 0, 67, 67, 67, 0, 50, 0, 0, 0, 0, 7, 7, 0, 0, 100, *[0] * 6, 3],
    }
    IDLE, GAIN, CURVE = 0.05, 0.1, (70.0, 600.0)

    def __init__(self, port, settings=(), arms=True, places=(0, 1, 2, 3), silent_after=math.inf, off=False):
        super().__init__(daemon=True)
        self.port, self.arms, self.places, self.silent_after, self.off = port, arms, places, silent_after, off
        self.answers = {question: list(answer) for question, answer in self.ANSWERS.items()}
        for question, byte, value in settings:
            self.answers[question][byte] = value
        self.stop, self.sticks, self.states, self.armings = threading.Event(), [], 0, []
        self.console = socket.create_server(("127.0.0.1", 0))
        self.console.settimeout(0.1)
        threading.Thread(target=self.talk, daemon=True).start()

    def talk(self):
        """MSP, one connection after the other."""
        while not self.stop.is_set():
            with contextlib.suppress(OSError), self.console.accept()[0] as peer, peer.makefile("rb") as stream:
                while head := stream.read(6):
                    answer = self.answers[head[4]]
                    sent = bytes((len(answer), head[4], *answer))
                    check = 0
                    for byte in sent:
                        check ^= byte
                    peer.sendall(b"$M>" + sent + bytes((check,)))
        self.console.close()

    def run(self):
        with contextlib.ExitStack() as opened:
            heard, sticks = (opened.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) for _ in range(2))
            heard.bind(("127.0.0.1", self.port + 1))
            sticks.bind(("127.0.0.1", self.port + 2))
            heard.settimeout(0.1)
            sticks.setblocking(False)
            while not self.stop.is_set():
                try:
                    state = struct.unpack("<18d", heard.recv(4096))
                except TimeoutError:
                    continue
                self.states += 1
                self.hear(sticks)
                if self.states <= self.silent_after and not (self.off and self.states > 1):
                    heard.sendto(struct.pack("<4f", *self.motors(state[1:4])), ("127.0.0.1", self.port))
            self.hear(sticks)

    def hear(self, sticks):
        with contextlib.suppress(BlockingIOError):
            while True:
                self.sticks = struct.unpack("<d16H", sticks.recv(4096))[1:]
                self.armings.append(self.sticks[4] > 1700)

    def motors(self, rates):
        """Front right, back left, front left, back right. rates: to the right, nose up, to the right [rad/s]."""
        if not (self.arms and self.sticks and self.sticks[4] > 1700):
            return [0.0] * 4
        roll, pitch, throttle, yaw = ((stick - 1500.0) / 500.0 for stick in self.sticks[:4])
        asked = [self.CURVE[0] * x + self.CURVE[1] * x * abs(x) for x in (roll, pitch, yaw)]
        turn = [math.radians(one) for one in asked]
        roll, pitch, yaw = (self.GAIN * one for one in (turn[0] - rates[0], turn[1] + rates[1], 2.0 * (turn[2] - rates[2])))
        lift = self.IDLE + (1.0 - self.IDLE) * max(500.0 * throttle + 450.0, 0.0) / 950.0
        signs = (-1, -1, 1), (1, 1, 1), (1, -1, -1), (-1, 1, -1)
        shares = [min(max(lift + r * roll + p * pitch + y * yaw, self.IDLE), 1.0) for r, p, y in signs]
        return [shares[place] for place in self.places]
