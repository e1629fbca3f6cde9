"""Sphinx's settings. The source is what `docs.site.writing` makes; nothing is fetched from a network."""

import json
import re
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from docutils import nodes

import quadstep
from docs.site.sentences import sentences
from quadstep.report import markup
from quadstep.report.markup import FONTS
from quadstep.report.mathml import CLOSING, displayed, in_line
from quadstep.report.units import numerals, prose

if TYPE_CHECKING:
    from sphinx.application import Sphinx
    from sphinx.writers.html5 import HTML5Translator

project = "quadstep"
author = "The quadstep developers"
project_copyright = "The quadstep developers, MIT licence"
version = release = quadstep.__version__

extensions = ["myst_parser"]
myst_heading_anchors = 4
myst_enable_extensions = ["colon_fence", "dollarmath"]
html_math_renderer = "mathml"
highlight_language = "text"
smartquotes_action = "qe"  # quotes and dots; with "D" it would make a dash of the two hyphens of an option
suppress_warnings = ["misc.highlighting_failure"]  # a frame of a law with dots in it is no Python

here = Path(__file__).parent
html_theme = "furo"
html_title = "quadstep"
html_static_path = [str(here / "static"), str(FONTS), str(Path(markup.__file__).with_name("colours.css"))]
html_extra_path: list[str] = []
html_favicon = str(here / "static" / "icon.svg")
html_css_files = ["colours.css", "formulas.css", "theme.css"]
html_js_files = ["frames.js"]
html_search_scorer = str(here / "search.js")
html_show_search_summary = False  # search.js has a sentence for each result
html_copy_source = False
html_show_sourcelink = False
html_show_sphinx = False

BOTH = {"font-stack": 'Inter, system-ui, -apple-system, "Segoe UI", sans-serif'}
html_theme_options = {
    "light_css_variables": {
        **BOTH,
        "color-brand-primary": "#0072b2",
        "color-brand-content": "#0072b2",
        "color-link-underline": "#7fb6d8",
        "color-background-primary": "#fdfcfa",
        "color-background-secondary": "#f6f5f1",
        "color-foreground-primary": "#1c2126",
    },
    "dark_css_variables": {
        "color-brand-primary": "#4aa8e0",
        "color-brand-content": "#4aa8e0",
        "color-link-underline": "#3d7599",
        "color-background-primary": "#15191d",
        "color-background-secondary": "#0f1215",
        "color-foreground-primary": "#e8e6e1",
    },
}


TYPEWRITTEN = nodes.literal, nodes.FixedTextElement, nodes.math, nodes.raw
"""Of whose text no character is changed."""


def set_numbers(_app: "Sphinx", tree: nodes.document) -> None:
    """Minus, powers and units in text as they are set in figures and reports; code stays as it is."""
    for text in [one for one in tree.findall(nodes.Text) if not isinstance(one.parent, TYPEWRITTEN)]:
        changed = re.sub(r"(?<![\w)\]-])-(?=[xyz]\b)", "−", numerals(prose(text.astext())))
        if changed != text.astext():
            text.parent.replace(text, nodes.Text(changed))


def link_rows(app: "Sphinx", tree: nodes.document) -> None:
    """Rows of keys and of the glossary, by the words they begin with, and exercises of the lessons, each with a link to it."""
    place = app.env.docname
    for row in tree.findall(nodes.row):
        name = row[0].astext()
        inside = row.parent.parent.parent.parent
        if isinstance(row.parent, nodes.tbody) and (place == "glossary" or "keys" in inside.get("classes", ())):
            titles = [
                f"{one}-" for one in inside.parent["ids"][::-1] if not one.startswith("id")
            ]  # id1: of a title met before
            link(row, f"{titles[0] if place != 'glossary' and titles else ''}{nodes.make_id(name)}", row[0][0])
    if place.startswith("lessons/"):
        for listed in tree.findall(nodes.enumerated_list):
            if isinstance(listed.parent, nodes.section) and "exercises" in listed.parent["ids"]:
                for number, item in enumerate(listed, 1):
                    link(item, f"exercise-{number}", item[0])


