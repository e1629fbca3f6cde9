"""What a controller is: one sampled law over numbers, and what is known of it.

To add one, write a frozen dataclass that subclasses `Controller`, a `NamedTuple` of declared gains (`control/gain.py`) and a
`NamedTuple` of memory. It then flies on every engine. See "Add a controller" in the README.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple, Self

from quadstep.control.gain import Declaration, Gain, Said, Undecided, declared, kept, with_defaults
from quadstep.control.learning import Learning
from quadstep.control.model import Model
from quadstep.guidance.reference import Reference
from quadstep.numbers import Number, Structure, Vector, vector
from quadstep.numbers.noise import Key

NOT_SAID = vector(math.nan, math.nan, math.nan)
"""Of a command that names no attitude: the log has no columns for it, and nothing is made of them."""

NOTHING = vector()
"""Of what is not measured."""

NO_KEY = Key(NOTHING)


class Command(NamedTuple):
    """What a controller asks for, held until its next sample, and internal signals for the log.

    thrust: u [N]. torque [N m]: on the paper's plant (tau_psi, tau_theta, tau_phi), generalised; on an airframe about its
    body axes. The rest is only logged: desired_attitude: (psi_d, theta_d, phi_d), on an airframe (yaw, pitch, roll),
    right-handed [rad], left out by a law that has none in mind; r1 [m/s] and r2 [rad/s], the filtered errors; stored: the
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
    """What a controller of an airframe gets to know, measured or estimated.

    position [m], velocity [m/s]: world, z up. attitude: unit quaternion (w, x, y, z), body to world. rates: about the body's
    axes [rad/s]. thrust [N], torque [N m]: what the rotors were asked for since the last sample, after their limits.

    The rest only for a law that names it in `also_measures`. specific_force: the accelerometer's last sample, body axes
    [m/s^2], less its estimated bias where there is an estimator. rotor_speeds: as they turn now [rad/s]. age: how old what is
    told of position and velocity is [s]. noise: what a law draws its own random numbers by (`numbers/noise.py`): the flight's
    key, so that they are the flight's own whatever batch or engine it is flown in.
    """

    position: Vector
    velocity: Vector
    attitude: Vector
    rates: Vector
    thrust: Number
    torque: Vector
    specific_force: Vector = NOTHING
    rotor_speeds: Vector = NOTHING
    age: Number = math.nan
    noise: Key = NO_KEY


class Condition(NamedTuple):
    """What theory asks of the gains: left > right, or left >= right where `text` says so.

    text: in symbols, as "K_r1 (x) > m Lambda1". source: what asks for it. key: of the mission, where that is not the symbol
    on the left. warned: whether a mission that breaks it is warned, and a search keeps to it.
    """

    text: str
    left: Number
    right: Number
    source: str
    key: str = ""
    warned: bool = True

    @property
    def or_equal(self) -> bool:
        """Whether equality is enough."""
        return " >= " in self.text

    @property
    def holds(self) -> bool:
        """Whether it holds; an array of answers for numbers that are arrays."""
        return self.left >= self.right if self.or_equal else self.left > self.right

    def warning(self) -> str:
        """That it is broken, with its numbers."""
        left, right = self.text.split(" >= " if self.or_equal else " > ")
        key = f"{self.key}: {left}" if self.key else left
        relation = "below" if self.or_equal else "not above"
        return f"controller.{key} = {self.left:g} is {relation} {right} = {self.right:g} (condition of {self.source})"


