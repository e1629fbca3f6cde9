"""The log of a flight: one row of numbers a log tick, each column with its name, unit and law."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadstep.flight.loop import Cycle, Loop, Outcome, Parameters, Ticks
from quadstep.numbers import Number
from quadstep.vehicle.lagrange import effective_inertia
from quadstep.vehicle.rotors import allocate

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


def log_row(loop: Loop, parameters: Parameters, cycle: Cycle, t: Number) -> list[Number]:
    """One row, in the order of `COLUMNS`, at time t [s]: the state now, the command held.

    lyapunov is Eq. 55 without its last term, which holds the unknown ideal weights.
    """
    state, command, vehicle = cycle.state, cycle.command, parameters.vehicle
    wanted = loop.path.reference(t, parameters.path).position
    r1, r2 = command.r1, command.r2
    inertia = effective_inertia(state.attitude, vehicle.inertia, loop.kinematics)
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


class FlightLog(NamedTuple):
    """A flight as flown.

    rows: (samples, len(COLUMNS)), every value finite. outcome, and ended: when it came [s].
    final: the cycle of floats at that moment (state, controller memory with the weights, command).
    """

    rows: NDArray[np.float64]
    outcome: Outcome
    ended: float
    final: Cycle

    def column(self, name: str) -> NDArray[np.float64]:
        """One column by name."""
        column: NDArray[np.float64] = self.rows[:, list(COLUMNS).index(name)]
        return column

    def columns(self, *names: str) -> NDArray[np.float64]:
        """Several columns by name, shape (samples, len(names))."""
        columns: NDArray[np.float64] = self.rows[:, [list(COLUMNS).index(name) for name in names]]
        return columns


def finished(rows: NDArray[np.float64], code: float, tick: int, ticks: Ticks, final: Cycle) -> FlightLog:
    """The log of a flight whose sample at `tick` gave outcome `code`; rows from that tick on, and broken ones, are cut."""
    outcome = Outcome(int(code))
    if outcome is not Outcome.COMPLETED:
        rows = rows[: -(-tick // ticks.log)]
    broken = np.flatnonzero(~np.isfinite(rows).all(axis=1))
    if len(broken):
        outcome = Outcome.NOT_FINITE if outcome is Outcome.COMPLETED else outcome
        rows = rows[: broken[0]]
    return FlightLog(rows, outcome, tick * ticks.step, final)
