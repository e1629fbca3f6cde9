"""Metrics of a flight of the paper's plant, computed from its log."""

from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from quadstep.flight.log import FlightLog
from quadstep.numbers import atan2, cos

POSITION, ATTITUDE = ("x", "y", "z"), ("psi", "theta", "phi")
INPUTS = ("u", "tau_psi", "tau_theta", "tau_phi")

SETTLING_BAND = 0.005
"""Half-width of the band an angle must stay in to count as settled [rad]."""


def rmse(errors: NDArray[np.float64]) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(np.square(errors))))


def position_errors(log: FlightLog) -> NDArray[np.float64]:
    """e1 = xi_d - xi at each sample, shape (samples, axes) [m]."""
    axes = position_axes(log)
    errors: NDArray[np.float64] = log.table(*(f"{axis}_d" for axis in axes)) - log.table(*axes)
    return errors


def position_axes(log: FlightLog) -> tuple[str, ...]:
    """Columns of the position: the lengths that have a wanted one beside them."""
    return tuple(name for name, unit in log.columns.items() if unit == "m" and f"{name}_d" in log.columns)


def attitude_errors(log: FlightLog) -> NDArray[np.float64]:
    """(psi_d, theta_d, phi_d) - (psi, theta, phi) at each sample, shape (samples, 3) [rad]; theta_d, phi_d unfiltered."""
    errors: NDArray[np.float64] = log.table("psi_d", "theta_d", "phi_d") - log.table(*ATTITUDE)
    return errors


def largest_angle(cosines: Any) -> float:
    """The largest angle [rad] of those with these cosines, an array; round-off beyond 1 counts as 1."""
    cosines = np.clip(cosines, -1.0, 1.0)
    angles: Any = atan2(np.sqrt((1.0 - cosines) * (1.0 + cosines)), cosines)
    return float(angles.max())


def settling_time(t: NDArray[np.float64], values: NDArray[np.float64]) -> float | None:
    """Time from which |values| stays within SETTLING_BAND [s]; None if it is outside at the end."""
    outside = np.flatnonzero(np.abs(values) > SETTLING_BAND)
    if not len(outside):
        return float(t[0])
    return float(t[outside[-1] + 1]) if outside[-1] + 1 < len(t) else None


def saturated_share(log: FlightLog, least: float, greatest: float) -> float:
    """Share of the rows in which a rotor is at its least or greatest thrust [N]."""
    forces, tolerance = log.table("f1", "f2", "f3", "f4"), 1e-9 * greatest
    return float(((forces <= least + tolerance) | (forces >= greatest - tolerance)).any(axis=1).mean()) if len(forces) else 0.0


def errors_of(errors: NDArray[np.float64], names: tuple[str, ...], unit: str) -> dict[str, Any]:
    """RMSE, largest and final magnitude of each column."""
    return {
        name: {
            f"rmse[{unit}]": rmse(errors[:, i]),
            f"largest[{unit}]": float(np.abs(errors[:, i]).max()),
            f"final[{unit}]": float(np.abs(errors[-1, i])),
        }
        for i, name in enumerate(names)
    }


def lagrange_metrics(log: FlightLog) -> dict[str, Any]:
    """Everything the study reports of one flight, with units in the keys; attitude: only if the law says which it wants.

    settling: of the angle's error against its command, and of the angle itself (towards level or its final yaw).
    total variation: sum of |differences| of an input from one log row to the next.
    """
    result: dict[str, Any] = {"outcome": log.outcome.name.lower(), "ended[s]": log.ended}
    if len(log.rows) < 2:
        return result
    t, attitude = log.column("t"), log.table(*ATTITUDE)
    _, theta, phi = cast(Any, attitude.T)
    e1 = position_errors(log)
    result["position"] = errors_of(e1, POSITION, "m")
    result["position_rmse[m]"] = rmse(np.linalg.norm(e1, axis=1))
    if "psi_d" in log.columns:
        e2 = attitude_errors(log)
        result["attitude"] = errors_of(e2, ATTITUDE, "rad")
        for i, name in enumerate(ATTITUDE):
            result["attitude"][name]["error_settling[s]"] = settling_time(t, e2[:, i])
            result["attitude"][name]["angle_settling[s]"] = settling_time(t, attitude[:, i] - log.column(f"{name}_d")[-1])
    result["largest_tilt[rad]"] = largest_angle(cos(theta) * cos(phi))
    for name, unit in zip(INPUTS, ("N", "N m", "N m", "N m"), strict=True):
        values = log.column(name)
        result[name] = {
            f"largest[{unit}]": float(np.abs(values).max()),
            f"total_variation[{unit}]": float(np.abs(np.diff(values)).sum()),
        }
    forces = log.table("f1", "f2", "f3", "f4")
    result["rotors"] = {"least[N]": float(forces.min()), "largest[N]": float(forces.max())}
    result["largest_weight_norm"] = {name: float(log.column(name).max()) for name in ("norm_W1", "norm_W2")}
    return result
