"""Random vehicles whose sticks snap, without an excitation: what `advise` measures and advises, against the flown loop.

`python -m tests.challenge.setpoints [COUNT [SEED]] [ardupilot] [loud] [rings]` flies so many vehicles and counts.
"""

import itertools
import math
import sys
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from quadstep.identify.changes import Advice, changes
from quadstep.identify.excited import Excited, refuse_narrow, setpoint_excitation
from quadstep.identify.logs.series import Columns, Series, Topics
from quadstep.identify.plant import loop_margins
from quadstep.identify.rate_loops import ARDUPILOT, PX4, RateLoop
from quadstep.io.errors import UserError
from quadstep.metrics.registry import LEAST_GAIN, LEAST_PHASE, SOUND
from tests.challenge.advice import CLOSE
from tests.challenge.search import Attempt, Search
from tests.rate_flights import Axis, Ring, flown, random_axes, stepped

USUAL, LOUD = (-3.5, -2.0), (-1.5, -0.5)
"""Powers of ten between which a gyro's noise lies [rad/s a sample]; of one whose command asks for a lower cut-off."""

NOISY_SAMPLES = 10_000
"""Of a flight that tells how loud a command is."""

EVERY, DURATION, BATCH, TOGETHER = {"px4": 2, "ardupilot": 1}, 90.0, 50, 250
"""Samples from one that is logged to the next; of a flight [s]; vehicles flown at once, of a search and of a count."""

OMEGA = np.geomspace(0.3, 1000.0, 8_000)


class Flown(NamedTuple):
    """A vehicle: what is off, crossover as a share and phase margin [rad], and whether its interval held; least margins before
    and after what was advised, as shares of a sound loop's, None where nothing was. louder: the command's noise with another
    cut-off over that without, as flown. doubtful: whether advice says that a resonance may be hidden. refusal: why there is
    no measurement.
    """

    crossover: float = 0.0
    phase: float = 0.0
    held: bool = True
    before: float = 0.0
    after: float | None = None
    grade: str = ""
    filters: tuple[str, ...] = ()
    louder: float = 1.0
    doubtful: bool = False
    refusal: str = ""


def least(opened: np.ndarray, stable: np.ndarray | None = None) -> tuple[float, float, float]:
    """Crossover [rad/s] and phase margin [rad], negative where unstable, and the least margin as a share of a sound loop's,
    negative where it turns about -1 otherwise than a stable loop.
    """
    level, phase = 20.0 * np.log10(np.abs(opened)), np.unwrap(np.angle(-opened))
    at = np.flatnonzero(np.diff(level > 0.0))
    margins = np.array([math.remainder(float(phase[i]), 2.0 * math.pi) for i in at])
    turns = np.flatnonzero(np.diff(np.floor(phase / (2.0 * math.pi))))
    place = int(np.abs(margins).argmin())
    shares = [margins[place] / LEAST_PHASE, *(abs(level[turns]) / LEAST_GAIN)]
    turned = 0.0 if stable is None else np.ptp([np.diff(np.unwrap(np.angle(1.0 + one))[[0, -1]]) for one in (opened, stable)])
    return float(OMEGA[at[place]]), float(margins[place]), float(min(shares)) if turned < math.pi else -1.0


def parameters(loop: RateLoop, one: Axis) -> dict[str, float]:
    """What a log says of a vehicle, each (1,)."""
    gains = {"P": one.p, "I": one.i, "D": one.d}
    cuts = {"IMU_GYRO_CUTOFF": one.cut, "IMU_DGYRO_CUTOFF": one.slope}
    if loop.form == "px4":
        gains["K"] = np.ones_like(one.p)
    else:
        gains |= {"FLTT": one.target, "FLTE": one.error, "FLTD": one.slope}
        cuts = {"INS_GYRO_FILTER": one.cut, "SCHED_LOOP_RATE": 1.0 / one.period}
    told = {f"{loop.stem}{name}": value for name, value in gains.items()} | {loop.attitude: one.attitude} | cuts
    return {name: float(value) if np.isfinite(value) else 0.0 for name, value in told.items()}


def read(
    loop: RateLoop,
    time: np.ndarray,
    signals: Iterable[np.ndarray],
    told: dict[str, float],
    more: Columns = MappingProxyType({}),
) -> Excited:
    """What `advise` has of setpoint, rate [rad/s] and command, each (n,), where all axes fly alike. Raises UserError."""
    units = {loop.setpoint: loop.unit, loop.rate: loop.unit, loop.command: 1.0}
    logged = {name: Series(time, one / unit) for (name, unit), one in zip(units.items(), signals, strict=True)}
    flight = setpoint_excitation(Path("flight.ulg"), Topics({**logged, **more}, 0, told), loop, 0)
    refuse_narrow(Path("flight.ulg"), flight)
    return flight._replace(others=(flight, flight))


