"""Quantities of a flight that metrics are made of: from the columns of its log, or from its loop while it flies."""

import math
from collections.abc import Callable, Container, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadstep.interfaces.log import FlightLog
from quadstep.metrics.reductions import rmse
from quadstep.numbers.kinds import ARRAYS

Numbers = NDArray[np.float64]

ANGLES = ("psi", "theta", "phi")
"""Of the paper's plant."""

INPUTS = ("u", "tau_psi", "tau_theta", "tau_phi")

SATURATED = 1e-3
"""What the rotors could not make counts as saturation from this share of the vehicle's mean thrust on."""


@dataclass(frozen=True)
class LoggedFlight:
    """A log. since: errors of position and heading count from then on [s]. efforts: columns of the plant's inputs and their
    units. arm: from the vehicle's centre to its farthest rotor [m], 0 if not known.
    """

    log: FlightLog
    since: float = 0.0
    efforts: Mapping[str, str] = field(default_factory=dict)
    arm: float = 0.0

    @cached_property
    def path(self) -> Numbers:
        """Where its path is at each sample, shape (samples, axes) [m]."""
        return self.log.table(*(f"{axis}_d" for axis in position_axes(self.log)))

    @cached_property
    def holds(self) -> bool:
        """Whether its path, since errors count, is a point to hold or to step to."""
        path = self.path[self.log.column("t") >= self.since]
        steps = np.count_nonzero(np.any(np.diff(path, axis=0), axis=1))
        return bool(path.size) and not (steps > 1 and (path.max(axis=0) - path.min(axis=0) > POINT).any())

    @cached_property
    def asked(self) -> Numbers:
        """The acceleration of its path, shape (samples, axes) [m/s^2]: of a jump, much; at the ends of the log, 0."""
        t, asked = self.log.column("t"), np.zeros_like(self.path)
        step = (t[-1] - t[0]) / (len(t) - 1)
        asked[1:-1] = (self.path[2:] - 2.0 * self.path[1:-1] + self.path[:-2]) / (step * step)
        return asked


class QuantityRows(NamedTuple):
    """A quantity. entries: names and units. values: of shape (samples, entries), at times t [s]."""

    entries: Mapping[str, str]
    values: Numbers
    t: Numbers


Quantity = Callable[[LoggedFlight], QuantityRows | None]
"""None where the log has no such columns."""


def position_axes(log: FlightLog) -> tuple[str, ...]:
    """Columns of the position: the lengths that have a wanted one beside them."""
    return tuple(name for name, unit in log.columns.items() if unit == "m" and f"{name}_d" in log.columns)


def position_errors(log: FlightLog) -> Numbers:
    """e1 = xi_d - xi at each sample, shape (samples, axes) [m]."""
    axes = position_axes(log)
    return log.table(*(f"{axis}_d" for axis in axes)) - log.table(*axes)


def shorter_way(turned: Numbers) -> Numbers:
    """Differences of angles [rad], any shape, less whole turns: unchanged where they are at most half a turn either way."""
    return turned - 2.0 * np.pi * np.floor(turned / (2.0 * np.pi) + 0.5)


def rotor_columns(columns: Mapping[str, str]) -> tuple[str, ...]:
    """Of each rotor's thrust."""
    return tuple(name for name in columns if name[0] == "f" and name[1:].isdigit())


def as_it_turns(rotor: str, columns: Container[str]) -> str:
    """The column of a rotor's thrust without what a fault takes from it: of a log without one, its thrust."""
    return whole if (whole := f"{rotor}_whole") in columns else rotor


def rotor_thrusts(log: FlightLog) -> Numbers:
    """Each rotor's thrust as it turns, shape (samples, rotors) [N]."""
    return log.table(*(as_it_turns(name, log.columns) for name in rotor_columns(log.columns)))


def has(flight: LoggedFlight, *names: str) -> bool:
    return all(name in flight.log.columns for name in names)


def rows(flight: LoggedFlight, entries: Mapping[str, str], values: Numbers) -> QuantityRows:
    """Over the whole log."""
    return QuantityRows(entries, values.reshape(len(values), -1), flight.log.column("t"))


def position_error(flight: LoggedFlight) -> QuantityRows | None:
    """e1 (Eq. 11), from `since` on."""
    t, axes = flight.log.column("t"), position_axes(flight.log)
    if not axes:
        return None
    scored = flight.log._replace(rows=flight.log.rows[t >= flight.since])
    return QuantityRows(dict.fromkeys(axes, "m"), position_errors(scored), t[t >= flight.since])


