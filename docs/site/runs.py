"""Running the listings of many pages, each in a process and a folder of its own; what has not changed is not run again."""

import hashlib
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from docs.site.pages import DOCS, ROOT, name_of
from docs.site.running import Ran


def source_digest() -> str:
    """Of everything that a listing's result depends on, beside its page."""
    found = hashlib.sha256()
    for folder, kinds in ((ROOT / "src", ("*.py", "*.toml", "*.html")), (ROOT / "examples", ("*",)), (DOCS / "site", ("*",))):
        for path in sorted(
            path for kind in kinds for path in folder.rglob(kind) if path.is_file() and "__pycache__" not in path.parts
        ):
            found.update(path.read_bytes())
    return found.hexdigest()


def folder_of(page: Path, runs: Path) -> Path:
    """Where a page runs."""
    return runs / name_of(page).removesuffix(".md").replace("/", "-")


def results(page: Path, runs: Path) -> list[Ran]:
    """The results of a page's listings when it last ran; nothing if it never did."""
    file = folder_of(page, runs).with_suffix(".json")
    return [Ran(**one) for one in json.loads(file.read_text(encoding="utf-8"))] if file.is_file() else []


def run_one(page: Path, runs: Path, source: str) -> list[Ran]:
    """Run one page, unless it ran just so before."""
    folder = folder_of(page, runs)
    key, file = hashlib.sha256((source + page.read_text(encoding="utf-8")).encode()).hexdigest(), folder.with_suffix(".key")
    if file.is_file() and file.read_text() == key and folder.with_suffix(".json").is_file():
        return results(page, runs)
    for old in (file, folder.with_suffix(".json")):
        old.unlink(missing_ok=True)
    shutil.rmtree(folder, ignore_errors=True)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join((str(ROOT / "src"), str(ROOT)))}
    subprocess.run([sys.executable, "-m", "docs.site.running", str(page), str(folder)], cwd=ROOT, env=environment, check=True)
    found = results(page, runs)
    if not any(one.status == "failed" for one in found):
        file.write_text(key)
    return found


def run_pages(pages: list[Path], runs: Path, jobs: int) -> Iterator[tuple[Path, list[Ran]]]:
    """Each page with the results of its listings, as they are done."""
    runs.mkdir(parents=True, exist_ok=True)
    source = source_digest()
    with ThreadPoolExecutor(jobs) as pool:
        yield from zip(pages, pool.map(lambda page: run_one(page, runs, source), pages), strict=True)
