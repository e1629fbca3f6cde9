"""A thing of the user's own in a mission: its table says `type = "my_path.py:Lissajous"`, and the numbers that it declares."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import ClassVar, Literal, TypeVar

from pydantic import ValidationInfo

from quadstep.interfaces.gain import cached_by_class
from quadstep.io.errors import UserError
from quadstep.io.user_code.installed import own_place
from quadstep.io.user_code.loading import load
from quadstep.mission.numbers_section import NumbersSection, numbers_section
from quadstep.mission.own_table import or_own, unknown_type

T = TypeVar("T")


class OwnSection(NumbersSection):
    """The table of one."""

    thing: ClassVar[object]
    type: str


def own_class(kind: object, base: type, group: str, folder: Path) -> type | None:
    """The class that `kind` names, which is one of `base`; None where it names nothing of the user's. Raises UserError.

    group: of the entry points that name such classes.
    """
    found = own_place(kind, group)
    if found is None:
        return None
    thing, wanted = load(found, folder), f"quadstep.own.{base.__name__.removeprefix('Declared')}"
    if not (isinstance(thing, type) and issubclass(thing, base)):
        whose = f", which {found.origin} registers for {group}" if found.origin else ""
        raise UserError(f"{kind}{whose}: should be a subclass of {wanted}")
    lacking = sorted(getattr(thing, "__abstractmethods__", ()))
    if lacking:
        raise UserError(f"{kind}: has no {' and no '.join(f'`{name}`' for name in lacking)}, which {wanted} requires")
    return thing


@cached_by_class
def the_only(thing: type[T]) -> T:
    """The one object of a class that holds structure only, so that flights of it have one program."""
    return thing()


def own_or(
    base: type,
    section: type[OwnSection],
    group: str,
    known: Sequence[str | None] = (None,),
    otherwise: Callable[[object], object] | None = None,
) -> Callable[[object, Callable[[object], object], ValidationInfo], object]:
    """A validator around that of the package's tables: takes one of a class of the user's own too.

    base: what the class is one of; section: what its table is; group: of entry points. known: each `type` of the package's
    tables, None where one needs none. otherwise: as in `or_own`.
    """

    def table(kind: object, folder: Path) -> type[OwnSection] | None:
        thing = own_class(kind, base, group, folder)
        if thing is None and kind not in known:
            raise unknown_type(kind, filter(None, known), group)
        return own_section(str(kind), thing, section) if thing else None

    return or_own(lambda kind: issubclass(kind, section), table, otherwise)


def own_section(kind: str, thing: type, section: type[OwnSection]) -> type[OwnSection]:
    """The table of a class of the user's own. Raises UserError."""
    try:
        return new_section(kind, thing, section)
    except TypeError as error:  # in a declaration
        raise UserError(f"{kind}: {error}") from error


@cached_by_class
def new_section(kind: str, thing: type, section: type[OwnSection]) -> type[OwnSection]:
    """The same, made when first asked for."""
    if not hasattr(thing, "Numbers"):
        raise TypeError("has no `Numbers`, the NamedTuple of its declared numbers")
    made: type[OwnSection] = numbers_section(f"{thing.__name__}Section", thing.Numbers, section, type=(Literal[kind], ...))
    made.thing = the_only(thing)
    return made
