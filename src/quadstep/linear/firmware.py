"""The margins of a mission's loop as it will be in a firmware: with the filter of its gyro and the delay of its outputs."""

import math
from typing import NamedTuple

from quadstep.io.errors import UserError
from quadstep.linear.grade import UNSTABLE, Grade, grade
from quadstep.mission.airframe import CommandSection
from quadstep.mission.multirotor import MultirotorMission
from quadstep.mission.schema import Mission


class Path(NamedTuple):
    """What lies between sensors, law and rotors of a firmware by default. cutoff: of the gyro's second-order low-pass [Hz],
    which `parameter` sets; outputs: delay until the motors are told [s].
    """

    name: str
    parameter: str
    cutoff: float
    outputs: float

    @property
    def behind(self) -> float:
        """How far the filtered gyro is behind below its cutoff [s]: of a Butterworth filter."""
        return math.sqrt(2.0) / (2.0 * math.pi * self.cutoff)


PATHS = {
    "px4": Path("PX4", "IMU_GYRO_CUTOFF", 40.0, 0.0025),
    "ardupilot": Path("ArduPilot", "INS_GYRO_FILTER", 20.0, 0.0025),
    "crazyflie": Path("the Crazyflie", "the gyro's low-pass filter", 80.0, 0.001),
}
"""By target. Outputs: a period at 400 Hz, and of the Crazyflie's loop."""


def within(mission: Mission, path: Path) -> Mission:
    """The mission with the gyro and the outputs as late as there, in whole samples. Its gains are those that are exported,
    which do not follow this delay.
    """
    assert isinstance(mission, MultirotorMission)
    vehicle, sensors = mission.vehicle, mission.sensors
    period = sensors.imu_period or mission.simulation.period_of("law")
    late = sensors.imu_latency + round(path.behind / period) * period
    command = vehicle.command or CommandSection(speed=vehicle.rotor.fastest)
    delay = 0.5 * mission.simulation.period_of("law") + command.delay + path.outputs
    return mission.model_copy(
        update={
            "sensors": sensors.model_copy(update={"imu_latency": late}),
            "vehicle": vehicle.model_copy(update={"command": command.model_copy(update={"delay": delay})}),
            "modelled": mission.modelled,
        }
    )


def in_firmware(mission: Mission, target: str) -> tuple[str, bool]:
    """What the margins are in a firmware, in a sentence, and whether they are too small to fly."""
    path = PATHS[target]
    about = f"{path.parameter} {path.cutoff:g} Hz: {1e3 * path.behind:.0f} ms, outputs {1e3 * path.outputs:g} ms"
    try:
        found: Grade = grade(within(mission, path))
    except UserError as error:
        return f"Margins on {path.name} ({about}): not known: {error}.", False
    if found.word == UNSTABLE:
        return f"On {path.name} ({about}) this loop is unstable: {found.why}.", True
    if not found.measures:
        return f"Margins on {path.name} ({about}): {found.why}.", False
    short = [one for one in found.measures if one.what != "delay" and not one.met]  # what is late is counted already
    missed = " and ".join(
        f"{one.what} margin on {path.name} is {one.text(one.value)}, below {one.text(one.limit)}" for one in short
    )
    below = f"The {missed}: choose slower gains. " if short else ""
    said = ", ".join(f"{one.what} {one.text(one.value)} ({one.channel})" for one in found.measures)
    return f"{below}Least margins on {path.name} ({about}): {said}.", bool(short)
