"""The kinds of controller a mission can name, and the law and gains of each. Defaults are the choices of the study."""

import math
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import BeforeValidator, Field, TypeAdapter

from quadstep.control.backstepping import FORCE_INPUTS, TORQUE_INPUTS, Backstepping, BacksteppingGains
from quadstep.control.completed_backstepping import CompletedBackstepping, CompletedGains
from quadstep.control.nested_saturation import NestedSaturation, NestedSaturationGains
from quadstep.control.networks import Net, random_input_weights
from quadstep.documents import read_json
from quadstep.errors import UserError
from quadstep.mission.fields import (
    Finite,
    NonNegative,
    NonNegativeDiagonal,
    Positive,
    PositiveDiagonal,
    Section,
    as_tuple,
)
from quadstep.mission.vehicles import VehicleSection
from quadstep.numbers import Matrix, Vector
from quadstep.vehicle.kinematics import Kinematics

SLOPE_1, SLOPE_2 = (1.0, 1.0, 1.0), (15.0, 15.0, 15.0)
"""Lambda_1 and Lambda_2 [1/s] of the study."""


class BuiltController(NamedTuple):
    """law and gains as in `quadstep.control`."""

    law: Any
    gains: Any


class ControllerSection(Section):
    """A controller in a mission file: a `type`, its keys, and what they build. Subclass it and add it to `AnyController`."""

    def build(self, vehicle: VehicleSection, folder: Path) -> BuiltController:
        """The law and its gains. folder: where files are looked up that a key names. Raises UserError."""
        raise NotImplementedError

    def warnings(self, vehicle: VehicleSection) -> list[str]:
        """What is to be said against these gains, a line each."""
        return []


class NetsSection(Section):
    """The two neural nets."""

    enabled: bool = True
    start: NonNegative = 0.0
    neurons: Annotated[int, Field(ge=1, le=64)] = 10
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 1
    F1: NonNegative = 5.0
    F2: NonNegative = 5.0
    kappa1: NonNegative = 0.01
    kappa2: NonNegative = 0.01
    weights: str | None = None

    def initial_weights(self, folder: Path) -> tuple[Matrix, Matrix]:
        """W_hat_1 and W_hat_2 at the start: zero, or as saved in the file `weights` by an earlier flight."""
        if self.weights is None:
            rows = [Vector((0.0, 0.0, 0.0)) for _ in range(self.neurons)]
            return Matrix(rows), Matrix(rows)
        try:
            saved = read_weights(folder / self.weights)
        except UserError as error:
            raise UserError(f"controller.nets.weights: {error}") from None
        if (saved.neurons, saved.seed) != (self.neurons, self.seed):
            raise UserError(
                f"{folder / self.weights}: saved with neurons = {saved.neurons}, seed = {saved.seed}; "
                f"controller.nets asks for neurons = {self.neurons}, seed = {self.seed}"
            )
        return Matrix(map(Vector, saved.W1)), Matrix(map(Vector, saved.W2))


class SavedWeights(Section):
    """Trained weights, shape (neurons, 3) each, and the nets they belong to."""

    neurons: int
    seed: int
    W1: list[Annotated[tuple[Finite, Finite, Finite], BeforeValidator(as_tuple)]]
    W2: list[Annotated[tuple[Finite, Finite, Finite], BeforeValidator(as_tuple)]]


def read_weights(path: Path) -> SavedWeights:
    """Weights from the `weights.json` of an earlier flight. Raises UserError for anything else."""
    try:
        saved = TypeAdapter(SavedWeights).validate_python(read_json(path))
    except ValueError:
        saved = None
    if saved is None or not len(saved.W1) == len(saved.W2) == saved.neurons:
        raise UserError(f"{path}: not a weights.json as `quadstep fly` writes it (neurons, seed, W1 and W2 of neurons x 3)")
    return saved


