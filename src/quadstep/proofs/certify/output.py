"""A certificate as JSON and as a table for the screen."""

from typing import Any

import numpy as np

from quadstep.interfaces.closed_loop import Outcome
from quadstep.metrics.reductions import rmse
from quadstep.metrics.statistics import finite
from quadstep.proofs.certify.certificate import FlightCertificate
from quadstep.proofs.plain import Array, Mask, lengths
from quadstep.report import units


def kind(c: FlightCertificate) -> str:
    """lost, conditions broken, untested, sign consistent, rising between samples or contradicted."""
    if c.outcome is not Outcome.COMPLETED:
        return "lost"
    if c.conditions.broken():
        return "conditions broken"
    if not c.outside.any():
        return "untested"
    if not (c.lyapunov.rate[c.outside] < 0.0).all():
        return "contradicted"
    return "sign consistent" if (periods_outside(c) < 0.0).all() else "rising between samples"


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


ANSWERS = {
    "conditions broken": "This flight breaks conditions that the proof of Theorem 5.1 needs, so it says nothing of it",
    "untested": "This flight neither confirms nor refutes Theorem 5.1: its conditions hold, and the error never left the ball "
    "outside which L should fall. To test it, hover with an initial yaw error, a large K_r1, no nets and no disturbance",
    "sign consistent": "This flight agrees with Theorem 5.1: its conditions hold, and L fell at every sample where it should",
    "rising between samples": "This flight neither confirms nor refutes Theorem 5.1: its conditions hold, and L_dot is "
    "negative wherever it should be, but a command is held for a control period, in which the error can leap over the ball",
    "contradicted": "This flight contradicts the proof of Theorem 5.1: its conditions hold, yet L rose where it should fall",
}
"""What a verdict means, by its kind."""


def answer(c: FlightCertificate) -> str:
    """What a reader wants to know first, in a sentence; everything else is in the verdict."""
    what = kind(c)
    if what != "lost":
        more = {"sign consistent": f" ({c.outside.sum()} of {len(c.outside)})", "rising between samples": f": {rises(c)}"}
        return f"{ANSWERS[what]}{more.get(what, '')}. {raised_by(c)}"
    ended, found = f"The flight was lost at {c.ended:.4g} s", c.conditions.broken()
    rest = raised_by(c)
    if c.undefined:  # why it is certified up to some time only
        then = f"from then on the law commands {c.undefined.rstrip(',')}, and the angles that it asks for have no rates"
        rest += f" The certificate ends at {c.until:.3g} s: {then}."
    if not c.conditions.printed_hold:
        return f"{ended}; the conditions of Theorem 5.1 do not hold. {rest}"
    if not found:
        return f"{ended} although the conditions of Theorem 5.1 hold, as printed and corrected. {rest}"
    beyond = f"Further conditions of the proof do not hold: {'; '.join(found)}"
    return f"{ended} although the printed conditions of Theorem 5.1 hold. {beyond}. {rest}"


def rises(c: FlightCertificate) -> str:
    """How often L rose from sample to sample outside b_r."""
    between = periods_outside(c)
    return f"L rose in {(~(between < 0.0)).sum()} of the {len(between)} periods that begin and end outside it"


def verdict(c: FlightCertificate) -> str:
    """The kind, and in numbers what decides it."""
    k, rate, said = c.conditions, c.lyapunov.rate[c.outside], list[str]()
    if kind(c) == "lost":
        printed = min(*k.position, *k.printed_anywhere)
        said += [
            f"the flight ended at {c.ended:.4g} s, and all numbers are from the first {c.until:.4g} s",
            f"the printed conditions {'hold' if k.printed_hold else 'do not hold'} (smallest margin {printed:.4g})",
        ]
    margins = f"K_r1 - m Lambda1 >= {k.k_1:.4g}, K_r2 - J_M max(Lambda2) >= {k.k_2:.4g}"
    thrust = f"thrust <= {k.thrust:.4g} N < {k.thrust_bound or 0.0:.4g} N"
    said += [*(k.broken() or [f"the conditions hold ({margins}, {thrust})"]), of_ball(c)]
    if len(rate):
        said += [f"L_dot < 0 on {(rate < 0.0).sum()} of the {len(rate)} samples outside b_r", rises(c)]
    return f"{kind(c)}: {'; '.join(said)}"


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


def share(condition: Mask) -> float | None:
    """The share of samples for which a condition holds; None for no samples."""
    return float(np.mean(condition)) if len(condition) else None


