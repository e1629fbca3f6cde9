"""What Section 6 of the paper claims, what was measured, and the verdict."""

from enum import StrEnum
from typing import Any, NamedTuple

import numpy as np

from quadstep.flight.log import FlightLog
from quadstep.study.cases import NEURONS, SEEDS, STRESS_SCALES, STRESS_TIMES, case_1
from quadstep.study.study import Metrics, Study, completed


class Verdict(StrEnum):
    """What the flights say of a sentence."""

    HOLDS = "holds"
    FAILS = "fails"
    UNDECIDED = "cannot be decided from the text"


class Claim(NamedTuple):
    """name: short. sentence: the paper's. measured: one line with numbers. values: the same for machines."""

    name: str
    sentence: str
    measured: str
    verdict: Verdict
    values: dict[str, Any]


def judge(holds: bool) -> Verdict:
    """Holds or fails."""
    return Verdict.HOLDS if holds else Verdict.FAILS


def check_claims(study: Study) -> list[Claim]:
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


def largest(metrics: Metrics, group: str, unit: str) -> dict[str, float]:
    """Largest error by axis."""
    return {axis: values[f"largest[{unit}]"] for axis, values in metrics[group].items()}


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
        f"at t_f: distance to the target {miss:g} m, speed {speed:g} m/s, acceleration {rate:g} m/s^2",
        judge(max(miss, speed, rate) < 1e-12),
        {"distance[m]": miss, "speed[m/s]": speed, "acceleration[m/s^2]": rate},
    )


def tracking(study: Study) -> Claim:
    """Case 1, Fig. 4."""
    errors = largest(study.cases["case1"], "position", "m")
    return Claim(
        "near-perfect tracking",
        "The tracking is almost perfect as well as the tracking errors are significantly small (Case 1).",
        "largest error " + ", ".join(f"{a} {1e6 * e:.2g} um" for a, e in errors.items()) + " (bound taken: 1 mm)",
        judge(max(errors.values()) < 1e-3),
        {"largest_error[m]": errors},
    )


def injected(log: FlightLog) -> float:
    """Largest entry of the paper's disturbance (Eq. 67, scale 1) along a flight [N, N m]."""
    products = log.columns("x_dot", "y_dot", "z_dot") * log.columns("phi_dot", "theta_dot", "psi_dot")
    return float(np.abs(products).max())


def compensation(study: Study) -> Claim:
    """Case 1's disturbance, and the stress flights at scale 1."""
    disturbance = injected(study.logs["case1"])
    with_nets, without = study.cases["case1"]["position_rmse[m]"], study.further["case1 without nets"]["position_rmse[m]"]
    ratios = {
        f"t_f = {t:g} s": study.stress[t, 1.0, False]["position_rmse[m]"] / study.stress[t, 1.0, True]["position_rmse[m]"]
        for t in STRESS_TIMES
        if completed(study.stress[t, 1.0, True]) and completed(study.stress[t, 1.0, False])
    }
    return Claim(
        "nonlinearities compensated by the nets",
        "This is in spite of the unknown nonlinearities, which are effectively compensated by the neural networks (Case 1).",
        f"Case 1 injects at most {disturbance:.1e} N and tracks to {1e6 * without:.0f} um RMSE with nets off, "
        f"{1e6 * with_nets:.1f} um on: it does not test them. Faster flights at scale 1 do: nets cut the RMSE "
        f"{min(ratios.values()):.0f} to {max(ratios.values()):.0f} times",
        Verdict.UNDECIDED,
        {"largest_disturbance[N]": disturbance, "rmse_nets_on[m]": with_nets, "rmse_nets_off[m]": without,
         "rmse_ratio_off_to_on": ratios},
    )  # fmt: skip


def angles(study: Study) -> Claim:
    """Case 1, Fig. 5."""
    errors = largest(study.cases["case1"], "attitude", "rad")
    return Claim(
        "angles match their commands",
        "Again the angles match their command values nearly perfectly (Case 1).",
        "largest error " + ", ".join(f"{a} {1e3 * e:.2g} mrad" for a, e in errors.items()) + " (bound taken: 5 mrad)",
        judge(max(errors.values()) < 5e-3),
        {"largest_error[rad]": errors},
    )


