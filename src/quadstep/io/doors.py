"""Doors: where commands, engines, export targets, log readers, figures and autopilots register themselves.

A door is a group of entry points. What the package has itself stands beside it in the same form, "module:object", and is
loaded in the same way: when it is asked for by name. A distribution adds to a door in its pyproject.toml:

    [project.entry-points."quadstep.log_readers"]
    csv2 = "my_package.logs:read"
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Any

from quadstep.io.errors import UserError, unknown_name
from quadstep.io.user_code import loading
from quadstep.io.user_code.loading import NAMED

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint


@cache
def registered(group: str) -> "Mapping[str, Sequence[EntryPoint]]":
    """The entry points of a group, by name: one each, unless distributions clash. To look for them takes longer than to check
    a mission, so it is done once.
    """
    from importlib.metadata import entry_points  # noqa: PLC0415 (30 ms, which commands do not need to start)

    by_name: dict[str, list[EntryPoint]] = {}
    for one in sorted(entry_points(group=group), key=lambda one: (one.name, origin(one))):
        by_name.setdefault(one.name, []).append(one)
    return by_name


def installed(group: str, name: str) -> "EntryPoint":
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
        one = installed(self.group, name)
        if loading.refused:
            raise UserError(f"{one.value}: user code is not run: {loading.refused}")
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
