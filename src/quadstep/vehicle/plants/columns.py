"""The log of a flight of the paper's plant: one row of numbers per log tick, each column with its name, unit and law."""

from quadstep.interfaces.controller import Command
from quadstep.interfaces.model import Kinematics
from quadstep.numbers import Number, Vector
from quadstep.vehicle.paper.lagrange import Vehicle, effective_inertia
from quadstep.vehicle.paper.rotors import allocate
from quadstep.vehicle.paper.state import State

COLUMNS: dict[str, str] = {
    "t": "s",
    **dict.fromkeys(("x", "y", "z"), "m"),
    **dict.fromkeys(("psi", "theta", "phi"), "rad"),
    **dict.fromkeys(("x_dot", "y_dot", "z_dot"), "m/s"),
    **dict.fromkeys(("psi_dot", "theta_dot", "phi_dot"), "rad/s"),
    **dict.fromkeys(("x_d", "y_d", "z_d"), "m"),
    **dict.fromkeys(("psi_d", "theta_d", "phi_d"), "rad"),
    "u": "N",
    **dict.fromkeys(("tau_psi", "tau_theta", "tau_phi"), "N m"),
    **dict.fromkeys(("f1", "f2", "f3", "f4"), "N"),
    "norm_W1": "-",
    "norm_W2": "-",
    "lyapunov": "J",
    "norm_r1": "m/s",
    "norm_r2": "rad/s",
}
"""Name and unit of every logged column, in order."""


def log_row(
    vehicle: Vehicle, kinematics: Kinematics, wanted: Vector, state: State, command: Command, t: Number
) -> list[Number]:
    """One row, in the order of `COLUMNS`, at time t [s]: the state now, the command held. wanted: xi_d [m].

    lyapunov is Eq. 55 without its last term, which contains the unknown ideal weights.
    """
    r1, r2 = command.r1, command.r2
    inertia = effective_inertia(state.attitude, vehicle.inertia, kinematics)
    kinetic = 0.5 * (vehicle.mass * (r1 @ r1) + r2 @ (inertia @ r2))
    forces = allocate(vehicle.rotors, command.thrust, command.torque)
    return [
        t,
        *state.position,
        *state.attitude,
        *state.velocity,
        *state.rates,
        *wanted,
        *command.desired_attitude,
        command.thrust,
        *command.torque,
        *forces,
        *command.weight_norms,
        kinetic + command.stored,
        r1.norm(),
        r2.norm(),
    ]