def realisable(study: Study) -> Claim:
    """Case 1, Fig. 6."""
    m = study.cases["case1"]
    thrust, least = m["u"]["largest[N]"], m["rotors"]["least[N]"]
    torque = max(m[name]["largest[N m]"] for name in ("tau_psi", "tau_theta", "tau_phi"))
    return Claim(
        "inputs realisable",
        "Figure 6 describes the control input requirement which is very much realizable (Case 1).",
        f"thrust at most {thrust:.2f} N (weight 9.81 N), torques at most {torque:.2f} N m, rotors "
        f"{least:.2f} to {m['rotors']['largest[N]']:.2f} N at l = 0.25 m, c = 0.05 m (our choice): never negative",
        judge(least >= 0.0 and thrust < 2.0 * 9.81),
        {"largest_thrust[N]": thrust, "largest_torque[N m]": torque, "rotors[N]": m["rotors"]},
    )


def no_yaw_torque(study: Study) -> Claim:
    """Case 1, Fig. 6."""
    m = study.cases["case1"]
    yaw, pitch = m["tau_psi"]["largest[N m]"], m["tau_theta"]["largest[N m]"]
    return Claim(
        "tau_psi = 0",
        "The control requirement for yaw angle is tau_psi = 0 and it is seen from Fig. 6 (Case 1).",
        f"tau_psi at most {yaw:.1e} N m, {100 * yaw / pitch:.2f} % of tau_theta (bound taken: 1 %); not exactly zero: "
        "Eq. 67's third row and the torque net act on yaw",
        judge(yaw < 0.01 * pitch),
        {"largest_tau_psi[N m]": yaw, "largest_tau_theta[N m]": pitch},
    )


def silent(metrics: Metrics, axes: str, torque: str, angle: str) -> dict[str, float]:
    """How much the other axes, their torque and angle move."""
    moved = {f"{axis}[m]": metrics["position"][axis]["largest[m]"] for axis in axes}
    return {**moved, f"{torque}[N m]": metrics[torque]["largest[N m]"], f"{angle} error[rad]":
            metrics["attitude"][angle]["largest[rad]"]}  # fmt: skip


def shown(values: dict[str, float]) -> str:
    """Values with their names in one line."""
    return ", ".join(f"{name.partition('[')[0]} {value:.1e} {name.partition('[')[2][:-1]}" for name, value in values.items())


def decoupling_x(study: Study) -> Claim:
    """Case 2, Figs 7 to 9."""
    values = silent(study.cases["case2"], "yz", "tau_phi", "phi")
    return Claim(
        "decoupling in x",
        "The change in x does not make any influence on phi; tau_phi is almost zero; y and z are held (Case 2).",
        "largest in the silent channels: " + shown(values) + " (bound taken: 1e-6)",
        judge(max(values.values()) < 1e-6),
        values,
    )


def decoupling_y_z(study: Study) -> Claim:
    """Case 2, last sentence."""
    y, z = silent(study.cases["case2_y"], "xz", "tau_theta", "theta"), silent(study.cases["case2_z"], "xy", "tau_phi", "phi")
    return Claim(
        "decoupling in y and z",
        "Simulations for y and z separately yield similar plots that show excellent tracking with decoupling (Case 2).",
        f"y alone: {shown(y)}; z alone: {shown(z)}",
        judge(max(*y.values(), *z.values()) < 1e-6),
        {"y": y, "z": z},
    )


def by_start(study: Study, ours: Any, smaller: bool = True) -> dict[str, str]:
    """For each start and gain set of [11]: whether the measure `ours` is smaller (or larger) for the adaptive controller.

    Answers yes, no, equal, or who did not finish.
    """
    table = {}
    for (where, name), nested in study.starts.items():
        if name == "adaptive":
            continue
        adaptive = study.starts[where, "adaptive"]
        if not completed(adaptive):
            answer = f"adaptive diverged at {adaptive['ended[s]']:g} s ({adaptive['outcome']})"
        elif not completed(nested):
            answer = f"nested diverged at {nested['ended[s]']:g} s ({nested['outcome']})"
        else:
            a, b = ours(adaptive), ours(nested)
            answer = "equal" if a == b else "yes" if (a < b) == smaller else "no"
        table[f"{where}; {name}"] = answer
    return table


