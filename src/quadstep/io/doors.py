"""Doors: where commands, engines, export targets, log readers, figures and autopilots register themselves.

A door is a group of entry points. What the package has itself stands beside it in the same form, "module:object", and is
loaded in the same way: when it is asked for by name. A distribution adds to a door in its pyproject.toml:

    [project.entry-points."quadstep.log_readers"]
    csv2 = "my_package.logs:read"

Missions name the things that installed packages bring, those of `GROUPS`, as they name the package's own. `EXTRAS` is what to
install for commands that need more than the core.
"""

import contextlib
import re
import shlex
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from importlib.metadata import PackageNotFoundError, requires
from types import ModuleType
from typing import TYPE_CHECKING, Any

from quadstep.io import user_code
from quadstep.io.errors import MissingExtraError, UserError, unknown_name
from quadstep.io.grouping import by_first
from quadstep.io.places import Place, place
from quadstep.io.user_code import NAMED

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint


@cache
def registered(group: str) -> "Mapping[str, Sequence[EntryPoint]]":
    """The entry points of a group, by name: one each, unless distributions clash. To look for them takes longer than to check
    a mission, so it is done once.
    """
    from importlib.metadata import entry_points  # noqa: PLC0415 (30 ms, which commands do not need to start)

    return by_first((one.name, one) for one in sorted(entry_points(group=group), key=lambda one: (one.name, origin(one))))


def entry_point(group: str, name: str) -> "EntryPoint":
    """An entry point that there is. Raises UserError where two distributions register it."""
    first, *others = registered(group)[name]
    if others:
        raise UserError(f"{origin(first)} and {origin(others[0])} both register {name} for {group}; uninstall one of them")
    return first


def origin(one: "EntryPoint") -> str:
    """The distribution that an entry point is of, with its version."""
    return f"{one.dist.name} {one.dist.version}" if one.dist else "an installed package"


@dataclass(frozen=True)
class Door:
    """group: of entry points. own: the package's, "module:object" by name; another distribution cannot take these names."""

    group: str
    own: Mapping[str, str] = field(hash=False)

    @property
    def names(self) -> tuple[str, ...]:
        """All there are, the package's first."""
        return (*self.own, *(name for name in registered(self.group) if name not in self.own))

    def __contains__(self, name: object) -> bool:
        return name in self.own or name in registered(self.group)

    def load(self, name: str) -> Any:
        """The function or class of this name. Raises UserError, for another distribution's that cannot be loaded too."""
        if name in self.own:
            module, _, thing = self.own[name].partition(":")
            return getattr(import_module(module), thing)
        if name not in self:
            raise UserError(unknown_name("name", name, self.names))
        one = entry_point(self.group, name)
        if user_code.refused:
            raise UserError(f"{one.value}: user code is not run: {user_code.refused}")
        what = f"{name}, which {origin(one)} registers for {self.group}"
        try:
            loaded = one.load()
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # SystemExit too
            why = " ".join(f"{type(error).__name__}: {error}".split())
            raise UserError(f"{what}, cannot be loaded: {why}") from error
        if not callable(loaded):
            raise UserError(f"{what}: should be a function or a class, not {type(loaded).__name__}")
        NAMED.add(what)
        return loaded


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


CONTROLLERS, PATHS, WINDS = "quadstep.controllers", "quadstep.paths", "quadstep.winds"
DISTURBANCES, METRICS, PLANTS, VEHICLES = "quadstep.disturbances", "quadstep.metrics", "quadstep.plants", "quadstep.vehicles"
SENSORS, ESTIMATORS = "quadstep.sensors", "quadstep.estimators"

GROUPS = (CONTROLLERS, PATHS, WINDS, DISTURBANCES, METRICS, PLANTS, VEHICLES, SENSORS, ESTIMATORS)
"""Of entry points: what a name in such a group stands for."""

OWN = "your own FILE.py:NAME"
"""How a user's own thing is named."""


def own_place(kind: object, group: str) -> Place | None:
    """What a mission names: a thing of the user's own, or an entry point of this group; None where it is neither.

    Raises UserError where two distributions register it, and where it is not what an entry point should be.
    """
    if isinstance(kind, str) and not place(kind) and kind in registered(group):
        return registered_place(entry_point(group, kind))
    return place(kind)


def registered_place(one: "EntryPoint") -> Place:
    """What an entry point stands for. Raises UserError for one that names neither a class nor a function of a module."""
    known, source = place(one.value), origin(one)
    if known is None:
        raise UserError(f"{one.name}, which {source} registers for {one.group}: should be module:name, not {one.value!r:.80}")
    return known._replace(origin=source)


def installed(group: str) -> dict[str, Place]:
    """The entry points of a group, by name, without those that `own_place` refuses."""
    found: dict[str, Place] = {}
    for name in registered(group):
        with suppress(UserError):
            found[name] = registered_place(entry_point(group, name))
    return found


def named(own: Iterable[str], group: str) -> tuple[str, ...]:
    """The names that a mission may use beside `OWN`: the package's, and those that installed packages bring."""
    names = tuple(own)
    return *names, *sorted(installed(group).keys() - set(names))


def all_installed() -> dict[str, list[Place]]:
    """Those of all groups, by name."""
    return by_first(pair for group in GROUPS for pair in installed(group).items())
