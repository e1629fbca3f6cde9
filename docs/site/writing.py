"""The source of the site, made from the pages: listings with their output, links, what flights showed, and the reference."""

import os
import re
import shutil
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path

from docs.site.listings import MARK, listings
from docs.site.notebooks import SOLVED
from docs.site.pages import DOCS, ROOT, pages
from docs.site.reference import commands, equations, files, keys, python
from docs.site.running import Ran
from quadstep.report.markup import figure
from quadstep.report.mathml import typeset
from quadstep.report.units import rich

SHOWING = ("tutorials", "lessons")
"""Folders of pages that show what their commands print."""

FEWEST_SECTIONS, MANY_SECTIONS = 4, 12
"""Of a page that lists them; of one whose sections within sections are listed, too."""

MOST_LINES, LAST_LINES = 60, 10
"""Of a command's output; of a longer one the last are shown too, for there the verdict is."""


ARTICLE = "out/article.html"

MISSING = "% Not here yet: "
"""What begins the comment that stands for a figure or a page of a listing that has not run."""

MENTION = re.compile(
    r"```.*?\n```|\[[^\]\n]*\]\([^)\n]*\)|`(?P<code>[\w./-]+\.md)`|`[^`\n]*`|(?<![\w/])(?P<plain>docs/(?:[\w./-]+\.md|decisions/\d{4}\b(?!-)))",
    re.DOTALL,
)
"""What a page mentions of another, as code or plainly; listings, links and other code are passed over."""

REFERENCE: Mapping[str, Callable[[], str]] = {
    "commands": commands.page, "python": python.page, "equations": equations.page, "files": files.page,
    **{name: partial(keys.page, name) for name in keys.FILES},
}  # fmt: skip
"""The pages made from code, by name."""


class MissingError(Exception):
    """Something that a page shows and that its listings did not make."""


def output_of(ran: Ran) -> list[str]:
    """What a command printed, as it stands below it."""
    lines = [line.rstrip() for line in ran.output.strip("\n").splitlines()]
    if len(lines) > MOST_LINES:
        left_out = len(lines) - MOST_LINES + 1
        lines = [*lines[: MOST_LINES - LAST_LINES - 1], f"... {left_out} more lines", *lines[-LAST_LINES:]]
    return ["", "```{code-block} text", ":class: printed", *lines, "```"] if lines else []


def with_listings(text: str, ran: Sequence[Ran], showing: bool) -> str:
    """A page whose listings all say their language, and with what they printed."""
    lines, by_line = text.split("\n"), {one.line: one for one in ran}
    for listing in reversed(listings(text)):
        fenced = lines[listing.first].startswith("`")
        given = re.sub("^`+", "", lines[listing.first]) if fenced else ""
        language = given or listing.kind
        made = [f"```{language}", *listing.text.rstrip("\n").split("\n"), "```"]
        one = by_line.get(listing.first + 1)
        if showing and one is not None and one.status == "ran":
            made += output_of(one)
        lines[listing.first : listing.last] = made
    return "\n".join(lines)


def with_links(text: str, place: str, there: Mapping[str, str]) -> str:
    """A page in which every mention of another is a link, in docs/ by its title. there: its place in the site, by name."""

    def linked(found: re.Match[str]) -> str:
        name = found["code"] or found["plain"] or ""
        if there.get(name, place) == place:
            return found[0]
        where = os.path.relpath(there[name], Path(place).parent)
        return f"*[]({where})*" if name.startswith("docs/") else f"[{found[0]}]({where})"

    return MENTION.sub(linked, text)


def with_sections(text: str) -> str:
    """A page of many sections with a list of them after its introduction, shown where there is no room for the theme's; one of
    many sections within sections with a list of those, too, which is always shown.
    """
    prose = re.sub(r"^(`{3,}).*?^\1$", "", text, flags=re.MULTILINE | re.DOTALL)
    names = re.findall(r"^##(#?) (.+)$", prose, re.MULTILINE)
    inner = sum(bool(deep) for deep, _ in names)
    if len(names) - inner < FEWEST_SECTIONS:
        return text
    whole = inner >= MANY_SECTIONS
    before, after = re.split(r"^(?=## )", text, maxsplit=1, flags=re.MULTILINE)
    places = [re.sub(r"[^\w -]", "", name.lower()).replace(" ", "-") for _, name in names]
    listed = "\n".join(
        f"{'  ' * bool(deep)}- [{name}](#{where})"
        for (deep, name), where in zip(names, places, strict=True)
        if whole or not deep
    )
    return f"{before}:::{{container}} sections{' whole' * whole}\n{listed}\n:::\n\n{after}"