@dataclass(frozen=True)
class Controller:
    """A sampled law. Its numbers live in the gains; the object itself holds only structure and is hashable.

    name: the `type` in mission files. label: on the page and in tables. source: the paper. Gains: its `NamedTuple` of declared
    gains. defaults: other defaults than those declared, by field. measures: what `law` is told, and with it what the
    controller flies: a `Measured` of a real vehicle, or a `State` of the paper's plant. also_measures: further fields of
    `Measured` that it needs; what is not named is neither measured nor computed. commands: what `law` gives, one of those in
    `control/commands.py` on a real vehicle. preview: how far ahead [s] the samples of `reference.ahead` are.

    rates: usual sample times [s] of `law` and of each slower loop, a method with the signature of `guide` and any name; those
    that are due run in this order, and `law` last. one_at_a_time: whether its flights are flown singly, each announced by
    `before_flight`, because something outside the program takes part.
    """

    name: ClassVar[str] = ""
    label: ClassVar[str] = ""
    source: ClassVar[str] = ""
    Gains: ClassVar[type]
    defaults: ClassVar[Mapping[str, object]] = {}
    measures: ClassVar[type] = Measured
    also_measures: ClassVar[tuple[str, ...]] = ()
    commands: ClassVar[type] = Command
    preview: ClassVar[tuple[float, ...]] = ()
    rates: ClassVar[Mapping[str, float]] = {"guide": 0.01, "law": 0.002}
    one_at_a_time: ClassVar[bool] = False

    @classmethod
    def for_vehicle(cls, model: Model) -> Self:  # noqa: ARG003 (others need it)
        """The law for a vehicle, where its structure depends on it."""
        return cls()

    def start(self, measured: Structure, gains: Structure) -> Structure:
        """The memory before the first sample."""
        return ()

    def guide(
        self, memory: Structure, measured: Structure, reference: Reference, gains: Structure, t: Number, period: Number
    ) -> Structure:
        """The position loop, every `period` [s]: the memory that tells `law` which thrust and attitude are wanted."""
        return memory

    def slower(
        self,
        loop: str,
        memory: Structure,
        measured: Structure,
        reference: Reference,
        gains: Structure,
        t: Number,
        period: Number,
    ) -> Structure:
        """A sample of one of its `loops`, `guide` or another: the memory after it."""
        return getattr(self, loop)(memory, measured, reference, gains, t, period)

    def law(
        self, memory: Structure, measured: Structure, reference: Reference, gains: Structure, t: Number, period: Number
    ) -> tuple[Structure, Structure]:
        """The command for the next `period` [s] from time t [s] on, and the memory for the sample after it.

        The command is a `Command`, or what another plant takes.
        """
        raise NotImplementedError

    def prepare(self, gains: Structure, model: Model) -> Structure:
        """What the law gets as its gains, worked out before the flight."""
        return gains

    @property
    def alone(self) -> "Controller":
        """Its law, without what it was given beside."""
        return self

    def instead(self, other: "Controller") -> "Controller":
        """Another controller in its place, with what this one was given beside its law."""
        return other

    def before_flight(self, measured: Structure, gains: Structure) -> None:
        """Called before each flight of one that flies one at a time. measured: at its start. Raises UserError."""

    def landed(self, gains: Structure) -> None:
        """Called after its flights; raises what kept it from giving a command, if it is no law over numbers."""

    def why_lost(self, gains: Structure) -> str:
        """Why its last flight ended early, where something outside the program was to blame; else empty."""
        return ""

    def conditions(self, gains: Structure, model: Model) -> Sequence[Condition]:
        """What theory asks of the gains as declared; a law over numbers."""
        return ()

    # What follows from the declarations

    @classmethod
    def loops(cls) -> tuple[str, ...]:
        """Names of the slower loops that it has, in the order in which those run that are due together."""
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
        """The gains for a vehicle, decided as they are read. values: what is said of them, by key; learning: of the nets."""
        said = {} if values is None else {name: values.get(key) for key, (name, _) in cls.by_key().items()}
        return Undecided(cls.Gains, cls.declarations(), Said(said, learning), model)

    @classmethod
    def gains(cls, model: Model, values: Mapping[str, object] | None = None, learning: Learning | None = None) -> Any:
        """The gains for a vehicle, as declared."""
        return cls.undecided(model, values, learning).decided()


@kept
def declarations_of(controller: type[Controller]) -> Mapping[str, Declaration]:
    """Those of its gains, with the controller's own defaults."""
    return with_defaults(declared(controller.Gains), controller.defaults)


@kept
def keys_of(controller: type[Controller]) -> Mapping[str, tuple[str, Gain]]:
    """By key: field and declaration."""
    return {one.key: (name, one) for name, one in declarations_of(controller).items() if isinstance(one, Gain)}
