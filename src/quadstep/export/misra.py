"""Deviations from MISRA C:2012 that cppcheck's addon finds, and why they are there."""

import re
import shutil
import subprocess
import tempfile
from collections import Counter
from pathlib import Path

from quadstep.io.errors import UserError

REASONS = {
    "2.3": "types of the interface that a caller may need and this file does not",
    "2.4": "types of the interface that a caller may need and this file does not",
    "2.5": "status codes that a caller may need and this file does not",
    "2.7": "arguments that all laws have but not all laws use",
    "5.9": "local variables keep the names of the law; functions are static and used in one file only",
    "8.4": "the parameters are defined in a file of their own, whose header declares them",
    "8.6": "the parameters are defined in a file of their own",
    "8.7": "functions of the interface, which another file calls",
    "8.9": "the parameters are in a separate file, so that they can be replaced without the law",
    "10.4": "the checker does not know the real type of `real`",
    "10.8": "an exponent or random bits become a number, or a number limited to the entries of a table becomes an index",
    "11.5": "a struct of numbers is read as an array, to check that all are finite",
    "11.8": "a struct of numbers is read as an array, to check that all are finite",
    "12.1": "every operation is parenthesised; the checker wants more parentheses around conditions",
    "13.4": "none: the checker misreads an initialiser",
    "14.2": "loops have one counter and a constant number of turns",
    "15.5": "one exit per function",
    "17.7": "the return value of memcpy is not needed",
    "18.4": "arrays of a struct are indexed",
    "20.1": "the C library header comes after the file's own header",
    "21.15": "memcpy between a number and the integer with its bits, as defined by C",
    "21.2": "names that begin with `qs_` are static",
}
"""By rule. A rule that is not here is reported without a reason."""


LONGEST = 600
"""Seconds that the check may take."""

REMARK, STOP = re.compile(r"^ +/\* .* \*/$", re.M), 'asm("");'
"""A remark between statements, and what is written beside it for cppcheck, which stops following values there. Otherwise it
follows each to the end of its function: 4 min of the processor for `mpc` instead of 17 s. No rule here needs that.
"""


def missing() -> bool:
    return shutil.which("cppcheck") is None


def deviations(folder: Path, files: list[str]) -> dict[str, int]:
    """How often each rule is deviated from, by rule. Raises UserError if the check does not end."""
    with tempfile.TemporaryDirectory() as place:
        for file in (*folder.glob("*.c"), *folder.glob("*.h")):
            text = REMARK.sub(rf"\g<0> {STOP}", file.read_text(encoding="utf-8"))
            (Path(place) / file.name).write_text(text, encoding="utf-8")
        line = ["cppcheck", "--addon=misra", "--std=c99", "--quiet", "--enable=style", "--inline-suppr", *files]
        try:
            run = subprocess.run(line, cwd=place, capture_output=True, text=True, check=False, timeout=LONGEST)
        except subprocess.TimeoutExpired:
            raise UserError(f"cppcheck did not finish in {LONGEST} s") from None
    found = Counter(re.findall(r"\[misra-c2012-(\d+\.\d+)\]", run.stderr))
    return dict(sorted(found.items(), key=lambda one: [int(part) for part in one[0].split(".")]))
