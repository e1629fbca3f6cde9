"""Made logs of which it is known what took their motors to a limit, whether the gyro has a tone, and whether descents stir
the vehicle more: against what `advise` says of them. `python -m tests.challenge.symptoms [COUNT]` counts.
"""

import math
import re
import sys
from collections import Counter
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from quadstep.identify.changes import changes
from quadstep.identify.excited import Excited
from quadstep.identify.logs.series import Series
from quadstep.identify.measured import measured
from quadstep.identify.peaks import STANDS
from quadstep.identify.plant import loop_margins
from quadstep.identify.rate_loops import ARDUPILOT, COLUMNS, PX4, PX4_MOTORS, SINKING, RateLoop
from quadstep.identify.response import Response
from quadstep.identify.symptoms import peak, saturation, wash
from quadstep.io.errors import UserError
from tests.challenge.advice import CLOSE
from tests.challenge.search import Attempt, Search
from tests.challenge.setpoints import NOISY_SAMPLES, OMEGA, least, parameters, read
from tests.rate_flights import Axis, Ring, flown, random_axes, stepped

PERIOD, DURATION, HIGHEST = 0.004, 120.0, 150.0
AXES = [one.axis for one in PX4[:3]]

WHOLE_RANGE = {
    "ardupilot": {
        **{"MOT_PWM_MIN": 0.0 + 1e-9, "MOT_PWM_MAX": 1.0, "MOT_SPIN_MIN": 0.0, "MOT_SPIN_MAX": 1.0},
        **{f"SERVO{number}_FUNCTION": 32.0 + number for number in range(1, 5)},
    }
}
"""Of motors that are logged from 0 to 1."""


def slow(random: np.random.Generator, count: int, span: float) -> np.ndarray:
    """Noise of deviation 1 that lasts so long [s]."""
    lines = 2.0 * math.pi * np.fft.rfftfreq(count, PERIOD)
    found = np.fft.irfft(np.fft.rfft(random.normal(size=count)) / (1.0 + 1j * lines * span), count)
    return (found - found.mean()) / found.std()


def flight(command: np.ndarray, rate: np.ndarray | None = None, **columns: np.ndarray) -> Excited:
    """What `advise` has of a flight whose loop does nothing."""
    omega = np.geomspace(1.0, HIGHEST, 80)
    same = np.ones(80)
    found = Response(omega, same.astype(complex), 0.01 * same, 20.0 * same, same)
    time = PERIOD * np.arange(len(command))
    series = {name: Series(time, one) for name, one in columns.items()}
    one = Excited("roll", (), found, 0.0 * command, command, PERIOD, {}, loop=PX4[0])
    return one._replace(columns=series, rate=rate)


def mixed(random: np.random.Generator) -> Attempt:
    """Four to eight motors; the axis that made most of what took them to a limit comes first, with its share."""
    count, number = int(DURATION / PERIOD), int(random.integers(4, 9))
    angle = 2.0 * math.pi * (np.arange(number) + 0.5 * random.integers(2)) / number
    mixer = np.stack([np.sin(angle), np.cos(angle), np.where(np.arange(number) % 2, 1.0, -1.0)]) * random.uniform(
        0.3, 1.5, (3, 1)
    )
    sizes = 10.0 ** random.uniform(-1.7, -0.4, 3)
    commands = sizes[:, None] * np.stack([slow(random, count, float(random.uniform(0.02, 0.3))) for _ in AXES])
    thrust = random.uniform(0.2, 0.7) + random.uniform(0.0, 0.15) * slow(random, count, 1.0)
    parts = [
        *(commands[place][:, None] * mixer[place] for place in range(3)),
        (thrust - np.median(thrust))[:, None] + np.zeros(number),
    ]
    wanted = thrust[:, None] + sum(parts[:3])
    motors = np.clip(wanted, 0.0, 1.0)
    columns = {one.command: commands[place] for place, one in enumerate(PX4[:3])}
    columns |= {name: motors[:, place] for place, name in enumerate(PX4_MOTORS[:number])}
    worst, case = 0.0, f"{number} motors, commands of {sizes}"
    for one, high in zip(saturation(flight(commands[0], **columns)), (True, False), strict=True):
        at = wanted >= 1.0 - 1e-3 if high else wanted <= 1e-3
        true = at.any(axis=1).mean()
        said = float(re.search(r"for ([\d.e+-]+) %", one.sentence)[1])
        worst = max(worst, abs(said - 100.0 * true) / max(0.06 * 100.0 * true, 1e-9))
        if named := re.search(r"there (\w+) made (\d+) %", one.sentence):
            sums = {
                name: np.maximum((1 if high else -1) * part[at], 0.0).sum()
                for name, part in zip((*AXES, "thrust"), parts, strict=True)
            }
            share = sums[named[1]] / sum(sums.values())
            worst = max(
                worst, abs(share - 0.01 * float(named[2])) / 0.15, max(sums.values()) / sum(sums.values()) - share > 0.1
            )
            case += f"; {one.sentence} (true: {share:.2f})"
    return Attempt(float(worst), case)


