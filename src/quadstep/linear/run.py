"""`quadstep linear`: one mission from file to folder, and numbers for machines: SI units, gain margins in dB, null where
missing.
"""

import math
from operator import attrgetter
from pathlib import Path

import numpy as np

from quadstep.engines.fly import fingerprint
from quadstep.interfaces.closed_loop import Outcome
from quadstep.interfaces.log import FlightLog
from quadstep.io import __version__
from quadstep.io.errors import UserError, errors_in
from quadstep.io.run_record import FIGURES
from quadstep.linear import tables, worst
from quadstep.linear.analysis import Analysis, RestAnalysis, StepResponse, analyse_rest, steps
from quadstep.linear.equilibrium import BEGUN, GROWING, KICK, LONG, stepped
from quadstep.linear.grade import REMEDY, graded
from quadstep.linear.margins import Margins
from quadstep.linear.states import Array
from quadstep.linear.tables import OpenLoop, draw_bode, draw_nyquist, draw_steps, merged
from quadstep.linear.transfer import LOWEST, harmonic, opened
from quadstep.metrics.statistics import finite
from quadstep.mission.multirotor import MultirotorMission
from quadstep.mission.read import plan_mission, read_mission
from quadstep.mission.schema import Mission
from quadstep.numbers import flatten
from quadstep.report import markup
from quadstep.report.drawing import FigureJob
from quadstep.report.evidence import Evidence, Figure, TableSection
from quadstep.report.panel import LOG, Panel
from quadstep.report.publish import MANIFEST, publishing, write_csv, write_json
from quadstep.report.sheet import Sheet
from quadstep.report.units import quantity

MARGIN_COLUMNS = (
    "gain_up[dB]", "gain_down[dB]", "phase[rad]", "crossover[rad/s]", "delay[s]", "disk[-]", "sensitivity[-]",
    "complementary[-]",
)  # fmt: skip


def margin_numbers(one: Margins) -> list[float | None]:
    gains = [20.0 * math.log10(gain) if 0.0 < gain < math.inf else None for gain in (one.gain_up, one.gain_down)]
    rest = one.phase, one.phase_at, one.delay, one.disk, one.sensitivity, one.complementary
    return [*gains, *map(finite, rest)]


def channel_margins(analysis: Analysis) -> dict[str, list[float | None]]:
    return {channel.name: margin_numbers(one) for channel, one in zip(analysis.channels, analysis.margins, strict=False)}


def record(analysis: Analysis, steps: list[StepResponse]) -> dict[str, object]:
    period, grade, asked = analysis.loop.period, graded(analysis), analysis.limits
    return {
        "grade": grade.word,
        "why": grade.why,
        "limits": {"gain[dB]": asked.gain, "phase[rad]": asked.phase, "delay[s]": asked.delay},
        "stable": analysis.holds,
        "not_held": list(analysis.not_held),
        "period[s]": period.length,
        "states": list(period.names),
        "margins": {name: dict(zip(MARGIN_COLUMNS, one, strict=True)) for name, one in channel_margins(analysis).items()},
        "bends": list(analysis.bends),
        "bends_near": list(analysis.near),
        "sides_tried": analysis.tried,
        "changes_until[s]": list(analysis.later),
        "rests_aside[m]": analysis.aside,
        "poles[1/s]": [[pole.real, pole.imaginary] for pole in analysis.poles],
        "pole_states": [list(pole.states) for pole in analysis.poles],
        "steps": {
            step.name: {"rest[-]": step.rest, "overshoot[-]": step.overshoot, "settling[s]": finite(step.settling)}
            for step in steps
        },
    }


LEAST, STEADY = 1e-6, 0.5
"""The least swing that counts [m]; share by which one changes over the last half of a flight that neither grows nor decays."""

CERTIFY = " `quadstep certify` judges the conditions of Theorem 5.1."
THERE = f"Stepped {1e3 * KICK:g} mm along each axis, the vehicle"


def flown_from_rest(mission: Mission) -> tuple[str, list[FigureJob]]:
    """A flight that is to stay where the path begins, without noise, gusts and events, after a small step: a sentence, and its
    figure, if it can be flown.
    """
    path = mission.path.build(mission.folder)
    try:
        log, t, errors = stepped(mission, path.law.reference(0.0, path.parameters))
    except UserError as error:  # a law of the user's own that fails there
        return f"It cannot be flown at rest: {error}.", []
    far = Panel("distance", "m", {"flown": np.linalg.norm(errors, axis=1)}, LOG)
    return of_flight(log), [FigureJob("flown", f"Distance from where it should stay, in that flight. {GROWING}", t, [far])]


