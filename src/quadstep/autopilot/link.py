"""What flies a vehicle through a socket: it is told the sensors of a sample and says how fast the rotors should turn."""

import math
from collections.abc import Callable, Iterable
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from quadstep.numbers import Vector
from quadstep.numbers.rotations import rotation_matrix

WAIT = 5.0
"""Seconds that an autopilot may be silent in flight."""

FIRST_WAIT = 60.0
"""Seconds that it may take to appear."""


class Sample(NamedTuple):
    """What sensors say, in the axes of autopilots: north, east, down; front, right, down.

    time [s]. position [m], velocity [m/s]: world. attitude: (w, x, y, z), body to world. rates [rad/s], force: specific force
    [m/s^2], body.
    """

    time: float
    position: tuple[float, float, float]
    velocity: tuple[float, float, float]
    attitude: tuple[float, float, float, float]
    rates: tuple[float, float, float]
    force: tuple[float, float, float]

    def into_body(self, vector: tuple[float, float, float]) -> tuple[float, float, float]:
        """A vector of the world in body axes."""
        x, y, z = rotation_matrix(Vector(self.attitude)).T @ Vector(vector)
        return x, y, z


class Lost(Exception):  # noqa: N818 (it is no error of ours)
    """The autopilot fell silent or hung up in flight."""


class Link(Protocol):
    """A connection to an autopilot."""

    def meet(self, sample: Sample) -> None:
        """Wait until it is there. sample: at rest at the start. Raises UserError where it does not come."""
        ...

    def exchange(self, sample: Sample) -> list[float]:
        """Tell a sample, and get the outputs, 0 to 1. Raises Lost, and UserError for a malformed packet."""
        ...

    def close(self) -> None:
        """Hang up."""
        ...


class Piloted:
    """The function that a flight asks: 17 numbers of a sample in, a share of full speed for each rotor out.

    connect: makes a new link for each flight. lost: why the last flight ended before its time; empty where it did not.
    """

    def __init__(self, connect: Callable[[], Link]) -> None:
        self.connect, self.rotors, self.lost = connect, 0, ""
        self.link: Link | None = None
        self._asked, self._answer = b"", [0.0]

    def begin(self, sample: Sample, rotors: int) -> None:
        """Before a flight: wait until the autopilot is there. Raises UserError."""
        self.end()
        self.rotors, self.lost, self._asked = rotors, "", b""
        self.link = self.connect()
        try:
            self.link.meet(sample)
        except BaseException:
            self.end()
            raise

    def end(self) -> None:
        """After a flight: hang up."""
        if self.link:
            self.link.close()
        self.link = None

    def __call__(self, inputs: NDArray[np.float64]) -> list[float]:
        question = inputs.tobytes()
        if question == self._asked:  # lanes fill up a block with one flight
            return self._answer
        sample = sample_of(inputs)
        self._asked = question
        try:
            outputs = [] if self.lost or not self.link else self.link.exchange(sample)
        except Lost as error:
            self.lost, outputs = f"{error} at {sample.time:g} s", []
        shares = [min(max(one, 0.0), 1.0) for one in outputs[: self.rotors]]
        self._answer = shares if len(shares) == self.rotors else [math.nan] * self.rotors
        return self._answer


def sample_of(inputs: Iterable[float]) -> Sample:
    """A sample from our axes, z up and front, left, up."""
    t, px, py, pz, vx, vy, vz, w, x, y, z, p, q, r, fx, fy, fz = (float(one) for one in inputs)
    return Sample(t, (px, -py, -pz), (vx, -vy, -vz), (w, x, -y, -z), (p, -q, -r), (fx, -fy, -fz))
