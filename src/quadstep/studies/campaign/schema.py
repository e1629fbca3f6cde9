"""A campaign file: which mission, what varies in it, and what counts as failure; how rare failures are searched for."""

import contextlib
import hashlib
import json
import math
from collections.abc import Mapping
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import BeforeValidator, Field

from quadstep.engines.scored import names_without_units
from quadstep.io import files, places
from quadstep.io.documents import read_toml
from quadstep.io.doors import all_installed
from quadstep.io.errors import UserError, errors_in
from quadstep.metrics.registry import LARGEST, RMSE
from quadstep.mission.check import check
from quadstep.mission.distributions import CorrelatedKeys, Distribution, Grid, by_key
from quadstep.mission.fields import Name, Positive, Quantity, Section, Several, as_tuple, key_parts
from quadstep.mission.presets import DEEPEST
from quadstep.mission.read import CAMPAIGN, check_mission, named_after, refuse_others
from quadstep.mission.schema import Mission
from quadstep.report.units import listed, metric, unit_suffix
from quadstep.studies.campaign import LARGEST_CHUNK, MOST_CHUNKS, MOST_FLIGHTS


class Method(StrEnum):
    """The method by which a replicate makes failures frequent."""

    CROSS_ENTROPY = "cross-entropy"
    SUBSET = "subset"

    @property
    def words(self) -> str:
        return "cross-entropy" if self is Method.CROSS_ENTROPY else "subset simulation"

    @property
    def other(self) -> "Method":
        """The other method, which gives a second opinion."""
        return Method.SUBSET if self is Method.CROSS_ENTROPY else Method.CROSS_ENTROPY


def as_method(value: object) -> object:
    """The method of a name in TOML. Raises ValueError for an unknown name."""
    if value not in tuple(Method):
        raise ValueError(f"should be {' or '.join(Method)}, not {value!r:.60}")
    return Method(str(value))


class RareSection(Section):
    """How a small probability is estimated."""

    method: Annotated[Method, BeforeValidator(as_method), Quantity("", "how flights are steered towards failure")] = (
        Method.CROSS_ENTROPY
    )
    score: Annotated[
        Annotated[
            tuple[str, ...],
            BeforeValidator(lambda value: (value,) if isinstance(value, str) else as_tuple(value)),
            Field(min_length=1),
        ]
        | None,
        Quantity("", "metrics that predict failure; default: the largest share of a limit, and the inputs' variation"),
    ] = None
    flights: Annotated[int, Field(ge=200, le=200_000), Quantity("", "flights per level or fit")] = 1000
    replicates: Annotated[int, Field(ge=5, le=50), Quantity("", "independent estimates")] = 5
    opinions: Annotated[
        int, Field(ge=0, le=10), Quantity("", "estimates by the other method, with other scores; they must agree")
    ] = 2


CHUNK = 65_536
"""Flights in one file of results: what a killed run loses at most."""

MOST_KEYS = 512
"""Most keys that may vary; each takes 8 bytes per flight."""

NOT_FLOWN = {
    "name": "a name does not affect flights",
    "seed": "every flight already has its own noise",
    "score_from": "when scoring starts does not affect flights",
    "metrics": "what is measured does not affect flights",
    "margins": "required margins do not affect flights",
    "tune": "what is tuned does not affect flights",
}
"""Keys of a mission that cannot vary, and why."""


