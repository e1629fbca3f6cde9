"""Declarations of a law's gains.

    class SuperTwistingGains(NamedTuple):
        mass: Number = believed("mass")
        k_p: Vector = gain(6.0, "1/s^2", "position", low=0.5, high=60.0)
        most_thrust: Number = given(lambda model: model.most_thrust)

A declaration is the default of a `NamedTuple` field. The mission's keys and their checks, the lines of `quadstep new`,
units, the page's sliders and the ranges of a search are all derived from it. A field that is itself a `NamedTuple` of
declared gains needs none, or `nested()` behind fields that have one: its keys are added to the others.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache
from numbers import Real
from typing import (
    TYPE_CHECKING,
    Any,
    Generic,
    Literal,
    NamedTuple,
    ParamSpec,
    Protocol,
    TypeAlias,
    TypeVar,
    cast,
    get_type_hints,
)

from quadstep.interfaces.plant import Model
from quadstep.numbers import Number, Vector

if TYPE_CHECKING:
    from quadstep.interfaces.learning import Learning

AXES, ANGLES = ("x", "y", "z"), ("psi", "theta", "phi")
"""Parts of a gain about three axes. One number in a mission stands for three equal ones."""

GAINS, NETS, BELIEF = "Gains", "Nets", "Values assumed by the controller"
"""Headings of sliders."""

BELIEVED_UNITS = {"mass": "kg", "inertia": "kg m^2", "gravity": "m/s^2"}


Rule: TypeAlias = Callable[[Any, Model], object]
"""A function of other gains, read by their names, and of the vehicle."""


@dataclass(frozen=True)
class FromGains:
    """A default computed from other gains of the same structure: rule(gains, model)."""

    rule: Rule


Default: TypeAlias = float | tuple[float, ...] | Callable[[Model], object] | FromGains | None
"""A number, one for each part, a function of the vehicle or of other gains; None if a mission must give it."""


Values = TypeVar("Values", float, tuple[float, ...])

Only: TypeAlias = Literal["", "range", "whole"]

About: TypeAlias = Literal["", "body", "rate", "yaw"]
"""What a usual gain is about: the axes of the body, of which the third turns the heading; rates about them; or yaw alone."""


@dataclass(frozen=True)
class Usual(Generic[Values]):
    """A gain found on the 2.6 kg vehicle; on others it is multiplied by their agility [1/s] to this power, or each part to its
    own: on body rates by that of their loop; about yaw, and the third part about the body's axes, by that of the heading.
    """

    values: Values
    power: int | tuple[int, ...]
    about: About = ""

    def __call__(self, model: Model) -> Values:
        values = self.values if isinstance(self.values, tuple) else (self.values,)
        powers = self.power if isinstance(self.power, tuple) else (self.power,) * len(values)
        first = {"yaw": 0, "body": len(values) - 1, "rate": len(values) - 1}.get(self.about, len(values))
        paces = (model.rate_agility if self.about == "rate" else model.agility,) * first + (model.yaw_agility,) * (
            len(values) - first
        )
        found = tuple(value * raised(pace, power) for value, pace, power in zip(values, paces, powers, strict=True))
        return found if isinstance(self.values, tuple) else found[0]


def raised(pace: Number, power: int) -> Number:
    """A power, in a fixed order."""
    product: Number = 1.0
    for _ in range(power):
        product = product * pace
    return product


class Declaration(Protocol):
    def decide(self, gains: object, model: Model, learning: "Learning | None") -> object:
        """The field's value if the mission does not give it. gains: the other fields; learning: settings of the nets."""
        ...


