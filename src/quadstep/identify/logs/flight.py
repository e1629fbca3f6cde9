"""A logged flight in the units and axes of the simulator."""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from quadstep.report.units import counted

Floats: TypeAlias = NDArray[np.float64]
Flags: TypeAlias = NDArray[np.bool_]

WIDTHS = {
    "position": 3,
    "velocity": 3,
    "attitude": 4,
    "rates": 3,
    "acceleration": 3,
    "voltage": 1,
    "setpoint": 3,
    "setpoint_yaw": 1,
    "reference_rates": 3,
    "estimated_position": 3,
    "estimated_velocity": 3,
    "estimated_attitude": 4,
    "law_thrust": 1,
    "law_torque": 3,
    "law_samples": 2,
}
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
        whole: Flags = np.logical_and.reduce(parts)
        return whole

    @property
    def turning(self) -> Flags:
        """(n,): whether every rotor turns as in flight."""
        full = self.motors.max() if self.speeds else 1.0
        fast: Flags = self.motors.min(axis=1) > TURNING * full
        return fast

    @property
    def flying(self) -> Flags:
        """(n,): whether the vehicle is in the air: rotors turning, off the ground; where the height is unknown, as before.

        Where the rotors begin to turn in the log it stands until it leaves that height, which need not be the lowest one.
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
        return high

    def runs(self) -> NDArray[np.int64]:
        """(n,): how many rows lie between each row and the last gap before it."""
        index = np.arange(self.rows)
        breaks = np.where(~self.follows, index, 0)
        result: NDArray[np.int64] = index - np.maximum.accumulate(breaks)
        return result


def damage(places: int) -> str:
    """How much of a log is damaged, in words."""
    return f"the file is damaged in {counted(places, 'place')}"