def rate_record(c: FlightCertificate) -> dict[str, object]:
    """L and L_dot: ends, work of each term, and how well the three ways to L_dot agree."""
    rate, value = c.lyapunov.rate, c.lyapunov.value
    mean = 0.5 * (rate[1:] + rate[:-1])
    scale = rmse(rate) or 1.0
    outside = c.outside
    return {
        "first[J]": float(value[0]),
        "last[J]": float(value[-1]),
        "largest[J]": float(value.max()),
        "work[J]": {name: float(values[-1]) for name, values in work(c).items()},
        "samples_outside_b_r": int(outside.sum()),
        "share_falling_outside_b_r": share(rate[outside] < 0.0),
        "share_falling_outside_b_r_differenced": share(c.lyapunov.differenced[outside[:-1]] < 0.0),
        "share_falling": share(rate < 0.0),
        "share_rising_only_by_coupling": share((rate - c.lyapunov.coupling)[rate > 0.0] <= 0.0),
        "formula_less_plant": float(np.abs(c.lyapunov.terms - rate).max()) / (float(np.abs(rate).max()) or 1.0),
        "formula_less_differenced_rms": rmse(c.lyapunov.differenced - mean) / scale,
        "same_sign_as_differenced": share((c.lyapunov.differenced < 0.0) == (mean < 0.0)),
        "largest_skew_term[W]": float(np.abs(c.lyapunov.skew).max()),
    }


def coupling_record(c: FlightCertificate) -> dict[str, object]:
    """The term -r1^T delta that the proof leaves out."""
    ratio, h, k_min = c.coupling_ratio, c.history, c.conditions.k_min
    tilt = np.sqrt(np.square(h.e2[:, 1:]).sum(axis=1))
    bound = h.thrust * tilt + lengths(h.lag)
    work, dissipated = float((lengths(h.r1) * lengths(h.delta)).mean()), k_min * float(np.square(c.r).mean())
    return {
        "largest_delta[N]": float(lengths(h.delta).max()),
        "largest_delta_of_filter[N]": float(lengths(h.lag).max()),
        "largest_term[W]": float(np.abs(c.lyapunov.coupling).max()),
        "largest_ratio": finite(ratio.max()) if len(ratio) else None,
        "median_ratio": finite(float(np.median(ratio))) if len(ratio) else None,
        "ratio_in_the_mean": finite(work / dissipated) if dissipated > 0.0 else None,
        "share_within_u_e2_and_filter": share(lengths(h.delta) <= bound * (1.0 + 1e-9) + 1e-9),
    }


def record(c: FlightCertificate) -> dict[str, Any]:
    """Everything, with units in the keys; r mixes m/s and rad/s as the paper does."""
    k, (first, second) = c.conditions, c.ideal.fits
    pairs = zip(c.ideal.fits, (c.history.mu_1, c.history.mu_2), strict=True)
    targets = [fit.residual + mu @ fit.weights for fit, mu in pairs]  # what the ideal weights say and the error they leave
    return {
        "kind": kind(c),
        "verdict": verdict(c),
        "outcome": c.outcome.name.lower(),
        "ended[s]": c.ended,
        "looked_at_until[s]": c.until,
        "samples": len(c.history.t),
        "conditions": {
            "J_M_visited[kg m^2]": k.j_visited,
            "J_M_anywhere[kg m^2]": k.j_anywhere,
            "K_r1 - m Lambda1 [N s/m]": k.position,
            "printed: K_r2 - J_M Lambda2 [N m s]": {"visited": k.printed_visited, "anywhere": k.printed_anywhere},
            "corrected: K_r2 - J_M max(Lambda2) [N m s]": {"visited": k.corrected_visited, "anywhere": k.corrected_anywhere},
            "printed_hold": k.printed_hold,
            "corrected_hold": k.hold,
            "coupling_holds": k.coupling_holds,
            "u_max[N]": k.thrust,
            "u_max_allowed[N]": {"visited": finite(k.thrust_bound), "anywhere": finite(k.thrust_bound_anywhere)},
            "broken": k.broken(),
        },
        "K_min": k.k_min,
        "K_min_printed": k.k_min_printed,
        "nets": {
            "used": c.ideal.used,
            "learning_from[s]": finite(float(c.history.t[np.argmax(c.history.on)])) if c.ideal.used else None,
            "W_B": c.weight_bound,
            "eps_N": c.residual_bound,
            "ridges": [finite(first.ridge), finite(second.ridge)],
            "norm_W": [float(np.linalg.norm(first.weights)), float(np.linalg.norm(second.weights))],
            "largest_target": [float(lengths(t).max()) for t in targets],
            "least_squares": {"W_B": c.weight_bound_plain, "eps_N": c.residual_bound_plain, "b_r": finite(c.b_r_plain)},
            "condition_numbers": [finite(value) for value in c.ideal.conditions],
            "W1": first.weights.tolist(),
            "W2": second.weights.tolist(),
        },
        "bounds": {"b_r": finite(c.b_r), "b_r_printed": finite(c.b_r_printed), "b_w": finite(c.b_w)},
        "flight": {
            "largest_r": float(c.r.max()),
            "largest_r1[m/s]": float(lengths(c.history.r1).max()),
            "largest_r2[rad/s]": float(lengths(c.history.r2).max()),
            "transient_ends[s]": None if c.entered is None else float(c.history.t[c.entered]),
            "largest_r_after_transient": None if c.entered is None else float(c.r[c.entered :].max()),
            "final_r": float(c.r[-1]),
            "largest_W_tilde": float(c.missing.max()),
            "share_outside_b_w": None if c.b_w is None else share(c.missing > c.b_w),
        },
        "lyapunov": rate_record(c),
        "coupling": coupling_record(c),
    }


