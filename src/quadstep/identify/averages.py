"""Averages over half a second of flight, and equation error of their torques: centre of gravity and flapping.

Averages are used so that noise in the regressors does not bias the regression, and because an observer that learns slow
forces would hide all of these parameters from prediction errors.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple, cast

import numpy as np

from quadstep.identify.logs.flight import FlightRecord, Floats
from quadstep.identify.prediction import Curve, PredictorParameters
from quadstep.identify.starts import voltage_of
from quadstep.numbers import Vector, vector
from quadstep.numbers.rotations import from_rotation_vector, rotation_matrix
from quadstep.vehicle.allocation import mixing
from quadstep.vehicle.rigid_body import Geometry

BLOCK = 0.5
"""Length of an average [s]."""

FEWEST = 12
"""Fewest blocks for an estimate."""


class AverageEstimate(NamedTuple):
    """A parameter estimated from averages: value and standard error. pulls: by how much errors that all pull the same
    way would move it.
    """

    value: float
    error: float
    pulls: float = 0.0


class HalfSeconds(NamedTuple):
    """n half seconds of flight with their samples. flight, row (n,): index, and first row. gain (n, 3): mean
    acceleration less gravity, world axes [m/s^2]. axes (n, samples, 3, 3): rotation matrices. commands (n, samples, rotors),
    volts (n, samples). velocity (n, samples, 3): body axes [m/s]. rates (n, samples, 3). turning (n, 3): mean angular
    acceleration [rad/s^2].
    """

    flight: Floats
    row: Floats
    gain: Floats
    axes: Floats
    commands: Floats
    volts: Floats
    velocity: Floats
    rates: Floats
    turning: Floats


def matrices(attitude: Floats) -> Floats:
    """Rotation matrices (n, 3, 3) of quaternions."""
    return np.array([list(row) for row in rotation_matrix(Vector(attitude.T))]).transpose(2, 0, 1)


def lagged(wanted: Floats, period: float, lag: float) -> Floats:
    """What follows numbers (rows, ...) with a first-order lag [s]."""
    share = 1.0 - math.exp(-period / max(lag, 1e-4))
    found = wanted.copy()
    for row in range(1, len(found)):
        found[row] = found[row - 1] + share * (0.5 * (wanted[row - 1] + wanted[row]) - found[row - 1])
    return found


def followed(flight: FlightRecord, delay: float, lag: float) -> Floats:
    """The commands as the rotors follow them, `delay` [s] later and with a first-order lag [s], shape (n, rotors)."""
    index, shift = np.arange(flight.rows, dtype=float), delay / flight.period
    found = np.stack([np.interp(index - shift, index, column) for column in flight.motors.T], axis=1)
    return lagged(found, flight.period, lag)


def between(column: Floats) -> Floats:
    """Values half-way between each row and the next."""
    return 0.5 * (column[:-1] + column[1:])


def blocks(flights: Sequence[FlightRecord], delay: float, lag: float, gravity: float) -> HalfSeconds | None:
    """Averages of all flights, with rotors that follow their commands in this way; None if there are too few."""
    found: list[tuple[Floats, ...]] = []
    for number, flight in enumerate(flights):
        count = max(2, round(BLOCK / flight.period))
        good, runs = flight.flying & flight.measured, flight.runs()
        before = math.ceil((delay + 8.0 * lag) / flight.period) + 1
        speed, rates = flight.channel("velocity"), flight.channel("rates")
        turn, moving, turning = (between(one) for one in (matrices(flight.channel("attitude")), speed, rates))
        body = np.einsum("nij,ni->nj", turn, moving)
        motors, volts = between(followed(flight, delay, lag)), between(lagged(voltage_of(flight), flight.period, lag))
        for first in range(before, flight.rows - count - 1, count):
            last = first + count
            if not good[first : last + 1].all() or runs[last] < count + before:
                continue
            gain, twist = ((one[last] - one[first]) / (count * flight.period) for one in (speed, rates))
            told = (one[first:last] for one in (turn, motors, volts, body, turning))
            found.append((np.array(number), np.array(first), gain + np.array([0.0, 0.0, gravity]), *told, twist))
    if len(found) < FEWEST:
        return None
    return HalfSeconds(*(np.array(column) for column in zip(*found, strict=True)))


def clusters_of(block: HalfSeconds) -> Floats:
    """A cluster number for each block: one cluster per flight or, if there are few flights, per four blocks."""
    flights = len(np.unique(block.flight))
    return block.flight if flights >= 6 else np.floor(np.arange(len(block.flight)) / 4.0)


def least_squares(matrix: Floats, wanted: Floats, clusters: Floats) -> tuple[Floats, Floats, Floats]:
    """Solution, its cluster-robust standard errors (Liang and Zeger 1986), and its pulls."""
    inverse = np.linalg.pinv(matrix.T @ matrix)
    solution = inverse @ (matrix.T @ wanted)
    rest = wanted - matrix @ solution
    names = np.unique(clusters)
    scores = np.array([matrix[clusters == name].T @ rest[clusters == name] for name in names])
    count = len(names)
    spread = inverse @ (scores.T @ scores) @ inverse * (count / max(count - 1, 1))
    return solution, np.sqrt(np.maximum(np.diag(spread), 0.0)), np.abs(inverse @ (matrix * rest[:, None]).T).sum(axis=1)


def in_rotors_axes(block: HalfSeconds, tilt: Floats) -> HalfSeconds:
    """The averages in the axes of the rotors, turned by `tilt` about x and y [rad] from the measured ones."""
    (turn,) = matrices(np.array([list(from_rotation_vector(vector(float(tilt[0]), float(tilt[1]), 0.0)))]))
    axes, velocity, rates, turning = (part @ turn for part in (block.axes, block.velocity, block.rates, block.turning))
    return block._replace(axes=axes, velocity=velocity, rates=rates, turning=turning)


def hubs(block: HalfSeconds, geometry: Geometry) -> Floats:
    """Velocity of every rotor's hub in body axes [m/s], shape (n, samples, rotors, 3)."""
    places = np.array([mount.position for mount in geometry.mounts])
    return block.velocity[:, :, None, :] + np.cross(block.rates[:, :, None, :], places)