def over_starts(table: dict[str, str]) -> Verdict:
    """The paper states neither start nor gains: a sentence holds if it does wherever both controllers finish and differ."""
    answers = set(table.values()) & {"yes", "no"}
    return Verdict.UNDECIDED if len(answers) != 1 else judge(answers == {"yes"})


def dependence(table: dict[str, str]) -> str:
    """How the verdict depends on start and gains, in a few words."""
    counts = {answer: list(table.values()).count(answer) for answer in ("yes", "no", "equal")}
    lost = len(table) - sum(counts.values())
    shown = ", ".join(f"{count} {answer}" for answer, count in counts.items() if count)
    return f"; over {len(table)} starts and gain sets: {shown}" + (f", {lost} with a divergence" if lost else "")


def altitude(study: Study) -> Claim:
    """Case 3, Fig. 10."""
    new, old = (study.cases[name]["position"]["z"]["rmse[m]"] for name in ("case3_adaptive", "case3_nested"))
    table = by_start(study, lambda m: m["position"]["z"]["rmse[m]"])
    return Claim(
        "better z tracking than [11]",
        "The controller proposed in this paper follows the trajectory z_d more accurately than that of [11] (Case 3).",
        f"RMSE in z {1e3 * new:.2g} mm against {1e3 * old:.2g} mm" + dependence(table),
        over_starts(table),
        {"adaptive[m]": new, "nested[m]": old, "by_start": table},
    )


def sideways(study: Study) -> Claim:
    """Case 3, Fig. 10."""

    def miss(m: Metrics) -> float:
        return float(max(m["position"]["x"]["rmse[m]"], m["position"]["y"]["rmse[m]"]))

    new, old = miss(study.cases["case3_adaptive"]), miss(study.cases["case3_nested"])
    table = by_start(study, miss)
    return Claim(
        "smaller x and y error than [11]",
        "NN backstepping controller also has less position error magnitude in x and y directions (Case 3).",
        f"larger RMSE of x and y {new:.3f} m against {old:.3f} m" + dependence(table),
        over_starts(table),
        {"adaptive[m]": new, "nested[m]": old, "by_start": table},
    )


def settled(metrics: Metrics) -> float:
    """When roll and pitch both stay level to 5 mrad [s]; infinite if never."""
    times = [metrics["attitude"][angle]["angle_settling[s]"] for angle in ("theta", "phi")]
    return max(np.inf if time is None else time for time in times)


def settling(study: Study) -> Claim:
    """Case 3, Fig. 11."""
    new, old = settled(study.cases["case3_adaptive"]), settled(study.cases["case3_nested"])
    table = by_start(study, settled)
    return Claim(
        "faster attitude settling than [11]",
        "The attitude stabilization occurs more quickly for the controller proposed in this paper (Case 3).",
        f"roll and pitch level to 5 mrad from {new:.2f} s against {old:.2f} s" + dependence(table),
        over_starts(table),
        {"adaptive[s]": finite_or_none(new), "nested[s]": finite_or_none(old), "by_start": table},
    )


def finite_or_none(value: float) -> float | None:
    """For JSON, which knows no infinity."""
    return value if np.isfinite(value) else None


def smoothness(study: Study) -> Claim:
    """Case 3, Fig. 12."""

    def roughness(m: Metrics) -> float:
        return float(m["u"]["total_variation[N]"])

    new, old = roughness(study.cases["case3_adaptive"]), roughness(study.cases["case3_nested"])
    table = by_start(study, roughness)
    return Claim(
        "smoother thrust than [11]",
        "The thrust input shows the chattering due to the nested saturation controller; ours generates a smoother control.",
        f"total variation of u {new:.2f} N against {old:.2f} N" + dependence(table) + "; [11]'s thrust law is a linear PD, "
        "so saturation cannot make it chatter",
        over_starts(table),
        {"adaptive[N]": new, "nested[N]": old, "by_start": table},
    )


