"""A C compiler of this machine."""

import os
import shlex
import shutil
import subprocess
from pathlib import Path

from quadstep.io.errors import UserError

BITS = ("-ffp-contract=off", "-fno-math-errno")
"""Flags that preserve the bits, and one that allows a square root as one instruction."""

WARNINGS = ("-Wall", "-Wextra", "-Wconversion", "-Wdouble-promotion", "-Wfloat-equal", "-Wshadow")

LONGEST = 120.0
"""Seconds that a compiler may take."""


def compiler() -> list[str]:
    """The command of the compiler: `CC`, or cc, gcc or clang. Raises UserError if there is none."""
    said = shlex.split(os.environ.get("CC", ""))
    if said:
        if shutil.which(said[0]) is None:
            raise UserError(f"the C compiler {said[0]} named by CC is not on the path")
        return said
    for name in ("cc", "gcc", "clang"):
        if shutil.which(name):
            return [name]
    raise UserError("no C compiler found: cc, gcc and clang are not on the path; install one (Debian: gcc), or set CC")


def compile_c(folder: Path, arguments: list[str], command: list[str] | None = None) -> str:
    """Run the compiler in a folder and return its warnings. Raises UserError with its first line if it fails."""
    line = [*(command or compiler()), "-std=c99", *BITS, *arguments]
    try:
        run = subprocess.run(line, cwd=folder, capture_output=True, text=True, check=False, timeout=LONGEST)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise UserError(f"the C compiler {line[0]} did not finish: {error}") from None
    said = next((text for text in run.stderr.splitlines() if "error" in text), run.stderr)
    if run.returncode:
        why = f"rejected the law: {said}" if said.strip() else f"ended with exit code {run.returncode} and no message"
        raise UserError(f"the C compiler {line[0]} {why}")
    if "-o" in arguments and not (folder / arguments[arguments.index("-o") + 1]).exists():
        raise UserError(f"the C compiler {line[0]} wrote nothing: is it a C compiler?")
    return run.stderr
