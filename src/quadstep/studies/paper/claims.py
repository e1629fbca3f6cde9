"""The claims of Section 6 of the paper, what was measured, and the verdict."""

from collections.abc import Sequence

import numpy as np

from quadstep.metrics.of_log import metric
from quadstep.studies.paper.cases import NEURONS, SEEDS, STRESS_SCALES, STRESS_TIMES
from quadstep.studies.paper.claims_comparison import altitude, settling, sideways, smoothness, transient_cause, transients
from quadstep.studies.paper.claims_tracking import (
    angles,
    compensation,
    decoupling_x,
    decoupling_y_z,
    no_yaw_torque,
    realisable,
    rest_at_the_end,
    tracking,
)
from quadstep.studies.paper.study import Claim, Study, Verdict, completed, judge


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
        errors = {n: [metric(study.neurons[flight, n, seed], "position_rmse[m]") for seed in SEEDS] for n in NEURONS}
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


__all__ = ["Claim", "Verdict", "check_claims"]


def answer(claims: Sequence[Claim]) -> str:
    """The result for the paper's claims, in a sentence."""
    count = {kind: sum(claim.verdict is kind for claim in claims) for kind in Verdict}
    return (
        f"Of {len(claims)} claims that the paper makes about its simulations, {count[Verdict.HOLDS]} hold when reproduced, "
        f"{count[Verdict.FAILS]} fail, and {count[Verdict.UNDECIDED]} cannot be decided; gains and whatever else the paper "
        "does not give are our own."
    )


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
