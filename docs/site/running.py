"""Running the listings of one page, from the top down, in a folder of its own: `python -m docs.site.running PAGE FOLDER`."""

import contextlib
import io
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import time
import traceback
from pathlib import Path
from typing import Any, NamedTuple

from matplotlib import rc_context

from docs.site.checking import check_toml
from docs.site.listings import Kind, Listing, listings
from docs.site.pages import DOCS, ROOT, name_of
from quadstep.report.canvas import drawing
from quadstep.report.sheet import Sheet

LONGEST = 900
"""Of a listing [s]."""


class Ran(NamedTuple):
    """The result of a listing. line: of the page, from 1. status: ran, checked, not run, or failed."""

    line: int
    status: str
    output: str
    seconds: float


def prepare(folder: Path, page: Path, found: list[Listing]) -> None:
    """A folder as a reader has it: the examples, some files of their own, and those that the page shows."""
    shutil.copytree(ROOT / "examples", folder / "examples", ignore=shutil.ignore_patterns("__pycache__", "crazypad"))
    for name, start in (("quadstep", "-m quadstep "), ("python", "")):
        program = folder / ".bin" / name
        program.parent.mkdir(exist_ok=True)
        program.write_text(f'#!/bin/sh\nexec {shlex.quote(sys.executable)} {start}"$@"\n', encoding="utf-8")
        program.chmod(0o755)
    for path in (ROOT / "examples").glob("*.py"):  # beside missions that name them
        shutil.copyfile(path, folder / path.name)
    shutil.copytree(DOCS / "site" / "folder", folder, dirs_exist_ok=True, ignore=shutil.ignore_patterns("__pycache__"))
    for path in page.parent.iterdir() if page.parent != ROOT else ():
        if path.suffix in (".toml", ".py", ".csv") and page.parent != DOCS:
            shutil.copyfile(path, folder / path.name)
    for listing in found:
        if "given" in listing.marks:
            source, _, name = listing.marks["given"].partition(" as ")
            shutil.copyfile(folder / source, folder / name)
        if "file" in listing.marks:
            (folder / listing.marks["file"]).parent.mkdir(parents=True, exist_ok=True)
            (folder / listing.marks["file"]).write_text(listing.text, encoding="utf-8")


def shell(command: str, wanted: int, folder: Path) -> str:
    """What a shell listing prints. Raises RuntimeError where it ends otherwise than said."""
    command = command.replace(".venv/bin/quadstep", "quadstep").replace(".venv/bin/python", "python")
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "src"), "COLUMNS": "100", "MPLBACKEND": "agg"}
    environment["PATH"] = f"{folder / '.bin'}{os.pathsep}{os.environ['PATH']}"
    done = subprocess.run(
        ["bash", "-e", "-o", "pipefail", "-c", command],
        cwd=folder,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        stdin=subprocess.DEVNULL,
        text=True,
        timeout=LONGEST,
        check=False,
    )
    if done.returncode != wanted:
        raise RuntimeError(f"exit code {done.returncode}, not {wanted}:\n{done.stdout[-3000:]}")
    return re.sub(rf"{re.escape(str(folder))}/?", "", done.stdout)


def python(text: str, source: str, names: dict[str, Any]) -> str:
    """What a Python listing prints; `names` are those of the page so far. Its figures get the style of the reports."""
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed), drawing(Sheet()), rc_context({"text.parse_math": True}):
        exec(compile(text, source, "exec"), names)
    return printed.getvalue()


def run_one(listing: Listing, source: str, folder: Path, names: dict[str, Any]) -> tuple[str, str]:
    """Status and output of a listing."""
    marks = listing.marks
    if "not run" in marks:
        return "not run", marks["not run"]
    if listing.kind is Kind.SHELL:
        return "ran", shell(marks.get("instead", listing.text), int(marks.get("exit", "0")), folder)
    if listing.kind is Kind.PYTHON:
        if marks.get("file", "").endswith(".py"):
            compile(listing.text, source, "exec")
            return "checked", ""
        return "ran", python(listing.text, source, names)
    if listing.kind is Kind.TOML:
        check_toml(listing.text, source, folder)
        return "checked", ""
    return "not run", "text"


def run_page(page: Path, folder: Path) -> list[Ran]:
    """Runs all listings of a page in a new folder; one that fails does not stop those after it."""
    found, ran, names = listings(page.read_text(encoding="utf-8")), [], {"__name__": "__main__"}
    folder.mkdir(parents=True)
    prepare(folder, page, found)
    os.chdir(folder)
    for listing in found:
        begun = time.monotonic()
        try:
            status, output = run_one(listing, f"{name_of(page)}:{listing.first + 1}", folder, names)
        except Exception:
            status, output = "failed", traceback.format_exc(limit=-2)
        ran.append(Ran(listing.first + 1, status, output, round(time.monotonic() - begun, 1)))
    return ran


def main() -> None:
    """Run one page; the results go to FOLDER.json."""
    page, folder = Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve()
    ran = run_page(page, folder)
    folder.with_suffix(".json").write_text(json.dumps([one._asdict() for one in ran], indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
