"""The request and its axes: a mission or a campaign file and the axes of the map, turned into a campaign of all cells."""

import itertools
import json
import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple, TypeAlias

from quadstep.io import files
from quadstep.io.documents import read_toml
from quadstep.io.errors import UserError, unknown_name
from quadstep.mission.distributions import MOST_OPTIONS, Grid
from quadstep.mission.fields import MOST, unit, words
from quadstep.mission.read import check_mission
from quadstep.numbers.functions import evenly_spaced
from quadstep.report.units import unit_suffix
from quadstep.studies.campaign.planner import Planner
from quadstep.studies.campaign.schema import NOT_FLOWN, Campaign, CampaignFile, campaign_of, read_campaign
from quadstep.studies.campaign.varied import text_of

Value: TypeAlias = float | int | bool | str

MOST_CELLS = 1_000_000
MOST_PANELS = 12

HOW = "give KEY=a:b:n (n numbers from a to b) or KEY=v1,v2,... (numbers, true and false, or words)"
KEY = re.compile(r"[A-Za-z0-9_-]+(\.[A-Za-z0-9_-]+)*")
WORDS = {"true": True, "false": False}


class MapAxis(NamedTuple):
    """One direction of the map. option: where the user gave it. ranged: evenly spaced numbers, not a list. unit: of these."""

    option: str
    key: str
    values: tuple[Value, ...]
    ranged: bool
    unit: str = ""

    def shown(self, value: Value, bound: int = 0) -> str:
        """A value for people, with its unit: of evenly spaced ones the digits that tell neighbours apart, else all. bound: 1
        to round up, so that "at most" is true of it, −1 to round down.
        """
        said = text_of(value)
        if self.ranged and isinstance(value, float | int):
            step = (float(self.values[-1]) - float(self.values[0])) / (len(self.values) - 1)
            near = round(value, places := max(0, 1 - math.floor(math.log10(step))))
            beyond = bound * (value - near) > 1e-9 * step
            said = f"{near + beyond * bound * 10.0**-places + 0.0:.10g}"
        return f"{said}{'' if isinstance(value, bool) else unit_suffix(self.unit or '-')}"

    def in_words(self, value: Value) -> str:
        """A value in words: "nets off", "path duration = 4 s"."""
        return f"{words(self.key)} {self.shown(value) if isinstance(value, bool) else f'= {self.shown(value)}'}"

    @property
    def whole(self) -> bool:
        """Whether all values are whole numbers."""
        return all(isinstance(value, float) and value.is_integer() for value in self.values)


def parse_axis(option: str, text: str, most: int) -> MapAxis:
    """An axis from what was typed after `option`, of at most so many values. Raises UserError."""
    key, equals, given = (part.strip() for part in text.partition("="))
    if not equals or not KEY.fullmatch(key):
        raise UserError(f"{option}: {text!r:.60} cannot be parsed; {HOW}")
    key = ".".join(str(int(part)) if part.isdecimal() else part for part in key.split("."))
    if key.partition(".")[0] in NOT_FLOWN:
        raise UserError(f"{option} {key}: {NOT_FLOWN[key.partition('.')[0]]}")
    where, ranged = f"{option} {key}", ":" in given
    values = spaced(where, given, most) if ranged else listed(where, given)
    if len(values) > most:
        raise UserError(f"{where}: {len(values)} values; allowed: at most {most}")
    return MapAxis(option, key, values, ranged and len(values) > 1)


def spaced(where: str, text: str, most: int) -> tuple[float, ...]:
    """The numbers of a:b:n. Raises UserError."""
    parts = text.split(":")
    if len(parts) != 3:
        raise UserError(f"{where}: {text!r:.60} cannot be parsed; {HOW}")
    low, high = (number(where, part) for part in parts[:2])
    if not re.fullmatch(r"\s*[+-]?[0-9]{1,18}\s*", parts[2], re.ASCII):
        raise UserError(f"{where}: n in a:b:n should be a whole number, not {parts[2]!r:.60}")
    count = int(parts[2])
    if not 1 <= count <= most:
        raise UserError(f"{where}: n in a:b:n should be from 1 to {most}, not {count}")
    if low >= high:
        raise UserError(f"{where}: a in a:b:n should be below b, not {low:g} and {high:g}")
    return tuple(evenly_spaced(low, high, count))


