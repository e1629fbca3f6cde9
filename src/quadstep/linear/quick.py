"""The grade of a mission's loop beside other results: only where it takes less than about a second, and cached beside the
compiled code; and margins as metrics of a mission, finite numbers that can be compared and searched.
"""

import hashlib
import json
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import cast

from quadstep.control.opaque import Opaque
from quadstep.engines.fly import FlightPlan, fingerprint
from quadstep.io import code_cache
from quadstep.io.errors import UserError
from quadstep.io.results.code import code_digest
from quadstep.linear.analysis import Analysis, least, limits, of_even_rotors, of_loop, studied, worst_of
from quadstep.linear.equilibrium import at_rest, hovering, newton, warmed, with_others, with_pieces
from quadstep.linear.grade import Grade, Measure, grade, graded, refused
from quadstep.linear.margins import Margins
from quadstep.linear.sampled import Loops, NoRestError, linearising
from quadstep.linear.states import states
from quadstep.metrics.margins import LESS_IS_BETTER, MARGINS, UNITS
from quadstep.mission.schema import Mission

MOST = {"gain_margin_up": 60.0, "gain_margin_down": 60.0, "phase_margin": math.pi, "delay_margin": 10.0, "disk_margin": 2.0}
"""Finite stand-in for an infinite margin, in its unit."""

UNSTABLE = {**dict.fromkeys(MOST, 0.0), LESS_IS_BETTER: 1000.0}
"""Margin of a loop that is not stable."""


def margin_metrics(mission: Mission, names: Iterable[str]) -> dict[str, float]:
    """The metrics of these names, out of `MARGINS`. Raises UserError for a loop that cannot be linearised."""
    found = of_analysis(studied(mission).analysis)
    return {name: found[name] for name in names}


def of_analysis(found: Analysis) -> dict[str, float]:
    """All metrics by name; for a channel that the vehicle does not have, the stand-in for an infinite margin."""
    by_channel = {channel.name: one for channel, one in zip(found.channels, found.margins, strict=False)}
    if found.stable:
        by_channel[""] = least(found.margins)
    made = {}
    for name in MARGINS:
        kind = next(kind for kind in UNITS if name.startswith(kind))
        one = by_channel.get(name.removeprefix(kind).removeprefix("_"))
        endless = MOST.get(kind, 1.0)
        made[name] = (
            UNSTABLE[kind] if not found.stable else endless if one is None else min(sizes(one)[kind], MOST.get(kind, math.inf))
        )
    return made


def sizes(one: Margins) -> dict[str, float]:
    return {
        "gain_margin_up": one.up,
        "gain_margin_down": one.down,
        "phase_margin": one.phase,
        "delay_margin": one.delay,
        "disk_margin": one.disk,
        LESS_IS_BETTER: one.sensitivity,
    }


MOST_STATES, MOST_TICKS = 160, 50
"""Of a loop that is linearised here; more take seconds."""


def quick_grade(mission: Mission) -> Mapping[str, str]:
    """The "grade" and "why" of a mission's loop at rest where its path begins; empty where `quadstep linear` has to be asked:
    the loop is large, has other slopes on other sides of rest, or has no equations.
    """
    law = mission.controller.controller
    if issubclass(law, Opaque) or law.one_at_a_time:
        return {}
    try:
        plans = of_even_rotors(hovering(mission))
        found = cached("grade", mission, plans, lambda: at_once(mission, [Loops(plan) for plan in plans]))
    except Exception:
        return {}
    return cast("Mapping[str, str]", found)


def whole_grade(mission: Mission) -> Grade:
    """The grade of a stock law's loop however long it takes, kept as well; never raises for a loop that has none."""
    try:
        plans = of_even_rotors(hovering(mission))
    except UserError as error:
        return refused(error)
    found = cached("whole grade", mission, plans, lambda: grade(mission))
    word, why, measures = cast("tuple[str, str, list[tuple[str, float, float, str, float, str]]]", found)
    return Grade(word, why, tuple(Measure(*one) for one in measures))


def cached(kind: str, mission: Mission, plans: list[FlightPlan], made: Callable[[], object]) -> object:
    """What is made of a mission's loops, as JSON has it; made once for the same laws and numbers, and anew each time where a
    loop has code of its user's, which may change while it keeps its name.
    """
    if any(is_own(plan.loop) for plan in plans):
        return made()
    name = code_cache.key(kind, code_digest(), own_digest(), fingerprint(plans), repr(limits(mission)))
    found = code_cache.read(name)
    if found is None:
        found = json.dumps(made()).encode()
        code_cache.write(name, found)
    loaded: object = json.loads(found)
    return loaded


def is_own(part: object) -> bool:
    """Whether a part of a loop, or anything in it, is not of this package."""
    inner = (
        [getattr(part, one.name) for one in fields(part)] if is_dataclass(part) else part if isinstance(part, tuple) else ()
    )
    place = getattr(part, "__module__", "builtins").partition(".")[0]
    return place not in ("quadstep", "builtins") or any(map(is_own, inner))


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
            if one.count > MOST_TICKS or len(states(flown)) > MOST_STATES:
                return {}
            try:
                rest = newton(one, flown, first)
                if rest.period.period.bends:
                    rest = with_pieces(rest)
                if rest.pieces:
                    return {}
                rest = with_others(rest)
            except NoRestError:
                try:
                    rest = at_rest(one.plan)
                except NoRestError as error:
                    return {"grade": (none := refused(error)).word, "why": none.why}
            analyses += [of_loop(each, limits(mission)) for each in (rest.period, *rest.pieces)]
    found: Grade = graded(worst_of(analyses))
    return {"grade": found.word, "why": found.why}
