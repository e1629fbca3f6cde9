"""Fake autopilots that speak the protocols of the real ones: they hold a vehicle where it is, or misbehave."""

import json
import math
import socket
import struct
import threading

from tests.patience import PATIENCE

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


def listening(port):
    """A vehicle that says it is there, over UDP."""
    from pymavlink import mavutil

    vehicle = mavutil.mavlink_connection(f"udpout:127.0.0.1:{port}", source_system=7)
    stop = threading.Event()

    def beat():
        while not stop.is_set():
            vehicle.mav.heartbeat_send(2, 12, 0, 0, 0)
            stop.wait(0.05)

    threading.Thread(target=beat, daemon=True).start()
    return vehicle, stop


class Hover:
    """Outputs that hold the height and level a vehicle: hover, and feedback of attitude, rates, height and climb."""

    def __init__(self, plan):
        p, geometry = plan.parameters, plan.loop.plant.geometry
        self.allocation, self.geometry = p.allocation, geometry
        self.weight = float(p.airframe.mass * p.airframe.gravity)
        self.inertia = [float(one) for one in p.airframe.inertia]
        self.fastest = float(p.airframe.rotor.fastest)
        self.height = None

    def outputs(self, attitude, rates, down, sinking):
        from quadstep.numbers import Vector
        from quadstep.vehicle.airframe.allocation import allocate

        self.height = down - ABOVE if self.height is None else self.height
        w, x, y, z = attitude
        turn = [2.0 * x, 2.0 * y, 2.0 * z] if w > 0 else [-2.0 * x, -2.0 * y, -2.0 * z]
        torque = [j * (-80.0 * e - 16.0 * r) for j, e, r in zip(self.inertia, turn, rates, strict=True)]
        thrust = self.weight * (1.0 + 0.4 * (down - self.height) + 0.3 * sinking)
        speeds, _, _ = allocate(self.geometry, self.allocation, thrust, Vector((torque[0], -torque[1], -torque[2])))
        return [min(max(speed / self.fastest, 0.0), 1.0) for speed in speeds]


class FakeArduPilot(threading.Thread):
    """Sends pulse widths and reads JSON, in lockstep. silent_after: samples after which it says nothing more."""

    def __init__(self, port, hover, silent_after=math.inf, garbage=False, flights=1):
        super().__init__(daemon=True)
        self.port, self.hover, self.silent_after, self.garbage = port, hover, silent_after, garbage
        self.seen, self.still = [], True
        self.stop = threading.Event()

    def run(self):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
            link.settimeout(0.2)
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
                if state["timestamp"] < BOOT:
                    self.still &= state["velocity"] == [0.0] * 3 and abs(state["imu"]["accel_body"][2] + 9.80665) < 1e-9
                    continue
                gyro, q = state["imu"]["gyro"], state["quaternion"]
                outputs = self.hover.outputs(q, gyro, state["position"][2], state["velocity"][2])


class FakePx4(threading.Thread):
    """Connects over TCP, reads HIL_SENSOR and answers HIL_ACTUATOR_CONTROLS. It has no attitude but the one it integrates.

    flights: how often it is started anew.
    """

    def __init__(self, port, hover, silent_after=math.inf, garbage=False, flights=1):
        super().__init__(daemon=True)
        self.port, self.hover, self.silent_after, self.garbage, self.flights = port, hover, silent_after, garbage, flights
        self.seen, self.fixes, self.still = [], [], True
        self.stop = threading.Event()

    def run(self):
        for _ in range(self.flights):
            self.fly()

    def fly(self):
        from pymavlink.dialects.v20 import common

        self.hover.height = None
        with self._connected() as link:
            if self.garbage:
                link.sendall(b"GET / HTTP/1.1\r\n" * 40)
                self.stop.wait(5.0)
                return
            mav = common.MAVLink(None, srcSystem=1, srcComponent=1)
            mav.robust_parsing = True
            turned, last, first = [0.0, 0.0, 0.0], None, None
            while not self.stop.is_set():
                try:
                    data = link.recv(4096)
                except OSError:
                    return
                if not data:
                    return
                for message in mav.parse_buffer(data) or []:
                    if message.get_type() == "HIL_GPS":
                        self.fixes.append(message)
                    if message.get_type() != "HIL_SENSOR":
                        continue
                    self.seen.append(message)
                    if len(self.seen) >= self.silent_after:
                        self.stop.wait(30.0)
                        return
                    if last is not None and message.time_usec <= last:
                        continue  # its clock stands still, and it answers nothing
                    since = 0.0 if last is None else 1e-6 * (message.time_usec - last)
                    last = message.time_usec
                    first = last if first is None else first
                    rates = [message.xgyro, message.ygyro, message.zgyro]
                    turned = [angle + since * rate for angle, rate in zip(turned, rates, strict=True)]
                    attitude = (1.0, *(0.5 * angle for angle in turned))
                    outputs = [0.0] * 4
                    if last - first < 1e6 * BOOT:
                        self.still &= rates == [0.0] * 3 and abs(message.zacc + 9.80665) < 1e-5
                    else:
                        outputs = self.hover.outputs(attitude, rates, -message.pressure_alt, 0.0)
                    answer = mav.hil_actuator_controls_encode(message.time_usec, outputs + [0.0] * 12, 128, 1)
                    link.sendall(answer.pack(mav))

    def _connected(self):
        for _ in range(round(PATIENCE / 0.05)):
            try:
                return socket.create_connection(("127.0.0.1", self.port), timeout=5.0)
            except OSError:
                self.stop.wait(0.05)
        raise AssertionError("nobody listens")


FAKES = {"ardupilot": (FakeArduPilot, socket.SOCK_DGRAM), "px4": (FakePx4, socket.SOCK_STREAM)}
"""Each, and its kind of socket."""
