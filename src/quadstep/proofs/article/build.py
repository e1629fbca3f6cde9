"""The article as one HTML file: its text with formulas set, still figures for paper, and the law that its figures fly."""

import json
import re
from collections.abc import Callable, Mapping, Sequence
from importlib.resources import files
from typing import Any

from quadstep.control.inversion import invert_force
from quadstep.interfaces.closed_loop import Outcome
from quadstep.io.errors import UserError
from quadstep.io.version import __version__
from quadstep.mission.lagrange import LagrangeMission
from quadstep.numbers import Number, Vector, flatten
from quadstep.page.build import fill
from quadstep.page.emit import emit, library
from quadstep.page.flights import words
from quadstep.page.model import numbers_text
from quadstep.page.writing import Output, Writer
from quadstep.program.assignments import Record
from quadstep.proofs.article.insight import PERIOD, SHOWN, ball, insight_row, printed_roll
from quadstep.report.mathml import typeset
from quadstep.report.symbols import rich
from quadstep.vehicle.paper import thrust_direction

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
"""Period of the figures' logs [s]."""

FLIGHTS: Mapping[str, Mapping[str, Any]] = {
    "nested": {**STAY, "start": {"position": [-3.0, 0.0, 0.0]}, "simulation": {"duration": 8.0, "log_period": LOGGED}},
    "sliding": {**STAY, "start": {"position": [-1.5, 0.0, 0.0]}, "simulation": {"duration": 8.0, "log_period": LOGGED}},
    "net": {
        "path": {"type": "minimum-jerk", "end": [20.0, 5.0, 10.0], "duration": 6.0},
        "controller": {"type": "backstepping"},
        "simulation": {"duration": 10.0, "log_period": LOGGED},
    },
    "lyapunov": {**STAY, **SMOOTH, "simulation": {"duration": 12.0, "log_period": LOGGED}},
}
"""The missions that the figures begin with, by the figure's id."""

QUOTED = ("T_eta", "Eq. 52", "Eq. 13", "Eq. 26", "Eq. 63", "compact set")
"""Rows of `quadstep verify` that the text shows, with their counterexamples."""


def missions() -> dict[str, LagrangeMission]:
    return {name: LagrangeMission.model_validate(one) for name, one in FLIGHTS.items()}


def article() -> str:
    """The HTML. Raises UserError where the package was installed without its front end."""
    data, script = law_and_data()
    return fill(template().replace(BODY, body()), TITLE, data, script)


def template() -> str:
    """The built front end. Raises UserError."""
    try:
        return files("quadstep.page").joinpath("assets", "article.html").read_text(encoding="utf-8")
    except OSError:
        raise UserError("the article's front end is not part of this installation; build it: `make frontend`") from None


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
    made = [
        function("invert", ("x", "y", "z"), lambda x, y, z: invert_force(Vector((x, y, z)))),
        function("printedRoll", ("x", "y", "z"), lambda x, y, z: [printed_roll((x, y, z))]),
        function("direction", ("theta", "phi"), lambda theta, phi: [*thrust_direction(Vector((0.0, theta, phi)))]),
        function("ball", ("kappa", "weights", "error", "gain"), ball),
    ]
    names = ",".join(("invert", "printedRoll", "direction", "ball"))
    return "\n".join(["(()=>{'use strict';", library(), *made, f"return{{{names}}}}})()"])


def function(name: str, arguments: Sequence[str], law: Callable[..., Sequence[Number]]) -> str:
    """A function of the package in JavaScript; it returns an array."""
    record = Record()
    results = law(*map(record.input, arguments))
    outputs = [Output(f"result[{place}]", record.at(one)) for place, one in enumerate(results)]
    (text,) = Writer(record, ()).functions(outputs)
    return f"function {name}({','.join(arguments)}){{const result=[];{text}return result}}"


def body() -> str:
    """The text, with formulas, still figures and what `quadstep verify` found in their places."""
    facts = json.loads(read("facts.json"))
    values = {
        "rows": str(facts["rows"]),
        "checks": f"{facts['checks']:,}",
        "wrong": str(len(facts["wrong"])),
        "version": __version__,
        "errata": errata({name: facts["wrong"][name] for name in QUOTED}),
    }

    def put(found: re.Match[str]) -> str:
        kind, _, name = found[1].partition(" ")
        return still(name) if kind == "still" else values[kind]

    return re.sub(r"\{\{([\w -]+)\}\}", put, typeset(read("text.html"), around=str))


def read(name: str) -> str:
    return files(HERE).joinpath(name).read_text(encoding="utf-8")


def still(name: str) -> str:
    """A figure before anybody touches it, for paper and readers without JavaScript; nothing if it was not drawn."""
    try:
        return read(f"stills/{name}.svg")
    except OSError:
        return ""


def errata(wrong: Mapping[str, Sequence[str]]) -> str:
    """A table of what is wrong: where, what is printed, what is right, and the numbers that show it."""
    columns = ("where", "printed", "what is wrong, what is right", "shown by")
    header = "".join(f'<th scope="col">{text}</th>' for text in columns)
    rows = "".join(
        f'<tr><th scope="row">{rich(name)}</th>{"".join(f"<td>{rich(cell)}</td>" for cell in cells)}</tr>'
        for name, cells in wrong.items()
    )
    table = f"<table><thead><tr>{header}</tr></thead><tbody>{rows}</tbody></table>"
    return f'<div class="scroll" tabindex="0" role="region" aria-label="Errors of the print">{table}</div>'
