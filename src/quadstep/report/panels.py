"""What the figures of a flight show: panels from its log."""

from quadstep.analysis.metrics import attitude_errors, position_errors
from quadstep.flight.log import FlightLog
from quadstep.report.drawing import FigureJob
from quadstep.report.panel import Panel


def position_panels(log: FlightLog) -> list[Panel]:
    """Each axis against its command, then its error."""
    errors = position_errors(log)
    tracks = [Panel(f"{a}", "m", {a: log.column(a), f"{a}_d": log.column(f"{a}_d")}) for a in ("x", "y", "z")]
    misses = [Panel(f"{a}_d - {a}", "m", {f"error in {a}": errors[:, i]}) for i, a in enumerate(("x", "y", "z"))]
    return tracks + misses


def attitude_panels(log: FlightLog, angles: tuple[str, ...] = ("phi", "theta")) -> list[Panel]:
    """Angles against their commands, then the errors; of a law that does not say which attitude it wants, the angles alone."""
    if "psi_d" not in log.columns:
        return [Panel(a, "rad", {a: log.column(a)}) for a in angles]
    errors, order = attitude_errors(log), ("psi", "theta", "phi")
    tracks = [Panel(f"{a}", "rad", {a: log.column(a), f"{a}_d": log.column(f"{a}_d")}) for a in angles]
    misses = [Panel(f"{a}_d - {a}", "rad", {f"error in {a}": errors[:, order.index(a)]}) for a in angles]
    return tracks + misses


def input_panels(log: FlightLog) -> list[Panel]:
    """Thrust and the three torques."""
    torques = [Panel(f"tau_{a}", "N m", {f"tau_{a}": log.column(f"tau_{a}")}) for a in ("phi", "theta", "psi")]
    return [Panel("u", "N", {"u": log.column("u")}), *torques]


def learning_panels(log: FlightLog) -> list[Panel]:
    """Weight norms, filtered errors, the Lyapunov function and the rotor thrusts."""
    return [
        Panel("norm of weights", "-", {"W1": log.column("norm_W1"), "W2": log.column("norm_W2")}),
        Panel("filtered errors", "m/s, rad/s", {"|r1|": log.column("norm_r1"), "|r2|": log.column("norm_r2")}),
        Panel("L without weights", "J", {"L": log.column("lyapunov")}),
        Panel("rotor thrust", "N", {f"f{i}": log.column(f"f{i}") for i in range(1, 5)}),
    ]


def flight_jobs(log: FlightLog, name: str) -> list[FigureJob]:
    """The figures of any flight: position, attitude, inputs, learning."""
    t = log.column("t")
    return [
        FigureJob("position", f"{name}: position", t, position_panels(log), 2),
        FigureJob("attitude", f"{name}: attitude", t, attitude_panels(log, ("phi", "theta", "psi")), 2),
        FigureJob("inputs", f"{name}: thrust and torques", t, input_panels(log), 2),
        FigureJob("learning", f"{name}: learning, errors and rotors", t, learning_panels(log), 2),
    ]
