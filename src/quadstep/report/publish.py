"""Results on disk: a folder always contains a complete result, the new one or the one before; tables as CSV and LaTeX."""

import contextlib
import csv
import json
import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import cast

from quadstep.interfaces.log import FlightLog
from quadstep.io.documents import parse_json
from quadstep.io.errors import UserError, signals_ignored
from quadstep.io.files import JSON, PAGE, WRITING, WRITTEN
from quadstep.io.parts import GO_ON, OTHER_CODE, changed_files
from quadstep.io.results_folder import Folder, names_in, opened

MANIFEST = "metrics.json"
"""The file that is moved last and identifies the results in a folder."""


OTHERS = {MANIFEST: "results of another kind", "export.json": "an exported law", "campaign.json": "a campaign",
          "rare.json": "an estimate of rare failures"}  # fmt: skip
"""What a folder holds by the file that identifies it."""


@contextlib.contextmanager
def publishing(
    path: Path, identity: str, overwrite: bool, name: str = MANIFEST, code: str = "", named: Mapping[str, str] | None = None
) -> Iterator[Path]:
    """A temporary folder to write into, moved into the folder `path` when the block ends well, thrown away when it does not.

    identity: digest of what is being flown. name: of the file that is moved last and identifies the results. code: digest of
    the code that made them, where parts of them are used again. named: digests of the user's files, by name, to say which have
    changed. Raises UserError if the folder cannot be written or holds something else.
    """
    said = {"fingerprint": identity, **({"code": code} if code else {}), **({"named": named} if named else {})}
    try:
        with opened(path) as folder, contextlib.ExitStack() as stack:
            with folder.locked():
                replaceable(folder, said, overwrite, name)
                folder.sweep()
                draft = stack.enter_context(folder.draft())
            yield draft.path
            names = draft.files()
            content = json.loads(draft.read(name, PAGE))
            draft.write(name, as_text({**content, **said, "files": names}), synced=False)
            with folder.locked(), signals_ignored():
                previous = replaceable(folder, said, overwrite, name)  # another run may have finished meanwhile
                replace(folder, draft, names, previous, name, said)
                WRITTEN.append(str(path))
    except OSError as error:
        raise UserError(f"{path}: cannot be written: {error.strerror or error}{f'; {GO_ON}' if code else ''}") from None


def replace(
    folder: Folder, draft: Folder, names: list[str], previous: list[str], last: str, record: Mapping[str, object]
) -> None:
    """Move files into place, remove those of the previous result, and move the manifest last.

    Meanwhile the folder's manifest names the files of both, so that after a kill the same command replaces all of them.
    """
    folder.check_free(names)
    meanwhile = {**record, "files": sorted({*previous, *names})}
    folder.write(last, as_text(meanwhile), synced=False)
    folder.take(draft, [one for one in names if one != last], last)
    for one in sorted(set(previous) - set(names)):
        folder.remove(one)
    folder.take(draft, [last], last)


def files_to_replace(path: Path, identity: str, overwrite: bool) -> list[str]:
    """The files of the result in the folder `path`. Raises UserError where it is none, or replacing it was not requested."""
    try:
        if not path.exists():
            return []
        with opened(path) as folder:
            return replaceable(folder, {"fingerprint": identity}, overwrite, MANIFEST)
    except OSError as error:
        raise UserError(f"{path}: cannot be read: {error.strerror or error}") from None


def replaceable(folder: Folder, record: Mapping[str, object], overwrite: bool, name: str) -> list[str]:
    """The files of the result that a folder holds. record: what identifies the new one, as in a manifest.

    Raises UserError where replacing it was not requested.
    """
    other = next((what for one, what in OTHERS.items() if one != name and folder.has(one)), "")
    if other:
        raise UserError(f"{folder.path}: holds {other}; choose another --out")
    content: dict[str, object] = {}
    says = ""
    if folder.has(name):
        text, says = folder.read(name, JSON), f", says {name}"
        try:
            loaded = parse_json(text, name)
            content = loaded if isinstance(loaded, dict) else {}
        except UserError as error:
            says = f" ({error})"
    found = any(not one.startswith(WRITING) for one in folder.names())
    others = [key for key in ("fingerprint", "code") if content.get(key) != record.get(key, content.get(key))]
    if not overwrite and others and found:
        what = f"other results ({content['name']})" if content.get("name") else "other files"
        what, says = (f"this result, but {OTHER_CODE}", "") if others == ["code"] else (what, says)
        changes = changed_files(content.get("named"), cast(Mapping[str, str], record.get("named", {})))
        says += f"; {changes}" if changes else ""
        raise UserError(f"{folder.path}: holds {what}{says}; choose another --out, or replace them with --overwrite")
    return names_in(content.get("files"))


def write_json(path: Path, content: object) -> None:
    """JSON with a fixed order and no NaN."""
    path.write_bytes(as_text(content))


def as_text(content: object) -> bytes:
    return (json.dumps(content, indent=2, allow_nan=False) + "\n").encode()


SPECIAL = {char: f"\\{char}" for char in "&%$#_{}"} | {
    "\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "<": "$<$", ">": "$>$",
    "\u2212": "$-$", "\u00b0": r"\textdegree{}", "\u00b5": r"\textmu{}", "\u00b2": "$^2$", "\u00b3": "$^3$", "\u00a0": "~",
}  # fmt: skip


def escaped(text: str) -> str:
    """Text that LaTeX sets as it is."""
    return "".join(SPECIAL.get(char, char) for char in text)


def booktabs(
    header: Sequence[str], groups: Sequence[Sequence[Sequence[str]]], comments: Sequence[str] = (),
    bold: Collection[tuple[int, int, int]] = (),
) -> str:  # fmt: skip
    """A tabular with its first column to the left and the others to the right.

    groups: rows of cells, each set apart by a rule. comments: what the table shows. bold: group, row, column of cells.
    """
    parts = [f"% {escaped(line)}" for line in comments] + [r"% needs \usepackage{booktabs}"]
    parts += [rf"\begin{{tabular}}{{l{'r' * (len(header) - 1)}}}", r"\toprule", line(map(escaped, header))]
    for g, group in enumerate(groups):
        parts.append(r"\midrule")
        for r, row in enumerate(group):
            cells = [rf"\textbf{{{escaped(cell)}}}" if (g, r, c) in bold else escaped(cell) for c, cell in enumerate(row)]
            parts.append(line(cells))
    return "\n".join([*parts, r"\bottomrule", r"\end{tabular}", ""])


def markdown_table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join(f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in line)} |" for line in lines)


def line(cells: Iterable[str]) -> str:
    """A row of cells that LaTeX sets."""
    return f"{' & '.join(cells)} \\\\"


def write_csv(path: Path, header: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Write rows under a header; numbers read back exactly, missing values (None, NaN, infinity) are empty."""
    with path.open("w", encoding="utf-8", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(header)
        table.writerows(tuple(map(cell, row)) for row in rows)


def write_log(path: Path, log: FlightLog) -> None:
    """Write one row per sample, units in brackets in the header."""
    line = ",".join(["%r"] * len(log.columns)) + "\n"  # what `csv` would write, in two thirds of the time
    with path.open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerow([f"{name}[{unit}]" for name, unit in log.columns.items()])
        file.writelines(line % tuple(row) for row in log.rows.tolist())


def cell(value: object) -> object:
    """A value as it stands in the file."""
    if isinstance(value, bool):
        return str(value).lower()
    return None if isinstance(value, float) and not math.isfinite(value) else value
