"""`quadstep certify`: one mission from file to folder, and the line that says how flight and theorem fit."""

import json
from pathlib import Path

import numpy as np

from quadstep.engines.fly import fingerprint
from quadstep.interfaces.closed_loop import Outcome
from quadstep.io import __version__
from quadstep.io.errors import errors_in
from quadstep.linear.grade import REMEDY, UNSTABLE, quick_grade
from quadstep.metrics.registry import at_rest_sentences
from quadstep.metrics.verdict import Case
from quadstep.mission.read import plan_mission, read_mission
from quadstep.proofs.certify.certificate import FlightCertificate, certify_plan
from quadstep.proofs.certify.output import record, tables
from quadstep.proofs.certify.standing import answer, facts, kind, seen, stacked, visible
from quadstep.proofs.plain import Array
from quadstep.report import markup
from quadstep.report.drawing import FigureJob
from quadstep.report.evidence import Evidence, Figure, TableSection
from quadstep.report.panel import LOG, STACKED, UNJUDGED, Panel
from quadstep.report.pool import drawing_pool
from quadstep.report.publish import publishing, write_json
from quadstep.report.sheet import Sheet

NAME = "certificate"
"""Of its figure, and of the file with all its numbers."""

CHANGES = "changes"
"""Of the figure of what changed L, and of its section."""


def certify_mission(path: Path, folder: Path, overwrite: bool, sheet: Sheet | None = None) -> Evidence:
    """Fly the mission in `path`, certify it, and write `folder`; judged is whether it was completed. Raises UserError."""
    mission = read_mission(path)
    plan = plan_mission(mission, path)
    with publishing(folder, "certificate-" + fingerprint([plan]), overwrite) as out, drawing_pool() as pool:
        with errors_in(path, "no certificate"):
            flown = certify_plan(plan)
        drawn = [pool.submit(job.draw, out, sheet and sheet.shown()) for job in figures_of(flown, mission.name)]
        full = record(flown)
        write_json(out / f"{NAME}.json", full)
        found = evidence(flown, mission.name, full["verdict"], json.loads(mission.model_dump_json()))
        grade = quick_grade(mission)
        remedy = [REMEDY] * (grade.get("grade") == UNSTABLE)
        said = " ".join([found.answer, *at_rest_sentences(grade), *remedy])
        found = found._replace(answer=said, opening=said, grade=grade, told=True)
        for one in drawn:
            one.result()
        found.write(out)
    return found


def bounded(name: str, values: Array, bound: str, radius: float | None, later: Array, unit: str = "m/s, rad/s") -> Panel:
    """A line and the radius it is held against. later: how it goes on, if it does."""
    lines = {name: values, **({f"{bound} = {radius:.3g}": np.full(len(values), radius)} if radius is not None else {})}
    return Panel(name, unit, {**lines, **({UNJUDGED: np.append(values, later)} if len(later) else {})}, LOG)


def figures_of(c: FlightCertificate, name: str) -> list[FigureJob]:
    """|r| with b_r beside the thrust with what the proof covers; and what each term has added to L.

    Axes are logarithmic: a transient takes milliseconds, what it leaves is thousands of times smaller. So is time, but not of
    a lost flight, whose end is what matters.
    """
    k, title, log_time = c.conditions, f"{name}: Theorem 5.1 on this flight", c.outcome is Outcome.COMPLETED
    first = [
        bounded("|r|", c.r, "b_r", c.b_r, c.later),
        bounded("thrust", c.history.thrust, "covered by the proof", k.thrust_bound, c.later[:0], "N"),
    ]
    t = np.append(c.history.t, c.history.t[-1] + c.history.period * np.arange(1, len(c.later) + 1))
    figures = ((NAME, first), (CHANGES, [Panel("added to L", "J", visible(c), STACKED)]))
    return [FigureJob(file, title, t, panels, len(panels), log_time) for file, panels in figures]


def evidence(c: FlightCertificate, name: str, verdict: str, mission: dict[str, object]) -> Evidence:
    """What was found. mission: as it was flown."""
    lost = None if c.outcome is Outcome.COMPLETED else f"lost at {c.ended:.4g} s"
    found, logarithmic = tables(c), " Time is logarithmic." * (not lost)
    return Evidence(
        name=name,
        kind="Certificate",
        answer=answer(c),
        sentences=[],
        opening=answer(c),
        record={"name": name, "version": __version__, "kind": kind(c), "verdict": verdict, "mission": mission},
        facts=facts(c),
        figures=[Figure(NAME, seen(c) + logarithmic)],
        sections=[
            TableSection("Conditions", "conditions", CONDITIONS, found.conditions, shown=name),
            markup.disclosure("how they are computed", markup.paragraph(ASKED)),
            TableSection("Ball", "ball", ("", "measured", "bound", ""), found.ball, BALL, shown="The ball", most=4),
            TableSection("What changed L", CHANGES, ("", "added to L"), found.changes, CHANGED),
            TableSection("", "", ("", "L"), found.levels),
            Figure(CHANGES, stacked(c) + logarithmic),
            TableSection("Checks", "checks", ("", "share", "should be", ""), found.ways, CHECKED),
        ],
        cases=(Case("completed", lost),),
        fold=("ball", "checks", *([] if c.outside.any() else [CHANGES])),
    )


CONDITIONS = ("", "this flight", "must be", "verdict")
ASKED = (
    "Each margin is the smallest over the axes; what holds on this flight only does not at every attitude. J_M is the largest "
    "eigenvalue of J on this flight. The proof covers thrusts up to 2 l_2 sqrt(k_1 k_2): k_1 and k_2 are the first and the "
    "third margin, and l_2 is the smallest entry of Lambda2."
)
BALL = (
    "L (Eq. 55) joins all errors in one energy: the filtered errors r = (r_1, r_2), their integrals, and how far the weights "
    "of the nets are from ideal ones. Theorem 5.1 promises that L falls while |r| > b_r = (kappa W_B^2 / 4 + eps_N) / K_min "
    "and, unless r = 0, while the error of the weights |W_tilde| > b_w (Eq. 65). W_B is the size of the ideal weights and "
    "eps_N the largest error that even they leave, not only of the disturbance but of the torque that turns the vehicle as "
    "commanded (Eq. 33). As in the paper, |r| mixes m/s and rad/s."
)
CHANGED = (
    "The terms of dL/dt are those of a command that changes continuously; the flown one is held from sample to sample, and "
    "“sampling” is the difference that this makes."
)
CHECKED = (
    "dL/dt is computed in three ways: by the formula, from the plant's accelerations and from differences of L. The first two "
    "differ only by rounding; the third differs by what sampling adds. All numbers are in certificate.json."
)
"""What the rows of the tables are about."""
