"""The request: a mission or a campaign file and the axes of the map, turned into a campaign of all cells."""

import itertools
import math
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from quadstep.io import files
from quadstep.io.documents import read_toml
from quadstep.io.errors import UserError
from quadstep.mission.distributions import MOST_OPTIONS, Grid
from quadstep.mission.read import check_mission
from quadstep.studies.campaign.planner import Planner
from quadstep.studies.campaign.schema import Campaign, CampaignFile, campaign_of, read_campaign
from quadstep.studies.envelope.axes import MOST_CELLS, MOST_PANELS, Axis, as_typed, check_axes, number, parse_axis

MOST_FLIGHTS = 50_000_000
NOISY_FLIGHTS = 20
"""Default flights per cell, where flights of a cell differ."""


class Request(NamedTuple):
    """A map to be flown.

    campaign: its flights; x, y, by: the axes (by: one panel per value, or None). flights: of a cell. random: whether they
    differ. Flight number f is of cell f % cells, and x changes fastest, then y, then by.
    """

    campaign: Campaign
    x: Axis
    y: Axis
    by: Axis | None
    flights: int
    random: bool

    @property
    def shape(self) -> tuple[int, int, int]:
        """Panels, rows (y), columns (x)."""
        return len(self.by.values) if self.by else 1, len(self.y.values), len(self.x.values)

    @property
    def cells(self) -> int:
        """Number of cells."""
        return math.prod(self.shape)

    @property
    def axes(self) -> tuple[Axis, ...]:
        """All, the slowest first."""
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
        raise UserError(f"--x, --y{', --by' * (by is not None)}: {cells} cells; allowed are at most {MOST_CELLS}")
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


def fitted(base: Campaign, axes: list[Axis]) -> list[Axis]:
    """The axes with whole numbers where a key takes no others. Raises UserError for a key that takes neither."""
    choices = [[axis, axis._replace(values=tuple(map(int, axis.values)))] if axis.whole else [axis] for axis in axes]
    refused = None
    for tried in itertools.product(*choices):
        values = {axis.key: axis.values[0] for axis in tried}
        try:
            planner_of(base).mission(values)
        except UserError as error:
            said = ", ".join(f"{key} = {as_typed(value)}" for key, value in values.items())
            text = str(error).removeprefix(f"{base.source}: ")
            refused = refused or UserError(f"{base.source}: with {said:.120}: {text}")
        else:
            return list(tried)
    assert refused
    raise refused


def planner_of(base: Campaign) -> Planner:
    """The builder of single flights of the mission."""
    return Planner(base.content, base.defaults, base.source, base.folder, {}, base.file.seed, None, base.singly)


def is_random(base: Campaign, axes: Sequence[Axis]) -> bool:
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
    """A criterion of failure, METRIC=MOST. Raises UserError."""
    name, equals, most = (part.strip() for part in text.partition("="))
    if not equals:
        raise UserError(f"--failure: {text!r:.60} cannot be parsed; give METRIC=MOST, such as position_rmse=0.5")
    if name not in base.thresholds:
        raise UserError(f"--failure: {name!r:.60} is not known; allowed: {', '.join(base.thresholds)}")
    limit = number(f"--failure {name}", most)
    if limit <= 0.0:
        raise UserError(f"--failure {name}: should be above 0, not {limit:g}")
    return name, limit
