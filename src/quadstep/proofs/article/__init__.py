"""The article as one HTML file: its text with formulas set, still figures for paper, and the law that its figures fly.

Beside a flight's log they show what the paper's law wants on its way, and the terms of L and its rate: one row of numbers per
log row, from the functions that fly (`page/laws.py` records them), in the order of `SHOWN`; the net's numbers follow.
"""

import json
import re
from collections.abc import Callable, Mapping, Sequence
from importlib.resources import files
from typing import Any, cast

from quadstep.control.backstepping import (
    Backstepping,
    BacksteppingGains,
    BacksteppingMemory,
    attitude_errors,
    position_loop,
    torque_basis,
)
from quadstep.control.filters import command_filter
from quadstep.control.vectoring import invert_force
from quadstep.engines.loop import Cycle, Loop
from quadstep.interfaces.closed_loop import ClosedLoop, Outcome
from quadstep.interfaces.controller import Command
from quadstep.interfaces.learning import output
from quadstep.io import __version__
from quadstep.mission.lagrange import LagrangeMission
from quadstep.numbers import Number, Vector, atan2, flatten, where
from quadstep.page.build import fill, template
from quadstep.page.flights import words
from quadstep.page.laws import emit, library, net_row
from quadstep.page.model import numbers_text
from quadstep.page.writing import Output, Writer
from quadstep.program.assignments import Record
from quadstep.proofs.certify.certificate import error_radius
from quadstep.report.mathml import dollars, typeset
from quadstep.report.units import rich
from quadstep.vehicle.lagrange import Lagrange, Parameters
from quadstep.vehicle.paper import State, coriolis, effective_inertia, thrust_direction

PERIOD = 0.002
"""Control period of the article's flights [s]."""

XYZ, ANGLES = ("x", "y", "z"), ("psi", "theta", "phi")

SHOWN: tuple[str, ...] = (
    *(f"e1_{axis}" for axis in XYZ),
    *(f"e1_dot_{axis}" for axis in XYZ),
    *(f"r1_{axis}" for axis in XYZ),
    *(f"velocity_{axis}" for axis in XYZ),
    *(f"force_{axis}" for axis in XYZ),
    *(f"made_{axis}" for axis in XYZ),
    *(f"e2_{angle}" for angle in ANGLES),
    "L_position", "L_attitude", "L_integrals",
    "rate_position", "rate_attitude", "rate_unknown", "rate_coupling",
)  # fmt: skip
"""e1 [m], e1_dot, r1 [m/s] (Eqs 11, 12). velocity: at which r1 would be 0 [m/s]. force: F_d_hat (Eq. 24), made: what
thrust and attitude make of it [N]. e2 [rad] (Eq. 27). Then the parts of L without the weights (Eq. 55) [J], and of its rate
[W]: -r1^T (K_r1 - m Lambda_1) r1, -r2^T (K_r2 - J Lambda_2) r2, what the nets still miss of Eqs 22 and 33 times r1 and r2, and
r1^T (F_d_hat - u n(eta)), the coupling that Eqs 26 and 56 leave out. These four together are the rate of those three.
"""


