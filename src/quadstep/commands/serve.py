"""What opens in a browser or is sent on: `quadstep page`, `explain` and `serve`; `quadstep serve-setpoints`."""

import webbrowser
from pathlib import Path
from typing import Annotated

import typer

from quadstep.commands.options import EngineOption, OpenOption, check_range
from quadstep.engines.engine import Engine
from quadstep.io.documents import read_toml
from quadstep.io.errors import UserError, unknown_name
from quadstep.io.files import PAGE, check_place, read_bytes, read_text, write_beside
from quadstep.io.user_code import refuse
from quadstep.mission.read import CAMPAIGN, look
from quadstep.report.bars import bar
from quadstep.report.screen import complain, say, say_whole

OWN_MARK = 'id="quadstep-data"'
"""Identifies a page that this command has written."""


def page(
    missions: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="MISSION.toml", help="Mission files, or one campaign file; default: the paper's cases and stress flights."
        ),
    ] = None,
    out: Annotated[Path | None, typer.Option(help="HTML file; default: out/page.html, or out/<mission>.html for one.")] = None,
    show: OpenOption = False,
    story: Annotated[
        Path | None, typer.Option(metavar="FILE.md", help="A guided walk of your own, in Markdown (docs/story.md).")
    ] = None,
    engine: EngineOption = Engine.LANES,
) -> None:
    """Write one HTML file that flies missions in the browser, offline, with a slider for every gain.

    Replaces an existing page, but never any other file.
    """
    files = missions or []
    named = files[0].stem if len(files) == 1 else "page" if story is None else story.stem
    target = as_page(out or Path("out") / f"{named}.html")
    check_target(target)
    text = link_pair(target, page_of(files, engine, story))
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


def as_page(path: Path) -> Path:
    """With the ending by which a desktop knows a page, where a new file has none."""
    return path if path.suffix or path.exists() else path.with_suffix(".html")


def check_target(path: Path) -> None:
    """Refuses a place that cannot be written, and an existing file that is not a page. Raises UserError."""
    check_place(path, parents=True)
    if path.exists() and OWN_MARK.encode() not in read_bytes(path, PAGE):
        raise UserError(f"{path}: exists and is not a page of quadstep; choose another --out")


PAIR = {"page.html": "The flights, live", "article.html": "The article"}
"""The page and the article, and what each is called where the other links to it."""


def link_pair(target: Path, text: str) -> str:
    """The page or the article, linked with the other one, both ways, where that is beside it under its usual name."""
    from quadstep.page.build import with_link
    from quadstep.page.model import Link

    for name in PAIR.keys() - {target.name} if target.name in PAIR else ():
        other = target.with_name(name)
        if other.is_file() and OWN_MARK in (old := read_text(other, PAGE)):
            text = with_link(text, Link(PAIR[name], name))
            write_beside(other, with_link(old, Link(PAIR[target.name], target.name)))
    return text


def open_in_browser(address: str) -> None:
    """Open an address; where no browser can be found, say so."""
    if not webbrowser.open(address):
        complain(f"warning: no browser found; open {address}")


def explain(
    out: Annotated[Path, typer.Option(help="HTML file to write.")] = Path("out/article.html"), show: OpenOption = False
) -> None:
    """Explain the paper in an article: five figures that fly its laws as you drag.

    One HTML file: no network, no installation. Replaces an existing page of quadstep, but never any other file.
    """
    from quadstep.proofs.article import article

    out = as_page(out)
    check_target(out)
    text = link_pair(out, article())
    write_beside(out, text, parents=True)
    say_whole(f"Article: {out} ({len(text.encode()) / 1e6:.2f} MB). Double-click it to open it.")
    if show:
        open_in_browser(out.resolve().as_uri())


PORT = 8765


