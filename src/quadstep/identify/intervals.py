"""Intervals: the fit repeated with each stretch of flight left out in turn (a block jackknife), through both of its stages.

Estimates from averages are fixed while predictions are fitted, so their errors propagate to those fits. Both stages lose the
same stretches; the second takes one Newton step for each, with the curvature that is left without it (a generated regressor's
error: Murphy and Topel 1985; the jackknife over blocks: Kuensch 1989).
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadstep.identify.averages import BLOCK, AverageEstimate, HalfSeconds, torques
from quadstep.identify.logs.flight import FlightRecord, Floats, smooth
from quadstep.identify.mean_forces import PLAIN, VARIANTS, Variant, forces
from quadstep.identify.parameters import VEHICLE, Free, placed, point_of
from quadstep.identify.prediction import PredictorParameters
from quadstep.identify.prediction_problem import Curvature, Prior
from quadstep.metrics.statistics import student_quantile
from quadstep.vehicle.allocation import mixing
from quadstep.vehicle.rigid_body import Geometry

FLIGHTS = 6
"""With this many flights or more, whole flights are left out, else stretches."""

STRETCH = 2.0
"""Length of a stretch [s]."""

IN_STEP = 0.05
"""Least share of the pulls on an estimate that are in step: errors of model and feedback do not average out as noise does."""

INEXACT = 0.05
"""Standard error, in a parameter's scale, that averages over half a second have without any noise."""

UNKNOWN_EXPONENT = 0.2
"""Standard deviation of the logarithm of a command's exponent that flights do not determine."""

FROM_AVERAGES = {
    "command.speed": "curve.speed", "command.exponent": "curve.exponent", "command.voltage_exponent": "curve.voltage_exponent",
    "imu.tilt[0]": "tilt.0", "imu.tilt[1]": "tilt.1", "centre_of_gravity[0]": "offset.0", "centre_of_gravity[1]": "offset.1",
}  # fmt: skip
AVERAGED = tuple(one for one in VEHICLE if one.key in FROM_AVERAGES)
DYNAMIC = tuple(one for one in VEHICLE if one.key not in FROM_AVERAGES)


class StandardErrors(NamedTuple):
    """Standard errors on the search's scale, the degrees of freedom behind each, and by how much errors that all pull the same
    way would move each estimate: the sum of the sizes of all pulls. The last is that of lag and delay together [s].
    """

    errors: Floats
    freedom: Floats
    pulls: Floats

    def halves(self, in_step: float) -> Floats:
        """Halves of 95 % intervals: chance, and the pulls in step; in_step: which share of those on predictions."""
        reach = np.array([student_quantile(0.975, float(one)) for one in self.freedom])
        shares = np.full(len(self.pulls), in_step)
        shares[-1 - len(AVERAGED) : -1] = IN_STEP
        return reach * self.errors + shares * self.pulls


def of_lateness(p: PredictorParameters, free: Sequence[Free]) -> Floats:
    """By how much lag and delay together grow with each number, on the search's scale [s]."""
    slopes = {"rotor.rise_time": float(p.airframe.rotor.rise), "command.delay": 1.0}
    return np.array([slopes.get(one.key, 0.0) for one in free])


def with_values(p: PredictorParameters, values: dict[str, float]) -> PredictorParameters:
    """The parameters with some leaves replaced."""
    free = [Free(name, (name,), "", False) for name in values]
    return placed(p, free, np.array(list(values.values())))


def averaged(
    block: HalfSeconds, p: PredictorParameters, geometry: Geometry, speeds: bool, rounds: int = 10, variant: Variant = PLAIN
) -> tuple[PredictorParameters, dict[str, AverageEstimate], dict[str, str]]:
    """p with the parameters that averages determine; and why the others stay."""
    known, why = forces(block, p, geometry, speeds, rounds, variant)
    p = with_values(p, {FROM_AVERAGES[key]: told.value for key, told in known.items() if key in FROM_AVERAGES})
    more = torques(block, p, geometry, speeds) if "imu.tilt[0]" in known else {}
    p = with_values(p, {FROM_AVERAGES[key]: told.value for key, told in more.items() if key in FROM_AVERAGES})
    return p, {**known, **more}, why


