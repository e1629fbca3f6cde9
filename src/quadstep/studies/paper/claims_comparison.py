"""Claims of Case 3: the paper's controller compared with that of its reference [11]."""

from collections.abc import Callable, Mapping
from math import degrees

import numpy as np

from quadstep.metrics.registry import Metrics, metric
from quadstep.metrics.statistics import finite
from quadstep.report.units import listed
from quadstep.studies.paper.cases import NETS_OFF, Claim, PaperStudy, completed, judge_all

OURS = "the paper's controller"

VARIED = "Case 3, 5 starts, 2 gain sets"
"""What was flown, in words."""

Answers = dict[str, tuple[bool | None, str]]
"""By start and gains of [11]: whether a claim is true there (None: the flights do not differ), and why."""


def by_start(study: PaperStudy, true: Callable[[Metrics, Metrics], bool | None]) -> Answers:
    """true: of the flights of the paper's controller and of [11]. The one that is lost where the other completes is worse."""
    table: Answers = {}
    for (where, name), old in study.starts.items():
        if not name.startswith("nested"):
            continue
        new = study.starts[where, "adaptive"]
        ours, theirs = completed(new), completed(old)
        answer = true(new, old) if ours and theirs else None if ours is theirs else ours
        ends = sorted(((OURS, new), ("[11]", old)), key=lambda end: completed(end[1]))
        why = [
            f"{who} completes" if completed(m) else f"{who} is lost at {m['ended[s]']:g} s ({m['outcome']})" for who, m in ends
        ]
        table[f"{where}; {name}"] = answer, " and ".join(why) * (not (ours and theirs))
    return table


def dependence(table: Answers) -> str:
    """How the verdict depends on start and gains, in a few words."""
    answers = [answer for answer, _ in table.values()]
    words = ((True, ("agrees", "agree")), (False, ("disagrees", "disagree")), (None, ("is equal", "are equal")))
    shown = [f"{count} {said[count > 1]}" for kind, said in words if (count := answers.count(kind))]
    if False in answers and all(f"{OURS} is lost" in why for answer, why in table.values() if answer is False):
        shown[-1 - (None in answers)] += f" ({OURS} is lost there)"
    return f"; of {len(table)} variations, {listed(shown)}."


def losses(by_start: Mapping[str, Mapping[str, str]]) -> str:
    """In sentences, from which starts a controller is lost, out of a claim's answers."""
    starts: dict[str, dict[str, None]] = {}
    for where, said in by_start.items():
        starts.setdefault(said["why"], {})[where.partition("; ")[0]] = None
    return " ".join(f"From {listed(list(places))}, {why}." for why, places in starts.items() if why)


def table_values(table: Answers) -> dict[str, dict[str, str]]:
    """The same for machines and for the table of starts."""
    words = {True: "yes", False: "no", None: "equal"}
    return {where: {"true": words[answer], "why": why} for where, (answer, why) in table.items()}


def compared(
    study: PaperStudy, name: str, sentence: str, ours: Callable[[Metrics], float], unit: str, text: str,
    scale: float = 1.0, more: str = "",
) -> Claim:  # fmt: skip
    """A measure of Case 3 that should be smaller than under [11]. text: of both, in `scale` units."""
    new, old = (ours(study.cases[f"case3_{one}"]) for one in ("adaptive", "nested"))
    table = by_start(study, lambda a, b: None if ours(a) == ours(b) else ours(a) < ours(b))
    values = {f"adaptive[{unit}]": finite(new), f"nested[{unit}]": finite(old), "by_start": table_values(table)}
    measured = text.format(scale * new, scale * old) + dependence(table) + more
    return Claim(name, VARIED, sentence, measured, judge_all(answer for answer, _ in table.values()), values)


def altitude(study: PaperStudy) -> Claim:
    """Case 3, Fig. 10."""
    sentence = "The controller proposed in this paper follows the trajectory z_d more accurately than that of [11]."
    text = "The RMSE in z is {:.2g} mm with the paper's controller and {:.2g} mm with [11]"
    return compared(
        study, "better z tracking than [11]", sentence, lambda m: metric(m, "position", "z", "rmse[m]"), "m", text, 1e3
    )


def sideways(study: PaperStudy) -> Claim:
    """Case 3, Fig. 10."""

    def miss(m: Metrics) -> float:
        return float(max(metric(m, "position", "x", "rmse[m]"), metric(m, "position", "y", "rmse[m]")))

    sentence = "NN backstepping controller also has less position error magnitude in x and y directions."
    text = "The larger RMSE of x and y is {:.0f} mm with the paper's controller and {:.0f} mm with [11]"
    return compared(study, "smaller x and y error than [11]", sentence, miss, "m", text, 1e3)


