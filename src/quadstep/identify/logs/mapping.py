"""Mapping files: which column of a log holds what, in which unit, in which axes and with which sign."""

import math
import tomllib
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from quadstep.identify.logs.flight import WIDTHS, Flags, Floats
from quadstep.io.documents import read_toml
from quadstep.io.errors import UserError, unknown_name
from quadstep.mission.check import check
from quadstep.mission.fields import Positive, Quantity, Section, Several
from quadstep.numbers import Vector
from quadstep.numbers.rotations import multiply

UNITS = {
    "position": {"m": 1.0, "cm": 1e-2, "mm": 1e-3},
    "velocity": {"m/s": 1.0, "cm/s": 1e-2, "mm/s": 1e-3},
    "attitude": {"": 1.0, "rad": 1.0, "deg": math.pi / 180.0},
    "rates": {"rad/s": 1.0, "deg/s": math.pi / 180.0, "mrad/s": 1e-3},
    "acceleration": {"m/s^2": 1.0, "g": 9.80665, "mg": 9.80665e-3},
    "voltage": {"V": 1.0, "mV": 1e-3},
    "yaw": {"rad": 1.0, "deg": math.pi / 180.0},
    "law_thrust": {"N": 1.0},
    "law_torque": {"N m": 1.0},
    "law_samples": {"": 1.0},
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9},
}
"""Units by kind of quantity, with their value in SI; the first is the default."""

LARGEST = {
    "position": 1e8, "velocity": 1e4, "attitude": 1e6, "rates": 1e3, "acceleration": 1e4, "voltage": 1e3, "yaw": 1e6,
    "law_thrust": 1e6, "law_torque": 1e6, "law_samples": 1e10,
}  # fmt: skip
"""Larger numbers [SI] are no measurements, but damage or another column."""

KINDS = {
    "setpoint": "position", "estimated_position": "position", "estimated_velocity": "velocity",
    "estimated_attitude": "attitude", "reference_rates": "rates", "setpoint_yaw": "yaw",
}  # fmt: skip
"""Channels of the same kind as another."""

ORDERS = {"wxyz": 4, "xyzw": 4, "roll-pitch-yaw": 3, "yaw-pitch-roll": 3}

Names = Annotated[Several[str], Field(min_length=1, max_length=8)]


MOST_COMMAND, MOST_SPEED = 1e3, 1e5
"""Largest command, as a share of the full one, and largest speed of a rotor [rad/s]; larger ones are taken for these."""


class TimeSection(Section):
    """The time column and its unit."""

    column: Annotated[str, Quantity("", "name of the column")]
    unit: Annotated[Literal["s", "ms", "us", "ns"], Quantity("", "logged unit")] = "s"


class ChannelSection(Section):
    """A quantity of the log, of one or more columns."""

    columns: Annotated[Names, Quantity("", "columns, one for each component")]
    unit: Annotated[str | None, Quantity("", "logged unit; default: the channel's first unit")] = None
    signs: Annotated[Several[Literal[1, -1]], Quantity("", "1 or -1 for each component, to convert to the stated axes")] = ()
    order: Annotated[
        Literal["wxyz", "xyzw", "roll-pitch-yaw", "yaw-pitch-roll"], Quantity("", "order of the attitude's components")
    ] = "wxyz"
    axes: Annotated[Literal["world", "body"], Quantity("", "axes of the velocity")] = "world"
    where: Annotated[
        dict[str, float], Field(default_factory=dict), Quantity("", "columns of the topic, with the value of messages to use")
    ]

    def model_post_init(self, context: object) -> None:
        if self.signs and len(self.signs) != len(self.columns):
            raise ValueError(f"signs: {len(self.signs)} given for {len(self.columns)} columns")


class MotorsSection(Section):
    """Commands to the rotors. A value above the full one (65535 for a 16-bit ratio) marks a row whose command was lost."""

    columns: Annotated[Names, Quantity("", "one column for each rotor, in the vehicle's order")]
    unit: Annotated[Literal["share", "rad/s", "rpm"], Quantity("", "share of the full command, or a speed")] = "share"
    zero: Annotated[float, Quantity("", "value of a zero command, in the logged unit")] = 0.0
    full: Annotated[Positive, Quantity("", "value of the full command, in the logged unit")] = 1.0

    def model_post_init(self, context: object) -> None:
        if not self.full > self.zero:
            raise ValueError(f"full = {self.full:g} should be above zero = {self.zero:g}")


