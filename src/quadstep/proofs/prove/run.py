"""`quadstep prove`: one mission from file to verdict, and certificates from file to verdict."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from quadstep.control.backstepping import BacksteppingGains
from quadstep.engines.fly import FlightPlan, fly
from quadstep.interfaces.closed_loop import Outcome
from quadstep.interfaces.log import REASONS, FlightLog
from quadstep.io import files
from quadstep.io.documents import parse_toml
from quadstep.io.errors import UserError
from quadstep.io.parts import read_sealed
from quadstep.io.user_code import only
from quadstep.linear.equilibrium import check_equilibrium
from quadstep.mission.read import check_mission, plan_mission
from quadstep.mission.schema import Mission
from quadstep.numbers.enclosure import UndefinedError
from quadstep.proofs.certify.lyapunov import conditions
from quadstep.proofs.prove.certificate_file import SET_FORMAT, WHAT, Certificate, folder_from, off_path, write_certificate
from quadstep.proofs.prove.checker import check_certificate
from quadstep.proofs.prove.for_ever import check_for_ever, hover_for_ever, left_hover
from quadstep.proofs.prove.hold import Departure, invariant_set
from quadstep.proofs.prove.hover import Hover, Instability, hover, instability
from quadstep.proofs.prove.invariant import MOST_STEPS
from quadstep.proofs.prove.linear_maps import Coordinates, block, coordinates
from quadstep.proofs.prove.proof_pictures import of_flight, of_instability, of_tube
from quadstep.proofs.prove.report import UNTIL, ProofVerdict, VerdictKind, length, under, within
from quadstep.proofs.prove.rest import path_rests
from quadstep.proofs.prove.sampled import Array, SampledLoop
from quadstep.proofs.prove.tube import SAMPLES, OpenTube, beginning, tube
from quadstep.proofs.prove.unknown import Unknown, check_unknown
from quadstep.report.bars import bar
from quadstep.report.markup import Fact
from quadstep.report.progress import Count
from quadstep.report.units import in_one_unit, rounded_down, rounded_up
from quadstep.vehicle.lagrange import Parameters
from quadstep.vehicle.paper import Disturbance

PUSH = 2.3e-4
"""The largest force [N] and torque [N m] of the paper's disturbance (Eq. 67) on its own first case."""


NOTHING = Unknown()

FEWEST = 2
"""Samples of a tube that bound a flight."""


def usual(plan: FlightPlan, force: float | None, torque: float | None, others: Unknown) -> Unknown:
    """The unknowns, with the defaults of the paper's plant for those not given."""
    push = PUSH if isinstance(plan.parameters, Parameters) and isinstance(plan.parameters.disturbance, Disturbance) else 0.0
    return others._replace(force=push if force is None else force, torque=push if torque is None else torque)


def prove_mission(
    path: Path, force: float | None = None, torque: float | None = None, others: Unknown = NOTHING,
    out: Path | None = None,
) -> ProofVerdict:  # fmt: skip
    """The verdict on the mission in `path`; a tube that closes is written to `out`. others: besides force and torque.

    Raises UserError.
    """
    text = files.read_text(path, files.TOML)
    mission = check_mission(parse_toml(text, str(path)), str(path), path.parent)
    plan = plan_mission(mission, path)
    unknown = usual(plan, force, torque, others)
    try:
        check_equilibrium(mission)
        check_unknown(plan, unknown)
        loop = SampledLoop(plan)
        at = hover(mission, plan, loop)
        loop.starts(unknown)
    except UserError as error:
        raise UserError(f"{path}: {error}") from None
    except UndefinedError as error:
        raise UserError(f"{path}: no bound of the starts: {error}") from None
    found = instability(loop, at) if at else None
    if at and found:
        return unstable(mission, plan, at, found)
    why = ""
    if path_rests(loop):
        with bar("proving", f"of at most {MOST_STEPS} sets") as progress:
            kept = invariant_set(loop, unknown, progress.to)
        if isinstance(kept, Departure):
            return left_hover(mission.name, loop, unknown, kept)._replace(pictures=of_instability(mission, plan, 0.0))
        if not isinstance(kept, str):
            found_set = hover_for_ever(mission.name, path, text, loop, unknown, kept, out)
            return found_set._replace(settings=settings(loop, unknown, "an invariant set, a product over the modes"))
        why = kept
    flown, log = loop.flown()
    if log.outcome is not Outcome.COMPLETED:
        return flown_verdict(mission.name, plan, fly(plan))
    chosen, axes = coordinates(loop, flown, unknown), len(plan.loop.plant.axes)
    refuse_singular(path, loop, flown, unknown, chosen)
    with bar("proving", "samples", loop.samples) as progress:
        shown = Count(progress, loop.samples).add
        result = tube(loop, flown, unknown, chosen, axes, shown)
    apart = flown[:, :axes] - path_samples(loop, len(flown))
    off, bound = np.abs(apart), result.position * 1.001
    drawn = of_tube(loop, apart[: len(bound)], bound)
    how = settings(loop, unknown, f"a box for each block of {SAMPLES} control periods, {-(-loop.samples // SAMPLES):,} blocks")
    if isinstance(result, OpenTube):
        partly = still_open(mission.name, plan, loop, unknown, result, off, bound, why)
        return partly._replace(pictures=drawn if partly.rows else (), settings=how)
    position = bound.max(axis=0)
    if out is not None:
        names = tuple(loop.names)
        content = text, unknown, names, flown, SAMPLES, chosen.spread, result.boxes, position
        write_certificate(out, Certificate(*content, folder_from(out, path)))
    away = off_path(off, SAMPLES, result.boxes, position)  # as the check of the certificate has it
    names = plan.loop.plant.axes
    says = [
        f"proved: {tube_sentence(loop.samples * loop.period, unknown, names, away, f'{len(flown):,} samples', why)}",
        *scale(plan, unknown),
        *not_for_ever(why),
    ]
    return ProofVerdict(
        mission.name, VerdictKind.PROVED, bounds_of(names, position, away), says, out, pictures=drawn, settings=how
    )


