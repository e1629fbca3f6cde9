"""The page as one HTML file: the built front end, what it is told, the laws it flies; and the page of missions, each flown by
Python once, and again when a slider is moved.
"""

import contextlib
import html
import json
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from typing import NamedTuple

from quadstep.engines.engine import Engine
from quadstep.engines.fly import FlightPlan, fly
from quadstep.interfaces.log import FlightLog
from quadstep.io import __version__
from quadstep.io.errors import UserError
from quadstep.metrics.registry import Metrics
from quadstep.metrics.verdict import LEFT_PATH
from quadstep.mission.read import plan_mission, read_mission
from quadstep.mission.schema import Grading, Mission, ungraded
from quadstep.page.flights import RECORDED_NUMBERS, ShownFlight, flight, outcomes, rules
from quadstep.page.laws import Laws
from quadstep.page.model import FORMAT, ClaimView, Link, Sharing, identity, numbers_text
from quadstep.page.story import Story, story_view


class Walk(NamedTuple):
    """A story over a page's flights. missions: ids of the flights of its mission files."""

    story: Story
    missions: Mapping[Path, str]


TITLE = "<title>quadstep</title>"
DATA = '<script id="quadstep-data" type="application/json">{}</script>'
LAWS = '<script id="quadstep-laws">0</script>'


def template(of: str = "page") -> str:
    """The built front end of the page, or of the article. Raises UserError where the package was installed without it."""
    try:
        return files("quadstep.page").joinpath("assets", f"{of}.html").read_text(encoding="utf-8")
    except OSError:
        raise UserError(f"the {of}'s front end is not part of this installation; build it: `make frontend`") from None


def build_page(
    title: str, intro: Sequence[str], flown: Sequence[ShownFlight], claims: Sequence[ClaimView] = (),
    links: Sequence[Link] = (), walk: Walk | None = None,
) -> str:  # fmt: skip
    """The HTML of a page with these flights. intro: parts of a paragraph, every other one in bold. Raises UserError."""
    laws = Laws()
    return fill(template(), title, page_data(title, intro, flown, claims, links, laws, walk), laws.script())


def page_data(
    title: str, intro: Sequence[str], flown: Sequence[ShownFlight], claims: Sequence[ClaimView], links: Sequence[Link],
    laws: Laws, walk: Walk | None = None,
) -> dict[str, object]:  # fmt: skip
    """What the page is told, as JSON can hold it; the loops of its flights are added to `laws`. Raises UserError."""
    sharing = Sharing()
    share = RECORDED_NUMBERS // max(1, len(flown))
    shown = [flight(one, laws, share) for one in flown]
    return {
        "format": FORMAT,
        "version": __version__,
        "title": title,
        "intro": intro,
        "links": sharing.value(list(links)),
        "laws": laws.facts(),
        "presets": {name: numbers_text(values) for name, values in laws.presets.items()},
        "tables": laws.tables,
        "outcomes": outcomes(),
        "rules": rules(),
        "left": LEFT_PATH,
        "flights": [sharing.value(one) for one in shown],
        "story": sharing.value(story_view(walk.story, shown, walk.missions, laws)) if walk else None,
        "claims": sharing.value(list(claims)),
        "shared": sharing.values,
    }


def fill(text: str, title: str, data: dict[str, object], script: str) -> str:
    """The template with title, data and laws in their places."""
    if "</" in script or "<!--" in script:
        raise ValueError("the laws would end their own script element")
    places = {
        TITLE: f"<title>{html.escape(title)}</title>",
        DATA: DATA.replace("{}", as_json(data)),
        LAWS: LAWS.replace(">0<", f">{script}<"),
    }
    for mark in places:
        if text.count(mark) != 1:
            raise ValueError(f"the page's template must hold {mark} once, and has it {text.count(mark)} times")
    return re.sub("|".join(map(re.escape, places)), lambda found: places[found.group()], text)


def as_json(data: dict[str, object]) -> str:
    """What a page is told, as it stands in its HTML."""
    content = json.dumps(data, allow_nan=False, ensure_ascii=True, separators=(",", ":"))
    return content.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def with_link(text: str, link: Link) -> str:
    """A page, or the article, with a link to a file beside it; one that leads there already is replaced."""
    start, end = (re.escape(part) for part in DATA.split("{}"))

    def renew(found: re.Match[str]) -> str:
        data = json.loads(found[0])
        data["links"] = [*(one for one in data.get("links", []) if one.get("href") != link.href), link._asdict()]
        return as_json(data)

    return re.sub(f"(?<={start}).*?(?={end})", renew, text, count=1)


GROUP, WALK = "Missions", "From the guided walk"


def fly_missions(
    paths: Sequence[Path], engine: Engine = Engine.LANES, story: Story | None = None, grading: Grading = ungraded
) -> str:
    """The page of these mission files, and of those of a story. Raises UserError naming the file."""
    flown = flown_files(paths, engine, grading=grading)
    if story is None:
        return missions_page(flown)
    flown, walk = with_walk(flown, story, engine, grading)
    return build_page(story.title, (), flown, walk=walk)


def flown_files(
    paths: Sequence[Path], engine: Engine, group: str = GROUP, taken: Sequence[str] = (), grading: Grading = ungraded
) -> list[ShownFlight]:
    """Mission files, flown. taken: ids in use. Raises UserError naming the file."""
    flown: list[ShownFlight] = []
    for path in paths:
        mission = read_mission(path)
        plan = plan_mission(mission, path)
        ids = [*taken, *(one.id for one in flown)]
        log = fly(plan, engine)
        measured = mission.flight_metrics(log, grading)
        flown.append(flown_mission(mission, plan, log, path.parent, ids, measured)._replace(group=group))
    names = Counter(one.name for one in flown)
    return [
        one._replace(name=f"{one.name} ({path.stem})") if names[one.name] > 1 else one
        for one, path in zip(flown, paths, strict=True)
    ]


def with_walk(
    flown: Sequence[ShownFlight], story: Story, engine: Engine, grading: Grading = ungraded
) -> tuple[list[ShownFlight], Walk]:
    """Flights of a page and those of a story's own missions behind them. Raises UserError naming the file."""
    own = flown_files(story.missions, engine, WALK, [one.id for one in flown], grading)
    return [*flown, *own], Walk(story, {path: one.id for path, one in zip(story.missions, own, strict=True)})


def write_mission_page(
    path: Path, mission: Mission, plan: FlightPlan, log: FlightLog, folder: Path, measured: tuple[Metrics, list[str]]
) -> None:
    """The page of one flight beside its results; none where the package was installed without the front end. measured: what
    the mission's `flight_metrics` gave for the log.
    """
    with contextlib.suppress(UserError):
        path.write_text(missions_page([flown_mission(mission, plan, log, folder, measured=measured)]), encoding="utf-8")


def missions_page(flown: Sequence[ShownFlight]) -> str:
    """The page of missions that were flown. Raises UserError."""
    title = flown[0].name if len(flown) == 1 else f"{len(flown)} missions"
    return build_page(title, (), flown)


def flown_mission(
    mission: Mission, plan: FlightPlan, log: FlightLog, folder: Path, names: Sequence[str] = (),
    measured: tuple[Metrics, list[str]] | None = None,
) -> ShownFlight:  # fmt: skip
    """A mission as the page takes it. folder: where its files are looked up; names: ids in use; measured: its metrics and
    warnings, where they are known.
    """
    metrics, found = measured or mission.flight_metrics(log)
    warnings = (*plan.warnings, *found)
    return ShownFlight(
        identity(mission.name, names), mission.name, GROUP, mission, plan, log, metrics, folder, warnings=warnings
    )
