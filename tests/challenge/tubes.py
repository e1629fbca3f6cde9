"""Tubes and sets of random nonsmooth laws and plants, attacked by flights from corners of their starts and by ascent.

The laws remember the first measurement, in an observer, in a delay line and for ever; the plant has a random drag. A flight is
led to a bound by the signs of differences of the flight itself, again and again.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from quadstep import Mission
from quadstep.control.planar import PlanarPd
from quadstep.io.errors import UserError
from quadstep.numbers import Number, Vector, atan2, vector
from quadstep.numbers.enclosure import UndefinedError
from quadstep.proofs.prove.hold import Hold, everywhere
from quadstep.proofs.prove.invariant import SetArithmetic, largest
from quadstep.proofs.prove.linear_maps import coordinates, modes
from quadstep.proofs.prove.rest import rest
from quadstep.proofs.prove.sampled import SampledLoop
from quadstep.proofs.prove.tube import SAMPLES, Tube, tube
from quadstep.proofs.prove.unknown import Unknown
from quadstep.vehicle.planar import Planar, PlanarCommand, plane
from tests.challenge.search import Attempt, Search
from tests.random_programs import BENT, JUMPS, SMOOTH, Program, program
from tests.started import begun, flown

RISES = 3
"""Steps of an ascent."""


class Memory(NamedTuple):
    observed: Vector
    late: tuple[Vector, ...]
    first: Vector


@dataclass(frozen=True)
class RandomLaw(PlanarPd):
    """PD, and a share of random programs of what is measured, observed and remembered."""

    programs: tuple[Program, ...] = ()
    share: float = 0.0
    delay: int = 0
    keeps: float = 0.0

    def start(self, measured, gains):
        return Memory(measured.position, (measured.position,) * self.delay, self.keeps * measured.velocity)

    def law(self, memory, measured, reference, gains, t, period):
        wanted, late = plane(reference.position), (*memory.late, measured.position)
        seen = late[0] - wanted
        observed = memory.observed + period * (measured.position - memory.observed)
        inputs = [*seen, *(observed - wanted), *measured.velocity, measured.pitch, *memory.first]
        push = self.share * Vector([one(inputs) for one in self.programs])
        pull = plane(reference.acceleration) - gains.k_p * seen - gains.k_v * (measured.velocity - plane(reference.velocity))
        pull = pull + push + vector(0.0, gains.gravity)
        pitch = atan2(-pull[0], pull[1])
        turn = gains.k_theta * (pitch - measured.pitch) - gains.k_q * measured.rate
        return PlanarCommand(gains.mass * pull.norm(), gains.inertia[1] * turn, pitch), Memory(
            observed, late[1:], memory.first
        )


@dataclass(frozen=True)
class RandomPlanar(Planar):
    """With a random drag."""

    drag: Program = sum

    def rate(self, p, state, held, wind, time):
        found = super().rate(p, state, held, wind, time)
        lost: Number = 0.2 * self.drag([*state.velocity, state.pitch])
        return found._replace(velocity=found.velocity - lost * state.velocity)


def random_loop(random: np.random.Generator, still: bool) -> tuple[SampledLoop, str]:
    """still: a path at rest, and programs that are smooth."""
    end = [0.0, 0.0, 5.0] if still else [0.2, 0.0, 5.1]
    path = {"type": "step" if still else "minimum-jerk", "start": [0.0, 0.0, 5.0], "end": end, "duration": 4.0}
    clock = {"duration": 0.02 * int(random.integers(2, 6)), "guidance_period": 0.002}
    plan = Mission.model_validate({"vehicle": {"type": "planar"}, "path": path, "simulation": clock}).plan()
    kinds = (SMOOTH,) if still else (SMOOTH, BENT, *([JUMPS] if random.random() < 0.2 else []))
    made = [program(random, 9, int(random.integers(1, 5)), *kinds) for _ in range(2)]
    drag, said = program(random, 3, int(random.integers(1, 4)), *kinds)
    share, delay = float(random.choice([0.1, 1.0, 5.0])), int(random.integers(0, 3))
    law = RandomLaw(programs=tuple(one for one, _ in made), share=share, delay=delay, keeps=0.0 if still else 0.5)
    loop = replace(plan.loop, controller=law, plant=RandomPlanar(drag=drag))
    text = " | ".join(one for _, one in made)
    return SampledLoop(plan._replace(loop=loop)), f"share {share}, delay {delay}, programs {text}, drag {said}"


def random_unknown(random: np.random.Generator, most: float) -> Unknown:
    size = [float(most * random.random() * (random.random() < 0.7)) for _ in range(4)]
    return Unknown(start=size[0] + 1e-6, start_velocity=size[1], start_attitude=size[2], start_rates=size[3])


def shares_of(
    loop: SampledLoop, unknown: Unknown, shares: np.ndarray, centre: np.ndarray, bounds: np.ndarray, into: np.ndarray
) -> np.ndarray:
    """The deviation of a flight as shares of its bounds, (samples, bounds). centre: (samples + 1, states)."""
    off = (flown(loop, begun(loop, unknown, shares), len(centre) - 1) - centre) @ into.T
    return off[1:] / bounds


def ascended(random: np.random.Generator, reached, shape=(4, 3)) -> tuple[float, np.ndarray]:
    """The largest |share| that flights reach, from corners, each led on to a sample and a bound of its own."""
    best, most = random.choice([-1.0, 1.0], shape), 0.0
    for _ in range(2):
        way = random.choice([-1.0, 1.0], shape)
        for _ in range(RISES):
            now = reached(way)
            if np.abs(now).max() > most:
                most, best = float(np.abs(now).max()), way
            sample, bound = np.unravel_index(np.argmax(np.abs(now)), now.shape)
            slopes = np.zeros(shape)
            for place in np.ndindex(shape):
                other = way.copy()
                other[place] *= 0.5
                slopes[place] = (now - reached(other))[sample, bound] * np.sign(way[place])
            led = np.where(slopes == 0.0, way, np.sign(slopes) * np.sign(now[sample, bound]))
            if np.array_equal(led, way):
                break
            way = led
    return most, best


def tubes(seed: int) -> Iterable[Attempt]:
    random = np.random.default_rng(seed)
    while True:
        loop, text = random_loop(random, still=False)
        try:
            with np.errstate(all="ignore"):
                unknown = random_unknown(random, float(10.0 ** random.uniform(-5.0, -1.5)))
                centre = flown(loop, loop.at_rest(loop.like), loop.samples)
                chosen = coordinates(loop, centre, unknown)
                found = tube(loop, centre, unknown, chosen, 2)
        except (UserError, UndefinedError):
            continue
        if not isinstance(found, Tube):
            continue
        boxes = np.repeat(found.boxes, SAMPLES, axis=0)[: loop.samples]
        bounds, into = np.hstack([boxes, found.position[1:]]), np.vstack([chosen.into, np.eye(2, len(chosen.into))])

        def reached(shares, loop=loop, unknown=unknown, centre=centre, bounds=bounds, into=into):
            return shares_of(loop, unknown, shares, centre, bounds, into)

        most, way = ascended(random, reached)
        yield Attempt(most, f"{unknown}, from {way.tolist()}, {text}")


def in_set(loop: SampledLoop, found: Hold, rows: np.ndarray) -> np.ndarray:
    """|z| of states as shares of the set's radii, (states, modes)."""
    live = list(found.at.live)
    z = (rows - found.at.state)[:, live] @ np.linalg.inv(found.modes.spread).T
    size, radii = np.abs(z), found.found.radii.copy()
    for i in found.modes.pairs:
        size[:, i] = size[:, i + 1] = np.hypot(z[:, i], z[:, i + 1])
        radii[i : i + 2] = radii[i : i + 2].max()
    return size / radii


