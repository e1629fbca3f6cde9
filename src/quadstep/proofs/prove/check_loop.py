"""The loop of a certificate's mission on enclosures, for both independent checks: shares nothing with the prover."""

from __future__ import annotations

from collections.abc import Sequence
from copy import deepcopy
from typing import cast

import numpy as np

from quadstep.engines.fly import FlightPlan
from quadstep.engines.loop import Numbers
from quadstep.interfaces.closed_loop import Clock
from quadstep.io.errors import UserError
from quadstep.numbers import Number, Vector, flatten, leaf_names, rebuild
from quadstep.numbers.affine import UP
from quadstep.numbers.enclosure import Array, Enclosure, Fresh, Operand, UndefinedError
from quadstep.numbers.rotations import from_rotation_vector, multiply
from quadstep.proofs.prove.unknown import Unknown
from quadstep.vehicle.lagrange import Parameters
from quadstep.vehicle.multirotor import Multirotor
from quadstep.vehicle.paper import Disturbance

PUSHES, CONSTANTS, STARTS = 6, 4, 12
"""Unknowns that may change at every sample, those that may not, and those of a start."""


class CheckedLoop:
    """From sample to sample. Leaves that are not states stay constant, or are written before they are read.

    begun: all leaves at the start, over all starts. Raises UserError for states that are not the mission's, UndefinedError.
    """

    def __init__(self, plan: FlightPlan, states: tuple[str, ...], unknown: Unknown) -> None:
        self.plan, self.like = plan, plan.loop.start(plan.start, plan.parameters)
        named: dict[str, int] = {}
        for place, name in enumerate(leaf_names(self.like)):  # by its name, or by the last parts of it the first that has them
            named[name] = place
            named.setdefault(name.partition(".")[2], place)
        self.start = [float(leaf) for leaf in flatten(self.like)]
        self.places = [named.get(name, -1) for name in states]
        moving = set(range(len(flatten(self.like.state))))
        if len(set(self.places)) != len(states) or -1 in self.places or moving - set(self.places):
            raise UserError("its states do not match its mission")
        self.others = sorted(set(range(len(self.start))) - set(self.places))
        self.written: set[int] | None = None
        body = moved(plan, [float(one) for one in flatten(plan.start)], unknown)
        self.begun = flatten(plan.loop.start(rebuild(plan.start, iter(body)), plan.parameters))
        self.span = max(plan.ticks.every)
        if any(self.span % every for every in plan.ticks.every):
            raise UserError("the check supports only loops whose periods divide the slowest one")

    def after(self, x: Sequence[Operand], ticks: Operand, p: Numbers) -> list[Operand]:
        """The states one sample later. Leaves that the loop writes before it reads them start undefined.

        Raises UndefinedError, UserError.
        """
        leaves: list[Operand] = [*self.start]
        for place, number in zip(self.places, x, strict=True):
            leaves[place] = number
        if self.written is None:
            later = self.run(deepcopy(leaves), ticks, p)  # which leaves the directions of `Fresh` unused
            self.written = {*self.changed(later), *self.changed(self.begun)}
        nothing = np.full(next((len(one.centre) for one in x if isinstance(one, Enclosure)), 1), np.nan)
        for place in self.written:
            leaves[place] = Enclosure(nothing, None, nothing, nothing)
        found = self.run(leaves, ticks, p)
        if set(self.changed(found)) - self.written:
            raise UserError("a number that is not a state of the certificate affects the flight")
        return [found[place] for place in self.places]

    def changed(self, leaves: Sequence[Operand]) -> list[int]:
        """Places of the others that are not as they were."""
        return [i for i in self.others if not (isinstance(leaves[i], float) and leaves[i] == self.start[i])]

    def run(self, leaves: Sequence[Operand], ticks: Operand, p: Numbers) -> list[Operand]:
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


def number(centre: Array, row: Array, total: int, fresh: Fresh | None = None) -> Enclosure:
    """centre + row . e + d for every sample of the centre: e the first of `total` directions; d, what the row has rounded."""
    parts = np.zeros((total, len(centre)))
    parts[: len(row)] = row[:, None]
    reach = np.full(len(centre), np.abs(row).sum() * UP)
    return Enclosure(centre, parts, 2.0**-52 * reach, reach, fresh)


def moved(plan: FlightPlan, state: list[float], unknown: Unknown) -> list[Operand]:
    """The leaves of the vehicle's state over all starts about these numbers, in the first directions. Raises UserError."""
    names, found = [name.partition(".")[0] for name in leaf_names(plan.start)], [*map(cast, [Operand] * len(state), state)]
    parts = (("position",), ("velocity",), ("attitude", "pitch"), ("rates", "rate"))
    for first, radius, called in zip(range(0, STARTS, 3), unknown[4:], parts, strict=True):
        places = [place for place, name in enumerate(names) if name in called]
        quaternion = first == 6 and len(places) == 4 and isinstance(plan.loop.plant, Multirotor)
        if radius and not quaternion and not 1 <= len(places) <= 3:
            raise UserError(f"its plant has no {called[0]} whose start could be unknown")
        rows = radius * np.eye(STARTS)[first : first + min(3, len(places))]
        if radius and quaternion:
            turn = Vector([cast(Number, number(np.zeros(1), row, STARTS)) for row in rows])
            turned = multiply(Vector([state[place] for place in places]), from_rotation_vector(turn))
            for place, one in zip(places, turned, strict=True):
                found[place] = cast(Operand, one)
        elif radius:
            for place, row in zip(places, rows, strict=True):
                found[place] = number(np.array([state[place]]), row, STARTS)
    return found


def all_finite(*arrays: Array) -> None:
    """Raises UndefinedError for a number of the check that is infinite or none, of which no comparison would tell."""
    if not all(np.all(np.isfinite(one)) for one in arrays):
        raise UndefinedError("a number of the check is not finite")


def pushed(p: Numbers, unknown: Unknown, first: int, total: int, samples: int) -> Numbers:
    """The parameters with their unknowns: force and torque on the vehicle, its mass and inertia. Raises UserError."""
    force, torque, mass, inertia = unknown[:4]
    if not any((force, torque, mass, inertia)):
        return p
    if not isinstance(p, Parameters) or not isinstance(p.disturbance, Disturbance):
        raise UserError("its unknowns are supported only on the paper's plant with its own disturbance")
    push, body = p.disturbance, p.vehicle
    values = [*push.force, *push.torque, body.mass, *body.inertia]
    radii = [force] * 3 + [torque] * 3 + [mass * body.mass] + [inertia * one for one in body.inertia]
    rows = np.hstack([np.zeros((len(values), first)), np.diag(radii)])
    made = [cast(Number, number(np.full(samples, float(x)), row, total)) for x, row in zip(values, rows, strict=True)]
    disturbance = push._replace(force=Vector(made[:3]), torque=Vector(made[3:PUSHES]))
    return p._replace(disturbance=disturbance, vehicle=body._replace(mass=made[PUSHES], inertia=Vector(made[PUSHES + 1 :])))
