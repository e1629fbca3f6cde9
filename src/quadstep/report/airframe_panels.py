"""What the figures of a real vehicle's flight show."""

import numpy as np

from quadstep.analysis.airframe_metrics import rotor_thrusts
from quadstep.analysis.metrics import position_errors
from quadstep.flight.log import FlightLog
from quadstep.report.drawing import FigureJob
from quadstep.report.panel import Panel

AXES = ("x", "y", "z")


def position_panels(log: FlightLog) -> list[Panel]:
    """Each axis against its command, then its error."""
    errors = position_errors(log)
    tracks = [Panel(a, "m", {a: log.column(a), f"{a}_d": log.column(f"{a}_d")}) for a in AXES]
    return tracks + [Panel(f"{a}_d - {a}", "m", {f"error in {a}": errors[:, i]}) for i, a in enumerate(AXES)]


def attitude_panels(log: FlightLog) -> list[Panel]:
    """Angles, unwrapped, against their commands as far as these are said, then the body rates."""
    angles = [
        Panel(a, "rad", {name: np.unwrap(log.column(name)) for name in (a, f"{a}_d") if name in log.columns})
        for a in ("roll", "pitch", "yaw")
    ]
    return angles + [Panel(rate, "rad/s", {rate: log.column(rate)}) for rate in ("p", "q", "r")]


def input_panels(log: FlightLog) -> list[Panel]:
    """Thrust and torques, wanted and within the limits."""
    names = (("u", "N"), ("tau_x", "N m"), ("tau_y", "N m"), ("tau_z", "N m"))
    return [Panel(n, unit, {"wanted": log.column(n), "within limits": log.column(f"{n}_a")}) for n, unit in names]


def vehicle_panels(log: FlightLog) -> list[Panel]:
    """Rotors, wind, battery and nets."""
    forces = rotor_thrusts(log)
    wind = {name: log.column(f"wind_{name}") for name in AXES}
    panels = [
        Panel("rotor thrust", "N", {f"f{i + 1}": forces[:, i] for i in range(forces.shape[1])}),
        Panel("wind", "m/s", wind),
        Panel("norm of weights", "-", {"W1": log.column("norm_W1"), "W2": log.column("norm_W2")}),
        Panel("filtered errors", "m/s, rad/s", {"|r1|": log.column("norm_r1"), "|r2|": log.column("norm_r2")}),
    ]
    battery = log.column("voltage")
    return [*panels, Panel("battery", "V", {"voltage": battery})] if battery.any() else panels


def airframe_jobs(log: FlightLog, name: str) -> list[FigureJob]:
    """The figures of a flight: position, attitude, inputs, vehicle."""
    t = log.column("t")
    return [
        FigureJob("position", f"{name}: position", t, position_panels(log), 2),
        FigureJob("attitude", f"{name}: attitude", t, attitude_panels(log), 2),
        FigureJob("inputs", f"{name}: thrust and torques", t, input_panels(log), 2),
        FigureJob("vehicle", f"{name}: rotors, air, nets and battery", t, vehicle_panels(log), 2),
    ]
