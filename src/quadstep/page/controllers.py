"""The controllers that can fly a mission on the page, each with its sliders and with what theory asks of the gains: the
conditions of the law, recorded as terms.
"""

import contextlib
from collections.abc import Iterator, Mapping
from pathlib import Path

from pydantic import ValidationError

from quadstep.control.registry import controllers as built_in
from quadstep.engines.fly import FlightPlan
from quadstep.interfaces.controller import Controller as Law
from quadstep.interfaces.controller import Measured
from quadstep.interfaces.learning import DeclaredNet
from quadstep.interfaces.model import Model
from quadstep.io.errors import UserError
from quadstep.mission.derived import ControllerSection, section_of
from quadstep.mission.schema import Mission
from quadstep.numbers import Table, flatten, leaf_names, rebuild
from quadstep.page.laws import Laws, widened
from quadstep.page.model import Condition, Controller, identity
from quadstep.page.sliders import sliders
from quadstep.program.assignments import CONSTANT, INPUT, Record
from quadstep.vehicle.paper import State

CHOSEN = {(">", False): "max", (">", True): "min", ("<", False): "min", ("<", True): "max"}
"""What choosing one of two compared numbers comes to; True where they stand the other way round."""


OPERATIONS = frozenset(("+", "-", "*", "/", "negative", "magnitude", "sqrt", "<", "<=", ">", ">=", "where"))
"""What the page can work out; `data/contract.ts` says how."""


def page_conditions(controller: Law, plan: FlightPlan, model: Model) -> tuple[Condition, ...]:
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


GHOSTS = {
    State: ("backstepping", "completed-backstepping", "nested-saturation"),
    Measured: ("geometric", "pid", "rotation-backstepping"),
}
"""Controllers offered beside a mission's own, by what they are told."""


def controllers(
    mission: Mission,
    plan: FlightPlan,
    folder: Path,
    laws: Laws,
    called: str = "",
    rivals: Mapping[str, ControllerSection] | None = None,
) -> list[Controller]:
    """All that can fly this mission, its own first. Raises UserError where its own cannot be held by the page.

    called: its own one's name, if not that of its kind. rivals: the others, by name; those of the package if there are none.
    """
    own = controller(mission.controller, mission, plan, folder, laws)
    result = [renamed(own, called) if called else own]
    for name, section in rivals.items() if rivals else (("", one) for one in ghosts(mission.controller)):
        if laws.room_for_ghosts or rivals:
            with contextlib.suppress(UserError):  # no room for it
                one = controller(section, mission, plan, folder, laws)
                result.append(renamed(one, name) if name else one)
    return result


def renamed(one: Controller, name: str) -> Controller:
    """A controller under a name of its own."""
    return one._replace(id=identity(name, ()), label=name)


def ghosts(own: ControllerSection) -> Iterator[ControllerSection]:
    """The others, with what they have in common with a mission's own controller, else their defaults."""
    measures = own.controller.measures
    for name in GHOSTS.get(measures, tuple(built_in(measures))):
        law = built_in(measures)[name]
        if name != own.type:
            with contextlib.suppress(ValidationError):  # a controller of another kind may mean something else by its keys
                yield section_of(law).model_validate({**in_common(own, law), "type": name})


def in_common(own: ControllerSection, other: type[Law]) -> dict[str, object]:
    """The keys that are given to one controller and mean the same to another."""
    ours, theirs = meanings(own.controller), meanings(other)
    given = own.model_dump(exclude_unset=True)
    return {key: value for key, value in given.items() if key in ours and ours[key] == theirs.get(key)}


def meanings(law: type[Law]) -> Mapping[str, object]:
    """What each key of a controller means."""
    found: dict[str, object] = {key: (gain.unit, gain.meaning) for key, (_, gain) in law.by_key().items()}
    return {**found, "nets": [one for one in law.declarations().values() if isinstance(one, DeclaredNet)]}


def controller(section: ControllerSection, mission: Mission, plan: FlightPlan, folder: Path, laws: Laws) -> Controller:
    """One of them. Raises UserError."""
    built = section.build(mission.modelled, folder)
    gains = widened(built.gains, section.table.seed) if section.table else built.gains
    flown = plan.with_controller(built.law, gains)
    numbers = laws.add(flown)
    conditions = page_conditions(built.law, flown, mission.modelled.model())
    label = section.controller.label or section.type
    return Controller(section.type, label, *numbers, tuple(sliders(section, built.gains)), conditions)
