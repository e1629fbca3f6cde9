"""What `quadstep what-if` says of a change of parameters, against more flights of a campaign with another seed."""

import math
from collections.abc import Iterable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np

from quadstep.control.registry import STOCK
from quadstep.io.errors import UserError
from quadstep.mission.presets import preset_table
from quadstep.mission.read import check_mission
from quadstep.report.sheet import Sheet
from quadstep.studies.campaign.flyer import OUTCOME, OUTCOMES, Flyer
from quadstep.studies.campaign.schema import campaign_of
from quadstep.studies.tuning.gains import with_numbers
from quadstep.studies.tuning.ground import tuning_request
from quadstep.studies.what_if import answer, in_gusts, law_of, question
from quadstep.studies.what_if_report import Question
from tests.challenge.margins import PRESETS
from tests.challenge.search import Attempt, Search, coverage

FLIGHTS, MORE = 100, 3000
"""Of an answer, and of the truth, whose own scatter takes half a percent of what intervals at 95 % hold."""

COMPLETED = "completed"


class Answered(NamedTuple):
    """What an answer says of one number, and what it is. case: to repeat it."""

    low: float
    high: float
    truth: float
    case: str

    @property
    def held(self) -> bool:
        return not (self.low > self.truth or self.high < self.truth)


def questions(seed: int, folder: Path) -> Iterator[Question]:
    """One or two gains of a stock law on a vehicle that is heavier or lighter than its preset, without end."""
    random = np.random.default_rng(seed)
    while True:
        name, preset = str(random.choice(STOCK)), str(random.choice(PRESETS))
        table = preset_table(preset)
        light, slow = random.uniform(0.85, 1.2), random.uniform(0.8, 1.3)
        file = folder / f"{preset}-{random.integers(1_000_000)}.toml"
        inertia = [float(one) for one in slow * np.array(table["inertia"])]
        file.write_text(f'preset = "{preset}"\nmass = {float(light * table["mass"])!r}\ninertia = {inertia!r}\n')
        law = law_of(Question(name, {}, str(file)))
        gains = {
            key: one for key, (_, one) in law.by_key().items() if one.tunable and isinstance(one.fixed, float) and one.fixed
        }
        chosen = random.choice(sorted(gains), int(random.integers(1, 3)), replace=False)
        changes = {str(key): float(gains[key].fixed * np.exp(random.uniform(-0.9, 0.9))) for key in chosen}
        wind, within = float(random.uniform(0.0, 9.0)), float(np.exp(random.uniform(np.log(0.15), np.log(1.5))))
        yield Question(name, changes, str(file), wind, FLIGHTS, int(random.integers(1, 2**31)), within)


def flown(content: dict[str, object], asked: Question) -> dict[str, np.ndarray]:
    """Many flights of a mission in gusts, by themselves."""
    request = tuning_request(Path(asked.file), "", content, Path.cwd(), apart=False)
    bare = {key: value for key, value in content.items() if key != "tune"}
    file = request.campaign(request.section.vary, seed=asked.seed + 2**32, flights=MORE)
    table = Flyer(campaign_of(file, "", bare, asked.file, Path.cwd())).fly(0, MORE)
    columns = {name: table[name].to_numpy() for name in table.column_names if "[" in name or name == "saturation"}
    return {**columns, OUTCOME: np.array(table[OUTCOME].to_pylist()) == COMPLETED}


def answered(seed: int) -> Iterator[Answered]:
    """Every number with an interval of one answer after another."""
    assert COMPLETED in OUTCOMES
    with TemporaryDirectory() as folder:
        for place, asked in enumerate(questions(seed, Path(folder))):
            law, here = law_of(asked), Path.cwd()
            try:
                said = answer(asked, Path(folder) / f"out-{place}", sheet=Sheet(formats=())).record
                calm = question(asked, law, here)
                mission = check_mission(calm, asked.file, here)
                before = {f"controller.{name}": value for name, value in said["before"].items()}
                after = {f"controller.{name}": value for name, value in asked.changes.items()}
                gusty = in_gusts(calm, asked, before)
                sides = [flown(with_numbers(gusty, mission, values) if values else gusty, asked) for values in ({}, after)]
            except UserError:
                continue
            kept = [one[OUTCOME] for one in sides]
            both = kept[0] & kept[1]
            case = f"seed {seed}, question {place}: {asked}"
            shares = [1.0 - float(one.mean()) for one in kept]
            for name, truth in zip(("before", "after", "difference"), (*shares, shares[1] - shares[0]), strict=True):
                yield Answered(said["failed"][name]["low"], said["failed"][name]["high"], truth, f"fail, {name}: {case}")
            for name, found in said["metrics"].items():
                values = [one[name] for one in sides]
                means = [mean(one[some]) for one, some in zip(values, kept, strict=True)]
                means.append(mean((values[1] - values[0])[both]))
                for when, truth in zip(("before", "after", "difference"), means, strict=True):
                    one = found[when]
                    if one and one["low"] is not None and np.isfinite(truth):
                        yield Answered(one["low"], one["high"], truth, f"{name}, {when}: {case}")


def mean(values: np.ndarray) -> float:
    return float(values.mean()) if len(values) else math.nan


def intervals(seed: int) -> Iterable[Attempt]:
    return coverage((one.held for one in answered(seed)), 0.93, batch=15)


SEARCHES = [
    Search(
        "intervals of what-if",
        "of 95 % intervals of what-if at least 93 % hold what many more flights give",
        intervals,
        slow=True,
    )
]