ARMS = 10.0
"""Where the path is a point, its errors are measured against so many arms of the vehicle."""

ARM = 0.1
"""Of a vehicle whose arm is not known [m]."""

POINT = 1e-6
"""A path that stays within this [m] is a point."""

FAR = 30.0
"""Errors are measured against no more than this [m], however far a path goes."""


def error_against_path(flight: LoggedFlight) -> QuantityRows | None:
    """Distance from the path, and what it is measured against [m].

    Of a path that moves: the distance of its points from where the vehicle started, or from where the path was when errors
    began to count, whichever is less, and no more than `FAR`: the error of a vehicle that stays there; an arm if that is less.
    Of a point: `ARMS` arms of the vehicle, and only the second half of the flight, when it should have arrived.
    """
    found = position_error(flight)
    if found is None or len(found.t) < 2:
        return None
    started, wanted = flight.log.table(*position_axes(flight.log))[0], flight.path[-len(found.t) :]
    distance = np.linalg.norm(found.values, axis=1)
    arms = np.full(len(distance), flight.arm or ARM)
    if flight.holds:
        against, first = ARMS * arms, len(distance) // 2
    else:
        gone = (np.minimum(np.linalg.norm(wanted - place, axis=1), FAR) for place in (started, wanted[0]))
        against, first = max(min(gone, key=rmse), arms, key=rmse), 0
    return QuantityRows({"error": "-"}, np.column_stack([distance, against])[first:], found.t[first:])


def error_over_time(flight: LoggedFlight) -> QuantityRows | None:
    """As `error_against_path`, of the whole flight, and the acceleration that the path asks for [m/s^2]."""
    found, against = position_error(flight), error_against_path(flight)
    if found is None or against is None:
        return None
    scale = np.full(len(found.t), rmse(against.values[:, 1]))
    off, asked = np.linalg.norm([found.values, flight.asked[-len(found.t) :]], axis=2)
    return QuantityRows({"error": "-"}, np.column_stack([off, scale, asked]), found.t)


RATES = (("p", "q", "r"), ("psi_dot", "theta_dot", "phi_dot"))
"""Of a rigid body, and of the paper's plant."""

RATE_SCALE = 1e3
"""What rates are measured against [rad/s]."""


def rates_over_time(flight: LoggedFlight) -> QuantityRows | None:
    """Magnitude of the angular rates, `RATE_SCALE`, and the acceleration that the path asks for [m/s^2]."""
    names = next((names for names in RATES if has(flight, *names)), None)
    if names is None:
        return None
    rates, asked = (np.linalg.norm(one, axis=1) for one in (flight.log.table(*names), flight.asked))
    return rows(flight, {"rate": "-"}, np.column_stack([rates, np.full(len(rates), RATE_SCALE), asked]))


def attitude_error(flight: LoggedFlight, against: slice = slice(None)) -> QuantityRows | None:
    """Each angle of the paper's plant from its command, the shorter way round; theta_d, phi_d unfiltered. None of a law that
    does not say which attitude it wants. against: rows of commands, as many as angles, or one.
    """
    if not has(flight, *ANGLES, "psi_d", "theta_d", "phi_d"):
        return None
    wanted = flight.log.table("psi_d", "theta_d", "phi_d")[against]
    return rows(flight, dict.fromkeys(ANGLES, "rad"), shorter_way(wanted - flight.log.table(*ANGLES)))


HEADINGS = ("heading_d", "yaw"), ("psi_d", "psi")
"""What is asked for and what is flown, of a rigid body and of the paper's plant."""


def heading_error(flight: LoggedFlight) -> QuantityRows | None:
    """Yaw less the heading that is asked for, the shorter way round, from `since` on."""
    names = next((names for names in HEADINGS if has(flight, *names)), None)
    if names is None:
        return None
    t = flight.log.column("t")
    wanted, yaw = flight.log.table(*names)[t >= flight.since].T
    return QuantityRows({"heading": "rad"}, shorter_way(yaw - wanted)[:, None], t[t >= flight.since])


def attitude_from_last(flight: LoggedFlight) -> QuantityRows | None:
    """Each of these angles from the last command: level, or the final yaw."""
    return attitude_error(flight, slice(-1, None))


def measuring_error(flight: LoggedFlight) -> QuantityRows | None:
    """What the controller was told of the position, less the truth."""
    if not has(flight, "x_m", "y_m", "z_m"):
        return None
    return rows(flight, dict.fromkeys("xyz", "m"), flight.log.table("x_m", "y_m", "z_m") - flight.log.table("x", "y", "z"))


