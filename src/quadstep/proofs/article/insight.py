"""What the article shows of a flight beside its log: what the paper's law wants on its way, and the terms of L and its rate.

One row of numbers per log row, from the functions that fly (`page/emit.py` records them), in the order of `SHOWN`; the net's
numbers follow.
"""

from collections.abc import Sequence
from typing import cast

from quadstep.control.backstepping import (
    Backstepping,
    BacksteppingGains,
    BacksteppingMemory,
    attitude_errors,
    position_loop,
    torque_basis,
)
from quadstep.control.command_filter import command_filter
from quadstep.control.networks import output
from quadstep.engines.loop import Cycle, Loop
from quadstep.interfaces.closed_loop import ClosedLoop
from quadstep.interfaces.controller import Command
from quadstep.numbers import Number, Vector, atan2, where
from quadstep.page.emit import net_row
from quadstep.proofs.certify.certificate import error_radius
from quadstep.vehicle.paper import State, coriolis, effective_inertia, thrust_direction
from quadstep.vehicle.plants.lagrange import Lagrange, Parameters

PERIOD = 0.002
"""Control period of the article's flights [s]."""

XYZ, ANGLES = ("x", "y", "z"), ("psi", "theta", "phi")

SHOWN: tuple[str, ...] = (
    *(f"e1_{axis}" for axis in XYZ),
    *(f"e1_dot_{axis}" for axis in XYZ),
    *(f"r1_{axis}" for axis in XYZ),
    *(f"velocity_{axis}" for axis in XYZ),
    *(f"force_{axis}" for axis in XYZ),
    *(f"made_{axis}" for axis in XYZ),
    *(f"e2_{angle}" for angle in ANGLES),
    "L_position", "L_attitude", "L_integrals",
    "rate_position", "rate_attitude", "rate_unknown", "rate_coupling",
)  # fmt: skip
"""e1 [m], e1_dot, r1 [m/s] (Eqs 11, 12). velocity: at which r1 would be 0 [m/s]. force: F_d_hat (Eq. 24), made: what
thrust and attitude make of it [N]. e2 [rad] (Eq. 27). Then the parts of L without the weights (Eq. 55) [J], and of its rate
[W]: -r1^T (K_r1 - m Lambda_1) r1, -r2^T (K_r2 - J Lambda_2) r2, what the nets still miss of Eqs 22 and 33 times r1 and r2, and
r1^T (F_d_hat - u n(eta)), the coupling that Eqs 26 and 56 leave out. These four together are the rate of those three.
"""


def insight_row(loop: ClosedLoop, cycle: object, p: object, time: Number) -> list[Number]:
    """Those numbers at time t [s], then `net_row`'s; the loop is the paper's law on the paper's plant."""
    assert isinstance(loop, Loop)
    assert isinstance(loop.plant, Lagrange)
    assert isinstance(loop.controller, Backstepping)
    flown, parameters = cast(Cycle, cycle), cast(Parameters, p)
    state, memory = cast(State, flown.state), cast(BacksteppingMemory, flown.memory)
    gains, vehicle, wanted = cast(BacksteppingGains, parameters.gains), parameters.vehicle, loop.wanted(time, parameters)
    on = where(time >= gains.learning_start, 1.0, 0.0)
    asked = cast(Command, flown.command)
    tilt = Vector([*asked.desired_attitude][1:])
    filtered = command_filter(
        memory.filtered, tilt, gains.filter_frequency, -PERIOD
    )  # as the law had it: its memory is a sample ahead
    e1, r1, r2 = wanted.position - state.position, asked.r1, asked.r2
    e2, _ = attitude_errors(gains, filtered, state, wanted)
    mu_1 = position_loop(gains, memory, state, wanted, on).mu_1
    force = asked.thrust * thrust_direction(asked.desired_attitude)
    made = asked.thrust * thrust_direction(state.attitude)

    inertia = effective_inertia(state.attitude, vehicle.inertia, loop.plant.kinematics)
    turning = coriolis(state.attitude, state.rates, vehicle.inertia, loop.plant.kinematics)
    tilting = (memory.filtered.rate - filtered.rate) * (1.0 / PERIOD)  # the mean over the sample, as the torque is held
    eta_dd = Vector((wanted.yaw_acceleration, *tilting))
    rates = Vector((wanted.yaw_rate, *filtered.rate))
    pushed, twisted = loop.plant.disturbed(parameters, state, time)
    missing_1 = -pushed - on * output(memory.weights_1, mu_1)  # Eq. 22 less Eq. 23
    slope = gains.slope_2
    target_2 = inertia @ (eta_dd - slope * (slope * e2)) - twisted + turning @ (rates + slope * e2)  # Eq. 33
    missing_2 = target_2 - on * output(memory.weights_2, torque_basis(gains, state, r1, r2))
    stored = memory.integral_1 @ (gains.integral_1 * memory.integral_1)
    stored = stored + memory.integral_2 @ (gains.integral_2 * memory.integral_2)
    return [
        *e1, *(wanted.velocity - state.velocity), *r1, *(state.velocity + r1), *force, *made, *e2,
        0.5 * vehicle.mass * (r1 @ r1), 0.5 * (r2 @ (inertia @ r2)), 0.5 * stored,
        -(r1 @ ((gains.gain_1 - vehicle.mass * gains.slope_1) * r1)),
        -(r2 @ (gains.gain_2 * r2 - inertia @ (slope * r2))),
        r1 @ missing_1 + r2 @ missing_2,
        r1 @ (force - made),
        *net_row(loop, cycle, p, time),
    ]  # fmt: skip


def printed_roll(force: Sequence[Number]) -> Number:
    """phi_d [rad] as Eq. 52 prints it, atan(f_y / f_z): wrong for f_z < 0. Without f_z it is taken as f_z = 0+."""
    _, f_y, f_z = force
    return atan2(where(f_z < 0.0, -f_y, f_y), where(f_z < 0.0, -f_z, f_z))


def ball(kappa: Number, weights: Number, error: Number, least_gain: Number) -> tuple[Number, Number]:
    """(b_r, b_r as Eq. 63 prints it), of |W| <= weights, |eps_v| <= error and |K_v|_min."""
    return _radius(weights, error, kappa) / least_gain, _radius(weights, error, 1.0) / least_gain


def _radius(weights: Number, error: Number, kappa: Number) -> Number:
    """b_r for a |K_v|_min of 1."""
    return cast(Number, error_radius(weights, error, kappa, 1.0))
