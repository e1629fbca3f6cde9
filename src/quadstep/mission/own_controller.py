"""A controller of the user's own in a mission: `type = "my_law.py:SuperTwisting"`, or the name of an installed entry point."""

import contextlib
import inspect
import math
from abc import abstractmethod
from collections.abc import Callable, Mapping
from numbers import Real
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Protocol

from pydantic import SerializeAsAny, WrapValidator
from pydantic_core import PydanticCustomError

from quadstep.control.opaque import opaque_law
from quadstep.control.rate_loop import following_rates
from quadstep.control.registry import controller, names
from quadstep.interfaces.controller import BodyRates, Command, Controller, Measured, RotorSpeeds, RotorThrusts
from quadstep.interfaces.gain import Gain, declared
from quadstep.interfaces.plant import Model
from quadstep.io.doors import CONTROLLERS, Door, own_place
from quadstep.io.errors import UserError, shorten, unknown_name
from quadstep.io.places import Place
from quadstep.io.user_code import blamed, check_callable, load, user_error
from quadstep.mission.derived import ControllerSection, section_of
from quadstep.mission.own_thing import check_gain, or_own, unknown_type
from quadstep.vehicle.paper import State

if TYPE_CHECKING:
    from quadstep.engines.fly import FlightPlan

SECTION = "quadstep.bridges.autopilots:AutopilotSection"
AUTOPILOTS = Door("quadstep.autopilots", {"px4": SECTION, "ardupilot": SECTION, "betaflight": SECTION})
"""Classes of `PilotedSection` by the `type` in [controller]."""

FIRST_WAIT = 60.0
"""How long an autopilot may take to connect [s]."""


class Matching(Protocol):
    """What an autopilot must be told of the vehicle that it flies. note: what that does not settle; may be empty."""

    @property
    def file(self) -> str: ...

    @property
    def note(self) -> str: ...

    def sentence(self) -> str: ...

    def text(self) -> str:
        """The content of `file`, in the autopilot's own format."""
        ...


class PilotedSection(ControllerSection):
    """The table of an autopilot. connect: where it is listened for."""

    connect: str = ""

    @abstractmethod
    def matching(self, plan: "FlightPlan") -> Matching:
        """What the autopilot must be told of the plan's vehicle."""

    @abstractmethod
    def watch(self, say: Callable[[str], None], first_wait: float) -> None:
        """Tells what the next flight waits for; it waits so long for an autopilot to appear [s]. Its user leads it."""

    def lead(self, plan: "FlightPlan", model: Model, where: str, say: Callable[[str], None]) -> None:
        """Leads the next flight instead of its user: arms, takes off, sends the plan's path. model: of its vehicle. where: it
        is reached; empty: where it usually is. say: of what the user should know. Raises UserError where it cannot.
        """
        raise UserError("--pilot: is not supported with this autopilot")


def piloted_section(name: str) -> type[PilotedSection]:
    """The table of an autopilot. Raises UserError."""
    found = AUTOPILOTS.load(name)
    if not (isinstance(found, type) and issubclass(found, PilotedSection)):
        raise UserError(f"{name}: the object registered for {AUTOPILOTS.group} should be a subclass of PilotedSection")
    return found


ALSO_MEASURED = ("specific_force", "rotor_speeds", "age", "noise")
"""What a controller of a real vehicle may ask for beside its motion."""

COMMANDS = (BodyRates, RotorThrusts, RotorSpeeds)
"""What it may command instead of thrust and torque."""

MOST_AHEAD, MOST_PREVIEWED = 60.0, 200
"""Of the path ahead [s], and of samples of it."""

RESERVED = ("type", "nets")
"""Keys of every controller's table."""


def law_named(kind: str, measures: type, folder: Path) -> type[Controller] | None:
    """The controller of this `type`, the package's or the user's; None where there is none, of which others will tell."""
    with contextlib.suppress(UserError):
        own = own_section(kind, measures, folder)
        return own.controller if own else controller(measures, kind)
    return None


def own_section(kind: str, measures: type, folder: Path) -> type[ControllerSection] | None:
    """The table of a controller of the user's own; None where `kind` names none. Raises UserError.

    measures: what the vehicle tells its controllers. folder: the mission's.
    """
    found = own_place(kind, CONTROLLERS)
    if found is None:
        return None
    law = as_controller(load(found, folder), found, measures)
    if not isinstance(law.measures, type):
        raise UserError(f"{kind}: measures: should be a class, such as Measured or State, not {law.measures!r:.60}")
    if law.measures is not measures:
        raise UserError(
            f"{kind}: is written for a vehicle that provides a {law.measures.__name__}; this one provides a "
            f"{measures.__name__}"
        )
    try:
        check_declared(law)
        return section_of(following_rates(law), kind)
    except Exception as error:
        if blamed(error):
            raise user_error(error) from error
        raise UserError(f"{kind}: {error}") from error


