"""Claims of Case 3: the paper's controller compared with that of its reference [11]."""

from collections.abc import Callable
from math import degrees

import numpy as np
from numpy.typing import ArrayLike

from quadstep.metrics.registry import Metrics, metric
from quadstep.metrics.statistics import finite
from quadstep.studies.paper.cases import Claim, ClaimVerdict, PaperStudy, completed, judge


def by_start(study: PaperStudy, ours: Callable[[Metrics], ArrayLike], smaller: bool = True) -> dict[str, str]:
    """For each start and gain set of [11]: whether the measure (all of several) is smaller, or larger, for the adaptive one.

    Answers yes, no, equal, or which controller did not finish.
    """
    table = {}
    for (where, name), nested in study.starts.items():
        if name == "adaptive":
            continue
        adaptive = study.starts[where, "adaptive"]
        if not completed(adaptive):
            answer = f"adaptive was lost at {adaptive['ended[s]']:g} s ({adaptive['outcome']})"
        elif not completed(nested):
            answer = f"nested was lost at {nested['ended[s]']:g} s ({nested['outcome']})"
        else:
            a, b = np.atleast_1d(ours(adaptive)), np.atleast_1d(ours(nested))
            answer = "equal" if np.all(a == b) else "yes" if np.all(a <= b if smaller else a >= b) else "no"
        table[f"{where}; {name}"] = answer
    return table


def over_starts(table: dict[str, str]) -> ClaimVerdict:
    """The paper gives neither start nor gains: a sentence holds if it does wherever both controllers finish and differ."""
    answers = set(table.values()) & {"yes", "no"}
    return ClaimVerdict.UNDECIDED if len(answers) != 1 else judge(answers == {"yes"})


def dependence(table: dict[str, str]) -> str:
    """How the verdict depends on start and gains, in a few words."""
    counts = {answer: list(table.values()).count(answer) for answer in ("yes", "no", "equal")}
    lost = len(table) - sum(counts.values())
    shown = ", ".join(f"{count} {answer}" for answer, count in counts.items() if count)
    return f"; in {len(table)} variations: {shown}" + (f", a controller lost in {lost}" if lost else "")


def altitude(study: PaperStudy) -> Claim:
    """Case 3, Fig. 10."""
    new, old = (metric(study.cases[name], "position", "z", "rmse[m]") for name in ("case3_adaptive", "case3_nested"))
    table = by_start(study, lambda m: metric(m, "position", "z", "rmse[m]"))
    return Claim(
        "better z tracking than [11]",
        "The controller proposed in this paper follows the trajectory z_d more accurately than that of [11] (Case 3).",
        f"RMSE in z {1e3 * new:.2g} mm against {1e3 * old:.2g} mm" + dependence(table),
        over_starts(table),
        {"adaptive[m]": new, "nested[m]": old, "by_start": table},
    )


def sideways(study: PaperStudy) -> Claim:
    """Case 3, Fig. 10."""

    def miss(m: Metrics) -> float:
        return float(max(metric(m, "position", "x", "rmse[m]"), metric(m, "position", "y", "rmse[m]")))

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
    """Time from which roll and pitch both stay level to within 5 mrad [s]; infinite if never."""
    times: list[float | None] = [metric(metrics, "attitude", angle, "angle_settling[s]") for angle in ("theta", "phi")]
    return max(np.inf if time is None else time for time in times)


def settling(study: PaperStudy) -> Claim:
    """Case 3, Fig. 11."""
    new, old = settled(study.cases["case3_adaptive"]), settled(study.cases["case3_nested"])
    table = by_start(study, settled)
    return Claim(
        "faster attitude settling than [11]",
        "The attitude stabilization occurs more quickly for the controller proposed in this paper (Case 3).",
        f"roll and pitch level to 5 mrad from {new:.2f} s against {old:.2f} s" + dependence(table),
        over_starts(table),
        {"adaptive[s]": finite(new), "nested[s]": finite(old), "by_start": table},
    )


def smoothness(study: PaperStudy) -> Claim:
    """Case 3, Fig. 12."""

    def roughness(m: Metrics) -> float:
        return float(metric(m, "u", "total_variation[N]"))

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
    return metric(metrics, "largest_tilt[rad]"), max(
        metric(metrics, name, "largest[N m]") for name in ("tau_theta", "tau_phi")
    )


def transients(study: PaperStudy) -> Claim:
    """Case 3, Figs 11 and 12."""
    (tilt, torque), (tilt_old, torque_old) = peaks(study.cases["case3_adaptive"]), peaks(study.cases["case3_nested"])
    vanished = settled(study.cases["case3_adaptive"])
    table = by_start(study, peaks, smaller=False)
    return Claim(
        "larger early transients",
        "Initial variations in attitude and torque are higher for our controller than that in [11]; they vanish quickly.",
        f"largest tilt {degrees(tilt):.0f}° against {degrees(tilt_old):.0f}°, torque {torque:.0f} N m against "
        f"{torque_old:.1f}; gone after "
        f"{vanished:.1f} s" + dependence(table),
        over_starts(table) if vanished < 10.0 else ClaimVerdict.FAILS,
        {"tilt[rad]": [tilt, tilt_old], "torque[N m]": [torque, torque_old], "by_start": table},
    )


def transient_cause(study: PaperStudy) -> Claim:
    """Case 3, the reason that the paper gives."""
    (tilt, torque), (tilt_off, torque_off) = peaks(study.cases["case3_adaptive"]), peaks(study.further["case3 without nets"])
    return Claim(
        "transients caused by the nets",
        "This is because of the transient phase of NN weights from their initial assigned values of zero.",
        f"nets off: peaks of {degrees(tilt_off):.0f}° and {torque_off:.0f} N m; on: {degrees(tilt):.0f}° and "
        f"{torque:.0f} N m. The nets add to the tilt; the torque comes from the start off the path and the gains",
        judge(tilt_off < 0.8 * tilt and torque_off < 0.8 * torque),
        {"nets_on": [tilt, torque], "nets_off": [tilt_off, torque_off]},
    )
