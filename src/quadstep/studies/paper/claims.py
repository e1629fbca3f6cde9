"""The claims of Section 6 of the paper, what was measured, and the verdict."""

from collections.abc import Sequence

import numpy as np

from quadstep.metrics.registry import Metrics, group, metric
from quadstep.report import units
from quadstep.studies.paper.cases import (
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
)
from quadstep.studies.paper.claims_comparison import altitude, settling, sideways, smoothness, transient_cause, transients


def largest(metrics: Metrics, kind: str, unit: str) -> dict[str, float]:
    return {axis: values[f"largest[{unit}]"] for axis, values in group(metrics, kind).items()}


def rest_at_the_end() -> Claim:
    """Reference trajectory generation."""
    plan = case_1().plan()
    path = plan.parameters.path
    end = plan.loop.path.reference(path.duration, path)
    miss = max(abs(a - b) for a, b in zip(end.position, path.end, strict=True))
    speed, rate = end.velocity.norm(), end.acceleration.norm()
    return Claim(
        "rest at the end point",
        "This trajectory ensures that the velocities and accelerations at the end point are zero.",
        f"At t_f the distance to the target is {miss:g} m, the speed {speed:g} m/s and the acceleration {rate:g} m/s^2.",
        judge(max(miss, speed, rate) < 1e-12),
        {"distance[m]": miss, "speed[m/s]": speed, "acceleration[m/s^2]": rate},
    )


def stays_small(
    study: PaperStudy, kind: str, unit: str, name: str, sentence: str, shown: tuple[float, str], most: int
) -> Claim:
    """That no largest error of Case 1 is above `most` thousandths of the unit. shown: in what errors are written."""
    errors = largest(study.cases["case1"], kind, unit)
    said = units.listed([f"{shown[0] * e:.2g} {shown[1]} in {a}" for a, e in errors.items()])
    measured = f"The largest error is {said}. The bound, {most} m{unit}, is our choice."
    return Claim(name, sentence, measured, judge(max(errors.values()) < 1e-3 * most), {f"largest_error[{unit}]": errors})


def tracking(study: PaperStudy) -> Claim:
    """Case 1, Fig. 4."""
    sentence = "The tracking is almost perfect as well as the tracking errors are significantly small (Case 1)."
    return stays_small(study, "position", "m", "near-perfect tracking", sentence, (1e6, "µm"), 1)


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
    return Claim(
        "nonlinearities compensated by the nets",
        "This is in spite of the unknown nonlinearities, which are effectively compensated by the neural networks (Case 1).",
        f"Case 1 is no test of the nets: its disturbance is at most {disturbance:.1e} N, and the RMSE is {1e6 * without:.0f} "
        f"µm with nets off and {1e6 * with_nets:.1f} µm with nets on. In faster flights at scale 1, nets cut the RMSE "
        f"by a factor of {min(ratios.values()):.0f} to {max(ratios.values()):.0f}.",
        ClaimVerdict.UNDECIDED,
        {"largest_disturbance[N]": disturbance, "rmse_nets_on[m]": with_nets, "rmse_nets_off[m]": without,
         "rmse_ratio_off_to_on": ratios},
    )  # fmt: skip


def angles(study: PaperStudy) -> Claim:
    """Case 1, Fig. 5."""
    sentence = "Again the angles match their command values nearly perfectly (Case 1)."
    return stays_small(study, "attitude", "rad", "angles match their commands", sentence, (1e3, "mrad"), 5)


def realisable(study: PaperStudy) -> Claim:
    """Case 1, Fig. 6."""
    m = study.cases["case1"]
    thrust, least = metric(m, "u", "largest[N]"), metric(m, "rotors", "least[N]")
    torque = max(metric(m, name, "largest[N m]") for name in ("tau_psi", "tau_theta", "tau_phi"))
    sign = "no rotor has to pull" if least >= 0.0 else "a rotor would have to pull"
    return Claim(
        "inputs realisable",
        "Figure 6 describes the control input requirement which is very much realizable (Case 1).",
        f"The thrust is at most {thrust:.2f} N (weight 9.81 N), torques are at most {torque:.2f} N m, and rotors give "
        f"{least:.2f} to {metric(m, 'rotors', 'largest[N]'):.2f} N: {sign}. "
        "The rotors' l = 0.25 m and c = 0.05 m are our choice.",
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
        "The control requirement for yaw angle is tau_psi = 0 and it is seen from Fig. 6 (Case 1).",
        f"tau_psi is at most {yaw:.1e} N m, {100 * yaw / pitch:.2f} % of the largest tau_theta of the flight, and after the "
        f"first second {100 * later[0] / later[1]:.0f} % of the largest from then on. The bound, 1 % of the whole flight's, "
        "is our choice, by the scale of Fig. 6. tau_psi is not exactly zero, because Eq. 67's third row and the torque net "
        "act on yaw.",
        judge(yaw < 0.01 * pitch),
        {"largest_tau_psi[N m]": yaw, "largest_tau_theta[N m]": pitch, "share_after_1_s": float(later[0] / later[1])},
    )