class Mapping(Section):
    """A mapping file: which column of a log holds what."""

    description: Annotated[str, Quantity("", "description in one line")] = ""
    world: Annotated[Literal["z-up", "z-down"], Quantity("", "world axes; z-down: north, east, down")] = "z-up"
    body: Annotated[Literal["forward-left-up", "forward-right-down"], Quantity("", "body axes")] = "forward-left-up"
    time: TimeSection
    motors: MotorsSection
    columns: Annotated[dict[str, ChannelSection], Quantity("", "channels by name")]

    def model_post_init(self, context: object) -> None:
        for name, channel in self.columns.items():
            if name not in WIDTHS:
                raise ValueError(f"columns: {unknown_name('channel', name, WIDTHS)}")
            units = UNITS[KINDS.get(name, name)]
            if channel.unit is not None and channel.unit not in units:
                raise ValueError(f"columns.{name}: {unknown_name('unit', channel.unit, map(repr, units))}")
            width = ORDERS[channel.order] if WIDTHS[name] == 4 else WIDTHS[name]
            if len(channel.columns) != width:
                raise ValueError(f"columns.{name}: {len(channel.columns)} columns given, {width} are needed")

    def names(self) -> list[str]:
        channels = [name for channel in self.columns.values() for name in (*channel.columns, *channel.where)]
        return list(dict.fromkeys([self.time.column, *self.motors.columns, *channels]))


def mapping_names() -> list[str]:
    folder = files("quadstep.identify.logs") / "mappings"
    return sorted(entry.name.removesuffix(".toml") for entry in folder.iterdir() if entry.name.endswith(".toml"))


def load_mapping(name: str) -> Mapping:
    """A mapping that comes with the package."""
    text = (files("quadstep.identify.logs") / "mappings" / f"{name}.toml").read_text(encoding="utf-8")
    return Mapping.model_validate(tomllib.loads(text))


def read_mapping(text: str) -> Mapping:
    """A mapping by name, or from a user's file. Raises UserError."""
    if text in mapping_names():
        return load_mapping(text)
    if not text.endswith(".toml"):
        raise UserError(unknown_name("mapping", text, mapping_names(), "a file that ends in .toml"))
    return check(Mapping, read_toml(Path(text)), text, Path(text).parent)


def fitting(header: list[str]) -> str | None:
    """The name of the first mapping of the package whose columns are all in a header."""
    known = set(header)
    return next((name for name in mapping_names() if set(load_mapping(name).names()) <= known), None)


def converted(mapping: Mapping, name: str, values: Floats) -> Floats:
    """A channel in the simulator's units and axes from its columns as logged, shape (n, columns)."""
    channel = mapping.columns[name]
    kind = KINDS.get(name, name)
    unit = UNITS[kind][channel.unit or next(iter(UNITS[kind]))]
    scaled = np.where(np.abs(values) <= LARGEST[kind] / unit, values, np.nan) * unit
    if channel.signs:
        scaled = scaled * np.array(channel.signs, dtype=float)
    if WIDTHS[name] == 4:
        return attitude(channel.order, scaled, mapping)
    down = mapping.world == "z-down" if channel.axes == "world" else mapping.body == "forward-right-down"
    if name in ("rates", "reference_rates", "acceleration", "law_torque"):
        down = mapping.body == "forward-right-down"
    if down and WIDTHS[name] == 3:
        scaled = scaled * np.array([1.0, -1.0, -1.0])
    if down and name == "setpoint_yaw":
        scaled = -scaled
    return scaled


def attitude(order: str, values: Floats, mapping: Mapping) -> Floats:
    """Quaternions (w, x, y, z), body to world, in the simulator's axes."""
    if order == "xyzw":
        values = values[:, [3, 0, 1, 2]]
    elif order != "wxyz":
        yaw, pitch, roll = (values[:, i] for i in ((2, 1, 0) if order == "roll-pitch-yaw" else (0, 1, 2)))
        half = [0.5 * angle for angle in (yaw, pitch, roll)]
        (cy, cp, cr), (sy, sp, sr) = ([f(a) for a in half] for f in (np.cos, np.sin))
        parts = [
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        ]
        values = np.stack(parts, axis=1)
    flip = np.array([0.0, 1.0, 0.0, 0.0])  # half a turn about x
    if mapping.world == "z-down":
        values = product(flip, values)
    if mapping.body == "forward-right-down":
        values = product(values, flip)
    with np.errstate(invalid="ignore", divide="ignore"):
        length = np.linalg.norm(values, axis=1, keepdims=True)
        unit: Floats = values / np.where(length > 0.5, length, np.nan)
    return unit


def product(a: Floats, b: Floats) -> Floats:
    """Hamilton products of quaternions along the last axis."""
    parts = multiply(Vector(np.moveaxis(a, -1, 0)), Vector(np.moveaxis(b, -1, 0)))
    return np.stack(np.broadcast_arrays(*parts), axis=-1)


def commanded(mapping: Mapping, logged: Floats) -> tuple[Floats, Flags]:
    """The motors' commands, (n, rotors), as shares of the full one or speeds [rad/s], and which rows are lost: one of them is
    above the full one, or not a number. logged: in the log's unit.
    """
    motors = mapping.motors
    share = motors.unit == "share"
    zero, one, most = motors.zero, motors.full - motors.zero, MOST_COMMAND
    if not share:
        zero, one, most = 0.0, {"rad/s": 1.0, "rpm": 30.0 / math.pi}[motors.unit], MOST_SPEED
    known = np.isfinite(logged)
    found = (np.where(known, logged, zero).clip(zero, zero + most * one) - zero) / one
    lost: Flags = ~known.all(axis=1) | (found.max(axis=1) > (1.0 + 1e-6 if share else np.inf))
    return found, lost
