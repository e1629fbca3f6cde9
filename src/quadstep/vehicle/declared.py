"""A plant in one file, the package's or a user's, with all its declarations.

Its numbers and limits are `NamedTuple`s of declarations (`gain.py`), from which the tables `[vehicle]` and `[limits]`
of its missions follow, and the page's sliders. `planar.py` is an example. Where it sets `windy`, its missions have a wind,
which `rate` is given; there are no sensors: its controllers are told the state.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Generic, NamedTuple

from typing_extensions import TypeVar

from quadstep.interfaces.plant import Drawn, H, Model, Reference, U, X
from quadstep.numbers import Number, Vector

N = TypeVar("N", default=Any)
"""The numbers of a vehicle."""

L = TypeVar("L", default=Any)
"""Its limits."""


class PlantParameters(NamedTuple, Generic[N, L]):
    """Every number of a flight: vehicle as its plant declares it, limits likewise. wind: of its air, () where there is none.
    key: of the air's noise, likewise.
    """

    vehicle: N
    path: object
    gains: object
    limits: L
    wind: object = ()
    key: object = ()


@dataclass(frozen=True)
class DeclaredPlant(ABC, Generic[N, L, X, U, H]):
    """A `Plant`; structure only, so it has no fields unless the structure of its equations varies.

    name: the `type` in [vehicle]. Numbers, Limits: declared. measures: its state, which is what controllers are told.
    columns, axes, efforts, norms: see `Plant`; efforts are columns too. windy: whether air acts on it.
    """

    name: ClassVar[str]
    label: ClassVar[str] = ""
    source: ClassVar[str] = ""
    Numbers: ClassVar[type]
    Limits: ClassVar[type]
    measures: ClassVar[type]
    compact: ClassVar[bool] = True
    windy: ClassVar[bool] = False
    columns: ClassVar[Mapping[str, str]]
    axes: ClassVar[tuple[str, ...]]
    efforts: ClassVar[Mapping[str, str]]
    norms: ClassVar[tuple[str, ...]] = ()

    @abstractmethod
    def model(self, numbers: N) -> Model:
        """What the vehicle is to a controller."""

    @abstractmethod
    def begin(self, numbers: N, wanted: Reference) -> X:
        """The state at t = 0."""

    @abstractmethod
    def rest(self, state: X, p: PlantParameters[N, L]) -> tuple[U, H]:
        """The command and the actuators before the first sample."""

    @abstractmethod
    def actuate(self, p: PlantParameters[N, L], command: U) -> H:
        """What the actuators are told to make of a command, within their limits."""

    @abstractmethod
    def rate(self, p: PlantParameters[N, L], state: X, held: H, wind: Vector, time: Number) -> X:
        """Rate of every state."""

    @abstractmethod
    def outcome(self, p: PlantParameters[N, L], state: X, command: U, reference: Reference) -> Number:
        """The `Outcome` that ends the flight at a sample, 0 while all is well."""

    @abstractmethod
    def error(self, state: X, reference: Reference) -> Vector:
        """The wanted position less the true one [m], along `axes`."""

    @abstractmethod
    def inputs(self, held: H) -> Vector:
        """What the actuators are told, in the order of `efforts`."""

    @abstractmethod
    def row(
        self, p: PlantParameters[N, L], state: X, told: X, command: U, held: H,
        reference: Reference, wind: Vector, time: Number,
    ) -> list[Number]:  # fmt: skip
        """One row of the log, in the order of `columns`."""

    def drawing(self, p: PlantParameters[N, L]) -> Drawn:
        """How the page draws it: a small quadrotor, unless it says otherwise."""
        return Drawn()

    def body(self, p: PlantParameters[N, L]) -> Model:
        """mass, inertia and gravity among its numbers."""
        return self.model(p.vehicle)

    def truth(self, state: X) -> X:
        return state

    def specific_force(self, p: PlantParameters[N, L], state: X, rate: X) -> Vector:
        """Never asked: there is no estimator."""
        raise NotImplementedError

    def measurement(self, known: X, held: H) -> X:
        return known

    def rotor_speeds(self, state: X) -> Vector:
        """Never asked."""
        raise NotImplementedError

    def full_speed(self, state: X, p: PlantParameters[N, L]) -> Number:
        """Never asked."""
        raise NotImplementedError

    def logged_command(self, p: PlantParameters[N, L], command: U) -> U:
        return command

    def projected(self, state: X) -> X:
        return state

    def weight_norms(self, command: U) -> Vector:
        """Of no nets."""
        return Vector(())
