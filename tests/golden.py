"""The study's numbers as committed: `python -m tests.golden` rewrites `tests/golden/metrics.json` from a fresh study.

One line a flight: the numbers of its metrics in the order of `columns`, to ten digits, null where there is none (an angle
that never settles). Some flights are chaotic, all that diverge and a few that do not: round-off, and with it another
processor or compiler, decides their last digits first and soon all of them. They are found by flying the study a second time
with its starts moved by 1e-13 m; of these only the outcome and the time are kept.
"""

import json
from functools import lru_cache
from pathlib import Path

from quadstep.numbers import Vector
from quadstep.study.claims import check_claims
from quadstep.study.study import StudyPlans, completed, fly_study, plan_study

FILE = Path(__file__).parent / "golden" / "metrics.json"
DIGITS = 10
NUDGE = 1e-13
"""How far the starts are moved to find the flights that round-off decides [m]."""


@lru_cache(maxsize=1)
def study():
    """The study, flown once a test run."""
    return fly_study(plan_study())


def nudged_study():
    """The study from starts that are moved by next to nothing."""

    def nudged(plan):
        position = Vector([value + NUDGE for value in plan.start.position])
        return plan._replace(start=plan.start._replace(position=position))

    return fly_study(StudyPlans(*({key: nudged(plan) for key, plan in family.items()} for family in plan_study())))


def flights(flown):
    """Metrics of every flight by name."""
    named = {**flown.cases, **flown.further}
    named |= {f"case3; {where}; {controller}": metrics for (where, controller), metrics in flown.starts.items()}
    named |= {f"{flight}; {count} neurons; seed {seed}": m for (flight, count, seed), m in flown.neurons.items()}
    stress = flown.stress.items()
    return named | {f"t_f {t:g} s; scale {scale:g}; nets {'on' if nets else 'off'}": m for (t, scale, nets), m in stress}


def numbers(metrics, prefix=""):
    """The numbers of nested metrics by dotted name; text is dropped."""
    found = {}
    for key, value in metrics.items():
        if isinstance(value, dict):
            found |= numbers(value, f"{prefix}{key}.")
        elif not isinstance(value, str):
            found[prefix + key] = value
    return found


def rounded(value):
    return None if value is None else float(f"{value:.{DIGITS}g}")


def end(metrics):
    """What is kept of a chaotic flight."""
    return {"outcome": metrics["outcome"], "ended[s]": rounded(metrics["ended[s]"])}


def summary(flown):
    """Every number of the flights that complete, the end of the others."""
    columns = list(numbers(flown.cases["case1"]))
    kept = {}
    for name, metrics in flights(flown).items():
        found = numbers(metrics)
        assert not completed(metrics) or list(found) == columns, name
        kept[name] = [rounded(value) for value in found.values()] if completed(metrics) else end(metrics)
    verdicts = {claim.name: str(claim.verdict) for claim in check_claims(flown)}
    return {"columns": columns, "flights": kept, "verdicts": verdicts}


def differing(columns, row, other):
    """The numbers of a flight that are not those of another: 1e-6 relative, 1e-9 absolute for what is only round-off."""
    return [
        (column, a, b)
        for column, a, b in zip(columns, row, other, strict=True)
        if (a is None) != (b is None) or (a is not None and abs(a - b) > 1e-9 + 1e-6 * abs(b))
    ]


def committed():
    """What is written: the summary, with only the end of flights that round-off decides."""
    content, nudged = summary(study()), summary(nudged_study())["flights"]
    for name, metrics in flights(study()).items():
        row, other = content["flights"][name], nudged[name]
        if isinstance(row, dict) or isinstance(other, dict) or differing(content["columns"], row, other):
            content["flights"][name] = end(metrics)
    return content


def text(content):
    """JSON with one line a flight."""
    lines = ",\n".join(f"  {json.dumps(name)}: {json.dumps(row, allow_nan=False)}" for name, row in content["flights"].items())
    columns, verdicts = (json.dumps(content[key], indent=1) for key in ("columns", "verdicts"))
    return f'{{\n"columns": {columns},\n"verdicts": {verdicts},\n"flights": {{\n{lines}\n}}\n}}\n'


if __name__ == "__main__":
    FILE.parent.mkdir(exist_ok=True)
    FILE.write_text(text(committed()), encoding="utf-8")
