"""The claims of Section 6 of the paper, what was measured, and the verdict."""

from collections.abc import Sequence

import numpy as np

from quadstep.metrics.registry import Metrics, group, metric
from quadstep.report import units
from quadstep.report.units import rounded_up
from quadstep.studies.paper.cases import (
    HOLD,
    NEURONS,
    SEEDS,
    STRESS_SCALES,
    STRESS_TIMES,
    Claim,
    ClaimVerdict,
    PaperStudy,
    case_1,
    completed,
    judge,
    judge_all,
)
from quadstep.studies.paper.claims_comparison import altitude, settling, sideways, smoothness, transient_cause, transients


def rest_at_the_end() -> Claim:
    """Reference trajectory generation."""
    plan = case_1().plan()
    path = plan.parameters.path
    end = plan.loop.path.reference(path.duration, path)
    miss = max(abs(a - b) for a, b in zip(end.position, path.end, strict=True))
    speed, rate = end.velocity.norm(), end.acceleration.norm()
    return Claim(
        "rest at the end point",
        "Case 1",
        "This trajectory ensures that the velocities and accelerations at the end point are zero.",
        f"The desired trajectory ends {miss:g} m from the target, with a speed of {speed:g} m/s and an acceleration of "
        f"{rate:g} m/s^2.",
        judge(max(miss, speed, rate) < 1e-12),
        {"distance[m]": miss, "speed[m/s]": speed, "acceleration[m/s^2]": rate},
    )


def stays_small(study: PaperStudy, kind: str, unit: str, name: str, sentence: str, most: int) -> Claim:
    """That no largest error of Case 1 is above `most` thousandths of the unit."""
    errors = {axis: values[f"largest[{unit}]"] for axis, values in group(study.cases["case1"], kind).items()}
    said = units.listed([f"{units.quantity(e, unit, 2)} in {a}" for a, e in errors.items()])
    measured = f"The largest error is {said}; the bound, {most} m{unit}, is our choice."
    verdict = judge(max(errors.values()) < 1e-3 * most)
    return Claim(name, "Case 1", sentence, measured, verdict, {f"largest_error[{unit}]": errors})


def tracking(study: PaperStudy) -> Claim:
    """Case 1, Fig. 4."""
    sentence = "The tracking is almost perfect as well as the tracking errors are significantly small."
    return stays_small(study, "position", "m", "near-perfect tracking", sentence, 1)


def compensation(study: PaperStudy) -> Claim:
    """Case 1's disturbance, and the stress flights at scale 1."""
    log = study.logs["case1"]
    products = log.table("x_dot", "y_dot", "z_dot") * log.table("phi_dot", "theta_dot", "psi_dot")
    disturbance = float(np.abs(products).max())  # largest entry of Eq. 67, scale 1 [N, N m]
    with_nets, without = (
        metric(study.cases["case1"], "position_rmse[m]"),
        metric(study.further["case1 without nets"], "position_rmse[m]"),
    )
    ratios = {
        f"t_f = {t:g} s": metric(study.stress[t, 1.0, False], "position_rmse[m]")
        / metric(study.stress[t, 1.0, True], "position_rmse[m]")
        for t in STRESS_TIMES
        if completed(study.stress[t, 1.0, True]) and completed(study.stress[t, 1.0, False])
    }
    hurt = [
        f"; with t_f = {t:g} s the flight with nets is lost, and that without completes with an RMSE of "
        f"{units.quantity(metric(study.stress[t, 1.0, False], 'position_rmse[m]'), 'm')}"
        for t in STRESS_TIMES
        if completed(study.stress[t, 1.0, False]) and not completed(study.stress[t, 1.0, True])
    ]
    return Claim(
        "nonlinearities compensated by the nets",
        "Case 1, and in 3 to 20 s",
        "This is in spite of the unknown nonlinearities, which are effectively compensated by the neural networks.",
        f"Case 1 is no test of this: its disturbance, at most {1e3 * rounded_up(disturbance, 2):g} mN, causes almost none of "
        f"the RMSE of {1e6 * without:.0f} µm that the nets cut to {1e6 * with_nets:.1f} µm. In faster flights at scale 1 that "
        f"complete either way, nets cut the RMSE (until {HOLD:g} s after t_f) by a factor of {min(ratios.values()):.0f} to "
        f"{max(ratios.values()):.0f}{''.join(hurt)}.",
        ClaimVerdict.UNDECIDED,
        {"largest_disturbance[N]": disturbance, "rmse_nets_on[m]": with_nets, "rmse_nets_off[m]": without,
         "rmse_ratio_off_to_on": ratios},
    )  # fmt: skip