def insight_row(loop: ClosedLoop, cycle: object, p: object, time: Number) -> list[Number]:
    """Those numbers at time t [s], then `net_row`'s; the loop is the paper's law on the paper's plant."""
    assert isinstance(loop, Loop)
    assert isinstance(loop.plant, Lagrange)
    assert isinstance(loop.controller, Backstepping)
    flown, parameters = cast(Cycle, cycle), cast(Parameters, p)
    state, memory = cast(State, flown.state), cast(BacksteppingMemory, flown.memory)
    gains, vehicle, wanted = cast(BacksteppingGains, parameters.gains), parameters.vehicle, loop.reference(time, parameters)
    on = where(time >= gains.learning_start, 1.0, 0.0)
    asked = cast(Command, flown.command)
    tilt = Vector([*asked.desired_attitude][1:])
    filtered = command_filter(
        memory.filtered, tilt, gains.filter_frequency, -PERIOD
    )  # as the law had it: its memory is a sample ahead
    e1, r1, r2 = wanted.position - state.position, asked.r1, asked.r2
    e2, _ = attitude_errors(gains, filtered, state, wanted)
    mu_1 = position_loop(gains, memory, state, wanted, on).mu_1
    force = asked.thrust * thrust_direction(asked.desired_attitude)
    made = asked.thrust * thrust_direction(state.attitude)

    inertia = effective_inertia(state.attitude, vehicle.inertia, loop.plant.kinematics)
    turning = coriolis(state.attitude, state.rates, vehicle.inertia, loop.plant.kinematics)
    tilting = (memory.filtered.rate - filtered.rate) * (1.0 / PERIOD)  # the mean over the sample, as the torque is held
    eta_dd = Vector((wanted.yaw_acceleration, *tilting))
    rates = Vector((wanted.yaw_rate, *filtered.rate))
    pushed, twisted = loop.plant.disturbed(parameters, state, time)
    missing_1 = -pushed - on * output(memory.weights_1, mu_1)  # Eq. 22 less Eq. 23
    slope = gains.slope_2
    target_2 = inertia @ (eta_dd - slope * (slope * e2)) - twisted + turning @ (rates + slope * e2)  # Eq. 33
    missing_2 = target_2 - on * output(memory.weights_2, torque_basis(gains, state, r1, r2))
    stored = memory.integral_1 @ (gains.integral_1 * memory.integral_1)
    stored = stored + memory.integral_2 @ (gains.integral_2 * memory.integral_2)
    return [
        *e1, *(wanted.velocity - state.velocity), *r1, *(state.velocity + r1), *force, *made, *e2,
        0.5 * vehicle.mass * (r1 @ r1), 0.5 * (r2 @ (inertia @ r2)), 0.5 * stored,
        -(r1 @ ((gains.gain_1 - vehicle.mass * gains.slope_1) * r1)),
        -(r2 @ (gains.gain_2 * r2 - inertia @ (slope * r2))),
        r1 @ missing_1 + r2 @ missing_2,
        r1 @ (force - made),
        *net_row(loop, cycle, p, time),
    ]  # fmt: skip


def printed_roll(force: Sequence[Number]) -> Number:
    """phi_d [rad] as Eq. 52 prints it, atan(f_y / f_z): wrong for f_z < 0. Without f_z it is taken as f_z = 0+."""
    _, f_y, f_z = force
    return atan2(where(f_z < 0.0, -f_y, f_y), where(f_z < 0.0, -f_z, f_z))


def ball(kappa: Number, weights: Number, error: Number, least_gain: Number) -> tuple[Number, Number]:
    """(b_r, b_r as Eq. 63 prints it), of |W| <= weights, |eps_v| <= error and |K_v|_min."""
    right, printed = (cast(Number, error_radius(weights, error, one, 1.0)) / least_gain for one in (kappa, 1.0))
    return right, printed


HEADING = re.compile(r'id="([\w-]+)">(?:\n<h2>)?([^<\n]+)</h2>')
QUOTE = re.compile(r"(?<!\w)'(.+?)'(?!\w)")
TITLE = "Backstepping a quadrotor, explained"
HERE = "quadstep.proofs.article"
BODY = "<!--ARTICLE-->"

STAY = {
    "path": {"type": "minimum-jerk", "end": [0.0, 0.0, 0.0], "duration": 6.0},
    "controller": {"type": "backstepping", "nets": {"enabled": False}},
    "disturbance": {"scale": 0.0},
}
"""To hold a place in still air, nets off."""

SMOOTH = {"start": {"position": [-1.0, 0.5, 0.0], "velocity": [2 / 3, -1 / 3, 0.0]}}
"""Off the place and moving towards it, so that Eq. 24 asks for no lean at first: r1 = Lambda_1^2 e1 / K_r1."""

LOGGED = 0.02
"""Period of the figures' logs [s], but for Figure 5: the study's inner loop settles in about that."""

FLIGHTS: Mapping[str, Mapping[str, Any]] = {
    "nested": {**STAY, "start": {"position": [-3.0, 0.0, 0.0]}, "simulation": {"duration": 4.0, "log_period": LOGGED}},
    "sliding": {**STAY, "start": {"position": [-1.5, 0.0, 0.0]}, "simulation": {"duration": 5.0, "log_period": LOGGED}},
    "net": {"path": {"type": "minimum-jerk", "end": [20.0, 5.0, 10.0], "duration": 6.0},
        "controller": {"type": "backstepping"}, "simulation": {"duration": 10.0, "log_period": LOGGED}},
    "lyapunov": {**STAY, **SMOOTH, "simulation": {"duration": 7.0, "log_period": PERIOD}},
}  # fmt: skip
"""The missions that the figures begin with, by the figure's id."""

QUOTED = ("Eq. 26", "Eq. 63", "Eq. 52", "Eq. 13", "T_eta")
"""Rows of `quadstep verify` that the text shows, with their counterexamples."""


def missions() -> dict[str, LagrangeMission]:
    return {name: LagrangeMission.model_validate(one) for name, one in FLIGHTS.items()}