def changed(axes: Axis, advice: Advice, loop: RateLoop) -> Axis:
    """All with the change that is advised for one."""
    endings = {"GYRO_CUTOFF": "cut", "GYRO_FILTER": "cut", "DGYRO_CUTOFF": "slope", "FLTD": "slope", "FLTE": "error"}
    endings |= {"FLTT": "target", "I": "i"}
    found = axes
    for name, (_, value) in advice.others.items():
        ending = name.removeprefix(loop.stem).removeprefix("IMU_").removeprefix("INS_")
        field = "attitude" if name == loop.attitude else endings[ending]
        found = found._replace(**{field: np.full_like(axes.cut, value)})
    return found.scaled(advice.factor)


def resonances(random: np.random.Generator, axes: Axis) -> Ring:
    """Of frames, that nothing shakes but the command, by up to 0.7 of itself where the loop closes over them."""
    count, none = len(axes.p), np.zeros(len(axes.p))
    at, damping, gain = np.exp(random.uniform(np.log([[15.0], [0.01], [0.05]]), np.log([[120.0], [0.1], [0.7]]), (3, count)))
    ring = Ring(at, damping, none + 1.0, none, none)
    return ring._replace(by_torque=gain / np.abs(axes.opened(OMEGA, ring) - axes.opened(OMEGA)).max(axis=1))


def vehicles(
    random: np.random.Generator, count: int, loop: RateLoop = PX4[0], powers: tuple[float, float] = USUAL, rings: bool = False
) -> Iterator[Flown]:
    """Stable ones, as PX4 logs them every 2 ms or ArduPilot every sample, with noisy gyros in gusts. powers: of ten, between
    which the gyros' noise lies [rad/s a sample]. rings: small gains, and a resonance of the frame.
    """
    axes, every = random_axes(random, count, loop.form == "ardupilot"), EVERY[loop.form]
    axes = axes.scaled(np.exp(random.uniform(math.log(0.2), 0.0, count))) if rings else axes
    ring = resonances(random, axes) if rings else None
    period = float(axes.period[0])
    angle = stepped(random, DURATION, period=period)
    with np.errstate(all="ignore"):
        noise, number = 10.0 ** random.uniform(*powers), int(random.integers(1 << 30))
        columns = flown(axes, angle[:, None] * axes.attitude, noise, 0.3, number, every, ring)
    time = every * period * np.arange(len(columns[0]))
    opened = axes.opened(OMEGA, ring)
    for place in range(count):
        signals = [column[:, place] for column in columns]
        at, phase, before = least(opened[place])
        if not np.isfinite(signals[2]).all() or phase <= 0.0 or np.abs(signals[1]).max() > 50.0:
            continue
        try:
            flight = read(loop, time, signals, parameters(loop, Axis(*(field[place] for field in axes))))
        except UserError as error:
            yield Flown(refusal=str(error))
            continue
        now, behind = loop_margins(flight)
        if now.phase is None:
            yield Flown(refusal="no phase margin is told")
            continue
        advice = changes(flight, now, behind)
        then = changed(axes, advice, loop).opened(OMEGA, ring)[place] if advice else None
        after = None if then is None else least(then, opened[place])[2]
        held = now.phase.value.low <= phase <= now.phase.value.high
        names, louder = (*advice.others,) if advice else (), 1.0
        if advice and advice.others:
            both = (Axis(*(field[[place]] for field in one)) for one in (axes, changed(axes, advice, loop)))
            louder = noisier(Axis(*map(np.concatenate, zip(*both, strict=True))), angle[:NOISY_SAMPLES], noise, number)
        off = now.phase.at.value / at - 1.0, now.phase.value.value - phase
        doubtful = advice is not None and advice.expected.doubtful
        yield Flown(*off, held, before, after, now.grade, names, louder, doubtful)


def noisier(pair: Axis, angle: np.ndarray, noise: float, number: int) -> float:
    """The noise in the command of the second vehicle over that of the first, from sample to sample, as flown."""
    command = flown(pair, angle[:, None] * pair.attitude, noise, 0.3, number, 1)[2]
    first, second = np.diff(command, axis=0).std(axis=0)
    return float(second / first)


def searched(seed: int) -> Iterable[Attempt]:
    random = np.random.default_rng(seed)
    for loop in itertools.cycle((PX4[0], ARDUPILOT[0])):
        for one in vehicles(random, BATCH, loop):
            if one.after is not None or one.grade == SOUND:
                said = f"{one.grade}, with {one.before:.3g} of a sound loop's margins, and {one.after} as advised"
                right = (one.before if one.after is None else one.after) > CLOSE
                yield Attempt(0.0 if right else 2.0, said)


