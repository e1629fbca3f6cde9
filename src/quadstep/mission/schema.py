"""A mission: everything a flight needs, as a user writes it. Every key but the path has a default.

What a mission can say depends on what it flies: `Mission` has the keys that all have in common, and the plan they make. Its
subclasses, one a plant, add theirs; `Mission(...)` and `Mission.model_validate` give the one that the vehicle asks for.
"""

from abc import abstractmethod
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, Self

from pydantic import ValidationInfo, model_validator

from quadstep.errors import UserError
from quadstep.flight.engines import FlightPlan
from quadstep.flight.log import FlightLog
from quadstep.flight.loop import Loop
from quadstep.flight.plant import Air, Plant
from quadstep.flight.scored import bare, score_names
from quadstep.guidance.reference import Reference
from quadstep.mission.clock import ClockSection
from quadstep.mission.derived import with_usual_rates
from quadstep.mission.fields import Name, Section
from quadstep.mission.kinds import kind_of
from quadstep.mission.own_controller import law_named
from quadstep.mission.paths import AnyPath, BuiltPath
from quadstep.mission.tune import TuneSection
from quadstep.report.drawing import FigureJob
from quadstep.sensing.suite import Suite


class Built(NamedTuple):
    """What a mission flies, as laws and numbers.

    periods: of each task of the loop, by name [s]. numbers: the parameters,
    given path and gains. start: the state at t = 0, given the reference then. warnings: what speaks against it, a line each.
    """

    periods: Mapping[str, float]
    numbers: Callable[..., Any]
    start: Callable[[Reference], Any]
    air: Air | None = None
    sensing: Suite | None = None
    guided: bool = False
    warnings: Callable[[], list[str]] = list


class Mission(Section):
    """What every mission has; the order of the keys is that of its subclass."""

    if TYPE_CHECKING:
        name: Name
        path: AnyPath
        vehicle: Any
        controller: Any
        simulation: ClockSection
        tune: TuneSection | None

    @property
    def noisy(self) -> bool:
        """Whether flights of the same numbers differ by their noise."""
        return False

    measures: ClassVar[type]
    """What the vehicle tells its controllers."""

    @model_validator(mode="before")
    @classmethod
    def _at_the_controllers_rates(cls, content: Any, info: ValidationInfo) -> Any:
        if not isinstance(content, dict):
            return content
        table = content.get("controller", {"type": cls.model_fields["controller"].default.type})
        name = table.get("type") if isinstance(table, dict) else None
        folder = (info.context or {}).get("folder", Path())
        law = law_named(name, cls.measures, folder) if isinstance(name, str) else None
        return with_usual_rates(content, law) if law else content

    @property
    def modelled(self) -> Any:
        """The vehicle that the controller is built for."""
        return self.vehicle

    @property
    @abstractmethod
    def plant(self) -> Plant:
        """What is flown."""

    @property
    def scores(self) -> tuple[str, ...]:
        """The metrics that campaigns, envelopes and tuning have of its flights, with units."""
        return score_names(self.plant)

    @property
    def scored_from(self) -> float:
        """From when on a flight is scored [s]."""
        return 0.0

    def __new__(cls, **given: Any) -> Self:
        """The mission of the plant that the vehicle names."""
        kind: Any = kind_of(given) if cls is Mission else cls
        made: Self = super().__new__(kind)
        return made

    @classmethod
    def model_validate(cls, obj: Any, **how: Any) -> Self:
        """The checked mission of the plant that the vehicle names. Raises pydantic's ValidationError."""
        if cls is not Mission:
            return super().model_validate(obj, **how)
        kind: Any = kind_of(obj, (how.get("context") or {}).get("folder", Path()))
        found: Self = kind.model_validate(obj, **how)
        return found

    @abstractmethod
    def build(self, path: BuiltPath) -> Built:
        """What is flown along a path. Raises UserError."""

    @abstractmethod
    def metrics(self, log: FlightLog) -> tuple[dict[str, Any], list[str]]:
        """What the flight was like, and warnings that only flying it could give."""

    @abstractmethod
    def figures(self, log: FlightLog) -> list[FigureJob]:
        """What is drawn of a flight."""

    @model_validator(mode="after")
    def _tunes_what_is_scored(self) -> Self:
        for table, names in (("objective", self.tune.objective), ("constraints", self.tune.constraints)) if self.tune else ():
            unknown = [name for name in names if name not in bare(self.scores)]
            if unknown:
                raise ValueError(f"tune: {table}.{unknown[0]}: unknown metric; allowed: {', '.join(bare(self.scores))}")
        return self

    def plan(self, folder: Path = Path(), warn: bool = True) -> FlightPlan:
        """The flight this mission describes. Files it names are looked up from `folder`. Raises UserError.

        warn: whether to look for what speaks against it.
        """
        path, vehicle = self.path.build(folder), self.modelled
        built = self.build(path)
        controller = self.controller.build(vehicle, folder)
        loop = Loop(self.plant, path.law, controller.law, built.air, built.sensing, built.guided)
        ticks = self.simulation.clock(path.length, [built.periods[task.name] for task in loop.tasks])
        last = ticks.last // ticks.log * ticks.log * ticks.step
        if self.scored_from >= last:
            raise UserError(f"score_from: {self.scored_from:g} s is not before the last row of the log at {last:g} s")
        parameters = built.numbers(path=path.parameters, gains=controller.gains)
        start = built.start(path.law.reference(0.0, path.parameters))
        warnings = [*self.controller.warnings(vehicle), *built.warnings()] if warn else []
        return FlightPlan(loop, parameters, start, ticks, tuple(warnings))