def tilt(flight: LoggedFlight) -> QuantityRows | None:
    """Between thrust and vertical."""
    if has(flight, "q_x", "q_y"):
        cosines = 1.0 - 2.0 * (flight.log.table("q_x", "q_y") ** 2).sum(axis=1)
    elif has(flight, *ANGLES):
        theta, phi = flight.log.table("theta", "phi").T
        cosines = ARRAYS.cos(theta) * ARRAYS.cos(phi)
    else:
        return None
    cosines = np.clip(cosines, -1.0, 1.0)  # round-off beyond 1 counts as 1
    return rows(flight, {"tilt": "rad"}, ARRAYS.atan2(np.sqrt((1.0 - cosines) * (1.0 + cosines)), cosines))


SWING = 0.25
"""A swing is measured from the mean over so long before and after [s]."""

GRAVITY = 9.81
"""By which an acceleration becomes a tilt [m/s^2]."""

AXES = ("q_w", "q_x", "q_y", "q_z"), ("theta", "phi")
"""What says where thrust points, of a rigid body and of the paper's plant."""


def swings(flight: LoggedFlight) -> QuantityRows | None:
    """How far the thrust's axis is from its mean over half a second, and the same of the axis that the path's acceleration
    asks for; in the second half of the flight.
    """
    t = flight.log.column("t")
    half = math.floor(SWING * (len(t) - 1) / (t[-1] - t[0])) if len(t) > 1 else 0
    first, last = max(len(t) // 2, half), len(t) - half
    names = next((names for names in AXES if has(flight, *names)), None)
    if names is None or half < 2 or last - first < 2 * half:
        return None
    axis = flight.log.table(*names)
    if len(names) == 4:
        w, x, y, z = axis.T
        axis = np.column_stack([2.0 * (x * z + w * y), 2.0 * (y * z - w * x)])
    level = [place for place, name in enumerate(position_axes(flight.log)) if name in ("x", "y")]
    asked = flight.asked[:, level] / GRAVITY
    lengths = [np.linalg.norm(from_mean(one, half)[first - half :], axis=1) for one in (axis, asked)]
    return QuantityRows({"swing": "rad"}, np.column_stack(lengths), t[first:last])


def from_mean(values: Numbers, half: int) -> Numbers:
    """Each row less the mean of itself and `half` rows before and after it; of rows that have so many."""
    sums = np.cumsum(np.concatenate([np.zeros((1, values.shape[1])), values]), axis=0)
    return values[half : len(values) - half] - (sums[2 * half + 1 :] - sums[: -2 * half - 1]) / (2.0 * half + 1.0)


def inputs(flight: LoggedFlight) -> QuantityRows | None:
    """Thrust and torques of the paper's plant, or what the plant calls its inputs and logs."""
    for names in (tuple(flight.efforts), INPUTS):
        if names and has(flight, *names):
            return rows(flight, {name: flight.log.columns[name] for name in names}, flight.log.table(*names))
    return None


def rotors(flight: LoggedFlight) -> QuantityRows | None:
    """Each rotor's thrust."""
    names = rotor_columns(flight.log.columns)
    return rows(flight, dict.fromkeys(names, "N"), flight.log.table(*names)) if names else None


def total_thrust(flight: LoggedFlight) -> QuantityRows | None:
    """Of all rotors."""
    found = rotors(flight)
    return rows(flight, {"thrust": "N"}, found.values.sum(axis=1)) if found else None


def saturation(flight: LoggedFlight) -> QuantityRows | None:
    """1 at samples at which the rotors' limits left less than was asked for, else 0."""
    names = ("u", "tau_x", "tau_y", "tau_z")
    if not has(flight, *names, *(f"{name}_a" for name in names)):
        return None
    wanted, made = flight.log.table(*names), flight.log.table(*(f"{name}_a" for name in names))
    scale = float(np.abs(wanted[:, 0]).mean())
    missing = np.abs(wanted - made) > SATURATED * np.array([scale, *3 * [0.1 * scale]])
    return rows(flight, {"saturated": "-"}, np.any(missing, axis=1).astype(float))


def wind(flight: LoggedFlight) -> QuantityRows | None:
    """In world axes."""
    names = ("wind_x", "wind_y", "wind_z")
    return rows(flight, dict.fromkeys(names, "m/s"), flight.log.table(*names)) if has(flight, *names) else None


def weight_norms(flight: LoggedFlight) -> QuantityRows | None:
    """Of each net."""
    names = [name for name in ("norm_W1", "norm_W2") if has(flight, name)]
    return rows(flight, dict.fromkeys(names, "-"), flight.log.table(*names)) if names else None