def listed(where: str, text: str) -> tuple[Value, ...]:
    """The values of v1,v2,v3. Raises UserError."""
    parts = [part.strip() for part in text.split(",")]
    if not all(parts):
        raise UserError(f"{where}: a value is missing in {text!r:.60}; {HOW}")
    values = tuple(value(where, part) for part in parts)
    if len({type(one) for one in values}) > 1:
        raise UserError(f"{where}: values should be all numbers, all true or false, or all words, not {text!r:.60}")
    twice = [part for part, one in zip(parts, values, strict=True) if values.count(one) > 1] if len(values) <= 1000 else []
    if twice or len(set(values)) < len(values):
        raise UserError(f"{where}: {(twice or ['a value'])[0]} is given twice")
    return values


def value(where: str, text: str) -> Value:
    """One value of a list. Raises UserError."""
    if text in WORDS:
        return WORDS[text]
    try:
        float(text)
    except ValueError:
        return text
    return number(where, text)


def number(where: str, text: str) -> float:
    """A number that flights can be computed with. Raises UserError."""
    try:
        found = float(text)
    except ValueError:
        raise UserError(f"{where}: {text!r:.60} is not a number; {HOW}") from None
    if not math.isfinite(found) or abs(found) > MOST:
        raise UserError(f"{where}: should be a number from {-MOST:g} to {MOST:g}, not {text.strip()!r:.60}")
    return found


def check_axes(axes: Sequence[MapAxis], varied: Sequence[str], source: str) -> None:
    """Refuse a key that is given twice or is inside another. varied: the keys that the file `source` varies already."""
    known: dict[str, str] = dict.fromkeys(varied, f"what varies in {source}")
    for axis in axes:
        for key, where in known.items():
            if key == axis.key:
                raise UserError(f"{axis.option} {axis.key}: is {where} too; a key can be given only once")
            outer, inner = sorted((key, axis.key), key=len)
            if inner.startswith(f"{outer}."):
                raise UserError(f"{axis.option} {axis.key}: {inner} is inside {outer} ({where}), which varies as a whole")
        known[axis.key] = axis.option


MOST_FLIGHTS = 50_000_000
NOISY_FLIGHTS = 20
"""Default flights per cell, where flights of a cell differ."""


class Request(NamedTuple):
    """A map to be flown.

    campaign: its flights; x, y, by: the axes (by: one panel per value, or None). flights: of a cell. random: whether they
    differ. Flight number f is of cell f % cells, and x changes fastest, then y, then by.
    """

    campaign: Campaign
    x: MapAxis
    y: MapAxis
    by: MapAxis | None
    flights: int
    random: bool

    @property
    def shape(self) -> tuple[int, int, int]:
        """Panels, rows (y), columns (x)."""
        return len(self.by.values) if self.by else 1, len(self.y.values), len(self.x.values)

    @property
    def cells(self) -> int:
        return math.prod(self.shape)

    @property
    def axes(self) -> tuple[MapAxis, ...]:
        return (*([self.by] if self.by else []), self.y, self.x)


