"""The controllers that can fly a real vehicle, each with its sliders."""

import contextlib
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel

from quadstep.control.backstepping import BacksteppingGains
from quadstep.errors import UserError
from quadstep.flight.engines import FlightPlan
from quadstep.mission.airframe_controllers import AnyAirframeController, RotationSection
from quadstep.page.conditions import coupling_condition, rotation_conditions, theorem_conditions
from quadstep.page.controllers import believed_mass, net_controls, paper_gains
from quadstep.page.controls import BELIEF, GAINS, NETS, grouped
from quadstep.page.laws import Laws, widened
from quadstep.page.model import Condition, Control, Controller
from quadstep.page.plain import plain_controls

GHOSTS = ("geometric", "rotation-backstepping", "pid")
"""Controllers offered beside a mission's own."""

LABELS = {
    "geometric": "geometric tracking on SE(3)",
    "pid": "cascaded PID",
    "lqr": "linear quadratic regulator",
    "rotation-backstepping": "adaptive backstepping on the rotation group",
    "backstepping": "adaptive backstepping (the paper's)",
}


def airframe_controllers(mission: Any, plan: FlightPlan, folder: Path, laws: Laws) -> list[Controller]:
    """The mission's own controller, then others with their usual gains. Raises UserError where its own cannot be held."""
    own = mission.controller
    belief = {key: value for key, value in own.model_dump(exclude_unset=True).items() if key in ("mass", "inertia")}
    vehicle = mission.model
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
