"""The controller of the paper's reference [11], which Case 3 flies; in floats, because its saturations nest four deep."""

import numpy as np

from quadstep.control.nested_saturation import NestedSaturation, NestedSaturationGains, NoMemory, nested
from quadstep.interfaces.model import Kinematics
from quadstep.interfaces.reference import Reference
from quadstep.numbers import Vector, vector
from quadstep.proofs.verify.algebra import holds, listed, near
from quadstep.proofs.verify.rows import EquationRow, EquationVerdict, Evidence, row
from quadstep.vehicle.paper import Rotors, State, Vehicle, acceleration, angular_acceleration

ROWS: list[EquationRow] = []
WIDE, NARROW = vector(8e6, 4e6, 2e6, 1e6), vector(2.0, 1.0, 0.2, 0.1)


@row(ROWS, "[11]", "the controller of reference [11]", "not given in this "
     "paper", "control.nested_saturation:NestedSaturation.law",
     EquationVerdict.DEFINITION, "u c_th c_ph = m g - m (a_z1 z_dot + a_z2 z); tau = C eta_dot + J tau~; unsaturated, each "
         "channel has the "
     "poles of (s + 1)^4")  # fmt: skip
def reference_11() -> Evidence:
    slopes = [-nested(WIDE, *unit) for unit in np.eye(4).tolist()]
    far, near_by = nested(NARROW, 0.0, 0.0, 0.0, 100.0), nested(NARROW, 0.01, -0.02, 0.03, 0.01)
    draw = np.random.default_rng(11)
    lift = turn = logged = 0.0
    for _ in range(20):
        state = State(*(Vector(draw.uniform(-1.2, 1.2, 3).tolist()) for _ in range(4)))
        a_z, a_psi, slope_1, slope_2 = (Vector(draw.uniform(0.5, 3, n).tolist()) for n in (2, 2, 3, 3))
        position, velocity, ahead = (Vector(draw.uniform(-1, 1, 3).tolist()) for _ in range(3))
        path = Reference(position, velocity, ahead, *draw.uniform(-1, 1, 2).tolist())
        body = Vehicle(1.7, vector(5.0, 8.0, 12.0), 9.81, Rotors(0.25, 0.05, 0.0, 8.0))
        gains = NestedSaturationGains(1.7, body.inertia, 9.81, a_z, a_psi, WIDE, slope_1, slope_2, pace=1.0)
        command, _ = NestedSaturation().law(NoMemory(), state, path, gains, 0.0, 0.0)
        e, e_dot = state.position - position, state.velocity - velocity
        climb = acceleration(body, state.attitude, command.thrust, vector(0.0, 0.0, 0.0))[2]
        eta_dd = angular_acceleration(body, state.attitude, state.rates, command.torque, Kinematics.STANDARD)
        (psi, theta, phi), (psi_dot, theta_dot, phi_dot) = state.attitude, state.rates
        wanted = vector(
            -a_psi[0] * (psi_dot - path.yaw_rate) - a_psi[1] * (psi - path.yaw),
            -(4 * theta_dot + 6 * theta - (4 * e_dot[0] + e[0]) / 9.81),
            -(4 * phi_dot + 6 * phi + (4 * e_dot[1] + e[1]) / 9.81),
        )
        r1 = -e_dot - slope_1 * e
        r2 = vector(path.yaw_rate, 0.0, 0.0) - state.rates + slope_2 * (vector(path.yaw, 0.0, 0.0) - state.attitude)
        lift = max(lift, abs(climb + a_z[0] * e_dot[2] + a_z[1] * e[2]))
        turn = max(turn, (eta_dd - wanted).norm())
        logged = max(logged, (command.r1 - r1).norm(), (command.r2 - r2).norm())
    return Evidence([
        holds("a_dd = -(4 a_dot + 6 a + 4 v + p) unsaturated", slopes == [4.0, 6.0, 4.0, 1.0], listed(slopes), "(4, 6, 4, 1)"),
        near("a_dd far away", far, -0.1, 1e-12),
        near("a_dd close by", near_by, -(0.04 - 0.12 + 0.12 + 0.01), 1e-12),
        holds("z_dd = -a_z1 z_dot - a_z2 z by the plant, 20 random states", lift < 1e-10, f"off by {lift:.0e}", "equal"),
        holds("eta_dd = tau~ by the plant", turn < 1e-8, f"off by {turn:.0e}", "equal"),
        holds("logged r1 and r2", logged < 1e-12, f"off by {logged:.0e}", "equal"),
    ])  # fmt: skip
