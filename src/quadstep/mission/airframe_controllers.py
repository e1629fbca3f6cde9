"""The kinds of controller a real vehicle can fly with. Gains are per mass and inertia, so the defaults suit vehicles of any
size.
"""

import math
from pathlib import Path
from typing import Annotated, ClassVar, Literal

from pydantic import BeforeValidator, Field

from quadstep.control.cascaded_pid import CascadedPid, CascadedPidGains
from quadstep.control.geometric import Geometric, GeometricGains
from quadstep.control.lqr import Lqr, hover_gains
from quadstep.control.networks import Net, random_input_weights
from quadstep.control.rotation_backstepping import FORCE_INPUTS, TORQUE_INPUTS, RotationBackstepping, RotationGains
from quadstep.mission.agility import BelievedSection, Usual, agility, most_thrust
from quadstep.mission.airframe import BuiltAirframe
from quadstep.mission.controllers import BuiltController, NetsSection, Pair
from quadstep.mission.fields import NonNegative, NonNegativeDiagonal, Positive, PositiveDiagonal, as_tuple
from quadstep.mission.paper_law import PaperSection
from quadstep.numbers import Vector


class GeometricSection(BelievedSection):
    """Geometric tracking control on SE(3) (Lee, Leok, McClamroch 2010), with an integral (Goodarzi, Lee, Lee 2013).

    k_x, k_v, k_i over mass; k_R, k_Omega over inertia.
    """

    type: Literal["geometric"]
    k_x: PositiveDiagonal | None = None
    k_v: PositiveDiagonal | None = None
    k_i: NonNegativeDiagonal | None = None
    k_R: PositiveDiagonal | None = None  # noqa: N815 (the paper's symbols)
    k_Omega: PositiveDiagonal | None = None  # noqa: N815
    integral_bound: Positive = 5.0

    usual: ClassVar[dict[str, Usual]] = {
        "k_x": Usual((24.0, 24.0, 24.0), 2),
        "k_v": Usual((3.8, 3.8, 3.8), 1),
        "k_i": Usual((20.0, 20.0, 20.0), 3),
        "k_R": Usual((270.0, 270.0, 70.0), 2),
        "k_Omega": Usual((35.0, 35.0, 17.0), 1),
    }

    def build(self, vehicle: BuiltAirframe, folder: Path) -> BuiltController:
        gain = self.gains_for(vehicle)
        gains = GeometricGains(
            **self.believed(vehicle),
            stiffness=gain["k_x"],
            damping=gain["k_v"],
            integral=gain["k_i"],
            turn_stiffness=gain["k_R"],
            turn_damping=gain["k_Omega"],
            integral_bound=self.integral_bound,
        )
        return BuiltController(Geometric(), gains)


class PidSection(BelievedSection):
    """Cascaded PID: position P (asking for at most most_speed [m/s] back to the path), velocity PI, attitude P, body rate
    PID.
    """

    type: Literal["pid"]
    position: PositiveDiagonal | None = None
    most_speed: Positive = 3.0
    velocity: PositiveDiagonal | None = None
    velocity_integral: NonNegativeDiagonal | None = None
    integral_bound: Positive = 15.0
    attitude: PositiveDiagonal | None = None
    most_rate: Positive = 8.0
    rate: PositiveDiagonal | None = None
    rate_integral: NonNegativeDiagonal | None = None
    rate_integral_bound: Positive = 20.0
    rate_derivative: NonNegativeDiagonal = (0.0, 0.0, 0.0)
    rate_filter: Positive = 60.0

    usual: ClassVar[dict[str, Usual]] = {
        "position": Usual((5.0, 5.0, 5.0), 1),
        "velocity": Usual((6.2, 6.2, 6.2), 1),
        "velocity_integral": Usual((5.2, 5.2, 5.2), 2),
        "attitude": Usual((12.3, 12.3, 6.2), 1),
        "rate": Usual((40.0, 40.0, 20.0), 1),
        "rate_integral": Usual((25.0, 25.0, 10.0), 2),
    }

    def build(self, vehicle: BuiltAirframe, folder: Path) -> BuiltController:
        gains = CascadedPidGains(
            **self.believed(vehicle),
            **self.gains_for(vehicle),
            most_thrust=most_thrust(vehicle),
            most_speed=self.most_speed,
            most_rate=self.most_rate,
            integral_bound=self.integral_bound,
            rate_integral_bound=self.rate_integral_bound,
            rate_derivative=Vector(self.rate_derivative),
            rate_filter=self.rate_filter,
        )
        return BuiltController(CascadedPid(), gains)


LEVEL_WEIGHTS = (40.0, 40.0, 4.0, 1.0, 0.3, 0.002)


