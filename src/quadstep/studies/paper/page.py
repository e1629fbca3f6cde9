"""The page of the paper: its cases and the stress flights, with the claims that each of them bears on."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from quadstep.engines.engine import Engine
from quadstep.engines.fly import FlightPlan
from quadstep.interfaces.closed_loop import Outcome
from quadstep.interfaces.log import FlightLog
from quadstep.io.errors import UserError
from quadstep.linear.grade import quick_grade
from quadstep.metrics.registry import AT_REST, Metrics, metric
from quadstep.mission.lagrange import LagrangeMission
from quadstep.page.build import build_page, with_walk
from quadstep.page.flights import ShownFlight
from quadstep.page.model import Cell, ClaimView, Link
from quadstep.page.story import OWN, Story, read_story
from quadstep.studies.paper.cases import (
    STRESS_SCALES,
    STRESS_TIMES,
    PaperStudy,
    StudyPlans,
    case_1,
    case_title,
    fly_study,
    further_flights,
    main_cases,
    plan_study,
    stress_flights,
)
from quadstep.studies.paper.claims import Claim, check_claims, counts

TITLE = "Das, Lewis and Subbarao (2009), re-flown"
PAPER = "“Backstepping Approach for Controlling a Quadrotor Using Lagrange Form Dynamics”"
CASES, VARIANTS, STRESS = "The paper's cases", "Without nets", "Stress flights"

NOTES = {
    "case1": "To (20, 5, 10) m in 40 s. The disturbance stays below 0.0003 N, too little to test the nets: raise it, or "
    "shorten t_f.",
    "case2": "Only x moves; y, z and roll should stay unaffected.",
    "case3-adaptive": "Up by 10 m, starting half a metre off in x and in y, and tilted. Fly nested saturations as a ghost.",
    "case3-nested": "The same flight with the controller of reference [11], Castillo, Lozano and Dzul (2005).",
    "case1-without-nets": "Case 1 with both nets off: 20 times the error, still 72 micrometres.",
    "case3-without-nets": "Case 3 with both nets off: the torque peak is still there.",
}


class Spot(NamedTuple):
    """Where a claim is seen. flights, panels: ids."""

    flights: tuple[str, ...]
    panels: tuple[str, ...]
    sentence: str


def stress_id(duration: float, scale: float, nets: bool) -> str:
    return f"stress-{duration:g}s-x{scale:g}-{'nets' if nets else 'no-nets'}"


STRESS_1 = tuple(stress_id(duration, 1.0, nets) for duration in STRESS_TIMES for nets in (True, False))
STRESS_NETS = tuple(stress_id(duration, scale, True) for duration in STRESS_TIMES for scale in STRESS_SCALES)
BOTH_3 = ("case3-adaptive", "case3-nested")
TURN_NEURONS = "Set the neurons of each net to 8, 10 and 12 and compare the position error; the verdict takes eight seeds."

LOOKS = {
    "rest at the end point": Spot(("case1",), ("position", "thrust"), "The end: velocity and acceleration go to zero."),
    "near-perfect tracking": Spot(("case1",), ("position", "position-error"), "The position error: micrometres."),
    "nonlinearities compensated by the nets": Spot(
        ("case1", "case1-without-nets", *STRESS_1), ("position-error", "weights"),
        "Switch the nets off: Case 1 hardly changes. In the stress flights at scale 1 it does."),
    "angles match their commands": Spot(("case1",), ("attitude", "attitude-error"), "The attitude error."),
    "inputs realisable": Spot(("case1",), ("thrust", "torque", "rotors"), "Thrust, torques and the rotor forces."),
    "tau_psi = 0": Spot(("case1",), ("torque",), "tau_psi compared with tau_theta: small, but not zero."),
    "decoupling in x": Spot(("case2",), ("position-error", "attitude", "torque"), "y, z, phi and tau_phi do not respond."),
    "decoupling in y and z": Spot(("case2-y", "case2-z"), ("position-error", "torque"), "The axes that should not move."),
    "better z tracking than [11]": Spot(BOTH_3, ("position", "position-error"), "z_d - z of both controllers."),
    "smaller x and y error than [11]": Spot(BOTH_3, ("position-error",), "x and y, from half a metre off."),
    "faster attitude settling than [11]": Spot(BOTH_3, ("attitude",), "When roll and pitch become level. Move the start."),
    "smoother thrust than [11]": Spot(BOTH_3, ("thrust",), "u of both. Move the start and the gains a_z."),
    "larger transients that vanish": Spot(BOTH_3, ("attitude", "torque"), "The first second."),
    "transients caused by the nets": Spot(
        ("case3-adaptive", "case3-without-nets"), ("torque", "weights"), "The first second, with and without nets."),
    "a wide range of nonlinearities": Spot(STRESS_NETS, ("position", "weights"), "When each flight is lost, and why."),
    "8 neurons are worse than 10": Spot(("case1", stress_id(6.0, 1.0, True)), ("position-error",), TURN_NEURONS),
    "12 neurons are no better than 10": Spot(("case1", stress_id(6.0, 1.0, True)), ("position-error",), TURN_NEURONS),
}  # fmt: skip
"""By the name of the claim."""


def view(claim: Claim) -> ClaimView:
    look = LOOKS.get(claim.name, Spot((), (), ""))
    return ClaimView(claim.name, claim.sentence, claim.measured, claim.verdict, look.flights, look.sentence, look.panels)


def paper_page(
    study: PaperStudy, plans: StudyPlans, claims: Sequence[Claim], links: Sequence[Link] = (),
    story: Story | None = None, engine: Engine = Engine.LANES,
) -> str:  # fmt: skip
    """The page of a study that was flown, with a walk if there is one. Raises UserError."""
    views = [view(claim) for claim in claims]
    flown = flown_study(study, plans, views)
    said = f"Of {len(claims)} claims that {PAPER} makes about its simulations, {counts(claims)}. "
    intro = f"{said}Gains and other values missing from the paper are ours.".partition(counts(claims))
    if story is None:
        return build_page(TITLE, intro, flown, views, links)
    flown, walk = with_walk(flown, story, engine, quick_grade)
    return build_page(TITLE, intro, flown, views, links, walk)


def write_paper_page(path: Path, study: PaperStudy, plans: StudyPlans, claims: Sequence[Claim]) -> bool:
    """The page beside a study's report, with the package's walk; false where it was installed without the front end."""
    try:
        links = [Link("Report: every table and figure", "report.html")]
        path.write_text(paper_page(study, plans, claims, links, read_story(OWN)), encoding="utf-8")
    except UserError:
        return False
    return True


def fly_paper(engine: Engine = Engine.LANES, story: Story | None = None) -> str:
    """The page of the paper, with its flights flown here, and a walk: the package's if none is given. Raises UserError."""
    plans = plan_study()
    study = fly_study(plans, engine)
    return paper_page(study, plans, check_claims(study), story=story or read_story(OWN), engine=engine)


