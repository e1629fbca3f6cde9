"""Figures 3 to 12 of the paper, panel for panel what their captions and the text describe.

`quadstep reproduce`: fly the study and write its folder, with the choices that the paper leaves open.
"""

import math
import platform
import re
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Future
from pathlib import Path
from typing import NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from quadstep.engines.engine import Engine
from quadstep.engines.fly import fingerprint
from quadstep.interfaces.log import FlightLog
from quadstep.io import __version__
from quadstep.metrics.quantities import position_errors
from quadstep.metrics.registry import Metrics, group, metric
from quadstep.mission.lagrange import LagrangeMission
from quadstep.numbers import vector
from quadstep.report import markup, units
from quadstep.report.drawing import FigureJob
from quadstep.report.evidence import Evidence, Figure, TableSection
from quadstep.report.panel import Panel
from quadstep.report.panels import attitude_panels, input_panels, position_panels
from quadstep.report.pool import drawing_pool
from quadstep.report.publish import publishing, write_json, write_log
from quadstep.report.sheet import Sheet
from quadstep.studies.paper.cases import (
    CASE_3_START,
    CASE_TIME,
    FIGURE_3_ENDS,
    FIGURE_3_TIME,
    HOLD,
    NESTED_GAINS,
    STRESS_SCALES,
    STRESS_TIMES,
    Logs,
    PaperStudy,
    case_1,
    case_title,
    completed,
    fly_study,
    main_cases,
    plan_study,
)
from quadstep.studies.paper.claims import RULE, Claim, ClaimVerdict, answer, check_claims
from quadstep.studies.paper.claims_comparison import settled
from quadstep.studies.paper.page import write_paper_page
from quadstep.world.paths import MinimumJerk, MinimumJerkParameters

CAPTIONS = {
    3: "Example trajectory simulation for different final positions",
    4: "Three position commands simultaneously (Case 1)",
    5: "Resultant angular positions and errors (Case 1)",
    6: "Input commands for Case 1",
    7: "Position and position tracking errors for x command only (Case 2)",
    8: "Angular variations due to change in x (Case 2)",
    9: "Input commands for variation in x (Case 2)",
    10: "Comparison: position response (Case 3)",
    11: "Comparison: attitude response (Case 3)",
    12: "Comparison: input commands (Case 3)",
}

TO_SEE: dict[int, str | tuple[str, ...]] = {
    3: "Velocity and acceleration are zero at both ends, and in proportion to the distance.",
    4: ("rest at the end point", "near-perfect tracking"),
    5: ("angles match their commands",),
    6: ("inputs realisable",),
    7: ("decoupling in x",),
    8: "Pitch tilts the thrust along x; roll stays at zero.",
    9: "The pitch torque moves the vehicle along x; the roll torque stays at zero.",
    10: ("better z tracking than [11]", "smaller x and y error than [11]"),
    11: ("faster attitude settling than [11]",),
    12: ("smoother thrust than [11]", "larger early transients"),
}
"""What a figure shows: in words, or the names of claims, of which the first sentence of what was measured is said."""

PRINTED = {
    3: "minimum-jerk trajectories to 10, 20, 30 and 40 m; so are these",
    4: "tracking is almost perfect; so is ours",
    5: "the angles match their commands nearly perfectly; ours do",
    6: "the inputs are realisable and tau_psi = 0; ours are, and tau_psi is small but not zero",
    7: "x follows its command nearly perfectly, y and z are held; ours agrees",
    8: "x does not influence phi; ours agrees",
    9: "tau_phi is almost zero; ours agrees",
    10: "z follows z_d more accurately than under [11], and x and y err less; from our start they do",
    11: "attitude settles sooner than under [11], after larger variations; from our start it does",
    12: "thrust is smoother than that of [11], after larger torques; ours are larger, too, but the thrust is not smoother",
}
"""What the paper's text says of its figure, and whether ours agrees."""

GLANCE = 12
"""The figure above the table of claims."""

FLAT = 1e-6
"""Change of a line below which a panel of Case 2 is named rather than drawn, in SI units."""