def toned(random: np.random.Generator) -> tuple[bool, bool, float]:
    """Whether the gyro has a tone, whether one is told, and how far off its frequency is, as a share; noise is coloured."""
    count = int(DURATION / PERIOD)
    noise = 10.0 ** random.uniform(-3.0, -1.0) * random.normal(size=count)
    lines = np.fft.rfftfreq(count, PERIOD)
    cut = float(random.uniform(20.0, 100.0))
    shape = 1.0 / (1.0 + (1j * lines / cut)) ** int(random.integers(0, 3))
    rate = np.fft.irfft(np.fft.rfft(noise) * shape, count)
    at, told = float(random.uniform(35.0, 95.0)), bool(random.random() < 0.5)
    if told:
        phase = 2.0 * math.pi * np.cumsum(at * (1.0 + 0.003 * slow(random, count, 0.5))) * PERIOD
        level = math.sqrt(2.0) * float(np.abs(shape[np.searchsorted(lines, at)])) * noise.std()
        rate = rate + 0.7 * level * np.sin(phase)
    made = flight(noise, rate)
    (found,) = peak(made, measured(made.measured), None)
    where = float(re.search(r"at ([\d.]+) Hz", found.measured)[1])
    return told, found.shows, where / at - 1.0


def stirred(random: np.random.Generator) -> tuple[float, float, float] | None:
    """How much more descents stir a vehicle, with gusts in spells, and the interval that is told."""
    count = int(DURATION / PERIOD)
    sinks = 2.0 * np.sign(slow(random, count, 2.0)) * (random.random() < 0.9)
    sinks = np.repeat(sinks[:: int(2.0 / PERIOD)], int(2.0 / PERIOD))[:count]
    ratio = float(np.exp(random.uniform(0.0, 1.0))) if random.random() < 0.5 else 1.0
    gusts = np.exp(0.5 * slow(random, count, 4.0)) * slow(random, count, 0.01)
    rest = np.where(sinks > 0.0, ratio, 1.0) * gusts
    for one in wash(flight(rest, **{SINKING["px4"]: sinks})):
        low, high = (float(part) for part in re.search(r"\(([\d.]+) to ([\d.]+)\)", one.measured).groups())
        return ratio, low, high
    return None


class Rung(NamedTuple):
    """A flight with a tone: what made it, what `advise` says of it, least margins before and after, as shares of a sound
    loop's, and the command's noise with the notch over that without, as said and as flown; None without a notch.
    """

    kind: str
    said: str
    before: float
    after: float = math.nan
    louder: tuple[float, float] | None = None


