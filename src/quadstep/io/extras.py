"""What to install for commands that need more than the core."""

import contextlib
import re
import shlex
import sys
from collections.abc import Iterator
from importlib import import_module
from importlib.metadata import PackageNotFoundError, requires
from types import ModuleType

from quadstep.io.errors import MissingExtraError

EXTRAS = {
    "pyarrow": "campaign", "scipy": "campaign", "cma": "campaign", "tomlkit": "campaign", "ray": "cluster",
    "sympy": "verify", "mpmath": "verify", "pymavlink": "mavlink", "rotorpy": "rotorpy", "pandas": "pandas",
    "mcap": "mcap", "mcap_ros2": "mcap", "lz4": "mcap", "zstandard": "mcap",
    "betaflight_chirp_core": "blackbox", "foundation_policy": "raptor", "h5py": "raptor", "segno": "share",
}  # fmt: skip
"""Which extra of pyproject.toml brings a package."""


def missing_extra(command: str, error: ModuleNotFoundError) -> MissingExtraError:
    """The error for a package that `command` needs; raises `error` itself if the package belongs to no extra."""
    package = (error.name or "").partition(".")[0]
    if package not in EXTRAS:
        raise error
    wanted = requirements(EXTRAS[package]) or [package]
    install = shlex.join([sys.executable, "-m", "pip", "install", *wanted])
    return MissingExtraError(f"{command} needs {package}; install it: {install}")


@contextlib.contextmanager
def needed_by(command: str) -> Iterator[None]:
    """A block that needs the packages of an extra. Raises MissingExtraError, saying what to install, where one is absent."""
    try:
        yield
    except ModuleNotFoundError as error:
        raise missing_extra(command, error) from None


def optional(command: str, module: str) -> ModuleType:
    """A module of an extra. Raises MissingExtraError, saying what to install, where it is absent."""
    with needed_by(command):
        return import_module(module)


def requirements(extra: str) -> list[str]:
    """What an extra consists of, as pip takes it; empty where quadstep itself is not installed.

    The packages, not `quadstep[extra]`: quadstep need not be on an index for this to work.
    """
    try:
        declared = requires("quadstep") or []
    except PackageNotFoundError:
        return []
    parts = [line.partition(";") for line in declared]
    return [wanted.strip() for wanted, _, marker in parts if re.search(rf"""extra\s*==\s*["']{extra}["']""", marker)]
