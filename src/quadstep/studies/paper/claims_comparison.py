"""Claims of Case 3: the paper's controller compared with that of its reference [11]."""

from collections.abc import Callable
from math import degrees

import numpy as np
from numpy.typing import ArrayLike

from quadstep.metrics.registry import Metrics, metric
from quadstep.metrics.statistics import finite
from quadstep.report.units import listed
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
    answers = list(table.values())
    counts = {word: answers.count(answer) for answer, word in (("yes", "agree"), ("no", "disagree"), ("equal", "are equal"))}
    lost = len(table) - sum(counts.values())
    ended = [f"in {lost} a controller is lost"] if lost else []
    shown = listed([*(f"{count} {word}" for word, count in counts.items() if count), *ended])
    return f"; of {len(table)} variations of start and gains, {shown}."


def compared(
    study: PaperStudy, name: str, sentence: str, ours: Callable[[Metrics], float], unit: str, text: str,
    scale: float = 1.0, more: str = "",
) -> Claim:  # fmt: skip
    """A measure of Case 3 that should be smaller than under [11]. text: of both, in `scale` units."""
    new, old = (ours(study.cases[f"case3_{one}"]) for one in ("adaptive", "nested"))
    table = by_start(study, ours)
    values = {f"adaptive[{unit}]": finite(new), f"nested[{unit}]": finite(old), "by_start": table}
    measured = text.format(scale * new, scale * old) + dependence(table) + more
    return Claim(name, sentence, measured, over_starts(table), values)


def altitude(study: PaperStudy) -> Claim:
    """Case 3, Fig. 10."""
    sentence = "The controller proposed in this paper follows the trajectory z_d more accurately than that of [11] (Case 3)."
    text = "The RMSE in z is {:.2g} mm, against {:.2g} mm"
    return compared(
        study, "better z tracking than [11]", sentence, lambda m: metric(m, "position", "z", "rmse[m]"), "m", text, 1e3
    )


def sideways(study: PaperStudy) -> Claim:
    """Case 3, Fig. 10."""

    def miss(m: Metrics) -> float:
        return float(max(metric(m, "position", "x", "rmse[m]"), metric(m, "position", "y", "rmse[m]")))

    sentence = "NN backstepping controller also has less position error magnitude in x and y directions (Case 3)."
    text = "The larger RMSE of x and y is {:.3f} m, against {:.3f} m"
    return compared(study, "smaller x and y error than [11]", sentence, miss, "m", text)


def settled(metrics: Metrics) -> float:
    """Time from which roll and pitch both stay level to within 5 mrad [s]; infinite if never."""
    times: list[float | None] = [metric(metrics, "attitude", angle, "angle_settling[s]") for angle in ("theta", "phi")]
    return max(np.inf if time is None else time for time in times)


def settling(study: PaperStudy) -> Claim:
    """Case 3, Fig. 11."""
    sentence = "The attitude stabilization occurs more quickly for the controller proposed in this paper (Case 3)."
    text = "Roll and pitch are level to 5 mrad from {:.2f} s, against {:.2f} s"
    return compared(study, "faster attitude settling than [11]", sentence, settled, "s", text)


def smoothness(study: PaperStudy) -> Claim:
    """Case 3, Fig. 12."""
    sentence = (
        "The thrust input shows the chattering due to the nested saturation controller; ours generates a smoother control."
    )
    text = "The total variation of u is {:.2f} N, against {:.2f} N"
    more = " The thrust law of [11] is a linear PD, so saturation cannot make it chatter."
    return compared(
        study, "smoother thrust than [11]", sentence, lambda m: metric(m, "u", "total_variation[N]"), "N", text, more=more
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
        f"The tilt reaches {degrees(tilt):.0f}°, against {degrees(tilt_old):.0f}°, and the torque {torque:.0f} N m, against "
        f"{torque_old:.1f} N m{dependence(table)} Roll and pitch are level after {vanished:.1f} s.",
        over_starts(table) if vanished < 10.0 else ClaimVerdict.FAILS,
        {"tilt[rad]": [tilt, tilt_old], "torque[N m]": [torque, torque_old], "by_start": table},
    )


def transient_cause(study: PaperStudy) -> Claim:
    """Case 3, the reason that the paper gives."""
    (tilt, torque), (tilt_off, torque_off) = peaks(study.cases["case3_adaptive"]), peaks(study.further["case3 without nets"])
    of_tilt, of_torque = judge(tilt_off < 0.8 * tilt), judge(torque_off < 0.8 * torque)
    return Claim(
        "transients caused by the nets",
        "This is because of the transient phase of NN weights from their initial assigned values of zero.",
        f"With nets off, tilt and torque reach {degrees(tilt_off):.0f}° and {torque_off:.0f} N m, with nets on "
        f"{degrees(tilt):.0f}° and {torque:.0f} N m. The claim {of_tilt.value} for the tilt and {of_torque.value} for the "
        "torque; it needs both.",
        judge(of_tilt is of_torque is ClaimVerdict.HOLDS),
        {"nets_on": [tilt, torque], "nets_off": [tilt_off, torque_off]},
    )
