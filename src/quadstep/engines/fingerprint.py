"""What identifies flights: results in a folder are replaced only by results of the same flights."""

import hashlib

from quadstep.engines.fly import FlightPlan
from quadstep.numbers import Table, flatten


def fingerprint(plans: list[FlightPlan]) -> str:
    """A digest of everything that decides the flights: laws, every number, clock and start."""
    digest = hashlib.sha256()
    for plan in plans:
        leaves = flatten((plan.parameters, plan.start, plan.ticks))
        numbers = [leaf.values if isinstance(leaf, Table) else leaf for leaf in leaves]
        digest.update(f"{plan.loop!r} {numbers!r}\n".encode())
    return digest.hexdigest()[:16]
