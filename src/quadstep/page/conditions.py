"""What theory asks of the gains, as the page works it out: the controller's own conditions, recorded as terms."""

import contextlib

from quadstep.engines.fly import FlightPlan
from quadstep.interfaces.controller import Controller
from quadstep.interfaces.model import Model
from quadstep.io.errors import UserError
from quadstep.numbers import Table, flatten, leaf_names, rebuild
from quadstep.page.model import Condition
from quadstep.program.assignments import CONSTANT, INPUT, Record

CHOSEN = {(">", False): "max", (">", True): "min", ("<", False): "min", ("<", True): "max"}
"""What choosing one of two compared numbers comes to; True where they stand the other way round."""


OPERATIONS = frozenset(("+", "-", "*", "/", "negative", "magnitude", "sqrt", "<", "<=", ">", ">=", "where"))
"""What the page can work out; `data/contract.ts` says how."""


def page_conditions(controller: Controller, plan: FlightPlan, model: Model) -> tuple[Condition, ...]:
    """The conditions of a controller on the gains of a plan, as far as the page has the operations that they take.

    model: of the vehicle; what the plan holds of it varies.
    """
    if not isinstance(plan.parameters.gains, controller.Gains):  # prepared: the page has only what came of the gains
        return ()
    record = Record()
    named = zip(leaf_names(plan.parameters), flatten(plan.parameters), strict=True)
    inputs = [leaf if isinstance(leaf, Table) else record.input(name) for name, leaf in named]
    parameters = rebuild(plan.parameters, iter(inputs))
    body = plan.loop.plant.body(parameters)
    model = model._replace(mass=body.mass, inertia=body.inertia, gravity=body.gravity)
    found = []
    for one in controller.conditions(parameters.gains, model):
        with contextlib.suppress(UserError):
            left, right = (term(record, record.at(side)) for side in (one.left, one.right))
            found.append(Condition(one.text, left, right, one.or_equal, one.source))
    return tuple(found)


def term(record: Record, place: int) -> object:
    """A recorded number as a term. Raises UserError for an operation that the page does not know."""
    operation, operands, text = record.nodes[place]
    if operation == INPUT:
        return {"name": text}
    if operation == CONSTANT:
        return float(text.strip("()"))
    if operation == "where":
        comparison, *chosen = operands
        relation, compared, _ = record.nodes[comparison]
        swapped = list(compared) != chosen
        if (relation, swapped) in CHOSEN and sorted(compared) == sorted(chosen):
            return {"op": CHOSEN[relation, swapped], "of": [term(record, one) for one in chosen]}
    if operation not in OPERATIONS:
        raise UserError(f"a condition on its gains asks for {operation!r}, which the page cannot work out")
    return {"op": operation, "of": [term(record, one) for one in operands]}
