"""Which parameters would make a measured loop sound, or a sound one faster or quieter: gains first, then the cut-off of a
low-pass, or a notch.

The open loop times the ratio of the controllers, as the parameters make them, is the loop with other parameters.
"""

import math
from collections.abc import Iterable, Iterator, Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from quadstep.identify.excited import Excited
from quadstep.identify.measured import MeasuredLoop, measured
from quadstep.identify.peaks import STANDS, Peak, free_notch, highest, unfit
from quadstep.identify.plant import IdentifiedPlant
from quadstep.identify.rate_loops import Filter, RateLoop
from quadstep.identify.response import Complex, Response, gain_margins
from quadstep.io.errors import UserError
from quadstep.metrics.registry import LEAST_GAIN

FINE = 2.0 ** (1.0 / 28.0)
FACTORS = FINE ** np.arange(112.0, -57.0, -1.0)
"""Factors on the gains that are tried, the largest first, and from one to the next."""

APART = 0.999 * 10.0 ** (LEAST_GAIN / 20.0)
"""No factor nearer to one with which the loop is unstable leaves a sound loop's gain margin."""

WORTH = 1.1
"""Least factor by which the gains of a sound loop are raised."""

UNHEARD = 0.5
"""Largest gain of a loop at the fastest excited frequency with larger gains, 6 dB below 1: what decides its margins was
excited, as nothing but a resonance grows beyond.
"""

STEP, STEPS = 1.1, 15
"""Factor from one value of a parameter that is tried to the next, and how many are."""

NEARER = 0.7
"""Least distance of the open loop from -1 on the way to another value, as a share of the flown one's: the loop is stable as
flown, and stays so where it comes no nearer.
"""

NOISY = 0.05
"""RMS of a command above the excited frequencies, as a share of the whole command, from which on it is too noisy: of Gaussian
noise one sample in 400 then takes 15 % of what the motors have for an axis. quadstep's own choice: autopilots name none.
"""

MOST = 3
"""Changes at most: P, I and D times one factor are one."""


class Advice(NamedTuple):
    """A factor on the gains of a command, other parameters, now and then, by name (of filters [Hz] and of the attitude loop
    [1/s]; the I gain before the factor), and what the response says of the loop with them. louder: factor on the noise of the
    command, at most where a cut-off rises. held: whether gains rise no further since noise could hide a resonance.
    """

    factor: float
    expected: MeasuredLoop
    others: Mapping[str, tuple[float, float]] = MappingProxyType({})
    louder: float = 1.0
    held: bool = False


def advised(response: Response, whole: Iterable[float] = (), most: float = 1.0, least: float = 0.0) -> Advice | None:
    """The largest factor from `least` to `most` with which the loop would be sound at the lower ends of its intervals; None
    where none is known to make it so. The loop is stable as flown, and with other gains up to where its phase crosses -180
    degrees. whole: gains that are rounded to whole numbers, which leaves the loop sound too.
    """
    turns = [one.value for one in gain_margins(response)]
    floor = max((one.high for one in turns if one.low < 1.0), default=0.0)
    ceiling = min((max(one.low, 1.0) for one in turns if one.value > 1.0), default=math.inf)
    if math.isinf(ceiling) or not (floor or response.rising):
        return None  # a gain margin is unknown, whatever the factor
    low, high = max(floor * APART, least), min(ceiling / APART, most)
    tried = FACTORS[(floor < FACTORS) & (low <= FACTORS) & (high >= FACTORS)]
    expected = ((float(factor), measured(response.scaled(float(factor)))) for factor in tried)
    sound = (one for one in expected if one[1].sound)
    return next(
        (Advice(*one) for one in sound if all(measured(response.scaled(by)).sound for by in factor_range(one[0], whole))), None
    )


def factor_range(factor: float, whole: Iterable[float]) -> list[float]:
    """The least and the largest factor that gains get which are rounded."""
    found = [round(factor * one) / one for one in whole if one > 0.0]
    return [min(found), max(found)] if found else []


def changes(flight: Excited, now: MeasuredLoop, behind: IdentifiedPlant | None) -> Advice | None:
    """What the log advises, and what becomes with it of what noise may hide."""
    if (advice := chosen(flight, now, behind)) and behind:
        hidden = behind.hidden.scaled(factors(flight, advice, behind.hidden.omega))
        advice = advice._replace(expected=advice.expected._replace(hidden=hidden))
    return advice


