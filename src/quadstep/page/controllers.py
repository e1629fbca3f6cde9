"""The controllers that can fly a mission of the paper's plant, each with its sliders."""

import contextlib
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import ValidationError

from quadstep.errors import UserError
from quadstep.flight.engines import FlightPlan
from quadstep.mission.controllers import (
    BacksteppingSection,
    CompletedSection,
    ControllerSection,
    NestedSaturationSection,
    NetsSection,
)
from quadstep.mission.lagrange import LagrangeMission
from quadstep.page.conditions import conditions
from quadstep.page.controls import ANGLES, AXES, BELIEF, GAINS, NETS, each, from_zero, grouped, one, parameter, positive
from quadstep.page.laws import NEURONS, Laws, widened
from quadstep.page.model import Component, Control, Controller
from quadstep.page.plain import plain_controls

LEARNING, DAMPING = "Learning rate of Eq. 54.", "Damping of the weights in Eq. 54."

LABELS = {
    "backstepping": "adaptive backstepping (the paper's)",
    "completed-backstepping": "completed backstepping",
    "nested-saturation": "nested saturations [11]",
}


class Choice(NamedTuple):
    """A controller that a mission could name."""

    id: str
    label: str
    section: Any


def choices(mission: LagrangeMission) -> list[Choice]:
    """The mission's own controller, then the others with what they have in common with it, else their defaults."""
    own = mission.controller
    given = own.model_dump(exclude_unset=True)
    belief: dict[str, Any] = {key: given[key] for key in ("mass", "inertia") if key in given}
    common = {key: value for key, value in given.items() if key in BacksteppingSection.model_fields}
    if not isinstance(own, BacksteppingSection):
        common = {key: value for key, value in belief.items() if key == "mass"}
    others: dict[str, tuple[type[ControllerSection], Mapping[str, Any]]] = {
        "backstepping": (BacksteppingSection, common),
        "completed-backstepping": (CompletedSection, common),
        "nested-saturation": (NestedSaturationSection, belief),
    }
    found = [Choice(own.type, LABELS.get(own.type, own.type), own)]
    for kind, (section, keys) in others.items():
        if kind != own.type:
            with contextlib.suppress(ValidationError):  # a controller of another kind may mean something else by them
                found.append(Choice(kind, LABELS[kind], section.model_validate({**keys, "type": kind})))
    return found


def controllers(mission: LagrangeMission, plan: FlightPlan, folder: Path, laws: Laws) -> list[Controller]:
    """All that can fly this mission, its own first. Raises UserError where its own cannot be held by the page."""
    result = []
    for place, (name, label, section) in enumerate(choices(mission)):
        if place > 0 and not laws.room_for_ghosts:
            break
        try:
            built = section.build(mission.vehicle, folder)
            gains = widened(built.gains, section.nets.seed) if isinstance(section, BacksteppingSection) else built.gains
            numbers = laws.add(plan.with_controller(built.law, gains))
        except UserError:
            if place == 0:
                raise
            continue
        controls = gain_controls(section, built.gains)
        result.append(Controller(name, label, *numbers, tuple(controls), tuple(conditions(section))))
    return result


def gain_controls(section: Any, gains: Any) -> list[Control]:
    """The sliders of a controller that a mission file can name; of one that is not known here, a slider for each gain."""
    if isinstance(section, CompletedSection):
        at = "gains.paper"
        return [
            *grouped(GAINS, *paper_gains(gains.paper, at), *completion_gains(gains)),
            *grouped(NETS, *net_controls(section.nets, gains.paper, at), *net_bounds(gains)),
            *grouped(BELIEF, *believed_mass(gains.paper.mass, at), *believed_inertia(gains.inertia)),
        ]
    if isinstance(section, BacksteppingSection):
        return [
            *grouped(GAINS, *paper_gains(gains, "gains")),
            *grouped(NETS, *net_controls(section.nets, gains, "gains")),
            *grouped(BELIEF, *believed_mass(gains.mass, "gains")),
        ]
    if isinstance(section, NestedSaturationSection):
        return [
            *grouped(GAINS, *nested_gains(gains)),
            *grouped(BELIEF, *believed_mass(gains.mass, "gains"), *believed_inertia(gains.inertia)),
        ]
    return plain_controls(gains)