def peaks(metrics: Metrics) -> tuple[float, float]:
    """Largest tilt [rad], and largest roll or pitch torque [N m]."""
    return metrics["largest_tilt[rad]"], max(metrics[name]["largest[N m]"] for name in ("tau_theta", "tau_phi"))


def transients(study: Study) -> Claim:
    """Case 3, Figs 11 and 12."""
    (tilt, torque), (tilt_old, torque_old) = peaks(study.cases["case3_adaptive"]), peaks(study.cases["case3_nested"])
    vanished = settled(study.cases["case3_adaptive"])
    table = by_start(study, peaks, smaller=False)
    return Claim(
        "larger early transients",
        "Initial variations in attitude and torque are higher for our controller than that in [11]; they vanish quickly.",
        f"largest tilt {tilt:.2f} rad against {tilt_old:.2f}, torque {torque:.0f} N m against {torque_old:.1f}; gone after "
        f"{vanished:.1f} s" + dependence(table),
        over_starts(table) if vanished < 10.0 else Verdict.FAILS,
        {"tilt[rad]": [tilt, tilt_old], "torque[N m]": [torque, torque_old], "by_start": table},
    )


def transient_cause(study: Study) -> Claim:
    """Case 3, the reason given."""
    (tilt, torque), (tilt_off, torque_off) = peaks(study.cases["case3_adaptive"]), peaks(study.further["case3 without nets"])
    return Claim(
        "transients caused by the nets",
        "This is because of the transient phase of NN weights from their initial assigned values of zero.",
        f"nets off: peaks of {tilt_off:.2f} rad and {torque_off:.0f} N m; on: {tilt:.2f} rad and {torque:.0f} N m. The nets "
        "add to the tilt; the torque comes from the start off the path and the gains",
        judge(tilt_off < 0.8 * tilt and torque_off < 0.8 * torque),
        {"nets_on": [tilt, torque], "nets_off": [tilt_off, torque_off]},
    )


def wide_range(study: Study) -> Claim:
    """The remark that closes Section 6."""
    lost = {(t, scale): m for (t, scale, nets), m in study.stress.items() if nets and not completed(m)}
    by_scale = {scale: sum(key[1] == scale for key in lost) for scale in STRESS_SCALES}
    hurt = [f"t_f = {t:g} s, scale {scale:g}" for t, scale in lost if completed(study.stress[t, scale, False])]
    return Claim(
        "a wide range of nonlinearities",
        "NN backstepping controller gives satisfactory results for a wide range of nonlinearities.",
        "of the stress flights with nets "
        + ", ".join(f"{count} of {len(STRESS_TIMES)} diverge at scale {scale:g}" for scale, count in by_scale.items())
        + (f"; without nets the controller survives {' and '.join(hurt)}" if hurt else ""),
        judge(not lost),
        {"diverged_by_scale": {f"{scale:g}": count for scale, count in by_scale.items()}, "nets_hurt": hurt},
    )


def neurons(study: Study) -> list[Claim]:
    """Neural network parameters."""
    median: dict[str, dict[int, float]] = {}
    for flight in ("Case 1", "t_f = 6 s, scale 1"):
        errors = {n: [study.neurons[flight, n, seed]["position_rmse[m]"] for seed in SEEDS] for n in NEURONS}
        median[flight] = {n: float(np.median(values)) for n, values in errors.items()}
    text = "; ".join(
        f"{flight}: " + ", ".join(f"{n}: {1e3 * value:.2g} mm" for n, value in values.items())
        for flight, values in median.items()
    )
    values = {flight: {str(n): value for n, value in by_count.items()} for flight, by_count in median.items()}
    measured = f"median RMSE over {len(SEEDS)} seeds by neurons, {text}"
    return [
        Claim(
            "8 neurons are worse than 10",
            "Using eight neurons the performance deteriorated.",
            measured,
            judge(all(m[8] > m[10] for m in median.values())),
            values,
        ),
        Claim(
            "12 neurons are no better than 10",
            "A simulation using 12 neurons did not improve performance.",
            measured,
            judge(all(m[12] >= 0.99 * m[10] for m in median.values())),
            values,
        ),
    ]