def ringing(random: np.random.Generator, count: int, loop: RateLoop = PX4[0], duration: float = 60.0) -> Iterator[Rung]:
    """Sound vehicles with the structure of an autopilot, logged whole, whose gyro has a resonance, a rotor's tone, or noise
    alone; thrice as many as are wanted are drawn.
    """
    axes = random_axes(random, 3 * count, after=loop.form == "ardupilot")
    period, names, motor_names = float(axes.period[0]), loop.notches, COLUMNS[loop.form][:4]
    stem = names.stems[0]
    kinds = random.choice(["resonance", "rotor", "noise"], 3 * count, p=[0.6, 0.3, 0.1])
    angle = stepped(random, duration, period=period)
    time = period * np.arange(len(angle))
    throttle = np.exp(0.04 * np.interp(time, PERIOD * np.arange(len(angle)), slow(random, len(angle), 2.0)))
    ring = rings(random, axes, kinds)
    noise = np.where(kinds == "noise", 10.0 ** random.uniform(-2.0, -0.5, len(kinds)), 1e-3)
    number = int(random.integers(1 << 30))
    with np.errstate(all="ignore"):
        columns = flown(axes, angle[:, None] * axes.attitude, noise, 0.3, number, 1, ring, None, throttle)
    for place in range(3 * count):
        signals, one = [column[:, place] for column in columns], Axis(*(field[[place]] for field in axes))
        if not np.isfinite(signals[2]).all() or np.abs(signals[1]).max() > 50.0:
            continue
        mine = Ring(*(field[[place]] for field in ring))
        before = least(one.opened(OMEGA, mine)[0])[2]
        told = parameters(loop, Axis(*(field[place] for field in axes)))
        told |= {f"{stem}{names.off}": 0.0, names.rate: 1.0 / period, **WHOLE_RANGE.get(loop.form, {})}
        motors = 0.5 * throttle[:, None] + 0.1 * np.outer(signals[2], [1.0, -1.0, 1.0, -1.0])
        more = {name: Series(time, np.clip(motors[:, number], 0.0, 1.0)) for number, name in enumerate(motor_names)}
        try:
            read_flight = read(loop, time, signals, told, more)
        except UserError:
            continue
        now, behind = loop_margins(read_flight)
        if not now.sound:
            continue
        advice = changes(read_flight, now, behind)
        said = next((seen.sentence for seen in peak(read_flight, now, advice)), "")
        if not advice or f"{stem}{names.centre}" not in advice.others:
            yield Rung(str(kinds[place]), said, before)
            continue
        stops = [np.array([0.0, advice.others[f"{stem}{name}"][1]]) for name in (names.centre, names.band)]
        after = least(one.opened(OMEGA, mine, [stop[1:] for stop in stops])[0])[2]
        both, same = Axis(*(field[[0, 0]] for field in one)), Ring(*(field[[0, 0]] for field in mine))
        part = slice(0, NOISY_SAMPLES)
        with np.errstate(all="ignore"):
            again = flown(
                both, angle[part, None] * both.attitude, noise[place], 0.3, number + 1, 1, same, stops, throttle[part]
            )
        command = again[2] - again[2].mean(axis=0)
        above = 2.0 * math.pi * np.fft.rfftfreq(len(command), period) > read_flight.beyond
        first, second = np.linalg.norm(np.fft.rfft(command * np.hanning(len(command))[:, None], axis=0)[above], axis=0)
        yield Rung(str(kinds[place]), said, before, after, (advice.louder, float(second / first)))


def rings(random: np.random.Generator, axes: Axis, kinds: np.ndarray) -> Ring:
    """Tones that make commands noisy: a frame's, shaken by its rotors' torques too, or a rotor's."""
    count, frame = len(kinds), kinds == "resonance"
    at = np.exp(random.uniform(math.log(50.0), math.log(200.0), count))
    damping = np.exp(random.uniform(math.log(0.004), math.log(0.03), count))
    level = np.exp(random.uniform(math.log(0.02), math.log(0.3), count)) * (1.0 + (at / axes.cut) ** 2) / axes.p
    push = np.where(kinds == "noise", 0.0, level * np.sqrt(8.0 * math.pi * damping * at / axes.period))
    by_torque = np.where(frame, np.exp(random.uniform(math.log(1e-3), math.log(0.1), count)), 0.0)
    return Ring(at, damping, by_torque, push, np.where(frame, 0.0, random.uniform(0.5, 1.0, count)))