def tube_sentence(seconds: float, unknown: Unknown, axes: Sequence[str], away: Array, samples: str, why: str = "") -> str:
    """why: hover was not shown to hold for all time, if that was tried."""
    near, given = within(axes, away.tolist()), under(unknown).rstrip(",")
    after = "; what follows them is undecided" * bool(why)
    return f"{given}, the vehicle stays within {near} of its path at all {samples} of the {seconds:g} s flight{after}."


def settings(loop: SampledLoop, unknown: Unknown, sets: str) -> list[list[str]]:
    """How a proof was computed: name and value."""
    return [
        ["for", under(unknown).rstrip(",")],
        ["sets", sets],
        ["loop", f"{len(loop.names)} states, sampled every {1e3 * loop.period:g} ms"],
        ["numbers", "affine forms, with every rounding of the law and of the form in a remainder"],
    ]


def scale(plan: FlightPlan, unknown: Unknown) -> list[str]:
    """The force beside the weight, in a sentence."""
    if not unknown.force or not isinstance(plan.parameters, Parameters):
        return []
    weight = plan.parameters.vehicle.mass * plan.parameters.vehicle.gravity
    return [f"The force is up to {100.0 * unknown.force / weight:.2g} % of the weight on each axis."]


def bounds_of(axes: Sequence[str], *bounds: Array) -> list[list[str]]:
    """A row for each axis, of each bound [m]."""
    return [[axis, *(length(float(one)) for one in each)] for axis, *each in zip(axes, *bounds, strict=True)]


def refuse_singular(path: Path, loop: SampledLoop, flown: Array, unknown: Unknown, chosen: Coordinates) -> None:
    """Raises UserError if the law has no bounded value on the requested starts."""
    try:
        columns, weights = beginning(loop, unknown)
        block(loop, flown, unknown, chosen, np.maximum(np.abs(chosen.into @ columns) @ weights, 1e-12), 0, 1)
    except UndefinedError as error:
        raise UserError(f"{path}: no bound of the first sample over the starts and unknowns: {error}") from None


def check(path: Path, code: Sequence[str] = ()) -> ProofVerdict:
    """The verdict on a certificate. code: the only files and modules of users that are run. Raises UserError."""
    with only(code):
        found = checked(path)
    ran = f"Of users' code, only {', '.join(code)} was run, as you allowed." if code else "No user code was run."
    return found._replace(says=[*found.says, ran])


def checked(path: Path) -> ProofVerdict:
    if read_sealed(path, WHAT, links=True).get("format") == SET_FORMAT:
        return check_for_ever(path)
    found = check_certificate(path)
    if found.failed:
        return ProofVerdict(found.name, VerdictKind.OPEN, [], [f"not confirmed: {found.failed}"])
    says = f"confirmed: {tube_sentence(found.seconds, found.unknown, found.axes, found.off_path, 'samples')}"
    return ProofVerdict(found.name, VerdictKind.PROVED, bounds_of(found.axes, found.position, found.off_path), [says])


def path_samples(loop: SampledLoop, count: int) -> Array:
    """The path at every sample, (samples, axes) [m]."""
    time = np.arange(count) * float(loop.span) * loop.ticks.step
    position = loop.loop.path.reference(time, loop.parameters.path).position  # type: ignore[arg-type]
    along = ["xyz".index(axis) for axis in loop.loop.plant.axes]
    return np.stack([np.broadcast_to(position[i], count) for i in along], axis=1)


def not_for_ever(why: str) -> list[str]:
    """The note that hover was not shown to hold for all time, if that was tried."""
    return [f"undecided: what follows the flight. No set was found that hover never leaves: {why}."] if why else []


