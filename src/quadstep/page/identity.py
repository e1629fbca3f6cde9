"""Names by which links find what a page shows."""

import re
from collections.abc import Sequence


def identity(name: str, taken: Sequence[str]) -> str:
    """An id of letters, digits and hyphens that is not taken."""
    base = re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-")[:40].strip("-") or "flight"
    candidates = [base, *(f"{base}-{number}" for number in range(2, len(taken) + 3))]
    return next(candidate for candidate in candidates if candidate not in taken)