def silent(metrics: Metrics, axes: str, torque: str, angle: str) -> dict[str, float]:
    """How far the other axes, with their torque and angle, move."""
    moved = {f"{axis}[m]": metric(metrics, "position", axis, "largest[m]") for axis in axes}
    return {**moved, f"{torque}[N m]": metric(metrics, torque, "largest[N m]"), f"{angle} error[rad]":
            metric(metrics, "attitude", angle, "largest[rad]")}  # fmt: skip


def values_text(values: dict[str, float]) -> str:
    return units.listed(
        [f"{name.partition('[')[0]} {value:.2g} {name.partition('[')[2][:-1]}" for name, value in values.items()]
    )


def unmoved(*flights: dict[str, float]) -> str:
    """That other axes hardly move, in a sentence."""
    largest_value = max(value for values in flights for value in values.values())
    return f"What should not move stays within {largest_value:.2g} (in m, N m and rad). The bound, 1e-6, is our choice."


def decoupling_x(study: PaperStudy) -> Claim:
    """Case 2, Figs 7 to 9."""
    values = silent(study.cases["case2"], "yz", "tau_phi", "phi")
    return Claim(
        "decoupling in x",
        "The change in x does not make any influence on phi; tau_phi is almost zero; y and z are held (Case 2).",
        f"{unmoved(values)} The largest values are {values_text(values)}.",
        judge(max(values.values()) < 1e-6),
        values,
    )


def decoupling_y_z(study: PaperStudy) -> Claim:
    """Case 2, last sentence."""
    y, z = silent(study.cases["case2_y"], "xz", "tau_theta", "theta"), silent(study.cases["case2_z"], "xy", "tau_phi", "phi")
    return Claim(
        "decoupling in y and z",
        "Simulations for y and z separately yield similar plots that show excellent tracking with decoupling (Case 2).",
        f"{unmoved(y, z)} The largest values are {values_text(y)} when only y moves, and {values_text(z)} when only z moves.",
        judge(max(*y.values(), *z.values()) < 1e-6),
        {"y": y, "z": z},
    )


def wide_range(study: PaperStudy) -> Claim:
    """The remark that closes Section 6."""
    lost = {(t, scale): m for (t, scale, nets), m in study.stress.items() if nets and not completed(m)}
    by_scale = {scale: sum(key[1] == scale for key in lost) for scale in STRESS_SCALES}
    hurt = [f"t_f = {t:g} s, scale {scale:g}" for t, scale in lost if completed(study.stress[t, scale, False])]
    return Claim(
        "a wide range of nonlinearities",
        "NN backstepping controller gives satisfactory results for a wide range of nonlinearities.",
        "Stress flights lost with nets: "
        + units.listed([f"{count} of {len(STRESS_TIMES)} at scale {scale:g}" for scale, count in by_scale.items()])
        + (f". Of these, completed without nets: {' and '.join(hurt)}." if hurt else "."),
        judge(not lost),
        {"diverged_by_scale": {f"{scale:g}": count for scale, count in by_scale.items()}, "nets_hurt": hurt},
    )


def neurons(study: PaperStudy) -> list[Claim]:
    """Neural network parameters."""
    median: dict[str, dict[int, float]] = {}
    larger: dict[str, dict[int, int]] = {}  # in how many seeds the error is larger than with 10
    for flight in ("Case 1", "t_f = 6 s, scale 1"):
        errors = {n: np.array([metric(study.neurons[flight, n, seed], "position_rmse[m]") for seed in SEEDS]) for n in NEURONS}
        median[flight] = {n: float(np.median(values)) for n, values in errors.items()}
        larger[flight] = {n: int((values > errors[10]).sum()) for n, values in errors.items()}
    values = {flight: {str(n): value for n, value in by_count.items()} for flight, by_count in median.items()}
    measured = {
        other: f"With {other} neurons, not 10, the median RMSE is "
        + units.listed(
            [
                f"{units.quantity(m[other], 'm')} against {units.quantity(m[10], 'm')} ({flight}; larger in "
                f"{larger[flight][other]}/{len(SEEDS)} seeds)"
                for flight, m in median.items()
            ]
        )
        + "."
        for other in (8, 12)
    }
    worse, no_better = all(m[8] > m[10] for m in median.values()), all(m[12] >= 0.99 * m[10] for m in median.values())
    eight = "Using eight neurons the performance deteriorated."
    twelve = "A simulation using 12 neurons did not improve performance."
    return [
        Claim("8 neurons are worse than 10", eight, measured[8], judge(worse), values),
        Claim("12 neurons are no better than 10", twelve, measured[12], judge(no_better), values),
    ]


__all__ = ["Claim", "ClaimVerdict", "check_claims"]


def answer(claims: Sequence[Claim]) -> str:
    """The result for the paper's claims."""
    count = {kind: sum(claim.verdict is kind for claim in claims) for kind in ClaimVerdict}
    hold, fail, undecided = (count[kind] for kind in (ClaimVerdict.HOLDS, ClaimVerdict.FAILS, ClaimVerdict.UNDECIDED))
    return (
        f"Of {len(claims)} claims that the paper makes about its simulations, {hold} hold, {fail} fail, and {undecided} "
        "cannot be decided, when reproduced with gains and other values of our choice where the paper gives none."
    )


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
