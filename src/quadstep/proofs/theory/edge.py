"""The region of Theorem B for the defaults, and flights that start on its edge."""

from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import NamedTuple, cast

import numpy as np

from quadstep.control.backstepping import attitude_errors, position_loop
from quadstep.control.completed_backstepping import CompletedGains, counter_rate
from quadstep.engines.fly import FlightPlan, fly_all
from quadstep.interfaces.closed_loop import Outcome
from quadstep.interfaces.log import FlightLog
from quadstep.io.errors import UserError
from quadstep.mission.lagrange import LagrangeMission
from quadstep.numbers import Number, Vector
from quadstep.proofs.theory.region import E1, NORMS, R1, R2, Region, Setting, certify_region, root_above
from quadstep.report.units import listed
from quadstep.studies.paper.cases import case_1

DIRECTIONS: dict[str, dict[str, tuple[float, float, float]]] = {
    "position, x": {"position": (1.0, 0.0, 0.0)},
    "position, z": {"position": (0.0, 0.0, -1.0)},
    "position, all axes": {"position": (0.6, -0.6, 0.5)},
    "velocity, x": {"velocity": (1.0, 0.0, 0.0)},
    "velocity, z": {"velocity": (0.0, 0.0, -1.0)},
    "velocity, all axes": {"velocity": (-0.6, 0.6, 0.5)},
    "pitch": {"attitude": (0.0, 1.0, 0.0)},
    "roll": {"attitude": (0.0, 0.0, -1.0)},
    "yaw": {"attitude": (1.0, 0.0, 0.0)},
    "yaw rate": {"rates": (1.0, 0.0, 0.0)},
    "pitch rate": {"rates": (0.0, 8.0, 0.0)},
    "everything": {"position": (0.5, 0.4, 0.3), "velocity": (-0.4, 0.3, 0.3), "attitude": (0.1, 0.02, -0.02)},
}
"""Directions away from the start of the path [m, m/s, rad, rad/s]; each is scaled until L equals the region's level."""

DURATION = 20.0
"""Seconds flown of Case 1's 40."""


class Edge(NamedTuple):
    """A flight from the edge. off: start off the path, by section key. returned: largest |r1|, |e1|, |r2| over what the
    theorem allows at each instant, nets off. learning: the same with nets, which the theorem does not cover; None where it
    diverged.
    """

    name: str
    off: Mapping[str, tuple[float, float, float]]
    returned: tuple[float, float, float]
    learning: tuple[float, float, float] | None


class Pushes(NamedTuple):
    """Bounds of what acts beside the law: a force [N], a torque [N m], and a force that is constant [N]."""

    force: float = 0.0
    torque: float = 0.0
    bias: float = 0.0

    @property
    def words(self) -> str:
        """What acts, after a verb."""
        named = (("a force up to {:g} N", self.force), ("a torque up to {:g} N m", self.torque),
                 ("a constant force up to {:g} N", self.bias))  # fmt: skip
        return f"with {listed([text.format(most) for text, most in named if most])}" if any(self) else "with nothing unknown"


NOTHING = Pushes()


def mission(off: Mapping[str, tuple[float, float, float]], nets: bool, unknown: Pushes = NOTHING) -> LagrangeMission:
    """Case 1 without Eq. 67, flown by the completed law from a start off its path, pushed by as much as is unknown."""
    controller = {"type": "completed-backstepping", "nets": {"enabled": nets}}
    pushed = {"force": (unknown.force, 0.0, -unknown.bias), "torque": (0.0, 0.0, unknown.torque)}
    return case_1(
        disturbance={"scale": 0.0, **pushed}, controller=controller, start=dict(off), simulation={"duration": DURATION}
    )