def of_case_2(log: FlightLog) -> dict[int, tuple[list[Panel], list[str]]]:
    """By figure: the panels in which something moves, and the names of the others."""
    found = {}
    for number, panels in ((7, position_panels(log)), (8, attitude_panels(log, ROLL_AND_PITCH)), (9, input_panels(log))):
        still = [max(map(np.ptp, panel.lines.values())) < FLAT for panel in panels]
        pairs = list(zip(panels, still, strict=True))
        found[number] = [one for one, flat in pairs if not flat], [one.label for one, flat in pairs if flat]
    return found


ROLL_AND_PITCH = ("phi", "theta")


def figure_name(number: int) -> str:
    return f"fig{number:02d}"


def figure_jobs(logs: Mapping[str, FlightLog]) -> list[FigureJob]:
    """fig03 to fig12, from the logs of the cases by file name."""
    case_1, case_2 = logs["case1"], logs["case2"]
    new, old = logs["case3_adaptive"], logs["case3_nested"]
    inputs = (("u", "N"), ("tau_phi", "N m"), ("tau_theta", "N m"), ("tau_psi", "N m"))

    def job(number: int, t: NDArray[np.float64], panels: list[Panel], columns: int = 2) -> FigureJob:
        return FigureJob(figure_name(number), f"Fig. {number}  {CAPTIONS[number]}", t, panels, columns)

    return [
        job(3, *trajectories(), 1),
        job(4, case_1.column("t"), position_panels(case_1)),
        job(5, case_1.column("t"), attitude_panels(case_1, ROLL_AND_PITCH)),
        job(6, case_1.column("t"), input_panels(case_1)),
        *(job(number, case_2.column("t"), panels, 1) for number, (panels, _) in of_case_2(case_2).items()),
        job(10, new.column("t"), comparison_positions(new, old)),
        job(11, new.column("t"), [both_controllers(a, "rad", new, old) for a in ("phi", "theta", "psi")], 1),
        job(12, new.column("t"), [both_controllers(name, unit, new, old) for name, unit in inputs]),
    ]


def trajectories() -> tuple[NDArray[np.float64], list[Panel]]:
    """x_d(t) for four final positions in 10 s (Eq. 75), with its first and second derivative."""
    t = np.linspace(0.0, FIGURE_3_TIME, 401)
    path, here = MinimumJerk(), vector(0.0, 0.0, 0.0)
    panels = [Panel("x_d", "m", {}), Panel("x_d_dot", "m/s", {}), Panel("x_d_ddot", "m/s^2", {})]
    for end in FIGURE_3_ENDS:
        parameters = MinimumJerkParameters(here, vector(end, 0.0, 0.0), 0.0, 0.0, FIGURE_3_TIME)
        rows = [path.reference(float(time), parameters) for time in t]
        values = np.array([(row.position[0], row.velocity[0], row.acceleration[0]) for row in rows])
        for order, panel in enumerate(panels):
            panel.lines[f"to {end:g} m"] = values[:, order]
    return t, panels


def both_controllers(name: str, unit: str, new: FlightLog, old: FlightLog) -> Panel:
    """A column of both controllers, with the paper's subscripts: n this paper's, o that of [11]."""
    return Panel(name, unit, {f"{name}_n (adaptive)": new.column(name), f"{name}_o (nested [11])": old.column(name)})


def comparison_positions(new: FlightLog, old: FlightLog) -> list[Panel]:
    """Positions of both controllers with the command, then their errors."""
    errors_new, errors_old = position_errors(new), position_errors(old)
    tracks, misses = [], []
    for i, a in enumerate(("x", "y", "z")):
        panel = both_controllers(a, "m", new, old)
        tracks.append(Panel(panel.label, panel.unit, {**panel.lines, f"{a}_d": new.column(f"{a}_d")}))
        misses.append(Panel(f"{a}_d - {a}", "m", {f"{a}_d - {a}_n": errors_new[:, i], f"{a}_d - {a}_o": errors_old[:, i]}))
    return tracks + misses


class Ruling(NamedTuple):
    """A choice: what was chosen, its value, and why."""

    what: str
    value: str
    why: str


