"""The one line that says how a flight and Theorem 5.1 fit, with the numbers it rests on."""

import numpy as np

from quadstep.interfaces.closed_loop import Outcome
from quadstep.proofs.certify.certificate import FlightCertificate


def kind(c: FlightCertificate) -> str:
    """diverged, conditions broken, untested, sign consistent or contradicted."""
    if c.outcome is not Outcome.COMPLETED:
        return "diverged"
    if c.conditions.broken():
        return "conditions broken"
    if not c.outside.any():
        return "untested"
    return "sign consistent" if (c.lyapunov.rate[c.outside] < 0.0).all() else "contradicted"


def margins(c: FlightCertificate) -> str:
    """The smallest margins of the conditions that hold."""
    k = c.conditions
    return (
        f"K_r1 - m Lambda1 >= {k.k_1:.4g}, K_r2 - J_M max(Lambda2) >= {k.k_2:.4g}, "
        f"thrust <= {k.thrust:.4g} N < {k.thrust_bound or 0.0:.4g} N"
    )


def after(c: FlightCertificate) -> str:
    """What |r| did once it had come inside b_r."""
    if c.entered is None:
        return "|r| never entered b_r"
    time, most = c.history.t, c.r[c.entered :].max()
    came = f"|r| entered b_r at {time[c.entered]:.4g} s"
    left = np.flatnonzero(c.outside & (np.arange(len(c.r)) > c.entered))
    if not len(left):
        return f"{came} and stayed, <= {most:.4g}"
    last = f"was last outside at {time[left[-1]]:.4g} s" if left[-1] < len(c.r) - 1 else "ended outside"
    return f"{came}, left it again at {time[left[0]]:.4g} s up to {most:.4g} and {last}"


ANSWERS = {
    "conditions broken": "This flight breaks conditions that the proof of Theorem 5.1 needs, so it says nothing of it",
    "untested": "This flight neither confirms nor refutes Theorem 5.1: its conditions hold, and the error never left the ball "
    "outside which L should fall",
    "sign consistent": "This flight agrees with Theorem 5.1: its conditions hold, and L fell at every sample where it should",
    "contradicted": "This flight contradicts the proof of Theorem 5.1: its conditions hold, yet L rose where it should fall",
}
"""What a verdict means, by its kind."""


def answer(c: FlightCertificate) -> str:
    """What a reader wants to know first, in a sentence; everything else is in the verdict."""
    if kind(c) != "diverged":
        return f"{ANSWERS[kind(c)]}."
    ended, found = f"The flight was lost at {c.ended:.4g} s", c.conditions.broken()
    if not c.conditions.printed_hold:
        return f"{ended}; the conditions of Theorem 5.1 do not hold."
    if not found:
        return f"{ended} although the conditions of Theorem 5.1 hold, as printed and corrected."
    return f"{ended} although the printed conditions of Theorem 5.1 hold. Broken on this flight: {'; '.join(found)}."


def verdict(c: FlightCertificate) -> str:
    """The verdict line."""
    what, k = kind(c), c.conditions
    if what == "diverged":
        printed = min(*k.position, *k.printed_anywhere)
        said = f"the printed conditions {'hold' if k.printed_hold else 'do not hold'} (smallest margin {printed:.4g})"
        found = k.broken()
        rest = f"; broken on this flight: {'; '.join(found)}" if found else f"; so do the corrected conditions: {margins(c)}"
        return f"diverged: the flight ended at {c.ended:.4g} s; {said}{rest}; all numbers are from the first {c.until:.4g} s"
    if what == "conditions broken":
        return f"conditions broken: {'; '.join(k.broken())}; largest |r| of the flight {c.r.max():.4g}"
    if what == "untested":
        return (
            f"conditions hold ({margins(c)}) and |r| stayed inside b_r, largest {c.r.max():.4g} <= {c.b_r:.4g}, "
            "so the sign of L_dot outside was never tested"
        )
    count = int(c.outside.sum())
    if what == "sign consistent":
        falls = f"L_dot < 0 on all {count} samples outside b_r = {c.b_r:.4g}"
        return f"sign consistent on this flight: {margins(c)}; {falls}; {after(c)}"
    rising = 100.0 * float(np.mean(c.lyapunov.rate[c.outside] >= 0.0))
    return f"conditions hold ({margins(c)}), but L_dot >= 0 on {rising:.3g} % of the {count} samples outside b_r = {c.b_r:.4g}"
