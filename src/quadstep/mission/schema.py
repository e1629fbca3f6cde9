"""A mission: everything a flight needs, as a user writes it. Every key but the path has a default.

The keys of a mission depend on the plant: `Mission` has the keys that all have in common, and makes the plan. Its
subclasses, one per plant, add theirs. All of them are made by `check_mission`, from files and in Python.
"""

import math
from abc import abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, NamedTuple, Self, TypeAlias, cast

from pydantic import Field, ValidationInfo, model_validator

from quadstep.engines.fly import FlightPlan, fly, reason
from quadstep.engines.loop import Loop
from quadstep.engines.own_checks import NotFiniteError, check_plant, check_wind, try_metrics, try_out
from quadstep.engines.scored import names_without_units, of_log, score_names
from quadstep.interfaces.closed_loop import Outcome, Ticks
from quadstep.interfaces.controller import Controller
from quadstep.interfaces.log import FlightLog, Metric
from quadstep.interfaces.plant import Air, Plant, Reference
from quadstep.io.errors import UserError, errors_in
from quadstep.io.user_code import defined_at
from quadstep.metrics.registry import AT_REST, DELAYS, EFFORTS, LEAST_GAIN, LEAST_PHASE, Metrics
from quadstep.metrics.verdict import graded, together
from quadstep.mission.clock import ClockSection
from quadstep.mission.derived import ControllerSection, ModelledVehicle, with_usual_rates
from quadstep.mission.fields import Name, NonNegative, Quantity, Section, plain, with_value
from quadstep.mission.own_controller import law_named
from quadstep.mission.own_thing import check_names, own_metrics
from quadstep.mission.paths import AnyPath, BuiltPath, waypoints_of
from quadstep.mission.read import check_mission
from quadstep.mission.tune import TuneSection
from quadstep.report.drawing import FigureJob
from quadstep.report.panel import EventMark
from quadstep.report.panels import flight_jobs, of_marks, seen_moments
from quadstep.sensing.suite import Suite


class MarginsSection(Section):
    """Minimum margins for a loop to be graded sound; they affect no flight."""

    gain: Annotated[NonNegative, Quantity("dB", "least gain margin, upwards and downwards")] = LEAST_GAIN
    phase: Annotated[NonNegative, Field(le=math.pi), Quantity("rad", "least phase margin")] = LEAST_PHASE
    delay: Annotated[
        NonNegative | None, Quantity("s", "least delay margin; default: twice the latency of sensors and commands")
    ] = None

    def least_delay(self, latency: float) -> float:
        """The delay margin [s] asked of a mission with this latency [s]."""
        return DELAYS * latency if self.delay is None else self.delay


Grading: TypeAlias = Callable[["Mission"], Mapping[str, str]]
"""Gives "grade" and "why" of a mission's loop at rest; empty where it cannot in less than about a second."""


def ungraded(_: "Mission") -> Mapping[str, str]:
    return {}


class Built(NamedTuple):
    """What a mission flies, as laws and numbers.

    numbers: the parameters, given path and gains. start: the state at t = 0, given the reference then. periods: of air and
    sensors, as far as there are any, by their tasks' names [s]. late: samples of the law until the actuators are told. fitted:
    the controller as it is flown, given the periods of its loops. own_plant: the name of a plant of the user's own. warnings:
    what speaks against it, a line each, given how long the flight takes [s].
    """

    numbers: Callable[..., Any]
    start: Callable[[Reference], Any]
    periods: Mapping[str, float] = {}
    air: Air | None = None
    sensing: Suite | None = None
    guided: bool = False
    late: int = 0
    fitted: Callable[[Controller, Mapping[str, float]], Controller] = lambda law, _: law
    own_plant: str = ""
    warnings: Callable[[float], list[str]] = lambda _: []


if TYPE_CHECKING:
    from pydantic._internal._model_construction import ModelMetaclass as MissionMeta
else:

    class MissionMeta(type(Section)):
        """Reads the arguments of `Mission(...)`, or of a kind of it, as the keys of a mission."""

        def __call__(cls, **keys):
            return cls.model_validate(keys)