def brief(value: float | None) -> str:
    return "–" if value is None else f"{value:.4g}"


def tables(c: FlightCertificate) -> tuple[list[list[str]], list[list[str]], list[list[str]]]:
    """Rows of text: the conditions on this flight, at any attitude and as asked; of the ball, value and bound; of the checks,
    value.
    """
    k, full = c.conditions, record(c)
    nets, flight, rate, coupling = full["nets"], full["flight"], full["lyapunov"], full["coupling"]
    plain, work, fell = nets["least_squares"], rate["work[J]"], rate["share_falling_outside_b_r"]
    ends = "never" if c.entered is None else f"{brief(flight['transient_ends[s]'])} s" if c.entered else "at the start"
    ridges = " and ".join("infinite" if ridge is None else f"{ridge:g}" for ridge in nets["ridges"])
    conditions = [
        ["K_r1 - m Lambda1, smallest", brief(k.k_1), "", "> 0"],
        ["K_r2 - J_M Lambda2, smallest, as printed", brief(min(k.printed_visited)), brief(min(k.printed_anywhere)), "> 0"],
        ["K_r2 - J_M max(Lambda2), smallest, corrected", brief(k.k_2), brief(min(k.corrected_anywhere)), "> 0"],
        ["J_M, largest eigenvalue of J", f"{k.j_visited:.4g} kg m^2", f"{k.j_anywhere:.4g} kg m^2", ""],
        ["largest thrust that the coupling condition allows", f"{brief(k.thrust_bound)} N",
         f"{brief(k.thrust_bound_anywhere)} N", f"> {k.thrust:.4g} N, the flight's largest"],
        ["K_min, smallest eigenvalue of K_v", brief(k.k_min), "", "> 0"],
    ]  # fmt: skip
    ball = [
        ["W_B of the ideal weights", brief(c.weight_bound), ""],
        ["eps_N of the ideal weights", brief(c.residual_bound), ""],
        ["largest |r|", brief(flight["largest_r"]), f"b_r = {brief(c.b_r)}"],
        ["largest |r| after the transient", brief(flight["largest_r_after_transient"]), f"b_r = {brief(c.b_r)}"],
        ["end of the transient, the first |r| <= b_r", ends, ""],
        ["largest |W_tilde|", brief(flight["largest_W_tilde"]), f"b_w = {brief(c.b_w)}"],
        ["samples outside b_r", f"{rate['samples_outside_b_r']} of {len(c.r)}", ""],
        *([["L_dot < 0 on these", f"{100.0 * fell:.4g} %", "100 %"]] if fell is not None else []),
        *([f"L, {when}", f"{rate[key]:.4g} J", ""]
          for when, key in (("at first", "first[J]"), ("largest", "largest[J]"), ("at the end", "last[J]"))),
    ]  # fmt: skip
    checks = [
        ["K_min, as printed", brief(k.k_min_printed)],
        ["b_r, as printed", brief(c.b_r_printed)],
        *([["ridges of the fits of the two nets' ideal weights", ridges]] if c.ideal.used else []),
        ["W_B by least squares, without a ridge", brief(plain["W_B"])],
        ["eps_N by least squares", brief(plain["eps_N"])],
        ["b_r by least squares", brief(plain["b_r"])],
        *([f"work on L of {said}", f"{work[name]:.3g} J"] for name, (said, _) in TERMS.items()),
        ["L_dot, formula against plant: largest difference, as a share of the largest", brief(rate["formula_less_plant"])],
        ["L_dot, formula against differences of L: rms, as a share of the rms", brief(rate["formula_less_differenced_rms"])],
        ["coupling |r1| |delta| / K_min |r|^2, ratio of means", brief(coupling["ratio_in_the_mean"])],
        ["the same, largest", brief(coupling["largest_ratio"])],
        ["the same, median", brief(coupling["median_ratio"])],
    ]
    return conditions, ball, checks


def seen(c: FlightCertificate) -> str:
    """What the figure shows of this flight, in sentences."""
    until = "" if c.outcome is Outcome.COMPLETED else f"In the first {c.until:.3g} s, all that is certified, "
    return (
        f"{until}{of_ball(c)}. Theorem 5.1 promises only that L falls outside the ball b_r. "
        "Areas: what each term of L_dot has added to L up to then, or taken from it; sampling is what the others leave, as "
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