def as_controller(thing: object, place: Place, measures: type) -> type[Controller]:
    """A class of controllers; a function of time, measurement and reference becomes one. Raises UserError."""
    if inspect.isclass(thing) and issubclass(thing, Controller):
        if thing.law is Controller.law:
            raise UserError(f"{place.text}: has no method `law`")
        if not hasattr(thing, "Gains"):
            raise UserError(f"{place.text}: has no `Gains`, the NamedTuple of its declared gains")
        return thing
    if callable(thing) and not inspect.isclass(thing):
        if measures not in (Measured, State):
            said = "a function flies a real vehicle or the paper's plant; this vehicle needs a Controller"
            raise UserError(f"{place.text}: {said}")
        check_callable(place.name, thing, ("t", "measured", "reference"), whose=f"{place.text}: ")
        return opaque_law(thing, place.name, measures)
    raise UserError(f"{place.text}: should be a subclass of quadstep.own.Controller, or a function")


def check_declared(law: type[Controller]) -> None:
    """Refuses declarations that no table can be made of. Raises TypeError or ValueError."""
    if not hasattr(law.Gains, "_fields"):
        raise TypeError(f"Gains: should be a NamedTuple, not {law.Gains!r:.60}")
    known = declared(law.Gains)
    for name in law.defaults:
        if name not in known:
            raise ValueError(f"defaults: {unknown_name('gain', name, known)}")
    if not isinstance(law.rates, Mapping):
        raise TypeError(f"rates: should be a dict of sample times, such as {{'law': 0.004}}, not {law.rates!r:.60}")
    for name, period in law.rates.items():
        if not callable(getattr(law, name, None)):
            raise TypeError(f"rates: {shorten(name)} should be `law`, `guide` or another method of the controller")
        if not isinstance(period, Real) or not 0.0 < period < math.inf:
            raise ValueError(f"rates: {name} should be a sample time above 0 s, not {period!r:.60}")
    check_methods(law)
    check_interface(law)
    for one in law.declarations().values():
        if isinstance(one, Gain):
            if one.key in RESERVED:
                raise ValueError(f"a gain cannot have the key {one.key!r:.60}; give it another by key=...")
            check_gain(one)


def check_methods(law: type[Controller]) -> None:
    """Refuses methods that cannot be called as the loop calls them. Raises UserError."""
    for name in {"start": None, "law": None, "prepare": None} | dict.fromkeys(law.rates):
        owner, *given = inspect.signature(getattr(Controller, name, Controller.guide)).parameters
        check_callable(name, getattr(object.__new__(law), name), given, [owner])


def check_interface(law: type[Controller]) -> None:
    """Refuses what a controller cannot be told, or cannot command. Raises TypeError or ValueError."""
    real = law.measures is Measured
    if isinstance(law.also_measures, str):
        raise TypeError(f"also_measures: should be a tuple of names, such as ('age',), not {law.also_measures!r:.60}")
    for name in law.also_measures:
        if not real or name not in ALSO_MEASURED:
            told = unknown_name("measurement", name, ALSO_MEASURED if real else ())
            raise ValueError(f"also_measures: {told}{'' if real else '; only real vehicles have further measurements'}")
    if law.commands is not Command and (not real or law.commands not in COMMANDS):
        allowed = ", ".join(one.__name__ for one in (Command, *COMMANDS) if real or one is Command)
        raise TypeError(f"commands: should be one of {allowed}, not {law.commands!r:.60}")
    for later in law.preview:
        if not isinstance(later, Real) or not 0.0 <= later <= MOST_AHEAD:
            raise ValueError(f"preview: should consist of times from 0 to {MOST_AHEAD:g} s, not {later!r:.60}")
    if len(law.preview) > MOST_PREVIEWED:
        raise ValueError(f"preview: at most {MOST_PREVIEWED} samples, not {len(law.preview)}")


def any_controller(measures: type) -> Any:
    """The table of a controller that is told such a measurement, the package's or one of the user's own. Its `type` decides
    the keys, and no other is loaded.
    """

    def table(kind: object, folder: Path) -> type[ControllerSection]:
        if isinstance(kind, str):
            law = controller(measures, kind)
            if law:
                return section_of(law)
            if measures is Measured and kind in AUTOPILOTS:
                return piloted_section(kind)
            own = own_section(kind, measures, folder)
            if own:
                return own
        flown_by = AUTOPILOTS.names if measures is Measured else ()
        raise unknown_type(kind, (*names(measures), *flown_by), CONTROLLERS)

    def refused(_: object) -> ControllerSection:
        raise PydanticCustomError("model_type", "not a table")

    def is_one(kind: type) -> bool:
        return issubclass(kind, ControllerSection) and kind.controller.measures is measures

    return Annotated[SerializeAsAny[ControllerSection], WrapValidator(or_own(is_one, table, refused))]
