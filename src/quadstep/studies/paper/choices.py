"""Every choice made where the paper is silent, in one place, with its reason."""

from typing import NamedTuple

from quadstep.mission.lagrange import LagrangeMission
from quadstep.studies.paper.cases import (
    CASE_3_START,
    CASE_TIME,
    FIGURE_3_TIME,
    HOLD,
    NESTED_GAINS,
    STRESS_SCALES,
    STRESS_TIMES,
    case_1,
)


class Choice(NamedTuple):
    """A choice: what was chosen, its value, and why."""

    what: str
    value: str
    why: str


def choices() -> list[Choice]:
    """The list, its values read from the missions that are flown."""
    mission: LagrangeMission = case_1()
    vehicle, clock, limits = mission.vehicle, mission.simulation, mission.limits
    gains = mission.controller.model_dump()
    nets = gains["nets"]
    return [
        Choice("T_eta", vehicle.kinematics, "the printed one violates Newton-Euler; with Sigma = 5 I both fly alike"),
        Choice("C(eta, eta_dot)", "C eta_dot by Eq. 2", "Christoffel's C gives the same and is the one the proof needs"),
        Choice("Eq. 67", "row products", "sums give tau_psi = 0.93 N m in Case 1, which the paper says is 0"),
        Choice("rotor arm l, factor c", f"{vehicle.rotors.arm:g} m, {vehicle.rotors.moment:g} m", "only f_i depends on them"),
        Choice("rotor limits", "none", "the paper has none"),
        Choice("Lambda1, K_r1, K_i1", f"{gains['Lambda1'][0]:g}, {gains['K_r1'][0]:g}, {gains['K_i1'][0]:g}",
               "K_r1 > m Lambda1; a second-order response of about 1 rad/s"),
        Choice("Lambda2, K_r2, K_i2", f"{gains['Lambda2'][0]:g}, {gains['K_r2'][0]:g}, {gains['K_i2'][0]:g}",
               "K_r2 > J_M max(Lambda2) = 150; inner loop well above the outer one"),
        Choice("desired attitude rates", f"critically damped filter at {gains['filter_frequency']:g} rad/s, from the attitude "
               "at the start", "the exact rate needs eta_dd and makes an algebraic loop; yaw's rate is known from the path"),
        Choice("zero desired force", "theta_d = phi_d = 0", "any attitude gives zero force; level is the safe one"),
        Choice("basis and input weights", f"sigmoid, uniform in [-1, 1] with bias, seed {nets['seed']}", "worked in trials"),
        Choice("neurons", f"{nets['neurons']} per net", "the paper's number; 8 and 12 are flown too"),
        Choice("F1, F2", f"{nets['F1']:g} I, {nets['F2']:g} I (N x N)", "diag(5 [1;1;1]) does not fit Eq. 54's dimensions"),
        Choice("kappa", f"kappa1 = {nets['kappa1']:g}, kappa2 = {nets['kappa2']:g}, both times |r| of both loops",
               "Section 6 has two, Eq. 54 one"),
        Choice("learning starts", f"t = {nets['start']:g} s from zero weights", "the paper gives no time"),
        Choice("step, control period", f"RK4 at {1e3 * clock.step:g} ms, law sampled every {1e3 * clock.control_period:g} ms",
               "halving the step moves Case 1 by less than 1e-6 m"),
        Choice("t_f", f"{CASE_TIME:g} s in every case, {FIGURE_3_TIME:g} s in Fig. 3", "given for Case 1; Eq. 75 has 10 s"),
        Choice("start of Cases 1 and 2", "at rest on the path", "as described"),
        Choice("start of Case 3", f"{CASE_3_START}",
               "from rest on the path x, y, theta, phi stay zero for ever, yet the paper plots their errors"),
        Choice("gains of [11]", f"{next(iter(NESTED_GAINS))}, a_psi = (2.374, 0.08), b = (2, 1, 0.2, 0.1)",
               "printed in scripts that reproduce it; the other altitude gains are flown too"),
        Choice("stress flights", f"t_f = {STRESS_TIMES} s, scale {STRESS_SCALES}, scored to t_f + {HOLD:g} s",
               "the disturbance is nearly zero in the paper's own cases"),
        Choice("divergence", f"{limits.distance:g} m off the path, an Euler rate of {limits.rate:g} rad/s, "
               f"|theta| > {limits.pitch:g} rad, or a number that is not finite", "an outcome with a time, never an error"),
        Choice("settling", "within 5 mrad for good", "the paper shows plots only"),
    ]  # fmt: skip
