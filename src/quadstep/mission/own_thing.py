"""A thing of the user's own in a mission: its table says `type = "my_path.py:Lissajous"`, and the numbers that it declares.

A mission names metrics likewise: of effort, `metrics = ["energy"]`, or of the user's own, `["my_metrics.py:Overshoot"]`.
"""

import inspect
import math
import re
from collections.abc import Callable, Container, Iterable, Mapping, Sequence
from numbers import Real
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, TypeVar

from pydantic import AfterValidator, BaseModel, Field, ValidationError, ValidationInfo, create_model
from pydantic_core import PydanticCustomError

from quadstep.control.registry import flown_by
from quadstep.interfaces.gain import Gain, cached_by_class, declared, gains_in
from quadstep.interfaces.log import Metric
from quadstep.io.doors import CONTROLLERS, METRICS, OWN, named, own_place
from quadstep.io.errors import UserError, listed, unknown_name
from quadstep.io.user_code import check_callable, load
from quadstep.metrics.effort import EFFORT
from quadstep.mission.check import INSIDE
from quadstep.mission.derived import key_field
from quadstep.mission.fields import Quantity, Section, Several
from quadstep.numbers import Vector

KEY = re.compile(r"[^\W_]\w*")
"""Of a gain."""


def check_gain(one: Gain) -> None:
    """Refuses a number that no key can be made of, or whose default its own range refuses. Raises TypeError or ValueError."""
    if not all(isinstance(text, str) for text in (one.key, one.unit, one.meaning, one.symbol)):
        raise TypeError(f"{one.key}: its key, unit, meaning and symbol should be text")
    if not KEY.fullmatch(one.key):
        raise ValueError(f"a gain cannot have the key {one.key!r:.60}; give it another by key=...")
    if one.default is None:
        raise ValueError(f"{one.key}: its default should be a number or be computed from the vehicle")
    if one.scale not in (None, "log", "linear"):
        raise ValueError(f"{one.key}: scale should be 'log' or 'linear', not {one.scale!r:.60}")
    if one.low is not None and one.high is not None and not one.low < one.high:
        raise ValueError(f"{one.key}: low = {one.low:g} must be below high = {one.high:g}")
    if one.fixed is None:
        return
    values: tuple[object, ...] = one.fixed if one.parts and isinstance(one.fixed, tuple) else (one.fixed,)
    if len(values) != (len(one.parts) or 1):
        raise ValueError(f"{one.key}: its default should be one number, or {len(one.parts)} in a tuple")
    for value in values:
        if (
            not isinstance(value, Real)
            or not math.isfinite(value)
            or not (one.signed or float(value) > 0.0 or (value == 0.0 and one.zero))
        ):
            least = "" if one.signed else " of at least 0" if one.zero else " above 0"
            raise ValueError(f"{one.key}: its default should consist of finite numbers{least}, not {value!r:.60}")
        low, high = -math.inf if one.low is None else one.low, math.inf if one.high is None else one.high
        if not low <= float(value) <= high:
            raise ValueError(f"{one.key}: its default {value:g} should lie within its range, {low:g} to {high:g}")


def or_own(
    is_own: Callable[[type], bool],
    table: Callable[[object, Path], type[BaseModel] | None],
    otherwise: Callable[[object], object] | None = None,
) -> Callable[[object, Callable[[object], object], ValidationInfo], object]:
    """A validator around that of the package's tables: takes one of the user's own too.

    is_own: of the class of a checked table. table: what a `type`, None if missing, names, files looked up from the mission's
    folder; None where that is the package's; raises UserError. otherwise: what takes all but tables instead of pydantic's own
    validator. An error in a table names its key.
    """

    def validated(value: object, known: Callable[[object], object], info: ValidationInfo) -> object:
        if is_own(type(value)):
            return value
        if not isinstance(value, Mapping):
            return (otherwise or known)(value)
        try:
            model = table(value.get("type"), (info.context or {}).get("folder", Path()))
        except UserError as error:
            kind = "union_tag_not_found" if value.get("type") is None else "value_error"
            wrong = {"type": kind, "loc": ("type",), "msg": str(error), "input": value}
            raise PydanticCustomError(INSIDE, "inside", {"model": BaseModel, "problems": [wrong]}) from error
        if model is None:
            return known(value)
        try:
            return model.model_validate(value, context=info.context)
        except ValidationError as error:
            every = error.errors(include_url=False)
            raise PydanticCustomError(INSIDE, "inside", {"model": model, "problems": every}) from None

    return validated


def unknown_type(kind: object, own: Iterable[str], group: str) -> UserError:
    """What is said of a `type`, None if missing, that names nothing: own are the package's, group those of entry points."""
    names = named(own, group)
    allowed = f"allowed: {listed(names, OWN)}"
    if kind is None:
        return UserError(f"is required; {allowed}")
    others = flown_by(kind) if group == CONTROLLERS else ""
    return UserError(f"{kind} flies only {others}; {allowed}" if others else unknown_name("value", kind, names, OWN))


class NumbersSection(Section):
    """Numbers that a structure declares; keys are those declared."""

    structure: ClassVar[type]

    def numbers(self) -> object:
        values = {name: getattr(self, one.key) for name, one in gains_in(self.structure).items()}
        return self.structure(**{name: Vector(one) if isinstance(one, tuple) else one for name, one in values.items()})