def paper_gains(gains: Any, at: str) -> list[Control]:
    """The paper's gains."""
    above_1, above_2 = "The theorem asks K_r1 > m Lambda1.", "The theorem asks K_r2 > J_M max(Lambda2)."
    return [
        positive("Lambda1", "Lambda1", "1/s", each(gains.slope_1, AXES, f"{at}.slope_1"), "Outer loop, Eq. 12."),
        positive("K_r1", "K_r1", "N s/m", each(gains.gain_1, AXES, f"{at}.gain_1"), above_1),
        from_zero("K_i1", "K_i1", "N/m", each(gains.integral_1, AXES, f"{at}.integral_1"), 2.0),
        positive("Lambda2", "Lambda2", "1/s", each(gains.slope_2, ANGLES, f"{at}.slope_2"), "Inner loop, Eq. 28."),
        positive("K_r2", "K_r2", "N m s", each(gains.gain_2, ANGLES, f"{at}.gain_2"), above_2),
        from_zero("K_i2", "K_i2", "N m", each(gains.integral_2, ANGLES, f"{at}.integral_2"), 100.0),
        positive("filter", "command filter", "rad/s", one(gains.filter_frequency, parameter(f"{at}.filter_frequency"))),
    ]


def net_controls(nets: NetsSection, gains: Any, at: str) -> list[Control]:
    """Both nets: on or off, how large, how fast they learn."""
    force, torque = gains.force_net, gains.torque_net
    most = max(NEURONS, nets.neurons)
    never = parameter(f"{at}.learning_start", 0.0, 1, math.inf)
    return [
        from_zero("nets_start", "nets switch on at", "s", one(nets.start, parameter(f"{at}.learning_start")), 20.0),
        Control(
            "nets", "nets", "-", NETS, "Switches both nets off.", "toggle", "linear", 0, 1, 0, 1, 1,
            (Component("", float(nets.enabled), (never,)),),
        ),
        Control(
            "neurons", "neurons of each net", "-", NETS, "", "neurons", "linear", 1, most, 1, most, 1,
            (Component("", nets.neurons, ()),),
        ),
        from_zero("F1", "F1", "-", one(force.learning_rate, parameter(f"{at}.force_net.learning_rate")), 50.0, LEARNING),
        from_zero("F2", "F2", "-", one(torque.learning_rate, parameter(f"{at}.torque_net.learning_rate")), 50.0, LEARNING),
        from_zero("kappa1", "kappa1", "-", one(force.damping, parameter(f"{at}.force_net.damping")), 0.2, DAMPING),
        from_zero("kappa2", "kappa2", "-", one(torque.damping, parameter(f"{at}.torque_net.damping")), 0.2, DAMPING),
    ]  # fmt: skip


def completion_gains(gains: Any) -> list[Control]:
    """What the completed law has beyond the paper's."""
    weight = "Of the attitude error in the Lyapunov function."
    bounds = each(gains.integral_bounds, ("r1", "r2"), "gains.integral_bounds")
    return [
        positive("P", "P", "N m/rad", each(gains.coupling, ANGLES, "gains.coupling"), weight),
        positive("integral_bounds", "bounds of the integrals", "m, rad", bounds),
    ]


def net_bounds(gains: Any) -> list[Control]:
    """The bounds of the completed law's weights."""
    bounds = each(gains.weight_bounds, ("W1", "W2"), "gains.weight_bounds")
    return [positive("weight_bounds", "bounds of the weights", "-", bounds)]


def nested_gains(gains: Any) -> list[Control]:
    """The gains of [11]."""
    pair, four = ("rate", "offset"), ("1", "2", "3", "4")
    return [
        positive("a_z", "a_z", "1/s, 1/s^2", each(gains.altitude, pair, "gains.altitude"), "Altitude."),
        positive("a_psi", "a_psi", "1/s, 1/s^2", each(gains.yaw, pair, "gains.yaw"), "Yaw."),
        positive("bounds", "b", "-", each(gains.bounds, four, "gains.bounds"), "[11] asks b_i > 2 b_i+1."),
    ]


def believed_mass(mass: float, at: str) -> list[Control]:
    """The mass that a controller believes in."""
    return [positive("believed_mass", "mass", "kg", one(mass, parameter(f"{at}.mass")))]


def believed_inertia(inertia: Any) -> list[Control]:
    """The inertia that a controller believes in."""
    return [positive("believed_inertia", "inertia", "kg m^2", each(inertia, AXES, "gains.inertia"))]