def of_flight(log: FlightLog) -> str:
    """How such a flight ends, in a sentence."""
    if log.outcome is not Outcome.COMPLETED:
        return f"{THERE} is lost after {log.ended - BEGUN:.3g} s."
    t, half = log.column("t"), len(log.rows) // 2
    axes = {name: log.column(name)[half:] for name in ("x", "y", "z")}
    axis, values = max(axes.items(), key=lambda one: np.ptp(one[1]))
    first, last = np.ptp(values[: len(values) // 2]), np.ptp(values[len(values) // 2 :])
    if np.ptp(values) < 2.0 * LEAST:
        return f"{THERE} stays within {quantity(LEAST, 'm')} for {LONG:g} s: it grows too slowly to be seen."
    trend = ", still growing" if last > (1.0 + STEADY) * first else ", decaying" if last < (1.0 - STEADY) * first else ""
    about = f" every {quantity(every, 's')}" if (every := period(t[half:], values)) else ""
    return f"{THERE} does not settle: it swings by {quantity(0.5 * float(last), 'm')} along {axis}{about}{trend}."


def period(t: Array, values: Array) -> float:
    """Mean time between upward crossings of the mean [s]; 0 where there are too few."""
    above = values > values.mean()
    crossings = t[1:][above[1:] & ~above[:-1]]
    return float(np.diff(crossings).mean()) if len(crossings) > 2 else 0.0


DRAWN, SLOWEST_SHOWN = 600, 0.1
"""Number of frequencies in a plot, and the least of them [rad/s]."""


def linear_mission(path: Path, folder: Path, overwrite: bool, sheet: Sheet) -> Evidence:
    """Linearise the mission in `path` where its path begins, and write `folder`. Raises UserError."""
    mission = read_mission(path)
    plan = plan_mission(mission, path)
    with publishing(folder, "linear-" + fingerprint([plan]), overwrite) as out:
        with errors_in(path):
            found = analyse_rest(mission)
        but = mission.shortfall(plan) if found.analysis.holds else ""
        done = evidence(out, mission, path, found, sheet, but)
        rows = channel_margins(found.analysis).items()
        write_csv(out / "margins.csv", ("channel", *MARGIN_COLUMNS), [(name, *one) for name, one in rows])
        write_csv(out / "poles.csv", ("real[1/s]", "imaginary[rad/s]", "states"), [one.row for one in found.analysis.poles])
        write_json(out / "linear.json", done.record)
        done.write_report(out)
        write_json(out / MANIFEST, {**done.record, "states": len(found.analysis.loop.period.names)})
    return done


def evidence(out: Path, mission: Mission, path: Path, studied: RestAnalysis, sheet: Sheet, but: str = "") -> Evidence:
    """The loop for its readers; draws the figures of a stable one into the folder `out`. but: what the mission's flight does
    that was not asked.
    """
    found = studied.analysis
    moves = steps(studied.rest.period, found.poles) if found.stable else []
    answer, jobs = [worst.finding(found, but), *turned(moves)], list[FigureJob]()
    if not found.stable:
        flown, jobs = flown_from_rest(mission)
        answer += [flown, REMEDY + CERTIFY * mission.controller.controller.theorem]
    said = [*answer, *tables.sentences(found), *for_latency(mission)]
    about = {"name": mission.name, "version": __version__, "mission": str(path), "controller": mission.controller.type}
    rows = tables.pole_rows(found.poles, found.in_words)
    poles = TableSection("Poles", "poles", tables.POLE_HEADER, rows, tables.of_poles(found))
    done = Evidence(
        name=mission.name,
        kind="Linear",
        answer=" ".join(answer),
        opening=answer[0],
        sentences=said[1:],
        record={**about, **record(found, moves), "sentences": said},
        sections=[poles],
        more=said[len(answer) :],
        fold=("poles",),
    )
    if not found.stable:
        (out / FIGURES).mkdir()
        for job in jobs:
            job.draw(out / FIGURES, sheet.with_svg())
        fastest = markup.Fact("fastest growing poles", f"{rows[0][0]}\u00a01/s", f"of {rows[0][-1]}", kind="fails")
        drawn = [Figure(f"{FIGURES}/{one.name}", one.caption) for one in jobs]
        return done._replace(figures=drawn, facts=[fastest], fold=())
    draw(out / FIGURES, found, moves, sheet.with_svg())
    margins = f"{mission.name}: margins, one loop opened at a time"
    return done._replace(
        more=(),
        facts=[with_limit(one, found) for one in worst.facts([("", found)])],
        figures=[Figure(f"{FIGURES}/{name}", caption) for name, caption in captions(found, moves).items()],
        sections=[
            TableSection("Margins", "margins", *worst.by_channel(found), tables.PEAKS, shown=margins),
            markup.disclosure("how they are computed", "".join(map(markup.paragraph, [tables.METHOD, *said[len(answer) :]]))),
            poles,
        ],
    )


def for_latency(mission: Mission) -> list[str]:
    """That gains which the mission leaves out are for its latency, in a sentence; none where they are the same without it."""
    if not isinstance(mission, MultirotorMission):
        return []
    controller, prompt = mission.controller, mission.vehicle.build(0.0, 0.0, mission.simulation.control_period)
    used, other = (controller.gains(one.model()) for one in (mission.modelled, prompt))
    names = [attrgetter(name) for name, _ in controller.controller.by_key().values()]
    if [flatten(of(used)) for of in names] == [flatten(of(other)) for of in names]:
        return []
    return ["Gains that the mission leaves out are defaults chosen for its latency; with another latency they would differ."]


def with_limit(fact: markup.Fact, analysis: Analysis) -> markup.Fact:
    """A least margin with what a sound loop needs of it or what it allows."""
    asked = [one for one in graded(analysis).measures if fact.what == f"smallest {one.what} margin"]
    needed = [f"a sound loop has at least {one.text(one.limit)}" if one.limit else "no limit applies" for one in asked]
    if fact.what == worst.DISK and (d := float(fact.value)) < 2.0:
        both = 20.0 * math.log10((2.0 + d) / (2.0 - d)), math.degrees(2.0 * math.atan(0.5 * d))
        gain, angle = map(analysis.written, both)
        needed.append(f"allows a gain of {gain} dB up or down, a phase of {angle}°, and less of both together")
    short = any(not one.met for one in asked)
    return fact._replace(more="; ".join(filter(None, (fact.more, *needed))), kind="fair" * short)


def captions(analysis: Analysis, moves: list[StepResponse]) -> dict[str, str]:
    """What to see in each figure."""
    pairs = list(zip(analysis.channels, analysis.margins, strict=False))
    phase = pairs[least_phase(analysis)]
    least = analysis.written(math.degrees(phase[1].phase))
    near = max(pairs, key=lambda pair: pair[1].sensitivity)
    over, late = max(moves, key=lambda one: one.overshoot), max(moves, key=lambda one: one.settling)
    settled = f"the last to settle is {late.name}: within 2 % after {late.settling:.3g} s"
    never = f"{late.name} does not settle within 2 % in the time shown"
    return {
        "bode": "Where |L| falls through 0 dB, the phase's distance from −180° is the phase margin. It is smallest in "
        f"{phase[0].name}: {least}° at {phase[1].phase_at:.3g} rad/s. The bars mark it, and the smallest gain margin, which "
        "is read where the phase crosses −180° or −540°; dots mark their frequencies in the other panel.",
        "step": f"The path steps by 1 along one axis at a time. The largest overshoot is that of {over.name}, "
        f"{100.0 * over.overshoot:.1f} % over its final value, {over.rest:.3g}; "
        f"{settled if math.isfinite(late.settling) else never}.",
        "nyquist": "The nearer a curve comes to −1 (the cross), the less it takes to lose the vehicle. On the grey circle, "
        "|L| is 1: the angle there between a curve and −1 is its phase margin. The nearest to −1 is "
        f"{near[0].name}: disturbances are amplified {analysis.written(near[1].sensitivity, 2, up=True)} times there.",
    }


def least_phase(analysis: Analysis) -> int:
    """The place of the channel with the least phase margin, the first of those that are equal."""
    return min(range(len(analysis.margins)), key=lambda i: float(f"{analysis.margins[i].phase:.6g}"))


def turned(moves: list[StepResponse]) -> list[str]:
    """That a small step of the heading ends elsewhere, in a sentence, where it does."""
    rest = next((one.rest for one in moves if one.name == "yaw"), 1.0)
    said = f"A small turn from this heading ends {100.0 * abs(rest - 1.0):.2g} % too {'large' if rest > 1.0 else 'small'}."
    return [said] * (f"{rest:.3g}" != "1")


def draw(folder: Path, analysis: Analysis, moves: list[StepResponse], sheet: Sheet) -> None:
    """The figures: frequencies up to half the rate of the law."""
    folder.mkdir()
    ready = opened(analysis.loop)
    omega = np.geomspace(max(LOWEST, SLOWEST_SHOWN), np.pi * len(ready.due) / ready.length, DRAWN)
    least = least_phase(analysis)
    all_gains = [(i, way) for i, one in enumerate(analysis.margins) for way in (one.up, -one.down)]
    one = analysis.margins[least]
    shown = merged(OpenLoop(
        analysis.channels, omega, harmonic(ready, omega),
        phases=[(least, math.degrees(one.phase), one.phase_at)] if math.isfinite(one.phase) else [],
        gains=[min(all_gains, key=lambda gain: abs(gain[1]))], written=analysis.written,
    ))  # fmt: skip
    draw_bode(folder / "bode", shown, sheet)
    draw_nyquist(folder / "nyquist", shown, sheet)
    draw_steps(folder / "step", moves, sheet)