def angles(study: PaperStudy) -> Claim:
    """Case 1, Fig. 5."""
    sentence = "Again the angles match their command values nearly perfectly."
    return stays_small(study, "attitude", "rad", "angles match their commands", sentence, 5)


def realisable(study: PaperStudy) -> Claim:
    """Case 1, Fig. 6."""
    m = study.cases["case1"]
    thrust, least = metric(m, "u", "largest[N]"), metric(m, "rotors", "least[N]")
    torque = max(metric(m, name, "largest[N m]") for name in ("tau_psi", "tau_theta", "tau_phi"))
    sign = "no rotor needs negative thrust" if least >= 0.0 else "a rotor needs negative thrust"
    low, high = (metric(study.cases["case3_adaptive"], "rotors", f"{which}[N]") for which in ("least", "largest"))
    return Claim(
        "inputs realisable",
        "Case 1",
        "Figure 6 describes the control input requirement which is very much realizable.",
        f"The thrust is at most {rounded_up(thrust, 3):g} N (weight 9.81 N), torques {rounded_up(torque, 3):g} N m; rotors "
        f"give {least:.2f} to {metric(m, 'rotors', 'largest[N]'):.2f} N: {sign} (in Case 3: {low:,.0f} to {high:,.0f} N). "
        "The bound on the thrust, twice the weight, and the rotors' l = 0.25 m and c = 0.05 m are our choice.",
        judge(least >= 0.0 and thrust < 2.0 * 9.81),
        {"largest_thrust[N]": thrust, "largest_torque[N m]": torque, "rotors[N]": m["rotors"]},
    )


def no_yaw_torque(study: PaperStudy) -> Claim:
    """Case 1, Fig. 6."""
    m = study.cases["case1"]
    yaw, pitch = metric(m, "tau_psi", "largest[N m]"), metric(m, "tau_theta", "largest[N m]")
    later = np.abs(study.logs["case1"].table("tau_psi", "tau_theta")[study.logs["case1"].column("t") > 1.0]).max(axis=0)
    return Claim(
        "tau_psi = 0",
        "Case 1",
        "The control requirement for yaw angle is tau_psi = 0 and it is seen from Fig. 6.",
        f"|tau_psi| never exceeds {rounded_up(yaw, 2):.1e} N m: {100 * yaw / pitch:.2f} % of the peak |tau_theta| of the "
        f"whole flight (the bound, 1 %, is our choice), but {100 * later[0] / later[1]:.0f} % of its peak after the first "
        "second. It is not exactly zero, because Eq. 67's third row and the torque net act on yaw.",
        judge(yaw < 0.01 * pitch),
        {"largest_tau_psi[N m]": yaw, "largest_tau_theta[N m]": pitch, "share_after_1_s": float(later[0] / later[1])},
    )


def silent(metrics: Metrics, axes: str, torque: str, angle: str) -> dict[str, float]:
    """How far the other axes, with their torque and angle, move."""
    moved = {f"{axis}[m]": metric(metrics, "position", axis, "largest[m]") for axis in axes}
    return {**moved, f"{torque}[N m]": metric(metrics, torque, "largest[N m]"), f"{angle} error[rad]":
            metric(metrics, "attitude", angle, "largest[rad]")}  # fmt: skip


def unmoved(*flights: dict[str, float]) -> str:
    """That other axes hardly move, in a sentence."""
    most = rounded_up(max(value for values in flights for value in values.values()), 2)
    return f"Everything that should stay at zero stays below {most:.1e} (m, N m, rad); the bound, 1e-6, is our choice."


def decoupling_x(study: PaperStudy) -> Claim:
    """Case 2, Figs 7 to 9."""
    values = silent(study.cases["case2"], "yz", "tau_phi", "phi")
    return Claim(
        "decoupling in x",
        "Case 2",
        "The change in x does not make any influence on phi; tau_phi is almost zero; y and z are held.",
        unmoved(values),
        judge(max(values.values()) < 1e-6),
        values,
    )


def decoupling_y_z(study: PaperStudy) -> Claim:
    """Case 2, last sentence."""
    y, z = silent(study.cases["case2_y"], "xz", "tau_theta", "theta"), silent(study.cases["case2_z"], "xy", "tau_phi", "phi")
    return Claim(
        "decoupling in y and z",
        "Case 2",
        "Simulations for y and z separately yield similar plots that show excellent tracking with decoupling.",
        unmoved(y, z),
        judge(max(*y.values(), *z.values()) < 1e-6),
        {"y": y, "z": z},
    )


