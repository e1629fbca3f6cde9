"""The controllers that can fly a mission on the page, each with its sliders and with what theory asks of the gains: the
conditions of the law, recorded as terms.
"""

import contextlib
import math
from collections.abc import Iterator, Mapping
from operator import attrgetter
from pathlib import Path

from pydantic import ValidationError

from quadstep.control.registry import controllers as built_in
from quadstep.engines.fly import FlightPlan
from quadstep.interfaces.controller import Controller as Law
from quadstep.interfaces.controller import Measured
from quadstep.interfaces.gain import AXES, BELIEF, GAINS, NETS, Gain, declared
from quadstep.interfaces.learning import DeclaredNet, LearningStart
from quadstep.interfaces.plant import Model
from quadstep.io.errors import UserError
from quadstep.mission.derived import ControllerSection, section_of
from quadstep.mission.schema import Mission
from quadstep.numbers import Table, flatten, in_matrix, leaf_names, rebuild
from quadstep.page.controls import (
    POSITIVE,
    control,
    from_zero,
    grouped,
    moved_start,
    number_sliders,
    one,
    parameter,
    path_controls,
    slider,
    wind_controls,
)
from quadstep.page.laws import NEURONS, Laws, widened
from quadstep.page.model import Component, ConditionData, Control, ControllerData, identity
from quadstep.program.assignments import CONSTANT, INPUT, Record
from quadstep.vehicle.paper import State

MOST_SLIDERS = 60
ROOM_FOR_GHOSTS = 800_000
"""Characters of laws up to which controllers are added beside the missions' own."""

LEARNING, DAMPING = "Learning rate of net {} (Eq. 54).", "Damping of the weights of net {} (Eq. 54)."
STARTING = "When both nets switch on."
UNDECLARED = "A number of this controller, which does not say what it means."


def gain_sliders(declarations: Mapping[str, object], gains: object) -> list[Control]:
    named = ((name, gain) for name, gain in declarations.items() if isinstance(gain, Gain))
    return [slider(gain, attrgetter(name)(gains), f"gains.{name}") for name, gain in named]


def declared_controls(mission: Mission, plan: FlightPlan) -> list[Control]:
    """Path, vehicle and start of a mission for a plant that declares its numbers."""
    return [
        *grouped("Path", *path_controls(mission, plan.ticks)),
        *grouped("Vehicle", *number_sliders(plan.parameters.vehicle, "vehicle")),
        *grouped("Wind", *(wind_controls(plan.parameters.wind) if plan.loop.air else [])),
        *grouped("Start", moved_start(plan.loop.plant.axes)),
    ]


def net_sliders(declarations: Mapping[str, object], gains: object, section: ControllerSection) -> list[Control]:
    """Both nets: on or off, how large, how fast they learn."""
    nets, found = section.table, []
    if nets is None:
        return []
    most = max(NEURONS, nets.neurons)
    for name in (name for name, start in declarations.items() if isinstance(start, LearningStart)):
        never = parameter(f"gains.{name}", 0.0, 1, math.inf)
        found += [
            from_zero("nets_start", "nets switch on at", "s", one(nets.start, parameter(f"gains.{name}")), 20.0, STARTING),
            Control(
                "nets", "nets", "-", NETS, "Whether the two nets learn and act.", "toggle", "linear", 0, 1, 0, 1, 1,
                (Component("", float(nets.enabled), (never,)),),
            ),
            Control(
                "neurons", "neurons of each net", "-", NETS, "Neurons in each net's hidden layer.", "neurons", "linear",
                1, most, 1, most, 1, (Component("", nets.neurons, ()),),
            ),
        ]  # fmt: skip
    for symbol, field, end, hint in (("F", "learning_rate", 50.0, LEARNING), ("kappa", "damping", 0.2, DAMPING)):
        for name, net in declarations.items():
            if isinstance(net, DeclaredNet):
                place, label = f"{name}.{field}", f"{symbol}{net.number}"
                value = one(attrgetter(place)(gains), parameter(f"gains.{place}"))
                found.append(from_zero(label, label, "-", value, end, hint.format(net.number)))
    return grouped(NETS, *found)


def sliders(section: ControllerSection, gains: object) -> list[Control]:
    """All of a controller's, by heading: gains, then nets, then what it believes."""
    declarations = section.controller.declarations()
    if not isinstance(gains, section.controller.Gains):  # prepared
        return sliders_of(gains)
    found = [*net_sliders(declarations, gains, section), *gain_sliders(declarations, gains)]
    return sorted(found, key=lambda control: {NETS: 1, BELIEF: 2}.get(control.group, 0))


