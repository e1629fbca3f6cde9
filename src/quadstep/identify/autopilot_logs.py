"""What autopilots' logs and parameters tell besides their rate loops: motors and their limits, notches, how fast they sink."""

import math
from collections.abc import Mapping
from typing import NamedTuple

from quadstep.identify.rate_loops import harmonics

Limits = dict[str, tuple[float, float]]
"""Least and largest value in flight of each motor, by column."""


class Notch(NamedTuple):
    """A filter of the gyro against a peak: what its parameters begin with, which frequencies it may take [Hz], and whether it
    follows one of them.
    """

    name: str
    low: float
    high: float
    follows: bool = False


PX4_MOTORS = tuple(f"actuator_motors.control[{place}]" for place in range(12))
ARDUPILOT_MOTORS = tuple(f"RCOU.C{number}" for number in range(1, 15))
BETAFLIGHT_MOTORS = tuple(f"main.motor[{place}]" for place in range(8))
COLUMNS = {"px4": PX4_MOTORS, "ardupilot": ARDUPILOT_MOTORS, "betaflight": BETAFLIGHT_MOTORS}
"""Columns of motors."""

SINKING = {"px4": "vehicle_local_position.vz", "ardupilot": "XKF1.VD"}
"""Columns of the velocity downwards [m/s], where there is one."""

FUNCTIONS = {*range(33, 41), *range(82, 86)}
"""SERVOn_FUNCTION of ArduPilot's motors 1 to 12."""


def limits(form: str, parameters: Mapping[str, float]) -> Limits:
    """Of the motors; empty where the parameters do not tell them."""
    if form == "px4":
        return dict.fromkeys(PX4_MOTORS, (0.0, 1.0))
    if form == "betaflight":
        low, high = (parameters.get(f"motorOutput[{place}]", 0.0) for place in range(2))
        return dict.fromkeys(BETAFLIGHT_MOTORS, (low, high)) if low < high else {}
    least, most = (parameters.get(f"MOT_PWM_{name}", 0.0) for name in ("MIN", "MAX"))
    if not 0.0 < least < most:
        return {}
    ends = [
        least + (most - least) * parameters.get(f"MOT_SPIN_{name}", share) for name, share in (("MIN", 0.15), ("MAX", 0.95))
    ]
    numbers = enumerate(ARDUPILOT_MOTORS, 1)
    return {name: (ends[0], ends[1]) for number, name in numbers if parameters.get(f"SERVO{number}_FUNCTION") in FUNCTIONS}


def notches(form: str, parameters: Mapping[str, float]) -> list[Notch]:
    """Those that are on, by name. Where one follows a frequency, it may take any from its least one on."""
    found = []
    if form == "px4":
        for place in range(2):
            at, wide = (parameters.get(f"IMU_GYRO_NF{place}_{name}", 0.0) for name in ("FRQ", "BW"))
            if at > 0.0:
                found.append(Notch(f"IMU_GYRO_NF{place}", at - 0.5 * wide, at + 0.5 * wide))
        if parameters.get("IMU_GYRO_DNF_EN", 0.0) > 0.0:
            found.append(Notch("IMU_GYRO_DNF", parameters.get("IMU_GYRO_DNF_MIN", 25.0), math.inf, follows=True))
        return found
    if form == "betaflight":
        for place in range(2):
            at, cut = (parameters.get(f"gyro_notch_{name}[{place}]", 0.0) for name in ("hz", "cutoff"))
            if 0.0 < cut < at:
                found.append(Notch("gyro_notch", cut, at * at / cut))
        if parameters.get("dyn_notch_count", 0.0) > 0.0:
            low, high = (parameters.get(f"dyn_notch_{name}_hz", usual) for name, usual in (("min", 100.0), ("max", 600.0)))
            found.append(Notch("dyn_notch", low, high, follows=True))
        if parameters.get("gyro_rpm_notch_harmonics", 0.0) > 0.0:
            found.append(Notch("rpm_filter", parameters.get("gyro_rpm_notch_min", 100.0), math.inf, follows=True))
        return found
    for stem in ("INS_HNTCH_", "INS_HNTC2_"):
        at, wide = (parameters.get(f"{stem}{name}", 0.0) for name in ("FREQ", "BW"))
        if parameters.get(f"{stem}ENABLE", 0.0) > 0.0 and at > 0.0:
            fixed = parameters.get(f"{stem}MODE", 1.0) == 0.0
            each = harmonics(parameters.get(f"{stem}HMNCS", 3.0))
            ends = [(k * at - 0.5 * wide, k * at + 0.5 * wide) for k in each] if fixed else [(at - 0.5 * wide, math.inf)]
            found += [Notch(stem.removesuffix("_"), *one, follows=not fixed) for one in ends]
    return found