def edge(random: np.random.Generator, loop: SampledLoop, found: Hold) -> Iterator[float]:
    """How far states on the set's edge are out a sample later, as shares of its radii, by ascent."""
    count, radii = len(found.found.radii), found.found.radii
    later = float(loop.span * int(random.integers(1, 100)))

    def share(phases: np.ndarray) -> np.ndarray:
        z = radii * np.sign(np.sin(phases))
        for i in found.modes.pairs:
            z[i : i + 2] = radii[i : i + 2].min() * np.array([np.cos(phases[i]), np.sin(phases[i])])
        x = found.at.state.copy()
        x[list(found.at.live)] += found.modes.spread @ z
        for place, other in found.at.twins.items():
            x[place] = x[other]
        return in_set(loop, found, np.array([loop.step([float(one) for one in x], later)], dtype=float))[0]

    best = max((random.uniform(-np.pi, np.pi, count) for _ in range(15)), key=lambda one: share(one).max())
    goal, size = int(np.argmax(share(best))), 0.5
    for _ in range(30):
        other = best + size * random.normal(size=count)
        if share(other)[goal] > share(best)[goal]:
            best = other
        else:
            size *= 0.97
    yield float(share(best).max())


def sets(seed: int) -> Iterable[Attempt]:
    random = np.random.default_rng(seed)
    while True:
        loop, text = random_loop(random, still=True)
        try:
            with np.errstate(all="ignore"):
                unknown = random_unknown(random, 1e-5)
                at = rest(loop)
                chosen = modes(at.slopes)
                if not np.all(np.abs(chosen.values) < 1.0 - 1e-6):
                    continue
                arithmetic = SetArithmetic(loop, at, chosen, unknown, True)
                radii = largest(arithmetic)
        except (UserError, UndefinedError, np.linalg.LinAlgError):
            continue
        if isinstance(radii, str):
            continue
        found = Hold(at, chosen, radii, True, everywhere(at, arithmetic.reach @ radii.radii))
        case = f"{unknown}, {text}"
        for most in edge(random, loop, found):
            yield Attempt(most, f"the edge of the set of {case}")
        starts, way = unknown._replace(start=radii.start), random.choice([-1.0, 1.0], (4, 3))
        rows = flown(loop, begun(loop, starts, way), 100)[1:]
        yield Attempt(float(in_set(loop, found, rows).max()), f"a flight from {way.tolist()} of {case}")


SEARCHES = [
    Search("tubes", "every flight from a proved box of starts stays in its tube", tubes, bound=True),
    Search(
        "sets", "a flight in a set that hover never leaves stays in it, and flights from its starts get in", sets, bound=True
    ),
]