def chosen(flight: Excited, now: MeasuredLoop, behind: IdentifiedPlant | None) -> Advice | None:
    """What the log advises: gains as large as a sound loop bears, where the plant is told, or those that make a fragile loop
    sound, or a higher cut-off where these do not, or a slower attitude loop; a lower cut-off, or a notch, for a sound loop
    whose command is too noisy.
    """
    gains = (flight.loop and flight.loop.whole_gains and flight.loop.gains(flight.parameters)) or {}
    if flight.loop is None:
        return advised(flight.measured) if now.lacking else None
    if (advice := tuned(flight, flight.loop, now, behind, [{}])) and within_limits(flight, advice, behind):
        return advice
    if now.lacking and (advice := advised(flight.measured, gains.values(), least=factor_limits(flight, flight.loop)[0])):
        return advice
    tried = raised(flight, flight.loop, behind) if now.lacking else lowered(flight, flight.loop) if now.sound else ()
    if advice := next((one for one in tried if within_limits(flight, one, behind)), None):
        return advice
    slower = {flight.loop.attitude: 1.0 / STEP} if flight.levelled else {}
    for steps in (slower, {**slower, flight.loop.integral: STEP**-2}):
        if (advice := tuned(flight, flight.loop, now, behind, stepped(flight, steps))) and within_limits(
            flight, advice, behind
        ):
            return advice
    return None


def tuned(
    flight: Excited, loop: RateLoop, now: MeasuredLoop, behind: IdentifiedPlant | None, tried: Iterable[dict[str, float]]
) -> Advice | None:
    """With the first of other parameters that allow it, the largest gains with which the loop by its plant is sound, where it
    is not known to be so, or where they are worth a change and it is not slower otherwise.
    """
    if behind is None or not behind.explains:
        return None
    by_plant = measured(behind.loop)
    poor = now.lacking or by_plant.lacking or not (now.sound or by_plant.sound)
    for other, response in changed_responses(flight, loop, tried, behind.loop):
        end = float(np.interp(flight.measured.omega[-1], response.omega, np.abs(response.opened)))
        least, largest = factor_limits(flight, loop, other)
        room = behind.hidden.room(ratio(flight, loop, other, behind.hidden.omega))
        most = min(max(min(UNHEARD / end, NOISY / loud(flight), largest), 1.0), room)
        if advice := advised(response, (), most, least):
            expected = advice.expected._replace(by_plant=True)
            worth = poor or (advice.factor >= WORTH and not other)
            held = 1.0 < room < advice.factor * FINE
            others = parameter_changes(flight, other)
            return Advice(advice.factor, expected, others, advice.factor, held) if worth else None
    return None


def raised(flight: Excited, loop: RateLoop, behind: IdentifiedPlant | None) -> Iterator[Advice]:
    """Sound loops with a higher cut-off, the least step first, and smaller gains if it needs them too, or if it would take
    what noise may hide further than `HiddenResonance.room`.
    """
    higher = (stepped(flight, {one.name: STEP}) for one in logged_low_passes(flight, loop))
    kept = [list(changed_responses(flight, loop, tried, flight.measured)) for tried in higher]
    least = factor_limits(flight, loop)[0]
    for place in range(STEPS):
        for found in kept:
            if place < len(found):
                other, response = found[place]
                room = behind.hidden.room(ratio(flight, loop, other, behind.hidden.omega)) if behind else math.inf
                then = measured(response)
                enough = then.sound and room >= 1.0
                advice = Advice(1.0, then) if enough else advised(response, (), min(room, 1.0), least)
                louder = growth(flight, loop, other)
                if advice and louder * loud(flight) <= NOISY:
                    yield advice._replace(others=parameter_changes(flight, other), louder=louder)


def lowered(flight: Excited, loop: RateLoop) -> Iterator[Advice]:
    """Sound loops with a notch that makes the command quiet enough, since it costs less phase than a lower cut-off, then with
    a notch or a lower cut-off; those with the least noise first.
    """
    if loud(flight) <= NOISY:
        return
    stopped = quietest(flight, loop, notches(flight, loop))
    lower = (stepped(flight, {one.name: 1.0 / STEP}) for one in logged_low_passes(flight, loop))
    cut = [one for tried in lower for one in quietest(flight, loop, tried)]
    yield from (one for one in stopped if one.louder * loud(flight) <= NOISY)
    yield from sorted([*stopped, *cut], key=lambda one: one.louder)


