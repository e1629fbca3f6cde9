"""What the tables of two reports say differently: reports have the words and units that their numbers lack."""

import re
from collections.abc import Iterator
from pathlib import Path

from quadstep.io import files
from quadstep.page.folder import REPORT, plain_text

PLACE = re.compile(r"<(h2|summary)\b[^>]*>(.{1,400}?)</\1>|<table>", re.DOTALL)
ROW, CELL = re.compile(r"<tr\b[^>]*>(.*?)</tr>", re.DOTALL), re.compile(r"<t[dh]\b[^>]*>(.*?)</t[dh]>", re.DOTALL)
NUMBER = re.compile(r"[−-]?\d[\d.,]*(?:\s×\s.*)?")
"""A row or a column that is named by one, such as that of a flight, is of another thing in the other report."""


def differences(first: Path, second: Path) -> dict[str, list[list[str]]]:
    """By the heading of a table that both results have, a row for each value that differs: of what it is, and both, a dash
    where one has none. Links are not followed. Raises UserError, OSError for a report that cannot be read.
    """
    front, behind = ({place[:2]: place[2] for place in values(report_text(folder))} for folder in (first, second))
    both, found = {heading for heading, _ in front} & {heading for heading, _ in behind}, dict[str, list[list[str]]]()
    for heading, what in front | behind:
        says = [one.get((heading, what), "–") for one in (front, behind)]
        if heading in both and says[0] != says[1] and not ("–" in says and NUMBER.match(what)):
            found.setdefault(heading, []).append([what, *says])
    return found


def report_text(folder: Path) -> str:
    with files.opened(folder / REPORT, files.PAGE, links=False) as file:
        return file.read().decode("utf-8", "replace")


def values(text: str) -> Iterator[tuple[str, str, str]]:
    """Every value of the tables of a report: under which heading, of what, and itself, as plain text."""
    heading = ""
    for place in PLACE.finditer(text):
        if place[2]:
            heading = plain_text(place[2])
            continue
        table = text[place.end() : text.find("</table>", place.end())]
        head, _, body = table.rpartition("</thead>")
        columns = [plain_text(one) for one in CELL.findall(head)]
        rows = [[plain_text(one) for one in CELL.findall(row)] for row in ROW.findall(body)]
        rows = [row for row in rows if row]
        labels = next((of for of in (1, 2, 3) if len({tuple(row[:of]) for row in rows}) == len(rows)), 2)
        for row in rows:
            named = columns[labels:] if len(row) - labels > 1 else [""]
            if not NUMBER.fullmatch(row[0]):
                said = ", ".join(row[:labels])
                kept = ((column, value) for column, value in zip(named, row[labels:], strict=False) if value)
                yield from (
                    (heading, f"{said}: {of}" if of else said, value) for of, value in kept if not NUMBER.fullmatch(of)
                )
