"""`quadstep reproduce`: fly the study and write its folder, with the choices that the paper leaves open."""

import math
import platform
import re
from collections.abc import Mapping
from concurrent.futures import Future
from pathlib import Path

from quadstep.engines.engine import Engine
from quadstep.engines.fly import fingerprint
from quadstep.io import __version__
from quadstep.metrics.registry import Metrics, group, metric
from quadstep.mission.lagrange import LagrangeMission
from quadstep.report import markup, units
from quadstep.report.evidence import Evidence, Figure, TableSection
from quadstep.report.pool import drawing_pool
from quadstep.report.publish import publishing, write_json, write_log
from quadstep.report.sheet import Sheet
from quadstep.studies.paper.cases import (
    CASE_3_START,
    CASE_TIME,
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
from quadstep.studies.paper.claims import CONTEXT, RULE, Claim, ClaimVerdict, answer, check_claims
from quadstep.studies.paper.claims_comparison import losses, settled
from quadstep.studies.paper.page import write_paper_page
from quadstep.studies.paper.paper_figures import CAPTIONS, figure_jobs, to_see


def choices() -> list[tuple[str, str, str]]:
    """What was chosen, its value, read from the missions that are flown, and why."""
    mission: LagrangeMission = case_1()
    vehicle, clock, limits = mission.vehicle, mission.simulation, mission.limits
    gains = mission.controller.model_dump()
    nets = gains["nets"]
    listed = (CASE_3_START["position"], CASE_3_START["attitude"], STRESS_TIMES, STRESS_SCALES)
    position, attitude, times, scales = (", ".join(f"{one:g}" for one in numbers) for numbers in listed)
    return [
        ("T_eta", vehicle.kinematics, "the printed one violates Newton-Euler; with Sigma = 5 I both fly identically"),
        ("Coriolis term, C times the rates", "by Eq. 2", "Christoffel's C gives the same; the proof needs it"),
        ("Eq. 67", "row products", "sums give tau_psi = 0.93 N m in Case 1, which the paper says is 0"),
        ("rotor arm l, factor c", f"{vehicle.rotors.arm:g} m, {vehicle.rotors.moment:g} m", "only f_i depends on them"),
        ("rotor limits", "none", "the paper has none"),
        ("Lambda1, K_r1, K_i1", f"{gains['Lambda1'][0]:g}, {gains['K_r1'][0]:g}, {gains['K_i1'][0]:g}",
               "K_r1 > m Lambda1; a second-order response of about 1 rad/s"),
        ("Lambda2, K_r2, K_i2", f"{gains['Lambda2'][0]:g}, {gains['K_r2'][0]:g}, {gains['K_i2'][0]:g}",
               "K_r2 > J_M max(Lambda2) = 150; inner loop well above the outer one"),
        ("desired attitude rates", f"critically damped filter at {gains['filter_frequency']:g} rad/s, from the attitude "
               "at the start", "the exact rate makes an algebraic loop; yaw's rate is known from the path"),
        ("zero desired force", "theta_d = phi_d = 0", "any attitude gives zero force; level is the safe one"),
        ("basis and input weights", f"sigmoid, uniform in [-1, 1] with bias, seed {nets['seed']}", "worked in trials"),
        ("neurons", f"{nets['neurons']} per net", "the paper's number; 8 and 12 are flown too"),
        ("F1, F2", f"{nets['F1']:g} I, {nets['F2']:g} I (N x N)", "diag(5 [1;1;1]) does not fit Eq. 54's dimensions"),
        ("kappa", f"kappa1 = {nets['kappa1']:g}, kappa2 = {nets['kappa2']:g}, both times |r| of both loops",
               "Section 6 has two, Eq. 54 one"),
        ("learning starts", f"t = {nets['start']:g} s from zero weights", "the paper gives no time"),
        ("step, control period", f"RK4 at {1e3 * clock.step:g} ms, law sampled every {1e3 * clock.control_period:g} ms",
               "halving the step moves Case 1 by less than 1e-6 m"),
        ("t_f", f"{CASE_TIME:g} s in every case, {FIGURE_3_TIME:g} s in Fig. 3", "given for Case 1; Eq. 75 has 10 s"),
        ("start of Cases 1 and 2", "at rest on the path", "as described"),
        ("start of Case 3", f"({position}) m off, psi, theta, phi = ({attitude}) rad",
               "from rest on the path x, y, theta, phi stay zero for ever, yet the paper plots their errors"),
        ("gains of [11]", f"{next(iter(NESTED_GAINS))}, a_psi = (2.374, 0.08), b = (2, 1, 0.2, 0.1)",
               "printed in scripts that reproduce it; the other altitude gains are flown too"),
        ("stress flights", f"t_f = {times} s, scale {scales}, scored to t_f + {HOLD:g} s",
               "the disturbance is nearly zero in the paper's own cases"),
        ("divergence", f"{limits.distance:g} m off the path, an Euler rate of {limits.rate:g} rad/s, "
               f"|theta| > {limits.pitch:g} rad, or a number that is not finite", "an outcome with a time, never an error"),
        ("settling", "within 5 mrad for good", "the paper shows plots only"),
    ]  # fmt: skip


CHOICE = ("what", "value", "why")


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
        "name": "The paper's simulation study",
        "version": __version__,
        "python": platform.python_version(),
        "seed": nets["seed"],
        "choices": [dict(zip(CHOICE, choice, strict=True)) for choice in choices()],
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
    """The cases: errors, settling and what they take."""
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
        thrust = f"{metric(m, 'u', 'largest[N]'):.2f} N"
        rows.append([case_title(key, mission), *errors, settling, thrust, units.quantity(torque, "N m")])
    return rows


def briefly(measured: str) -> str:
    """What decides, without what was measured besides."""
    return re.split(r"(?<=\.) (?=[A-Z])", measured, maxsplit=1)[0]


SOURCES = (
    "Das, Lewis, Subbarao: Backstepping Approach for Controlling a Quadrotor Using Lagrange Form Dynamics (2009), Section 6, "
    f"replayed by quadstep {__version__}. Numbers in full: metrics.json, claims.json and the CSV files next to this page."
)

CASES_HEADER = ("flight", *"xyz", "level after", "largest thrust", "largest torque")
STRESS_HEADER = "t_f, scale", "nets on", "nets off"
OF_CASES = "Of x, y and z: RMSE / largest error. Level after: from then on roll and pitch are within 5 mrad of level."


def evidence(study: PaperStudy, claims: list[Claim], flying: bool = False) -> Evidence:
    """What was found. flying: whether page.html stands beside the report."""
    rows = [
        [f"{t:g} s, {scale:g}", *(stress_cell(study.stress[t, scale, nets]) for nets in (True, False))]
        for t in STRESS_TIMES
        for scale in STRESS_SCALES
    ]
    compared = [claim for claim in claims if "by_start" in claim.values]
    starts = compared[0].values["by_start"]
    tables = (
        [
            ("start; gains of [11]", *(one.name for one in some)),
            *([start, *(one.values["by_start"][start]["true"] for one in some)] for start in starts),
        ]
        for some in (compared[:3], compared[3:])  # which a phone shows below one another
    )
    lost, cases = losses(starts), case_rows(study)
    seen = {n: to_see(n, claims, study.logs["case2"]) for n in CAPTIONS}
    figures = [Figure(f"fig{n:02d}", f"Fig. {n}: {caption}. {seen[n]}") for n, caption in CAPTIONS.items()]
    worst_first = sorted(claims, key=lambda one: [*ClaimVerdict].index(one.verdict) or len(claims))
    judged = [(c.name, briefly(c.measured), (c.verdict, c.verdict)) for c in worst_first]
    anchors, full = ([f"{name}-{i}" for i, _ in enumerate(claims, 1)] for name in ("claim", "in-full"))  # a phone stacks rows
    all_said = [(c.name, c.case, c.sentence, c.measured) for c in claims]
    in_full = markup.table(("claim", "flights", "the paper's sentence", "measured"), all_said, anchors=full)
    return Evidence(
        name="The paper, flown and judged",
        kind="Reproduction",
        answer=f"{answer(claims)} {CONTEXT}",
        sentences=[answer(claims), CONTEXT],
        record=study_metrics(study),
        sections=[
            markup.links([("page.html", "Fly these flights in your browser")]) if flying else "",
            markup.heading("The paper's claims and the measurements", "claims"),
            markup.table(("claim", "measured", "verdict"), judged, anchors=anchors),
            markup.heading("The paper's figures, flown again", "figures"),
            TableSection(text="Captions compare with the text of the paper; its printed pictures were not at hand."),
            *figures,
            TableSection("How the claims are judged", "judged", text=RULE),
            TableSection(text=SOURCES),
            in_full,
            TableSection("The cases in numbers", "cases", CASES_HEADER[:4], [row[:4] for row in cases], OF_CASES),
            TableSection(header=(CASES_HEADER[0], *CASES_HEADER[4:]), rows=[[row[0], *row[4:]] for row in cases]),
            TableSection("Case 3 from other starts and with other gains of [11]", "starts",
                  text=f"Whether each claim holds for the flight; the paper gives neither the start nor the gains. {lost}"),
            *(TableSection(header=header, rows=some) for header, *some in tables),
            TableSection("Stress flights: Case 1's path in less time, under more disturbance", "stress", STRESS_HEADER, rows,
                  "Position RMSE and largest tilt, or the time and reason of the loss."),
            TableSection("Choices made where the paper is silent", "choices", ("what", "chosen", "why"), choices()),
        ],
        fold=("judged", "cases", "starts", "stress", "choices"),
    )  # fmt: skip
