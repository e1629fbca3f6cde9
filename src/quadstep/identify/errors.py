"""Errors of predictions, and of two predictions that need no model."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from quadstep.identify.logs.flight import FlightRecord, Floats
from quadstep.identify.logs.mapping import product
from quadstep.identify.starts import Starts

HORIZONS = (1, 10, 50)
GROUPS = ("position", "velocity", "attitude", "rates")


class States(NamedTuple):
    """States of many predictions, one row each; attitude (w, x, y, z)."""

    position: Floats
    velocity: Floats
    attitude: Floats
    rates: Floats


def logged(flights: Sequence[FlightRecord], starts: Starts, horizon: int) -> States:
    """The measured states `horizon` samples after each start."""
    parts = []
    for name in GROUPS:
        rows = [flight.channel(name)[starts.row[starts.flight == i] + horizon] for i, flight in enumerate(flights)]
        parts.append(np.concatenate(rows))
    return States(*parts)


def constant(now: States, time: float) -> States:
    """Baseline: velocity and rates stay constant."""
    speed = np.linalg.norm(now.rates, axis=1, keepdims=True)
    half = 0.5 * speed * time
    turn = np.concatenate([np.cos(half), np.sin(half) * now.rates / np.maximum(speed, 1e-12)], axis=1)
    return States(now.position + time * now.velocity, now.velocity, product(now.attitude, turn), now.rates)


def zero_rate(now: States, time: float) -> States:
    """Baseline: velocity stays constant, rates are zero."""
    return States(now.position + time * now.velocity, now.velocity, now.attitude, np.zeros_like(now.rates))


def differences(predicted: States, truth: States) -> list[Floats]:
    """Predicted minus true for each group, shape (n, 3); for attitudes the rotation between them [rad]."""
    turn = product(truth.attitude * np.array([1.0, -1.0, -1.0, -1.0]), predicted.attitude)
    sine = turn[:, 1:] * np.where(turn[:, :1] < 0.0, -1.0, 1.0)
    length = np.linalg.norm(sine, axis=1, keepdims=True)
    angle = 2.0 * np.arctan2(length, np.abs(turn[:, :1]))
    vectors = sine * np.where(length > 1e-12, angle / np.maximum(length, 1e-12), 2.0)
    return [
        predicted.position - truth.position,
        predicted.velocity - truth.velocity,
        vectors,
        predicted.rates - truth.rates,
    ]


def norms(predicted: States, truth: States) -> Floats:
    """Lengths of the differences, shape (groups, n)."""
    return np.stack([np.linalg.norm(part, axis=1) for part in differences(predicted, truth)])
