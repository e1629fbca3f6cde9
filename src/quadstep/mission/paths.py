"""The kinds of path a mission can name, and the law and numbers of each; whether a vehicle can follow."""

import math
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal, NamedTuple, cast

import numpy as np
from pydantic import Field, SerializeAsAny, WrapValidator

from quadstep.engines.own_checks import check_first
from quadstep.interfaces.plant import PathLaw, Reference
from quadstep.io.doors import PATHS
from quadstep.io.errors import UserError, errors_in
from quadstep.io.user_code import defined_at
from quadstep.mission.check import sections, types
from quadstep.mission.data_files import ANGLE_UNITS, read_recording
from quadstep.mission.fields import MOST, Duration, Finite, NonNegative, Positive, Quantity, Section, Several, Triple
from quadstep.mission.own_thing import OwnSection, own_or
from quadstep.numbers import Vector, vector
from quadstep.report.panel import EventMark
from quadstep.world.paths import DeclaredPath, MinimumJerk, MinimumJerkParameters, Orbit, OrbitParameters, Step, StepParameters
from quadstep.world.pieces import LEAST_SPAN, Piecewise, near_recording, through_waypoints


class BuiltPath(NamedTuple):
    """law and parameters as in `quadstep.world.paths`; length: how long the path takes [s]."""

    law: PathLaw
    parameters: object
    length: float


class MinimumJerkPath(Section):
    """From rest to rest along a straight line with the least jerk (Eqs 68-75)."""

    type: Literal["minimum-jerk"]
    start: Annotated[Triple, Quantity("m", "start point")] = (0.0, 0.0, 0.0)
    end: Annotated[Triple, Quantity("m", "end point")]
    duration: Annotated[Duration, Quantity("s", "time from start to end")]
    yaw_start: Annotated[Finite, Quantity("rad", "yaw at the start")] = 0.0
    yaw_end: Annotated[Finite, Quantity("rad", "yaw at the end")] = 0.0

    def build(self, folder: Path) -> BuiltPath:
        return BuiltPath(MinimumJerk(), self.as_numbers(MinimumJerkParameters), self.duration)


class Waypoint(Section):
    """A place to be at a time [s]."""

    t: Annotated[NonNegative, Quantity("s", "time of the waypoint")]
    position: Annotated[Triple, Quantity("m", "position of the waypoint")]
    yaw: Annotated[Finite, Quantity("rad", "yaw at the waypoint")] = 0.0


class WaypointsPath(Section):
    """Least jerk through waypoints at their times, at rest at both ends."""

    type: Literal["waypoints"]
    waypoints: Annotated[Several[Waypoint], Field(min_length=2, max_length=200)]

    def model_post_init(self, context: object) -> None:
        times = [waypoint.t for waypoint in self.waypoints]
        if times[0] != 0.0:
            raise ValueError(f"the first waypoint must be at t = 0, not {times[0]:g}")
        for before, after in pairwise(times):
            if after - before < 1e-3:
                raise ValueError(f"times of waypoints must increase by at least 1 ms: {before:g} is followed by {after:g}")

    def build(self, folder: Path) -> BuiltPath:
        times = np.array([waypoint.t for waypoint in self.waypoints])
        points = np.array([(*waypoint.position, waypoint.yaw) for waypoint in self.waypoints])
        return BuiltPath(Piecewise(), through_waypoints(times, points), float(times[-1]))


def waypoints_of(path: Section) -> list[EventMark]:
    """When a path is at its waypoints, if it has any."""
    given = path.waypoints if isinstance(path, WaypointsPath) else []
    return [EventMark(one.t, "", f"waypoint {place}") for place, one in enumerate(given, 1)]


class CirclePath(Section):
    """A horizontal circle, entered from rest over `ramp` seconds."""

    type: Literal["circle"]
    centre: Annotated[Triple, Quantity("m", "centre of the circle")] = (0.0, 0.0, 0.0)
    radius: Annotated[Positive, Quantity("m", "radius of the circle")]
    period: Annotated[Duration, Quantity("s", "time of one turn")]
    turns: Annotated[Positive, Quantity("", "number of turns")] = 2.0
    clockwise: Annotated[bool, Quantity("", "direction, seen from above")] = False
    yaw: Annotated[Finite, Quantity("rad", "yaw at the start")] = 0.0
    yaw_rate: Annotated[Finite, Quantity("rad/s", "constant yaw rate")] = 0.0
    ramp: Annotated[NonNegative, Quantity("s", "time from rest to full speed")] = 3.0

    def build(self, folder: Path) -> BuiltPath:
        rate = 2.0 * math.pi / self.period
        parameters = self.as_numbers(
            OrbitParameters,
            amplitude=vector(self.radius, -self.radius if self.clockwise else self.radius, 0.0),
            frequency=vector(rate, rate, rate),
            phase=vector(math.pi / 2.0, 0.0, 0.0),
        )
        return BuiltPath(Orbit(), parameters, self.turns * self.period + 0.5 * self.ramp)


