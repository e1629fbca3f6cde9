"""Figures 3 to 12 of the paper, panel for panel what their captions and the text describe."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from quadstep.interfaces.log import FlightLog
from quadstep.metrics.quantities import position_errors
from quadstep.numbers import vector
from quadstep.report.drawing import FigureJob
from quadstep.report.panel import Panel
from quadstep.report.panels import attitude_panels, input_panels, position_panels
from quadstep.studies.paper.cases import FIGURE_3_ENDS, FIGURE_3_TIME
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
        job(7, case_2.column("t"), position_panels(case_2)),
        job(8, case_2.column("t"), attitude_panels(case_2, ROLL_AND_PITCH)),
        job(9, case_2.column("t"), input_panels(case_2)),
        job(10, new.column("t"), comparison_positions(new, old)),
        job(11, new.column("t"), [both(a, "rad", new, old) for a in ("phi", "theta", "psi")], 1),
        job(12, new.column("t"), [both(name, unit, new, old) for name, unit in inputs]),
    ]


def trajectories() -> tuple[NDArray[np.float64], list[Panel]]:
    """x_d(t) for four final positions in 10 s (Eq. 75), with its first and second derivative."""
    t = np.linspace(0.0, FIGURE_3_TIME, 401)
    path, here = MinimumJerk(), vector(0.0, 0.0, 0.0)
    panels = [Panel("x_d", "m", {}), Panel("x_d rate", "m/s", {}), Panel("x_d second rate", "m/s^2", {})]
    for end in FIGURE_3_ENDS:
        parameters = MinimumJerkParameters(here, vector(end, 0.0, 0.0), 0.0, 0.0, FIGURE_3_TIME)
        rows = [path.reference(float(time), parameters) for time in t]
        values = np.array([(row.position[0], row.velocity[0], row.acceleration[0]) for row in rows])
        for order, panel in enumerate(panels):
            panel.lines[f"to {end:g} m"] = values[:, order]
    return t, panels


def both(name: str, unit: str, new: FlightLog, old: FlightLog) -> Panel:
    """A column of both controllers, with the paper's subscripts: n this paper's, o that of [11]."""
    return Panel(name, unit, {f"{name}_n (adaptive)": new.column(name), f"{name}_o (nested [11])": old.column(name)})


def comparison_positions(new: FlightLog, old: FlightLog) -> list[Panel]:
    """Positions of both controllers with the command, then their errors."""
    errors_new, errors_old = position_errors(new), position_errors(old)
    tracks, misses = [], []
    for i, a in enumerate(("x", "y", "z")):
        panel = both(a, "m", new, old)
        tracks.append(Panel(panel.label, panel.unit, {**panel.lines, f"{a}_d": new.column(f"{a}_d")}))
        misses.append(Panel(f"{a}_d - {a}", "m", {f"{a}_d - {a}_n": errors_new[:, i], f"{a}_d - {a}_o": errors_old[:, i]}))
    return tracks + misses
