"""Figures 3 to 12 of the paper, panel for panel what their captions and the text describe, and what each of them shows."""

import re
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from quadstep.interfaces.log import FlightLog
from quadstep.metrics.quantities import position_errors
from quadstep.numbers import vector
from quadstep.report import units
from quadstep.report.drawing import FigureJob
from quadstep.report.panel import DESIRED, Panel
from quadstep.report.panels import attitude_panels, input_panels, position_panels
from quadstep.studies.paper.cases import FIGURE_3_ENDS, FIGURE_3_TIME
from quadstep.studies.paper.claims import Claim
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
    4: ("near-perfect tracking",),
    5: ("angles match their commands",),
    6: ("inputs realisable",),
    7: "The largest error in x is {error}.",
    8: "Pitch reaches {pitch:.2g}°, and its largest error is {miss:.2g} mrad.",
    9: "The thrust rises by at most {rise}, and the pitch torque reaches {torque}.",
    10: ("better z tracking than [11]", "smaller x and y error than [11]"),
    11: ("faster attitude settling than [11]",),
    12: ("smoother thrust than [11]", "larger transients that vanish"),
}
"""What a figure shows: in words with `extremes` of Case 2, or the names of claims, whose first measured sentence is said."""

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

FLAT = 1e-6
"""Change of a line below which a panel of Case 2 is named rather than drawn, in SI units."""


def of_case_2(log: FlightLog) -> dict[int, tuple[list[Panel], list[str]]]:
    """By figure: the panels in which something moves, and the names of the others."""
    found = {}
    for number, panels in ((7, position_panels(log)), (8, attitude_panels(log, ROLL_AND_PITCH)), (9, input_panels(log))):
        still = [one.label for one in panels if max(map(np.ptp, one.lines.values())) < FLAT]
        found[number] = [one for one in panels if one.label not in still], still
    return found


ROLL_AND_PITCH = ("phi", "theta")
SOON = 4.0
"""Until when the inputs of Case 3 are drawn [s]: later they hardly change."""

BOTH = ("paper’s controller", "[11]")

INPUTS = (("u", "N"), ("tau_phi", "N m"), ("tau_theta", "N m"), ("tau_psi", "N m"))


def figure_jobs(logs: Mapping[str, FlightLog]) -> list[FigureJob]:
    """fig03 to fig12, from the logs of the cases by file name."""
    case_1, case_2 = logs["case1"], logs["case2"]
    new, old = logs["case3_adaptive"], logs["case3_nested"]
    soon = slice(int(np.searchsorted(new.column("t"), SOON, "right")))

    def job(number: int, t: NDArray[np.float64], panels: list[Panel], columns: int = 2) -> FigureJob:
        return FigureJob(f"fig{number:02d}", f"Fig. {number}  {CAPTIONS[number]}", t, panels, columns)

    return [
        job(3, *trajectories(), 1),
        job(4, case_1.column("t"), position_panels(case_1)),
        job(5, case_1.column("t"), attitude_panels(case_1, ROLL_AND_PITCH)),
        job(6, case_1.column("t"), input_panels(case_1)),
        *(job(number, case_2.column("t"), panels, 1) for number, (panels, _) in of_case_2(case_2).items()),
        job(10, new.column("t"), comparison_positions(new, old)),
        job(11, new.column("t"), [both_controllers(a, "rad", new, old) for a in ("phi", "theta", "psi")], 1),
        job(12, new.column("t")[soon], [both_controllers(name, unit, new, old, soon) for name, unit in INPUTS]),
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


def both_controllers(name: str, unit: str, new: FlightLog, old: FlightLog, rows: slice = slice(None)) -> Panel:
    """A column of both controllers."""
    return Panel(name, unit, {who: log.column(name)[rows] for who, log in zip(BOTH, (new, old), strict=True)})


def comparison_positions(new: FlightLog, old: FlightLog) -> list[Panel]:
    """Positions of both controllers with the command, then their errors."""
    errors_new, errors_old = position_errors(new), position_errors(old)
    tracks, misses = [], []
    for i, a in enumerate(("x", "y", "z")):
        panel = both_controllers(a, "m", new, old)
        tracks.append(Panel(panel.label, panel.unit, {**panel.lines, DESIRED: new.column(f"{a}_d")}))
        misses.append(Panel(f"{a}_d - {a}", "m", dict(zip(BOTH, (errors_new[:, i], errors_old[:, i]), strict=True))))
    return tracks + misses


def extremes(case_2: FlightLog) -> dict[str, object]:
    """The largest values that Figs 7 to 9 show."""
    pitch, wanted, thrust, torque = (case_2.column(name) for name in ("theta", "theta_d", "u", "tau_theta"))
    return {
        "error": units.quantity(float(np.abs(position_errors(case_2)[:, 0]).max()), "m"),
        "pitch": np.degrees(np.abs(pitch).max()),
        "miss": 1e3 * np.abs(wanted - pitch).max(),
        "rise": units.quantity(float(thrust.max()) - 9.81, "N", 2),
        "torque": units.quantity(float(np.abs(torque).max()), "N m"),
    }


def to_see(number: int, claims: list[Claim], case_2: FlightLog) -> str:
    """What a figure shows, in sentences."""
    shown = TO_SEE[number]
    said = (
        [shown.format(**extremes(case_2))]
        if isinstance(shown, str)
        else [f"{re.split(r'; |[.] |[.]$', one.measured)[0]}." for name in shown for one in claims if one.name == name]
    )
    still = of_case_2(case_2).get(number, ([], []))[1]
    said += [f"Not drawn, because they change by less than {FLAT:g} in SI units: {units.listed(still)}."] if still else []
    said += [f"Not drawn, because it changes by less than {FLAT:g} rad: psi."] * (number == 5)
    said += [f"Drawn are the first {SOON:g} s."] * (number == 12)
    return " ".join([*said, f"The paper says of its figure: {PRINTED[number]}."])