@dataclass(frozen=True)
class Gain:
    """A number or vector with a key in mission files. parts: names of a vector's entries, none of a number.

    zero: whether it may be 0; it is never negative. signed: it may have any value. low, high, scale ("log" or "linear"): of
    the slider and of a search.
    tunable: whether a search may change it. group: heading of its slider. only: the values that a mission may give: from low
    to high ("range"), or whole numbers there ("whole").
    """

    default: Default
    unit: str
    meaning: str
    symbol: str = ""
    key: str = ""
    parts: tuple[str, ...] = ()
    zero: bool = False
    low: float | None = None
    high: float | None = None
    scale: str | None = None
    tunable: bool = True
    group: str = GAINS
    signed: bool = False
    only: Only = ""

    def decide(self, gains: object, model: Model, learning: "Learning | None") -> object:
        return self.shaped(resolved(self.default, gains, model))

    def shaped(self, value: object) -> object:
        """A value in the form that the law expects: a vector if there are parts, where one number stands for equal ones."""
        if not self.parts or isinstance(value, Vector):
            return value
        entries = value if isinstance(value, tuple) else (value,) * len(self.parts)
        return Vector(cast(tuple[Number, ...], entries))

    @property
    def label(self) -> str:
        """The symbol, or the key in words; k_p is a symbol, most_speed is words."""
        first, *more = self.key.split("_")
        return self.symbol or (self.key if len(first) == 1 or not more else " ".join((first, *more)))

    @property
    def stands_for_three(self) -> bool:
        """Whether a mission may give one number for all parts."""
        return self.parts in (AXES, ANGLES)

    @property
    def fixed(self) -> float | tuple[float, ...] | None:
        """The default if it is the same for every vehicle, in the form used in a mission; else None."""
        if self.default is None or callable(self.default) or isinstance(self.default, FromGains):
            return None
        if not self.parts:
            return self.default
        return self.default if isinstance(self.default, tuple) else (self.default,) * len(self.parts)

    def span(self, least: float, most: float) -> tuple[float, float, str]:
        """Low, high and scale of a slider or a search about present values from `least` to `most`; a declared end that these
        are beyond says nothing.
        """
        scale = self.scale or ("linear" if self.zero or self.signed or least <= 0.0 else "log")
        reach = max(10.0 * (max(-least, most) if self.signed else most), 1.0 if scale == "linear" else 0.0)
        low = -reach if self.signed else 0.0 if scale == "linear" else least / 10.0
        low = low if self.low is None or self.low > least else self.low
        return low, reach if self.high is None or self.high < most else self.high, scale


@dataclass(frozen=True)
class Given:
    """No key: it follows from the vehicle."""

    value: Callable[[Model], object]

    def decide(self, gains: object, model: Model, learning: "Learning | None") -> object:
        return self.value(model)


def gain(
    default: Default, unit: str, meaning: str, *, symbol: str = "", key: str = "", parts: tuple[str, ...] = (),
    zero: bool = False, low: float | None = None, high: float | None = None, scale: str | None = None,
    tunable: bool = True, group: str = GAINS, signed: bool = False, only: Only = "",
) -> Any:  # fmt: skip
    """Declares a gain; see `Gain`. Its key is the field's name, its parts those of three axes, unless they are given."""
    return Gain(default, unit, meaning, symbol, key, parts, zero, low, high, scale, tunable, group, signed, only)


def parameter(
    name: str, default: float, unit: str, meaning: str, *, low: float | None = None, high: float | None = None,
    zero: bool = True, tunable: bool = True, only: Only = "",
) -> Any:  # fmt: skip
    """Declares a gain that is one of an autopilot's parameters, by its own name there. low, high: its range there; only: where
    the autopilot itself takes no other values.
    """
    return gain(default, unit, meaning, symbol=name, key=name, zero=zero, low=low, high=high, tunable=tunable, only=only)


def switch(name: str, default: float, meaning: str, most: int = 1) -> float:
    """Declares a parameter that chooses: a whole number, from 0 to `most`."""
    return parameter(name, default, "-", meaning, low=0.0, high=float(most), tunable=False, only="whole")


def believed(what: str) -> Any:
    """Declares what the controller believes of the vehicle ("mass", "inertia"): a key, the vehicle's own if left out."""
    meaning = "value assumed by the controller; default: the vehicle's"
    return gain(lambda model: getattr(model, what), BELIEVED_UNITS[what], meaning, key=what, tunable=False, group=BELIEF)


def given(value: Callable[[Model], object]) -> Any:
    """Declares a number that follows from the vehicle and has no key."""
    return Given(value)


def nested(**fields: object) -> Any:
    """Declares a structure by its fields; without any, by their own declarations."""
    return fields


def usual(values: Values, power: int | tuple[int, ...] = 1, about: About = "") -> Usual[Values]:
    """A default found on the 2.6 kg vehicle, times the agility of others to this power, or each part to its own.

    about: "body" for three parts about the axes of the body, "rate" for gains on the rates about them, "yaw" for a gain of the
    heading; rates, and what turns about the vertical axis, have an agility of their own.
    """
    if not all(isinstance(one, Real) for one in (values if isinstance(values, tuple) else (values,))):
        raise TypeError(f"usual: should be given a number, or a tuple of them, not {values!r:.60}")
    return Usual(values, power, about)


