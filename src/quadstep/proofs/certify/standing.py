"""What a flight says of Theorem 5.1, in words, and the term of L_dot that decides it."""

import numpy as np

from quadstep.interfaces.closed_loop import Outcome
from quadstep.proofs.certify.certificate import NO_RATES, FlightCertificate
from quadstep.proofs.plain import Array, Mask
from quadstep.report import units
from quadstep.report.markup import Fact
from quadstep.report.panel import FAINT, seen_from


def kind(c: FlightCertificate) -> str:
    """lost, or what the flight says of the theorem."""
    return standing(c) if c.outcome is Outcome.COMPLETED else "lost"


def standing(c: FlightCertificate) -> str:
    """conditions broken, untested, sign consistent, rising between samples or contradicted, for the samples looked at."""
    if contradicting(c).any():
        return "contradicted"
    if c.conditions.broken():
        return "conditions broken"
    if not c.outside.any():
        return "untested"
    return "sign consistent" if (periods_outside(c) < 0.0).all() else "rising between samples"


def contradicting(c: FlightCertificate) -> Mask:
    """The samples at which L should fall and does not; outside the ball as printed, where only the printed conditions hold."""
    rising = c.outside & ~(c.lyapunov.rate < 0.0)
    if not c.conditions.broken():
        return rising
    return rising & (c.r > (c.b_r_printed or np.inf)) & c.conditions.printed_hold


def periods_outside(c: FlightCertificate) -> Array:
    """(L_next - L) / period of the control periods that begin and end outside b_r [W]."""
    return c.lyapunov.differenced[c.outside[:-1] & c.outside[1:]]


def of_ball(c: FlightCertificate) -> str:
    """What |r| did about the ball b_r."""
    time, most = c.history.t, c.r.max()
    if c.b_r is None:
        return f"|r| reached {most:.4g}, and there is no ball b_r"
    if not c.outside.any():
        return f"|r| never left b_r: {most:.4g} <= {c.b_r:.4g}"
    if c.entered is None:
        return f"|r| never entered b_r = {c.b_r:.4g}"
    came = f"|r| entered b_r = {c.b_r:.4g} at {time[c.entered]:.4g} s"
    left = np.flatnonzero(c.outside & (np.arange(len(c.r)) > c.entered))
    most = c.r[c.entered :].max()
    if not len(left):
        return f"{came} and stayed, <= {most:.4g}"
    last = f"was last outside at {time[left[-1]]:.4g} s" if left[-1] < len(c.r) - 1 else "ended outside"
    return f"{came}, left it again at {time[left[0]]:.4g} s up to {most:.4g} and {last}"


INSIDE = "the error never left the ball b_r, outside which L should fall"

TESTING = "examples/theorem_tested.toml"
"""A mission whose flight tests the theorem."""

ANSWERS = {
    "conditions broken": "is not covered by the proof of Theorem 5.1: ",
    "untested": f"meets the conditions of Theorem 5.1 but does not test it: {INSIDE}",
    "sign consistent": "agrees with Theorem 5.1: its conditions hold, and L fell wherever the error was outside "
    "the ball b_r, at",
    "rising between samples": "leaves Theorem 5.1 undecided: its conditions hold, and dL/dt is negative wherever it should "
    "be, but a command is held for a control period, in which the error can leap over the ball",
    "contradicted": "contradicts Theorem 5.1: its printed conditions hold, yet L rose where it should fall",
}
"""What a flight says of the theorem."""


def answer(c: FlightCertificate) -> str:
    """Whether the theorem applies and is tested; what breaks it, and which term raised L most where coupling may be blamed."""
    what, broken, lost = standing(c), "; ".join(c.conditions.broken()), kind(c) == "lost"
    more = {
        "conditions broken": broken,
        "sign consistent": f" {c.outside.sum():,} of {len(c.outside):,} samples",
        "rising between samples": f": {rises(c)}",
        "contradicted": f". At {contradicting(c).sum():,} of the {c.outside.sum():,} samples outside the ball b_r, dL/dt was "
        f"not negative, mostly because of {TERMS[culprit(c)][1]}",
    }
    if what == "conditions broken" and c.conditions.printed_hold:
        met = "he printed conditions of Theorem 5.1 hold."
        said = [f"Lost at {c.ended:.4g} s, although t{met}" if lost else f"T{met}", omitted(c)]
    else:
        began = f"Lost at {c.ended:.4g} s. Up to {c.until:.3g} s, this" if lost else "This"
        said = [f"{began} flight {ANSWERS[what]}{more.get(what, '')}."]
    said += untested(c) if what == "sign consistent" else []
    said += [f"The flight of {TESTING} tests it in yaw, without nets."] * (what == "untested" and not lost)
    return " ".join(said)


def omitted(c: FlightCertificate) -> str:
    """The condition that the paper omits and this flight does not meet, in a sentence."""
    k = c.conditions
    if not k.hold:
        return f"The corrected condition does not: {'; '.join(k.broken())}."
    covered = f"With the coupling of the loops, which they leave out, the proof covers thrusts up to {k.thrust_bound:.4g} N"
    heavy = k.weight > (k.thrust_bound or 0.0)
    return f"{covered}; {'hovering alone takes' if heavy else 'this flight took'} {k.weight if heavy else k.thrust:.4g} N."


