"""Flights of a vehicle whose every number is known, logged as a real one is: noise, lag, jitter."""

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np

from quadstep import Mission, fly_all
from quadstep.identify.flown_setpoints import thrust_ratios
from quadstep.identify.logs.flight import FlightRecord, Floats
from quadstep.identify.parameters import GROWS
from quadstep.mission.airframe import AirframeSection
from quadstep.mission.presets import preset_table
from quadstep.vehicle.allocation import allocation
from tests.quick_gains import QUICK

PERIOD = 0.01
TRUTH = {
    "command.speed": 2900.0,
    "command.exponent": 0.95,
    "command.voltage_exponent": 1.0,
    "rotor.rise_time": 0.04,
    "command.delay": 0.013,  # 12 ms, and one of the two for which a command is held
    "inertia[0]": 2.6e-5,
    "inertia[1]": 2.2e-5,
    "rotor.torque_coefficient": 1.8e-10,
    "rotor.inertia": 5.0e-8,
    "drag.rotor[0]": 1.6e-6,
    "drag.rotor[2]": 1.2e-6,
    "drag.flapping": 4.0e-8,
    "centre_of_gravity[0]": 4.0e-4,
    "centre_of_gravity[1]": -6.0e-4,
    "imu.tilt[0]": 0.006,
    "imu.tilt[1]": -0.015,
}
NOMINAL = 3.8
RATE = 1.3 / (TRUTH["rotor.rise_time"] + TRUTH["command.delay"])
PID = {
    "type": "pid",
    "position": 5.0,
    "velocity": 6.2,
    "velocity_integral": 5.2,
    "rate": [RATE, RATE, 0.4 * RATE],
    "rate_derivative": [RATE * TRUTH["rotor.rise_time"]] * 2 + [0.0],
    "rate_filter": 200.0,
    "rate_integral": 1.0,
    "attitude": [0.36 * RATE, 0.36 * RATE, 0.16 * RATE],
}
"""As fast as its rotors allow; quick gains shake this vehicle."""


def start() -> AirframeSection:
    """What an identification begins with: the preset, wrong in everything that is to be found."""
    return AirframeSection.model_validate(preset_table("crazyflie"))


def misgiven(vehicle: AirframeSection, mass: float, thrust: float, about_z: float) -> AirframeSection:
    """A vehicle with what no flight reveals, mass, thrust coefficient and inertia about z, times these."""
    x, y, z = vehicle.inertia
    rotor = vehicle.rotor.model_copy(update={"thrust_coefficient": thrust * vehicle.rotor.thrust_coefficient})
    return vehicle.model_copy(update={"mass": mass * vehicle.mass, "inertia": (x, y, about_z * z), "rotor": rotor})


def wrong_start() -> AirframeSection:
    """The same, also wrong in what no flight reveals."""
    return misgiven(start(), 1.1, 0.8, 0.75)


def true_vehicle() -> dict[str, Any]:
    """The vehicle that is flown, as a table."""
    table = preset_table("crazyflie")
    shift = np.array([TRUTH["centre_of_gravity[0]"], TRUTH["centre_of_gravity[1]"], 0.0])
    table["rotors"] = [{**one, "position": (np.array(one["position"]) - shift).tolist()} for one in table["rotors"]]
    table["inertia"] = [TRUTH["inertia[0]"], TRUTH["inertia[1]"], table["inertia"][2]]
    lag, drag = TRUTH["rotor.rise_time"], TRUTH["drag.rotor[0]"]
    table["rotor"] |= {"torque_coefficient": TRUTH["rotor.torque_coefficient"], "inertia": TRUTH["rotor.inertia"]}
    table["rotor"] |= {"rise_time": lag, "fall_time": lag, "slowest": 300.0, "fastest": 3200.0}
    table["drag"] |= {"rotor": [drag, drag, TRUTH["drag.rotor[2]"]], "flapping": TRUTH["drag.flapping"]}
    table.pop("sources")
    table["effects"] = {"battery": False}
    return table


