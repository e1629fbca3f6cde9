"""`quadstep reproduce`: fly the study and write its folder."""

import platform
from collections.abc import Mapping
from concurrent.futures import Future
from pathlib import Path
from typing import cast

from quadstep.engines.engine import Engine
from quadstep.engines.fly import fingerprint
from quadstep.io.version import __version__
from quadstep.metrics.of_log import Metrics, group, metric
from quadstep.report import page, units
from quadstep.report.pool import drawing_pool
from quadstep.report.publish import MANIFEST, publishing, write_json
from quadstep.report.sheet import Sheet
from quadstep.report.symbols import rich
from quadstep.report.tables import write_log
from quadstep.studies.paper.cases import STRESS_SCALES, STRESS_TIMES, case_1
from quadstep.studies.paper.choices import choices
from quadstep.studies.paper.claims import Claim, Verdict, answer, check_claims
from quadstep.studies.paper.figures import CAPTIONS, figure_jobs, figure_name
from quadstep.studies.paper.page import write_paper_page
from quadstep.studies.paper.study import Logs, Study, completed, fly_study, plan_study

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
        write_json(out / MANIFEST, study_metrics(study))
        write_json(out / "claims.json", [claim._asdict() for claim in claims])
        for figure in drawn:
            figure.result()
        flying = write_paper_page(out / "page.html", study, plans, claims)
        page.write_page(
            out / "report.html", "The paper, flown and judged", report_sections(out, study, claims, flying), "Reproduction"
        )
    return claims


def study_metrics(study: Study) -> dict[str, object]:
    """The content of metrics.json."""
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
    """Text keys for JSON."""
    return {"; ".join(map(str, key)): metrics for key, metrics in flights.items()}


def stress_cell(metrics: Metrics) -> str:
    """One stress flight in a table: RMSE and largest tilt, or when and why it ended."""
    if completed(metrics):
        return f"{short(1e3 * metric(metrics, 'position_rmse[m]'))} mm, {metric(metrics, 'largest_tilt[rad]'):.2f} rad"
    return f"diverged at {metric(metrics, 'ended[s]'):.2f} s: {str(metrics['outcome']).replace('_', ' ')}"


def stress_table(study: Study) -> tuple[list[str], list[list[str]]]:
    """Header and rows: t_f down, scale and nets across."""
    columns = [(scale, nets) for scale in STRESS_SCALES for nets in (True, False)]
    header = ["t_f", *(f"scale {scale:g}, nets {'on' if nets else 'off'}" for scale, nets in columns)]
    return header, [
        [f"{t:g} s", *(stress_cell(study.stress[t, scale, nets]) for scale, nets in columns)] for t in STRESS_TIMES
    ]


def start_table(claims: list[Claim]) -> tuple[list[str], list[list[str]]]:
    """Header and rows: starts and gains of [11] down, the claims of Case 3 across."""
    compared = [claim for claim in claims if "by_start" in claim.values]
    starts = compared[0].values["by_start"]
    return ["start; gains of [11]", *(claim.name for claim in compared)], [
        [start, *(claim.values["by_start"][start] for claim in compared)] for start in starts
    ]


def short(value: float) -> str:
    """Three digits, without an exponent for large numbers."""
    return f"{value:.0f}" if abs(value) >= 1000.0 else f"{value:.3g}"


def case_rows(study: Study) -> list[list[str]]:
    """The cases: errors, settling and effort."""
    rows = []
    for name, m in study.cases.items():
        errors = ", ".join(
            f"{short(1e3 * v['rmse[m]'])} / {short(1e3 * v['largest[m]'])}" for v in group(m, "position").values()
        )
        settled: list[float | None] = [metric(m, "attitude", a, "angle_settling[s]") for a in ("theta", "phi")]
        settling = "never" if None in settled else f"{max(cast('list[float]', settled)):.2f} s"
        torque = max(metric(m, f"tau_{a}", "largest[N m]") for a in ("psi", "theta", "phi"))
        weights = max(cast("dict[str, float]", m["largest_weight_norm"]).values())
        effort = [
            f"{metric(m, 'u', 'largest[N]'):.2f} N",
            f"{metric(m, 'u', 'total_variation[N]'):.2g} N",
            f"{short(torque)} N m",
        ]
        rows.append([name, errors, settling, *effort, f"{weights:.2g}"])
    return rows


VERDICT_CLASS = {Verdict.HOLDS: "holds", Verdict.FAILS: "fails", Verdict.UNDECIDED: "open"}


AT_A_GLANCE = (4, 10, 12)
"""Figures of the summary: Case 1 follows its path; both controllers beside each other."""


def facts(study: Study, claims: list[Claim]) -> list[page.Fact]:
    """The claims that hold, how well Case 1 follows its path, and how many stress flights complete."""
    case, nets = study.cases["case1"], [m for (_, _, on), m in study.stress.items() if on]
    through = sum(completed(m) for m in nets)
    off = max(axis["largest[m]"] for axis in group(case, "position").values())
    return [
        page.Fact("claims that hold", f"{sum(c.verdict is Verdict.HOLDS for c in claims)} of {len(claims)}"),
        page.Fact(
            "Case 1, position RMSE",
            units.quantity(metric(case, "position_rmse[m]"), "m"),
            f"largest error along an axis {units.quantity(off, 'm')}",
        ),
        page.Fact(
            "stress flights with nets that complete",
            f"{through} of {len(nets)}",
            "Case 1's path in less time, under more disturbance",
        ),
    ]


def report_sections(out: Path, study: Study, claims: list[Claim], flying: bool = False) -> list[str]:
    """The body of report.html. flying: whether page.html stands beside it."""
    header, rows = stress_table(study)
    start_header, start_rows = start_table(claims)
    drawn = {n: page.figure(out / figure_name(n), f"Fig. {n}: {caption}") for n, caption in CAPTIONS.items()}
    return [
        page.summary(answer(claims), facts(study, claims), [drawn[n] for n in AT_A_GLANCE]),
        page.links([("page.html", "Fly these flights in your browser")]) if flying else "",
        page.paragraph(
            "Das, Lewis, Subbarao: Backstepping Approach for Controlling a Quadrotor Using Lagrange Form Dynamics (2009), "
            f"Section 6, replayed by quadstep {__version__}. Numbers in full: metrics.json, claims.json and the CSV files "
            "next to this page."
        ),
        page.heading("What the paper claims, and what was measured", "claims"),
        page.table(
            ["claim", "the paper's sentence", "measured", "verdict"],
            ([c.name, c.sentence, c.measured, (c.verdict, VERDICT_CLASS[c.verdict])] for c in claims),
            rich,
        ),
        page.heading("The other figures", "figures"),
        *(one for n, one in drawn.items() if n not in AT_A_GLANCE),
        page.heading("The cases in numbers", "cases"),
        page.table(
            ["flight", "RMSE / largest error in x, y, z [mm]", "roll and pitch level from", "largest thrust",
             "total variation of u", "largest torque", "largest weight norm"],
            case_rows(study),
            rich,
        ),
        page.heading("Case 3 from other starts and with other gains of [11]", "starts"),
        page.paragraph("Whether each claim holds for the flight; the paper gives neither the start nor the gains."),
        page.table(start_header, start_rows, rich),
        page.heading("Stress flights: Case 1's path in less time, under more disturbance", "stress"),
        page.paragraph("Position RMSE and largest tilt, or the time and reason of divergence."),
        page.table(header, rows, rich),
        page.heading("Choices made where the paper is silent", "choices"),
        page.table(["what", "chosen", "why"], ([c.what, c.value, c.why] for c in choices()), rich),
    ]  # fmt: skip