class LqrSection(BelievedSection):
    """Linear quadratic regulator about hover; weights on squared errors: what one unit of each is worth.

    level: of the integral of the position error, position, velocity, tilt, tilt rate, angular acceleration; climb: of the
    integral, position, velocity, acceleration; turn: of heading, its rate, angular acceleration.
    """

    type: Literal["lqr"]
    level: Annotated[tuple[Positive, ...], BeforeValidator(as_tuple), Field(min_length=6, max_length=6)] = LEVEL_WEIGHTS
    climb: Annotated[tuple[Positive, ...], BeforeValidator(as_tuple), Field(min_length=4, max_length=4)] = (
        20.0,
        40.0,
        4.0,
        1.0,
    )
    turn: Annotated[tuple[Positive, ...], BeforeValidator(as_tuple), Field(min_length=3, max_length=3)] = (40.0, 4.0, 0.4)
    integral_bound: Positive = 5.0

    def build(self, vehicle: BuiltAirframe, folder: Path) -> BuiltController:
        believed = self.believed(vehicle)
        believed["inertia"] = list(believed["inertia"])
        gains = hover_gains(**believed, level=self.level, climb=self.climb, turn=self.turn, integral_bound=self.integral_bound)
        return BuiltController(Lqr(), gains)


class RotationNets(NetsSection):
    """The two nets; F1 = 6.5 and F2 = 36 times the agility squared if left out."""

    F1: NonNegative | None = None  # type: ignore[assignment]
    F2: NonNegative | None = None  # type: ignore[assignment]
    kappa1: NonNegative = 0.06
    kappa2: NonNegative = 0.06


class RotationSection(BelievedSection):
    """Adaptive neural backstepping on the rotation group; the paper's symbols, K over mass or inertia, nets for accelerations.

    K_i1: a fifteenth of K_r1 if left out, as in the paper's study. P: the completion's coupling over inertia [1/s^2].
    """

    type: Literal["rotation-backstepping"]
    Lambda1: PositiveDiagonal | None = None
    K_r1: PositiveDiagonal | None = None
    K_i1: NonNegativeDiagonal | None = None
    Lambda2: PositiveDiagonal | None = None
    K_r2: PositiveDiagonal | None = None
    K_i2: NonNegativeDiagonal | None = None
    P: PositiveDiagonal | None = None
    filter_frequency: PositiveDiagonal | None = None
    nets: RotationNets = RotationNets()
    weight_bounds: Pair = (30.0, 100.0)
    integral_bounds: Pair = (20.0, 5.0)

    usual: ClassVar[dict[str, Usual]] = {
        "Lambda1": Usual((1.2, 1.2, 1.2), 1),
        "K_r1": Usual((7.0, 7.0, 7.0), 1),
        "K_i1": Usual((7.0 / 15.0, 7.0 / 15.0, 7.0 / 15.0), 2),
        "Lambda2": Usual((4.7, 4.7, 2.4), 1),
        "K_r2": Usual((28.0, 28.0, 14.0), 1),
        "K_i2": Usual((80.0, 80.0, 40.0), 2),
        "P": Usual((60.0, 60.0, 60.0), 2),
        "filter_frequency": Usual((31.0, 31.0, 15.5), 1),
    }

    def build(self, vehicle: BuiltAirframe, folder: Path) -> BuiltController:
        gain, nets, pace = self.gains_for(vehicle), self.nets, agility(vehicle)
        weights_1, weights_2 = nets.initial_weights(folder)
        force_inputs = random_input_weights(nets.seed, 1, nets.neurons, FORCE_INPUTS)
        torque_inputs = random_input_weights(nets.seed, 2, nets.neurons, TORQUE_INPUTS)
        rate_1 = 6.5 * (pace * pace) if nets.F1 is None else nets.F1
        rate_2 = 36.0 * (pace * pace) if nets.F2 is None else nets.F2
        gains = RotationGains(
            **self.believed(vehicle),
            most_thrust=most_thrust(vehicle),
            slope_1=gain["Lambda1"],
            gain_1=gain["K_r1"],
            integral_1=gain["K_i1"],
            slope_2=gain["Lambda2"],
            gain_2=gain["K_r2"],
            integral_2=gain["K_i2"],
            coupling=gain["P"],
            filter_frequency=gain["filter_frequency"],
            force_net=Net(force_inputs, rate_1, nets.kappa1),
            torque_net=Net(torque_inputs, rate_2, nets.kappa2),
            learning_start=nets.start if nets.enabled else math.inf,
            weight_bounds=Vector(self.weight_bounds),
            integral_bounds=Vector(self.integral_bounds),
            weights_1=weights_1,
            weights_2=weights_2,
        )
        return BuiltController(RotationBackstepping(), gains)

    def warnings(self, vehicle: BuiltAirframe) -> list[str]:
        """The gain condition of Theorem 5.1 that is left when the rigid-body torque is fed forward: K_r1 > m Lambda_1."""
        gains = self.gains_for(vehicle)
        return [
            f"controller.K_r1 ({axis}) = {gain:g} is not above Lambda1 = {slope:g} (condition of Theorem 5.1, over mass)"
            for axis, gain, slope in zip("xyz", gains["K_r1"], gains["Lambda1"], strict=True)
            if gain <= slope
        ]


AnyAirframeController = Annotated[
    GeometricSection | PidSection | LqrSection | RotationSection | PaperSection,
    Field(discriminator="type"),
]
