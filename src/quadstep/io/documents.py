"""TOML and JSON from outside, checked for size, depth and numbers before their content is used."""

import json
import math
import re
import tomllib
from pathlib import Path
from typing import Any, NoReturn

from quadstep.io import files
from quadstep.io.errors import UserError

DEEPEST = 32
"""Tables and lists in one another, and parts of a dotted key. (The parser's memory grows with the square of the latter.)"""

TEXTS = re.compile(
    r"""
    "{3} (?: [^"\\] | \\. | "(?!"") )*+ (?: "{3,5} | \Z )  # strings, to the end of the text where they have none;
    | '{3} (?: [^'] | '(?!'') )*+ (?: '{3,5} | \Z )
    | " (?: [^"\\\n] | \\. )*+ "?
    | ' [^'\n]*+ '?
    | \# [^\n]*+                                            # comments
    """,
    re.DOTALL | re.VERBOSE,
)
DOTTED = re.compile(rf"(?<![\w-])(?:[\w-]++[ \t]*+\.[ \t]*+){{{DEEPEST}}}", re.ASCII)
"""Both take time in proportion to the text, whatever it contains."""


OTHER_KINDS = ".bin", ".csv", ".html", ".json", ".log", ".md", ".py", ".xml"
"""Endings of files whose errors as TOML would be no help."""

KEYS = re.compile(r"\('[^)]*',?\)")
"""A key as errors of Python's parser have it, a tuple of its parts."""


def read_toml(path: Path) -> dict[str, object]:
    """The content of a TOML file. Raises UserError naming it."""
    text = files.read_text(path, files.TOML)
    try:
        return parse_toml(text, str(path))
    except UserError:
        if path.suffix.lower() in OTHER_KINDS:
            raise UserError(f"{path}: a TOML file is needed, not one that ends in {path.suffix}") from None
        raise


def parse_toml(text: str, source: str) -> dict[str, object]:
    """The content of TOML. Raises UserError naming `source`."""
    bare = TEXTS.sub("t", text)
    if DOTTED.search(bare) or depth(bare) > DEEPEST:
        raise too_deep(source)
    try:
        content = tomllib.loads(text)
    except RecursionError:
        raise too_deep(source) from None
    except ValueError as error:  # TOMLDecodeError; a number of too many digits
        said = KEYS.sub(lambda found: ".".join(re.findall("'([^']*)'", found[0])), str(error))
        raise UserError(f"{source}: not valid TOML: {said}{error_line(text, said)}") from None
    check(content, source)
    return content


def error_line(text: str, error: str) -> str:
    """The line of which an error tells, where it is short enough to be read."""
    found = re.search(r"at line (\d+)", error)
    lines = text.splitlines()[int(found[1]) - 1 :] if found else []
    return f"; the line: {lines[0].strip()}" if lines and lines[0].isprintable() and 0 < len(lines[0].strip()) <= 60 else ""


def depth(text: str) -> int:
    """How deep brackets stand in one another in TOML without its strings, at most."""
    deepest = now = 0
    for sign in re.findall(r"[\[\]{}]", text):
        now += 1 if sign in "[{" else -1
        deepest = max(deepest, now)
    return deepest


def read_json(path: Path, links: bool = True) -> Any:
    """The content of a JSON file, every number of which is finite. Raises UserError naming it."""
    return parse_json(files.read_text(path, files.JSON, links), str(path))


def parse_json(text: str | bytes, source: str) -> Any:
    """The content of JSON, every number of which is finite. Raises UserError naming `source`."""
    try:
        content = json.loads(text, parse_constant=no_number)
    except RecursionError:
        raise too_deep(source) from None
    except ValueError as error:
        raise UserError(f"{source}: not valid JSON: {fault(error)}") from None
    check(content, source, finite=True)
    return content


def fault(error: ValueError) -> str:
    """Where JSON cannot be read, or what in it is not allowed."""
    if isinstance(error, UnicodeDecodeError):
        return "not text in UTF-8"
    return f"line {error.lineno}, column {error.colno}" if isinstance(error, json.JSONDecodeError) else str(error)


def too_deep(source: str) -> UserError:
    return UserError(f"{source}: nested too deep; at most {DEEPEST} levels are allowed")


def no_number(name: str) -> NoReturn:
    """NaN and Infinity are not JSON."""
    raise ValueError(f"{name} is not a number")


def check(value: object, source: str, key: str = "", level: int = 0, finite: bool = False) -> None:
    """Refuses content nested deeper than `DEEPEST` and whole numbers of more than 64 bits. Raises UserError naming `source`.

    key: where the value is. finite: refuses infinity and NaN too.
    """
    if isinstance(value, dict | list):
        if level > DEEPEST:
            raise too_deep(source)
        if isinstance(value, dict):
            for name, inside in value.items():
                check(inside, source, f"{key}.{name}" if key else name, level + 1, finite)
        else:
            for place, inside in enumerate(value):
                check(inside, source, f"{key}[{place}]", level + 1, finite)
    elif isinstance(value, int) and not -(2**63) <= value < 2**63:
        raise UserError(f"{source}: {key}: is too large; whole numbers go from -2^63 to 2^63 - 1")
    elif finite and isinstance(value, float) and not math.isfinite(value):
        raise UserError(f"{source}: {key}: should be a finite number, not {value}")