def article() -> str:
    """The HTML. Raises UserError where the package was installed without its front end."""
    data, script = law_and_data()
    return fill(template("article").replace(BODY, body()), TITLE, data, script)


def law_and_data() -> tuple[dict[str, object], str]:
    """What the figures are told, and the JavaScript of the one law that all of them fly, with four functions beside it."""
    plans = {name: mission.plan() for name, mission in missions().items()}
    first = plans["nested"]
    law = emit(first.loop, first.parameters, first.start, insight_row)
    assert all(plan.loop == first.loop and plan.ticks.step * plan.ticks.every[0] == PERIOD for plan in plans.values())
    neurons = len(first.parameters.gains.weights_1)
    data: dict[str, object] = {
        "format": 1,
        "version": __version__,
        "names": law.names,
        "starts": law.starts,
        "columns": law.columns,
        "shown": [*SHOWN, *(f"net_{place}" for place in range(4 * neurons + 6))],
        "neurons": neurons,
        "outcomes": [words(outcome) for outcome in Outcome],
        "flights": {
            name: {
                "parameters": numbers_text([float(one) for one in flatten(plan.parameters)]),
                "start": numbers_text([float(one) for one in flatten(plan.start)]),
                "ticks": plan.ticks._asdict(),
            }
            for name, plan in plans.items()
        },
    }
    return data, f"globalThis.quadstepLaws={{article:{law.text},tools:{tools()}}};"


def tools() -> str:
    """The package's functions that figures call by themselves, as a JavaScript object."""
    laws: dict[str, tuple[Sequence[str], Callable[..., Sequence[Number]]]] = {
        "invert": ("xyz", lambda x, y, z: invert_force(Vector((x, y, z)))),
        "printedRoll": ("xyz", lambda x, y, z: [printed_roll((x, y, z))]),
        "direction": (("theta", "phi"), lambda theta, phi: [*thrust_direction(Vector((0.0, theta, phi)))]),
        "ball": (("kappa", "weights", "error", "gain"), ball),
    }
    made = [function(name, *one) for name, one in laws.items()]
    return "\n".join(["(()=>{'use strict';", library(), *made, f"return{{{','.join(laws)}}}}})()"])


def function(name: str, arguments: Sequence[str], law: Callable[..., Sequence[Number]]) -> str:
    """A function of the package in JavaScript; it returns an array."""
    record = Record()
    results = law(*map(record.input, arguments))
    outputs = [Output(f"result[{place}]", record.at(one)) for place, one in enumerate(results)]
    (text,) = Writer(record, ()).functions(outputs)
    return f"function {name}({','.join(arguments)}){{const result=[];{text}return result}}"


def body() -> str:
    """The text, with formulas, still figures and what `quadstep verify` found in their places."""
    facts, text = json.loads(read("facts.json")), read("text.html")
    values = {
        "contents": "".join(f'<li><a href="#{name}">{said}</a></li>' for name, said in HEADING.findall(text)),
        "rows": str(facts["rows"]),
        "checks": f"{facts['checks']:,}",
        "wrong": str(len(facts["wrong"])),
        "version": __version__,
        "errata": errata({name: facts["wrong"][name] for name in QUOTED}),
    }

    def put(match: re.Match[str]) -> str:
        kind, _, name = match[1].partition(" ")
        return still(name) if kind == "still" else values[kind]

    return re.sub(r"\{\{([\w -]+)\}\}", put, typeset(text, around=str))


def read(name: str) -> str:
    return files(HERE).joinpath(name).read_text(encoding="utf-8")


def still(name: str) -> str:
    """A figure before anybody touches it, for paper and readers without JavaScript; nothing if it was not drawn."""
    try:
        return read(f"stills/{name}.svg")
    except OSError:
        return ""


def errata(wrong: Mapping[str, Sequence[str]]) -> str:
    """A table of what is wrong: where, what is printed, and what is right, with the numbers that show it."""
    columns = ("where", "printed", "what is wrong, what is right")
    header = "".join(f'<th scope="col">{text}</th>' for text in columns)
    wrong = {name: [QUOTE.sub("“\\1”", cell) for cell in cells] for name, cells in wrong.items()}
    rows = "".join(
        f'<tr><th scope="row">{rich(name)}</th><td>{printed}</td>'
        f"<td>{right} <details><summary>Shown by</summary>{shown}</details></td></tr>"
        for name, cells in wrong.items()
        for printed, right, shown in [[typeset(dollars(cell)) for cell in cells]]
    )
    table = f"<table><thead><tr>{header}</tr></thead><tbody>{rows}</tbody></table>"
    return f'<div class="scroll" tabindex="0" role="region" aria-label="Errors of the print">{table}</div>'
