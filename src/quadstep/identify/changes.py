"""Which parameters would make a measured loop sound, or a sound one quieter: gains first, then the cut-off of a low-pass.

The measured open loop times the ratio of the controllers, as the parameters make them, is the loop with other parameters.
"""

import math
from collections.abc import Iterable, Iterator, Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from quadstep.identify.excited import Excited
from quadstep.identify.measured import Measured, measured
from quadstep.identify.rate_loops import Filter, RateLoop
from quadstep.identify.response import Complex, Response, gain_margins
from quadstep.io.errors import UserError

FACTORS = np.geomspace(1.0, 0.25, 57)
"""Factors on the gains that are tried, the largest first."""

STEP, STEPS = 1.1, 15
"""Factor from one cut-off that is tried to the next, and how many are."""

NEARER = 0.7
"""Least distance of the open loop from -1 on the way to another cut-off, as a share of the flown one's: the loop is stable as
flown, and stays so where it comes no nearer.
"""

NOISY = 0.05
"""RMS of a command above the excited frequencies, as a share of the whole command, from which on it is too noisy: of Gaussian
noise one sample in 400 then takes 15 % of what the motors have for an axis. quadstep's own choice: autopilots name none.
"""

MOST = 3
"""Parameters that may change."""


class Advice(NamedTuple):
    """A factor on the gains of a command, cut-offs [Hz], now and then, by name, and what the measured response says of the
    loop with them. louder: factor on the noise of the command, at most where a cut-off rises.
    """

    factor: float
    expected: Measured
    filters: Mapping[str, tuple[float, float]] = MappingProxyType({})
    louder: float = 1.0


def advised(found: Response, now: Measured, whole: Iterable[float] = ()) -> Advice | None:
    """The largest factor with which the loop would be sound at the lower ends of its intervals; None where the loop may be
    sound as it is, or where no factor is known to make it so. The loop is stable as flown, and with smaller gains until the
    gain has fallen to where its phase crosses -180 degrees. whole: gains that are rounded to whole numbers, which leaves the
    loop sound too.
    """
    floor = max((one.value.high for one in gain_margins(found) if one.value.low < 1.0), default=0.0)
    tried = FACTORS[floor < FACTORS] if now.fragile else ()
    expected = ((float(factor), measured(found.scaled(float(factor)))) for factor in tried)
    sound = (one for one in expected if one[1].sound)
    return next((Advice(*one) for one in sound if all(measured(found.scaled(by)).sound for by in ends(one[0], whole))), None)


def ends(factor: float, whole: Iterable[float]) -> list[float]:
    """The least and the largest factor that gains get which are rounded."""
    found = [round(factor * one) / one for one in whole if one > 0.0]
    return [min(found), max(found)] if found else []


def changes(flight: Excited, now: Measured) -> Advice | None:
    """What the log advises: gains that make a fragile loop sound, or a higher cut-off where these do not; a lower one for a
    sound loop whose command is too noisy.
    """
    gains = (flight.loop and flight.loop.whole_gains and flight.loop.gains(flight.parameters)) or {}
    if advice := advised(flight.measured, now, gains.values()):
        return advice
    if flight.loop is None or not (now.fragile or (now.sound and loud(flight) > NOISY)):
        return None
    tried = raised(flight, flight.loop) if now.fragile else lowered(flight, flight.loop)
    return next((one for one in tried if told(flight, one)), None)


def raised(flight: Excited, loop: RateLoop) -> Iterator[Advice]:
    """Sound loops with a higher cut-off, the least step first, and smaller gains if it needs them too."""
    kept = {one: list(ways(flight, loop, one, STEP)) for one in known(flight, loop)}
    for place in range(STEPS):
        for one, found in kept.items():
            if place < len(found):
                cut, response = found[place]
                then = measured(response)
                advice = Advice(1.0, then) if then.sound else advised(response, then)
                louder = growth(flight, loop, {one.name: cut})
                if advice and louder * loud(flight) <= NOISY:
                    yield advice._replace(filters={one.name: (flight.parameters[one.name], cut)}, louder=louder)


def lowered(flight: Excited, loop: RateLoop) -> Iterator[Advice]:
    """Sound loops with a lower cut-off, that with the least noise first."""
    found = []
    for one in known(flight, loop):
        for cut, response in ways(flight, loop, one, 1.0 / STEP):
            then = measured(response)
            if not then.sound:
                break
            found.append(Advice(1.0, then, {one.name: (flight.parameters[one.name], cut)}, quieter(flight, {one.name: cut})))
    yield from sorted((one for one in found if one.louder < 1.0 / STEP), key=lambda one: one.louder)


def known(flight: Excited, loop: RateLoop) -> list[Filter]:
    """Low-passes that the log says to be on; none where it does not say what else makes the command."""
    try:
        loop.controller(flight.parameters, np.ones(1, dtype=np.complex128), flight.levelled)
    except UserError:
        return []
    return [one for one in loop.filters if flight.parameters.get(one.name, 0.0) > 0.0]


def ways(flight: Excited, loop: RateLoop, one: Filter, step: float) -> Iterator[tuple[float, Response]]:
    """The measured loop with other cut-offs [Hz], further and further away, as long as it comes no nearer to -1."""
    start = np.abs(1.0 / flight.measured.sensitivity).min()
    for place in range(1, STEPS + 1):
        cut = float(f"{flight.parameters[one.name] * step**place:.3g}")
        found = flight.measured.scaled(ratio(flight, loop, {one.name: cut}, flight.measured.omega))
        if np.abs(1.0 / found.sensitivity).min() < NEARER * start:
            return
        yield cut, found


def ratio(flight: Excited, loop: RateLoop, other: dict[str, float], omega: Iterable[float]) -> Complex:
    """Of the controller with other parameters to that of the log, at frequencies [rad/s]."""
    s: Complex = 1j * np.asarray(omega, dtype=np.complex128)
    before, after = (loop.controller(one, s, flight.levelled) for one in (flight.parameters, {**flight.parameters, **other}))
    return after / before


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


def told(flight: Excited, advice: Advice) -> bool:
    """Whether no more than three parameters change, none of which scales only part of the command, and each other axis whose
    command passes the same low-pass is measured and sound with it too.
    """
    assert flight.loop
    gains = flight.loop.gains(flight.parameters) if advice.factor != 1.0 else {}
    if gains is None or len(gains) + len(advice.filters) > MOST or (gains and flight.loop.bypassed(flight.parameters)):
        return False
    shared = {one.name for one in flight.loop.filters if one.shared} & {*advice.filters}
    return not shared or (len(flight.others) == 2 and all(bears(one, advice) for one in flight.others))


def bears(other: Excited, advice: Advice) -> bool:
    """Whether another axis is sound with the same cut-offs."""
    assert other.loop
    filters = {name: cut for name, (_, cut) in advice.filters.items()}
    return measured(other.measured.scaled(ratio(other, other.loop, filters, other.measured.omega))).sound


def lags(flight: Excited, at: float) -> dict[str, float]:
    """Phase [rad] that each low-pass takes from the open loop at a frequency [rad/s], by name; below 0 where it adds some."""
    loop = flight.loop
    if loop is None:
        return {}
    return {one.name: float(np.angle(ratio(flight, loop, {one.name: 0.0}, [at])[0])) for one in known(flight, loop)}