def numbers_section(name: str, structure: type, base: type[NumbersSection] = NumbersSection, **more: Any) -> Any:
    """The table of a structure of declared numbers. Raises TypeError or ValueError for declarations that give none."""
    fields: dict[str, Any] = {}
    for one in declared(structure).values():
        if not isinstance(one, Gain) or one.fixed is None:
            raise TypeError(f"{structure.__name__}: every number needs gain(...) with a default that is a number")
        check_gain(one)
        if hasattr(base, one.key) or one.key in (*more, *base.__class_vars__):
            raise TypeError(f"{structure.__name__}: a number cannot have the key {one.key}; give it another by key=...")
        fields[one.key] = key_field(one)
    made: Any = create_model(name, __base__=base, __module__=__name__, **more, **fields)
    made.structure = structure
    return made


T = TypeVar("T")


class OwnSection(NumbersSection):
    """The table of one."""

    thing: ClassVar[object]
    type: Annotated[str, Quantity("", "FILE.py:NAME, a class of your own")]


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
    for name, model in inspect.getmembers(base, inspect.isfunction):
        if not name.startswith("_"):
            owner, *given = (key for key, one in inspect.signature(model).parameters.items() if one.default is one.empty)
            check_callable(name, getattr(object.__new__(thing), name), given, [owner], f"{kind}: ")
    return thing


@cached_by_class
def the_only(thing: type[T]) -> T:
    """The one object of a class that holds structure only, so that flights of it have one program."""
    return thing()


def own_or(
    base: type, section: type[OwnSection], group: str, names: Sequence[str | None] = (None,),
    otherwise: Callable[[object], object] | None = None,
) -> Callable[[object, Callable[[object], object], ValidationInfo], object]:  # fmt: skip
    """A validator around that of the package's tables: takes one of a class of the user's own too.

    base: what the class is one of; section: what its table is; group: of entry points. names: each `type` of the package's
    tables, None where one needs none. otherwise: as in `or_own`.
    """

    def table(kind: object, folder: Path) -> type[OwnSection] | None:
        thing = own_class(kind, base, group, folder)
        if thing is None and kind not in names:
            raise unknown_type(kind, filter(None, names), group)
        return own_section(str(kind), thing, section) if thing else None

    return or_own(lambda kind: issubclass(kind, section), table, otherwise)


def own_section(kind: str, thing: type, section: type[OwnSection]) -> type[OwnSection]:
    """The table of a class of the user's own. Raises UserError."""
    try:
        return new_section(kind, thing, section)
    except (TypeError, ValueError) as error:  # in a declaration
        raise UserError(f"{kind}: {error}") from error


@cached_by_class
def new_section(kind: str, thing: type, section: type[OwnSection]) -> type[OwnSection]:
    """The same, made when first asked for."""
    if not hasattr(thing, "Numbers"):
        raise TypeError("has no `Numbers`, the NamedTuple of its declared numbers")
    made: type[OwnSection] = numbers_section(f"{thing.__name__}Section", thing.Numbers, section, type=(Literal[kind], ...))
    made.thing = the_only(thing)
    return made


TAKEN = (
    "flight", "outcome", "ended", "time_of_failure", "success", "name", "version", "engine", "warnings", "mission",
    "requirements",
)  # fmt: skip
"""What else is in results."""

NAMED = re.compile(r"[A-Za-z_]\w{0,59}")
UNIT = re.compile(r"[^\[\],\"]{0,20}")


def own_metrics(named: Sequence[str], folder: Path) -> tuple[Metric, ...]:
    """The metrics that a mission names. folder: the mission's. Raises UserError."""
    return tuple(own_metric(one, folder) for one in named)


def own_metric(kind: str, folder: Path) -> Metric:
    if kind in EFFORT:
        return EFFORT[kind]()
    thing: type[Metric] | None = own_class(kind, Metric, METRICS, folder)
    if thing is None:
        raise unknown_type(kind, EFFORT, METRICS)
    name, unit = getattr(thing, "name", None), thing.unit
    if not (isinstance(name, str) and NAMED.fullmatch(name)):
        raise UserError(f"{kind}: its `name` should be letters, digits and _, at most 60, not {name!r:.60}")
    if name in TAKEN:
        raise UserError(f"{kind}: its `name` is {name}, which already has another meaning in results")
    if not (isinstance(unit, str) and unit.isprintable() and UNIT.fullmatch(unit)):
        raise UserError(f"{kind}: its `unit` should be a few printable characters without brackets, not {unit!r:.60}")
    return the_only(thing)


def check_names(named: Sequence[Metric], scores: Container[str], with_rotors: bool) -> None:
    """Refuses metrics that the flights of a mission have anyway, or cannot have. Raises ValueError.

    scores: names of those that all its flights have. with_rotors: whether its vehicle has rotors of its own.
    """
    for one in named:
        if one.name in EFFORT and not with_rotors:
            raise ValueError(f"metrics: {one.name}: only for real vehicles; name one in [vehicle]")
        if one.name in scores:
            raise ValueError(f"metrics: {one.name}: every flight already has a metric of this name")


def checked_metrics(named: tuple[str, ...], info: ValidationInfo) -> tuple[str, ...]:
    """Refuses a name of nothing, and a metric named twice."""
    try:
        names = [one.name for one in own_metrics(named, (info.context or {}).get("folder", Path()))]
    except UserError as error:
        raise ValueError(str(error)) from error
    twice = [name for name in names if names.count(name) > 1]
    if twice:
        raise ValueError(f"two metrics share the name {twice[0]}")
    return named


OwnMetrics = Annotated[
    Several[str],
    Field(max_length=32),
    AfterValidator(checked_metrics),
    Quantity("", f"further metrics: {', '.join(EFFORT)}, or FILE.py:NAME of your own"),
]
"""The key `metrics`."""
