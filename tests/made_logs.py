"""Logs in the formats of autopilots, written byte by byte from a flight."""

import json
import struct

import numpy as np

from quadstep.identify.logs.flight import FlightRecord

FLIP = np.array([1.0, -1.0, -1.0])
MCAP_MAPPING = """
time = { column = "log_time" }
motors = { columns = ["/motors.c[0]", "/motors.c[1]", "/motors.c[2]", "/motors.c[3]"] }
[columns]
position = { columns = ["/state.p[0]", "/state.p[1]", "/state.p[2]"] }
velocity = { columns = ["/state.v[0]", "/state.v[1]", "/state.v[2]"] }
attitude = { columns = ["/state.q[0]", "/state.q[1]", "/state.q[2]", "/state.q[3]"] }
rates = { columns = ["/state.w[0]", "/state.w[1]", "/state.w[2]"] }
voltage = { columns = ["/state.volts"] }
"""
"""The mapping of what `mcap` writes."""


def frd(flight: FlightRecord):
    """Channels as PX4 and ArduPilot have them: north, east, down; forward, right, down; and quaternions from that to that."""
    channels = {name: flight.channels[name] * FLIP for name in ("position", "velocity", "rates")}
    return {**channels, "attitude": flight.channels["attitude"] * np.array([1.0, 1.0, -1.0, -1.0])}


def ulog(flight: FlightRecord, motors, parameters=(), **more) -> bytes:
    """A ULog; time in microseconds, each topic at a phase of its own. more: other topics."""
    known = frd(flight)
    topics = {
        "actuator_motors": ("float[12] control", np.pad(motors, ((0, 0), (0, 8)), constant_values=np.nan)),
        "vehicle_local_position": (
            "float x;float y;float z;float vx;float vy;float vz",
            np.concatenate([known["position"], known["velocity"]], axis=1),
        ),
        "vehicle_attitude": ("float[4] q", known["attitude"]),
        "vehicle_angular_velocity": ("float[3] xyz", known["rates"]),
        "battery_status": ("float voltage_v", flight.channels["voltage"]),
        **more,
    }
    return ulog_of(topics, flight.time, parameters)


def ulog_of(topics, time, parameters=()) -> bytes:
    """A ULog of topics by name, each with its fields and values (n, fields); parameters: names and values."""
    out = [b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0), message(b"B", bytes(40))]
    for name, (fields, _) in topics.items():
        out.append(message(b"F", f"{name}:uint64_t timestamp;{fields};".encode()))
    for name, value in parameters.items() if isinstance(parameters, dict) else parameters:
        key = f"float {name}".encode()
        out.append(message(b"P", bytes([len(key)]) + key + struct.pack("<f", value)))
    for number, name in enumerate(topics):
        out.append(message(b"A", struct.pack("<BH", 0, number) + name.encode()))
    for row, now in enumerate(time):
        for number, (_, values) in enumerate(topics.values()):
            stamp = round(1e6 * now) + 10 * number
            out.append(message(b"D", struct.pack("<HQ", number, stamp) + values[row].astype("<f4").tobytes()))
    return b"".join(out)


def rate_loop(setpoint, rate, command, period, parameters, alike=0.0, old=False, **more) -> bytes:
    """What PX4 logs of its roll's rate loop, each (n,). alike: what other axes do, as a share of it. old: before 1.14.
    more: other topics.
    """
    every = np.array([1.0, alike, alike])
    topics = {
        "vehicle_rates_setpoint": ("float roll;float pitch;float yaw", np.outer(setpoint, every)),
        "vehicle_angular_velocity": ("float[3] xyz", np.outer(rate, every)),
        **(
            {"actuator_controls_0": ("float[3] control", np.outer(command, every))}
            if old
            else {"vehicle_torque_setpoint": ("float[3] xyz", np.outer(command, every))}
        ),
    }
    return ulog_of({**topics, **more}, period * np.arange(len(setpoint)), parameters)


def message(kind: bytes, content: bytes) -> bytes:
    """A message of a ULog."""
    return struct.pack("<H", len(content)) + kind + content


