"""The project's Kalman filter on logged sensors, against ground truth and against the log's own estimate."""

from typing import NamedTuple

import numpy as np

from quadstep.identify.averages import matrices
from quadstep.identify.logs.flight import FlightRecord, Floats, stretches
from quadstep.io.errors import UserError
from quadstep.numbers import Vector
from quadstep.sensing import estimator
from quadstep.sensing.sensors import Navigation, Sensors

FIX_EVERY = 0.05
"""Time between two fixes of the position [s]."""

FIX_NOISE = 0.005
"""Noise added to the fixes [m]."""

NO_FIX = 100.0
"""Attitude noise that the filter assumes, so large that attitude fixes have no effect [rad]."""

LONGEST = 30.0
SETTLING = 2.0

SENSORS = Sensors(
    gyro_noise=0.01, gyro_bias=0.02, gyro_walk=1e-4, accelerometer_noise=0.08, accelerometer_bias=0.3,
    accelerometer_walk=5e-3, position_noise=FIX_NOISE, velocity_noise=100.0, attitude_noise=NO_FIX, gravity=9.80665,
)  # fmt: skip
"""The filter's model of small IMUs: noise densities and initial biases."""


class EstimateErrors(NamedTuple):
    """Root mean squares: position [m], velocity [m/s], tilt [rad], yaw [rad]."""

    position: float
    velocity: float
    tilt: float
    yaw: float


class Deviation(NamedTuple):
    """An estimate minus the truth over time: position [m] and velocity [m/s], (n, 3); tilt [rad] and yaw [rad], (n,)."""

    position: Floats
    velocity: Floats
    tilt: Floats
    yaw: Floats

    def rms(self, skip: int) -> EstimateErrors:
        """Root mean squares after the first `skip` rows."""
        squares = ((self.position**2).sum(axis=1), (self.velocity**2).sum(axis=1), self.tilt**2, self.yaw**2)
        return EstimateErrors(*(float(np.sqrt(np.nanmean(one[skip:]))) for one in squares))


class Estimated(NamedTuple):
    """A flight: the filter's errors, and those of the log's own estimate where there is one; time [s] (n,): of both."""

    name: str
    filter: EstimateErrors
    own: EstimateErrors | None
    time: Floats
    filter_deviation: Deviation
    own_deviation: Deviation | None


def estimate(flight: FlightRecord) -> Estimated:
    """Run the filter over the longest stretch of a flight. Raises UserError where a sensor was not logged."""
    if "acceleration" not in flight.channels or "rates" in flight.derived:
        raise UserError(f"{flight.name}: an estimator needs samples of gyro and accelerometer; the log does not have both")
    sure = flight.flying & flight.measured & np.isfinite(flight.channel("acceleration")).all(axis=1)
    sure[1:] &= flight.follows[1:] | ~sure[:-1]
    first, last = max(stretches(sure), key=lambda one: one[1] - one[0], default=(0, 0))
    last = min(last, first + round(LONGEST / flight.period))
    if (last - first) * flight.period < SETTLING + 2.0:
        raise UserError(f"{flight.name}: no uninterrupted stretch of flight is long enough for an estimator")
    part = slice(first, last)
    truth = {name: flight.channel(name)[part] for name in ("position", "velocity", "attitude")}
    found = deviation(filtered(flight, part, truth), truth)
    skip = round(SETTLING / flight.period)
    own = None
    if all(f"estimated_{name}" in flight.channels for name in truth):
        own = deviation({name: flight.channel(f"estimated_{name}")[part] for name in truth}, truth)
    time: Floats = flight.period * np.arange(last - first, dtype=np.float64)
    return Estimated(flight.name, found.rms(skip), own.rms(skip) if own else None, time, found, own)


def filtered(flight: FlightRecord, part: slice, truth: dict[str, Floats]) -> dict[str, Floats]:
    """The filter's estimates from the samples; fixes are the true position with noise."""
    random = np.random.default_rng(0)
    gyro, felt = flight.channel("rates")[part].tolist(), flight.channel("acceleration")[part].tolist()
    fixes = truth["position"] + random.normal(0.0, FIX_NOISE, truth["position"].shape)
    every = max(1, round(FIX_EVERY / flight.period))
    first = Navigation(*(Vector(truth[name][0].tolist()) for name in ("position", "velocity", "attitude")))
    # the start is known well; later fixes are of the position alone
    known = SENSORS._replace(velocity_noise=0.05, attitude_noise=0.01)
    memory = estimator.start(first, Vector(gyro[0]), known, 0, 0)._replace(accelerometer=Vector(felt[0]))
    rows = []
    for row, (turning, pull) in enumerate(zip(gyro, felt, strict=True)):
        if row:
            memory = estimator.predict(memory, Vector(turning), Vector(pull), SENSORS.gravity, flight.period)
            if row % every == 0:
                now = memory.now.state
                fix = Navigation(Vector(fixes[row].tolist()), now.velocity, now.attitude)
                memory = estimator.correct(memory, fix, SENSORS)
        rows.append([*memory.now.state.position, *memory.now.state.velocity, *memory.now.state.attitude])
    values = np.array(rows, dtype=float)
    return {"position": values[:, :3], "velocity": values[:, 3:6], "attitude": values[:, 6:]}


def deviation(values: dict[str, Floats], truth: dict[str, Floats]) -> Deviation:
    mine, theirs = matrices(values["attitude"]), matrices(truth["attitude"])
    up = np.einsum("ni,ni->n", mine[:, 2], theirs[:, 2])
    heading = [np.arctan2(one[:, 1, 0], one[:, 0, 0]) for one in (mine, theirs)]
    return Deviation(
        position=values["position"] - truth["position"],
        velocity=values["velocity"] - truth["velocity"],
        tilt=np.arccos(np.clip(up, -1.0, 1.0)),
        yaw=np.angle(np.exp(1j * (heading[0] - heading[1]))),
    )