def request(
    path: Path, x: str, y: str, by: str | None = None, failures: Sequence[str] = (), flights: int | None = None
) -> Request:
    """The map over the file in `path`. Raises UserError naming the option or the key."""
    axes = [parse_axis("--y", y, MOST_OPTIONS), parse_axis("--x", x, MOST_OPTIONS)]
    if by is not None:
        axes.insert(0, parse_axis("--by", by, MOST_PANELS))
    cells = math.prod(len(axis.values) for axis in axes)
    if cells > MOST_CELLS:
        raise UserError(f"--x, --y{', --by' * (by is not None)}: {cells} cells; allowed: at most {MOST_CELLS}")
    base = read_base(path)
    check_axes(axes, base.file.keys, str(path))
    axes = fitted(base, axes)
    vary = {**base.file.vary, **{axis.key: Grid(type="grid", values=axis.values) for axis in axes}}
    failure = {**base.file.failure, **dict(threshold(text, base) for text in failures)}
    file = base.file.model_copy(update={"vary": vary, "failure": failure, "flights": None})
    random = is_random(base, axes)
    together = math.prod(len(one.options) for one in base.file.vary.values() if isinstance(one, Grid))
    count = together * (-(-NOISY_FLIGHTS // together) if random else 1) if flights is None else flights
    if count < 1 or cells * count > MOST_FLIGHTS:
        raise UserError(
            f"--flights: should be from 1 to {MOST_FLIGHTS // cells} for each of {cells} cells "
            f"(at most {MOST_FLIGHTS} flights), not {count}"
        )
    return Request(base._replace(file=file), axes[-1], axes[-2], axes[0] if by is not None else None, count, random)


def read_base(path: Path) -> Campaign:
    """A campaign file as it is; a mission as a campaign in which nothing varies. Raises UserError."""
    content = read_toml(path)
    if "mission" in content:
        return read_campaign(path)
    mission = check_mission(content, str(path), path.parent)
    file = CampaignFile(name=mission.name, mission=content, seed=getattr(mission, "seed", 1))
    return campaign_of(file, files.read_text(path, files.TOML), content, str(path), path.parent)


def fitted(base: Campaign, axes: list[MapAxis]) -> list[MapAxis]:
    """The axes with whole numbers where a key takes no others. Raises UserError for a key that takes neither."""
    choices = [[axis, axis._replace(values=tuple(map(int, axis.values)))] if axis.whole else [axis] for axis in axes]
    refused = None
    for tried in itertools.product(*choices):
        values = {axis.key: axis.values[0] for axis in tried}
        try:
            planner_of(base).mission(values)
        except UserError as error:
            said = ", ".join(f"{key} = {json.dumps(value)}" for key, value in values.items())
            text = str(error).removeprefix(f"{base.source}: ")
            tried_with = "" if text.startswith("cannot vary ") else f"with {said:.120}: "
            refused = refused or UserError(f"{base.source}: {tried_with}{text}")
        else:
            return [axis._replace(unit=unit(base.mission, axis.key)) for axis in tried]
    assert refused
    raise refused


def planner_of(base: Campaign) -> Planner:
    """The builder of single flights of the mission."""
    return Planner(base.content, base.defaults, base.source, base.folder, {}, base.file.seed, None, base.singly)


def is_random(base: Campaign, axes: Sequence[MapAxis]) -> bool:
    """Whether two flights of a cell can differ: by what the file draws, or by noise in any corner of the map."""
    if base.file.correlated or not all(isinstance(one, Grid) for one in base.file.vary.values()):
        return True
    planner = planner_of(base)
    fixed = {key: one.options[0] for key, one in base.file.vary.items() if isinstance(one, Grid)}
    ends = [axis.values if axis.option == "--by" or not axis.ranged else axis.values[:: len(axis.values) - 1] for axis in axes]
    corners = itertools.islice(itertools.product(*(values[:MOST_PANELS] for values in ends)), 200)
    return any(is_noisy(planner, {**fixed, **dict(zip((axis.key for axis in axes), at, strict=True))}) for at in corners)


def is_noisy(planner: Planner, values: dict[str, object]) -> bool:
    """Whether a flight with these values uses random numbers; one that cannot be flown is found out later."""
    try:
        return planner.mission(values).noisy
    except UserError:
        return False


def threshold(text: str, base: Campaign) -> tuple[str, float]:
    """A criterion of failure, METRIC=LIMIT. Raises UserError."""
    name, equals, most = (part.strip() for part in text.partition("="))
    if not equals:
        raise UserError(f"--failure: {text!r:.60} cannot be parsed; give METRIC=LIMIT, such as position_rmse=0.5")
    if name not in base.thresholds:
        raise UserError(f"--failure: {unknown_name('metric', name, base.thresholds)}")
    limit = number(f"--failure {name}", most)
    if limit <= 0.0:
        raise UserError(f"--failure {name}: should be above 0, not {limit:g}")
    return name, limit
