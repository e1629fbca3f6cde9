"""A controller's sliders, derived from what its gains declare; of gains that declare nothing, from names and values."""

import math
from collections.abc import Mapping
from operator import attrgetter

from quadstep.engines.fly import FlightPlan
from quadstep.interfaces.gain import AXES, BELIEF, GAINS, NETS, Gain, declared
from quadstep.interfaces.learning import DeclaredNet, LearningStart
from quadstep.mission.derived import ControllerSection
from quadstep.mission.schema import Mission
from quadstep.numbers import flatten, in_matrix, leaf_names
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
from quadstep.page.laws import NEURONS
from quadstep.page.model import Component, Control

MOST_SLIDERS = 60
LEARNING, DAMPING = "Learning rate of Eq. 54.", "Damping of the weights in Eq. 54."


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
            from_zero("nets_start", "start of the nets", "s", one(nets.start, parameter(f"gains.{name}")), 20.0),
            Control(
                "nets", "nets", "-", NETS, "Switches both nets off.", "toggle", "linear", 0, 1, 0, 1, 1,
                (Component("", float(nets.enabled), (never,)),),
            ),
            Control(
                "neurons", "neurons of each net", "-", NETS, "", "neurons", "linear", 1, most, 1, most, 1,
                (Component("", nets.neurons, ()),),
            ),
        ]  # fmt: skip
    for symbol, field, end, hint in (("F", "learning_rate", 50.0, LEARNING), ("kappa", "damping", 0.2, DAMPING)):
        for name, net in declarations.items():
            if isinstance(net, DeclaredNet):
                place, label = f"{name}.{field}", f"{symbol}{net.number}"
                value = one(attrgetter(place)(gains), parameter(f"gains.{place}"))
                found.append(from_zero(label, label, "-", value, end, hint))
    return grouped(NETS, *found)


def sliders(section: ControllerSection, gains: object) -> list[Control]:
    """All of a controller's, by heading: gains, then nets, then what it believes."""
    declarations = section.controller.declarations()
    if not isinstance(gains, section.controller.Gains):  # prepared
        return known_sliders(gains)
    found = [*net_sliders(declarations, gains, section), *gain_sliders(declarations, gains)]
    return sorted(found, key=lambda control: {NETS: 1, BELIEF: 2}.get(control.group, 0))


def known_sliders(gains: object) -> list[Control]:
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
    """The slider of one of them."""
    values = [component.value for component in components]
    label = Gain(None, "", "", key=name).label
    if min(values) > 0.0:
        made = control(name, label, "", components, (min(values) / 10.0, max(values) * 10.0), "", "log", POSITIVE)
    else:
        made = control(name, label, "", components, (-10.0, 10.0))
    return made._replace(group=GAINS)