def hidden(seed: int) -> Iterable[Attempt]:
    """Resonances that only their own loop shakes, so that nothing but its noise tells them: gains rise no further than they
    allow, and where one has taken a sound loop's margins, the loop is not called sound, as flown or as advised.
    """
    random = np.random.default_rng(seed)
    for loop in itertools.cycle((PX4[0], ARDUPILOT[0])):
        for one in vehicles(random, BATCH, loop, rings=True):
            if one.after is not None or one.grade == SOUND:
                said = f"{loop.form}: {one.grade}, with {one.before:.3g} of a sound loop's margins, and {one.after} as advised"
                least_after = min(one.before, CLOSE) if one.doubtful else CLOSE
                called = one.grade != SOUND or one.before > CLOSE
                yield Attempt(0.0 if called and (one.after is None or one.after > least_after) else 2.0, said)


def quietened(seed: int) -> Iterable[Attempt]:
    """Loops whose gyro's noise dominates their command: a lower cut-off leaves them sound, and is quieter."""
    random = np.random.default_rng(seed)
    for loop in itertools.cycle((PX4[0], ARDUPILOT[0])):
        for one in vehicles(random, BATCH, loop, LOUD):
            if one.filters and one.grade == SOUND and one.after is not None:
                said = f"{one.filters} lowered: {one.after:.3g} of a sound loop's margins, {one.louder:.3g} of the noise"
                yield Attempt(0.0 if one.after > CLOSE and one.louder < 1.0 else 2.0, said)


SEARCHES = [
    Search("advice from setpoints", "no loop is called sound, as flown or as advised, that is not", searched),
    Search("advice where a frame resonates", "gains that rise wake no resonance, and what one may take is said", hidden),
    Search("advice for noisy commands", "with a lower cut-off a loop is sound, and its command quieter", quietened),
]


def main() -> None:
    """Counts of so many vehicles."""
    numbers = [int(one) for one in sys.argv[1:] if one.isdigit()]
    wanted, seed = numbers + [1000, 20261126][len(numbers) :]
    random = np.random.default_rng(seed)
    loop, every = ARDUPILOT[0] if "ardupilot" in sys.argv else PX4[0], list[Flown]()
    while len(every) < wanted:
        every += vehicles(random, min(TOGETHER, wanted), loop, LOUD if "loud" in sys.argv else USUAL, "rings" in sys.argv)
    sys.stdout.write(counted(every[:wanted]))


def counted(every: list[Flown]) -> str:
    """What `advise` measured and advised, in lines."""
    told = [one for one in every if not one.refusal]
    close = [one for one in told if abs(one.crossover) < 0.05 and abs(one.phase) < math.radians(3.0)]
    after = [one.after for one in told if one.after is not None]
    weak = [one for one in told if one.before < 1.0]
    better, sure = (
        sum(one.after is not None and one.after > most(one.before) for one in weak) for most in (float, lambda _: 1.0)
    )
    worse = sum(one.after is not None and one.after < min(one.before, 1.0) for one in told)
    sound = [one.before for one in told if one.grade == SOUND]
    promised = [one.after for one in told if one.after is not None and not one.doubtful]
    off = np.abs([(100.0 * one.crossover, math.degrees(one.phase)) for one in told])
    held = sum(one.held for one in told)
    counts = f"{len(told)} of {len(every)} measured, {len(close)} within 5 % and 3 degrees; {held} intervals hold"
    errors = f"crossover [%] and phase margin [deg] off by: median, 95 %, largest {np.quantile(off, (0.5, 0.95, 1.0), axis=0)}"
    least_after = f"{worse} of these worse, at least {min(after, default=0.0):.3g} of a sound loop's margins"
    said = (
        f"{len(weak)} lack margin, {better} of these better and {sure} sound as advised; {len(after)} advised, {least_after}"
    )
    said += "; others: " + ", ".join(f"{name} {n}" for name, n in Counter(n for o in told for n in o.filters).items())
    quiet = [one for one in told if one.filters and one.grade == SOUND]
    less = (
        f"{len(quiet)} sound ones quietened to {', '.join(f'{one.louder:.2f}' for one in quiet)} of their noise, and at least "
    )
    less += f"{min((one.after or 0.0 for one in quiet), default=0.0):.3g} of a sound loop's margins"
    good = f"{len(sound)} called sound, at least {min(sound, default=0.0):.3g}; {len(promised)} advised without saying that a "
    good += f"resonance may be hidden, at least {min(promised, default=0.0):.3g}"
    return "\n".join([counts, errors, said, good, less, ""])


if __name__ == "__main__":
    main()