class CampaignFile(Section):
    """A campaign file: which mission, how often, what varies, what counts as failure."""

    name: Annotated[Name, Quantity("", "name of the campaign, shown in its results; default: the file's name")] = "Campaign"
    mission: Annotated[
        str | dict[str, object], Quantity("", "a mission file, relative to this file's folder, or a whole mission as a table")
    ]
    flights: Annotated[
        Annotated[int, Field(ge=1, le=MOST_FLIGHTS)] | None,
        Quantity("", "number of flights; default: each combination of the grids once"),
    ] = None
    seed: Annotated[int, Field(ge=0, lt=2**63), Quantity("", "seed of all draws")] = 1
    precision: Annotated[Literal["f32", "f64"], Quantity("", "floating-point precision of the flights")] = "f64"
    score_period: Annotated[
        Positive | None, Quantity("s", "sampling period of the metrics; default: the mission's log period")
    ] = None
    chunk: Annotated[int, Field(ge=16, le=LARGEST_CHUNK), Quantity("", "flights per results file")] = CHUNK
    vary: Annotated[
        dict[str, Distribution], BeforeValidator(by_key), Quantity("", "a distribution for each mission key that varies")
    ] = Field(default_factory=dict)
    correlated: Annotated[Several[CorrelatedKeys], Quantity("", "keys that vary jointly")] = ()
    failure: Annotated[
        dict[str, Positive], Quantity("", "upper limits of metrics; a flight fails above any of them, or if it ends early")
    ] = Field(default_factory=dict)
    rare: Annotated[RareSection, Quantity("", "settings of `--rare`")] = RareSection()

    def model_post_init(self, context: object) -> None:
        keys = self.keys
        try:
            _ = [key_parts(key) for key in keys]
        except UserError as error:
            raise ValueError(f"vary: {error}") from None
        if self.combinations > MOST_FLIGHTS:
            raise ValueError(f"vary: the grids make {self.combinations:.3g} flights; allowed: at most {MOST_FLIGHTS}")
        if len(keys) > MOST_KEYS:
            raise ValueError(f"vary: {len(keys)} keys; allowed: at most {MOST_KEYS}")
        twice = [key for key in keys if keys.count(key) > 1]
        if twice:
            raise ValueError(f"{twice[0]}: is varied twice")
        for key in keys:
            longer = [other for other in keys if other.startswith(f"{key}.")]
            if longer:
                raise ValueError(f"vary: {longer[0]} is inside {key}, which varies as a whole")
        for key in keys:
            if key.partition(".")[0] in NOT_FLOWN:
                raise ValueError(f"vary: {key}: {NOT_FLOWN[key.partition('.')[0]]}")

    @property
    def combinations(self) -> int:
        return math.prod(len(one.options) for one in self.vary.values() if isinstance(one, Grid))

    @property
    def keys(self) -> list[str]:
        return [*self.vary, *(key for one in self.correlated for key in one.keys)]


ERRORS = {RMSE, LARGEST, "relative_error"}
"""Limits that a flight far from its path does not meet."""


