"""The controller interface: one sampled law over numbers, and its declarations.

To add one, write a frozen dataclass that subclasses `Controller`, a `NamedTuple` of declared gains (`gain.py`) and a
`NamedTuple` of memory. It then flies on every engine. See docs/own.md.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import Any, ClassVar, Generic, NamedTuple, Self, cast

from typing_extensions import TypeVar

from quadstep.interfaces.gain import Declaration, Gain, StatedGains, Undecided, cached_by_class, declared, with_defaults
from quadstep.interfaces.learning import Learning
from quadstep.interfaces.plant import Model, Reference, U, Y
from quadstep.numbers import Number, Vector, vector, where
from quadstep.numbers.noise import Key

NOT_SAID = vector(math.nan, math.nan, math.nan)
"""Desired attitude of a command without one: the log then has no columns, metrics or plots for it."""

NOTHING = vector()
"""Value of a quantity that is not measured."""

NO_KEY = Key(NOTHING)

M = TypeVar("M", default=Any)
"""The memory of a law: a `NamedTuple`, or () if it remembers nothing."""

G = TypeVar("G", default=Any)
"""The gains of a law."""


class Command(NamedTuple):
    """The output of a controller, held until its next sample, and internal signals for the log.

    thrust [N]: u, along the body's z. torque [N m]: on the paper's plant (tau_psi, tau_theta, tau_phi), generalised; on an
    airframe about its body axes. The rest is only logged. desired_attitude: (psi_d, theta_d, phi_d), on an airframe (yaw,
    pitch, roll), right-handed [rad], omitted by a law that has none; r1 [m/s] and r2 [rad/s], the filtered errors; stored: the
    integral terms of Eq. 55; weight_norms: Frobenius norms of both nets' weights.
    """

    thrust: Number
    torque: Vector
    desired_attitude: Vector = NOT_SAID
    r1: Vector = vector(0.0, 0.0, 0.0)
    r2: Vector = vector(0.0, 0.0, 0.0)
    stored: Number = 0.0
    weight_norms: Vector = vector(0.0, 0.0)


class Measured(NamedTuple):
    """The inputs of a controller of a real vehicle, measured or estimated.

    position [m]: world, z up. velocity [m/s]: world. attitude: unit quaternion (w, x, y, z), body to world. rates [rad/s]:
    about the body's axes: x ahead, y left, z up. thrust [N], torque [N m]: commanded to the rotors since the last sample,
    within their limits.

    The other fields are only for a law that names them in `also_measures`. specific_force [m/s^2]: the last accelerometer
    sample in body axes, minus its estimated bias if there is an estimator. rotor_speeds [rad/s]: the current ones. full_speed:
    of a rotor at full output, at the battery's present voltage [rad/s]. age: of position and velocity [s]. noise: the
    flight's key for random numbers of the law (`numbers/noise.py`), so that they belong to the flight whatever batch or
    engine it is flown in.
    """

    position: Vector
    velocity: Vector
    attitude: Vector
    rates: Vector
    thrust: Number
    torque: Vector
    specific_force: Vector = NOTHING
    rotor_speeds: Vector = NOTHING
    full_speed: Number = math.nan
    age: Number = math.nan
    noise: Key = NO_KEY


class Condition(NamedTuple):
    """A condition of the theory on the gains: left > right, or left >= right if `text` says so.

    text: in symbols, as "K_r1 (x) > m Lambda1". source: where it comes from. key: the mission's key, if it is not the symbol
    on the left. warned: whether a violation gives a warning, and whether a search respects it. unit: of both sides.
    """

    text: str
    left: Number
    right: Number
    source: str
    key: str = ""
    warned: bool = True
    unit: str = ""

    @property
    def or_equal(self) -> bool:
        """Whether equality is enough."""
        return " >= " in self.text

    @property
    def holds(self) -> bool:
        """Whether it holds; an array for numbers that are arrays."""
        return self.left >= self.right if self.or_equal else self.left > self.right

    def warning(self) -> str:
        """The warning about its violation, with the numbers."""
        left, right = self.text.split(" >= " if self.or_equal else " > ")
        key = f"{self.key}: {left}" if self.key else left
        table = "" if set(key) & set("^*/+") else "controller."  # a formula is no key
        relation = "below" if self.or_equal else "not above"
        return f"{table}{key} = {self.left:g} is {relation} {right} = {self.right:g} (condition of {self.source})"


@dataclass(frozen=True)
class Controller(Generic[M, Y, G, U]):
    """A sampled law. Its numbers live in the gains; the object itself holds only structure and is hashable.

    name: the `type` in mission files. label: on the page and in tables. source: the paper. off_command: why the attitude
    stays off the desired attitude of its `Command` in moving air, "" if it does not. theorem: whether it is the law that the
    paper's Theorem 5.1 is about, which `certify` takes; a law derived from that is not. Gains: its `NamedTuple` of declared
    gains. defaults: defaults that differ from those declared, by field. measures: the type of the law's input, which also
    decides what the controller flies: a `Measured` of a real vehicle, or a `State` of the paper's plant. also_measures:
    further fields of `Measured` that it needs; other fields are neither measured nor computed. commands: the type that `law`
    returns, one of those in `interfaces/controller.py` on a real vehicle. preview: times ahead [s] of the samples in
    `reference.ahead`.

    rates: default sample times [s] of `law` and of each slower loop, a method with the signature of `guide` and any name;
    loops that are due run in this order, and `law` last. one_at_a_time: whether its flights are flown singly, each announced
    by `before_flight`, because something outside the program takes part. parameter_file: the format (`io/parameter_files.py`)
    in which the autopilot keeps its parameters; unmodelled: those of the law's own groups that it does without; supported: the
    values with which it flies, of those that choose another frame or another law; renamed: names in files of other releases,
    and which of its parameters that is; ordered: what must hold of two of them unless one is 0, as "MPC_THR_MIN <=
    MPC_THR_MAX".
    """

    name: ClassVar[str] = ""
    label: ClassVar[str] = ""
    source: ClassVar[str] = ""
    off_command: ClassVar[str] = ""
    theorem: ClassVar[bool] = False
    Gains: ClassVar[type]
    defaults: ClassVar[Mapping[str, object]] = {}
    measures: ClassVar[type] = Measured
    also_measures: ClassVar[tuple[str, ...]] = ()
    commands: ClassVar[type] = Command
    preview: ClassVar[tuple[float, ...]] = ()
    rates: ClassVar[Mapping[str, float]] = {"guide": 0.01, "law": 0.002}
    one_at_a_time: ClassVar[bool] = False
    parameter_file: ClassVar[str] = ""
    unmodelled: ClassVar[tuple[str, ...]] = ()
    supported: ClassVar[Mapping[str, tuple[float, ...]]] = {}
    renamed: ClassVar[Mapping[str, str]] = {}
    ordered: ClassVar[tuple[str, ...]] = ()

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        cls.theorem = "theorem" in vars(cls) and cls.theorem

    @classmethod
    def for_vehicle(cls, model: Model) -> Self:  # noqa: ARG003 (others need it)
        """The law for a vehicle, if its structure depends on the vehicle."""
        return cls()

    def start(self, measured: Y, gains: G) -> M:
        """The memory before the first sample."""
        return cast(M, ())

    def enter(self, measured: Y, reference: Reference, gains: G) -> M:
        """The memory with which it takes over in flight: asked for the present motion, it would command the thrust and torque
        of `measured`, which another law commands now. reference: the present motion. A law without such a memory starts.
        """
        return self.start(measured, gains)

    def guide(self, memory: M, measured: Y, reference: Reference, gains: G, t: Number, period: Number) -> M:
        """The position loop, every `period` [s]: returns the memory with the desired thrust and attitude for `law`."""
        return memory

    def slower(
        self, loop: str, memory: M, measured: Y, reference: Reference, gains: G, t: Number, period: Number,
    ) -> M:  # fmt: skip
        """One sample of one of its `loops`, `guide` or another: returns the new memory."""
        return cast(M, getattr(self, loop)(memory, measured, reference, gains, t, period))

    def law(self, memory: M, measured: Y, reference: Reference, gains: G, t: Number, period: Number) -> tuple[U, M]:
        """The new memory, and the command for the next `period` [s] from time t [s] on.

        The command is a `Command`, or the command type of another plant.
        """
        raise NotImplementedError

    def prepare(self, gains: G, model: Model) -> G:
        """The gains passed to the law, computed before the flight."""
        return gains

    @property
    def unwrapped(self) -> "Controller":
        """Its law alone, without wrappers."""
        return self

    def instead(self, other: "Controller") -> "Controller":
        """Another controller in its place, with the wrappers of this one."""
        return other

    def before_flight(self, measured: Y, gains: G) -> None:
        """Called before each flight of a controller with `one_at_a_time`. measured: at its start. Raises UserError."""

    def after_flight(self, gains: G) -> None:
        """Called after its flights; raises the error of a Python function that failed to return a command."""

    def why_lost(self, gains: G) -> str:
        """Why its last flight ended early, if something outside the program was the cause; else empty."""
        return ""

    def conditions(self, gains: G, model: Model) -> Sequence[Condition]:
        """The theory's conditions on the declared gains, or the order of its parameters (`ordered`); a law over numbers."""
        return [in_order(text, gains, type(self)) for text in self.ordered]

    # What follows from the declarations

    @classmethod
    def loops(cls) -> tuple[str, ...]:
        """Names of its slower loops, in the order in which they run when due together."""
        named = dict.fromkeys((*cls.rates, "guide"))
        return tuple(name for name in named if name != "law" and getattr(cls, name) is not getattr(Controller, name, None))

    @classmethod
    def declarations(cls) -> Mapping[str, Declaration]:
        """The declaration of every field of the gains, by dotted name."""
        return declarations_of(cls)

    @classmethod
    def by_key(cls) -> Mapping[str, tuple[str, Gain]]:
        """By key of a mission: the dotted field and its declaration."""
        return keys_of(cls)

    @classmethod
    def undecided(
        cls, model: Model, values: Mapping[str, object] | None = None, learning: Learning | None = None
    ) -> Undecided:
        """The gains for a vehicle, evaluated when read. values: given values, by key; learning: settings of the nets."""
        said = {} if values is None else {name: values.get(key) for key, (name, _) in cls.by_key().items()}
        return Undecided(cls.Gains, cls.declarations(), StatedGains(said, learning), model)

    @classmethod
    def gains(cls, model: Model, values: Mapping[str, object] | None = None, learning: Learning | None = None) -> Any:
        """The gains for a vehicle, as declared."""
        return cls.undecided(model, values, learning).decided()


