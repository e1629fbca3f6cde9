"""A logged flight in the units and axes of the simulator; regressions and correlations of its signals."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from quadstep.io.errors import UserError
from quadstep.report.units import counted

Floats: TypeAlias = NDArray[np.float64]
Flags: TypeAlias = NDArray[np.bool_]

WIDTHS = {
    "position": 3, "velocity": 3, "attitude": 4, "rates": 3, "acceleration": 3, "voltage": 1,
    "setpoint": 3, "setpoint_yaw": 1, "reference_rates": 3,
    "estimated_position": 3, "estimated_velocity": 3, "estimated_attitude": 4,
    "law_thrust": 1, "law_torque": 3, "law_samples": 2,
}  # fmt: skip
"""Numbers in each channel except the motors, which have one per rotor."""

UNEVEN = 0.1
"""Share of the period by which a time step may differ from it and still count as one period."""

LIFT = 0.2
"""Height above the lowest logged one from which a vehicle counts as off the ground [m]."""

STOOD = 1.0
"""How long the rotors of a log must be still at first, so that it is taken to begin on the ground [s]."""

TURNING = 0.1
"""Share of the full command, or of the fastest logged speed, above which all rotors turn as in flight."""


@dataclass(frozen=True)
class FlightRecord:
    """Rows of a log; NaN where something was not measured. World axes with z up, body axes forward, left, up.

    time (n,) [s] as logged; period: of the rows [s]. motors (n, rotors), in the order of the vehicle's rotors: shares of the
    full command, or speeds [rad/s] if `speeds`. channels: each of `WIDTHS` that was logged, shape (n, width): position [m],
    velocity [m/s], attitude (w, x, y, z) body to world, rates [rad/s] about body axes, acceleration: specific force [m/s^2],
    voltage [V], setpoint [m], setpoint_yaw [rad], reference_rates: from another sensor, estimated_*: the log's own estimate;
    of an exported law that flew: law_thrust [N] and law_torque about body axes [N m] that it commanded, law_samples: the
    longest period of its samples since the row before [s], and how many it has rejected.
    derived: channels that were computed from others. lost (n,): rows with an invalid command (above the full one). damaged:
    how many stretches of the file could not be read and were skipped.
    """

    name: str
    time: Floats
    period: float
    motors: Floats
    speeds: bool
    channels: dict[str, Floats]
    derived: tuple[str, ...]
    lost: Flags
    damaged: int = 0

    def channel(self, name: str) -> Floats:
        """A channel, shape (n, width); NaN throughout where it was not logged."""
        found = self.channels.get(name)
        return np.full((len(self.time), WIDTHS[name]), np.nan) if found is None else found

    @property
    def rows(self) -> int:
        return len(self.time)

    @property
    def follows(self) -> Flags:
        """(n,): whether a row comes one period after the row before and neither has lost its command."""
        even = np.abs(np.diff(self.time) - self.period) <= UNEVEN * self.period
        kept = ~self.lost
        return np.concatenate([[False], even & kept[1:] & kept[:-1]])

    @property
    def measured(self) -> Flags:
        """(n,): whether the whole state was measured: position, velocity, attitude and rates."""
        parts = [np.isfinite(self.channel(name)).all(axis=1) for name in ("position", "velocity", "attitude", "rates")]
        return np.logical_and.reduce(parts)

    @property
    def turning(self) -> Flags:
        """(n,): whether every rotor turns as in flight."""
        full = self.motors.max() if self.speeds else 1.0
        return self.motors.min(axis=1) > TURNING * full

    @property
    def flying(self) -> Flags:
        """(n,): whether the vehicle is in the air: rotors turning, off the ground; where the height is unknown, as before.

        Where the rotors begin to turn in the log it stands until it leaves that height, which need not be the lowest one.
        Where they turn from its first row on, and it goes sideways and never up, it is in the air throughout.
        """
        height = self.channel("position")[:, 2]
        known = np.isfinite(height)
        if not known.any():
            return self.turning
        index = np.arange(self.rows)
        height = height[np.maximum.accumulate(np.where(known, index, 0))]
        high: Flags = self.turning & (np.nan_to_num(height, nan=-np.inf) > np.nanmin(height) + LIFT)
        first = int(np.argmax(self.turning))
        if self.time[first] - self.time[0] >= STOOD:
            high &= np.maximum.accumulate((np.abs(height - height[first]) > LIFT) & (index >= first))
        elif not high.any():
            sideways = self.channel("position")[known, :2]
            high = self.turning & bool(np.nanmax(np.ptp(sideways, axis=0)) > LIFT)
        return high

    @property
    def marks(self) -> NDArray[np.uint64]:
        """The measured motion while rotors turn: a number for each velocity and rate, to a thousandth of SI, in order.
        A recording has the same in any file, with more digits or fewer, and a part of it has some of them.
        """
        moved = np.hstack([self.channel("velocity"), self.channel("rates")])[self.measured & self.turning]
        found = np.zeros(len(moved), np.uint64)
        for column in np.rint(1e3 * moved).astype(np.int64).astype(np.uint64).T:
            found = (found ^ column) * np.uint64(0xBF58476D1CE4E5B9)  # as SplitMix64 mixes (Steele, Lea and Flood 2014)
            found ^= found >> np.uint64(31)
        return np.unique(found >> np.uint64(16))

    def runs(self) -> NDArray[np.int64]:
        """(n,): how many rows lie between each row and the last gap before it."""
        index = np.arange(self.rows)
        breaks = np.where(~self.follows, index, 0)
        return index - np.maximum.accumulate(breaks)


MOST_SHARED = 1.0
"""How much motion two flights may have in common: at rest all are alike [s]."""


def refuse_shared(flights: Sequence[FlightRecord]) -> None:
    """Refuses flights that overlap, as a log and a part of it do. Raises UserError."""
    for (one, first), (other, second) in combinations([(flight, flight.marks) for flight in flights], 2):
        shared = other.period * len(np.intersect1d(first, second, assume_unique=True))
        if shared > MOST_SHARED:
            raise UserError(f"{other.name}: {shared:.3g} s of it are in {one.name}, too; a flight counts once")


def damage(places: int) -> str:
    """How much of a log is damaged, in words."""
    return f"the file is damaged in {counted(places, 'place')}"


class LineFit(NamedTuple):
    """y = slope x by least squares. share: of y's variance that x explains. axis: the column of x that explains y best, and
    the slope on it alone.
    """

    slope: float
    share: float
    axis: int
    best: float
    best_share: float


class Lag(NamedTuple):
    """Lag of y behind x [s], and the correlation at that lag."""

    lag: float
    correlation: float


def stretches(told: Flags) -> list[tuple[int, int]]:
    """Where flags (n,) are set: the first place of each stretch, and the one past its last."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], told.astype(int), [0]])))
    return [(int(first), int(past)) for first, past in zip(edges[::2], edges[1::2], strict=True)]


