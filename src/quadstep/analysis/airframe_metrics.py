"""Metrics of a flight of a real vehicle, computed from its log."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadstep.analysis.metrics import errors_of, largest_angle, position_errors, rmse
from quadstep.flight.log import FlightLog

SATURATED = 1e-3
"""What the rotors could not make counts as saturation from this share of the vehicle's mean thrust on."""


def rotor_thrusts(log: FlightLog) -> NDArray[np.float64]:
    """Each rotor's thrust as it turns, shape (samples, rotors) [N]."""
    return log.table(*(name for name in log.columns if name[0] == "f" and name[1:].isdigit()))


def saturated(log: FlightLog) -> NDArray[np.bool_]:
    """For each sample, whether the rotors' limits left less than was asked for."""
    wanted, made = log.table("u", "tau_x", "tau_y", "tau_z"), log.table("u_a", "tau_x_a", "tau_y_a", "tau_z_a")
    scale = float(np.abs(wanted[:, 0]).mean())
    missing = np.abs(wanted - made) > SATURATED * np.array([scale, *3 * [0.1 * scale]])
    lost: NDArray[np.bool_] = np.any(missing, axis=1)
    return lost


def airframe_metrics(log: FlightLog, since: float = 0.0) -> dict[str, Any]:
    """Everything reported of one flight, with units in the keys; errors from `since` [s] on.

    activity: sum of |changes| of all rotors' thrusts a second. measured: distance of what the controller was told from the
    truth.

    >>> from quadstep import Mission, airframe_metrics, fly
    >>> step = {"type": "step", "end": [0.0, 0.0, 0.5], "duration": 4.0}
    >>> flight = fly(Mission(vehicle={"preset": "crazyflie"}, path=step))
    >>> airframe_metrics(flight)["largest_error[m]"], airframe_metrics(flight, since=3.5)["largest_error[m]"] < 0.1
    (0.5, True)
    """
    result: dict[str, Any] = {"outcome": log.outcome.name.lower(), "ended[s]": log.ended}
    t = log.column("t")
    if len(t) < 2 or t[-1] <= since:
        return result
    scored = log._replace(rows=log.rows[t >= since])
    e1 = position_errors(scored)
    distance = np.linalg.norm(e1, axis=1)
    result["position"] = errors_of(e1, ("x", "y", "z"), "m")
    result["position_rmse[m]"], result["largest_error[m]"] = rmse(distance), float(distance.max())
    measured = np.linalg.norm(log.table("x_m", "y_m", "z_m") - log.table("x", "y", "z"), axis=1)
    result["measured_rmse[m]"] = rmse(measured)
    attitude = log.table("q_w", "q_x", "q_y", "q_z")
    result["largest_tilt[rad]"] = largest_angle(1.0 - 2.0 * (attitude[:, 1:3] ** 2).sum(axis=1))
    forces = rotor_thrusts(log)
    result["rotors"] = {
        "least[N]": float(forces.min()),
        "largest[N]": float(forces.max()),
        "activity[N/s]": float(np.abs(np.diff(forces, axis=0)).sum() / (t[-1] - t[0])),
    }
    result["mean_thrust[N]"] = float(forces.sum(axis=1).mean())
    result["saturated_share"] = float(saturated(log).mean())
    result["wind"] = {"mean[m/s]": float(np.linalg.norm(log.table("wind_x", "wind_y", "wind_z").mean(axis=0)))}
    result["largest_weight_norm"] = {name: float(log.column(name).max()) for name in ("norm_W1", "norm_W2")}
    return result
