"""The controllers that can fly a real vehicle, each with its sliders; sliders for gains of which only names are known."""

import contextlib
import math
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel

from quadstep.control.backstepping import BacksteppingGains
from quadstep.errors import UserError
from quadstep.flight.engines import FlightPlan
from quadstep.mission.airframe_controllers import AnyAirframeController, RotationSection
from quadstep.numbers import flatten, in_matrix, leaf_names
from quadstep.page.conditions import coupling_condition, rotation_conditions, theorem_conditions
from quadstep.page.controllers import BELIEF, GAINS, NETS, believed_mass, net_controls, paper_gains
from quadstep.page.controls import AXES, control, grouped, parameter, positive
from quadstep.page.laws import Laws, widened
from quadstep.page.model import Component, Condition, Control, Controller

MOST_SLIDERS = 60

GHOSTS = ("geometric", "rotation-backstepping", "pid")
"""Controllers offered beside a mission's own."""

LABELS = {
    "geometric": "geometric tracking on SE(3)",
    "pid": "cascaded PID",
    "lqr": "linear quadratic regulator",
    "rotation-backstepping": "adaptive backstepping on the rotation group",
    "backstepping": "adaptive backstepping (the paper's)",
}

SYMBOLS = {
    "slope_1": "Lambda1",
    "gain_1": "K_r1",
    "integral_1": "K_i1",
    "slope_2": "Lambda2",
    "gain_2": "K_r2",
    "integral_2": "K_i2",
    "coupling": "P",
    "stiffness": "k_x",
    "damping": "k_v",
    "integral": "k_i",
    "turn_stiffness": "k_R",
    "turn_damping": "k_Omega",
}
"""The literature's symbols for gains, by their names in the code."""


def airframe_controllers(mission: Any, plan: FlightPlan, folder: Path, laws: Laws) -> list[Controller]:
    """The mission's own controller, then others with their usual gains. Raises UserError where its own cannot be held."""
    own = mission.controller
    belief = {key: value for key, value in own.model_dump(exclude_unset=True).items() if key in ("mass", "inertia")}
    vehicle = mission.vehicle.build()
    result = [controller(own, vehicle, plan, folder, laws)]
    for section in sections():
        kind = get_args(section.model_fields["type"].annotation)[0]
        if kind in GHOSTS and kind != own.type and laws.room_for_ghosts:
            known = {key: value for key, value in belief.items() if key in section.model_fields}
            with contextlib.suppress(UserError):  # no room for it
                result.append(controller(section.model_validate({"type": kind, **known}), vehicle, plan, folder, laws))
    return result


def sections() -> tuple[type[BaseModel], ...]:
    """The kinds of controller that a mission for a real vehicle can name."""
    found: tuple[type[BaseModel], ...] = get_args(get_args(AnyAirframeController)[0])
    return found


def controller(section: Any, vehicle: Any, plan: FlightPlan, folder: Path, laws: Laws) -> Controller:
    """One controller of a real vehicle. Raises UserError."""
    built = section.build(vehicle, folder)
    nets = getattr(section, "nets", None)
    gains = widened(built.gains, nets.seed) if nets else built.gains
    numbers = laws.add(plan.with_controller(built.law, gains))
    controls = airframe_gains(built.gains, nets)
    return Controller(
        section.type, LABELS.get(section.type, section.type), *numbers, tuple(controls), tuple(conditions(section))
    )


def airframe_gains(gains: Any, nets: Any) -> list[Control]:
    """The sliders of a controller of a real vehicle."""
    learning = grouped(NETS, *net_controls(nets, gains, "gains")) if nets else []
    if isinstance(gains, BacksteppingGains):
        return [
            *grouped(GAINS, *paper_gains(gains, "gains")),
            *learning,
            *grouped(BELIEF, *believed_mass(gains.mass, "gains")),
        ]
    return [*plain_controls(gains), *learning]


def conditions(section: Any) -> list[Condition]:
    """What the theory asks of the gains."""
    if section.type == "backstepping":
        return [*theorem_conditions("gains", "airframe"), coupling_condition("gains", "airframe")]
    return rotation_conditions() if isinstance(section, RotationSection) else []


def plain_controls(gains: Any) -> list[Control]:
    """A slider for every number or vector of gains, matrices and nets left out, if they are not too many."""
    vectors: dict[str, list[Component]] = {}
    for name, leaf, entry in zip(leaf_names(gains), flatten(gains), in_matrix(gains), strict=True):
        if (
            entry
            or "_net." in name
            or name == "learning_start"
            or not isinstance(leaf, float | int)
            or not math.isfinite(leaf)
        ):
            continue
        head, _, tail = name.rpartition(".")
        whole, label = (head, AXES[int(tail)] if int(tail) < len(AXES) else tail) if head and tail.isdigit() else (name, "")
        vectors.setdefault(whole, []).append(Component(label, float(leaf), (parameter(f"gains.{name}"),)))
    if len(vectors) > MOST_SLIDERS:
        return []
    return [plain_control(name, components) for name, components in vectors.items()]


def plain_control(name: str, components: list[Component]) -> Control:
    """The slider of one gain."""
    belief = name in ("mass", "inertia", "gravity")
    label = SYMBOLS.get(name, name.replace("_", " "))
    place = f"believed_{name}" if belief else name
    above = min(component.value for component in components) > 0.0
    made = positive(place, label, "", components) if above else control(place, label, "", components, (-10.0, 10.0))
    return made._replace(group=BELIEF if belief else GAINS)