def settled(metrics: Metrics) -> float:
    """Time from which roll and pitch both stay level to within 5 mrad [s]; infinite if never."""
    times: list[float | None] = [metric(metrics, "attitude", angle, "angle_settling[s]") for angle in ("theta", "phi")]
    return max(np.inf if time is None else time for time in times)


def settling(study: PaperStudy) -> Claim:
    """Case 3, Fig. 11."""
    sentence = "The attitude stabilization occurs more quickly for the controller proposed in this paper."
    text = "Roll and pitch stay within 5 mrad of level after {:.2f} s with the paper's controller and {:.2f} s with [11]"
    return compared(study, "faster attitude settling than [11]", sentence, settled, "s", text)


def smoothness(study: PaperStudy) -> Claim:
    """Case 3, Fig. 12."""
    sentence = (
        "The thrust input shows the chattering due to the nested saturation controller; ours generates a smoother control."
    )
    text = "The total variation of u is {:.2f} N with the paper's controller and {:.2f} N with [11]"
    more = " The thrust law of [11] is a linear PD, so saturation cannot make it chatter."
    return compared(
        study, "smoother thrust than [11]", sentence, lambda m: metric(m, "u", "total_variation[N]"), "N", text, more=more
    )


def peaks(metrics: Metrics) -> tuple[float, float]:
    """Largest tilt [rad], and largest roll or pitch torque [N m]."""
    return metric(metrics, "largest_tilt[rad]"), max(
        metric(metrics, name, "largest[N m]") for name in ("tau_theta", "tau_phi")
    )


QUICKLY = 10.0
"""In what time transients vanish that "vanish quickly", by our choice [s]."""


def larger_and_gone(new: Metrics, old: Metrics) -> bool | None:
    """Whether both peaks are as large as under [11], one larger, and roll and pitch level soon; None: they are equal."""
    ours, theirs = peaks(new), peaks(old)
    larger = all(a >= b for a, b in zip(ours, theirs, strict=True))
    return None if ours == theirs else larger and settled(new) < QUICKLY


def transients(study: PaperStudy) -> Claim:
    """Case 3, Figs 11 and 12."""
    (tilt, torque), (tilt_old, torque_old) = peaks(study.cases["case3_adaptive"]), peaks(study.cases["case3_nested"])
    table = by_start(study, larger_and_gone)
    return Claim(
        "larger transients that vanish",
        VARIED,
        "Initial variations in attitude and torque are higher for our controller than that in [11]; they vanish quickly.",
        f"The tilt reaches {degrees(tilt):.0f}° and the torque {torque:,.0f} N m with {OURS}, {degrees(tilt_old):.0f}° and "
        f"{torque_old:.1f} N m with [11]{dependence(table)} Roll and pitch are level after "
        f"{settled(study.cases['case3_adaptive']):.1f} s; the bound, {QUICKLY:g} s, is our choice.",
        judge_all(answer for answer, _ in table.values()),
        {"tilt[rad]": [tilt, tilt_old], "torque[N m]": [torque, torque_old], "by_start": table_values(table)},
    )


def transient_cause(study: PaperStudy) -> Claim:
    """Case 3, the reason that the paper gives: without the nets a peak is gone if it is below 0.8 of that with them."""
    (tilt, torque), (tilt_off, torque_off) = peaks(study.cases["case3_adaptive"]), peaks(study.further["case3 without nets"])
    pairs = {where: (m, study.starts[where, NETS_OFF]) for (where, name), m in study.starts.items() if name == "adaptive"}
    gone = {where: tuple(b < 0.8 * a for a, b in zip(*map(peaks, pair), strict=True)) for where, pair in pairs.items()}
    moving = {where: answers for where, answers in gone.items() if any(peaks(pairs[where][0]))}
    counts = [sum(answer[i] for answer in moving.values()) for i in range(2)]
    lost = [where for where, (on, off) in pairs.items() if completed(off) and not completed(on)]
    return Claim(
        "transients caused by the nets",
        "Case 3, 5 starts",
        "This is because of the transient phase of NN weights from their initial assigned values of zero.",
        f"Of {len(moving)} starts that disturb the attitude, switching the nets off lowers the peak of the tilt by more than "
        f"a fifth (our bound) in {counts[0]}, and that of the torque in {counts[1]}; the claim needs both. In Case 3 they "
        f"reach {degrees(tilt_off):.0f}° and {torque_off:,.0f} N m with nets off, {degrees(tilt):.0f}° and {torque:,.0f} N m "
        f"with nets on.{f' Lost with nets, and completed without: {listed(lost)}.' if lost else ''}",
        judge_all(all(answers) for answers in moving.values()),
        {"nets_on": [tilt, torque], "nets_off": [tilt_off, torque_off], "gone_without_nets": gone},
    )
