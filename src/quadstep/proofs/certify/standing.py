"""What a flight says of Theorem 5.1, in words, and the term of L_dot that decides it."""

import re

import numpy as np

from quadstep.interfaces.closed_loop import Outcome
from quadstep.proofs.certify.certificate import FlightCertificate
from quadstep.proofs.plain import Array, Mask
from quadstep.report import units


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


INSIDE = "the error never left the ball outside which L should fall"

ANSWERS = {
    "conditions broken": "does not test Theorem 5.1: conditions that its proof needs do not hold",
    "untested": f"neither confirms nor refutes Theorem 5.1: its conditions hold, and {INSIDE}",
    "sign consistent": "agrees with Theorem 5.1: its conditions hold, and L fell at every sample where it should",
    "rising between samples": "neither confirms nor refutes Theorem 5.1: its conditions hold, and L_dot is negative wherever "
    "it should be, but a command is held for a control period, in which the error can leap over the ball",
    "contradicted": "contradicts Theorem 5.1: its printed conditions hold, yet L rose where it should fall",
}
"""What a flight says of the theorem."""


def answer(c: FlightCertificate) -> str:
    """What a reader wants to know first, in a sentence, and what decides it."""
    what, broken, lost = standing(c), c.conditions.broken(), kind(c) == "lost"
    more = {
        "conditions broken": f"; besides, {INSIDE}" * (c.b_r is not None and not c.outside.any()),
        "untested": ". To test it, hover with an initial yaw error, a large K_r1, no nets and no disturbance" * (not lost),
        "sign consistent": f" ({c.outside.sum()} of {len(c.outside)})",
        "rising between samples": f": {rises(c)}",
        "contradicted": f". At {contradicting(c).sum()} of the {c.outside.sum()} samples outside the ball b_r, L_dot was not "
        f"negative, mostly because of {TERMS[culprit(c)][1]}",
    }
    began = "This flight"
    if lost:
        although = " although the printed conditions of Theorem 5.1 hold" * c.conditions.printed_hold
        began = f"The flight was lost at {c.ended:.4g} s{although}. In the first {c.until:.3g} s it"
    said = [f"{began} {ANSWERS[what]}{more[what]}.", f"What fails: {'; '.join(broken)}." if broken else "", raised_by(c)]
    if c.undefined:  # why it is certified up to some time only
        then = f"from then on the law commands {c.undefined.rstrip(',')}, and the angles that it asks for have no rates"
        said.append(f"The certificate ends at {c.until:.3g} s: {then}.")
    return " ".join(filter(None, said))


def decision(c: FlightCertificate) -> tuple[str, str, str]:
    """What the flight does to the theorem, and what decides this: in a word or two, and in numbers."""
    what, count = standing(c), c.outside.sum()
    if what == "conditions broken":
        name, _, numbers = re.split("( = |: )", c.conditions.broken()[0], maxsplit=1)
        return "not tested", name, numbers
    if what == "untested":
        return "not tested", "|r| <= b_r", f"largest |r| = {c.r.max():.4g}, b_r = {c.b_r:.4g}"
    if what == "contradicted":
        return "contradicted", TERMS[culprit(c)][0], f"at {contradicting(c).sum()} of {count} samples outside b_r"
    if what == "sign consistent":
        return "agrees", "L_dot < 0", f"at all {count} samples outside b_r"
    return "undecided", "sampling", rises(c)


def culprit(c: FlightCertificate) -> str:
    """The term of L_dot that raised L most at the samples that contradict the theorem."""
    terms = {name: getattr(c.lyapunov, name)[contradicting(c)].sum() for name in ("residual", "learning", "coupling")}
    return max(terms, key=terms.__getitem__)


def rises(c: FlightCertificate) -> str:
    """How often L rose from sample to sample outside b_r."""
    between = periods_outside(c)
    return f"L rose in {(~(between < 0.0)).sum()} of the {len(between)} periods that begin and end outside it"


TERMS = {
    "dissipation": ("damping K_v", "the damping K_v"),
    "residual": ("eps", "eps (which even ideal weights cannot learn)"),
    "learning": ("weights", "the weights of the nets"),
    "coupling": ("coupling", "the coupling that the proof omits"),
    "sampling": ("sampling", "sampling"),
    "filtering": ("the command filter", "the command filter"),
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


def raised(c: FlightCertificate) -> list[tuple[float, str]]:
    """The terms that raised L over the flight: share of what all of them added, and term, the largest first."""
    added = {said: float(values[-1]) for said, values in parts(c).items() if values[-1] > 0.0}
    return sorted(((one / sum(added.values()), said) for said, one in added.items()), reverse=True)


def about(share: float) -> str:
    """A share in whole percent: how the work is split depends on where in a period terms are taken."""
    return "less than 1 %" if share < 0.01 else "more than 99 %" if 0.99 < share < 1.0 else f"{100.0 * share:.0f} %"


def raised_by(c: FlightCertificate) -> str:
    """The same in a sentence."""
    meant = dict(TERMS.values())
    found = [f"{meant[said]}{' contributed' * (not at)} {about(share)}" for at, (share, said) in enumerate(raised(c))]
    return f"Of what raised L, {units.listed(found)}." if found else "No term raised L over the flight."


def seen(c: FlightCertificate) -> str:
    """What the figure shows of this flight, in sentences."""
    until = "" if c.outcome is Outcome.COMPLETED else f"In the first {c.until:.3g} s, all that is certified, "
    return (
        f"{until}{of_ball(c)}. Theorem 5.1 promises only that L falls outside the ball b_r. "
        "Areas: what each term of L_dot has added to L by then, or taken from it; sampling is the remainder, since "
        "commands are held between samples. Line: their sum, by which L has changed since the start."
    )


def checked(c: FlightCertificate) -> str:
    """What the figure of the checks shows."""
    value, ratio = c.lyapunov.value, c.coupling_ratio
    went = f"L goes from {value[0]:.3g} J to {value[-1]:.3g} J; its largest value is {value.max():.3g} J."
    if not len(ratio):
        return went
    above = f"{100.0 * np.mean(ratio > 1.0):.3g} % of samples"
    return f"{went} The coupling |r1| |delta|, which the proof omits, is above the damping K_min |r|^2 in {above}."
