"""`quadstep page`, and `quadstep explain`: the paper as a page."""

import webbrowser
from pathlib import Path
from typing import Annotated

import typer

from quadstep.commands.options import EngineOption, OpenOption
from quadstep.engines.engine import Engine
from quadstep.io.documents import read_toml
from quadstep.io.errors import UserError
from quadstep.io.files import PAGE, check_place, read_bytes, write_beside
from quadstep.mission.read import CAMPAIGN, look
from quadstep.report.screen import complain, say_whole

OWN_MARK = 'id="quadstep-data"'
"""Identifies a page that this command has written."""


def page(
    missions: Annotated[
        list[Path] | None,
        typer.Argument(
            help="Mission files, or one campaign file; default: the paper's cases and stress flights.", show_default=False
        ),
    ] = None,
    out: Annotated[Path | None, typer.Option(help="HTML file; default: out/page.html, or out/<mission>.html for one.")] = None,
    show: OpenOption = False,
    story: Annotated[
        Path | None,
        typer.Option(metavar="FILE.md", help="A guided walk of your own, in Markdown (docs/story.md).", show_default=False),
    ] = None,
    engine: EngineOption = Engine.LANES,
) -> None:
    """Write one HTML file that flies missions: no network, no installation, every gain a slider.

    Replaces an existing page, but never any other file.
    """
    files = missions or []
    named = files[0].stem if len(files) == 1 else "page" if story is None else story.stem
    target = out or Path("out") / f"{named}.html"
    check_target(target)
    text = page_of(files, engine, story)
    write_beside(target, text, parents=True)
    say_whole(f"Page: {target} ({len(text.encode()) / 1e6:.2f} MB). Double-click it to open it.")
    if show:
        open_in_browser(target.resolve().as_uri())


def page_of(missions: list[Path], engine: Engine, story: Path | None) -> str:
    """The page's HTML: of these missions; with none, of a story's own, or of the paper's flights. Raises UserError."""
    from quadstep.page.story import read_story

    walk = read_story(story) if story else None
    if len(missions) == 1 and not walk and look(read_toml(missions[0])) == CAMPAIGN:
        from quadstep.linear.grade import quick_grade
        from quadstep.studies.campaign.page import campaign_page

        return campaign_page(missions[0], engine, quick_grade)
    if missions or (walk and not walk.of_others):
        from quadstep.linear.grade import quick_grade
        from quadstep.page.build import fly_missions

        return fly_missions(missions, engine, walk, quick_grade)
    from quadstep.studies.paper.page import fly_paper

    return fly_paper(engine, walk)


def check_target(path: Path) -> None:
    """Refuses a place that cannot be written, and an existing file that is not a page. Raises UserError."""
    check_place(path, parents=True)
    if path.exists() and OWN_MARK.encode() not in read_bytes(path, PAGE):
        raise UserError(f"{path}: exists and is not a page of quadstep; choose another --out")


def open_in_browser(address: str) -> None:
    """Open an address; where no browser can be found, say so."""
    if not webbrowser.open(address):
        complain(f"warning: no browser found; open {address}")


def explain(
    out: Annotated[Path, typer.Option(help="HTML file to write.")] = Path("out/article.html"),
    show: OpenOption = False,
) -> None:
    """Write the paper as an article: five figures that fly its laws as you drag.

    One HTML file: no network, no installation. Replaces an existing page of quadstep, but never any other file.
    """
    from quadstep.proofs.article.build import article

    check_target(out)
    text = article()
    write_beside(out, text, parents=True)
    say_whole(f"Article: {out} ({len(text.encode()) / 1e6:.2f} MB). Double-click it to open it.")
    if show:
        open_in_browser(out.resolve().as_uri())
