"""What a log says of one motion in several channels: regressions and correlations that show wrong units, signs and axes."""

import math
from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np

from quadstep.identify.logs.flight import Flags, FlightRecord, Floats, lag, slopes, smooth
from quadstep.identify.logs.read import rates_of
from quadstep.vehicle.allocation import mixing
from quadstep.vehicle.rigid_body import Geometry

GRAVITY = 9.80665
CLEAR = 0.3
"""Share of a signal's variance that a regression must explain to count as evidence."""

MOSTLY = 0.7
"""The same, to count as evidence of a slope that is that of no unit."""

UNEXPLAINED = 0.05
"""The same, below which one signal has nothing to do with another that should follow it."""

FACTORS = {180.0 / math.pi: "degrees where radians are expected", math.pi / 180.0: "radians where degrees are expected",
           GRAVITY: "m/s^2 where g is expected", 1.0 / GRAVITY: "g where m/s^2 is expected", 1e3: "a thousand times too large",
           1e-3: "a thousand times too small"}  # fmt: skip
"""Slopes that indicate a wrong unit."""

MARGIN = 12
"""Rows on either side of an unmeasured one in which a smoothed signal is not trusted."""

AGAINST = -0.5
"""Correlation of torque and angular acceleration below which motors are in another order or turn the other way."""

SLOW = 0.3
"""Span of the moving averages [s] that are taken off both first."""

FEWEST = 200
"""Fewest rows for evidence."""

AXES = "xyz"


class Finding(NamedTuple):
    """One line on a log. wrong: whether it contradicts the mapping. grave: whether any user of the log should know it."""

    wrong: bool
    text: str
    grave: bool = False


def relations(flight: FlightRecord, sure: Flags, geometry: Geometry | None) -> list[Finding]:
    """What channels show of each other, on rows that can be used. geometry: of the vehicle that should have flown it."""
    found = [
        *check_slope(flight, sure, "rates", "attitude", "the attitude's", rates_of),
        *check_slope(flight, sure, "velocity", "position", "the position's rate", partial(np.gradient, axis=0)),
        *check_lean(flight, sure),
        *check_accelerometer(flight, sure),
        *height(flight),
    ]
    found += [*volts(flight, sure), *check_motors(flight, sure, geometry), *estimates(flight, sure), *clocks(flight, sure)]
    return found


def unit_of(slope: float) -> str:
    """The meaning of a slope other than 1; empty for about 1."""
    size = abs(slope)
    for factor, meaning in FACTORS.items():
        if 0.6 < size / factor < 1.6:
            return meaning
    if 0.5 < size < 2.0:
        return ""
    return f"{size:.3g} times too large" if size > 1.0 else f"{1.0 / max(size, 1e-9):.3g} times too small"


def against(name: str, other: str, x: Floats, y: Floats, where: Flags, least: float) -> list[Finding]:
    """Findings on unit, signs and axes from a regression of y, the channel `name`, on x. least: spread that either needs."""
    found: list[Finding] = []
    if where.sum() < FEWEST:
        return found
    for place, one in enumerate(slopes(x, y, where)):
        if max(x[where, one.axis].std(), y[where, place].std()) < least or one.best_share < CLEAR:
            continue
        axis = AXES[place]
        alike = one.best_share > MOSTLY or not unit_of(one.best / math.sqrt(one.best_share))  # a swap has the axis's own slope
        if one.axis != place and one.best_share > 2.0 * one.share + 0.2 and alike:
            evidence = f"slope {one.best:.2f}, {100 * one.best_share:.0f} % explained"
            text = f"{name}: {axis} goes with {AXES[one.axis]} of {other} ({evidence})"
            found.append(Finding(True, text))
            continue
        if one.share < CLEAR:
            continue
        # noise in x makes the slope smaller; divided by the correlation it lies between the slopes of either on the other
        slope = one.slope / math.sqrt(one.share)
        unit = unit_of(slope)
        evidence = f"slope {slope:.3g} on {other}, {100 * one.share:.0f} % explained"
        if one.slope < 0.0:
            found.append(Finding(True, f"{name}: the sign of {axis} is inverted ({evidence})"))
        if unit in FACTORS.values() or (unit and one.share > MOSTLY):
            found.append(Finding(True, f"{name}: {axis}: {unit} ({evidence})"))
    return found


def check_slope(
    flight: FlightRecord, sure: Flags, name: str, of: str, other: str, slope: Callable[[Floats, Floats], Floats]
) -> list[Finding]:
    """A channel that was logged, against the slope over time of the channel `of`. other: that slope in words."""
    if of not in flight.channels or name not in flight.channels or name in flight.derived:
        return []
    seen = finite(sure, flight.channel(of), flight.channel(name))
    made = smooth(slope(filled(flight.channel(of)), flight.time), flight.period)
    return against(name, other, made, smooth(filled(flight.channel(name)), flight.period), seen, 0.05)