def missions(seed: int, guidance: float, shaken: bool) -> list[Mission]:
    """Four flights along different paths. guidance: period of the position loop [s]. shaken: at quick gains."""
    paths: list[dict[str, Any]] = [
        {"type": "figure-eight", "centre": [0.0, 0.0, 1.5], "length": 2.4, "width": 1.6, "period": 5.0},
        {"type": "circle", "centre": [0.0, 0.0, 1.5], "radius": 1.0, "period": 4.0},
        {"type": "figure-eight", "centre": [0.0, 0.0, 1.5], "length": 1.6, "width": 2.4, "period": 5.5, "plane": "vertical"},
        {"type": "circle", "centre": [0.0, 0.0, 1.5], "radius": 0.6, "period": 3.2},
    ]
    return [
        Mission(
            name=f"made{i}",
            seed=17 * seed + i,
            vehicle=true_vehicle(),
            path=path,
            controller={"type": "pid", **QUICK["pid"]} if shaken else PID,
            sensors={"gyro_noise": 2e-5, "imu_period": 0.002, "imu_latency": 0.012, "position_noise": 1e-4},
            simulation={"duration": 24.0, "log_period": 0.002, "guidance_period": guidance},
            limits={"distance": 10.0},
        )
        for i, path in enumerate(paths)
    ]


@lru_cache(maxsize=4)
def flown(seed: int, guidance: float, shaken: bool) -> tuple[Any, ...]:
    """The flights themselves."""
    return tuple(fly_all(missions(seed, guidance, shaken)))


def logged(seed: int, guidance: float = 0.002, shaken: bool = False, noise: float = 1.0) -> list[FlightRecord]:
    """The flights as logs of 100 Hz. shaken: so that the motors' torques stand out, as in what judges a log.

    noise: a factor of all that is random in them, jitter too.
    """
    random = np.random.default_rng(seed)

    def drawn(deviation: float, *shape: int) -> Floats:
        return noise * random.normal(0.0, deviation, shape)

    return [record(flight, drawn) for flight in flown(seed, guidance, shaken)]


SCALES: dict[str, Callable[[float, float, float], float]] = {
    "": lambda m, k, j: 1.0,
    "m": lambda m, k, j: m,
    "√(m / k_f)": lambda m, k, j: math.sqrt(m / k),
    "√(m k_f)": lambda m, k, j: math.sqrt(m * k),
    "J_z k_f / m": lambda m, k, j: j * k / m,
    "J_z √(k_f / m)": lambda m, k, j: j * math.sqrt(k / m),
}
"""What numbers are proportional to, of the mass, the thrust coefficient and the inertia about z; no flight reveals these."""


def true_value(key: str, begun: AirframeSection | None = None) -> float:
    """What a fit should find that begins with a vehicle: the preset's nominal voltage is that of a full battery, and what
    flights determine only over what they hide is as much larger as the vehicle has it wrong.
    """
    ratio = (start().battery.full / NOMINAL) ** TRUTH["command.voltage_exponent"]
    return scale(key, begun or start(), start()) * TRUTH[key] * (ratio if key == "command.speed" else 1.0)


def scale(key: str, given: AirframeSection, true: AirframeSection) -> float:
    """By how much a number must differ for a given vehicle to fly as the true one does."""
    both = ((one.mass, one.rotor.thrust_coefficient, one.inertia[2]) for one in (given, true))
    return SCALES[GROWS.get(key, "")](*(a / b for a, b in zip(*both, strict=True)))


