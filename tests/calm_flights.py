"""Flights of a preset in closed loop, calm unless told, logged at 100 Hz with noise: ordinary logs, hard to learn from."""

from typing import Any

import numpy as np

from quadstep import Mission, fly_all
from quadstep.identify.logs.flight import FlightRecord, Floats
from quadstep.mission.airframe import AirframeSection
from quadstep.mission.presets import preset_table
from quadstep.vehicle.allocation import allocation
from tests.made_flights import turned

PATHS: dict[str, dict[str, Any]] = {
    "circle": {"type": "circle", "centre": [0.0, 0.0, 5.0], "radius": 2.0, "period": 10.0},
    "eight": {"type": "figure-eight", "centre": [0.0, 0.0, 5.0], "length": 4.0, "width": 2.0, "period": 9.0},
    "hover": {"type": "circle", "centre": [0.0, 0.0, 5.0], "radius": 0.05, "period": 10.0},
    "lively": {"type": "figure-eight", "centre": [0.0, 0.0, 5.0], "length": 6.0, "width": 4.0, "period": 6.0},
}
WOBBLY: dict[str, Any] = {
    "position": 4.44, "velocity": 5.51, "velocity_integral": 4.11, "attitude": [8.07, 8.07, 3.59],
    "rate": [22.41, 22.41, 8.97], "rate_integral": 1.0, "rate_derivative": [1.009, 1.009, 0.0], "rate_filter": 200.0,
}  # fmt: skip
"""Gains under which an x500 wobbles by 20 to 30 degrees."""
HELD = 0.001
"""Half the time for which a command is held [s], the only delay."""


def start(name: str) -> AirframeSection:
    """The vehicle, by the name of a preset."""
    return AirframeSection.model_validate(preset_table(name))


def true_values(name: str) -> dict[str, float]:
    """What a fit should find."""
    vehicle = start(name)
    rotor, drag = vehicle.rotor, vehicle.drag
    return {
        "command.speed": rotor.fastest, "command.exponent": 1.0, "command.delay": HELD, "rotor.rise_time": rotor.rise_time,
        "inertia[0]": vehicle.inertia[0], "inertia[1]": vehicle.inertia[1], "rotor.inertia": rotor.inertia,
        "rotor.torque_coefficient": rotor.torque_coefficient, "drag.rotor[0]": drag.rotor[0], "drag.rotor[2]": drag.rotor[2],
        "drag.flapping": drag.flapping, "command.voltage_exponent": 0.0,
        **dict.fromkeys(("centre_of_gravity[0]", "centre_of_gravity[1]", "imu.tilt[0]", "imu.tilt[1]"), 0.0),
    }  # fmt: skip


def logged(
    name: str, path: str, seed: int, duration: float, noise: float = 1.0, guidance: float = 0.002,
    wind: dict[str, Any] | None = None, volts: Floats | None = None, turn: float = 0.0,
    gains: dict[str, Any] | None = None,
) -> FlightRecord:  # fmt: skip
    """A flight as a log. noise: a factor of that of sensors and log. volts: logged at its beginning and end [V]. turn: how
    fast the heading does [rad/s]. gains: other than the usual ones.
    """
    table = preset_table(name)
    sensors = {"gyro_noise": 1e-4 * noise, "imu_period": 0.002, "imu_latency": 0.004, "position_noise": 1e-4 * noise}
    mission = Mission(
        name=f"{name}-{path}-{seed}", seed=seed, vehicle=table, path={**PATHS[path], "yaw_rate": turn},
        controller={"type": "pid", **(gains or {})},
        simulation={"duration": duration, "log_period": 0.002, "guidance_period": guidance}, limits={"distance": 50.0},
        **({"sensors": sensors} if noise else {}), **({"wind": wind} if wind else {}),
    )  # fmt: skip
    (flight,) = fly_all([mission])
    return record(name, flight, np.random.default_rng(seed), noise, volts)


def record(name: str, flight: Any, random: np.random.Generator, noise: float, volts: Floats | None) -> FlightRecord:
    """A flight as it would be logged: commands as shares of the fastest speed."""
    vehicle = start(name)
    rotor, time = vehicle.rotor.build(), flight.column("t")
    shares = np.array([list(row) for row in allocation(vehicle.geometry(), rotor).matrix])
    speeds = np.sqrt(np.maximum(flight.table("u_a", "tau_x_a", "tau_y_a", "tau_z_a") @ shares.T, 0.0) / rotor.thrust)
    stamps = np.arange(0.5, time[-1] - 0.05, 0.01)
    motors = speeds[np.searchsorted(time, stamps + 1e-9) - 1] / vehicle.rotor.fastest

    def at(deviation: float, *names: str) -> Floats:
        values = np.stack([np.interp(stamps, time, flight.column(one)) for one in names], axis=1)
        return values + noise * random.normal(0.0, deviation, values.shape)

    attitude = turned(at(0.0, "q_w", "q_x", "q_y", "q_z"), noise * random.normal(0.0, 1e-3, (len(stamps), 3)))
    channels = {
        "position": at(2e-3, "x", "y", "z"),
        "velocity": at(3e-3, "v_x", "v_y", "v_z"),
        "attitude": attitude / np.linalg.norm(attitude, axis=1, keepdims=True),
        "rates": at(5e-3, "p", "q", "r"),
    }
    if volts is not None:
        channels["voltage"] = np.linspace(volts[0], volts[1], len(stamps))[:, None]
    channels["position"][:20, 2] = channels["position"][:, 2].min() - 1.0  # where it stood
    motors[:20] = 0.0
    return FlightRecord(flight.name, stamps, 0.01, motors, False, channels, (), np.zeros(len(stamps), dtype=bool))