EVERYDAY = {"word", "seed", "success", "failure", "budget", "claim", "token", "story", "extra", "weights", "stack", "flash"}
"""Words of the glossary that a reader knows, or that mean something else in most sentences."""


def link_terms(app: "Sphinx", tree: nodes.document) -> None:
    """The first use of every word of the field in a lesson, with a link to what the glossary says that it means."""
    if not re.match(r"lessons/\d", app.env.docname):
        return
    tables = (here.parent / "glossary.md").read_text(encoding="utf-8").partition("\n## On the command line\n")[2]
    cells = re.findall(r"^\| ([\w, -]+?) \|", tables, re.MULTILINE)
    terms = {
        term: nodes.make_id(cell) for cell in cells for term in cell.split(", ") if len(term) > 3 and term not in EVERYDAY
    }
    any_term = re.compile(rf"(?<![\w-])(?:{'|'.join(sorted(terms, key=len, reverse=True))})(?![\w-])")
    for text in [one for one in tree.findall(nodes.Text) if isinstance(one.parent, nodes.paragraph)]:
        said, parts, done = text.astext(), [], 0
        for found in any_term.finditer(said):
            if place := terms.pop(found[0], None):
                linked = nodes.reference("", found[0], refuri=f"../glossary.html#{place}", classes=["term"], internal=True)
                parts += [nodes.Text(said[done : found.start()]), linked]
                done = found.end()
        if parts:
            text.parent.replace(text, [*parts, nodes.Text(said[done:])])


def link(there: nodes.Element, name: str, text: nodes.Element) -> None:
    """Give a place a name, and its text a mark that links to it."""
    there["ids"].append(name)
    text += nodes.reference("", "¶", internal=True, refid=name, classes=["headerlink"])


def put_inline(translator: "HTML5Translator", node: nodes.math) -> None:
    """A formula in a line of text."""
    translator.body.append(in_line(node.astext(), escape(node.get("after", ""))))
    raise nodes.SkipNode


def hold_punctuation(_app: "Sphinx", tree: nodes.document, _place: str) -> None:
    """Keep what closes a clause with the formula before it."""
    for node in list(tree.findall(nodes.math)):
        following = node.next_node(descend=False, siblings=True)
        if isinstance(following, nodes.Text) and (closing := CLOSING.match(following.astext())) and closing[0]:
            node["after"] = closing[0]
            following.parent.replace(following, nodes.Text(following.astext()[closing.end() :]))


def put_displayed(translator: "HTML5Translator", node: nodes.math_block) -> None:
    """A formula of its own; several in a row are set one by one, so that a narrow page has them below one another."""
    parts = node.astext().split(r"\qquad")
    whole = len(parts) == 1 or any(part.count("{") != part.count("}") or r"\begin" in part for part in parts)
    shown = displayed(node.astext()) if whole else f'<div class="pair">{"".join(map(displayed, parts))}</div>'
    translator.body.append(shown)
    raise nodes.SkipNode


SENTENCES: dict[str, list[tuple[str, str]]] = {}
"""Of every page: what the search shows."""


def collect_sentences(_app: "Sphinx", tree: nodes.document, place: str) -> None:
    SENTENCES[place] = sentences(tree)


def write_sentences(app: "Sphinx", _error: Exception | None) -> None:
    text = f"const sentences = {json.dumps(SENTENCES, ensure_ascii=False)};\n"
    (app.outdir / "_static" / "sentences.js").write_text(text, encoding="utf-8")


def add_sentences(app: "Sphinx", page: str, *_: object) -> None:
    """To the page of the search alone."""
    if page == "search":
        app.add_js_file("sentences.js")


def setup(app: "Sphinx") -> None:
    """Formulas by quadstep's own MathML (docs/decisions/0019), as in reports and the article; no script, no font to load."""
    app.connect("doctree-read", set_numbers, priority=100)  # before titles are collected
    app.connect("doctree-read", link_rows)
    app.connect("doctree-read", link_terms)
    app.connect("doctree-resolved", collect_sentences)
    app.connect("doctree-resolved", hold_punctuation)
    app.connect("html-page-context", add_sentences)
    app.connect("build-finished", write_sentences)
    app.add_html_math_renderer("mathml", (put_inline, None), (put_displayed, None))
