"""The interfaces of a plant, of the air that it flies in, and of a path; what a controller is told of them: the vehicle's
model, from which default gains are computed, and the reference motion.
"""

import math
from collections.abc import Mapping
from enum import StrEnum
from typing import Any, NamedTuple, Protocol

from typing_extensions import TypeVar

from quadstep.interfaces.closed_loop import Clock
from quadstep.numbers import Number, Vector, vector

MARGIN = 0.85
"""Share of all rotors' thrust that a position loop may ask for; the rest is for turning."""


class Kinematics(StrEnum):
    """Which T_eta is meant. They differ only where the inertias are unequal.

    STANDARD: rows 2 and 3 hold theta and roll, as Newton-Euler demands for R = Rz(psi) Ry(theta) Rx(phi).
    PRINTED: they hold theta and yaw, as the paper prints.
    RIGID: of R = Rx(-phi) Ry(-theta) Rz(-psi), to which the paper's thrust direction (Eq. 7) belongs: with it, and only with
    it, the whole plant is a rigid body pushed along its own z axis. Holds theta and yaw.
    """

    STANDARD = "standard"
    PRINTED = "printed"
    RIGID = "rigid"

    @property
    def angle(self) -> int:
        """Place in eta = (psi, theta, phi) of the angle that T_eta holds beside theta."""
        return 2 if self is Kinematics.STANDARD else 0


class Model(NamedTuple):
    """A vehicle as its controller models it; SI units.

    mass [kg], inertia: diagonal [kg m^2], gravity [m/s^2]. most_thrust: the largest that a position loop may command [N];
    infinite if the rotors have no limits. agility: speed of the loops relative to the 2.6 kg vehicle, in (0, 1];
    rate_agility: of that of the body rates within them; yaw_agility: of the loop of the heading. rotors: their number.
    lag: the longer time constant of a rotor [s]. kinematics: T_eta of the paper's plant; that of a rigid body elsewhere.

    Of a real vehicle also: mixing: four rows, thrust [N] and torques about body x, y, z [N m] per newton of each rotor.
    shares: a row for each rotor, its thrust per unit of thrust and torques, of least norm. per_speed: k_f, a rotor's thrust
    over the square of its speed [N s^2]. slowest, fastest: of a rotor [rad/s]. drag: of all rotors as they turn in hover,
    along body x, y, z, over mass [1/s]. lift: the thrust that they gain by moving across the air, over mass and the square
    of the speed [1/m].
    """

    mass: Number
    inertia: Vector
    gravity: Number
    most_thrust: Number = math.inf
    agility: Number = 1.0
    rate_agility: Number = 1.0
    yaw_agility: Number = 1.0
    rotors: int = 4
    lag: Number = 0.0
    kinematics: Kinematics = Kinematics.RIGID
    mixing: tuple[Vector, ...] = ()
    shares: tuple[Vector, ...] = ()
    per_speed: Number = math.nan
    slowest: Number = math.nan
    fastest: Number = math.nan
    drag: Vector = vector(0.0, 0.0, 0.0)
    lift: Number = 0.0


class Reference(NamedTuple):
    """The reference motion at an instant, in the world frame, z up.

    position [m]: xi_d, world, z up. velocity [m/s]: xi_d_dot. acceleration [m/s^2]: xi_d_dd.
    yaw [rad]: psi_d, not wrapped. yaw_rate [rad/s]: psi_d_dot.
    jerk [m/s^3]: rate of the acceleration; zero if unknown. snap [m/s^4]: rate of the jerk; zero if unknown.
    yaw_acceleration [rad/s^2]: psi_d_dd; zero if unknown. Vectors have length 3.
    ahead: the same at the later times for which the law asks (`preview`); paths leave it empty.

    >>> from quadstep.interfaces.plant import Reference
    >>> from quadstep.numbers import vector
    >>> hover = Reference(vector(0.0, 0.0, 2.0), vector(0.0, 0.0, 0.0), vector(0.0, 0.0, 0.0), yaw=0.0, yaw_rate=0.0)
    >>> hover.position, hover.jerk
    (Vector([0.0, 0.0, 2.0]), Vector([0.0, 0.0, 0.0]))
    """

    position: Vector
    velocity: Vector
    acceleration: Vector
    yaw: Number
    yaw_rate: Number
    jerk: Vector = vector(0.0, 0.0, 0.0)
    snap: Vector = vector(0.0, 0.0, 0.0)
    yaw_acceleration: Number = 0.0
    ahead: "tuple[Reference, ...]" = ()


class PathLaw(Protocol):
    """A path as a law over numbers. Its numbers live in `parameters`; the law itself holds only structure and is hashable.

    >>> from dataclasses import dataclass
    >>> from quadstep.interfaces.plant import Reference
    >>> from quadstep.numbers import vector
    >>> @dataclass(frozen=True)
    ... class Climb:  # parameters: the speed [m/s]
    ...     def reference(self, t, parameters):
    ...         rest = vector(0.0, 0.0, 0.0)
    ...         return Reference(vector(0.0, 0.0, parameters * t), vector(0.0, 0.0, parameters), rest, 0.0, 0.0)
    >>> Climb().reference(2.0, 0.5).position
    Vector([0.0, 0.0, 1.0])
    """

    def reference(self, t: Number, parameters: Any) -> Reference:
        """The reference motion at time t [s] after the start."""
        ...


class Rotor(NamedTuple):
    """A rotor as it is drawn: place in body axes [m], sense (1: counter-clockwise), column of its thrust."""

    position: tuple[float, float, float]
    spin: int
    column: str | None = None


