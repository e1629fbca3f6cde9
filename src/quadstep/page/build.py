"""The page as one HTML file: the built front end, what it is told, and the laws it flies."""

import html
import json
import re
from collections.abc import Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from typing import NamedTuple

from quadstep.io.errors import UserError
from quadstep.io.version import __version__
from quadstep.page.flights import RECORDED_NUMBERS, ShownFlight, flight, outcomes, rules
from quadstep.page.laws import Laws
from quadstep.page.model import FORMAT, ClaimView, Link, Sharing
from quadstep.page.story import Story, story_view


class Walk(NamedTuple):
    """A story over a page's flights. missions: ids of the flights of its mission files."""

    story: Story
    missions: Mapping[Path, str]


TITLE = "<title>quadstep</title>"
DATA = '<script id="quadstep-data" type="application/json">{}</script>'
LAWS = '<script id="quadstep-laws">0</script>'


def template() -> str:
    """The built front end. Raises UserError where the package was installed without it."""
    try:
        text = files("quadstep.page").joinpath("assets", "page.html").read_text(encoding="utf-8")
    except OSError:
        raise UserError("the page's front end is not part of this installation; build it: `make frontend`") from None
    return text


def build_page(
    title: str,
    intro: str,
    flown: Sequence[ShownFlight],
    claims: Sequence[ClaimView] = (),
    links: Sequence[Link] = (),
    walk: Walk | None = None,
) -> str:
    """The HTML of a page with these flights. Raises UserError."""
    laws = Laws()
    return fill(template(), title, page_data(title, intro, flown, claims, links, laws, walk), laws.script())


def page_data(
    title: str,
    intro: str,
    flown: Sequence[ShownFlight],
    claims: Sequence[ClaimView],
    links: Sequence[Link],
    laws: Laws,
    walk: Walk | None = None,
) -> dict[str, object]:
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
        "presets": laws.encoded_presets(),
        "tables": laws.tables,
        "outcomes": outcomes(),
        "rules": rules(),
        "flights": [sharing.value(one) for one in shown],
        "story": sharing.value(story_view(walk.story, shown, walk.missions, laws)) if walk else None,
        "claims": sharing.value(list(claims)),
        "shared": sharing.values,
    }


def fill(text: str, title: str, data: dict[str, object], script: str) -> str:
    """The template with title, data and laws in their places."""
    if "</" in script or "<!--" in script:
        raise ValueError("the laws would end their own script element")
    content = json.dumps(data, allow_nan=False, ensure_ascii=True, separators=(",", ":"))
    content = content.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")
    places = {
        TITLE: f"<title>{html.escape(title)}</title>",
        DATA: DATA.replace("{}", content),
        LAWS: LAWS.replace(">0<", f">{script}<"),
    }
    for mark in places:
        if text.count(mark) != 1:
            raise ValueError(f"the page's template must hold {mark} once, and has it {text.count(mark)} times")
    return re.sub("|".join(map(re.escape, places)), lambda found: places[found.group()], text)