def check_lean(flight: FlightRecord, sure: Flags) -> list[Finding]:
    """Horizontal acceleration against the tilt: the vehicle accelerates where the thrust points."""
    if "attitude" not in flight.channels or "velocity" not in flight.channels:
        return []
    w, x, y, z = filled(flight.channel("attitude")).T
    lean = GRAVITY * np.stack([2.0 * (x * z + w * y), 2.0 * (y * z - w * x)], axis=1)
    gain = np.gradient(smooth(filled(flight.channel("velocity")), flight.period), flight.time, axis=0)[:, :2]
    seen = finite(sure, flight.channel("attitude"), flight.channel("velocity"))
    found: list[Finding] = []
    if seen.sum() < FEWEST:
        return found
    across, ahead = smooth(lean, flight.period), smooth(gain, flight.period)
    speed = filled(flight.channel("velocity"))[:, :2]
    across, ahead = (without_drag(speed, values, seen) for values in (across, ahead))
    both = slopes(across, ahead, seen)
    least, most = sorted(both, key=lambda one: one.share)
    spread = ahead[seen].std(axis=0)
    if least.share < UNEXPLAINED and most.share > MOSTLY and spread[both.index(least)] > max(0.2, 0.3 * spread.max()):
        axis, other = (AXES[both.index(one)] for one in (least, most))
        text = f"attitude: {100 * least.share:.0f} % of the acceleration along {axis} goes with its tilt, along {other}"
        found.append(Finding(True, f"{text} {100 * most.share:.0f} %; is `order` right?"))
    for place, one in enumerate(both):
        if ahead[seen, place].std() < 0.2 or one.share < CLEAR:
            continue
        unit, shown = unit_of(1.0 / one.slope), f"{100 * one.share:.0f} % explained"
        if unit in FACTORS.values() or (unit and one.share > MOSTLY):
            found.append(Finding(True, f"attitude: {unit} (tilt along {AXES[place]}, {shown})"))
        if one.slope < 0.0:
            text = f"attitude: accelerates along {AXES[place]} against its tilt (slope {one.slope:.2f}, {shown})"
            found.append(Finding(True, f"{text}; a sign or the direction of the rotation is wrong"))
    return found


def without_drag(speed: Floats, values: Floats, where: Flags) -> Floats:
    """Values without what goes with the speed along the same axis: drag, against which a vehicle leans in wind."""
    moving = speed - speed[where].mean(axis=0)
    slope = (moving[where] * values[where]).sum(axis=0) / np.maximum((moving[where] ** 2).sum(axis=0), 1e-12)
    return values - slope * moving


def check_accelerometer(flight: FlightRecord, sure: Flags) -> list[Finding]:
    if "acceleration" not in flight.channels:
        return []
    mean = np.nanmean(flight.channel("acceleration")[sure], axis=0)
    size = float(np.linalg.norm(mean))
    unit = unit_of(size / GRAVITY)
    if unit:
        return [Finding(True, f"acceleration: {size:.3g} m/s^2 on average in flight instead of {GRAVITY:.3g}: {unit}")]
    if mean[2] < 0.0:
        return [Finding(True, f"acceleration: {mean[2]:.3g} m/s^2 along body z in flight; it should be near +{GRAVITY:.3g}")]
    tilt = np.degrees(np.arctan2(np.hypot(mean[0], mean[1]), mean[2]))
    return [Finding(False, f"the accelerometer leans {tilt:.1f} degrees on average in flight")] if tilt > 0.5 else []


def height(flight: FlightRecord) -> list[Finding]:
    high = flight.channel("position")[:, 2]
    rest = ~flight.turning
    if not np.isfinite(high).any() or not rest[:50].all():
        return []
    gained = float(np.nanmedian(high[flight.turning]) - np.nanmedian(high[rest]))
    if gained < -0.2:
        return [Finding(True, f"position: flies {-gained:.2g} m below where it stood; is z down?")]
    return []


def volts(flight: FlightRecord, sure: Flags) -> list[Finding]:
    if "voltage" not in flight.channels:
        return [Finding(False, "voltage: not logged; thrust is assumed to depend on the command alone")]
    middle = float(np.nanmedian(flight.channel("voltage")[sure]))
    if not 2.5 < middle < 70.0:
        return [Finding(True, f"voltage: {middle:.3g} V in flight; is the unit correct?")]
    return []


