"""A study file: which vehicles, paths and scenarios are flown, under which controllers, how these are tuned, and what is
measured.
"""

from collections.abc import Collection, Mapping
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import AfterValidator, BeforeValidator, Field

from quadstep.io.errors import unknown_name
from quadstep.mission.distributions import Together, Varied, ordered
from quadstep.mission.fields import Finite, Name, Positive, Quantity, Section, Several, printable
from quadstep.mission.tune import as_constraints, as_ranges, ranges_by_key

Content: TypeAlias = dict[str, object]
"""A mission, or a table of one, as parsed TOML."""

MOST_NAMES, MOST_SEEDS, FEWEST_TUNED, USUAL_TUNED = 200, 100_000, 16, 64
"""Entries of a table; flights of a cell; seeds of tuning, with fewer of which the tail is overfitted; those of a study that
names none.
"""

OF_THE_STUDY = {
    "vehicle": "the study's `vehicles` decide it",
    "controller": "the study's `controllers` decide it",
    "tune": "the study's `tuning` decides it",
    "name": "flights are named after their cell",
    "seed": "the study has one seed, and each flight has its own draws",
    "metrics": "the study's `metrics` decide it",
}
"""Keys of a mission that paths and scenarios cannot set, and why."""

Note = Annotated[str, Field(max_length=1000), AfterValidator(printable)]
Names = Annotated[Several[Name], Field(min_length=1, max_length=MOST_NAMES)]


class Limited(Section):
    """Something that is flown by some vehicles only, if it says which."""

    vehicles: Annotated[Names | None, Quantity("", "vehicles that fly it; default: all")] = None

    def suits(self, vehicle: str) -> bool:
        return self.vehicles is None or vehicle in self.vehicles


def of_a_mission(keys: Content) -> Content:
    """Refuses what the study itself says. Raises ValueError."""
    for key, why in OF_THE_STUDY.items():
        if key in keys and not (
            key == "vehicle" and isinstance(table := keys[key], dict) and not {"preset", "file"} & table.keys()
        ):
            raise ValueError(f"{key} cannot be set here: {why}")
    return keys


Keys = Annotated[Content, AfterValidator(of_a_mission)]


class PathEntry(Limited):
    """A path."""

    mission: Annotated[Keys, Quantity("", "mission keys, including path")]

    def model_post_init(self, context: object) -> None:
        if "path" not in self.mission:
            raise ValueError("mission.path is required")


class ScenarioEntry(Limited):
    """Conditions."""

    mission: Annotated[Keys, Quantity("", "mission keys that override the path's")] = Field(default_factory=dict)
    vary: Varied = Field(default_factory=dict)
    correlated: Together = ()
    paths: Annotated[Names | None, Quantity("", "paths flown in it; default: all")] = None


class ControllerEntry(Limited):
    """A controller. Its gains are tuned, or frozen for a reason ("as shipped")."""

    controller: Annotated[
        Content,
        BeforeValidator(lambda one: {"type": one} if isinstance(one, str) else one),
        Quantity("", "a table as in a mission, or only the type"),
    ]
    frozen: Annotated[Name | None, Quantity("", "reason why its gains are not tuned")] = None
    optional: Annotated[bool, Quantity("", "left out, with a note, where a package that it needs is not installed")] = False
    ranges: Annotated[
        Annotated[Content, BeforeValidator(ranges_by_key), AfterValidator(as_ranges)] | None,
        Quantity("", "ranges of tuned gains, {} for the declared one; default: all gains that declare a range"),
    ] = None

    def model_post_init(self, context: object) -> None:
        if not isinstance(self.controller.get("type"), str):
            raise ValueError("controller.type is required")  # noqa: TRY004 (pydantic takes it for an answer)
        if self.frozen is not None and self.ranges is not None:
            raise ValueError("frozen and ranges are both given; gains are either frozen or tuned")


class PathAndScenario(Section):
    """A path and a scenario."""

    path: Annotated[Name, Quantity("", "name of a path")]
    scenario: Annotated[Name, Quantity("", "name of a scenario")]


class TuningSection(Section):
    """How gains are found, the same for every controller; gains of a file `gains` are tuned only with `--retune`."""

    flown: Annotated[
        Several[PathAndScenario],
        Field(min_length=1, max_length=MOST_NAMES),
        Quantity("", "paths and scenarios used for tuning"),
    ]
    seeds: Annotated[int, Field(ge=FEWEST_TUNED, le=MOST_SEEDS), Quantity("", "flights per candidate on each of these")] = (
        USUAL_TUNED
    )
    budget: Annotated[int, Field(ge=1, le=10**9), Quantity("", "flights per controller and vehicle")]
    objective: Annotated[
        dict[str, Positive], Field(min_length=1), Quantity("", "weight of each metric in the cost of a flight")
    ] = Field(default_factory=lambda: {"position_rmse": 1.0})
    aggregate: Annotated[
        Literal["mean", "p95", "worst"], Quantity("", "aggregate of the flights' costs; its mean over `flown` is minimised")
    ] = "p95"
    constraints: Annotated[
        Annotated[dict[str, Any], AfterValidator(as_constraints)] | None,
        Quantity(
            "", "limits of metrics and margins, as in [tune]; {} for none; if no margin is named, also those of a sound loop"
        ),
    ] = None
    repeats: Annotated[
        int, Field(ge=1, le=20), Quantity("", "searches per controller and vehicle, each with its own seed")
    ] = 3
    gains: Annotated[str | None, Quantity("", "a file with gains from an earlier run")] = None


