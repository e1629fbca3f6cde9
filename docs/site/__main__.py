"""Builds the documentation into out/docs/: `make docs`.

With pages, only their listings and the first page's run. What has not changed since it ran is not run again.
"""

import argparse
import os
import shutil
import subprocess
import sys
from pathlib import Path

from docs.site.notebooks import write_notebooks
from docs.site.pages import DOCS, ROOT, name_of, run_pages
from docs.site.runs import folder_of, results, source_digest
from docs.site.runs import run_pages as run_listings
from docs.site.writing import MISSING, MissingError, accessible, write_pages, write_reference

OUT = ROOT / "out" / "docs"


def draw(figures: Path) -> None:
    """Have every picture of docs/ drawn anew by the module of its name, once for each state of the package."""
    done = figures / "digest"
    digest = source_digest()
    if done.is_file() and done.read_text() == digest:
        return
    shutil.rmtree(figures, ignore_errors=True)
    figures.mkdir(parents=True)
    for module in sorted(DOCS.glob("*.py")):
        if module.with_suffix(".png").is_file():
            print(f"drawing {module.stem}.png", flush=True)
            subprocess.run([sys.executable, str(module), str(figures)], check=True, stdout=subprocess.DEVNULL, cwd=ROOT)
    done.write_text(digest)


def run(named: list[Path], jobs: int) -> bool:
    """Run the listings of pages; whether all are true."""
    good = True
    for page, ran in run_listings(named, OUT / "runs", jobs):
        counted = {status: sum(one.status == status for one in ran) for status in ("ran", "checked", "failed")}
        said = ", ".join(f"{count} {status}" for status, count in counted.items() if count)
        print(f"{name_of(page)}: {said or 'no listings'}, {sum(one.seconds for one in ran):.0f} s", flush=True)
        for one in ran:
            if one.status == "failed":
                good = False
                print(f"{name_of(page)}:{one.line}: failed\n{one.output}", flush=True)
    return good


def build(answers: bool) -> int:
    """Write the source, and build the site; what Sphinx warns of is an error. answers: with those of the graded exercises."""
    source = OUT / "source"
    shutil.rmtree(source, ignore_errors=True)
    source.mkdir(parents=True)
    ran = {page: (folder_of(page, OUT / "runs"), results(page, OUT / "runs")) for page in run_pages()}
    write_pages(source, {page: one for page, one in ran.items() if one[0].is_dir()}, OUT / "figures", answers)
    write_reference(source)
    if lacking := sum(page.read_text(encoding="utf-8").count(MISSING) for page in source.rglob("*.md")):
        print(f"figures missing, because the listings of their pages have not run (make docs): {lacking}", flush=True)
    command = ["-b", "html", "-E", "-W", "--keep-going", "-q", "-c", str(DOCS / "site"), str(source), str(OUT / "html")]
    code = subprocess.run([sys.executable, "-m", "sphinx", *command], check=False, cwd=ROOT).returncode
    for page in (OUT / "html").rglob("*.html"):
        page.write_text(accessible(page.read_text(encoding="utf-8")), encoding="utf-8")
    write_notebooks(OUT / "notebooks")
    if (source / "flown").is_dir():
        shutil.copytree(source / "flown", OUT / "html" / "flown", dirs_exist_ok=True)
    return code


def main() -> None:
    """Run, draw, build."""
    parser = argparse.ArgumentParser(prog="python -m docs.site", description=__doc__)
    parser.add_argument("pages", nargs="*", type=Path, help="whose listings to run; default: all")
    parser.add_argument("--jobs", type=int, default=min(2, os.cpu_count() or 1), help="pages run side by side")
    parser.add_argument("--no-run", action="store_true", help="build from what ran before, and the first page")
    parser.add_argument("--without-answers", action="store_true", help="leave out the lessons' answers from exercise 4 on")
    said = parser.parse_args()
    named = [] if said.no_run else [page.resolve() for page in said.pages] or run_pages()
    if not run(list(dict.fromkeys([DOCS / "index.md", *named])), said.jobs):  # the first page's figure flies always: 3 s
        sys.exit(1)
    if not said.no_run:
        draw(OUT / "figures")
    try:
        code = build(not said.without_answers)
    except MissingError as error:
        sys.exit(f"error: {error}")
    if code == 0:
        print(f"{(OUT / 'html' / 'index.html').relative_to(ROOT)} is the site's first page")
    sys.exit(code)


if __name__ == "__main__":
    main()