def notching(seed: int) -> Iterable[Attempt]:
    random = np.random.default_rng(seed)
    while True:
        for one in ringing(random, 10, PX4[0] if random.random() < 0.5 else ARDUPILOT[0]):
            if one.louder:
                right = one.kind == "resonance" and one.after > min(one.before, CLOSE) and one.louder[1] < 1.0
                case = (
                    f"{one.kind}, {one.before:.3g} of a sound loop's margins, {one.after:.3g} with a notch, noise {one.louder}"
                )
                yield Attempt(0.0 if right else 2.0, case)


def mixing(seed: int) -> Iterable[Attempt]:
    random = np.random.default_rng(seed)
    while True:
        yield mixed(random)


SEARCHES = [
    Search("what takes motors to a limit", "the axis that is named first took them there", mixing),
    Search("notches that advise names", "a resonance alone gets one, which keeps the loop sound and is quieter", notching),
]


def main() -> None:
    """Counts of so many logs."""
    wanted, random = int(sys.argv[1]) if len(sys.argv) > 1 else 300, np.random.default_rng(20261127)
    worst = max((mixed(random) for _ in range(wanted)), key=lambda one: one.reached)
    tones = [toned(random) for _ in range(wanted)]
    false = sum(shows and not told for told, shows, _ in tones)
    found = [off for told, shows, off in tones if told and shows]
    winds = [one for one in (stirred(random) for _ in range(wanted)) if one]
    held = sum(low <= ratio <= high for ratio, low, high in winds)
    blamed = [low > 1.0 for ratio, low, _ in winds if ratio == 1.0]
    lines = [
        f"{wanted} logs with motors at a limit: worst {worst.reached:.2f} of what is allowed: {worst.case}",
        f"{false} of {sum(not told for told, *_ in tones)} gyros without a tone have a peak of {STANDS:g} dB; of "
        f"{sum(told for told, *_ in tones)} with one {len(found)}, off by at most {100.0 * max(map(abs, found)):.2g} %",
        *(notch_counts(random, wanted, loop) for loop in (PX4[0], ARDUPILOT[0])),
        f"{held} of {len(winds)} intervals hold how much descents stir; {sum(blamed)} of {len(blamed)} are blamed for nothing",
    ]
    sys.stdout.write("\n".join([*lines, ""]))


def notch_counts(random: np.random.Generator, wanted: int, loop: RateLoop) -> str:
    """Of sound vehicles of an autopilot: which got a notch, and what it brought."""
    rung = [one for _ in range(wanted // 20) for one in ringing(random, 16 if loop.form == "px4" else 48, loop)]
    advised = [one for one in rung if one.louder]
    off = [one.louder[1] / one.louder[0] for one in advised]
    counts = {
        kind: (sum(o.kind == kind for o in advised), sum(o.kind == kind for o in rung)) for kind in {o.kind for o in rung}
    }
    why = Counter(re.sub(r"[\d.]+", "#", one.sentence.rpartition("advised: ")[2])[:60] for one in rung if not one.louder)
    before, after = (min((found[place] for found in advised), default=math.nan) for place in (2, 3))
    return (
        f"sound loops of {loop.form} with a notch: {counts}; margins {after:.3g} or more (of those flown with {before:.3g} or "
        f"more); noise flown "
        f"{[round(o.louder[1], 2) for o in advised]}, over that expected {[round(one, 2) for one in off]}; none: {why}"
    )


if __name__ == "__main__":
    main()