class Drawn(NamedTuple):
    """How a vehicle is drawn. thrust, attitude: columns, three for the paper's angles or four for a quaternion.

    ground: its height [m], radius: of a rotor [m], if the vehicle knows them.
    """

    rotors: tuple[Rotor, ...] = ()
    thrust: str | None = None
    attitude: tuple[str, ...] = ("psi", "theta", "phi")
    ground: float | None = None
    radius: float | None = None


class Body(Protocol):
    """A vehicle's mass [kg], its inertia about each axis [kg m^2] and gravity [m/s^2]."""

    @property
    def mass(self) -> Number: ...

    @property
    def inertia(self) -> Vector: ...

    @property
    def gravity(self) -> Number: ...


P_contra = TypeVar("P_contra", contravariant=True, default=Any)
X = TypeVar("X", default=Any)
C_contra = TypeVar("C_contra", contravariant=True, default=Any)
U = TypeVar("U", default=Any)
H = TypeVar("H", default=Any)
K = TypeVar("K", default=Any)
Y = TypeVar("Y", default=Any)
A = TypeVar("A", default=Any)
"""P: a plant's parameters; X: its state; C: the commands that it takes, of one form or several; U: a command as it is logged;
H: what its actuators are told; K: what perfect sensors would measure; Y: what its controller gets to know. A: the state of air
that moves.
"""


class Plant(Protocol[P_contra, X, C_contra, U, H, K, Y]):
    """A vehicle as laws over numbers. Structure only, hashable; its numbers are in the flight's parameters `p`.

    State, actuators (`held`: their inputs until the next sample) and parameters are the plant's own NamedTuples.
    """

    @property
    def compact(self) -> bool:
        """Whether the compiler emits the derivative as one function that a step calls four times."""
        ...

    @property
    def columns(self) -> Mapping[str, str]:
        """Name and unit of every logged column, in the order of `row`."""
        ...

    @property
    def axes(self) -> tuple[str, ...]:
        """Columns of the position; those of the desired position have the suffix _d, its error is `error`."""
        ...

    @property
    def efforts(self) -> Mapping[str, str]:
        """Name and unit of each entry of `inputs`, as used by metrics."""
        ...

    @property
    def norms(self) -> tuple[str, ...]:
        """Name of each entry of `weight_norms`."""
        ...

    def body(self, p: P_contra) -> Body:
        """The part of the parameters with the vehicle's mass [kg], inertia [kg m^2] and gravity [m/s^2]."""
        ...

    def rest(self, state: X, p: P_contra) -> tuple[U, H]:
        """The command and the actuators before the first sample."""
        ...

    def truth(self, state: X) -> K:
        """The motion that perfect sensors would measure."""
        ...

    def specific_force(self, p: P_contra, state: X, rate: X) -> Vector:
        """What an accelerometer measures [m/s^2], body axes. rate: of the state. Used only with an estimator."""
        ...

    def measurement(self, known: K, held: H) -> Y:
        """What the controller measures: the motion, and the actuators' inputs."""
        ...

    def rotor_speeds(self, state: X) -> Vector:
        """The rotor speeds [rad/s]; used only by a law that measures them."""
        ...

    def full_speed(self, state: X, p: P_contra) -> Number:
        """Of a rotor at full output [rad/s]; used only by a law that measures it."""
        ...

    def logged_command(self, p: P_contra, command: C_contra) -> U:
        """A law's command as it is logged: without limits, and in one form, whatever forms the plant accepts."""
        ...

    def actuate(self, p: P_contra, command: C_contra) -> H:
        """The actuators' inputs for a command, within their limits."""
        ...

    def rate(self, p: P_contra, state: X, held: H, wind: Vector, time: Number) -> X:
        """Rate of every state. wind [m/s]: world axes."""
        ...

    def projected(self, state: X) -> X:
        """The state after a step, projected back onto its manifold."""
        ...

    def outcome(self, p: P_contra, state: X, command: U, reference: Reference) -> Number:
        """The `Outcome` that ends the flight at a sample, or 0; a non-finite number takes precedence.

        command: before limits, since a limit would hide NaN.
        """
        ...

    def error(self, state: X, reference: Reference) -> Vector:
        """The desired position less the true one [m], along the plant's axes."""
        ...

    def inputs(self, held: H) -> Vector:
        """The actuators' inputs, as metrics sum them."""
        ...

    def weight_norms(self, command: U) -> Vector:
        """Norms of the weights that a law has learned, as its command reports them."""
        ...

    def drawing(self, p: P_contra) -> Drawn:
        """How the vehicle is drawn."""
        ...

    def row(
        self, p: P_contra, state: X, told: Y, command: U, held: H, reference: Reference, wind: Vector,
        time: Number,
    ) -> list[Number]:  # fmt: skip
        """One row of the log, in the order of `columns`."""
        ...


class Air(Protocol[A, P_contra]):
    """Moving air. Its numbers are `p.wind`, the key of its noise `p.key`."""

    @property
    def stirs(self) -> bool:
        """Whether it has a state that persists from step to step."""
        ...

    def start(self) -> A:
        """Its state before the first tick."""
        ...

    def stir(self, air: A, p: P_contra, clock: Clock) -> A:
        """Its state one period later."""
        ...

    def wind(self, air: A, p: P_contra, time: Number, truth: object) -> Vector:
        """The wind [m/s] at time t [s], world axes, where the vehicle is. truth: as `Plant.truth`."""
        ...