def flown_study(study: PaperStudy, plans: StudyPlans, claims: Sequence[ClaimView]) -> list[ShownFlight]:
    found: list[ShownFlight] = []

    def add(
        name: str, title: str, group: str, mission: LagrangeMission, plan: FlightPlan, metrics: Metrics, log: FlightLog | None,
        at_rest: LagrangeMission | None = None,
    ) -> None:  # fmt: skip
        concerned = tuple(number for number, claim in enumerate(claims) if name in claim.flights)
        found.append(
            ShownFlight(name, title, group, mission, plan, log or as_reported(plan, metrics),
                {**metrics, AT_REST: dict(quick_grade(at_rest or mission))}, note=NOTES.get(name, ""), claims=concerned,
                warnings=plan.warnings)
        )  # fmt: skip

    for key, mission in main_cases().items():
        title = case_title(key, mission)
        add(key.replace("_", "-"), title, CASES, mission, plans.cases[key], study.cases[key], study.logs[key])
    for key, mission in further_flights().items():
        name, title = key.replace(" ", "-"), key.replace("case", "Case ")
        add(name, title, VARIANTS, mission, plans.further[key], study.further[key], None)
    for (duration, scale, nets), mission in stress_flights().items():
        title = f"path of {duration:g} s, disturbance × {scale:g}, nets {'on' if nets else 'off'}"
        case = (duration, scale, nets)
        add(stress_id(*case), title, STRESS, mission, plans.stress[case], study.stress[case], None,
            case_1() if nets else further_flights()["case1 without nets"])  # fmt: skip
        cell = Cell(f"Nets {'on' if nets else 'off'}", f"× {scale:g}", f"{duration:g} s", "disturbance", "time t_f")
        found[-1] = found[-1]._replace(cell=cell)
    return found


def as_reported(plan: FlightPlan, metrics: Metrics) -> FlightLog:
    """How a flight of which only metrics are kept ended, without its rows."""
    columns, outcome = plan.loop.columns, Outcome[str(metrics["outcome"]).upper()]
    return FlightLog(columns, np.zeros((0, len(columns))), outcome, metric(metrics, "ended[s]"), None)