def by_structure(
    block: HalfSeconds, p: PredictorParameters, averages: dict[str, AverageEstimate], geometry: Geometry, speeds: bool
) -> dict[str, float]:
    """By how much the numbers from averages differ with the structures that the flights do not tell from the plain one."""
    found = dict.fromkeys(averages, 0.0)
    for variant in VARIANTS:
        _, others, _ = averaged(block, p, geometry, speeds, variant=variant)
        for key in found.keys() & others.keys():
            found[key] = max(found[key], abs(others[key].value - averages[key].value))
    return found


def part_of_row(flight: Floats | NDArray[np.int64], row: Floats | NDArray[np.int64], period: float) -> Floats:
    """The index of the part of flight that each row belongs to."""
    whole = np.asarray(flight, dtype=np.float64)
    if len(np.unique(flight)) >= FLIGHTS:
        return whole
    return whole * 1e6 + row // max(1, round(STRETCH / period))


def shifts_of_averages(
    block: HalfSeconds, names: Floats, labels: Floats, p: PredictorParameters, geometry: Geometry, speeds: bool,
    keys: Sequence[str],
) -> tuple[Floats, Floats]:  # fmt: skip
    """Shifts of the estimates from averages without each part: (parts, averaged) on the search's scale, and (parts, keys) of
    other numbers, logarithms.
    """
    start, told, _ = averaged(block, p, geometry, speeds, 2)
    found, others = [], []
    for name in names:
        rest = labels != name
        if rest.all():
            found.append(point_of(start, AVERAGED))
            others.append([told[key].value for key in keys])
            continue
        moved, values, _ = averaged(HalfSeconds(*(column[rest] for column in block)), p, geometry, speeds, 2)
        found.append(point_of(moved, AVERAGED))
        others.append([values[key].value for key in keys])
    base = np.array([told[key].value for key in keys])
    return np.array(found) - point_of(start, AVERAGED), np.log(np.array(others) / base)


def jackknife(shifts: Floats) -> Floats:
    """Standard errors from the shifts of estimates without each part, shape (parts, numbers)."""
    count = len(shifts)
    return np.sqrt((count - 1) / count * ((shifts - shifts.mean(axis=0)) ** 2).sum(axis=0))


def freedom(shifts: Floats) -> Floats:
    """Degrees of freedom of a jackknife's variances: fewer than parts - 1 where few parts tell most (Satterthwaite 1946, with
    fourth moments for the variances of variances as in Lipsitz, Ibrahim and Parzen 1999).
    """
    squares = (shifts - shifts.mean(axis=0)) ** 2
    most, fourth = float(max(len(shifts) - 1, 1)), (squares * squares).sum(axis=0)
    found: Floats = np.clip(3.0 * squares.sum(axis=0) ** 2 / np.maximum(fourth, 1e-300), 1.0, most)
    return np.where(fourth > 0.0, found, most)


