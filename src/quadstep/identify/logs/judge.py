"""Judging a log before it is used: what contradicts its mapping, and what cannot be learned from it."""

import math
import re
from collections.abc import Mapping, Sequence

import numpy as np

from quadstep.identify.logs.consistency import Finding, relations
from quadstep.identify.logs.flight import TURNING, Flags, FlightRecord, damage
from quadstep.io.errors import UserError
from quadstep.report.units import listed
from quadstep.vehicle.rigid_body import Geometry

SLOWEST = 0.03
"""Longest time between two commands from which turning can be learned [s]."""

FASTER = (
    "log them faster (PX4: SDLOG_PROFILE, high rate; ArduPilot: LOG_BITMASK, bits 0 and 10, fast attitude and RC output, "
    "on versions that then write RCOU faster than 10 Hz)"
)

LEAST = 3.0
"""Of a flight that anything is learned from [s]."""


def judge(flight: FlightRecord, geometry: Geometry | None = None) -> list[Finding]:
    """Errors in a log, then notes. geometry: of the vehicle that should have flown it."""
    found = [*flaws(flight)]
    if flight.flying.sum() * flight.period < LEAST:
        return [Finding(True, never_flew(flight)), *found]
    found += seldom(flight)
    sure = flight.flying & (flight.runs() > 0)
    if sure.sum() < 0.5 * flight.flying.sum():
        return sorted([*found, Finding(True, "most of the flight cannot be used")], key=lambda one: not one.wrong)
    found += [*relations(flight, sure, geometry), *excitation(flight, sure)]
    return sorted(found, key=lambda one: not one.wrong)


def refuse(name: str, findings: list[Finding]) -> None:
    """Raises UserError with everything that contradicts the mapping."""
    wrong = [one.text for one in findings if one.wrong]
    if wrong:
        raise UserError(f"{name}: {'; '.join(wrong)}; --trust-mapping skips these checks")


NUMBER = re.compile(r"(?<![\w.^])\d+(?:\.\d+)?(?:e[+-]\d+)?")


def in_few_lines(judged: Mapping[str, Sequence[Finding]]) -> list[str]:
    """The findings of each flight; those of several flights that differ only in their numbers in one line, with the least and
    the greatest.
    """
    alike: dict[str, dict[str, str]] = {}
    for name, findings in judged.items():
        for one in findings:
            alike.setdefault(NUMBER.sub("0", one.text), {})[name] = one.text
    lines = []
    for texts in alike.values():
        spans = [sorted(set(row), key=float) for row in zip(*map(NUMBER.findall, texts.values()), strict=True)]
        ends = iter([" to ".join(dict.fromkeys((row[0], row[-1]))) for row in spans])
        many, few = f"{len(texts)} of {len(judged)} flights", len(texts) <= NAMED and len(texts) < len(judged)
        who = listed(list(texts)) if len(texts) == 1 else f"{many} ({listed(list(texts))})" if few else many
        lines.append(f"{who}: {NUMBER.sub(lambda _: next(ends), next(iter(texts.values())))}")  # noqa: B023 (called at once)
    return lines


NAMED = 3
"""So many flights are named, more are counted."""


def never_flew(flight: FlightRecord) -> str:
    """Why a log does not contain a flight. Seconds are rounded down, so that 2.96 s are not called 3.0 s."""
    if not flight.turning.any():
        least = TURNING * (flight.motors.max() if flight.speeds else 1.0)
        still = [f"{number}" for number, one in enumerate(flight.motors.T, 1) if not one.max() > least]
        if len(still) == flight.motors.shape[1]:
            return "never flew: the rotors never turned"
        return (
            f"never flew: rotor{'s' * (len(still) > 1)} {listed(still)} never turned"
            if still
            else "never flew: the rotors never all turned at once"
        )
    high = flight.channel("position")[:, 2]
    span = float(np.nanmax(high) - np.nanmin(high)) if np.isfinite(high).any() else 0.0
    seconds = float(flight.flying.sum()) * flight.period
    heights = f"heights within {span:.2g} m (are their units correct?)"
    said = "never flew" if seconds == 0.0 else "flew too briefly"
    return f"{said}: {math.floor(10.0 * seconds) / 10.0:.1f} s in the air, {heights}; at least {LEAST:g} s are needed"