def choices() -> list[Ruling]:
    """The list, its values read from the missions that are flown."""
    mission: LagrangeMission = case_1()
    vehicle, clock, limits = mission.vehicle, mission.simulation, mission.limits
    gains = mission.controller.model_dump()
    nets = gains["nets"]
    position, attitude = (", ".join(f"{one:g}" for one in CASE_3_START[part]) for part in ("position", "attitude"))
    return [
        Ruling("T_eta", vehicle.kinematics, "the printed one violates Newton-Euler; with Sigma = 5 I both fly identically"),
        Ruling("Coriolis term, C times the rates", "by Eq. 2", "Christoffel's C gives the same; the proof needs it"),
        Ruling("Eq. 67", "row products", "sums give tau_psi = 0.93 N m in Case 1, which the paper says is 0"),
        Ruling("rotor arm l, factor c", f"{vehicle.rotors.arm:g} m, {vehicle.rotors.moment:g} m", "only f_i depends on them"),
        Ruling("rotor limits", "none", "the paper has none"),
        Ruling("Lambda1, K_r1, K_i1", f"{gains['Lambda1'][0]:g}, {gains['K_r1'][0]:g}, {gains['K_i1'][0]:g}",
               "K_r1 > m Lambda1; a second-order response of about 1 rad/s"),
        Ruling("Lambda2, K_r2, K_i2", f"{gains['Lambda2'][0]:g}, {gains['K_r2'][0]:g}, {gains['K_i2'][0]:g}",
               "K_r2 > J_M max(Lambda2) = 150; inner loop well above the outer one"),
        Ruling("desired attitude rates", f"critically damped filter at {gains['filter_frequency']:g} rad/s, from the attitude "
               "at the start", "the exact rate makes an algebraic loop; yaw's rate is known from the path"),
        Ruling("zero desired force", "theta_d = phi_d = 0", "any attitude gives zero force; level is the safe one"),
        Ruling("basis and input weights", f"sigmoid, uniform in [-1, 1] with bias, seed {nets['seed']}", "worked in trials"),
        Ruling("neurons", f"{nets['neurons']} per net", "the paper's number; 8 and 12 are flown too"),
        Ruling("F1, F2", f"{nets['F1']:g} I, {nets['F2']:g} I (N x N)", "diag(5 [1;1;1]) does not fit Eq. 54's dimensions"),
        Ruling("kappa", f"kappa1 = {nets['kappa1']:g}, kappa2 = {nets['kappa2']:g}, both times |r| of both loops",
               "Section 6 has two, Eq. 54 one"),
        Ruling("learning starts", f"t = {nets['start']:g} s from zero weights", "the paper gives no time"),
        Ruling("step, control period", f"RK4 at {1e3 * clock.step:g} ms, law sampled every {1e3 * clock.control_period:g} ms",
               "halving the step moves Case 1 by less than 1e-6 m"),
        Ruling("t_f", f"{CASE_TIME:g} s in every case, {FIGURE_3_TIME:g} s in Fig. 3", "given for Case 1; Eq. 75 has 10 s"),
        Ruling("start of Cases 1 and 2", "at rest on the path", "as described"),
        Ruling("start of Case 3", f"({position}) m off, psi, theta, phi = ({attitude}) rad",
               "from rest on the path x, y, theta, phi stay zero for ever, yet the paper plots their errors"),
        Ruling("gains of [11]", f"{next(iter(NESTED_GAINS))}, a_psi = (2.374, 0.08), b = (2, 1, 0.2, 0.1)",
               "printed in scripts that reproduce it; the other altitude gains are flown too"),
        Ruling("stress flights", f"t_f = {STRESS_TIMES} s, scale {STRESS_SCALES}, scored to t_f + {HOLD:g} s",
               "the disturbance is nearly zero in the paper's own cases"),
        Ruling("divergence", f"{limits.distance:g} m off the path, an Euler rate of {limits.rate:g} rad/s, "
               f"|theta| > {limits.pitch:g} rad, or a number that is not finite", "an outcome with a time, never an error"),
        Ruling("settling", "within 5 mrad for good", "the paper shows plots only"),
    ]  # fmt: skip


NAME = "The paper's simulation study"


def reproduce(folder: Path, engine: Engine = Engine.LANES, overwrite: bool = False, sheet: Sheet | None = None) -> list[Claim]:
    """Fly everything and write `folder`; returns the claims with their verdicts. Raises UserError."""
    plans = plan_study()
    with publishing(folder, fingerprint(plans.all()), overwrite) as out, drawing_pool() as pool:
        drawn: list[Future[None]] = []

        def draw(logs: Logs) -> None:
            drawn.extend(pool.submit(job.draw, out, (sheet or Sheet()).with_svg()) for job in figure_jobs(logs))

        study = fly_study(plans, engine, draw)
        claims = check_claims(study)
        for name, log in study.logs.items():
            write_log(out / f"{name}.csv", log)
        write_json(out / "claims.json", [claim._asdict() for claim in claims])
        for figure in drawn:
            figure.result()
        evidence(study, claims, write_paper_page(out / "page.html", study, plans, claims)).write(out)
    return claims


