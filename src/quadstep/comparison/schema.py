"""A study file: which vehicles, paths and scenarios are flown, under which controllers, how these are tuned, and what is
measured.
"""

from collections.abc import Collection, Mapping
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from quadstep.campaign.distributions import Correlated, Distribution, by_key
from quadstep.mission.fields import Finite, Name, Positive, Section, as_tuple, printable
from quadstep.mission.tune import as_ranges, ranges_by_key

Content: TypeAlias = dict[str, Any]
"""A mission, or a table of one, as parsed TOML."""

MOST_NAMES, MOST_SEEDS, FEWEST_TUNED = 200, 100_000, 64
"""Entries of a table; flights of a cell; seeds of tuning, below which the tail is overfitted."""

EFFORTS = ("energy", "rotor_activity", "saturation")
"""What is measured beside tracking, where the vehicle has rotors of its own."""

OF_THE_STUDY = {
    "vehicle": "the study's `vehicles` say what flies",
    "controller": "the study's `controllers` say what flies it",
    "tune": "the study's `tuning` says how",
    "name": "a flight is named after its cell",
    "seed": "the study has one seed, and each flight its own draws",
    "metrics": "the study's `metrics` say what is measured",
}
"""Keys of a mission that paths and scenarios cannot set, and why."""

Note = Annotated[str, Field(max_length=1000), AfterValidator(printable)]
Names = Annotated[tuple[Name, ...], BeforeValidator(as_tuple), Field(min_length=1, max_length=MOST_NAMES)]


class Limited(Section):
    """Something that is flown by some vehicles only, if it says which."""

    vehicles: Names | None = None

    def suits(self, vehicle: str) -> bool:
        """Whether a vehicle flies it."""
        return self.vehicles is None or vehicle in self.vehicles


def of_a_mission(keys: Content) -> Content:
    """Refuses what the study itself says. Raises ValueError."""
    for key, why in OF_THE_STUDY.items():
        if key in keys and not (
            key == "vehicle" and isinstance(keys[key], dict) and not {"preset", "file"} & keys[key].keys()
        ):
            raise ValueError(f"{key} cannot be set here: {why}")
    return keys


Keys = Annotated[Content, AfterValidator(of_a_mission)]


class PathEntry(Limited):
    """A path. mission: keys of a mission, among them `path`. vehicles: those that fly it; all if left out."""

    mission: Keys

    @model_validator(mode="after")
    def _with_a_path(self) -> "PathEntry":
        if "path" not in self.mission:
            raise ValueError("mission.path: missing; it is needed")
        return self


class ScenarioEntry(Limited):
    """Conditions. mission: keys of a mission on top of the path's. vary, correlated: what differs from flight to flight, as in
    a campaign. paths: those flown in it; all if left out.
    """

    mission: Keys = Field(default_factory=dict)
    vary: Annotated[dict[str, Distribution], BeforeValidator(by_key)] = Field(default_factory=dict)
    correlated: Annotated[tuple[Correlated, ...], BeforeValidator(as_tuple)] = ()
    paths: Names | None = None


class ControllerEntry(Limited):
    """A controller. controller: its table as in a mission, or its type. frozen: why its gains are not tuned ("as shipped").
    ranges: of gains that are tuned, {} for the declared one; all that declare a range if left out.
    """

    controller: Annotated[Content, BeforeValidator(lambda one: {"type": one} if isinstance(one, str) else one)]
    frozen: Name | None = None
    ranges: Annotated[Content, BeforeValidator(ranges_by_key), AfterValidator(as_ranges)] | None = None

    @model_validator(mode="after")
    def _one_of_both(self) -> "ControllerEntry":
        if not isinstance(self.controller.get("type"), str):
            raise ValueError("controller.type: missing; it is needed")  # noqa: TRY004 (pydantic takes it for an answer)
        if self.frozen is not None and self.ranges is not None:
            raise ValueError("frozen and ranges are both given; gains are either frozen or tuned")
        return self


class Place(Section):
    """A path and a scenario."""

    path: Name
    scenario: Name