def flaws(flight: FlightRecord) -> list[Finding]:
    """Gaps, duplicate rows, lost commands, missing numbers, crashes."""
    found = []
    if flight.damaged:
        found.append(Finding(False, f"{damage(flight.damaged)}; what could not be read is left out", True))
    steps = np.diff(flight.time)
    twice = int((steps < 1e-9).sum())
    gaps = steps[steps > 1.5 * flight.period]
    uneven = int((~flight.follows[1:]).sum()) - twice - len(gaps)
    if twice:
        said = "1 row repeats" if twice == 1 else f"{twice} rows repeat"
        found.append(Finding(False, f"{said} the time of the row before"))
    if len(gaps):
        said = f"gaps in time: {len(gaps)}, the longest {1e3 * gaps.max():.0f} ms"
        found.append(Finding(False, f"{said}; no prediction crosses one"))
    if uneven > 0.3 * flight.rows:
        text = f"{100 * uneven / flight.rows:.0f} % of the steps in time differ by more than a tenth from {flight.period:g} s"
        found.append(Finding(True, text))
    if flight.lost.any():
        most = float(flight.motors.max())
        lost = int(flight.lost.sum())
        rows, above = f"{lost} row{'s' * (lost > 1)}", most > 1.0 and not flight.speeds
        text = f"{rows} with commands of up to {most:.3g} times full" if above else f"{rows} without a command"
        many = bool(lost > 0.2 * flight.turning.sum())
        right = "; is `full` correct?" if above else ""
        found.append(Finding(many, f"motors: {text}{right}" if many else f"{text}; left out"))
    for name, values in flight.channels.items():
        missing = float((~np.isfinite(values)).any(axis=1).mean())
        if missing > 0.0 and name != "voltage" and not name.startswith("law_"):  # a law flies only a part
            found.append(Finding(False, f"{name}: not measured in {100 * missing:.2g} % of the rows"))
    for name in flight.derived:
        found.append(Finding(False, f"{name}: not logged, derived from the channel that it is the rate of"))
    if "attitude" in flight.channels:
        q = flight.channel("attitude")
        tilt = 1.0 - 2.0 * (q[:, 1] ** 2 + q[:, 2] ** 2)
        over = np.flatnonzero(flight.flying & (tilt < 0.0))
        if len(over) > 0.5 * flight.flying.sum():
            found.append(Finding(True, "attitude: upside down for most of the flight; are `order` and `body` right?"))
        elif len(over):
            found.append(Finding(False, f"upside down, first after {flight.time[over[0]] - flight.time[0]:.1f} s: a crash?"))
    return found


def seldom(flight: FlightRecord) -> list[Finding]:
    """Whether commands of a flight are too far apart in time."""
    if flight.period <= SLOWEST:
        return []
    text = f"motors: a command every {1e3 * flight.period:.0f} ms; torques and the rotors' lag are seen only with one every"
    return [Finding(True, f"{text} {1e3 * SLOWEST:.0f} ms: {FASTER}")]


def barely_turned(flight: FlightRecord, where: Flags) -> dict[str, float]:
    """Axes about which it hardly turns there, with the standard deviation of the rate [rad/s]."""
    return {name: one for name, one in spreads(flight, where).items() if one < 0.1}


def spreads(flight: FlightRecord, where: Flags) -> dict[str, float]:
    """Standard deviation of the rate about each axis there [rad/s]; empty if rates were not logged."""
    if "rates" not in flight.channels:
        return {}
    found = np.nanstd(flight.channel("rates")[where], axis=0)
    return {name: float(one) for name, one in zip(("roll", "pitch", "yaw"), found, strict=True)}


def excitation(flight: FlightRecord, sure: Flags) -> list[Finding]:
    """Channels with so little excitation that little can be learned about them."""
    found = []
    for name, spread in barely_turned(flight, sure).items():
        text = f"{name} is barely excited ({spread:.2g} rad/s)"
        found.append(Finding(False, f"{text}: the {name} parameters will have wide intervals, or none"))
    if "velocity" in flight.channels:
        speed = float(np.nanpercentile(np.linalg.norm(flight.channel("velocity")[sure], axis=1), 95))
        if speed < 0.3:
            found.append(Finding(False, f"it flies no faster than {speed:.2g} m/s: it reveals little about drag"))
    return found