def study_metrics(study: PaperStudy) -> dict[str, object]:
    nets = case_1().controller.model_dump()["nets"]
    return {
        "name": NAME,
        "version": __version__,
        "python": platform.python_version(),
        "seed": nets["seed"],
        "choices": [choice._asdict() for choice in choices()],
        "cases": study.cases,
        "further": study.further,
        "case3_by_start": keyed(study.starts),
        "neurons": keyed(study.neurons),
        "stress": [
            {"t_f[s]": t, "scale": scale, "nets": nets_on, **metrics} for (t, scale, nets_on), metrics in study.stress.items()
        ],
    }


def keyed(flights: Mapping[tuple[str, int, int], Metrics] | Mapping[tuple[str, str], Metrics]) -> dict[str, Metrics]:
    return {"; ".join(map(str, key)): metrics for key, metrics in flights.items()}


def stress_cell(metrics: Metrics) -> str:
    """One stress flight in a table: RMSE and largest tilt, or when and why it ended."""
    if completed(metrics):
        error, tilt = metric(metrics, "position_rmse[m]"), metric(metrics, "largest_tilt[rad]")
        return f"{units.quantity(error, 'm')}, {math.degrees(tilt):.3g}°"
    return f"lost at {metric(metrics, 'ended[s]'):.2f} s: {str(metrics['outcome']).replace('_', ' ')}"


def case_rows(study: PaperStudy) -> list[list[str]]:
    """The cases: errors, settling and effort."""
    rows = []
    for key, mission in main_cases().items():
        m = study.cases[key]
        errors = [
            " / ".join(units.quantity(v[f"{which}[m]"], "m") for which in ("rmse", "largest"))
            for v in group(m, "position").values()
        ]
        level = settled(m)
        settling = "–" if "case3" not in key else f"{level:.2f} s" if math.isfinite(level) else "never"
        torque = max(metric(m, f"tau_{a}", "largest[N m]") for a in ("psi", "theta", "phi"))
        weights = max(cast("dict[str, float]", m["largest_weight_norm"]).values())
        thrust, varied = metric(m, "u", "largest[N]"), metric(m, "u", "total_variation[N]")
        name = case_title(key, mission)
        rows.append(
            [name, *errors, settling, f"{thrust:.2f} N", f"{varied:.2g} N", units.quantity(torque, "N m"), f"{weights:.2g}"]
        )
    return rows


def facts(study: PaperStudy, claims: list[Claim]) -> list[markup.Fact]:
    """The claims that hold, how well Case 1 follows its path, and how many stress flights complete."""
    case, nets = study.cases["case1"], [m for (_, _, on), m in study.stress.items() if on]
    through = sum(completed(m) for m in nets)
    off = max(axis["largest[m]"] for axis in group(case, "position").values())
    return [
        markup.Fact("claims that hold", f"{sum(c.verdict is ClaimVerdict.HOLDS for c in claims)} of {len(claims)}"),
        markup.Fact(
            "Case 1, position RMSE",
            units.quantity(metric(case, "position_rmse[m]"), "m"),
            f"largest error along an axis {units.quantity(off, 'm')}",
        ),
        markup.Fact("stress flights with nets that complete", f"{through} of {len(nets)}", "Case 1's path in less time"),
    ]


def to_claims(claims: Sequence[Claim]) -> Iterator[str]:
    """Links to the claims that do not hold; with their numbers, to those that fail."""
    for verdict, said in (
        (ClaimVerdict.FAILS, ("fails", "fail")),
        (ClaimVerdict.UNDECIDED, ("is undecided", "are undecided")),
    ):
        more = {i: f": {briefly(c.measured)}" * (verdict is ClaimVerdict.FAILS) for i, c in enumerate(claims)}
        found = [(f"#{anchor(i)}", units.typed(c.name + more[i])) for i, c in enumerate(claims) if c.verdict is verdict]
        if found:
            yield markup.links(found, f"{len(found)} {said[len(found) > 1]}:")