def serve(
    folder: Annotated[Path, typer.Argument(help="Folder with results.")] = Path("out"),
    port: Annotated[int, typer.Option(metavar="PORT", help="0 to 65535; 0 picks a free port.")] = PORT,
    host: Annotated[
        str,
        typer.Option(
            metavar="ADDRESS", help="Address on which others can connect (they need the token in the link); 0.0.0.0 means all."
        ),
    ] = "127.0.0.1",
    show: OpenOption = False,
    of: Annotated[
        Path | None,
        typer.Option(
            "--class", metavar="FILE", help="Fly the controllers that students submit, and rank them (docs/class.md)."
        ),
    ] = None,
) -> None:
    """Show results under a folder in the browser: sort, filter, compare two.

    Only this machine can see them, unless --host says otherwise. With --class the folder is not shown: it is where the flights
    of the class are stored.

    Exit code 0: ended by Ctrl-C. 2: bad input.
    """
    from quadstep.page.serve import serve as run
    from quadstep.page.sharing import access, qr_text

    check_range("--port", port, 0, 65535)
    refuse("`quadstep serve` never runs user code")
    allowed = access(host)

    def open_class(links: dict[str, str], teacher: str) -> None:
        for name, link in links.items():
            say_whole(f"{name}: {link}")
        say_whole(f"Your own page, for nobody else: {teacher}")
        whom = (
            "Give each of them one link" if allowed.shared else "Only this machine can open them; for others: --host 0.0.0.0"
        )
        say(f"{whom}. Ctrl-C ends.")
        if show:
            open_in_browser(teacher)

    def ready(link: str) -> None:
        say_whole(f"Results in {folder}: {link} (Ctrl-C ends)")
        if allowed.shared:
            complain("warning: anyone who has this link and can reach this machine can read the folder, unencrypted")
            try:
                say_whole(qr_text(link))
            except UserError as error:
                say(f"{error}.")
        if show:
            open_in_browser(link)

    try:
        if of is None:
            from quadstep.studies.advise import advise_dropped

            run(folder, port, allowed, ready, advise_dropped)
        else:
            from quadstep.studies.class_server import serve_class

            serve_class(of, folder, port, allowed, open_class)
    except KeyboardInterrupt:
        say("Stopped.")


ENDED = (
    "No more setpoints follow. Unless its mode was changed, PX4 now does what COM_OBL_RC_ACT says: at 0, its default, it "
    "descends without a remote control, level, and the wind carries it; at 5 it holds. ArduPilot stops where it is; after "
    "attitudes or rates it levels, and the wind carries it (GUID_TIMEOUT)."
)


def serve_setpoints(
    mission: Annotated[
        Path, typer.Argument(metavar="MISSION.toml", help="Mission file (TOML) for a real vehicle; its path is sent.")
    ],
    connect: Annotated[
        str, typer.Option(metavar="ADDRESS", help="Vehicle address, in pymavlink's form, such as udpin:127.0.0.1:14540.")
    ] = "udpin:127.0.0.1:14540",
    kind: Annotated[str, typer.Option(help="Content of each setpoint: position, attitude or rates.")] = "position",
    rate: Annotated[float, typer.Option(metavar="HZ", help="Setpoints per second, 2 to 200.")] = 50.0,
    hold: Annotated[
        float, typer.Option(metavar="SECONDS", help="How long to keep sending the end point after the path is finished.")
    ] = 10.0,
) -> None:
    """Send a mission's path to a vehicle as MAVLink setpoints, in real time; never arms it or changes its mode.

    Exit code 0: sent. 2: bad input, or no vehicle responded. 130: interrupted.
    """
    from quadstep.bridges.setpoints import FASTEST, MOST_HOLD, SLOWEST, SetpointKind, serve
    from quadstep.mission.read import plan_mission, read_mission

    if kind not in list(SetpointKind):
        raise UserError(f"--kind: {unknown_name('value', kind, SetpointKind)}")
    check_range("--rate", rate, SLOWEST, FASTEST)
    check_range("--hold", hold, 0.0, MOST_HOLD)
    plan = plan_mission(read_mission(mission), mission)
    duration = plan.ticks.last * plan.ticks.step
    with bar("waiting for the vehicle", "s", duration) as shown:

        def show_time(at: float) -> None:
            shown.doing("sending setpoints" if at <= duration else "holding the last point: take over, or change the mode")
            shown.to(round(min(at, duration)), round(duration))

        def say_limits() -> None:
            complain("This sends setpoints and nothing else: arming and switching to offboard or guided mode are up to you.")

        count = serve(plan, connect, SetpointKind(kind), rate, hold, show_time, say_limits)
    say(f"Sent {count} setpoints over {duration:g} s, and the path's last point for {hold:g} s. {ENDED}")