def smooth(x: Floats, period: float, span: float = 0.08) -> Floats:
    """Two moving averages over `span` [s], centred."""
    count = max(1, round(span / period)) | 1
    box = np.ones(count) / count
    columns = [np.convolve(np.convolve(np.pad(one, count - 1, "edge"), box, "valid"), box, "valid") for one in x.T]
    return np.stack(columns, axis=1)


def spectrum(x: Floats, period: float, count: int = 256) -> tuple[Floats, Floats]:
    """Frequencies [Hz] and amplitude densities, per sqrt(Hz), of the columns of x (n, columns), shape (frequencies, columns):
    means over Hann windows of `count` rows that overlap by half (Welch 1967).
    """
    count = min(count, len(x))
    window = np.hanning(count)[:, None]
    pieces = [x[first : first + count] for first in range(0, len(x) - count + 1, max(1, count // 2))]
    powers = [np.abs(np.fft.rfft((piece - piece.mean(axis=0)) * window, axis=0)) ** 2 for piece in pieces]
    density: Floats = np.sqrt(2.0 * period * np.mean(powers, axis=0) / float((window**2).sum()))
    frequencies: Floats = np.arange(len(density)) / (count * period)
    return frequencies[1:], density[1:]


def slopes(x: Floats, y: Floats, where: Flags) -> list[LineFit]:
    """For each column of y: its slope on the same column of x, and on the one that explains it best; means removed."""
    found = []
    for place in range(y.shape[1]):
        target = y[where, place] - y[where, place].mean()
        spread = float(target @ target) or 1.0
        shares, fits = [], []
        for column in x[where].T:
            known = column - column.mean()
            power = float(known @ known) or 1.0
            fit = float(known @ target) / power
            fits.append(fit)
            shares.append(fit * fit * power / spread)
        best = int(np.argmax(shares))
        found.append(LineFit(fits[place], shares[place], best, fits[best], shares[best]))
    return found


def lag(x: Floats, y: Floats, period: float, longest: float = 0.15) -> Lag | None:
    """Lag of y behind x, by the peak of their correlation over stretches of two seconds; None if there is no such stretch."""
    reach, size = round(longest / period), round(2.0 / period)
    found: list[tuple[float, float]] = []
    for first in range(reach, len(x) - size - reach, size):
        a = x[first : first + size] - x[first : first + size].mean()
        if a.std() < 1e-9:
            continue
        scores = []
        for shift in range(-reach, reach + 1):
            b = y[first + shift : first + shift + size]
            b = b - b.mean()
            scores.append(float(a @ b) / (float(np.sqrt((a @ a) * (b @ b))) or 1.0))
        best = int(np.argmax(scores))
        if 0 < best < 2 * reach and scores[best] > 0.6:
            left, middle, right = scores[best - 1 : best + 2]
            bend = left - 2.0 * middle + right
            found.append((best - reach + (0.5 * (left - right) / bend if bend else 0.0), middle))
    if len(found) < 3:
        return None
    lags = np.array([one for one, _ in found]) * period
    return Lag(float(np.median(lags)), float(np.median([score for _, score in found])))