def rotor_speeds(commands: Floats, volts: Floats, curve: Curve, measured: bool) -> Floats:
    """Speeds (..., rotors) [rad/s] of commands, or of measured speeds, at voltages (...) [V]."""
    return cast(Floats, curve.speeds(cast(float, commands), cast(float, volts[..., None]), measured))


def torques(block: HalfSeconds, p: PredictorParameters, geometry: Geometry, measured: bool) -> dict[str, AverageEstimate]:
    """Centre of gravity and flapping from mean torques, with a known thrust curve.

    I alpha + w x I w = torque - c x thrust + k_flap W v x e_z: about x torque - c_y T + k W v_y, about y torque + c_x T - k W
    v_x. The inertia is found too, but not used: predictions determine it better.
    """
    airframe, curve = p.airframe, p.curve
    block = in_rotors_axes(block, np.array([float(one) for one in p.tilt]))
    speeds = rotor_speeds(block.commands, block.volts, curve, measured)
    thrusts = airframe.rotor.thrust * (speeds**2).mean(axis=1)
    flows = (speeds[..., None] * hubs(block, geometry)).mean(axis=1)
    flow, pushes = flows.sum(axis=1), -flows * np.array([float(one) for one in airframe.drag.rotor])
    rows = np.array([list(row) for row in mixing(geometry, airframe.rotor.torque / airframe.rotor.thrust)])
    thrust, roll, pitch, _ = rows @ thrusts.T
    inertia = np.array([float(one) for one in airframe.inertia])
    spin = float(airframe.rotor.inertia) * (speeds @ np.array([float(mount.spin) for mount in geometry.mounts]))
    momentum = block.rates * inertia
    momentum[..., 2] += spin
    levers = np.cross([mount.position for mount in geometry.mounts], pushes).sum(axis=1)
    given = np.stack([roll, pitch], axis=1) + (levers - np.cross(block.rates, momentum).mean(axis=1))[:, :2]
    thrust = thrust + pushes[:, :, 2].sum(axis=1)
    nothing = np.zeros(len(thrust))
    about_x = np.stack([thrust, nothing, -flow[:, 1], block.turning[:, 0], nothing], axis=1)
    about_y = np.stack([nothing, -thrust, flow[:, 0], nothing, block.turning[:, 1]], axis=1)
    together = clusters_of(block)
    solution, errors, pulls = least_squares(
        np.concatenate([about_x, about_y]), given.T.reshape(-1), np.concatenate([together, together])
    )
    return {
        "centre_of_gravity[1]": AverageEstimate(float(solution[0]), float(errors[0]), float(pulls[0])),
        "centre_of_gravity[0]": AverageEstimate(float(solution[1]), float(errors[1]), float(pulls[1])),
        "drag.flapping": AverageEstimate(float(solution[2]), float(errors[2]), float(pulls[2])),
    }