class FigureEightPath(Section):
    """A figure eight, the second axis at twice the frequency of the first, entered from rest over `ramp` seconds."""

    type: Literal["figure-eight"]
    centre: Annotated[Triple, Quantity("m", "crossing point of the eight")] = (0.0, 0.0, 0.0)
    length: Annotated[Positive, Quantity("m", "size along x")]
    width: Annotated[Positive, Quantity("m", "size along y, or z if vertical")]
    period: Annotated[Duration, Quantity("s", "time of one turn")]
    turns: Annotated[Positive, Quantity("", "number of turns")] = 2.0
    plane: Annotated[Literal["horizontal", "vertical"], Quantity("", "plane of the eight")] = "horizontal"
    yaw: Annotated[Finite, Quantity("rad", "yaw at the start")] = 0.0
    yaw_rate: Annotated[Finite, Quantity("rad/s", "constant yaw rate")] = 0.0
    ramp: Annotated[NonNegative, Quantity("s", "time from rest to full speed")] = 3.0

    def build(self, folder: Path) -> BuiltPath:
        rate, second = 2.0 * math.pi / self.period, 0.5 * self.width
        flat = self.plane == "horizontal"
        parameters = self.as_numbers(
            OrbitParameters,
            amplitude=vector(0.5 * self.length, second if flat else 0.0, 0.0 if flat else second),
            frequency=vector(rate, 2.0 * rate, 2.0 * rate),
            phase=vector(0.0, 0.0, 0.0),
        )
        return BuiltPath(Orbit(), parameters, self.turns * self.period + 0.5 * self.ramp)


class StepPath(Section):
    """A jump from start to end at `time`, held until `duration`."""

    type: Literal["step"]
    start: Annotated[Triple, Quantity("m", "position before the step")] = (0.0, 0.0, 0.0)
    end: Annotated[Triple, Quantity("m", "position after the step")]
    time: Annotated[NonNegative, Quantity("s", "time of the step")] = 1.0
    duration: Annotated[Duration, Quantity("s", "duration of the whole path")] = 10.0
    yaw: Annotated[Finite, Quantity("rad", "constant yaw")] = 0.0

    def model_post_init(self, context: object) -> None:
        if self.time >= self.duration:
            raise ValueError(f"time = {self.time:g} s must be before duration = {self.duration:g} s")

    def build(self, folder: Path) -> BuiltPath:
        return BuiltPath(Step(), self.as_numbers(StepParameters), self.duration)


class Columns(Section):
    """Names of the columns in the recording."""

    t: Annotated[str, Quantity("", "name of the time column")] = "t"
    x: Annotated[str, Quantity("", "name of the x column")] = "x"
    y: Annotated[str, Quantity("", "name of the y column")] = "y"
    z: Annotated[str, Quantity("", "name of the z column")] = "z"
    psi: Annotated[str | None, Quantity("", "name of the yaw column, if there is one")] = None


class RecordedPath(Section):
    """Positions as recorded, smoothed to the least jerk near them, at rest at both ends."""

    type: Literal["recorded"]
    file: Annotated[str, Field(min_length=1), Quantity("", "a CSV file, relative to the mission's folder")]
    columns: Columns = Columns()
    psi_unit: Annotated[Literal["rad", "deg"], Quantity("", "unit of the recorded yaw")] = "rad"
    smoothing: Annotated[float, Field(ge=0.01, le=10.0), Quantity("s", "shorter motions are treated as noise")] = 0.15

    def build(self, folder: Path) -> BuiltPath:
        with errors_in("path.file"):
            times, points = read_recording(
                folder / self.file, self.columns.model_dump(), ANGLE_UNITS[self.psi_unit], LEAST_SPAN * self.smoothing
            )
        try:
            path = near_recording(times, points, self.smoothing)
        except ValueError:
            said = f"its times, 0 to {times[-1]:g} s with steps of up to {np.diff(times).max():g} s, cannot be smoothed"
            raise UserError(f"path.file: {self.file}: {said} over {self.smoothing:g} s; are they in seconds?") from None
        return BuiltPath(Piecewise(), path, float(times[-1]))