class TuningSection(Section):
    """How gains are found, the same for every controller.

    flown: the paths and scenarios that are tuned on. seeds: flights of each candidate on each of these. budget: flights a
    controller and vehicle. objective, aggregate: as in a mission's [tune]; what is minimised is the mean of the aggregates
    over `flown`. gains: a file of gains that an earlier run found, which are taken as they are.
    """

    flown: Annotated[tuple[Place, ...], BeforeValidator(as_tuple), Field(min_length=1, max_length=MOST_NAMES)]
    seeds: Annotated[int, Field(ge=FEWEST_TUNED, le=MOST_SEEDS)] = FEWEST_TUNED
    budget: Annotated[int, Field(ge=1, le=10**9)]
    objective: Annotated[dict[str, Positive], Field(min_length=1)] = Field(default_factory=lambda: {"position_rmse": 1.0})
    aggregate: Literal["mean", "p95", "worst"] = "p95"
    gains: str | None = None


class MarginEntry(Limited):
    """Something that is raised until flights fail. keys: of the mission, raised together.

    path, scenario: where. low, high: between which values. step: where given, only multiples of it are flown, as a latency has
    to be a whole number of samples. flights: of each controller. error: [m], beyond which a flight counts as failed too.
    """

    keys: Names
    path: Name
    scenario: Name
    low: Finite = 0.0
    high: Finite
    step: Positive | None = None
    unit: Name = ""
    flights: Annotated[int, Field(ge=20, le=10_000)] = 200
    error: Positive = 1.0

    @model_validator(mode="after")
    def _ordered(self) -> "MarginEntry":
        if self.low >= self.high:
            raise ValueError(f"low = {self.low:g} must be below high = {self.high:g}")
        if self.step is not None and (self.high - self.low) / self.step > 1000.0:
            raise ValueError(f"step = {self.step:g} makes more than 1000 steps from low to high")
        return self


def named(table: object) -> object:
    """Refuses a table of too many entries, or with names that are no plain text. Raises ValueError."""
    if isinstance(table, dict):
        if not table or len(table) > MOST_NAMES:
            raise ValueError(f"should have from 1 to {MOST_NAMES} entries, not {len(table)}")
        for name in table:
            if not name.strip() or not name.isprintable() or len(name) > 60:
                raise ValueError(f"{name!r:.40} is no name: printable text of at most 60 characters")
    return table


class StudyFile(Section):
    """A study. common: keys of a mission that all flights have; first of them what sensors there are.

    seeds: flights of a cell. metrics: what is reported of each flight beside its outcome, the first of which ranks. notes:
    what the report says of the limits of the study.
    """

    name: Name = "Study"
    vehicles: Names
    common: Keys = Field(default_factory=dict)
    paths: Annotated[dict[str, PathEntry], BeforeValidator(named)]
    scenarios: Annotated[dict[str, ScenarioEntry], BeforeValidator(named)]
    controllers: Annotated[dict[str, ControllerEntry], BeforeValidator(named)]
    tuning: TuningSection | None = None
    margins: Annotated[dict[str, MarginEntry], BeforeValidator(named)] | None = None
    seeds: Annotated[int, Field(ge=2, le=MOST_SEEDS)] = 500
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 1
    precision: Literal["f32", "f64"] = "f64"
    score_period: Positive | None = None
    metrics: Names = ("position_rmse", "largest_error")
    notes: Annotated[tuple[Note, ...], BeforeValidator(as_tuple), Field(max_length=50)] = ()

    @model_validator(mode="after")
    def _names_what_is_there(self) -> "StudyFile":
        twice = [name for name in self.vehicles if self.vehicles.count(name) > 1]
        if twice:
            raise ValueError(f"vehicles: {twice[0]} is named twice")
        limited: dict[str, Mapping[str, Limited]] = {"paths": self.paths, "scenarios": self.scenarios}
        limited |= {"controllers": self.controllers, "margins": self.margins or {}}
        for table, found in limited.items():
            for name, one in found.items():
                known("vehicles", one.vehicles or (), self.vehicles, f"{table}.{name}")
        for name, scenario in self.scenarios.items():
            known("paths", scenario.paths or (), self.paths, f"scenarios.{name}")
        for place, where in enumerate(self.tuning.flown if self.tuning else ()):
            self._known_place(where.path, where.scenario, f"tuning.flown[{place}]")
        for name, margin in (self.margins or {}).items():
            self._known_place(margin.path, margin.scenario, f"margins.{name}")
        return self

    def _known_place(self, path: str, scenario: str, said: str) -> None:
        known("path", (path,), self.paths, said)
        known("scenario", (scenario,), self.scenarios, said)


def known(what: str, names: tuple[str, ...], there: Collection[str], said: str) -> None:
    """Refuses the name of nothing. Raises ValueError."""
    for name in names:
        if name not in there:
            raise ValueError(f"{said}.{what}: {name!r:.60} is not in the study; allowed: {', '.join(there)}")
