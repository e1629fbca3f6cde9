"""An independent check of a certificate: it shares the laws and the enclosure arithmetic with the prover, nothing else.

The prover propagates the effect of every sample forwards; here each bound is computed backwards from its end: a row c of the
quantity goes back by c A from block to block, and the sum of |c| times each block's addition is the bound. Rounding of c A
counts as an addition too. The centre line need not be trusted: its defect from sample to sample is counted.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple, cast

import numpy as np

from quadstep.documents import parse_toml
from quadstep.errors import UserError
from quadstep.flight.closed_loop import Clock
from quadstep.flight.engines import FlightPlan
from quadstep.flight.loop import Numbers
from quadstep.mission.read import check_mission, plan_mission
from quadstep.numbers import Number, Vector, flatten, leaf_names, rebuild
from quadstep.numbers.enclosure import Array, Enclosure, Fresh, Operand, UndefinedError
from quadstep.plants.lagrange import Parameters
from quadstep.prove.backwards import CONSTANTS, PUSHES, UP, Stretch, from_the_start, grown, inner, passage, rounding
from quadstep.prove.certificate import Certificate, read_certificate
from quadstep.prove.unknown import Unknown
from quadstep.vehicle.disturbance import Disturbance


class Checked(NamedTuple):
    """failed: what does not hold, empty if everything does. position: bound of each axis [m]; off_path: from the path [m]."""

    name: str
    axes: tuple[str, ...]
    unknown: Unknown
    failed: str
    position: Array
    off_path: Array
    seconds: float


class Loop:
    """The mission's loop on enclosures; leaves that are not states stay constant, or are written before they are read."""

    def __init__(self, plan: FlightPlan, states: tuple[str, ...]) -> None:
        self.plan, self.like = plan, plan.loop.start(plan.start, plan.parameters)
        names: list[str] = []
        for name in leaf_names(self.like):  # by the last parts of the name, which belong to the first leaf of that name
            brief = name.partition(".")[2]
            names.append(name if brief in names else brief)
        self.start = [float(leaf) for leaf in flatten(self.like)]
        moving = len(flatten(self.like.state))
        if len(set(states)) != len(states) or set(states) - set(names) or set(names[:moving]) - set(states):
            raise UserError("its states do not match its mission")
        self.places = [names.index(name) for name in states]
        self.dead: set[int] | None = None
        self.span = max(plan.ticks.every)
        if any(self.span % every for every in plan.ticks.every):
            raise UserError("the check supports only loops whose periods divide the slowest one")

    def after(self, x: Sequence[Operand], ticks: Operand, p: Numbers) -> list[Operand]:
        """The states one sample later. Leaves that the loop writes before it reads them start undefined.

        Raises UndefinedError, UserError.
        """
        samples = next(len(one.centre) for one in x if isinstance(one, Enclosure))
        if self.dead is None:
            found = self.run(self.filled(x, {}), ticks, p)
            others = set(range(len(found))) - set(self.places)
            self.dead = {i for i in others if not (isinstance(found[i], float) and found[i] == self.start[i])}
        nothing = np.full(samples, np.nan)
        found = self.run(self.filled(x, dict.fromkeys(self.dead, Enclosure(nothing, None, nothing, nothing))), ticks, p)
        for i, leaf in enumerate(found):
            held = isinstance(leaf, float) and leaf == self.start[i]
            if i not in self.dead and i not in self.places and not held:
                raise UserError("a number that is not a state of the certificate affects the flight")
        return [found[i] for i in self.places]

    def filled(self, x: Sequence[Operand], others: dict[int, Enclosure]) -> list[Operand]:
        """All leaves of the cycle."""
        leaves: list[Operand] = [*self.start]
        for place, number in [*others.items(), *zip(self.places, x, strict=True)]:
            leaves[place] = number
        return leaves

    def run(self, leaves: list[Operand], ticks: Operand, p: Numbers) -> list[Operand]:
        """One sample: the tasks that are due and the vehicle, step by step."""
        loop, step = self.plan.loop, self.plan.ticks.step
        cycle = rebuild(self.like, iter(leaves))
        for past in range(self.span):
            now = cast(Number, ticks + past)
            for task, every in zip(loop.tasks, self.plan.ticks.every, strict=True):
                if past % every == 0:
                    cycle, code = task.run(cycle, p, Clock(now * step, now, step * every))
                    if isinstance(code, Enclosure) or np.any(np.asarray(code) != 0.0):
                        raise UndefinedError("the flight may end at a limit of the mission")
            cycle = loop.advance(cycle, p, Clock(now * step, now, step))
        return flatten(cycle)


def pushed(p: Numbers, unknown: Unknown, first: int, total: int, samples: int) -> Numbers:
    """The parameters with their unknowns: force and torque on the vehicle, its mass and inertia. Raises UserError."""
    force, torque, mass, inertia, _ = unknown
    if not any((force, torque, mass, inertia)):
        return p
    if not isinstance(p, Parameters) or not isinstance(p.disturbance, Disturbance):
        raise UserError("its unknowns are supported only on the paper's plant with its own disturbance")

    def one(value: float, radius: float, place: int) -> Number:
        parts = np.zeros((total, samples))
        parts[first + place] = radius
        size = np.full(samples, abs(radius))
        return cast(Number, Enclosure(np.full(samples, float(value)), parts, np.zeros(samples), size))

    def three(values: Vector, radii: list[float], place: int) -> Vector:
        return Vector([one(x, r, place + i) for i, (x, r) in enumerate(zip(values, radii, strict=True))])

    body = p.vehicle
    disturbance = p.disturbance._replace(
        force=three(p.disturbance.force, [force] * 3, 0), torque=three(p.disturbance.torque, [torque] * 3, 3)
    )
    moments = three(body.inertia, [inertia * x for x in body.inertia], PUSHES + 1)
    return p._replace(
        disturbance=disturbance, vehicle=body._replace(mass=one(body.mass, mass * body.mass, PUSHES), inertia=moments)
    )


