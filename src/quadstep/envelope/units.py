"""The unit of a mission's key, where it is known: from the section that holds it, or from the list here."""

from typing import Any

from pydantic import BaseModel

from quadstep.mission.fields import Quantity

KEYS = {
    "s": (
        "path.duration path.period path.ramp path.time "
        "wind.gust.start wind.gust.length sensors.latency "
        "sensors.imu_latency sensors.imu_period sensors.fix_period simulation.duration "
        "simulation.step simulation.control_period simulation.guidance_period simulation.air_period "
        "simulation.log_period"
    ),
    "m": (
        "path.radius path.length path.width path.start "
        "path.end path.centre vehicle.rotors.arm vehicle.rotors.moment "
        "start.position limits.distance wind.turbulence.height sensors.position_noise"
    ),
    "m/s": (
        "start.velocity wind.mean wind.swing wind.gust.velocity "
        "wind.turbulence.wind_20 wind.turbulence.airspeed sensors.velocity_noise"
    ),
    "m/s²": "vehicle.gravity sensors.accelerometer_bias",
    "m/s²/√Hz": "sensors.accelerometer_noise",
    "rad": "path.yaw path.yaw_start path.yaw_end start.attitude limits.pitch sensors.attitude_noise",
    "rad/s": "path.yaw_rate start.rates limits.rate wind.swing_frequency sensors.gyro_bias",
    "rad/s/√Hz": "sensors.gyro_noise",
    "kg": "vehicle.mass",
    "kg m²": "vehicle.inertia",
    "N": "vehicle.rotors.limits disturbance.force",
    "N m": "disturbance.torque",
    "times Eq. 67": "disturbance.scale",
}
"""Keys of a mission by unit."""

UNITS = {key: unit for unit, keys in KEYS.items() for key in keys.split()}


def unit(mission: BaseModel, key: str) -> str:
    """The unit of a key of a checked mission; nothing if it has none, or none is known."""
    names = [name for name in key.split(".") if not name.isdecimal()]
    return quantity(mission, names) or UNITS.get(".".join(names), "")


def quantity(section: Any, names: list[str]) -> str:
    """What the sections themselves say."""
    found = ""
    for name in names:
        field = type(section).model_fields.get(name) if isinstance(section, BaseModel) else None
        if field is None:
            return ""
        found = next((note.unit for note in field.metadata if isinstance(note, Quantity)), "")
        section = getattr(section, name)
    return found


def label(mission: BaseModel, key: str) -> str:
    """A key and its unit."""
    found = unit(mission, key)
    return f"{key} [{found}]" if found else key
