"""A certificate as JSON and as tables."""

from collections.abc import Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from quadstep.metrics.reductions import rmse
from quadstep.metrics.statistics import finite
from quadstep.proofs.certify.certificate import FlightCertificate
from quadstep.proofs.certify.standing import TERMS, answer, ball, kind, standing, work
from quadstep.proofs.plain import Mask, lengths
from quadstep.report import markup, units


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
        "verdict": f"{kind(c)}: {answer(c)}",
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


def brief(value: float | None, unit: str = "") -> str:
    return "–" if value is None else f"{value:.4g} {unit}".rstrip()


def joules(value: float, most: float) -> str:
    """In the unit that suits the largest value of its table."""
    unit, factor = units.handy("J", most)
    return f"{factor * value + 0.0:.4g} {unit}"


def mark(here: float, anywhere: float = np.inf) -> tuple[str, str]:
    """Whether a margin is positive, on this flight and at any attitude, with a class for its colour."""
    if here <= 0.0:
        return "fails", "fails"
    return ("holds", "holds") if anywhere > 0.0 else ("on this flight only", "open")


NOT_JUDGED = ("not judged", "open")

ROUNDING = 1e-9
"""Two ways to L_dot that are the same in exact arithmetic differ by less, as a share."""


Rows: TypeAlias = Sequence[Sequence[markup.Cell]]


class Tables(NamedTuple):
    """Rows of text. conditions: on this flight, as asked, and whether that holds; ball: value, bound and
    whether that is kept; then value by value: what changed L, L itself, and how three ways to L_dot agree.
    """

    conditions: Rows
    ball: Rows
    changes: Rows
    levels: Rows
    ways: Rows


def tables(c: FlightCertificate) -> Tables:
    """In the order in which they are needed, what is judged before what is not."""
    k, full = c.conditions, record(c)
    flight, rate = full["flight"], full["lyapunov"]
    work, fell = rate["work[J]"], rate["share_falling_outside_b_r"]
    ends = "never" if c.entered is None else f"{brief(flight['transient_ends[s]'])} s"
    until = f" up to {c.until:.3g} s" if len(c.later) else ""
    printed, corrected = min(k.printed_anywhere), min(k.corrected_anywhere)
    promised = fell is not None and standing(c) != "conditions broken"
    agree = rate["formula_less_plant"]
    later: list[list[markup.Cell]] = []
    if len(c.later):
        later = [["largest error |r| later [m/s, rad/s]", brief(c.later.max()), "", NOT_JUDGED]]
    return Tables(
        conditions=[
            ["K_r1 - m Lambda1", brief(k.k_1, "N s/m"), "> 0", mark(k.k_1)],
            ["K_r2 - J_M Lambda2 (printed)", brief(min(k.printed_visited), "N m s"),
             "> 0", mark(min(k.printed_visited), printed)],
            ["K_r2 - J_M max(Lambda2)", brief(k.k_2, "N m s"), "> 0", mark(k.k_2, corrected)],
            ["thrust that the proof covers", brief(k.thrust_bound, "N"), f"> {k.thrust:.4g} N",
             mark((k.thrust_bound or 0.0) - k.thrust, (k.thrust_bound_anywhere or 0.0) - k.thrust)],
            [f"J_M ({k.j_anywhere:.4g} at any attitude)", brief(k.j_visited, "kg m^2"), "", ""],
        ],
        ball=[
            ["samples outside the ball b_r" + until, f"{rate['samples_outside_b_r']:,} of {len(c.r):,}", "", ""],
            ["share of these with dL/dt < 0", "–" if fell is None else f"{100.0 * fell:.4g} %", "100 %",
             mark(1.0 if fell == 1.0 else -1.0) if promised else NOT_JUDGED],
            [f"largest error |r|{until} [m/s, rad/s]", brief(flight["largest_r"]), ball(c), ""],
            *later,
            ["time of the first |r| <= b_r", ends, "", ""],
            *([["largest error |r| from then on [m/s, rad/s]", brief(flight["largest_r_after_transient"]),
               ball(c), ""]] if c.entered else []),
            ["largest error of the weights |W_tilde| [N, N m]", brief(flight["largest_W_tilde"]),
             f"b_w = {c.b_w:.4g}" if c.b_w else "", ""],
            ["largest error that ideal weights leave, eps_N [N, N m]", brief(c.residual_bound), "", ""],
            ["size of the ideal weights, W_B [N, N m]", brief(c.weight_bound), "", ""],
            ["smallest margin of the gains, K_min", brief(k.k_min, "N s/m" if k.k_1 < k.k_2 else "N m s"), "", ""],
        ],
        changes=[
            *([f"by {said}", joules(work[name], rate["largest[J]"])]
              for name, (said, _) in TERMS.items()),
            ["sum (the filter's lag is already in the coupling)",
             joules(rate["last[J]"] - rate["first[J]"], rate["largest[J]"])],
        ],
        levels=[
            [f"at {when}", joules(rate[key], rate["largest[J]"])]
            for when, key in (("the start", "first[J]"), (f"most{until}", "largest[J]"), (f"{c.until:.3g} s", "last[J]"))
        ],
        ways=[
            ["formula and plant, at most", brief(agree), "< 10^-9", mark(ROUNDING - agree)],
            ["formula and differences of L, rms", brief(rate["formula_less_differenced_rms"]), "", NOT_JUDGED],
        ],
    )  # fmt: skip