ACCESSIBLE = {
    'rel="shortcut icon"': 'rel="icon" type="image/svg+xml"',
    '<p class="caption" role="heading">': '<p class="caption" role="heading" aria-level="2">',
    '<aside class="sidebar-drawer">': '<aside class="sidebar-drawer" aria-label="Pages">',
    '<aside class="toc-drawer': '<aside aria-label="On this page" class="toc-drawer',
    '<div class="highlight"><pre>': '<div class="highlight"><pre tabindex="0">',
    '<th class="head"><p></p></th>': '<td class="head"></td>',
    "<p><img": '<p tabindex="0"><img',
    '<div class="table-wrapper': '<div tabindex="0" class="table-wrapper',
    '<div id="search-results">': '<h1>Search</h1>\n<div id="search-results">',
}
"""What the theme writes, and what readers by ear or keyboard need instead: levels and names, lists that scroll by keys."""


def accessible(page: str) -> str:
    """A page of the site, as HTML, with these."""
    for theirs, ours in ACCESSIBLE.items():
        page = page.replace(theirs, ours)
    return page


def embedded(name: str, caption: str) -> str:
    """A page that flies, inside a page of the site. name: may end in the figure that it shows alone, as `?figure=nested`."""
    said, whole = caption or "The page of this flight", name.partition("?")[0]
    return (
        f'```{{raw}} html\n<iframe class="flying" src="{name}" title="{said}" loading="lazy"></iframe>\n'
        f'<p class="caption"><a href="{whole}">{said}, in a window of its own</a></p>\n```'
    )


def with_flights(text: str, folder: Path | None, static: Path, place: str) -> str:
    """A page with the figures and flying pages that its listings made. static: where these go. Raises MissingError."""

    def put(found: re.Match[str]) -> str:
        kind, said = found[1], found[2]
        if kind not in ("figure", "page"):
            return ""
        shown_first, _, caption = (part.strip() for part in said.partition("|"))
        file, *anchor = shown_first.split("#")
        if folder is None:
            return f"{MISSING}`make docs` flies this page's listings, which make this {kind}."
        if not (folder / file).is_file():
            raise MissingError(f"{place}: shows {file}, which its listings do not make")
        own = "" if file == ARTICLE else f"{folder.name}-"  # the article is the same for all
        name = own + file.removeprefix("out/").replace("/", "-")
        static.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(folder / file, static / name)
        if kind == "page":
            shown = os.path.relpath("flown", Path(place).parent)
            sets = "#" if anchor and "=" in anchor[0] else "?figure="
            return embedded(sets.join((f"{shown}/{name}", *anchor)), caption)
        return f"```{{raw}} html\n{figure(static / name, caption, set_as=partial(typeset, around=rich))}\n```"

    return MARK.sub(put, text)


def write_pages(source: Path, results: Mapping[Path, tuple[Path, Sequence[Ran]]], figures: Path, answers: bool = True) -> None:
    """Write every page by hand. results: folder and results of the pages that ran. figures: newly drawn pictures of docs/.
    answers: whether lessons have those of their exercises from 4 on.
    """
    found = {path: place for path, place in pages().items() if path.is_file()}
    there = places()
    for path, place in found.items():
        folder, ran = results.get(path, (None, []))
        written = path.read_text(encoding="utf-8")
        text = with_listings(written if answers else written.partition(SOLVED)[0], ran, place.split("/")[0] in SHOWING)
        text = re.sub(r"^<details>(?=<summary>(\d+)</summary>)", r'<details id="answer-\1">', text, flags=re.MULTILINE)
        text = text if place == "index.md" else with_sections(text)
        text = with_flights(with_links(text, place, there), folder, source / "flown", place)
        (source / place).parent.mkdir(parents=True, exist_ok=True)
        (source / place).write_text(text, encoding="utf-8")
    for path in (*DOCS.rglob("*.toml"), *DOCS.rglob("*.png"), *DOCS.rglob("*.svg")):
        inside = path.relative_to(DOCS)
        if inside.parts[0] != "site":
            drawn = figures / inside
            (source / inside).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(drawn if drawn.is_file() else path, source / inside)


def places() -> dict[str, str]:
    """Where each page stands in the site, by its name; decisions by their number, too."""
    by_hand = {path.relative_to(ROOT).as_posix(): place for path, place in pages().items() if path.is_file()}
    decisions = {
        name[: len("docs/decisions/0000")]: place for name, place in by_hand.items() if name.startswith("docs/decisions/")
    }
    return decisions | by_hand | {f"docs/reference/{name}.md": f"reference/{name}.md" for name in REFERENCE}


def write_reference(source: Path) -> None:
    """Write them."""
    (source / "reference").mkdir(parents=True, exist_ok=True)
    for name, made in REFERENCE.items():
        place = f"reference/{name}.md"
        (source / place).write_text(with_links(made(), place, places()), encoding="utf-8")
