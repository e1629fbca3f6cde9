"""Coq on the emitted statements: every one has a theorem of its name, nothing is admitted, nothing but the reals assumed."""

import re
import subprocess
from collections.abc import Iterable
from graphlib import TopologicalSorter
from pathlib import Path

from proofs.statement import Stated

SOURCES = Path(__file__).parent / "coq"
FUNCTIONS, STATEMENTS, CHECKS = "Functions", "Statements", "Checks"

AXIOMS = {
    "Classical_Prop.classic",
    "ClassicalDedekindReals.sig_forall_dec",
    "ClassicalDedekindReals.sig_not_dec",
    "FunctionalExtensionality.functional_extensionality_dep",
}
"""What Coq's own library of real numbers rests on (excluded middle: its sine)."""

CHEATS = re.compile(r"\b(Admitted|admit|Axiom|Parameter|Hypothesis|Conjecture|Variable|give_up|Abort|bypass_check)\b")


class UnprovedError(Exception):
    """Something is not proved: what, in one line."""


def files() -> list[str]:
    """All but the checks, in the order in which they need one another: the hand-written ones and the statements."""
    wanted: dict[str, list[str]] = {STATEMENTS: [FUNCTIONS]}
    for path in SOURCES.glob("*.v"):
        needs = re.findall(r"^Require Import (.*)\.$", path.read_text(encoding="utf-8"), re.MULTILINE)
        wanted[path.stem] = [name for line in needs for name in line.split()]
    return [name for name in TopologicalSorter(wanted).static_order() if name in wanted]


def prove(statements: Iterable[Stated], folder: Path) -> set[str]:
    """Write the statements into `folder`, compile the proofs there, and return what they assume. Raises UnprovedError."""
    statements = list(statements)
    for name in files():
        if name == STATEMENTS:
            head = f"From Coq Require Import Reals.\nRequire Import {FUNCTIONS}.\nOpen Scope R_scope.\n\n"
            settings = (setting.definition for statement in statements for setting in statement.settings[:-1])
            text = head + "\n".join([*dict.fromkeys(settings), *(statement.definition for statement in statements)])
        else:
            text = (SOURCES / f"{name}.v").read_text(encoding="utf-8")
            cheat = CHEATS.search(re.sub(r"\(\*.*?\*\)", "", text, flags=re.DOTALL))
            if cheat:
                raise UnprovedError(f"{name}.v holds {cheat[0]}")
        write(folder, name, text)
        compiled(folder, name)
    checks = [f"Check ({s.name}_holds : {s.name}).\nPrint Assumptions {s.name}_holds." for s in statements]
    write(folder, CHECKS, "\n".join([f"Require Import {' '.join(files())}.", *checks]) + "\n")
    assumed = set(re.findall(r"^([A-Za-z_][\w.']*)(?= ?:|$)", without_checks(compiled(folder, CHECKS)), re.MULTILINE))
    beyond = assumed - AXIOMS
    if beyond:
        raise UnprovedError(f"assumed beyond the real numbers: {', '.join(sorted(beyond))}")
    return assumed


def without_checks(printed: str) -> str:
    """What `Print Assumptions` said: the lines of `Check` and the headings left out."""
    kept, listing = [], False
    for line in printed.splitlines():
        if line.startswith("Axioms:"):
            listing = True
        elif re.match(r"\w+_holds$|\w+_holds ?:|Closed under", line) or (line.strip().startswith(":") and not listing):
            listing = False
        elif listing:
            kept.append(line)
    return "\n".join(kept)


def write(folder: Path, name: str, text: str) -> None:
    """A file for Coq."""
    (folder / f"{name}.v").write_text(text, encoding="utf-8")


def compiled(folder: Path, name: str) -> str:
    """What Coq prints of a file. Raises UnprovedError with its complaint."""
    done = subprocess.run(["coqc", "-q", f"{name}.v"], cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode:
        raise UnprovedError(f"{name}.v: {' '.join(done.stderr.split())[:500]}")
    return done.stdout
