"""Deviations from MISRA C:2012 that cppcheck's addon finds, and why they are there."""

import re
import shutil
import subprocess
from collections import Counter
from pathlib import Path

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
    "10.8": "an integer limited to the entries of a table, or an exponent, becomes a number or an index",
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


def missing() -> bool:
    """Whether cppcheck is absent."""
    return shutil.which("cppcheck") is None


def deviations(folder: Path, files: list[str]) -> dict[str, int]:
    """How often each rule is deviated from, by rule."""
    line = ["cppcheck", "--addon=misra", "--std=c99", "--quiet", "--enable=style", "--inline-suppr", *files]
    run = subprocess.run(line, cwd=folder, capture_output=True, text=True, check=False, timeout=300)
    found = Counter(re.findall(r"\[misra-c2012-(\d+\.\d+)\]", run.stderr))
    return dict(sorted(found.items(), key=lambda one: [int(part) for part in one[0].split(".")]))