def quietest(flight: Excited, loop: RateLoop, tried: Iterable[dict[str, float]]) -> list[Advice]:
    """Sound loops with a tenth less noise in the command or more, that with the least first, up to the first unsound one."""
    found = []
    for other, response in changed_responses(flight, loop, tried, flight.measured):
        then = measured(response)
        if not then.sound:
            break
        found.append(Advice(1.0, then, parameter_changes(flight, other), quieter(flight, other)))
    return sorted((one for one in found if one.louder < 1.0 / STEP), key=lambda one: one.louder)


def notches(flight: Excited, loop: RateLoop) -> list[dict[str, float]]:
    """Against the gyro's peak, from its bandwidth on wider and wider; none where it is not significant, or none would fit."""
    peak, stem = highest(flight), free_notch(loop, flight.parameters)
    names = loop.notches
    if not stem or not peak or peak.tall <= STANDS or not logged_low_passes(flight, loop) or unfit(flight, peak):
        return []
    widths = [float(f"{peak.width * STEP**place:.3g}") for place in range(STEPS + 1)]
    on = {f"{stem}{ending}": value for ending, value in names.on.items()}
    rows = [{f"{stem}{names.centre}": float(f"{peak.middle:.3g}"), f"{stem}{names.band}": one} for one in widths]
    ends = {name: loop.documented(name) for name in rows[0]}
    return [{**on, **row} for row in rows if all(ends[name][0] <= one <= ends[name][1] for name, one in row.items())]


def why_no_notch(flight: Excited, peak: Peak, now: MeasuredLoop, advice: Advice | None) -> str:
    """Why no notch is advised against a significant peak; empty where one is."""
    if why := unfit(flight, peak):
        return why
    if not now.sound:
        return "it costs phase, and the loop is not known to be sound without it"
    if (share := loud(flight)) <= NOISY:
        return f"it costs phase, and noise makes {100.0 * share:.2g} % of the whole command, less than {100.0 * NOISY:g} %"
    if advice is None:
        return "none is known to leave all three axes sound and the command a tenth quieter"
    named = free_notch(flight.loop, flight.parameters) if flight.loop else None
    return "" if any(one.startswith(f"{named}") for one in advice.others) else "a lower cut-off makes the command quieter"


def logged_low_passes(flight: Excited, loop: RateLoop) -> list[Filter]:
    """Low-passes that the log says to be on; none where it does not say what else makes the command."""
    try:
        loop.controller(flight.parameters, np.ones(1, dtype=np.complex128), flight.levelled)
    except UserError:
        return []
    return [one for one in loop.filters if flight.parameters.get(one.name, 0.0) > 0.0]


def stepped(flight: Excited, steps: Mapping[str, float]) -> list[dict[str, float]]:
    """Values of parameters further and further away, by a factor each, up to where a documented range ends; none of 0."""
    assert flight.loop
    now = {name: flight.parameters[name] for name in steps if flight.parameters.get(name, 0.0) > 0.0}
    ends = {name: parameter_limits(flight.loop, name, value) for name, value in now.items()}
    rows = [
        {name: float(np.clip(float(f"{value * steps[name] ** place:.3g}"), *ends[name])) for name, value in now.items()}
        for place in range(1, STEPS + 1)
    ]
    return [row for row in rows if row != now]


def parameter_limits(loop: RateLoop, name: str, now: float) -> tuple[float, float]:
    """Where a parameter may go: within its documented range, or not further out of it than it is."""
    low, high = loop.documented(name)
    return min(low, now), max(high, now)


def factor_limits(flight: Excited, loop: RateLoop, other: Mapping[str, float] = MappingProxyType({})) -> tuple[float, float]:
    """The least and the largest factor on the gains with which all stay where they may go."""
    gains = {name: one for name, one in (loop.gains({**flight.parameters, **other}) or {}).items() if one > 0.0}
    ends = [[end / one for end in parameter_limits(loop, name, flight.parameters[name])] for name, one in gains.items()]
    return max((low for low, _ in ends), default=0.0), min((high for _, high in ends), default=math.inf)


def changed_parameters(flight: Excited, advice: Advice) -> dict[str, tuple[float, float]]:
    """All parameters to change, now and then; without gains that the log does not name, or a feed-forward bypasses."""
    loop, gains = flight.loop, dict[str, float]()
    if loop and advice.factor != 1.0 and not loop.bypassed(flight.parameters):
        other = {name: value for name, (_, value) in advice.others.items()}
        gains = {name: value for name, value in (loop.gains({**flight.parameters, **other}) or {}).items() if value}
    then = {name: advice.factor * value for name, value in gains.items()}
    rounded = loop is not None and loop.whole_gains
    scaled = {name: (flight.parameters[name], float(round(one)) if rounded else one) for name, one in then.items()}
    return {**advice.others, **scaled}


