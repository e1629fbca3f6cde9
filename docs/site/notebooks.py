"""The lessons as notebooks: their text, their mission, and their Python; commands are shown.

At the end a notebook has three cells for each exercise that grades itself: what it asks, one to fill, and one that grades it.
nbgrader knows the last two by their metadata (version 3 of its schema) and empties the first of them.
"""

import json
import re
from pathlib import Path
from typing import Any

from docs.site.listings import MARK, Kind, listings
from docs.site.pages import DOCS
from quadstep.studies.lessons import tasks

LESSONS = DOCS / "lessons"

CUT = re.compile(r"\A\s*</details>|^<details><summary>(.*)</summary>\s*\Z", re.MULTILINE)
"""The end of a fold that began in a cell before, and the beginning of one that holds nothing but code, in the cell after."""

ANSWERS, SOLVED = "## Answers", "<details><summary>4</summary>"
"""Where the answers begin, and those that a notebook leaves out: students shall find them."""

OWN = """## Your solutions

These exercises grade themselves: write a mission in the first cell of each, and run the second. Their answers are on the
lesson's page."""


def cell(kind: str, text: str, number: int, hidden: bool) -> dict[str, Any]:
    """A cell. hidden: whether its source is folded away at first."""
    code: dict[str, Any] = {"outputs": [], "execution_count": None} if kind == "code" else {}
    metadata = {"jupyter": {"source_hidden": True}} if hidden else {}
    return {"cell_type": kind, "id": f"cell-{number}", "metadata": metadata, "source": text.strip("\n"), **code}


def cells(page: Path) -> list[tuple[str, str]]:
    """The cells of a lesson in order: kind and text. Its mission is written beside the notebook first."""
    text = page.read_text(encoding="utf-8").partition(SOLVED)[0]
    lines, found, at = text.split("\n"), [], 0
    for listing in listings(text):
        if listing.kind is Kind.PYTHON:
            found += [("markdown", "\n".join(lines[at : listing.first])), ("code", listing.text)]
            at = listing.last
    found.append(("markdown", "\n".join(lines[at:])))
    mission = page.with_suffix(".toml")
    if mission.is_file():
        content = mission.read_text(encoding="utf-8")
        found.insert(1, ("code", f'from pathlib import Path\n\nPath("{mission.name}").write_text("""{content}""");'))
    shown = [(kind, folded(MARK.sub("", one)) if kind == "markdown" else one) for kind, one in found]
    return [(kind, one) for kind, one in shown if one.strip()]


def folded(text: str) -> str:
    """A cell's text with folds that begin and end in it, or a heading where nothing but code would be folded."""
    text = CUT.sub(lambda fold: f"**{fold[1]}**" if fold[1] else "", text)
    return f"{text.rstrip()}\n\n</details>" if text.count("<details>") > text.count("</details>") else text


def graded(name: str, asks: str) -> list[dict[str, Any]]:
    """The cell that says what an exercise asks, the one in which it is solved, and the one that grades it."""
    number, mine = name.replace(".", "-"), f"exercise_{name.replace('.', '_')}"
    sources = {
        "exercise": f"{mine} = mission",
        "check": f'from quadstep.studies.lessons import grade_cell\n\ngrade_cell("{name}", {mine})',
    }
    said = f"**Exercise {name}.** {asks} Assign your mission to `{mine}`: `{mine} = mission.with_(path__duration=9.0)`, say."
    made = [{**cell("markdown", said, 0, False), "id": f"asks-{number}"}]
    for kind, source in sources.items():
        check = kind == "check"
        known = {"schema_version": 3, "grade_id": f"{kind}-{number}", "grade": check, "solution": not check, "locked": check}
        one = cell("code", source, 0, False)
        one |= {
            "id": f"{kind}-{number}",
            "metadata": {"nbgrader": {**known, "task": False, **({"points": 1} if check else {})}},
        }
        made.append(one)
    return made


def notebook(page: Path) -> dict[str, Any]:
    """A lesson in Jupyter's format, version 4.5."""
    found = cells(page)
    answers = next((place for place, (_, text) in enumerate(found) if ANSWERS in text), len(found))
    made = [cell(kind, text, place + 1, place > answers) for place, (kind, text) in enumerate(found)]
    made.append(cell("markdown", OWN, len(made) + 1, False))
    made += [part for one in tasks(f"{int(page.name[:2])}") for part in graded(one.name, one.asks)]
    kernel = {"kernelspec": {"name": "python3", "display_name": "Python 3", "language": "python"}}
    return {"nbformat": 4, "nbformat_minor": 5, "metadata": kernel, "cells": made}


def lessons() -> list[Path]:
    """The lessons in order."""
    return sorted(LESSONS.glob("[0-9]*.md"))


def write_notebooks(folder: Path) -> None:
    """Write a notebook for each lesson."""
    folder.mkdir(parents=True, exist_ok=True)
    for page in lessons():
        text = json.dumps(notebook(page), indent=1, ensure_ascii=False)
        (folder / page.with_suffix(".ipynb").name).write_text(text + "\n", encoding="utf-8")
