"""ArduPilot's .BIN (https://ardupilot.org/dev/docs/code-overview-adding-a-new-log-message.html)."""

from pathlib import Path

import numpy as np

from quadstep.identify.logs.series import PackedMessages, Topics, by_topic, columns_of, layout_of, rows_of
from quadstep.io import files
from quadstep.io.errors import UserError
from quadstep.io.grouping import by_first

HEAD = b"\xa3\x95"
FORMAT, FORMAT_LENGTH = 0x80, 89
"""The message that declares another: type, length, name (4), letters of its fields (16), their names (64)."""

LETTERS = {
    "a": ("<i2", 32), "b": ("i1", 0), "B": ("u1", 0), "h": ("<i2", 0), "H": ("<u2", 0), "i": ("<i4", 0), "I": ("<u4", 0),
    "f": ("<f4", 0), "d": ("<f8", 0), "g": ("<f2", 0), "n": ("S4", 0), "N": ("S16", 0), "Z": ("S64", 0), "c": ("<i2", 0),
    "C": ("<u2", 0), "e": ("<i4", 0), "E": ("<u4", 0), "L": ("<i4", 0), "M": ("u1", 0), "q": ("<i8", 0), "Q": ("<u8", 0),
}  # fmt: skip
UNITS = {"c": 0.01, "C": 0.01, "e": 0.01, "E": 0.01, "L": 1e-7}
"""What a whole number of these letters counts."""

TAIL = 528
"""Bytes at the end that may be anything: some boards write whole pages."""


def read(path: Path, columns: list[str]) -> Topics:
    """Columns of an ArduPilot log, of the first instance of each message (I, or C for the filter's core, is 0).

    Raises UserError for too many numbers, and for a file that declares no message.
    """
    fields, content = by_topic(columns), files.read_bytes(path, files.LOG)
    if bytes([*HEAD, FORMAT]) not in content:
        raise UserError(f"{path}: cannot be read as an ArduPilot log: damaged, or another kind of file")
    packed, letters, damaged = walked(content, [*fields, "PARM"])
    told = parameters(packed.pop("PARM")) if "PARM" in packed and "PARM" not in fields else {}
    rows = {}
    for topic, one in packed.items():
        messages = rows_of(one)
        names = messages.dtype.names or ()
        number = next((name for name in ("I", "C") if letters[topic].get(name) == "B"), None)
        if number is not None:
            messages = messages[messages[number] == 0]
        if "TimeUS" in names:
            rows[topic] = messages["TimeUS"].astype(np.float64) * 1e-6, messages
    found = columns_of(path, rows, fields)
    for name, series in found.items():
        topic, _, field = name.partition(".")
        found[name] = series._replace(value=series.value * UNITS.get(letters[topic].get(field, ""), 1.0))
    return Topics.with_history(found, damaged, told)


def parameters(logged: PackedMessages) -> dict[str, list[float]]:
    """All that the vehicle's parameters were, by name."""
    rows = rows_of(logged)
    if not {"Name", "Value"} <= set(rows.dtype.names or ()):
        return {}
    named = zip(rows["Name"], rows["Value"], strict=True)
    return by_first((bytes(name).rstrip(b"\0").decode("latin-1"), float(value)) for name, value in named)


def walked(content: bytes, topics: list[str]) -> tuple[dict[str, PackedMessages], dict[str, dict[str, str]], int]:
    """The messages of the topics, the letters of their fields, and how many places are damaged."""
    lengths = {FORMAT: FORMAT_LENGTH}
    found: dict[int, PackedMessages] = {}
    names: dict[str, int] = {}
    letters: dict[str, dict[str, str]] = {}
    at, damaged = 0, 0
    while at < len(content):
        length = lengths.get(content[at + 2], 0) if content.startswith(HEAD, at) and at + 2 < len(content) else 0
        end = at + length
        fine = length > 0 and end <= len(content)
        if fine and (one := found.get(content[at + 2])):
            one.content.extend(content[at + 3 : end])
        elif fine and content[at + 2] == FORMAT:
            number, name, size, fields = declared(content[at + 3 : end])
            if number not in lengths:
                lengths[number] = size
                if name in topics and name not in names:
                    try:
                        found[number], names[name] = PackedMessages(layout(fields, size), bytearray()), number
                        letters[name] = dict(fields)
                    except (KeyError, ValueError):
                        damaged += 1
        if not fine:
            end = next_message(content, at + 1, lengths)
            cut = HEAD.startswith(content[at : at + 2])  # the file ends within a message
            damaged += end < len(content) or cut or len(content) - at > TAIL
        at = end
    return {name: found[number] for name, number in names.items()}, letters, damaged


def next_message(content: bytes, at: int, lengths: dict[int, int]) -> int:
    """Where the next message begins that another one follows, or that ends the log."""
    while (at := content.find(HEAD, at)) >= 0:
        length = lengths.get(content[at + 2], 0) if at + 2 < len(content) else 0
        if length and (content.startswith(HEAD, at + length) or at + length == len(content)):
            return at
        at += 1
    return len(content)


def declared(body: bytes) -> tuple[int, str, int, list[tuple[str, str]]]:
    """What a message declares: number, name, length, and the name and letter of each field."""
    name, letters, names = (body[i:j].split(b"\0")[0].decode("latin-1") for i, j in ((2, 6), (6, 22), (22, 86)))
    return body[0], name, body[1], list(zip(names.split(","), letters, strict=False))


def layout(fields: list[tuple[str, str]], size: int) -> np.dtype[np.void]:
    """The layout of a message of so many bytes. Raises KeyError for an unknown letter, ValueError for another size."""
    found = layout_of([(name, *LETTERS[letter]) for name, letter in fields])
    if found.itemsize != size - 3:
        raise ValueError("fields of another length")
    return found