def anchor(place: int) -> str:
    """Of a claim's row."""
    return f"claim-{place + 1}"


def briefly(measured: str) -> str:
    """What decides, without what was measured besides."""
    return re.split(r"(?<=\.) (?=[A-Z])", measured, maxsplit=1)[0]


SOURCES = (
    "Das, Lewis, Subbarao: Backstepping Approach for Controlling a Quadrotor Using Lagrange Form Dynamics (2009), Section 6, "
    f"replayed by quadstep {__version__}. Numbers in full: metrics.json, claims.json and the CSV files next to this page."
)

CASES_HEADER = (
    "flight", *(f"RMSE / largest error in {axis}" for axis in "xyz"), "roll and pitch within 5 mrad of level after",
    "largest thrust", "total variation of u",
    "largest torque", "largest weight norm",
)  # fmt: skip


def to_see(number: int, claims: list[Claim], case_2: FlightLog) -> str:
    """What a figure shows, in sentences."""
    shown = TO_SEE[number]
    said = (
        [shown]
        if isinstance(shown, str)
        else [f"{re.split(r'; |[.] |[.]$', one.measured)[0]}." for name in shown for one in claims if one.name == name]
    )
    still = of_case_2(case_2).get(number, ([], []))[1]
    said += [f"Not drawn, because they change by less than {FLAT:g} in SI units: {units.listed(still)}."] if still else []
    said += [f"The paper says of its figure: {PRINTED[number]}."]
    return " ".join([*said, *["Numbers of the paper's law come first, those of [11] second."] * (number >= 10)])


def evidence(study: PaperStudy, claims: list[Claim], flying: bool = False) -> Evidence:
    """What was found. flying: whether page.html stands beside the report."""
    columns = [(scale, nets) for scale in STRESS_SCALES for nets in (True, False)]
    header = ["t_f", *(f"scale {scale:g}, nets {'on' if nets else 'off'}" for scale, nets in columns)]
    rows = [[f"{t:g} s", *(stress_cell(study.stress[t, scale, nets]) for scale, nets in columns)] for t in STRESS_TIMES]
    compared = [claim for claim in claims if "by_start" in claim.values]
    start_header = ["start; gains of [11]", *(claim.name for claim in compared)]
    starts = compared[0].values["by_start"]
    start_rows = [[start, *(claim.values["by_start"][start] for claim in compared)] for start in starts]
    seen = {n: to_see(n, claims, study.logs["case2"]) for n in CAPTIONS}
    figures = {n: Figure(figure_name(n), f"Fig. {n}: {caption}. {seen[n]}") for n, caption in CAPTIONS.items()}
    judged = [(c.name, c.case, briefly(c.measured), (c.verdict, c.verdict)) for c in claims]
    in_full = markup.table(("claim", "the paper's sentence", "measured"), [(c.name, c.sentence, c.measured) for c in claims])
    return Evidence(
        name="The paper, flown and judged",
        kind="Reproduction",
        answer=answer(claims),
        sentences=[answer(claims)],
        record=study_metrics(study),
        facts=facts(study, claims),
        sections=[
            *to_claims(claims),
            TableSection(text=SOURCES),
            figures[GLANCE],
            markup.links([("page.html", "Fly these flights in your browser")]) if flying else "",
            markup.heading("The paper's claims and the measurements", "claims"),
            markup.table(("claim", "flights", "measured", "verdict"), judged, anchors=[*map(anchor, range(len(claims)))]),
            TableSection(text=RULE),
            markup.disclosure("The paper's sentences, and all that was measured", in_full),
            markup.heading("The paper's other figures, flown again", "figures"),
            TableSection(text="Captions compare with the text of the paper; its printed pictures were not at hand."),
            *(figure for number, figure in figures.items() if number != GLANCE),
            TableSection("The cases in numbers", "cases", CASES_HEADER, case_rows(study)),
            TableSection("Case 3 from other starts and with other gains of [11]", "starts", start_header, start_rows,
                  "Whether each claim holds for the flight; the paper gives neither the start nor the gains."),
            TableSection("Stress flights: Case 1's path in less time, under more disturbance", "stress", header, rows,
                  "Position RMSE and largest tilt, or the time and reason of the loss."),
            TableSection("Choices made where the paper is silent", "choices", ("what", "chosen", "why"), choices()),
        ],
    )  # fmt: skip