def record(flight: Any, drawn: Callable[..., Floats]) -> FlightRecord:
    """A flight as it would be logged: commands ahead of the rotors by the delay; noise; jitter of motion capture."""
    vehicle = AirframeSection.model_validate(true_vehicle())
    geometry, rotor = vehicle.geometry(), vehicle.rotor.build()
    fine, time = flight.table, flight.column("t")
    wanted = fine("u_a", "tau_x_a", "tau_y_a", "tau_z_a")
    shares = np.array([list(row) for row in allocation(geometry, rotor).matrix])
    speeds = np.sqrt(np.maximum(wanted @ shares.T, 0.0) / rotor.thrust)
    stamps = np.arange(0.5, time[-1] - 0.1, PERIOD)
    volts = 4.0 - 0.25 * stamps / stamps[-1] - 0.08 * np.sin(0.9 * stamps)
    held = np.clip(np.searchsorted(time, stamps + 0.012 + 1e-9) - 1, 0, len(time) - 1)
    ratio = speeds[held] / (TRUTH["command.speed"] * (volts / NOMINAL) ** TRUTH["command.voltage_exponent"])[:, None]
    motors = ratio ** (1.0 / TRUTH["command.exponent"])

    def at(when: Floats, *names: str) -> Floats:
        return np.stack([np.interp(when, time, flight.column(name)) for name in names], axis=1)

    seen = stamps + drawn(0.002, len(stamps))
    attitude = at(seen, "q_w", "q_x", "q_y", "q_z")
    tilt = np.array([TRUTH["imu.tilt[0]"], TRUTH["imu.tilt[1]"], 0.0])
    attitude = turned(attitude, -tilt + drawn(0.002, len(stamps), 3))
    rates = at(stamps, "p", "q", "r") + np.cross(tilt, at(stamps, "p", "q", "r")) + drawn(0.01, len(stamps), 3)
    channels = {
        "position": at(seen, "x", "y", "z") + drawn(1e-4, len(stamps), 3),
        "velocity": at(seen, "v_x", "v_y", "v_z") + drawn(3e-3, len(stamps), 3),
        "attitude": attitude / np.linalg.norm(attitude, axis=1, keepdims=True),
        "rates": rates,
        "voltage": volts[:, None] + drawn(2e-3, len(stamps), 1),
        "setpoint": at(stamps, "x_d", "y_d", "z_d"),
    }
    channels["position"][:20, 2] = 0.0  # where it stood
    motors[:20] = 0.0
    lost = np.zeros(len(stamps), dtype=bool)
    return FlightRecord(flight.name, stamps, PERIOD, motors, False, channels, (), lost)


def turned(q: Floats, v: Floats) -> Floats:
    """Quaternions followed by small turns v about body axes."""
    w, x, y, z = q.T
    a, b, c = 0.5 * v.T
    return np.stack(
        [w - x * a - y * b - z * c, x + w * a + y * c - z * b, y + w * b + z * a - x * c, z + w * c + x * b - y * a], 1
    )


COLUMNS = {
    "position": ["x", "y", "z"],
    "velocity": ["vx", "vy", "vz"],
    "attitude": ["qw", "qx", "qy", "qz"],
    "rates": ["p", "q", "r"],
    "voltage": ["volts"],
    "setpoint": ["sx", "sy", "sz"],
}
MOTORS = ["m1", "m2", "m3", "m4"]
MAPPING = """
time = { column = "t", unit = "s" }
motors = { columns = ["m1", "m2", "m3", "m4"], full = 1.5 }
[columns]
position = { columns = ["x", "y", "z"], unit = "m" }
velocity = { columns = ["vx", "vy", "vz"], unit = "m/s" }
attitude = { columns = ["qw", "qx", "qy", "qz"], order = "wxyz" }
rates = { columns = ["p", "q", "r"], unit = "rad/s" }
voltage = { columns = ["volts"], unit = "V" }
setpoint = { columns = ["sx", "sy", "sz"], unit = "m" }
"""


def table(flight: FlightRecord) -> tuple[list[str], list[list[str]]]:
    """A log as the header and the rows of a CSV that `MAPPING` describes."""
    header = ["t", *MOTORS, *(name for names in COLUMNS.values() for name in names)]
    values = [flight.time[:, None], flight.motors, *(flight.channels[name] for name in COLUMNS)]
    rows = np.concatenate(values, axis=1)
    return header, [["" if np.isnan(one) else repr(float(one)) for one in row] for row in rows]


def write(path: Any, header: list[str], rows: list[list[str]]) -> None:
    """A CSV."""
    path.write_text("\n".join(",".join(row) for row in [header, *rows]) + "\n")


def hover_ratio(flight: FlightRecord, vehicle: AirframeSection) -> float:
    """Median ratio of the modelled thrust to that needed."""
    return float(np.median(thrust_ratios(flight, vehicle)))
