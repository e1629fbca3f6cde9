"""The claims of Section 6 of the paper, what was measured, and the verdict."""

from collections.abc import Sequence

from quadstep.studies.paper.claim import Claim, Verdict
from quadstep.studies.paper.claims_comparison import altitude, settling, sideways, smoothness, transient_cause, transients
from quadstep.studies.paper.claims_range import neurons, wide_range
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
from quadstep.studies.paper.study import Study

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