def standard_errors(
    around: Curvature, prior: Prior, sure: Sequence[tuple[int, str]], averages: dict[str, AverageEstimate],
    starts: Floats, block: HalfSeconds | None, blocks: Floats,
    p: PredictorParameters, geometry: Geometry, speeds: bool, free: Sequence[Free],
) -> StandardErrors:  # fmt: skip
    """Standard errors of everything that was fitted: estimates from predictions first, then `AVERAGED`, then lag and delay
    together, of which one is too long where the other is too short.

    around: the fit of both kinds of numbers. sure: places of numbers whose prior comes from averages, with their keys. starts,
    blocks: part of each start, and of each block (`part_of_row`). free: what was fitted.
    """
    many = around.hessian.shape[0] - len(AVERAGED)
    labels, count = np.unique(starts), len(np.unique(starts))
    inverse = np.linalg.pinv(around.hessian[:many, :many])
    scores = np.array([around.gradients[starts == label, :many].sum(axis=0) for label in labels])
    moved = np.zeros((count, len(AVERAGED)))
    deviation = dict(zip(prior.places, prior.deviation, strict=True))
    if block is not None:
        moved, others = shifts_of_averages(block, labels, blocks, p, geometry, speeds, [key for _, key in sure])
        for column, (place, _) in enumerate(sure):
            scores[:, place] += others[:, column] / deviation[place] ** 2
    crossed = around.hessian[:many, many:]
    rest = [around.hessian - around.hessians[starts == label].sum(axis=0) for label in labels]
    steps = [np.linalg.pinv(one[:many, :many]) @ score for one, score in zip(rest, scores - moved @ crossed.T, strict=True)]
    late = of_lateness(p, free)[:many]
    shifts = np.column_stack([steps, moved, np.array(steps) @ late])
    answers = np.vstack([inverse, np.zeros((len(AVERAGED), many)), late @ inverse])  # of every estimate to a pull
    pulls = np.abs(around.gradients[:, :many] @ answers.T).sum(axis=0)
    at = {place: DYNAMIC[place] for place, _ in sure} | {many + i: one for i, one in enumerate(AVERAGED)}
    for place, one in at.items():
        if known := averages.get(one.key):
            pulls[place] += known.pulls / (known.value if one.logarithmic else 1.0)
    variance = jackknife(shifts) ** 2
    variance[many:-1] += np.array([INEXACT * one.scale for one in AVERAGED]) ** 2
    for place, _ in sure:
        variance[place] += (INEXACT * DYNAMIC[place].scale) ** 2
    # vague priors, and the variation between flights if no whole flights were left out
    for place, vague in deviation.items():
        if place not in [at for at, _ in sure]:
            variance += (answers[:, place] / vague) ** 2
    speed = [one.key for one in AVERAGED].index("command.speed")
    if "command.speed" in averages:
        more = (averages["command.speed"].error / averages["command.speed"].value) ** 2 - variance[many + speed]
        if more > 0.0:
            variance[many + speed] += more
            variance += more * (answers @ crossed[:, speed]) ** 2
    if "command.exponent" not in averages and not speeds:
        place = [one.key for one in AVERAGED].index("command.exponent")
        variance += (UNKNOWN_EXPONENT * (answers @ crossed[:, place])) ** 2
    return StandardErrors(np.sqrt(variance), freedom(shifts), pulls)


def noise_bias(flights: Sequence[FlightRecord], geometry: Geometry, free: Sequence[Free]) -> Floats:
    """By how much numbers may be wrong, on the search's scale, because commands that answer to the gyro's noise change between
    the rows of a log: a part of their variance that is white acts for less than a row, so the answer to it is too small.

    That part is seen in third differences, which leave little of what a vehicle can follow (20 is the sum of their squares);
    its share is that of what changes within half a second, since predictions learn slower torques from the log.
    """
    rows = np.array([list(row) for row in mixing(geometry, 1.0)])[1:]
    white, whole = np.zeros(3), np.full(3, 1e-300)
    for flight in flights:
        torque = np.where(flight.lost[:, None], np.median(flight.motors, axis=0), flight.motors) ** 2 @ rows.T
        around, good = torque - smooth(torque, flight.period, BLOCK), flight.flying & (flight.runs() >= 3)
        white += (np.diff(torque, 3, axis=0)[good[3:]] ** 2).sum(axis=0) / 20.0
        whole += (around[good] ** 2).sum(axis=0)
    shares = np.minimum(white / whole, 0.99)
    roll, pitch, yaw = -np.log1p(-shares)
    found = {
        "inertia[0]": roll, "inertia[1]": pitch, "rotor.torque_coefficient": yaw, "rotor.inertia": yaw,
        "rotor.rise_time": max(roll, pitch), "command.delay": flights[0].period * max(shares[:2]),
    }  # fmt: skip
    return np.array([found.get(one.key, 0.0) for one in free])
