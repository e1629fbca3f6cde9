"""Logs of many topics: PX4 ULog, ArduPilot .BIN, MCAP. Readers are loaded when used: that of MCAP needs packages."""

from importlib import import_module
from pathlib import Path

from quadstep.identify.logs.series import Topics
from quadstep.io import files
from quadstep.io.errors import UserError
from quadstep.io.extras import needed_by

READERS = {
    ".ulg": ("ulog", "a ULog"),
    ".ulog": ("ulog", "a ULog"),
    ".bin": ("ardupilot", "an ArduPilot log"),
    ".mcap": ("mcap_file", "an MCAP file"),
}
"""The module that reads a kind of file, and the name of the kind, by file extension."""


def refuse_empty(path: Path) -> None:
    """Raises UserError for a log that is empty or cannot be opened."""
    with files.opened(path, files.LOG) as file:
        if not file.read(1):
            raise UserError(f"{path}: is empty")


def read_topics(path: Path, wanted: list[str]) -> Topics:
    """The requested columns that a log has. Raises UserError if it is not a log, or if a package is not installed."""
    module, kind = READERS[path.suffix.lower()]
    refuse_empty(path)
    found: Topics
    with needed_by(f"reading {kind}"):
        try:
            found = import_module(f"quadstep.identify.logs.{module}").read(path, wanted)
        except (UserError, ModuleNotFoundError):
            raise
        except Exception as error:
            said = str(error) or type(error).__name__
            raise UserError(f"{path}: cannot be read as {kind}: damaged, or another kind of file ({said})") from None
    return found