def check_motors(flight: FlightRecord, sure: Flags, geometry: Geometry | None) -> list[Finding]:
    """Motors: saturation, and torque against the measured angular acceleration."""
    found = []
    motors = flight.motors[sure]
    if not flight.speeds:
        middle = float(motors.mean())
        if middle > 1.0 or middle < 0.02:
            found.append(Finding(True, f"motors: {middle:.3g} of the full command on average in flight; is `full` right?"))
        full = float((motors >= 1.0 - 1e-6).any(axis=1).mean())
        if full > 0.001:
            found.append(Finding(False, f"a motor is at its full command in {100 * full:.2g} % of the flight"))
    if geometry is None or "rates" not in flight.channels or len(geometry.mounts) != motors.shape[1]:
        return found
    rows = np.array([list(row) for row in mixing(geometry, 0.006)])
    squares = flight.motors**2
    # slow torques only hold the vehicle against drag and an off-centre weight; what varies fast turns it
    torques, rates = (
        (fine := smooth(values, flight.period, 0.03)) - smooth(fine, flight.period, SLOW)
        for values in (squares @ rows[1:3].T, filled(flight.channel("rates"))[:, :2])
    )
    gains = np.gradient(rates, flight.time, axis=0)
    seen = finite(sure, flight.channel("rates"))
    if seen.sum() < FEWEST:
        return found
    for place, name in enumerate(("roll", "pitch")):
        best, cross = (
            max((correlation(torques[:, place], np.roll(gains[:, axis], -shift), seen) for shift in range(12)), key=abs)
            for axis in (place, 1 - place)
        )
        if abs(cross) > max(abs(best) + 0.2, -AGAINST):
            found.append(
                Finding(True, f"motors: their {name} torque turns the other axis (correlation {cross:.2f} against {best:.2f})")
            )
        elif best < -0.25:
            # Of a calm flight, in which torques answer the gyro's noise, such a correlation may be weak and mean nothing.
            text = f"motors: their {name} torque is against the angular acceleration (correlation {best:.2f})"
            found.append(Finding(best < AGAINST, text))
    return found


def correlation(x: Floats, y: Floats, where: Flags) -> float:
    a, b = x[where] - x[where].mean(), y[where] - y[where].mean()
    return float(a @ b) / (float(np.sqrt((a @ a) * (b @ b))) or 1.0)


def estimates(flight: FlightRecord, sure: Flags) -> list[Finding]:
    """The log's own estimate against its other channels."""
    if "attitude" not in flight.channels or "estimated_attitude" not in flight.channels:
        return []
    mine, theirs = (filled(flight.channel(name)) for name in ("attitude", "estimated_attitude"))
    seen = finite(sure, flight.channel("attitude"), flight.channel("estimated_attitude"))
    lean = [
        2.0 * np.stack([q[:, 0] * q[:, 1] + q[:, 2] * q[:, 3], q[:, 0] * q[:, 2] - q[:, 1] * q[:, 3]], axis=1)
        for q in (mine, theirs)
    ]
    return against("estimated_attitude", "the attitude's tilt", lean[0], lean[1], seen, 0.02)


def clocks(flight: FlightRecord, sure: Flags) -> list[Finding]:
    """Lags between sources."""
    found = []
    if "attitude" in flight.channels and "rates" in flight.channels and "rates" not in flight.derived:
        told = filled(flight.channel("rates"))[sure]
        made = smooth(rates_of(filled(flight.channel("attitude")), flight.time), flight.period, 0.03)[sure]
        seen = [one for axis in (0, 1) if (one := lag(told[:, axis], made[:, axis], flight.period))]
        if seen:
            late, alike = (float(np.mean(parts)) for parts in zip(*seen, strict=True))
            by = f"{1e3 * abs(late):.0f} ms"
            when = f"{'lags' if late > 0 else 'leads'} the rates by {by}" if by != "0 ms" else "is in step with the rates"
            text = f"attitude {when} (correlation {alike:.2f})"
            found.append(Finding(abs(late) > 0.1, text))
    if "setpoint" in flight.channels and "position" in flight.channels:
        for axis in (0, 1):
            goal, place = (filled(flight.channel(name))[sure, axis] for name in ("setpoint", "position"))
            behind = lag(goal, place, flight.period, 1.0) if goal.std() > 0.1 else None
            if behind:
                found.append(Finding(False, f"position lags the setpoint by {1e3 * behind.lag:.0f} ms along {AXES[axis]}"))
    return found


def filled(values: Floats) -> Floats:
    """The channel with missing numbers replaced by the last known one."""
    good: Flags = np.isfinite(values.sum(axis=1))
    if good.all() or not good.any():
        return np.nan_to_num(values)
    latest = np.maximum.accumulate(np.where(good, np.arange(len(values)), np.flatnonzero(good)[0]))
    return values[latest]


def finite(sure: Flags, *channels: Floats) -> Flags:
    """Rows around which all channels were measured, for about a tenth of a second on either side."""
    missing: Flags = np.zeros(len(sure), dtype=bool)
    for values in channels:
        missing |= ~np.isfinite(values).all(axis=1)
    if missing.any():
        missing = np.convolve(missing, np.ones(2 * MARGIN + 1), "same") > 0.0
    return sure & ~missing
