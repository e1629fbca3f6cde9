"""What the page draws of a flight: the vehicle, and plots by what the columns of its log are called."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from quadstep.engines.fly import FlightPlan
from quadstep.interfaces.log import FlightLog
from quadstep.interfaces.plant import Drawn
from quadstep.numbers import leaf_names
from quadstep.page.model import Arrow, Line, PanelData, RotorView, Scene

AXES, ANGLES = ("x", "y", "z"), ("psi", "theta", "phi")


def scene(plan: FlightPlan | None, log: FlightLog) -> Scene:
    """The scene of a flight; of an unknown vehicle a small quadrotor is drawn where its log says it is."""
    if plan is None:
        found, weight, arrows = Drawn(attitude=attitude(log.columns)), 1.0, forces(())
    else:
        body = plan.loop.plant.body(plan.parameters)
        found, weight = plan.loop.plant.drawing(plan.parameters), float(body.mass * body.gravity)
        arrows = forces(plan.parameters)
    rotors = tuple(RotorView(one.position, one.spin, column_or_none(log.columns, one.column)) for one in found.rotors)
    if not rotors:
        corners = ((0.1, 0.1), (-0.1, 0.1), (-0.1, -0.1), (0.1, -0.1))
        rotors = tuple(RotorView((x, y, 0.0), 1 if i % 2 else -1, None) for i, (x, y) in enumerate(corners))
    arm, low = max(math.hypot(rotor.position[0], rotor.position[1]) for rotor in rotors), lowest(log)
    ground = low if found.ground is None else found.ground
    wind = Arrow("wind", "m/s", "wind", ("wind_x", "wind_y", "wind_z"), None)
    return Scene(
        arm=arm,
        radius=found.radius or 0.6 * arm,
        rotors=rotors,
        hover=weight / len(rotors),
        position=AXES,
        wanted=("x_d", "y_d", "z_d"),
        attitude={"kind": "quaternion" if len(found.attitude) > 3 else "lagrange", "columns": list(found.attitude)},
        thrust=column_or_none(log.columns, found.thrust) or column_or_none(log.columns, "u"),
        arrows=(*arrows, *((wind,) if "wind_x" in log.columns else ())),
        ground=max(ground, low) if ground < low - 10.0 else ground,
    )


def attitude(columns: Mapping[str, str]) -> tuple[str, ...]:
    """The columns of an unknown vehicle's attitude."""
    quaternion = ("q_w", "q_x", "q_y", "q_z")
    return quaternion if all(name in columns for name in quaternion) else ANGLES


def forces(parameters: object) -> tuple[Arrow, ...]:
    """A steady force among the parameters."""
    names = ("disturbance.force.0", "disturbance.force.1", "disturbance.force.2")
    given = set(leaf_names(parameters))
    return (Arrow("steady force", "N", "force", None, names),) if given.issuperset(names) else ()


def column_or_none(columns: Mapping[str, str], name: str | None) -> str | None:
    """The name, if there is such a column."""
    return name if name in columns else None


def lowest(log: FlightLog) -> float:
    """A height [m] below everything flown."""
    if not len(log.rows):
        return 0.0
    heights = [log.column(name).min() for name in ("z", "z_d") if name in log.columns]
    return float(np.floor(min([0.0, *heights])))


def group(
    panel: str, title: str, unit: str, names: Sequence[str], wanted: Sequence[str] = (), minus: bool = False
) -> PanelData:
    """A panel of columns, with what was wanted of each beside it, or with the error instead."""
    if minus:
        return PanelData(panel, title, unit, tuple(Line(f"{d} - {n}", d, n) for n, d in zip(names, wanted, strict=True)))
    return PanelData(panel, title, unit, (*(Line(n, n) for n in names), *(Line(d, d, dashed=True) for d in wanted)))


PANELS = (
    group("position", "Position", "m", AXES, ("x_d", "y_d", "z_d")),
    group("position-error", "Position error", "m", AXES, ("x_d", "y_d", "z_d"), minus=True),
    group("attitude", "Attitude against command", "rad", ANGLES, ("psi_d", "theta_d", "phi_d")),
    group("attitude-error", "Attitude error", "rad", ANGLES, ("psi_d", "theta_d", "phi_d"), minus=True),
    group("attitude", "Attitude against command", "rad", ("yaw", "pitch", "roll"), ("yaw_d", "pitch_d", "roll_d")),
    group("attitude-error", "Attitude error", "rad", ("yaw", "pitch", "roll"), ("yaw_d", "pitch_d", "roll_d"), minus=True),
    group("thrust", "Thrust", "N", ("u",)),
    group("thrust-made", "Thrust, commanded and limited", "N", ("u_a",), ("u",)),
    group("torque", "Torques", "N m", ("tau_psi", "tau_theta", "tau_phi")),
    group("torque", "Torques, commanded and limited", "N m", ("tau_x_a", "tau_y_a", "tau_z_a"), ("tau_x", "tau_y", "tau_z")),
    group("rotors", "Rotor forces", "N", tuple(f"f{i}" for i in range(1, 9)), tuple(f"f{i}_whole" for i in range(1, 9))),
    group("estimate", "Estimated minus true position", "m", AXES, ("x_m", "y_m", "z_m"), minus=True)._replace(optional=True),
    group("wind", "Wind", "m/s", ("wind_x", "wind_y", "wind_z"))._replace(optional=True),
    group("voltage", "Battery", "V", ("voltage",))._replace(optional=True),
    PanelData(
        "weights", "Norms of the weights", "-", (Line("|W1_hat|", "norm_W1"), Line("|W2_hat|", "norm_W2")), optional=True
    ),
    PanelData(
        "lyapunov", "Lyapunov function, weight terms omitted (Eq. 55)", "J", (Line("L", "lyapunov"),), log=True, optional=True
    ),
    PanelData("r1", "Filtered position error |r1|", "m/s", (Line("|r1|", "norm_r1"),), log=True, optional=True),
    PanelData("r2", "Filtered attitude error |r2|", "rad/s", (Line("|r2|", "norm_r2"),), log=True, optional=True),
)
"""Every plot there may be, in order; a flight gets those whose first column its log has."""


def panels(columns: Mapping[str, str]) -> tuple[PanelData, ...]:
    """The plots of a log with these columns."""
    found: dict[str, PanelData] = {}
    for panel in PANELS:
        lines = tuple(line for line in panel.lines if line.column in columns and (line.minus is None or line.minus in columns))
        if lines and panel.id not in found and panel.lines[0] in lines:
            found[panel.id] = panel._replace(lines=lines)
    if "thrust-made" in found:
        found.pop("thrust", None)
    if "attitude" not in found:  # of a plant that calls its signals otherwise
        drawn = {"t", *(name for panel in found.values() for line in panel.lines for name in (line.column, line.minus))}
        others = {name: unit for name, unit in columns.items() if name not in drawn}
        for unit in dict.fromkeys(others.values()):
            names = [name for name in others if others[name] == unit]
            found[f"signals-{unit}"] = group(f"signals-{len(found)}", ", ".join(names), unit, names)
    return tuple(found.values())