def sliders_of(gains: object) -> list[Control]:
    """Of gains whose controller is not known: as they declare, if they do."""
    try:
        return gain_sliders(declared(type(gains)), gains)
    except TypeError:
        return plain_sliders(gains)


def plain_sliders(gains: object) -> list[Control]:
    """A slider for every number or vector of gains that declare nothing, matrices left out, if they are not too many."""
    vectors: dict[str, list[Component]] = {}
    for name, leaf, entry in zip(leaf_names(gains), flatten(gains), in_matrix(gains), strict=True):
        if entry or not isinstance(leaf, float | int) or not math.isfinite(leaf):
            continue
        head, _, tail = name.rpartition(".")
        whole, label = (head, AXES[int(tail)] if int(tail) < len(AXES) else tail) if head and tail.isdigit() else (name, "")
        vectors.setdefault(whole, []).append(Component(label, float(leaf), (parameter(f"gains.{name}"),)))
    if len(vectors) > MOST_SLIDERS:
        return []
    return [plain_slider(name, components) for name, components in vectors.items()]


def plain_slider(name: str, components: list[Component]) -> Control:
    values = [component.value for component in components]
    label = Gain(None, "", "", key=name).label
    if min(values) > 0.0:
        made = control(name, label, "", components, (min(values) / 10.0, max(values) * 10.0), UNDECLARED, "log", POSITIVE)
    else:
        made = control(name, label, "", components, (-10.0, 10.0), UNDECLARED)
    return made._replace(group=GAINS)


CHOSEN = {(">", False): "max", (">", True): "min", ("<", False): "min", ("<", True): "max"}
"""What choosing one of two compared numbers comes to; True where they stand the other way round."""


OPERATIONS = frozenset(("+", "-", "*", "/", "negative", "magnitude", "sqrt", "<", "<=", ">", ">=", "where"))
"""What the page can work out; `data/contract.ts` says how."""


def page_conditions(controller: Law, plan: FlightPlan, model: Model) -> tuple[ConditionData, ...]:
    """The conditions of a controller on the gains of a plan, as far as the page has the operations that they take.

    model: of the vehicle; what the plan holds of it varies.
    """
    if not isinstance(plan.parameters.gains, controller.Gains):  # prepared: the page has only what the gains became
        return ()
    record = Record()
    named = zip(leaf_names(plan.parameters), flatten(plan.parameters), strict=True)
    inputs = [leaf if isinstance(leaf, Table) else record.input(name) for name, leaf in named]
    parameters = rebuild(plan.parameters, iter(inputs))
    body = plan.loop.plant.body(parameters)
    model = model._replace(mass=body.mass, inertia=body.inertia, gravity=body.gravity)
    found = []
    for asked in controller.conditions(parameters.gains, model):
        with contextlib.suppress(UserError):
            left, right = (term(record, record.at(side)) for side in (asked.left, asked.right))
            order = bool(controller.ordered)
            found.append(ConditionData(asked.text, left, right, asked.or_equal, asked.source, order, asked.unit))
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
    mission: Mission, plan: FlightPlan, folder: Path, laws: Laws, called: str = "",
    rivals: Mapping[str, ControllerSection] | None = None,
) -> list[ControllerData]:  # fmt: skip
    """All that can fly this mission, its own first. Raises UserError where its own cannot be held by the page.

    called: its own one's name, if not that of its kind. rivals: the others, by name; those of the package if there are none.
    """
    own = controller(mission.controller, mission, plan, folder, laws, quick=True)
    result = [renamed(own, called) if called else own]
    for name, section in rivals.items() if rivals else (("", ghost) for ghost in ghosts(mission.controller)):
        if laws.size < ROOM_FOR_GHOSTS or rivals:
            with contextlib.suppress(UserError):  # no room for it
                rival = controller(section, mission, plan, folder, laws)
                result.append(renamed(rival, name) if name else rival)
    return result


def renamed(one: ControllerData, name: str) -> ControllerData:
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


def controller(
    section: ControllerSection, mission: Mission, plan: FlightPlan, folder: Path, laws: Laws, quick: bool = False
) -> ControllerData:
    """One of them. quick: as `Laws.add` has it. Raises UserError."""
    built = section.build(mission.modelled, folder)
    gains = widened(built.gains, section.table.seed) if section.table else built.gains
    flown = plan.with_controller(built.law, gains)
    numbers = laws.add(flown, quick)
    conditions = page_conditions(built.law, flown, mission.modelled.model())
    label = section.controller.label or section.type
    return ControllerData(
        section.type, label, *numbers, tuple(sliders(section, built.gains)), conditions, section.controller.off_command
    )