def wide_range(study: PaperStudy) -> Claim:
    """The remark that closes Section 6."""
    lost = {(t, scale): m for (t, scale, nets), m in study.stress.items() if nets and not completed(m)}
    by_scale = {scale: sum(key[1] == scale for key in lost) for scale in STRESS_SCALES}
    hurt = [f"t_f = {t:g} s at scale {scale:g}" for t, scale in lost if completed(study.stress[t, scale, False])]
    return Claim(
        "a wide range of nonlinearities",
        "stress flights, 3 to 20 s",
        "NN backstepping controller gives satisfactory results for a wide range of nonlinearities.",
        "Stress flights lost with nets: "
        + units.listed([f"{count} of {len(STRESS_TIMES)} at scale {scale:g}" for scale, count in by_scale.items()])
        + " of the paper's disturbance (one is enough to fail, by our choice)."
        + (f" Lost with nets, and completed without: {units.listed(hurt)}." if hurt else ""),
        judge(not lost),
        {"diverged_by_scale": {f"{scale:g}": count for scale, count in by_scale.items()}, "nets_hurt": hurt},
    )


def neurons(study: PaperStudy) -> list[Claim]:
    """Neural network parameters."""
    median: dict[str, dict[int, float]] = {}
    seeds: dict[str, dict[int, int]] = {}  # in how many the error is larger than with 10 neurons, or smaller with more
    for flight in ("Case 1", "t_f = 6 s, scale 1"):
        errors = {n: np.array([metric(study.neurons[flight, n, seed], "position_rmse[m]") for seed in SEEDS]) for n in NEURONS}
        median[flight] = {n: float(np.median(values)) for n, values in errors.items()}
        seeds[flight] = {n: int(((n - 10) * (errors[10] - values) > 0.0).sum()) for n, values in errors.items()}
    values = {flight: {str(n): value for n, value in by_count.items()} for flight, by_count in median.items()}
    measured = {
        other: f"With {other} neurons instead of 10, the median RMSE is "
        + units.listed(
            [
                f"{units.quantity(m[other], 'm')} against {units.quantity(m[10], 'm')} ({flight.partition(',')[0]}; {way} in "
                f"{seeds[flight][other]} of {len(SEEDS)} seeds)"
                for flight, m in median.items()
            ]
        )
        + f"{more}."
        for other, way, more in ((8, "larger", ""), (12, "smaller", ". The bound, a gain of 1 %, is our choice"))
    }
    worse, no_better = ([m[8] > m[10] for m in median.values()], [m[12] >= 0.99 * m[10] for m in median.values()])
    case = "Case 1; in 6 s, scale 1"
    eight = "Using eight neurons the performance deteriorated."
    twelve = "A simulation using 12 neurons did not improve performance."
    return [
        Claim("8 neurons are worse than 10", case, eight, measured[8], judge_all(worse), values),
        Claim("12 neurons are no better than 10", case, twelve, measured[12], judge_all(no_better), values),
    ]


__all__ = ["Claim", "ClaimVerdict", "check_claims"]


def counts(claims: Sequence[Claim]) -> str:
    """How many claims have each verdict."""
    hold, fail, undecided = (sum(claim.verdict is kind for claim in claims) for kind in ClaimVerdict)
    return f"{hold} hold, {fail} fail, and {undecided} are undecided"


def answer(claims: Sequence[Claim]) -> str:
    """The result for the paper's claims."""
    return f"Of {len(claims)} claims that Das, Lewis and Subbarao (2009) make about their simulations, {counts(claims)}."


CONTEXT = "Where the paper gives no value we chose one; [11], with which it compares, is Castillo, Lozano and Dzul (2005)."

RULE = (
    "A claim about a flight that the paper describes is judged on that flight. Where the paper leaves the flight open (the "
    "start of Case 3, the gains of [11], the flight on which neurons were tried), several are flown: the claim holds if it is "
    "true in all that differ, fails if it is false in all of these, and is undecided otherwise. A controller that is lost "
    "where the other completes counts as the worse one. A claim about a whole range fails with one flight against it. A claim "
    "that its flight cannot test is undecided."
)
"""How verdicts are reached."""


def check_claims(study: PaperStudy) -> list[Claim]:
    """Every sentence of Section 6 that claims something, in the paper's order."""
    return [
        rest_at_the_end(),
        tracking(study),
        compensation(study),
        angles(study),
        realisable(study),
        no_yaw_torque(study),
        decoupling_x(study),
        decoupling_y_z(study),
        altitude(study),
        sideways(study),
        settling(study),
        smoothness(study),
        transients(study),
        transient_cause(study),
        wide_range(study),
        *neurons(study),
    ]
