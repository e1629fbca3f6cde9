"""Logs of many topics: PX4 ULog, ArduPilot .BIN, MCAP. Readers are loaded when used: that of MCAP needs packages."""

from pathlib import Path

from quadstep.identify.logs.series import Topics
from quadstep.io import files
from quadstep.io.doors import Door
from quadstep.io.errors import UserError
from quadstep.io.extras import needed_by

READERS = Door("quadstep.log_readers", {
    "ulg": "quadstep.identify.logs.ulog:read",
    "ulog": "quadstep.identify.logs.ulog:read",
    "bin": "quadstep.identify.logs.ardupilot:read",
    "mcap": "quadstep.identify.logs.mcap_file:read",
})  # fmt: skip
"""What reads a kind of file, by file extension: given a path and the wanted columns, TOPIC.FIELD, it returns `Topics`."""

KINDS = {"ulg": "a ULog", "ulog": "a ULog", "bin": "an ArduPilot log", "mcap": "an MCAP file"}


def of_topics(path: Path) -> bool:
    """Whether there is a reader for the file."""
    return path.suffix.lower().removeprefix(".") in READERS


def refuse_empty(path: Path) -> None:
    """Raises UserError for a log that is empty or cannot be opened."""
    with files.opened(path, files.LOG) as file:
        if not file.read(1):
            raise UserError(f"{path}: is empty")


def read_topics(path: Path, wanted: list[str]) -> Topics:
    """The requested columns that a log has. Raises UserError if it is not a log, or if a package is not installed."""
    extension = path.suffix.lower().removeprefix(".")
    kind = KINDS.get(extension, f"a .{extension} file")
    refuse_empty(path)
    found: Topics
    with needed_by(f"reading {kind}"):
        try:
            found = READERS.load(extension)(path, wanted)
        except (UserError, ModuleNotFoundError):
            raise
        except Exception as error:
            said = str(error) or type(error).__name__
            raise UserError(f"{path}: cannot be read as {kind}: damaged, or another kind of file ({said})") from None
    return found