def stretch(loop: Loop, found: Certificate, place: int) -> Stretch:
    """A block, over its box. Raises UndefinedError, UserError."""
    n, spare = len(found.states), 6
    begin, end = place * found.block, min((place + 1) * found.block, len(found.flown) - 1)
    samples, total = end - begin, n + PUSHES + CONSTANTS + spare
    width = found.spread * found.boxes[place]
    x = []
    for i in range(n):
        parts = np.zeros((total, samples))
        parts[:n] = width[i][:, None]
        reach = np.full(samples, np.abs(width[i]).sum() * UP)
        x.append(Enclosure(found.flown[begin:end, i].copy(), parts, np.zeros(samples), reach, Fresh(total - spare, total)))
    p = pushed(loop.plan.parameters, found.unknown, n, total, samples)
    with np.errstate(all="ignore"):
        after = loop.after(x, np.arange(begin, end, dtype=np.float64) * float(loop.span), p)
    linear, rest = np.zeros((samples, n, total)), np.zeros((samples, n))
    for i, number in enumerate(after):
        if not isinstance(number, Enclosure) or number.parts is None or not np.all(np.isfinite(number.centre)):
            raise UserError(f"{found.states[i]} is not returned by the loop as a state is")
        linear[:, i] = number.parts.T
        rest[:, i] = number.rest + np.abs(number.centre - found.flown[begin + 1 : end + 1, i]) * UP
    into = 2.0 * np.eye(n) - found.spread
    middle = linear[samples // 2]
    step = (middle[:, :n] / np.where(found.boxes[place] > 0.0, found.boxes[place], 1.0)) @ into
    kept = np.concatenate([(step @ found.spread) * found.boxes[place], middle[:, n : n + PUSHES + CONSTANTS]], axis=1)
    known = n + PUSHES + CONSTANTS
    rest += np.abs(linear[:, :, :known] - kept).sum(axis=2) + np.abs(linear[:, :, known:]).sum(axis=2)
    reach = np.abs(found.spread) @ found.boxes[place]  # |e|
    rest += 3.0 * rounding(n) * (np.abs(step) @ (np.abs(into) @ reach + reach))  # `kept`, and going back by `step`
    return Stretch(step, kept[:, n:], rest * UP, reach)


def check_certificate(path: Path) -> Checked:
    """Whether the claim of the certificate in `path` holds. Raises UserError if it contains nothing that can be checked."""
    found = read_certificate(path)
    folder = path.parent / found.folder
    mission = check_mission(parse_toml(found.mission, str(path)), str(path), folder)
    plan = plan_mission(mission, path, folder)
    try:
        loop = Loop(plan, found.states)
    except UserError as error:
        raise UserError(f"{path}: {error}") from None
    n, axes = len(found.states), len(plan.loop.plant.axes)
    shear = found.spread - np.eye(n)
    moved, used = np.any(shear != 0.0, axis=1), np.any(shear != 0.0, axis=0)
    if np.any(moved & used) or np.any(moved[:axes]) or found.states[:axes] != tuple(f"position.{i}" for i in range(axes)):
        raise UserError(f"{path}: its coordinates are not a shear that keeps the position")
    if (len(found.flown) - 1) * loop.span != plan.ticks.last // loop.span * loop.span:
        raise UserError(f"{path}: its samples do not match its mission")
    if not np.array_equal(found.flown[0], [loop.start[place] for place in loop.places]):
        raise UserError(f"{path}: its flight does not start where its mission does")
    into = 2.0 * np.eye(n) - found.spread
    blocks, seconds = [], loop.span * plan.ticks.step
    failed, position = "", np.zeros((len(found.flown), axes))
    for place in range(len(found.boxes)):
        try:
            blocks.append(stretch(loop, found, place))
        except UndefinedError as error:
            failed = f"at {place * found.block * seconds:g} s: {error}"
            break
        except UserError as error:
            raise UserError(f"{path}: {error}") from None
    if not failed:
        start = np.zeros(n)
        start[:axes] = found.unknown.start
        passages, inners = [passage(one) for one in blocks], [inner(one, into, found.spread) for one in blocks]
        bounds = from_the_start(passages, inners, into, start, axes)
        for place, one in enumerate(inners):
            begin = place * found.block
            inside = grown(place, passages, one, bounds, found.spread, axes)
            position[begin : begin + len(inside)] = inside[:, :axes]
            wide = inside.max(axis=0) > found.boxes[place]
            if np.any(wide):
                name = found.states[int(np.argmax(wide))]
                failed = f"at {place * found.block * seconds:g} s: {name} is not shown to stay in its box"
                break
    most = position.max(axis=0)
    if not failed and np.any(most > found.position):
        failed = f"the position is shown to stay within {1e3 * most.max():.6g} mm, not within the bound that the file claims"
    time = np.arange(len(found.flown)) * float(loop.span) * plan.ticks.step
    wanted = plan.loop.path.reference(cast(Number, time), plan.parameters.path).position
    along = ["xyz".index(axis) for axis in plan.loop.plant.axes]
    off = [np.abs(found.flown[:, i] - wanted[along[i]]) + found.position[i] for i in range(axes)]
    return Checked(
        mission.name,
        tuple(plan.loop.plant.axes),
        found.unknown,
        failed,
        found.position,
        np.array([one.max() for one in off]),
        float(time[-1]),
    )
