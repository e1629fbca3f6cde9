"""The map of the code: every file of the package with the first line of its docstring."""

import ast
import re
from itertools import groupby
from pathlib import Path

from docs.site.pages import ROOT
from docs.site.reference.markdown import code, prose, table

SOURCE = ROOT / "src" / "quadstep"

HEAD = """\
# The files of the package

What each file says of itself. `docs/architecture.md` has the order in which the folders build on one another.
"""


def sentence(path: Path) -> str:
    """The first sentence of a file's docstring; its lines may be broken anywhere."""
    text = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
    first = " ".join(text.partition("\n\n")[0].split())
    return prose(re.split(r"(?<=[.:])\s", first)[0].rstrip(":"))


def page() -> str:
    """The page, a table for each folder."""
    paths = sorted(SOURCE.rglob("*.py"), key=lambda path: (path.parent, path.name != "__init__.py", path.name))
    parts = [HEAD]
    for folder, files in groupby(paths, key=lambda path: path.parent):
        rows = ((code(path.name), sentence(path)) for path in files)
        parts += [f"## {folder.relative_to(SOURCE.parent).as_posix()}\n", table(("file", "what it is"), rows)]
    return "\n".join(parts)