def still_open(
    name: str, plan: FlightPlan, loop: SampledLoop, unknown: Unknown, result: OpenTube, off: Array, bound: Array, why: str
) -> ProofVerdict:
    """The verdict on a tube that did not close: what was closed, and what was not. off, bound: as the picture has them [m]."""
    closed, given = len(bound), under(unknown).rstrip(",")
    if closed < FEWEST:
        says = [f"undecided: {given}, no bound is proved: {result.why}.", *not_for_ever(why)]
        return ProofVerdict(name, VerdictKind.OPEN, [], says)
    position, seconds = bound.max(axis=0), (closed - 1) * loop.period
    away = (off[:closed] + bound).max(axis=0)
    rows = [
        [axis, *(f"{length(one)}{UNTIL}{seconds:g} s" for one in bounds)]
        for axis, *bounds in zip(plan.loop.plant.axes, position, away, strict=True)
    ]
    says = [f"undecided: {given}, the bounds are proved until {seconds:g} s but not beyond: {result.why}.", *not_for_ever(why)]
    return ProofVerdict(name, VerdictKind.OPEN, rows, says)


def unstable(mission: Mission, plan: FlightPlan, at: Hover, growth: Instability) -> ProofVerdict:
    """The verdict that hover is not a stable equilibrium."""
    more = "of the linearised loop from sample to sample, enclosed by interval arithmetic"
    place, nets = ", ".join(f"{one:g}" for one in at.position), mission.controller.table
    says = [
        f"hover at the path's end, ({place}) m, is proved unstable. Flights that begin near it do not all stay near it. "
        "This holds for the law in exact arithmetic.",
        *consequence(plan),
    ]
    if nets and nets.enabled:
        says.append("At the path's start, which `fly` and `linear` judge, the rate differs: nets take position as an input.")
    bounds = f"{rounded_down(growth.slowest, 6):g} to {rounded_up(growth.fastest, 6):g} 1/s"
    fast = "growth of the fastest error"
    rows = [["eigenvalues outside the unit circle", f"{growth.unstable} of {growth.states}"], [fast, bounds]]
    cards = [
        Fact(rows[0][0], rows[0][1], more),
        Fact(fast, f"{growth.slowest:.3g} 1/s", f"it doubles every {math.log(2.0) / growth.slowest:.3g} s"),
    ]
    shown = of_instability(mission, plan, at.tick * plan.ticks.step)
    kind, columns = VerdictKind.DISPROVED, ("at hover", "proved")
    return ProofVerdict(mission.name, kind, rows, says, columns=columns, pictures=shown, cards=cards, unstable=True)


def consequence(plan: FlightPlan) -> list[str]:
    """What this means for Theorem 5.1, if its printed conditions hold: what they leave out."""
    gains, vehicle = plan.parameters.gains, plan.parameters.vehicle
    if not plan.loop.controller.unwrapped.theorem or not isinstance(gains, BacksteppingGains):
        return []
    k = conditions(plan, np.diag(vehicle.inertia)[None], np.array([vehicle.mass * vehicle.gravity]))
    if not k.printed_hold:
        return []
    outer, inner = min(k.position), min(k.printed_anywhere)
    says = (
        f"The printed conditions of Theorem 5.1 hold here (K_r1 - m Lambda1 is at least {outer:g} N s/m, K_r2 - J_M Lambda2 "
        f"at least {inner:g} N m s at any attitude). "
    )
    if not k.coupling_holds:
        bound = f"thrusts up to {k.thrust_bound or 0.0:.3g} N near hover, which takes {k.weight:.4g} N"
        says += f"With the coupling of the loops, which they leave out, the proof covers {bound}. "
    period = 1e3 * plan.ticks.step * plan.ticks.every[-1]
    return [
        f"{says}The theorem also assumes continuous time; this law is sampled every {period:g} ms and filters its commands."
    ]


def flown_verdict(name: str, plan: FlightPlan, log: FlightLog) -> ProofVerdict:
    """A disproof by the mission's own flight, which was lost: how far it was off its path along each axis, in its log or in
    the state that ended it, which the log is without.
    """
    says = [f"the mission's own flight was lost at {log.ended:.4g} s ({REASONS.get(log.outcome, '')})."]
    axes = plan.loop.plant.axes
    errors, t = log.table(*axes) - log.table(*(f"{axis}_d" for axis in axes)), log.column("t")
    last = np.array(tuple(plan.loop.plant.error(log.final.state, plan.loop.reference(log.ended, plan.parameters))))
    if np.isfinite(last).all():
        errors, t = np.vstack([errors, last]), np.append(t, log.ended)
    texts = in_one_unit([(one, math.nan, math.nan) for one in np.abs(errors).max(axis=0).tolist()], "m")
    rows, shown = [list(row) for row in zip(axes, texts, strict=True)], of_flight(t, errors, plan.parameters.limits.distance)
    return ProofVerdict(name, VerdictKind.DISPROVED, rows, says, columns=("axis", "largest error"), pictures=shown)
