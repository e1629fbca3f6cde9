"""The index of the equations: each of the paper's with its place in the code, its tests and its erratum."""

import ast
import re
from functools import cache
from pathlib import Path

from docs.site.pages import ROOT
from docs.site.reference.markdown import code, plain, table
from quadstep.proofs.verify.equation_row import EquationRow, EquationVerdict
from quadstep.proofs.verify.registry import all_rows
from quadstep.report.mathml import dollars

HEAD = """\
# The equations of the paper

Each equation as the paper prints it, where it stands in the code, which tests call that code or name the equation, and
whether it is corrected. Besides these, `tests/test_verify.py` asks for the evidence of every row, as `quadstep verify` prints
it (of one: `quadstep verify --only 24`).
"""


def numbers(text: str) -> set[int]:
    """The equations that a text names: Eq. 5, Eqs 9 and 10, Eqs 68-75."""
    found: set[int] = set()
    for said in re.findall(r"\bEqs?\.? (\d+(?:(?:, | and |, and |-)\d+)*)", text):
        for part in re.split(r", and |, | and ", said):
            first, _, last = part.partition("-")
            found.update(range(int(first), int(last or first) + 1))
    return found


def imported(tree: ast.Module) -> set[str]:
    """Modules and names that a test file imports."""
    found: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module:
            found |= {node.module, *(f"{node.module}.{one.name}" for one in node.names)}
        elif isinstance(node, ast.Import):
            found |= {one.name for one in node.names}
    return found


@cache
def tests() -> dict[str, tuple[set[str], set[int]]]:
    """Every test file: what it imports, and the equations that it names."""
    found = {}
    for path in sorted((ROOT / "tests").glob("test_*.py")):
        text = path.read_text(encoding="utf-8")
        found[path.name] = (imported(ast.parse(text)), numbers(text))
    return found


def tests_of(row: EquationRow) -> list[str]:
    """The test files of an equation: those that name it, else those that import the function that holds it."""
    module, _, function = row.where.partition(":")
    number = int(row.number) if row.number.isdigit() else None
    naming = [name for name, (_, said) in tests().items() if number in said]
    calling = [name for name, (modules, _) in tests().items() if f"{module}.{function.partition('.')[0]}" in modules]
    return (naming + [name for name in calling if name not in naming])[:4]


def file_of(row: EquationRow) -> str:
    """The file that holds an equation."""
    module = row.where.partition(":")[0].replace(".", "/")
    path = Path("src") / f"{module}.py"
    return (path if (ROOT / path).is_file() else Path("src") / module / "__init__.py").as_posix()


def printed(row: EquationRow) -> str:
    """The equation as the paper prints it, its formulas typeset."""
    parts = re.split(r"(\$[^$]+\$)", dollars(row.printed))
    return "".join(part.replace("|", r"\vert ") if part.startswith("$") else plain(part) for part in parts)


def line(row: EquationRow) -> tuple[str, ...]:
    """One row of the table."""
    by = tests_of(row) or ["test_verify.py"]
    named = f"<details><summary>{len(by)}</summary>{' '.join(map(code, by))}</details>"
    verdict = f"[{row.verdict}](../errata.md)" if row.verdict is EquationVerdict.CORRECTED else str(row.verdict)
    held_by = f"{code(row.where.partition(':')[2])} in {code(file_of(row))}"
    return plain(row.number), plain(row.what), printed(row), verdict, held_by, named


def page() -> str:
    """The whole page."""
    header = ("equation", "what", "as printed", "verdict", "code", "tests")
    return f"{HEAD}\n{table(header, map(line, all_rows()))}"