def setting_of(plan: FlightPlan, unknown: Pushes = NOTHING) -> Setting:
    """The theorem's numbers for a plan. Raises UserError where gains or inertias differ between axes."""
    gains: CompletedGains = plan.parameters.gains
    paper, vehicle = gains.paper, plan.parameters.vehicle

    def one(values: Vector, name: str) -> Fraction:
        found = {Fraction(value) for value in values}
        if len(found) != 1:
            raise UserError(f"{name}: differs between axes; the region can be computed only where all axes agree")
        return found.pop()

    times = np.linspace(0.0, plan.ticks.last * plan.ticks.step, 2001)
    reference = plan.loop.path.reference(cast(Number, times), plan.parameters.path)
    most = [
        float(np.sqrt(sum(np.square(part) for part in vector)).max()) for vector in (reference.acceleration, reference.jerk)
    ]
    spare = Fraction(101, 100)  # between the instants looked at
    return Setting(
        Fraction(vehicle.mass), Fraction(vehicle.gravity), one(paper.slope_1, "Lambda1"), one(paper.gain_1, "K_r1"),
        one(paper.integral_1, "K_i1"), one(vehicle.inertia, "inertia"), one(paper.slope_2, "Lambda2"),
        one(paper.gain_2, "K_r2"), one(paper.integral_2, "K_i2"), one(gains.coupling, "P"), Fraction(paper.filter_frequency),
        spare * Fraction(most[0]), spare * Fraction(most[1]),
        spare * Fraction(float(np.max(np.abs(reference.yaw_rate + 0.0 * times)))),
        *map(Fraction, unknown),
    )  # fmt: skip


def level_at_start(plan: FlightPlan, region: Region, bias: float = 0.0) -> float:
    """L of a plan's start [J]: integrals, counter-rate and weights at zero, the filter at the measured attitude.

    bias: constant force that the first integral has to take over [N].
    """
    gains: CompletedGains = plan.parameters.gains
    state = plan.start
    memory = plan.loop.controller.start(state, gains)
    reference = plan.loop.path.reference(0.0, plan.parameters.path)
    outer = position_loop(gains.paper, memory.paper, state, reference, 0.0)
    filtered = memory.paper.filtered
    e2, r2 = attitude_errors(gains.paper, filtered, state, reference)
    e1 = reference.position - state.position
    b = filtered.rate * (1.0 / gains.paper.filter_frequency)
    a = outer.tilt - (filtered.value + b)
    tilt = Vector(state.attitude.entries[1:])
    counter = Vector(counter_rate(gains, outer.u_d, tilt, filtered.value, outer.r1).entries)
    weights = [float(number) for number in region.shape[2:]]
    squares: list[Number] = [e1 @ e1, a @ a, b @ b, counter @ counter]
    high = float(region.bounds.inertia[1])
    mass = plan.parameters.vehicle.mass
    rest = (
        bias * bias / gains.paper.integral_1[0] + mass * (outer.r1 @ outer.r1) + e2 @ (gains.coupling * e2) + high * (r2 @ r2)
    )
    return float(0.5 * (rest + sum(w * square for w, square in zip(weights, squares, strict=False))))


def stretched(
    direction: Mapping[str, tuple[float, float, float]], region: Region, bias: float = 0.0
) -> dict[str, tuple[float, float, float]]:
    """A direction scaled as far as the region's level allows."""
    low, high = 0.0, 1.0

    def by(factor: float) -> dict[str, tuple[float, float, float]]:
        return {key: (factor * x, factor * y, factor * z) for key, (x, y, z) in direction.items()}

    for _ in range(40):
        middle = 0.5 * (low + high)
        inside = level_at_start(mission(by(middle), False).plan(), region, bias) <= float(region.level)
        low, high = (middle, high) if inside else (low, middle)
    return by(low)


def over_bounds(log: FlightLog, region: Region) -> tuple[float, float, float] | None:
    """Largest |r1|, |e1| and |r2| of a flight over the theorem's bound at each instant; None for one that diverged."""
    if log.outcome is not Outcome.COMPLETED:
        return None
    t = log.column("t")
    level, ultimate, rate = (float(number) for number in (region.level, region.ultimate, region.rate))
    shrunk = np.sqrt((ultimate + (level - ultimate) * np.exp(-2.0 * rate * t)) / level)
    e1 = np.linalg.norm(log.table("x_d", "y_d", "z_d") - log.table("x", "y", "z"), axis=-1)
    largest = [float(region.bounds.largest[place]) for place in (R1, E1, R2)]
    norms = (log.column("norm_r1"), e1, log.column("norm_r2"))
    return tuple(float((norm / (bound * shrunk)).max()) for norm, bound in zip(norms, largest, strict=True))  # type: ignore[return-value]