class Mission(Section, metaclass=MissionMeta):
    """A flight as a user describes it: vehicle, path, controller and conditions.

    Every key of a mission file is an argument, every table of it a dict: `path` is needed, all else has a default. Lists,
    tuples and NumPy arrays are accepted; files are relative to the working directory. SI units, angles in radians;
    positions are in the world frame, z up. `quadstep new` writes a file with every key explained.

    `Mission(...)` returns the mission for the plant that `vehicle` describes: the paper's (`LagrangeMission`), or with a
    preset, file, layout or rotor a real vehicle's (`MultirotorMission`). Missions are frozen. Raises UserError: one line that
    says which key is wrong, and what is allowed.

    >>> from quadstep import Mission
    >>> circle = {"type": "circle", "centre": [0.0, 0.0, 3.0], "radius": 2.0, "period": 8.0}
    >>> mission = Mission(vehicle={"preset": "x500"}, path=circle, controller={"type": "pid"})
    >>> type(mission).__name__, mission.path.turns
    ('MultirotorMission', 2.0)
    >>> Mission(path={**circle, "radius": -2.0})
    Traceback (most recent call last):
    quadstep.io.errors.UserError: Mission: path.radius: should be greater than 0, not -2.0 m
    """

    if TYPE_CHECKING:
        name: Name
        path: AnyPath
        vehicle: Any
        controller: ControllerSection
        simulation: ClockSection
        metrics: tuple[str, ...]
        margins: MarginsSection
        tune: TuneSection | None

    @property
    def random(self) -> list[str]:
        """What is drawn anew for each flight, so that flights of the same numbers differ, in words."""
        return []

    @property
    def noisy(self) -> bool:
        """Whether flights of the same numbers differ."""
        return bool(self.random)

    @property
    def latency(self) -> float:
        """How old measurements are when they arrive, and commands when they act [s]."""
        return 0.0

    with_rotors: ClassVar[bool] = False
    """Whether its vehicle has rotors of its own, whose effort can be measured."""

    measures: ClassVar[type]
    """What the vehicle tells its controllers."""

    @classmethod
    def usual_clock(cls, controller: object, clock: object, folder: Path) -> object:
        """The table `simulation` with the sample times of a controller of this type where it says none.

        controller: None for the usual one. folder: the mission's.
        """
        usual = cls.model_fields["controller"].default  # none for a plant whose controllers are all the user's own
        name = getattr(usual, "type", None) if controller is None else controller
        law = law_named(name, cls.measures, folder) if isinstance(name, str) else None
        keys = cast(type[ClockSection], cls.model_fields["simulation"].annotation).model_fields
        return with_usual_rates(clock, law, keys) if law else clock

    @property
    def modelled(self) -> ModelledVehicle:
        """The vehicle that the controller is built for."""
        return cast(ModelledVehicle, self.vehicle)

    @property
    @abstractmethod
    def plant(self) -> Plant:
        """What is flown."""

    @property
    def scores(self) -> tuple[str, ...]:
        """The metrics that campaigns, envelopes and tuning have of its flights, with units."""
        return score_names(self.plant, self.own_metrics)

    @property
    def own_metrics(self) -> tuple[Metric, ...]:
        return own_metrics(self.metrics, self.folder)

    @classmethod
    def model_validate(cls, obj: object, *, context: Mapping[str, Path] | None = None, **_: object) -> Self:
        """The checked mission of the plant that the vehicle names, from a dict of its keys. Raises UserError."""
        folder = (context or {}).get("folder", Path())
        return cast(Self, check_mission(plain(obj), "Mission", folder, None if cls is Mission else cls))

    def with_(self, changes: Mapping[str, object] = MappingProxyType({}), /, **keys: object) -> "Mission":
        """The same mission with other values of some keys. changes: by dotted key; keys: two underscores stand for each dot.

        Raises UserError as `Mission(...)` does.

        >>> from quadstep import Mission
        >>> slow = Mission(path={"type": "minimum-jerk", "end": [1.0, 0.0, 2.0], "duration": 4.0})
        >>> quick = slow.with_({"path.end.2": 1.0}, path__duration=2.0, controller__type="backstepping")
        >>> quick.path.end, quick.path.duration
        ((1.0, 0.0, 1.0), 2.0)
        """
        content, usual = self.model_dump(exclude_unset=True), plain(self.model_dump())
        content = cast("dict[str, object]", plain(content))
        for key, value in {**changes, **{name.replace("__", "."): value for name, value in keys.items()}}.items():
            content = with_value(content, key, plain(value), usual)
        return check_mission(content, "Mission", self.folder)

    @cached_property
    def folder(self) -> Path:
        """Where the files are that it names: beside the file it was read from, or the working directory.

        No field, so that missions of the same keys are equal wherever they are from.
        """
        return Path()

    @model_validator(mode="after")
    def _consistent(self, info: ValidationInfo) -> Self:
        """What no table can check alone. A mission of a file comes with a folder, where it looks up what it names."""
        if info.context is not None:
            self.__dict__["folder"] = info.context["folder"]
        self.simulation.check_loops(self.controller.controller.loops())
        scores = names_without_units(score_names(self.plant)) if self.metrics or self.tune else ()
        named = own_metrics(self.metrics, self.folder)
        check_names(named, scores, self.with_rotors)
        if self.tune:
            self.tune.check((*scores, *(one.name for one in named)))
        return self

    @property
    def scored_from(self) -> float:
        """From when on a flight is scored [s]."""
        return 0.0

    @property
    def arm(self) -> float:
        """From the vehicle's centre to its farthest rotor [m]; 0 if not known."""
        return 0.0

    @abstractmethod
    def build(self, path: BuiltPath) -> Built:
        """What is flown along a path. Raises UserError."""

    @abstractmethod
    def plant_metrics(self, log: FlightLog) -> tuple[Metrics, list[str]]:
        """What a flight of this plant was like, and warnings that only flying it could give."""

    def flight_metrics(self, log: FlightLog, grading: Grading = ungraded) -> tuple[Metrics, list[str]]:
        """The same, with metrics of the user's own and, where it is known, the grade of the loop at rest."""
        found, warnings = self.plant_metrics(log)
        own = of_log(self.own_metrics, log, self.plant.columns, self.scored_from - 0.5 * self.simulation.step)
        for name in own.keys() & found.keys():
            raise UserError(f"metrics: {name}: every flight already has a metric of this name")
        none = [one.name for one in self.own_metrics if own[one.full_name] is None and len(log.rows)]
        more = [f"the metric {name} is not finite on this flight, so it has no value" for name in none]
        rest = {AT_REST: dict(grade)} if (grade := grading(self)) else {}
        return {**found, **own, **rest}, [*warnings, *more]

    @property
    def cut(self) -> str:
        """How much of its path is flown, in a clause, where that is not all of it; else nothing."""
        flown, length = self.simulation.duration, self.path.build(self.folder).length
        return f"only the first {flown:g} s of a path of {length:.4g} s are flown" if flown and flown < length else ""

    def shortfall(self, plan: FlightPlan) -> str:
        """What its flight does that was not asked, in a clause for those who look at its loop alone; empty where nothing."""
        try:
            log = fly(plan)
            if log.outcome is not Outcome.COMPLETED:
                return f"the mission's flight is lost at {log.ended:.4g} s ({reason(plan, log)})"
            reasons = graded(self.flight_metrics(log)[0]).reasons
        except UserError as error:
            return f"the mission cannot be flown ({error})"
        return f"in flight, {together(reasons)}" if reasons else ""

    @property
    def moments(self) -> list[EventMark]:
        """What happens to the vehicle, and where its path is; what matters most first."""
        return waypoints_of(self.path)

    def figures(self, log: FlightLog) -> list[FigureJob]:
        seen, since = seen_moments(log, self.moments, self.scored_from), self.scored_from
        whole = " Figures and captions cover the whole flight; errors of cards and tables "
        first = (of_marks(seen) + f"{whole}count from {since:g} s on." * bool(since), "")
        jobs = enumerate(flight_jobs(log, self.name, self.plant.efforts))
        return [one._replace(moments=seen, caption=one.caption + first[min(i, 1)]) for i, one in jobs]

    def plan(self, folder: Path | None = None, warn: bool = True, drawn: bool = False) -> FlightPlan:
        """The flight this mission describes, as laws and numbers. Raises UserError.

        folder: where to look for files that it names, if not in the mission's folder. warn: whether to look for
        warnings. drawn: whether this is one of many flights, which may end with its first command.

        >>> from quadstep import Mission
        >>> plan = Mission(path={"type": "minimum-jerk", "end": [1.0, 0.0, 2.0], "duration": 4.0}).plan()
        >>> plan.ticks.last * plan.ticks.step, plan.parameters.vehicle.mass
        (4.0, 1.0)
        """
        folder = self.folder if folder is None else folder
        path, vehicle = self.path.build(folder), self.modelled
        built = self.build(path)
        controller = self.controller.build(vehicle, folder)
        loop = Loop(self.plant, path.law, controller.law, built.air, built.sensing, built.guided, built.late)
        periods = {**built.periods, **{task.name: self.simulation.period_of(task.name) for task in loop.sampled}}
        ticks = self.simulation.clock(path.length, [periods[task.name] for task in loop.tasks])
        last = ticks.last // ticks.log * ticks.log * ticks.step
        if self.scored_from >= last:
            raise UserError(f"score_from: {self.scored_from:g} s is not before the last row of the log at {last:g} s")
        parameters = built.numbers(path=path.parameters, gains=controller.gains)
        start = built.start(path.law.reference(0.0, path.parameters))
        if warn:
            if built.own_plant:
                with errors_in("vehicle", built.own_plant):
                    check_plant(loop, parameters, start)
            if self.metrics and (users := [one for one in self.own_metrics if one.name not in EFFORTS]):
                try_metrics(users, self.plant.columns)
            if not drawn and (where := defined_at(getattr(type(loop.air), "wind", None))):
                check_wind(loop, parameters, start, where)
            if self.controller.own:
                try_controller(self.controller.type, loop, parameters, start, ticks, drawn)
        loop = replace(loop, controller=built.fitted(controller.law, periods))
        flown = ticks.last * ticks.step
        warnings = [*self.controller.warnings(vehicle), *built.warnings(flown)] if warn else []
        return FlightPlan(loop, parameters, start, ticks, tuple(warnings))


def try_controller(name: str, loop: Loop, parameters: Any, start: Any, ticks: Ticks, drawn: bool) -> None:
    """One sample of a controller of the user's own. Raises UserError naming it."""
    try:
        try_out(loop, parameters, start, ticks)
    except UserError as error:
        if drawn and isinstance(error, NotFiniteError):
            return
        method = getattr(loop.controller, str(error).partition(":")[0], None)
        raise type(error)(f"controller: {name}: {error}{defined_at(method)}") from None
