"""What an autopilot must be told of the vehicle that it flies: frame, motors, thrust curve, as its own parameter file."""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from quadstep.io.parameter_files import FORMATS
from quadstep.vehicle.airframe.geometry import Geometry, Mount
from quadstep.vehicle.plants.multirotor import AirframeParameters

QUADS = {
    1: ("X", ((45.0, 1), (-135.0, 1), (-45.0, -1), (135.0, -1))),
    18: ("X, motors in Betaflight's order, turning the other way", ((135.0, 1), (45.0, -1), (-135.0, -1), (-45.0, 1))),
    0: ("plus", ((90.0, 1), (-90.0, 1), (0.0, -1), (180.0, -1))),
}
"""ArduPilot's `FRAME_TYPE` of quadrotors: in the order of its motors, degrees to the right of the nose, and spin."""

NEAR = 20.0
"""Degrees by which an arm may deviate from a frame's."""

FIRST_MOTOR = 33
"""`SERVOn_FUNCTION` of ArduPilot's motor 1."""

PX4_FIRST_MOTOR = 101


class Matching(NamedTuple):
    """Parameters by name. file: name of the autopilot's own file of them. note: what they do not settle; may be empty."""

    parameters: Mapping[str, float]
    file: str
    note: str = ""

    def sentence(self) -> str:
        return "The autopilot's parameters must be " + ", ".join(
            f"{name} {value:g}" for name, value in self.parameters.items()
        )

    def text(self) -> str:
        """The file: ArduPilot's, or QGroundControl's for PX4."""
        head = "# The vehicle of this mission: what must match. Written by quadstep.\n" + (
            f"# {self.note}\n" if self.note else ""
        )
        form = FORMATS.load("px4" if self.file == "px4.params" else "ardupilot")
        return head + str(form.write(self.parameters, {}))


def bearing(mount: Mount) -> float:
    """Of an arm, degrees to the right of the nose."""
    x, y, _ = mount.position
    return math.degrees(math.atan2(-y, x))


def motor_of(mount: Mount, frame: Sequence[tuple[float, int]]) -> int | None:
    """The frame's motor, from 0, at the place of a rotor with its spin; None where there is none."""
    for motor, (angle, spin) in enumerate(frame):
        apart = abs((bearing(mount) - angle + 180.0) % 360.0 - 180.0)
        if apart < NEAR and spin == mount.spin:
            return motor
    return None


def hover_share(p: AirframeParameters, geometry: Geometry) -> float:
    """The share of all rotors' largest thrust that carries the vehicle."""
    return float(p.airframe.mass * p.airframe.gravity / p.allocation.most) / len(geometry.mounts)


def for_ardupilot(p: AirframeParameters, geometry: Geometry) -> Matching:
    """Of ArduPilot: the frame, the motor of each output, a thrust that goes with the square of the pulse."""
    curve = {"MOT_THST_EXPO": 1.0, "MOT_SPIN_ARM": 0.0, "MOT_SPIN_MIN": 0.0, "MOT_SPIN_MAX": 1.0, "MOT_PWM_MIN": 1000.0}
    curve |= {"MOT_PWM_MAX": 2000.0, "MOT_BAT_VOLT_MAX": 0.0, "MOT_THST_HOVER": round(hover_share(p, geometry), 4)}
    for frame_type, (_, frame) in QUADS.items():
        motors = [motor_of(mount, frame) for mount in geometry.mounts]
        if len(motors) == len(frame) and None not in motors:
            frames = {"FRAME_CLASS": 1.0, "FRAME_TYPE": float(frame_type)}
            outputs = {f"SERVO{i}_FUNCTION": float(FIRST_MOTOR + (motor or 0)) for i, motor in enumerate(motors, 1)}
            return Matching({**frames, **outputs, **curve}, "ardupilot.parm")
    note = (
        "No quadrotor frame of ArduPilot has these arms and spins: set FRAME_CLASS, FRAME_TYPE and SERVOn_FUNCTION yourself."
    )
    return Matching(curve, "ardupilot.parm", note)


def for_px4(p: AirframeParameters, geometry: Geometry) -> Matching:
    """Of PX4: the rotors where they are, in the mission's order, and a thrust that goes with the square of the output."""
    moment = float(p.airframe.rotor.torque / p.airframe.rotor.thrust)
    parameters = {"CA_AIRFRAME": 0.0, "CA_ROTOR_COUNT": float(len(geometry.mounts))}
    for i, mount in enumerate(geometry.mounts):
        x, y, z = mount.position
        parameters |= {
            f"CA_ROTOR{i}_PX": x,
            f"CA_ROTOR{i}_PY": -y,
            f"CA_ROTOR{i}_PZ": -z,
            f"CA_ROTOR{i}_KM": mount.spin * moment,
        }
    parameters |= {f"PWM_MAIN_FUNC{i}": float(PX4_FIRST_MOTOR + i - 1) for i in range(1, len(geometry.mounts) + 1)}
    parameters |= {"THR_MDL_FAC": 1.0, "MPC_THR_HOVER": round(hover_share(p, geometry), 4)}
    return Matching({name: value + 0.0 for name, value in parameters.items()}, "px4.params")


MATCHING = {"ardupilot": for_ardupilot, "px4": for_px4}