def untested(c: FlightCertificate) -> list[str]:
    """That some errors, and nets or coupling, stay zero all the flight, of which it says nothing."""
    moves = np.abs(np.hstack([c.history.r1, c.history.r2])).max(axis=0) > 0.0
    moved, still = ([name for name, one in zip(ERRORS, moves, strict=True) if one == which] for which in (True, False))
    said = f"Only the error in {units.listed(moved)} is tested: {units.listed(still)} stay{'s' * (len(still) == 1)} at zero"
    terms = [TERMS[term][1] for term in ("learning", "coupling") if not getattr(c.lyapunov, term).any()]
    also = f", and so do{'es' * (len(terms) == 1)} {units.listed(terms)}" * bool(terms)
    return [f"{said}{also}."] * bool(still)


def facts(c: FlightCertificate) -> list[Fact]:
    """Whether the conditions hold, what L did where the theorem is tested, and how the flight ended."""
    broken, count, rising = c.conditions.broken(), int(c.outside.sum()), int((c.outside & ~(c.lyapunov.rate < 0.0)).sum())
    until = f" up to {c.until:.3g} s" * bool(len(c.later))
    none = "not tested", f"|r| is at most {c.r.max():.4g}{until}, {ball(c)}" if c.b_r else "there is no ball"
    but = "all but that of the coupling hold" * c.conditions.hold
    leaps, lost = standing(c) == "rising between samples", c.outcome is not Outcome.COMPLETED
    fell = ("undecided", rises(c)) if leaps else ("fell", f"at each of {count:,} samples")
    rose = "rose", f"at {rising:,} of {count:,} samples"
    hold = ("violated", but, False, "fails") if broken else ("hold", "", False, "holds")
    printed = bool(broken) and c.conditions.printed_hold
    return [
        *[Fact("printed conditions", "hold", kind="holds")] * printed,
        Fact("repaired conditions" if printed else "conditions of the proof", *hold),
        Fact("L outside the ball b_r", *(none if not count else rose if rising else fell), kind="fails" * bool(rising)),
        Fact("the flight", "lost" if lost else "completed", f"at {c.ended:.4g} s", kind="fails" * lost),
    ]


def ball(c: FlightCertificate) -> str:
    """The radius of the ball."""
    return f"b_r = {c.b_r:.4g}" if c.b_r else "no ball b_r"


def culprit(c: FlightCertificate) -> str:
    """The term of L_dot that raised L most at the samples that contradict the theorem."""
    terms = {name: getattr(c.lyapunov, name)[contradicting(c)].sum() for name in ("residual", "learning", "coupling")}
    return max(terms, key=terms.__getitem__)


def rises(c: FlightCertificate) -> str:
    """How often L rose from sample to sample outside b_r."""
    between = periods_outside(c)
    return f"L rose in {(~(between < 0.0)).sum()} of the {len(between)} periods that begin and end outside it"


ERRORS = ("x", "y", "z", "yaw", "pitch", "roll")
"""The components of r."""

TERMS = {
    "dissipation": ("damping K_v", "the damping K_v"),
    "residual": ("eps", "eps (the error that even ideal weights leave)"),
    "learning": ("weights", "the weights of the nets"),
    "coupling": ("coupling", "the omitted coupling"),
    "filtering": ("the command filter's lag, a part of the coupling", ""),
    "sampling": ("sampling", "sampling"),
}
"""The terms of L_dot, as tables and figures say them, and in a sentence; `filtering` is a part of `coupling`."""


def work(c: FlightCertificate) -> dict[str, Array]:
    """What each of `TERMS` has added to L from the first sample up to each, (n,) [J], by trapezoids; `sampling` is the rest of
    the change of L: terms are those of a fresh command, which is then held until the next sample.
    """
    rates = {name: getattr(c.lyapunov, name) for name in TERMS if name != "sampling"}
    found = {name: np.append(0.0, np.cumsum(0.5 * (one[1:] + one[:-1])) * c.history.period) for name, one in rates.items()}
    known = sum((found[name] for name in found if name != "filtering"), np.zeros(()))
    found["sampling"] = c.lyapunov.value - c.lyapunov.value[0] - known
    return {name: found[name] for name in TERMS}


def parts(c: FlightCertificate) -> dict[str, Array]:
    """The work of terms that add up to the change of L, by what a figure calls them [J]."""
    return {TERMS[name][0]: values for name, values in work(c).items() if name != "filtering"}


def seen(c: FlightCertificate) -> str:
    """What the figure of |r| and of the thrust shows of this flight."""
    judged = f"Up to {c.until:.3g} s, " * bool(len(c.later))
    why = f": the law then commands {c.undefined}{NO_RATES}" * bool(c.undefined)
    rest = f" What follows is grey and not judged{why}." if judged else ""
    bound = c.conditions.thrust_bound
    return f"{judged}{of_ball(c)}.{rest}{f' The proof covers thrusts up to {bound:.4g} N.' if bound else ''}"


def stacked(c: FlightCertificate) -> str:
    """What the figure of the work of each term shows."""
    every, shown = parts(c), visible(c)
    begins = c.history.t[seen_from([*shown.values()])]
    late = "" if c.outcome is Outcome.COMPLETED or not begins else f" from {begins:.2g} s on, where areas can first be seen"
    none = [name for name, values in every.items() if not values.any()]
    faint = [name for name in every if name not in (*shown, *none)]
    return (
        f"What each term of dL/dt has added to L since the start, or taken from it, as areas{late}; the line is their sum."
        f"{f' Too small to be drawn: {units.listed(faint)}.' if faint else ''}"
        f"{f' Zero throughout: {units.listed(none)}.' if none else ''}"
    )


def visible(c: FlightCertificate) -> dict[str, Array]:
    """The `parts` that are large enough to be drawn."""
    every = parts(c)
    size = {name: np.abs(values).max() for name, values in every.items()}
    return {name: values for name, values in every.items() if size[name] >= FAINT * max(size.values())}