def ardupilot(flight: FlightRecord, motors, **more) -> bytes:
    """An ArduPilot log. more: other messages."""
    known = frd(flight)
    w, x, y, z = known["attitude"].T
    angles = np.degrees(
        [
            np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
            np.arcsin(np.clip(2 * (w * y - z * x), -1, 1)),
            np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)),
        ]
    ).T
    pulses = np.round(1000 + 1000 * motors).astype(int)
    kinds = {
        "RCOU": (1, "QHHHH", "TimeUS,C1,C2,C3,C4", pulses),
        "ATT": (2, "Qfff", "TimeUS,Roll,Pitch,Yaw", angles),
        "XKF1": (3, "QBffffff", "TimeUS,C,PN,PE,PD,VN,VE,VD", np.concatenate([known["position"], known["velocity"]], axis=1)),
        "IMU": (4, "QBfff", "TimeUS,I,GyrX,GyrY,GyrZ", known["rates"]),
        "BAT": (5, "Qf", "TimeUS,Volt", flight.channels["voltage"]),
        **more,
    }
    out = [described(128, 89, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns")]
    for name, (number, layout, columns, _) in kinds.items():
        out.append(described(number, 3 + struct.calcsize("<" + layout), name, layout, columns))
    for row, time in enumerate(flight.time):
        for number, layout, _, values in kinds.values():
            core = (0,) if layout[1] == "B" else ()
            out.append(struct.pack("<BBB" + layout, 0xA3, 0x95, number, round(1e6 * time), *core, *values[row].tolist()))
    return b"".join(out)


def looped(crossover=20.0, period=0.004, duration=30.0):
    """Excitation, command and period of an integrating loop that answers a sample late, without a vehicle."""
    time = np.arange(0.0, duration, period)
    excitation = np.sin(2.0 * np.pi * 0.3 * duration / np.log(80.0) * (80.0 ** (time / duration) - 1.0))
    command, turned = np.zeros(len(time)), 0.0
    for row, one in enumerate(excitation):
        command[row] = one - turned
        turned += period * crossover * command[row]
    return excitation, command, period


def excited(excitation, command, period, parameters, output="ROut") -> bytes:
    """What ArduPilot logs in its mode System Identification, of one axis: excitation and command (n,). A command holds the
    excitation that was logged a loop earlier, and what is logged here.
    """
    parameters = {"SCHED_LOOP_RATE": 1.0 / period, **parameters}
    kinds = {"SIDD": (1, "Qff", "TimeUS,Time,Targ"), "RATE": (2, "Qff", f"TimeUS,RDes,{output}"), "PARM": (3, "QNff", "")}
    out = [described(128, 89, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns")]
    for name, (number, layout, columns) in kinds.items():
        length = 3 + struct.calcsize("<" + layout.replace("N", "16s"))
        out.append(described(number, length, name, layout, columns or "TimeUS,Name,Value,Default"))
    for name, value in parameters.items():
        out.append(struct.pack("<BBBQ16sff", 0xA3, 0x95, 3, 0, name.encode(), value, 0.0))
    later = np.append(excitation[1:], excitation[-1])
    for row, (d, u) in enumerate(zip(later, command, strict=True)):
        for number, value in ((1, d), (2, u)):
            out.append(struct.pack("<BBBQff", 0xA3, 0x95, number, round(1e6 * row * period), 0.0, value))
    return b"".join(out)


def described(number: int, length: int, name: str, layout: str, columns: str) -> bytes:
    """The message that says what another holds."""
    return struct.pack("<BBBBB4s16s64s", 0xA3, 0x95, 0x80, number, length, name.encode(), layout.encode(), columns.encode())


def mcap(path, flight: FlightRecord, motors, writing=None) -> None:
    """An MCAP file with JSON in it. writing: makes the writer of an open file; the library's own way if not given."""
    from mcap.writer import Writer

    with path.open("wb") as file:
        writer = (writing or Writer)(file)
        writer.start()
        schema = writer.register_schema("any", "jsonschema", b"{}")
        channels = {name: writer.register_channel(name, "json", schema) for name in ("/state", "/motors")}
        for row, time in enumerate(flight.time):
            place, speed, q, rates = (
                flight.channels[name][row].tolist() for name in ("position", "velocity", "attitude", "rates")
            )
            state = {"p": place, "v": speed, "q": q, "w": rates, "volts": float(flight.channels["voltage"][row, 0])}
            for name, content in (("/state", state), ("/motors", {"c": motors[row].tolist()})):
                stamp = round(1e9 * time)
                writer.add_message(channels[name], log_time=stamp, publish_time=stamp, data=json.dumps(content).encode())
        writer.finish()
