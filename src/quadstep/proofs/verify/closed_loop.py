"""One sample of the shipped controller in symbols, and the rate of every symbol when the shipped plant obeys it."""

from typing import NamedTuple

import sympy

from quadstep.control.backstepping import FORCE_INPUTS, TORQUE_INPUTS, Backstepping, BacksteppingGains, BacksteppingMemory
from quadstep.control.filters import Filtered
from quadstep.interfaces.controller import Command
from quadstep.interfaces.learning import Net, basis
from quadstep.interfaces.plant import Kinematics, Reference
from quadstep.numbers import Matrix, Vector
from quadstep.proofs.verify.equation_row import Expression, array, flow_of, symbol, symbols
from quadstep.proofs.verify.plant import MASS, THRUST, TORQUE, body
from quadstep.proofs.verify.rigid_body import ATTITUDE, RATES
from quadstep.vehicle.paper import Disturbance, State, derivative

NEURONS = 2
STATE = State(symbols("xi"), symbols("xi_dot"), ATTITUDE, RATES)
REFERENCE = Reference(
    symbols("xi_d"),
    symbols("xi_d_dot"),
    symbols("xi_d_dd"),
    symbol("psi_d", positive=False),
    symbol("psi_d_dot", positive=False),
)
DESIRED_DD = symbols("eta_d_dd")
FORCE, MOMENT = symbols("A_xyz"), symbols("A_eta")
PERIOD = symbol("T")
DISTURBANCE = Disturbance(0.0, FORCE, MOMENT)


def weights(name: str, rows: int, columns: int) -> Matrix:
    return Matrix(symbols(f"{name}{row + 1}", columns) for row in range(rows))


W_HAT_1, W_HAT_2 = weights("W1_hat", NEURONS, 3), weights("W2_hat", NEURONS, 3)
NET_1 = Net(weights("V1", NEURONS, FORCE_INPUTS + 1), symbol("F_1"), symbol("kappa_1"))
NET_2 = Net(weights("V2", NEURONS, TORQUE_INPUTS + 1), symbol("F_2"), symbol("kappa_2"))
GAINS = BacksteppingGains(
    mass=MASS,
    gravity=symbol("g"),
    slope_1=symbols("Lambda1", positive=True),
    gain_1=symbols("Kr1", positive=True),
    integral_1=symbols("Ki1", positive=True),
    slope_2=symbols("Lambda2", positive=True),
    gain_2=symbols("Kr2", positive=True),
    integral_2=symbols("Ki2", positive=True),
    filter_frequency=symbol("w"),
    force_net=NET_1,
    torque_net=NET_2,
    learning_start=0.0,
    weights_1=W_HAT_1,
    weights_2=W_HAT_2,
)
MEMORY = BacksteppingMemory(
    symbols("int_r1"), symbols("int_r2"), Filtered(symbols("eta_d", 2), symbols("eta_d_dot", 2)), W_HAT_1, W_HAT_2
)


class LawResult(NamedTuple):
    """The result of the law: the command, and the memory for the next sample."""

    command: Command
    following: BacksteppingMemory


def sample(learning: bool = True, gains: BacksteppingGains = GAINS) -> LawResult:
    """The shipped law evaluated with symbols, before or after the nets start learning."""
    start = 0.0 if learning else 2.0
    return LawResult(*Backstepping().law(MEMORY, STATE, REFERENCE, gains._replace(learning_start=start), 1.0, PERIOD))


def diagonal(entries: Vector) -> Expression:
    """A gain as a matrix, as the paper writes it."""
    return sympy.diag(*entries)


def column(*numbers: Expression) -> Expression:
    return sympy.Matrix(list(numbers))


# The paper's own symbols, by its definitions
XI_D_DD = array(REFERENCE.acceleration)
E1 = array(REFERENCE.position) - array(STATE.position)  # Eq. 11
E1_DOT = array(REFERENCE.velocity) - array(STATE.velocity)
LAMBDA_1, LAMBDA_2 = diagonal(GAINS.slope_1), diagonal(GAINS.slope_2)
R1 = E1_DOT + LAMBDA_1 * E1  # Eq. 12
M_G = column(0, 0, -MASS * GAINS.gravity)
ETA_D = column(REFERENCE.yaw, *MEMORY.filtered.value)
ETA_D_DOT = column(REFERENCE.yaw_rate, *MEMORY.filtered.rate)
E2 = ETA_D - array(ATTITUDE)  # Eq. 27
E2_DOT = ETA_D_DOT - array(RATES)
R2 = E2_DOT + LAMBDA_2 * E2  # Eq. 28
CHI_1 = (*STATE.position, *R1, *ATTITUDE, *RATES)
CHI_2 = (*ATTITUDE, *R1, *R2)


def mu(net: Net, chi: tuple[Expression, ...]) -> Expression:
    """The shipped basis at an input of the paper."""
    return array(basis(net, chi))


def plant(thrust: Expression = THRUST, torque: Vector = TORQUE, attitude: Vector = ATTITUDE) -> State:
    """Rate of the shipped plant's state under a thrust and a torque."""
    return derivative(body(), DISTURBANCE, Kinematics.STANDARD, STATE._replace(attitude=attitude), thrust, torque)


def motion(rate: State) -> dict[Expression, Expression]:
    """Rate of every symbol of a sample: the state's from the plant, those of the path and the desired attitude as given."""
    return flow_of(
        *zip(STATE, rate, strict=True),
        (REFERENCE.position, REFERENCE.velocity),
        (REFERENCE.velocity, REFERENCE.acceleration),
        (list(ETA_D), list(ETA_D_DOT)),
        (list(ETA_D_DOT), DESIRED_DD),
    )