def default_region(force: float = 0.0, torque: float = 0.0, bias: float = 0.0) -> Region | None:
    """The region of the completed law with its default gains on Case 1, without Eq. 67, nets off."""
    return certify_region(setting_of(mission({}, False).plan(), Pushes(force, torque, bias)))


def least_frequency(region: Region, unknown: Pushes = NOTHING) -> Fraction:
    """The least filter frequency at which the region's level is still certified with its shape, to 1 rad/s."""
    setting = setting_of(mission({}, False).plan(), unknown)
    frequency = int(setting.filter_frequency)
    while certify_region(setting._replace(filter_frequency=Fraction(frequency - 1)), region.shape):
        frequency -= 1
    return Fraction(frequency)


def fly_edge(region: Region, names: Sequence[str] = tuple(DIRECTIONS), unknown: Pushes = NOTHING) -> list[Edge]:
    """Every direction from the edge, nets off and on, pushed by as much as is unknown."""
    starts = {name: stretched(DIRECTIONS[name], region, unknown.bias) for name in names}
    plans = [mission(off, nets, unknown).plan() for off in starts.values() for nets in (False, True)]
    found = [over_bounds(log, region) for log in fly_all(plans)]
    nowhere = (float("inf"),) * 3
    return [Edge(name, off, found[2 * i] or nowhere, found[2 * i + 1]) for i, (name, off) in enumerate(starts.items())]


MEANINGS = {
    "r1": ("|r1|", "m/s"), "I1": ("|int r1|", "m"), "e1": ("|e1|: position", "m"), "e2": ("|e2|: attitude", "rad"),
    "r2": ("|r2|", "rad/s"), "I2": ("|int r2|", "rad"), "a": ("command filter, first stage", "rad"),
    "b": ("command filter, second stage", "rad"),
}  # fmt: skip
UNITS = {"position": "m", "velocity": "m/s", "attitude": "rad", "rates": "rad/s"}


def region_rows(region: Region, least_frequency: Fraction) -> list[tuple[str, str]]:
    """Level, rate and their consequences, each with its unit."""
    bounds = region.bounds
    ending = root_above(region.ultimate / region.level)
    rows = [
        ("L", f"{float(region.level):g} J"),
        ("time constant of the root of L", f"{1.0 / float(region.rate):.3g} s"),
        ("ultimate L", f"{float(region.ultimate):.2g} J"),
    ]
    for name, (what, unit) in MEANINGS.items():
        most = bounds.largest[NORMS.index(name)]
        rows.append((what, f"{float(most):.3g} {unit}, in the end {float(most * ending):.2g}"))
    return [
        *rows,
        ("thrust", f"{float(bounds.thrust):.3g} N"),
        ("least thrust upwards", f"{float(bounds.vertical):.3g} N (at least)"),
        ("filter frequency", f"{float(least_frequency):g} rad/s (at least)"),
    ]


def edge_rows(flights: list[Edge]) -> list[tuple[str, ...]]:
    rows = []
    for flight in flights:
        off = "; ".join(
            f"({', '.join(f'{number + 0.0:.3g}' for number in numbers)}) {UNITS[key]}" for key, numbers in flight.off.items()
        )
        learning = "diverged" if flight.learning is None else f"{max(flight.learning):.2f}"
        rows.append((flight.name, off, *(f"{share:.2f}" for share in flight.returned), learning))
    return rows


def line_rows(shares: dict[tuple[str, str], float]) -> list[tuple[str, str]]:
    """The share of each coefficient of Q that closed loops use, the least first."""
    return [(f"{a}, {b}", f"{max(share, 0.0):.2f}") for (a, b), share in sorted(shares.items(), key=lambda one: one[1])]
