"""How a good file becomes a bad one: its values and keys changed with its structure known, or its bytes without."""

import datetime
import json
import math
from collections.abc import Sequence
from copy import deepcopy
from random import Random
from typing import Any

DEEP: list[Any] = []
for _ in range(40):
    DEEP = [DEEP]

VALUES: list[Any] = [
    math.nan, math.inf, -math.inf, 1e308, -1e308, 5e-324, 1e-15, 1e-9, -1e-9, 0.0, -0.0, 0.0005, 1.5, 1e6, 1e9, 1e30,
    0, 1, -1, 3, 7, 64, 10**6, 2**31, 2**63 - 1, 2**63, 10**30, -(10**30), 10**400, True, False,
    "", "a", "nan", "1.0", "x" * 5000, "\x00", "\x1b[31mred", "\u202egnp.exe", "\ud7ff\uffff", "two\nlines", "é" * 70, "😀",
    "/dev/zero", "..", ".", "v.toml", "recording.csv", "weights.json", "nowhere.csv", "n" * 300, "../" * 40,
    [], {}, [[]], [{}], [1], [0.0, 0.0, 0.0], [1.0, 2.0, 3.0], [math.nan] * 3, [1e9] * 3, [1e308] * 3, [0.0] * 300, DEEP,
    {"type": "uniform", "low": 0.9, "high": 1.1}, {"type": "choice", "values": [1.0, "a", True]}, {"": {"": {"": 1}}},
    {"type": "x"}, {"type": ["x"]}, {"file": "v.toml"}, {"preset": "crazyflie"}, datetime.date(2026, 1, 31),
]  # fmt: skip
KEYS = [
    "", "type", "file", "preset", "a" * 2000, "\x1b[31m", "\u202e", "\x00", "ключ", "0", "a.b", "duration", "mass", "period",
]  # fmt: skip
SNIPPETS = [
    b"\x00", b"\xff", b"\xef\xbb\xbf", b"\r", b"\n", b"\\", b'"', b"'''", b'"""', b"[", b"]", b"[[", b"{", b"}", b"=", b",",
    b"#", b"1e999", b"nan", b"-inf", b"9" * 400, b"0x" + b"f" * 300, b"[" * 300, b"a." * 300, b"_", b"\t" * 200,
    b"\xe2\x80\xae",
    b"\x1b[2J", b"[path]\n", b'type = "circle"\n', b"1979-05-27T07:32:00Z", b";", b"%s%n", b"NaN", b"null", b"true",
]  # fmt: skip

Way = tuple[Any, ...]


def places(value: Any, way: Way = ()) -> list[Way]:
    """The ways to every value inside."""
    inside = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [way] * bool(way) + [place for key, one in inside for place in places(one, (*way, key))]


def mutated(content: dict[str, Any], others: Sequence[dict[str, Any]], random: Random) -> dict[str, Any]:
    """A copy with one to four changes; some bring a part of another file."""
    content = deepcopy(content)
    for _ in range(random.choice((1, 1, 1, 2, 2, 3, 4))):
        ways = places(content)
        if not ways:
            break
        way = random.choice(ways)
        inside: Any = content
        for key in way[:-1]:
            inside = inside[key]
        change(inside, way[-1], content, ways, others, random)
    return content


def change(inside: Any, key: Any, content: Any, ways: list[Way], others: Sequence[Any], random: Random) -> None:
    """One change, at a key of a table or a place of a list."""
    value, what = inside[key], random.randrange(18)
    if what == 0:
        del inside[key]
    elif what == 1 and isinstance(inside, dict):
        inside[random.choice(KEYS)] = deepcopy(random.choice(VALUES))
    elif what == 2 and isinstance(inside, dict):
        inside[random.choice([*KEYS, f"{key}s"])] = inside.pop(key)
    elif what == 3 and isinstance(inside, list):
        inside[key:key] = deepcopy([value] * random.choice((1, 2, 250)))
    elif what == 4:
        inside[key] = deepcopy(at(content, random.choice(ways)))
    elif what == 5:
        other = random.choice(others)
        inside[key] = deepcopy(at(other, random.choice(places(other))))
    elif what == 6:
        inside[key] = random.choice(([value], {"a": value}, [value] * 3, {"type": value}))
    elif what >= 10 and isinstance(value, int | float) and not isinstance(value, bool):
        factor = random.choice((-1.0, 0.0, 0.1, 0.5, 0.999, 1.001, 2.0, 10.0, 1e3, 1e6, 1e-3, 1e-6, 1e12))
        inside[key] = type(value)(value * factor) if abs(value) < 1e280 else -value
    else:
        inside[key] = deepcopy(random.choice(VALUES))


def at(content: Any, way: Way) -> Any:
    """What is there."""
    for key in way:
        content = content[key]
    return content


def scrambled(content: bytes, random: Random) -> bytes:
    """A copy with up to eight changes of bytes."""
    data = bytearray(content)
    for _ in range(random.choice((1, 1, 2, 4, 8))):
        place, length = random.randrange(len(data) + 1), random.choice((1, 1, 2, 8, 60))
        what = random.randrange(6)
        if what == 0:
            data[place : place + 1] = bytes([random.randrange(256)])
        elif what == 1:
            del data[place : place + length]
        elif what == 2:
            data[place:place] = random.choice(SNIPPETS)
        elif what == 3:
            data[place : place + length] = random.choice(SNIPPETS)
        elif what == 4:
            start = random.randrange(len(data) + 1)
            data[place:place] = data[start : start + random.choice((4, 40, 400))]
        elif random.random() < 0.2:
            del data[place:]
    return bytes(data)


def toml(value: Any) -> str:
    """A table as TOML, whatever is in it."""
    return "".join(f"{quoted(key)} = {inline(one)}\n" for key, one in value.items() if one is not None)


def inline(value: Any) -> str:
    """A value as TOML."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{quoted(key)} = {inline(one)}" for key, one in value.items() if one is not None) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(inline, value)) + "]"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return quoted(value)
    return value.isoformat() if isinstance(value, datetime.date) else repr(value)


def quoted(text: str) -> str:
    """A text as TOML, with every character that may not stand there escaped."""
    escaped = (sign if sign.isprintable() and sign not in '"\\' else f"\\U{ord(sign):08x}" for sign in text)
    return '"' + "".join(escaped) + '"'


def as_json(value: Any) -> bytes:
    """A value as JSON, with NaN and numbers of any size."""
    return json.dumps(value, default=str).encode()