class MarginEntry(Limited):
    """Something that is raised until flights fail, in steps if necessary: a latency is a whole number of samples."""

    keys: Annotated[Names, Quantity("", "mission keys, raised together")]
    path: Annotated[Name, Quantity("", "name of a path")]
    scenario: Annotated[Name, Quantity("", "name of a scenario")]
    low: Annotated[Finite, Quantity("", "lowest value, in the key's unit")] = 0.0
    high: Annotated[Finite, Quantity("", "highest value")]
    step: Annotated[Positive | None, Quantity("", "only multiples of this are flown")] = None
    unit: Annotated[Name, Quantity("", "unit to show")] = ""
    flights: Annotated[int, Field(ge=20, le=10_000), Quantity("", "flights per controller")] = 200
    error: Annotated[Positive, Quantity("m", "limit above which a flight also counts as failed")] = 1.0

    def model_post_init(self, context: object) -> None:
        ordered(self.low, self.high)
        if self.step is not None and (self.high - self.low) / self.step > 1000.0:
            raise ValueError(f"step = {self.step:g} makes more than 1000 steps from low to high")


def check_table(table: object) -> object:
    """Refuses a table of too many entries, or with names that are no plain text. Raises ValueError."""
    if isinstance(table, dict):
        if not table or len(table) > MOST_NAMES:
            raise ValueError(f"should have from 1 to {MOST_NAMES} entries, not {len(table)}")
        for name in table:
            if not name.strip() or not name.isprintable() or len(name) > 60:
                raise ValueError(f"{name!r:.40} is not a valid name: printable text of at most 60 characters")
    return table


class StudyFile(Section):
    """A study: which vehicles fly which paths in which scenarios, under which controllers."""

    name: Annotated[Name, Quantity("", "name of the study, shown in its report")] = "Study"
    vehicles: Annotated[Names, Quantity("", "presets, plants, vehicle files, or FILE.py:NAME of your own")]
    common: Annotated[Keys, Quantity("", "mission keys common to all flights")] = Field(default_factory=dict)
    paths: Annotated[dict[str, PathEntry], BeforeValidator(check_table), Quantity("", "paths by name")]
    scenarios: Annotated[dict[str, ScenarioEntry], BeforeValidator(check_table), Quantity("", "scenarios by name")]
    controllers: Annotated[dict[str, ControllerEntry], BeforeValidator(check_table), Quantity("", "controllers by name")]
    tuning: TuningSection | None = None
    margins: Annotated[Annotated[dict[str, MarginEntry], BeforeValidator(check_table)] | None, Quantity("", "by name")] = None
    seeds: Annotated[int, Field(ge=2, le=MOST_SEEDS), Quantity("", "flights per cell")] = 500
    seed: Annotated[int, Field(ge=0, lt=2**63), Quantity("", "seed of all draws")] = 1
    precision: Annotated[Literal["f32", "f64"], Quantity("", "floating-point precision of the flights")] = "f64"
    score_period: Annotated[Positive | None, Quantity("s", "sampling period of the metrics; default: the log period")] = None
    metrics: Annotated[Names, Quantity("", "metrics to report, also FILE.py:NAME of your own; the first one ranks")] = (
        "position_rmse",
        "largest_error",
    )
    notes: Annotated[
        Annotated[Several[Note], Field(max_length=50)], Quantity("", "limitations of the study, for its report")
    ] = ()

    def model_post_init(self, context: object) -> None:
        twice = [name for name in self.vehicles if self.vehicles.count(name) > 1]
        if twice:
            raise ValueError(f"vehicles: {twice[0]} is named twice")
        limited: dict[str, Mapping[str, Limited]] = {"paths": self.paths, "scenarios": self.scenarios}
        limited |= {"controllers": self.controllers, "margins": self.margins or {}}
        for table, found in limited.items():
            for name, one in found.items():
                check_named("vehicles", one.vehicles or (), self.vehicles, f"{table}.{name}")
        for name, scenario in self.scenarios.items():
            check_named("paths", scenario.paths or (), self.paths, f"scenarios.{name}")
        for place, where in enumerate(self.tuning.flown if self.tuning else ()):
            self._check_place(where.path, where.scenario, f"tuning.flown[{place}]")
        for name, margin in (self.margins or {}).items():
            self._check_place(margin.path, margin.scenario, f"margins.{name}")

    def _check_place(self, path: str, scenario: str, said: str) -> None:
        check_named("path", (path,), self.paths, said)
        check_named("scenario", (scenario,), self.scenarios, said)


def check_named(what: str, names: tuple[str, ...], there: Collection[str], said: str) -> None:
    """Refuses the name of nothing. Raises ValueError."""
    for name in names:
        if name not in there:
            raise ValueError(f"{said}.{what}: {unknown_name('value', name, there)}")