@cached_by_class
def declarations_of(controller: type[Controller]) -> Mapping[str, Declaration]:
    """Those of its gains, with the controller's own defaults."""
    return with_defaults(declared(controller.Gains), controller.defaults)


@cached_by_class
def keys_of(controller: type[Controller]) -> Mapping[str, tuple[str, Gain]]:
    return {one.key: (name, one) for name, one in declarations_of(controller).items() if isinstance(one, Gain)}


class BodyRates(NamedTuple):
    """Collective thrust [N] and body rates [rad/s], which the rate loop of `control/rate_loop.py` turns into torques.

    desired_attitude: as in `Command`.
    """

    thrust: Number
    rates: Vector
    desired_attitude: Vector = NOT_SAID


class RotorThrusts(NamedTuple):
    """thrusts [N]: of every rotor, in the order of the vehicle's rotors; each is clipped to its limits."""

    thrusts: Vector
    desired_attitude: Vector = NOT_SAID


class RotorSpeeds(NamedTuple):
    """speeds [rad/s]: of every rotor, in the order of the vehicle's rotors; each is clipped to its limits."""

    speeds: Vector
    desired_attitude: Vector = NOT_SAID


def in_order(text: str, gains: object, law: type[Controller]) -> Condition:
    """One of `Controller.ordered` as a condition: it holds where the greater of the two is 0, which switches something off."""
    lower, relation, upper = text.split()
    least, most = (cast(Number, attrgetter(law.by_key()[key][0])(gains)) for key in (lower, upper))
    sign = ">=" if relation == "<=" else ">"
    return Condition(f"{upper} {sign} {lower}", most, where(most > 0.0, least, -1.0), law.source)