def from_gains(rule: Rule) -> FromGains:
    """A default that follows from other gains: `from_gains(lambda gains, model: gains.k_p / 15.0)`."""
    return FromGains(rule)


def resolved(default: Default, gains: object, model: Model) -> object:
    if isinstance(default, FromGains):
        return default.rule(gains, model)
    return default(model) if callable(default) else default


# A structure of gains


P = ParamSpec("P")
R = TypeVar("R")


def cached_by_class(function: Callable[P, R]) -> Callable[P, R]:
    """The function, its answer for each class that it is asked about kept."""
    return cache(function)  # type: ignore[return-value]  # a class is hashable, whatever its objects are


@cached_by_class
def kinds_of(gains: type) -> Mapping[str, type]:
    return get_type_hints(gains)


@cached_by_class
def declared(gains: type) -> Mapping[str, Declaration]:
    """The declaration of every field of a structure of gains, by dotted name. Raises TypeError for a field without one."""
    found: dict[str, Declaration] = {}
    bare = [name for name, one in vars(gains).items() if isinstance(one, Gain | Given) and name not in kinds_of(gains)]
    if bare:
        raise TypeError(f"{gains.__name__}.{bare[0]}: needs a type, as in `{bare[0]}: Number = gain(...)`")
    for name, kind in kinds_of(gains).items():
        declaration = getattr(gains, "_field_defaults", {}).get(name)
        if isinstance(declaration, Gain):
            if kind in (str, bool, tuple, list, dict):
                raise TypeError(f"{gains.__name__}.{name}: a gain is a Number or a Vector, not a {kind.__name__}")
            parts = declaration.parts or (AXES if kind is Vector else ())
            found[name] = replace(declaration, key=declaration.key or name, parts=parts)
        elif hasattr(declaration, "decide"):
            found[name] = cast(Declaration, declaration)
        elif hasattr(kind, "_field_defaults"):
            found |= {f"{name}.{inner}": one for inner, one in (declaration or declared(kind)).items()}
        else:
            raise TypeError(f"{gains.__name__}.{name}: declare it as gain(...), believed(...) or given(...)")
    keys = [one.key for one in found.values() if isinstance(one, Gain)]
    twice = [key for key in keys if keys.count(key) > 1]
    if twice:
        raise TypeError(f"{gains.__name__}: two gains share the key {twice[0]}")
    return found


def gains_in(structure: type) -> dict[str, Gain]:
    """Those of a structure's declarations that have keys, by dotted name."""
    return {name: one for name, one in declared(structure).items() if isinstance(one, Gain)}


def with_defaults(declarations: Mapping[str, Declaration], defaults: Mapping[str, Any]) -> dict[str, Declaration]:
    """Declarations with other defaults, by dotted name; what is itself a declaration replaces the one that was there."""
    changed = dict(declarations)
    for name, one in defaults.items():
        changed[name] = one if hasattr(one, "decide") else replace(cast(Gain, declarations[name]), default=one)
    return changed


class StatedGains(NamedTuple):
    """What a mission says of the gains. values: by dotted field, where it does; learning: of the nets."""

    values: Mapping[str, object]
    learning: "Learning | None" = None


class Undecided:
    """Gains that are decided one by one as they are read, so that their order does not matter, and only what is read costs."""

    def __init__(
        self, gains: type, declarations: Mapping[str, Declaration], said: StatedGains, model: Model, prefix: str = ""
    ) -> None:
        self._gains, self._declarations, self._said, self._model, self._prefix = gains, declarations, said, model, prefix
        self._begun: set[str] = set()

    def __getattr__(self, name: str) -> Any:
        kinds = kinds_of(self._gains)
        if name not in kinds:
            raise AttributeError(f"{self._gains.__name__} has no field {name!r}")
        if name in self._begun:
            raise TypeError(f"{self._gains.__name__}.{name}: its default depends on itself")
        self._begun.add(name)
        path = f"{self._prefix}{name}"
        declaration, said = self._declarations.get(path), self._said.values.get(path)
        if declaration is None:
            value: object = Undecided(kinds[name], self._declarations, self._said, self._model, f"{path}.")
        elif said is None:
            value = declaration.decide(self, self._model, self._said.learning)
        else:
            value = cast(Gain, declaration).shaped(said)
        setattr(self, name, value)
        return value

    def decided(self) -> Any:
        """All of them, as the law takes them."""
        values = {name: getattr(self, name) for name in self._gains._fields}  # type: ignore[attr-defined]
        return self._gains(**{name: one.decided() if isinstance(one, Undecided) else one for name, one in values.items()})
