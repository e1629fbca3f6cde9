"""The study's numbers as committed: `python -m tests.golden` rewrites `tests/golden/metrics.json` from a fresh study.

One line a flight: the numbers of its metrics in the order of `columns`, every digit of them, null where there is none (an
angle that never settles, an error of a flight that ends at once). Every engine and processor gives the same bits, so the
flights that diverge, which amplify any difference, are held to theirs too.
"""

import json
from functools import lru_cache
from pathlib import Path

from quadstep.studies.paper.cases import fly_study, plan_study
from quadstep.studies.paper.claims import check_claims

FILE = Path(__file__).parent / "golden" / "metrics.json"


@lru_cache(maxsize=1)
def study():
    """The study, flown once a test run."""
    return fly_study(plan_study())


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


def summary(flown):
    """Every number of every flight."""
    columns = list(numbers(flown.cases["case1"]))
    kept = {}
    for name, metrics in flights(flown).items():
        found = numbers(metrics)
        assert set(found) <= set(columns), name
        kept[name] = [metrics["outcome"], *(found.get(column) for column in columns)]
    verdicts = {claim.name: str(claim.verdict) for claim in check_claims(flown)}
    return {"columns": ["outcome", *columns], "flights": kept, "verdicts": verdicts}


def text(content):
    """JSON with one line a flight."""
    lines = ",\n".join(f"  {json.dumps(name)}: {json.dumps(row, allow_nan=False)}" for name, row in content["flights"].items())
    columns, verdicts = (json.dumps(content[key], indent=1) for key in ("columns", "verdicts"))
    return f'{{\n"columns": {columns},\n"verdicts": {verdicts},\n"flights": {{\n{lines}\n}}\n}}\n'


if __name__ == "__main__":
    FILE.parent.mkdir(exist_ok=True)
    FILE.write_text(text(summary(study())), encoding="utf-8")
