"""PX4's ULog (https://docs.px4.io/main/en/dev_log/ulog_file_format.html)."""

import re
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from quadstep.identify.logs.series import PackedMessages, Topics, by_topic, columns_of, layout_of, rows_of
from quadstep.io import files
from quadstep.io.errors import UserError

MAGIC, START = b"ULog\x01\x12\x35", 16
KINDS = frozenset(b"BFIMPQARDLCSO")
NUMBERS = {
    "int8_t": "<i1", "uint8_t": "<u1", "int16_t": "<i2", "uint16_t": "<u2", "int32_t": "<i4", "uint32_t": "<u4",
    "int64_t": "<i8", "uint64_t": "<u8", "float": "<f4", "double": "<f8", "bool": "?", "char": "S1",
}  # fmt: skip
FIELD = re.compile(r"(\w+)(?:\[(\d{1,5})\])? (\w+)")
DEEPEST = 8
"""Layouts within one another."""

Formats = dict[str, list[tuple[str, int, str]]]
"""Type, count (0: not an array) and name of each field, by the name of a layout."""


class LoggedTopic(NamedTuple):
    """A topic with its id in the log. most: bytes that a message may have, with what pads its end."""

    topic: str
    packed: PackedMessages
    most: int


def read(path: Path, columns: list[str]) -> Topics:
    """Columns of a ULog: the first instance of each topic, times in seconds. Raises UserError if it is none."""
    fields = by_topic(columns)
    logged, told, damaged = walked(path, files.read_bytes(path, files.LOG), list(fields))
    rows = {}
    for one in logged:
        messages = rows_of(one.packed)
        known = [name for name in ("timestamp_sample", "timestamp") if name in (messages.dtype.names or ())]
        stamps = next((messages[name] for name in known if messages[name].any()), None)
        if stamps is not None and stamps.ndim == 1:
            rows[one.topic] = stamps.astype(np.float64) * 1e-6, messages
    return Topics.with_history(columns_of(path, rows, fields), damaged, told)


def walked(path: Path, content: bytes, topics: list[str]) -> tuple[list[LoggedTopic], dict[str, list[float]], int]:
    """The messages of the topics, all that parameters were, and how many places are damaged. Raises UserError."""
    if not content.startswith(MAGIC):
        raise UserError(f"{path}: cannot be read as a ULog: damaged, or another kind of file")
    formats: Formats = {}
    found: dict[bytes, LoggedTopic] = {}
    parameters: dict[str, list[float]] = {}
    resume = header_of(topics, [])
    at, damaged = START, 0
    while at < len(content):
        size, kind = int.from_bytes(content[at : at + 2], "little"), content[at + 2 : at + 3]
        end = at + 3 + size
        fine = len(kind) == 1 and kind[0] in KINDS and end <= len(content)
        if fine and kind == b"D" and (one := found.get(content[at + 3 : at + 5])):
            least = one.packed.layout.itemsize
            fine = least <= size - 2 <= one.most
            if fine:
                one.packed.content.extend(content[at + 5 : at + 5 + least])
        elif fine and kind == b"F":
            fine = declare(content[at + 3 : end], formats)
        elif fine and kind == b"P":
            fine = tell(content[at + 3 : end], parameters)
        elif fine and kind == b"A" and content[at + 3] == 0:
            fine = add(content[at + 4 : end], topics, formats, found)
            resume = header_of(topics, found.items())
        if not fine:
            damaged += 1
            later = resume.search(content, at + 1)
            end = later.start() if later else len(content)
        at = end
    return list(found.values()), parameters, damaged


def header_of(topics: Iterable[str], found: Iterable[tuple[bytes, LoggedTopic]]) -> re.Pattern[bytes]:
    """What begins a message that is wanted: a layout or an id of a topic, or a sample of one that has an id."""
    names = b"|".join(re.escape(topic.encode()) for topic in topics)
    samples = [(one.packed.layout.itemsize + 2).to_bytes(2, "little") + b"D" + number for number, one in found]
    return re.compile(b"|".join([b"..F(?:%b):" % names, b"..A\x00..(?:%b)" % names, *map(re.escape, samples)]), re.DOTALL)


def declare(body: bytes, formats: Formats) -> bool:
    """Takes in a layout, as `name:type field;type[3] field;`. Returns whether it is one."""
    name, _, declared = body.decode("latin-1").partition(":")
    matches = [FIELD.fullmatch(one) for one in declared.removesuffix(";").split(";")]
    if not all(matches):
        return False
    formats.setdefault(name, [(one[1], int(one[2] or 0), one[3]) for one in matches if one])
    return True


def tell(body: bytes, parameters: dict[str, list[float]]) -> bool:
    """Takes in a parameter: how long its key is, the key, as `float NAME`, and its value. Returns whether it is one."""
    kind, _, name = body[1 : 1 + body[0]].decode("latin-1").partition(" ") if body else ("", "", "")
    value = body[1 + len(kind) + 1 + len(name) :]
    if kind not in ("int32_t", "float") or len(value) != 4:
        return False
    parameters.setdefault(name, []).append(float(np.frombuffer(value, NUMBERS[kind])[0]))
    return True


def add(body: bytes, topics: list[str], formats: Formats, found: dict[bytes, LoggedTopic]) -> bool:
    """Takes in the id of a topic, if it is wanted and the first. Returns whether its layout is known."""
    number, topic = body[:2], body[2:].decode("latin-1")
    if topic not in topics or number in found or any(one.topic == topic for one in found.values()):
        return True
    try:
        fields = formats[topic]
        padded = layout(fields, formats, 0).itemsize
        while fields and fields[-1][2].startswith("_padding"):
            fields = fields[:-1]
        found[number] = LoggedTopic(topic, PackedMessages(layout(fields, formats, 0), bytearray()), padded)
    except (KeyError, ValueError):
        return False
    return True


def layout(fields: list[tuple[str, int, str]], formats: Formats, depth: int) -> np.dtype[np.void]:
    """The layout of some fields. Raises KeyError for one that was not declared, ValueError for one that cannot be."""
    if depth > DEEPEST:
        raise ValueError("a layout that contains itself")
    kinds = [(name, NUMBERS.get(kind) or layout(formats[kind], formats, depth + 1), count) for kind, count, name in fields]
    return layout_of(kinds)