class OwnPathSection(OwnSection):
    """A path of the user's own: its `type`, and a key for each of its numbers."""

    thing: ClassVar[DeclaredPath]

    def build(self, folder: Path) -> BuiltPath:
        law, numbers = self.thing, self.numbers()
        length, first = law.length(numbers), law.reference(0.0, numbers)
        if isinstance(length, float | int) and not 0.0 < length <= MOST:
            raise UserError(f"path.type: {self.type}: its length should be a number of seconds above 0, not {length:g}")
        if not isinstance(first, Reference) or any(len(part) != 3 for part in (*first[:3], first.jerk, first.snap)):
            raise UserError(f"path.type: {self.type}: `reference` should give a Reference, whose vectors have three entries")
        with errors_in("path.type", f"{self.type}{defined_at(law.reference)}"):
            check_first(first, "reference")
        return BuiltPath(law, numbers, length)


KnownPath = Annotated[
    MinimumJerkPath | WaypointsPath | CirclePath | FigureEightPath | StepPath | RecordedPath, Field(discriminator="type")
]

PATH_TYPES = tuple(name for one in sections(KnownPath) for name in types(one))
"""Each `type` of these."""

if TYPE_CHECKING:
    AnyPath = KnownPath | OwnPathSection
else:
    AnyPath = Annotated[SerializeAsAny[KnownPath], WrapValidator(own_or(DeclaredPath, OwnPathSection, PATHS, PATH_TYPES))]


INSTANTS = 400
"""At which a path is looked at; a peak between two of them is missed."""


def path_warnings(
    path: BuiltPath, duration: float, mass: float, gravity: float, most: float, ground: float = -math.inf
) -> list[str]:
    """What is said of a path in a flight of `duration` [s]: how much of it is not flown, that it goes below the ground and
    that its accelerations take more than all rotors have; nothing of a path of the user's own.

    mass [kg], gravity [m/s^2]. most: thrust of all rotors [N], infinite where there is no limit. ground: its height [m].
    """
    if isinstance(path.law, DeclaredPath):
        return []
    return [*unflown(path, duration), *impossible(path, duration, mass, gravity, most, ground)]


def unflown(path: BuiltPath, duration: float) -> list[str]:
    """How far a flight of `duration` [s] ends before a path that comes to rest."""
    if duration >= path.length - 1e-9:
        return []
    last, end = (path.law.reference(t, path.parameters) for t in (duration, path.length))
    ahead = float((Vector(end.position) - Vector(last.position)).norm())
    if float(Vector(end.velocity).norm()) > 1e-6 or ahead < 1e-6:
        return []
    whole = f"the path at {path.length:g} s, {ahead:.3g} m farther on"
    return [f"path: the flight ends at {duration:g} s (simulation.duration), {whole}"]


def impossible(path: BuiltPath, duration: float, mass: float, gravity: float, most: float, ground: float) -> list[str]:
    """That it goes below the ground, and that accelerations take more than all rotors have."""
    times = duration * np.arange(INSTANTS + 1) / INSTANTS
    found = path.law.reference(cast("float", times), path.parameters)
    low = float(np.min(found.position[2]))
    said = [f"path: it goes down to z = {low:.3g} m, below the ground at {ground:g} m"] * (low < ground - 1e-6)
    thrusts = np.broadcast_to(mass * (Vector(found.acceleration) + vector(0.0, 0.0, gravity)).norm(), times.shape)
    taken, at = thrusts.max(), times[thrusts.argmax()]
    if not taken > most:
        return said
    needs, has, speed = (f"{float(f'{one:.3g}'):,.9g}" for one in (taken, most, np.max(Vector(found.velocity).norm())))
    return [
        *said,
        f"path: this vehicle cannot fly it: at {at:.3g} s it takes {needs} N of thrust, and all rotors together give at most "
        f"{has} N; the path's greatest speed is {speed} m/s (lengths are in m, times in s)",
    ]
