"""The pages: which there are, and where each stands in the site."""

from pathlib import Path

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"

BESIDE = {"CHANGELOG.md": "changes.md", "CONTRIBUTING.md": "contributing.md", "SECURITY.md": "security.md"}
"""Pages of the site that lie at the top of the repository."""


def pages() -> dict[Path, str]:
    """Every page that is written by hand, with its place in the site."""
    found = {
        path: path.relative_to(DOCS).as_posix() for path in sorted(DOCS.rglob("*.md")) if DOCS / "site" not in path.parents
    }
    return {**found, **{ROOT / name: place for name, place in BESIDE.items()}}


def run_pages() -> list[Path]:
    """The pages whose listings run: those of the site that are for users, and the README."""
    inner = ("decisions", *BESIDE)
    return [ROOT / "README.md", *(path for path in pages() if path.parent.name not in inner and path.name not in inner)]


def name_of(page: Path) -> str:
    """How a page is called in messages."""
    return page.relative_to(ROOT).as_posix()
