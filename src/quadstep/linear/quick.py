"""The grade of a mission's loop beside other results: only where it takes less than about a second, and cached beside the
compiled code.
"""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path

from quadstep.control.opaque import Opaque
from quadstep.engines.fly import fingerprint
from quadstep.io import code_cache
from quadstep.io.results.code import code_digest
from quadstep.linear.analysis import limits, of_even_rotors, of_loop, worst_of
from quadstep.linear.equilibrium import at_rest, hovering, newton, warmed
from quadstep.linear.grade import Grade, graded, refused
from quadstep.linear.nearby import bending
from quadstep.linear.sampled import Loops, NoRestError, linearising
from quadstep.linear.states import states
from quadstep.mission.schema import Mission

MOST_STATES, MOST_TICKS = 120, 50
"""Of a loop that is linearised here; more take seconds."""


def quick_grade(mission: Mission) -> Mapping[str, str]:
    """The "grade" and "why" of a mission's loop at rest where its path begins; empty where `quadstep linear` has to be asked:
    the loop is large, bends at or near rest, or has no equations.
    """
    law = mission.controller.controller
    if issubclass(law, Opaque) or law.one_at_a_time:
        return {}
    try:
        plans = of_even_rotors(hovering(mission))
        name = code_cache.key("grade", code_digest(), own_digest(), fingerprint(plans), repr(limits(mission)))
        cached = code_cache.read(name)
        if cached is None:
            cached = json.dumps(at_once(mission, [Loops(plan) for plan in plans])).encode()
            code_cache.write(name, cached)
        found: Mapping[str, str] = json.loads(cached)
    except Exception:
        return {}
    return found


def own_digest() -> str:
    """Of the code of this folder."""
    here = sorted(Path(__file__).parent.glob("*.py"))
    return hashlib.sha256(b"\0".join(path.read_bytes() for path in here)).hexdigest()


def at_once(mission: Mission, loops: list[Loops]) -> dict[str, str]:
    """The grade of loops of a mission, flown only where no rest is found at its start; empty where it takes longer."""
    with linearising():
        analyses = []
        for one in loops:
            flown, first = warmed(one)
            if one.count > MOST_TICKS or len(states(flown)[0]) > MOST_STATES:
                return {}
            try:
                rest = newton(one, flown, first)
            except NoRestError:
                try:
                    rest = at_rest(one.plan)
                except NoRestError as error:
                    return {"grade": (none := refused(error)).word, "why": none.why}
            if rest.period.period.bends or bending(one, rest.flown, rest.first, rest.period):
                return {}
            analyses.append(of_loop(rest.period, limits(mission)))
    found: Grade = graded(worst_of(analyses))
    return {"grade": found.word, "why": found.why}