class Campaign(NamedTuple):
    """A campaign and its mission as they were read.

    file: as checked. text: of the campaign file. content: of the mission, as the user wrote it; defaults: the same with every
    default. source, folder: of the mission, for errors and for the files it names. metrics: of its flights, with units.
    singly: the keys because of which flights are set up one by one, as planning them shows, and how long one took [s]. named:
    digests of the user's files that it names, by name, as they were read.
    """

    file: CampaignFile
    text: str
    content: dict[str, object]
    defaults: dict[str, Any]
    source: str
    folder: Path
    metrics: tuple[str, ...]
    singly: dict[str, float]
    named: Mapping[str, str] = {}

    @property
    def thresholds(self) -> dict[str, str]:
        """Metrics that can define a failure, by their names without units."""
        return names_without_units(self.metrics)

    def limits(self, how: str = "") -> list[str]:
        """The limits of a flight in words. how: it stands to them, after a blank, as " at most"."""
        named = [(*metric(self.thresholds[name]), limit) for name, limit in self.file.failure.items()]
        return [f"{words}{how} {limit:g}{unit_suffix(unit)}" for words, unit, limit in named]

    @property
    def failing(self) -> str:
        """When a flight fails, in words."""
        since = self.mission.scored_from if ERRORS & self.file.failure.keys() else 0.0
        return ", or ".join(["if it ends early", *self.limits(" above")]) + f"; errors count from {since:g} s on" * (
            since > 0.0
        )

    @property
    def meaning(self) -> str:
        """How a flight is judged, in brackets after a blank."""
        return f" ({'; '.join(self.judged)})"

    @property
    def judged(self) -> list[str]:
        """By which limits a flight is judged, or that there is none, and what is less, or later, than one expects."""
        limits, mission = self.limits(), self.mission
        if ERRORS & self.file.failure.keys():
            said = [f"{'limit' if len(limits) == 1 else 'limits'}: {listed(limits)}"]
            said += [f"the first {since:g} s are not counted"] if (since := mission.scored_from) else []
        else:
            rest = f" with {listed(self.limits(' at most'))}" * bool(limits)
            said = [f"success means reaching the end{rest}, however large the error"]
        if (lasts := mission.simulation.duration) and not {"simulation", "simulation.duration"} & {*self.file.keys}:
            elsewhere = any(key.startswith("path") for key in self.file.keys)
            said += [f"no flight lasts longer than {lasts:g} s, however long its path" if elsewhere else mission.cut]
        return [one.replace("\N{NO-BREAK SPACE}", " ") for one in said if one]

    @property
    def mission(self) -> Mission:
        """As written, nothing of it drawn."""
        return check_mission(self.content, self.source, self.folder)

    @property
    def flights(self) -> int:
        """The number of flights if the command line does not set it."""
        return self.file.flights or self.file.combinations

    @property
    def varies(self) -> bool:
        """Whether any key differs from flight to flight."""
        return bool(self.file.keys)

    def check_count(self, flights: int) -> None:
        """Refuses a number of flights that would make too many files, or too large ones. Raises UserError."""
        columns = len(self.file.keys) + len(self.metrics) + 4
        if 8 * columns * min(flights, self.file.chunk) > files.FLIGHTS.most:
            raise UserError(
                f"chunk: {self.file.chunk} flights of {columns} columns make a file larger than "
                f"{files.FLIGHTS.most / 1e6:g} MB; choose a chunk of {files.FLIGHTS.most // (8 * columns)} or less"
            )
        made = -(-flights // self.file.chunk)
        if made > MOST_CHUNKS:
            raise UserError(
                f"flights, chunk: {flights} flights, {self.file.chunk} a file, make {made} files; allowed: at most "
                f"{MOST_CHUNKS}: choose a chunk of {-(-flights // MOST_CHUNKS)} or more"
            )

    @property
    def double(self) -> bool:
        """Whether it is flown in f64."""
        return self.file.precision == "f64"

    @property
    def fingerprint(self) -> str:
        """A digest of everything that affects a flight's result; the number of flights does not."""
        text = json.dumps([self.decides, self.content, self.named], default=str)
        return hashlib.sha256(text.encode()).hexdigest()[:16]

    @property
    def decides(self) -> dict[str, object]:
        """What the campaign itself says that affects a flight."""
        return self.file.model_dump(exclude={"name", "flights", "failure", "mission", "rare"})

    def digested(self) -> "Campaign":
        """With the files as they are now."""
        return self._replace(named=digests([self.decides, self.content], self.folder))


def digests(content: object, folder: Path, depth: int = 0) -> dict[str, str]:
    """A digest of each file that a string in parsed TOML names, by name, and of those that these name or import in turn."""
    found: dict[str, str] = {}
    installed = all_installed()
    for name in sorted(set(strings(content))):
        named = places.place(name)
        for own in [named] if named else installed.get(name, []):
            with contextlib.suppress(UserError):  # not a file of the user's, or flying will report it
                found |= places.digests(own, folder)
        if named or name in installed:
            continue
        path = folder / name
        try:
            with files.opened(path, files.ANY) as file:
                found[name] = hashlib.file_digest(file, "sha256").hexdigest()
        except (OSError, UserError):  # no file, or not readable: flying will report it
            continue
        if path.suffix == ".toml" and depth < DEEPEST:
            with contextlib.suppress(UserError):
                inner = digests(read_toml(path), path.parent, depth + 1)
                found |= {str(Path(name).parent / one): content for one, content in inner.items()}
    return found


def strings(content: object) -> list[str]:
    if isinstance(content, str):
        return [content]
    inside = content.values() if isinstance(content, dict) else content if isinstance(content, list | tuple) else ()
    return [text for one in inside for text in strings(one)]


def read_campaign(path: Path) -> Campaign:
    """The campaign in a TOML file. Raises UserError naming file, key and what is allowed."""
    content = named_after(path) | read_toml(path)
    refuse_others(content, CAMPAIGN, str(path))
    file = check(CampaignFile, content, str(path))
    if isinstance(file.mission, str):
        source = path.parent / file.mission
        with errors_in(path, "mission"):
            mission, folder = read_toml(source), source.parent
    else:
        source, mission, folder = path, file.mission, path.parent
    return campaign_of(file, files.read_text(path, files.TOML), mission, str(source), folder, str(path))


def campaign_of(
    file: CampaignFile, text: str, mission: dict[str, object], source: str, folder: Path, about: str = ""
) -> Campaign:
    """A campaign from the content of its files. about: the campaign's own file.

    Raises UserError for a mission that could not be flown by itself, and for an unknown metric.
    """
    flown = check_mission(mission, source, folder)
    campaign = Campaign(file, text, mission, flown.model_dump(), source, folder, flown.scores, {}).digested()
    for name in file.failure:
        if name not in campaign.thresholds:
            raise UserError(f"{about or source}: failure.{name}: unknown key; allowed here: {', '.join(campaign.thresholds)}")
    for name in file.rare.score or ():
        if name not in campaign.thresholds:
            raise UserError(f"{about or source}: rare.score: {name!r:.60}: allowed here: {', '.join(campaign.thresholds)}")
    return campaign