class BacksteppingSection(ControllerSection):
    """The paper's adaptive neural backstepping; keys are the paper's symbols."""

    type: Literal["backstepping"]
    mass: Positive | None = None
    Lambda1: PositiveDiagonal = SLOPE_1
    K_r1: PositiveDiagonal = (3.0, 3.0, 3.0)
    K_i1: NonNegativeDiagonal = (0.2, 0.2, 0.2)
    Lambda2: PositiveDiagonal = SLOPE_2
    K_r2: PositiveDiagonal = (250.0, 250.0, 250.0)
    K_i2: NonNegativeDiagonal = (10.0, 10.0, 10.0)
    filter_frequency: Positive = 100.0
    nets: NetsSection = NetsSection()

    def build(self, vehicle: VehicleSection, folder: Path) -> BuiltController:
        return BuiltController(Backstepping(), self.gains(vehicle, folder))

    def gains(self, vehicle: VehicleSection, folder: Path) -> BacksteppingGains:
        """The numbers of the paper's law."""
        nets, mass = self.nets, vehicle.mass if self.mass is None else self.mass
        weights_1, weights_2 = nets.initial_weights(folder)
        force_inputs = random_input_weights(nets.seed, 1, nets.neurons, FORCE_INPUTS)
        torque_inputs = random_input_weights(nets.seed, 2, nets.neurons, TORQUE_INPUTS)
        return BacksteppingGains(
            mass=mass,
            gravity=vehicle.gravity,
            slope_1=Vector(self.Lambda1),
            gain_1=Vector(self.K_r1),
            integral_1=Vector(self.K_i1),
            slope_2=Vector(self.Lambda2),
            gain_2=Vector(self.K_r2),
            integral_2=Vector(self.K_i2),
            filter_frequency=self.filter_frequency,
            force_net=Net(force_inputs, nets.F1, nets.kappa1),
            torque_net=Net(torque_inputs, nets.F2, nets.kappa2),
            learning_start=nets.start if nets.enabled else math.inf,
            weights_1=weights_1,
            weights_2=weights_2,
        )

    def warnings(self, vehicle: VehicleSection) -> list[str]:
        """The gain conditions of Theorem 5.1, corrected: K_r1 > m Lambda_1, K_r2 > J_M max(Lambda_2).

        J_M = 2 max(Sigma) bounds J = T^T Sigma T at every attitude, as the largest eigenvalue of T^T T is 1 + |sin theta|.
        """
        found, mass = [], self.mass or vehicle.mass
        for axis, gain, slope in zip("xyz", self.K_r1, self.Lambda1, strict=True):
            if gain <= mass * slope:
                found.append(f"controller.K_r1 ({axis}) = {gain:g} is not above m Lambda1 = {mass * slope:g}")
        bound = 2.0 * max(vehicle.inertia) * max(self.Lambda2)
        for angle, gain in zip(("psi", "theta", "phi"), self.K_r2, strict=True):
            if gain <= bound:
                found.append(f"controller.K_r2 ({angle}) = {gain:g} is not above J_M max(Lambda2) = {bound:g}")
        return [f"{line} (condition of Theorem 5.1)" for line in found]


Pair = Annotated[tuple[Positive, Positive], BeforeValidator(as_tuple)]


class CompletedSection(BacksteppingSection):
    """The paper's controller completed (docs/theory.md): the same keys, and what the completion needs.

    P [N m/rad]: 4 s^-2 times the inertia if left out; inertia: what the controller believes, the vehicle's if left out.
    """

    type: Literal["completed-backstepping"]  # type: ignore[assignment]
    P: PositiveDiagonal | None = None
    inertia: PositiveDiagonal | None = None
    weight_bounds: Pair = (20.0, 50.0)
    integral_bounds: Pair = (50.0, 50.0)

    def build(self, vehicle: VehicleSection, folder: Path) -> BuiltController:
        inertia = Vector(self.inertia or vehicle.inertia)
        gains = CompletedGains(
            paper=self.gains(vehicle, folder),
            coupling=Vector(self.P) if self.P else 4.0 * inertia,
            inertia=inertia,
            weight_bounds=Vector(self.weight_bounds),
            integral_bounds=Vector(self.integral_bounds),
        )
        law = CompletedBackstepping(Kinematics(vehicle.kinematics))
        return BuiltController(law, gains)


class NestedSaturationSection(ControllerSection):
    """The controller of the paper's reference [11], tracking the same path."""

    type: Literal["nested-saturation"]
    mass: Positive | None = None
    inertia: PositiveDiagonal | None = None
    a_z: Pair = (3.0, 0.5)
    a_psi: Pair = (2.374, 0.08)
    bounds: Annotated[tuple[Positive, Positive, Positive, Positive], BeforeValidator(as_tuple)] = (2.0, 1.0, 0.2, 0.1)

    def build(self, vehicle: VehicleSection, folder: Path) -> BuiltController:
        gains = NestedSaturationGains(
            mass=vehicle.mass if self.mass is None else self.mass,
            inertia=Vector(self.inertia or vehicle.inertia),
            gravity=vehicle.gravity,
            altitude=Vector(self.a_z),
            yaw=Vector(self.a_psi),
            bounds=Vector(self.bounds),
            slope_1=Vector(SLOPE_1),
            slope_2=Vector(SLOPE_2),
        )
        return BuiltController(NestedSaturation(Kinematics(vehicle.kinematics)), gains)

    def warnings(self, vehicle: VehicleSection) -> list[str]:
        """The condition of reference [11] that these bounds break."""
        return [
            f"controller.bounds: b_{i + 1} = {outer:g} is below 2 b_{i + 2} = {2 * inner:g} (condition of reference [11])"
            for i, (outer, inner) in enumerate(pairwise(self.bounds))
            if outer < 2.0 * inner
        ]


AnyController = Annotated[BacksteppingSection | CompletedSection | NestedSaturationSection, Field(discriminator="type")]