def parameter_changes(flight: Excited, other: Mapping[str, float]) -> dict[str, tuple[float, float]]:
    """Parameters as they were in the log, and as they would be."""
    before = dict(flight.parameters)
    if flight.loop:  # what a log does not tell of a notch that is on
        notch = flight.loop.notches
        before = {f"{stem}{ending}": one for stem in notch.stems for ending, one in notch.usual.items()} | before
    return {name: (before[name], value) for name, value in other.items() if flight.parameters.get(name) != value}


def changed_responses(
    flight: Excited, loop: RateLoop, tried: Iterable[dict[str, float]], response: Response
) -> Iterator[tuple[dict[str, float], Response]]:
    """A response with other parameters, as long as it comes no nearer to -1."""
    start = np.abs(1.0 / response.sensitivity).min()
    for other in tried:
        then = response.scaled(ratio(flight, loop, other, response.omega))
        if np.abs(1.0 / then.sensitivity).min() < NEARER * start:
            return
        yield other, then


def ratio(flight: Excited, loop: RateLoop, other: dict[str, float], omega: Iterable[float]) -> Complex:
    """Of the controller with other parameters to that of the log, at frequencies [rad/s]."""
    s: Complex = 1j * np.asarray(omega, dtype=np.complex128)
    before, after = (loop.controller(one, s, flight.levelled) for one in (flight.parameters, {**flight.parameters, **other}))
    return after / before


def factors(flight: Excited, advice: Advice, omega: Iterable[float]) -> Complex | float:
    """What is advised of the open loop, as a factor on it, at frequencies [rad/s]: one for all, or of each."""
    other = {name: then for name, (_, then) in advice.others.items()}
    return advice.factor * (ratio(flight, flight.loop, other, omega) if flight.loop and other else 1.0)


def loud(flight: Excited) -> float:
    """RMS of the command above the excited frequencies, as a share of the whole command."""
    return flight.noise * float(np.std(flight.command)) / (flight.loop.whole if flight.loop else math.inf)


def growth(flight: Excited, loop: RateLoop, other: dict[str, float]) -> float:
    """The most by which noise above the excited frequencies may grow: what is faster than half the log's rate counts too."""
    omega = np.geomspace(flight.measured.omega[-1], 1e5, 400)
    return float(np.abs(ratio(flight, loop, other, omega)).max())


def quieter(flight: Excited, other: dict[str, float]) -> float:
    """The factor on the RMS of the command above the excited frequencies, by its spectrum in the log."""
    assert flight.loop
    omega, power = flight.above
    after = power * np.abs(ratio(flight, flight.loop, other, omega)) ** 2
    return float(np.sqrt(after.sum() / power.sum()))


def within_limits(flight: Excited, advice: Advice, behind: IdentifiedPlant | None) -> bool:
    """Whether there are no more than three changes besides switches of a notch, none of which scales only part of the command,
    none lets a resonance that noise may hide grow too far, and each other axis whose command passes the same low-pass is
    measured and sound with it too.
    """
    assert flight.loop
    if behind and behind.hidden.room(factors(flight, advice, behind.hidden.omega)) < 1.0 - 1e-9:
        return False
    scaled = advice.factor != 1.0
    switches = [one for one in advice.others if flight.loop.notches.switches(one)]
    if len(advice.others) - len(switches) + scaled > MOST or (
        scaled and (flight.loop.gains(flight.parameters) is None or flight.loop.bypassed(flight.parameters))
    ):
        return False
    own = {flight.loop.attitude, flight.loop.integral, *(one.name for one in flight.loop.filters if not one.shared)}
    return not {*advice.others} - own or (len(flight.others) == 2 and all(tolerates(one, advice) for one in flight.others))


def tolerates(other: Excited, advice: Advice) -> bool:
    """Whether another axis is sound with the same cut-offs."""
    assert other.loop
    shared = {name: then for name, (_, then) in advice.others.items()}
    return measured(other.measured.scaled(ratio(other, other.loop, shared, other.measured.omega))).sound


def lags(flight: Excited, at: float) -> dict[str, float]:
    """Phase [rad] that each low-pass takes from the open loop at a frequency [rad/s], by name; below 0 where it adds some."""
    loop = flight.loop
    if loop is None:
        return {}
    return {
        one.name: float(np.angle(ratio(flight, loop, {one.name: 0.0}, [at])[0])) for one in logged_low_passes(flight, loop)
    }
