"""Modes, margins and grades of `quadstep linear` against differences of the flown loop, on random vehicles and laws."""

import math
import shutil
from collections.abc import Iterable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from quadstep import Mission
from quadstep.control.registry import names
from quadstep.identify.datasheet import Datasheet
from quadstep.identify.vehicle_estimate import estimate, vehicle_of
from quadstep.interfaces.controller import Measured
from quadstep.io.errors import UserError
from quadstep.linear.analysis import Analysis, of_loop, worst_of
from quadstep.linear.equilibrium import Rest, at_rest, hovering
from quadstep.linear.grade import SOUND, grade
from quadstep.linear.modes import scales
from quadstep.linear.sampled import Loops, linearising
from quadstep.linear.states import states, with_states
from quadstep.mission.check import check
from tests.altered import Delayed, Scaled
from tests.challenge.search import Attempt, Search
from tests.random_sheets import UNGRADED

HOLD = {"type": "step", "start": [0.0, 0.0, 5.0], "end": [0.0, 0.0, 5.0], "duration": 10.0}
LAWS = tuple(name for name in names(Measured) if name not in (*UNGRADED, "mpc"))
"""The sums of the solver of `mpc` are stiff: differences over 1e-7 keep too few digits of its slopes."""
EXAMPLES = Path(__file__).parents[2] / "examples"
PRESETS = ("crazyflie", "hummingbird", "research-2.6kg", "x500")
CLOSE = 1e-4
"""Largest difference of slopes in balanced coordinates, which differences of flights leave where slopes bend at rest."""

NEUTRAL = 1.0 + 1e-7
"""Larger factors in a period grow; states that never change, and on which nothing depends, have exactly 1."""

ASIDE = 0.02
"""How far to either side of a margin, as a share of it."""


SIZES = 1e-4, 1e-5, 1e-7
"""Of the steps of differences: a law may bend between them."""


def vehicles(random: np.random.Generator) -> Iterator[tuple[str, object]]:
    """Presets and data sheets, without end."""
    while True:
        if random.random() < 0.3:
            preset = str(random.choice(PRESETS))
            yield preset, {"preset": preset}
            continue
        inches = float(np.exp(random.uniform(np.log(3.0), np.log(15.0))))
        mass = 0.25 * (inches / 3.0) ** 1.8 * float(random.uniform(0.8, 1.3))
        sheet = {
            "name": "sheet", "mass": mass, "wheelbase": 0.043 * inches, "kv": 11000.0 / inches, "cells": 4, "capacity": mass,
            "motor_mass": 0.05 * mass, "propeller": {"inches": [inches, 0.6 * inches]},
        }  # fmt: skip
        text = f"{inches:.3g} inches, {mass:.3g} kg"
        try:
            found = check(Datasheet, sheet, text)
            yield text, vehicle_of(found, estimate(found)).model_dump(mode="json", exclude_none=True)
        except UserError:
            continue


def cases(seed: int) -> Iterator[tuple[str, Rest, Analysis]]:
    """Loops at rest, with the worst analysis of their pieces, without end."""
    random = np.random.default_rng(seed)
    for name, vehicle in vehicles(random):
        law, wind = str(random.choice(LAWS)), float(random.choice([0.0, 3.0]))
        case = f"{law} on {name}, wind {wind:g} m/s"
        try:
            mission = Mission(vehicle=vehicle, path=HOLD, controller={"type": law}, wind={"mean": [wind, 0.0, 0.0]})
            with linearising():
                rest = at_rest(hovering(mission))
                yield case, rest, worst_of([of_loop(one) for one in (rest.period, *rest.pieces)])
        except UserError:
            continue


def differences(loops: Loops, rest: Rest, flown, size: float = 1e-5) -> np.ndarray:
    """The map of a period by central differences of flights, all of them in one flight of arrays; (states, states)."""
    values = np.array(states(flown))
    count, steps = len(values), size * (1.0 + np.abs(values))
    columns = np.repeat(values[:, None], 4 * count, axis=1)
    for place, share in enumerate((1.0, -1.0, 2.0, -2.0)):
        columns[np.arange(count), place * count + np.arange(count)] += share * steps
    after = loops.fly(with_states(flown, list(columns)), rest.first, rest.first + loops.count)
    ends = np.array([np.broadcast_to(leaf, 4 * count) for leaf in states(after)]).reshape(count, 4, count)
    fine, coarse = (ends[:, 0] - ends[:, 1]) / (2.0 * steps), (ends[:, 2] - ends[:, 3]) / (4.0 * steps)
    return (4.0 * fine - coarse) / 3.0


def modes(seed: int) -> Iterable[Attempt]:
    """The map of every loop that bends neither at rest nor near it, state by state."""
    for case, rest, _ in cases(seed):
        if rest.pieces:
            continue
        places, exact = rest.period.places, rest.period.map
        for size in SIZES:
            near = differences(rest.loops, rest, rest.flown, size)[np.ix_(places, places)]
            miss = apart(near, exact, exact)
            yield Attempt(miss / CLOSE, f"{case}: slopes differ by {miss:.2g} over {size:g}")


def apart(one: np.ndarray, other: np.ndarray, exact: np.ndarray) -> float:
    """How far, relative to the largest slope, in units of the states."""
    units = scales(exact)
    ratio = units / units[:, None]
    return float(np.abs((one - other) * ratio).max() / max(1.0, np.abs(exact * ratio).max()))


def largest(loops: Loops, rest: Rest, flown) -> float:
    """The largest factor of a mode in a period, of a flown loop."""
    return float(np.abs(np.linalg.eigvals(differences(loops, rest, flown))).max())


def scaled(rest: Rest, channel: int, factor: float) -> float:
    """The same with a channel scaled."""
    return largest(Scaled(rest, channel, factor), rest, rest.flown)


def delayed(rest: Rest, channel: int, late: int) -> float:
    """The same with a channel late by so many samples."""
    loops = Delayed(rest, [channel], late)
    return largest(loops, rest, loops.begun)


def sides(seed: int) -> Iterable[Attempt]:
    """Every finite margin: the flown loop is stable on one side of it and, unless it bends, not on the other."""
    for case, rest, found in cases(seed):
        if not found.holds:
            continue
        plan = rest.loops.plan
        sample = plan.ticks.every[[task.name for task in rest.loops.loop.tasks].index("law")] * plan.ticks.step
        for i, (channel, one) in enumerate(zip(found.channels, found.margins, strict=True)):
            for what, gain in (("gain up", one.gain_up), ("gain down", one.gain_down)):
                if 0.0 < gain < math.inf:
                    inside, outside = (math.exp(share * math.log(gain)) for share in (1.0 - ASIDE, 1.0 + ASIDE))
                    right = scaled(rest, i, inside) < NEUTRAL and (rest.pieces or scaled(rest, i, outside) > NEUTRAL)
                    yield Attempt(0.0 if right else 2.0, f"{case}: {what} of {channel.name}, {gain:.6g}")
            if one.delay < 60 * sample:
                few, many = math.floor((1.0 - ASIDE) * one.delay / sample), math.ceil((1.0 + ASIDE) * one.delay / sample)
                right = delayed(rest, i, few) < NEUTRAL and (rest.pieces or delayed(rest, i, many) > NEUTRAL)
                yield Attempt(0.0 if right else 2.0, f"{case}: delay of {channel.name}, {one.delay:.6g} s")


AGEING = """
from typing import NamedTuple
from own_airframe_controller import ProportionalDerivative
from quadstep.own import Number, where

class Memory(NamedTuple):
    age: Number

class Ageing(ProportionalDerivative):
    def start(self, measured, gains):
        return Memory({first!r})

    def law(self, memory, measured, reference, gains, t, period):
        felt = where(memory.age < {past!r}, 1.0, -0.2) * measured.velocity
        command, _ = super().law((), measured._replace(velocity=felt), reference, gains, t, period)
        return command, Memory({grown!r} * memory.age + {more!r})
"""


def ageing(seed: int) -> Iterable[Attempt]:
    """A law that turns against its velocity once a memory of its own is past a number, at any time of its flight."""
    random = np.random.default_rng(seed)
    with TemporaryDirectory() as name:
        folder = Path(name)
        shutil.copy(EXAMPLES / "own_airframe_controller.py", folder)
        while True:
            grown = 1.0 if random.random() < 0.4 else float(1.0 + random.uniform(-0.02, 0.02))
            first, more = float(random.uniform(0.0, 1.0)), float(10.0 ** random.uniform(-4.0, 1.0))
            ages, until = [first], int(random.integers(100, 1900))  # of 2,000 samples
            for _ in range(until):
                ages.append(grown * ages[-1] + more)
            if not abs(ages[-1] - ages[-2]) > 1e-6 or ages[-1] <= max(ages[:-1]):
                continue
            (folder / "ageing.py").write_text(AGEING.format(first=first, past=ages[-1], grown=grown, more=more))
            content = {
                "vehicle": {"preset": "x500"}, "path": {**HOLD, "duration": 4.0},
                "controller": {"type": "ageing.py:Ageing"},
            }  # fmt: skip
            word = grade(Mission.model_validate(content, context={"folder": folder})).word
            yield Attempt(2.0 if word == SOUND else 0.0, f"{grown!r} m + {more!r} from {first!r}, past {ages[-1]!r}: {word}")


SEARCHES = [
    Search("a memory that grows", "no loop is sound that a memory of its law makes unstable before its end", ageing),
    Search("slopes of a linear loop", "`linear` differentiates the loop as it flies", modes),
    Search("both sides of a margin",
        "the flown loop is stable within each margin of `linear`, and not beyond it unless it bends", sides),
]  # fmt: skip
