"""`quadstep advise`: margins measured in flight, beside a model's, and which gains would repair them."""

import hashlib
import math
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadstep.identify.excited import AXES, Excited, excited
from quadstep.identify.logs.flight import damage
from quadstep.identify.response import Crossing, Response, crossovers, determined, gain_margins, margin
from quadstep.io import files
from quadstep.io.errors import UserError
from quadstep.io.results.record import FIGURES
from quadstep.io.version import __version__
from quadstep.linear.analysis import studied
from quadstep.linear.channels import Channel
from quadstep.linear.margins import Margins
from quadstep.linear.picture import Open, draw_bode
from quadstep.linear.transfer import harmonic, opened
from quadstep.metrics.margins import LEAST_GAIN, LEAST_PHASE
from quadstep.metrics.statistics import Estimate
from quadstep.mission.read import read_mission
from quadstep.report.evidence import Evidence, Figure, Table
from quadstep.report.page import Fact
from quadstep.report.publish import publishing
from quadstep.report.sheet import Sheet

RATE_GAINS = {
    axis: tuple(f"ATC_RAT_{name}_{gain}" for gain in "PID") for axis, name in zip(AXES, ("RLL", "PIT", "YAW"), strict=True)
}
"""ArduPilot's gains that together scale a whole command."""

FACTORS = np.geomspace(1.0, 0.25, 57)
"""Factors on the gains that are tried, the largest first."""

PARAMETERS = "advised.param"


class Measured(NamedTuple):
    """phase: the crossover with the smallest phase margin [rad], as `sized`; gain: where the gain may grow least, by which
    factor; None where the excitation tells of none. open: crossovers whose phase margin it does not tell. highest: excited
    frequency [rad/s].
    """

    phase: Crossing | None
    gain: Crossing | None
    open: tuple[Crossing, ...]
    highest: float

    @property
    def decibels(self) -> Estimate | None:
        """How far the gain may grow [dB]."""
        return None if self.gain is None else Estimate(*(20.0 * math.log10(one) for one in self.gain.value))

    @property
    def doubtful(self) -> bool:
        """Whether a crossover whose phase margin is not told may have less than a sound loop's."""
        return any(sized(one.value).low < LEAST_PHASE for one in self.open)

    def sound(self, end: str) -> bool:
        """Whether the margins at this end of their intervals, "low" or "high", are those of a sound loop."""
        gain = self.decibels
        enough = gain is None or getattr(gain, end) >= LEAST_GAIN
        return enough and self.phase is not None and getattr(self.phase.value, end) >= LEAST_PHASE


class Advice(NamedTuple):
    """A factor on the gains of a command, and what the measured response says of the loop with it."""

    factor: float
    expected: Measured


def measured(found: Response) -> Measured:
    """The margins of a response."""
    crossings = crossovers(found)
    upward = [one for one in gain_margins(found) if one.value.value > 1.0]
    gain, phase = min(upward, key=lambda one: one.value.value, default=None), margin(crossings)
    left = tuple(one for one in crossings if not determined(one))
    return Measured(phase and phase._replace(value=sized(phase.value)), gain, left, float(found.omega[-1]))


def sized(one: Estimate) -> Estimate:
    """A phase margin either way, lag or lead, as a size."""
    return one if one.value >= 0.0 else Estimate(-one.value, -one.high, -one.low)


def advised(found: Response, now: Measured) -> Advice | None:
    """The largest factor with which the loop would be sound at the lower ends of its intervals; None where the loop may be
    sound as it is, or where no factor makes it so.
    """
    if now.sound("high"):
        return None
    for factor in map(float, FACTORS):
        expected = measured(found.scaled(factor))
        if expected.sound("low"):
            return Advice(factor, expected)
    return None


def advise(
    path: Path, columns: tuple[str, str] | None, mission: Path | None, folder: Path, overwrite: bool, sheet: Sheet
) -> Evidence:
    """The advice that a log carries, in its folder. mission: whose model stands beside. Raises UserError."""
    flight = excited(path, columns)
    now = measured(flight.measured)
    if now.phase is None:
        raise UserError(untold(path, flight, now))
    identity = hashlib.sha256(files.read_bytes(path, files.LOG) + repr((columns, mission)).encode()).hexdigest()
    model = modelled(mission, flight) if mission else None
    with publishing(folder, f"advise-{identity}", overwrite) as out:
        found = evidence(out, path, flight, now, model, sheet)
        found.write(out)
    return found._replace(commands=[f"Parameters to load: {folder / PARAMETERS}"] if found.record["changes"] else [])


def untold(path: Path, flight: Excited, now: Measured) -> str:
    """Why a log tells no phase margin."""
    omega = flight.measured.omega
    where = f"{path}: {flight.source[1]}: between {omega[0]:.3g} and {omega[-1]:.3g} rad/s, which were excited, "
    if now.open:
        return where + "the phase margin is not known within 10 degrees; excite with a larger magnitude, or for longer"
    return where + "the open loop's gain does not cross 1; excite wider"


class Model(NamedTuple):
    """The loop of a mission. margins: of the same command; loop: L at the frequencies of the measured one."""

    name: str
    margins: Margins
    loop: NDArray[np.complex128]


def modelled(path: Path, flight: Excited) -> Model:
    """The loop that a mission models. Raises UserError where it has none, or no such command."""
    mission = read_mission(path)
    try:
        found = studied(mission).analysis
    except UserError as error:
        raise UserError(f"{path}: {error}") from None
    names = [one.name for one in found.channels]
    if not found.stable or flight.axis not in names:
        what = f"has no command {flight.axis}" if found.stable else "its loop at rest is unstable: it has no margins"
        raise UserError(f"{path}: {what}")
    place = names.index(flight.axis)
    return Model(mission.name, found.margins[place], harmonic(opened(found.loop), flight.measured.omega)[:, place])


def evidence(out: Path, path: Path, flight: Excited, now: Measured, model: Model | None, sheet: Sheet) -> Evidence:
    """What was measured and what follows, for its readers; draws the response, and writes the parameters to load."""
    assert now.phase
    advice = advised(flight.measured, now)
    changes = changed(flight, advice) if advice else {}
    if changes:
        lines = [f"{name},{value:.6g}\n" for name, (_, value) in changes.items()]
        (out / PARAMETERS).write_text("".join(lines), encoding="utf-8")
    (out / FIGURES).mkdir()
    loops = [flight.measured.opened, *([model.loop] if model else [])]
    channels = tuple(Channel(name, "") for name in ("measured", "modelled")[: len(loops)])
    shown = Open(channels, flight.measured.omega, np.stack(loops, axis=1))
    draw_bode(out / FIGURES / "bode", f"{path.stem}, {flight.axis}", shown, sheet.with_svg())
    answer = sentence(flight, now)
    more = [*following(flight, now, advice), *also(flight, now)]
    rows = margin_rows(now, model, advice)
    tables = [Table("Margins", "margins", HEADER, rows, METHOD, shown=f"{path.stem}: margins of {flight.axis}")]
    if changes:
        cells = [(name, f"{old:.4g}", f"{new:.4g}") for name, (old, new) in changes.items()]
        tables.append(Table("Changes", "changes", ("parameter", "now", "advised"), cells, shown="Changes"))
    return Evidence(
        name=f"{path.stem}, {flight.axis}",
        kind="Advice",
        answer=answer,
        sentences=[answer, *more],
        record={
            "name": path.stem, "version": __version__, "log": str(path), "axis": flight.axis, "columns": list(flight.source),
            "crossover[rad/s]": now.phase.at.as_json(), "phase_margin[rad]": now.phase.value.as_json(),
            "gain_margin_up[dB]": now.decibels.as_json() if now.decibels else None,
            "excited[rad/s]": [float(flight.measured.omega[0]), now.highest],
            "modelled": model and {"phase_margin[rad]": model.margins.phase, "crossover[rad/s]": model.margins.phase_at},
            "factor": advice and advice.factor, "changes": {name: new for name, (_, new) in changes.items()},
        },
        facts=[Fact("phase margin", *degrees(now.phase.value)), Fact("crossover", *hertz(now.phase.at))],
        figures=[Figure(f"{FIGURES}/bode", "The open loop at the controller's command", label="Open loop")],
        tables=tables,
        more=more,
        warnings=[f"{damage(flight.damaged)}; what could not be read is left out"] if flight.damaged else [],
    )  # fmt: skip


def changed(flight: Excited, advice: Advice) -> dict[str, tuple[float, float]]:
    """The parameters to change, now and then; empty where the log does not name them, or a feed-forward bypasses them."""
    names = RATE_GAINS.get(flight.axis, ())
    if not names or any(name not in flight.parameters for name in names) or bypassed(flight):
        return {}
    values = {name: flight.parameters[name] for name in names}
    return {name: (value, advice.factor * value) for name, value in values.items() if value}


def bypassed(flight: Excited) -> bool:
    """Whether part of the command does not pass the gains."""
    return any(flight.parameters.get(f"{name[:-1]}FF", 0.0) != 0.0 for name in RATE_GAINS.get(flight.axis, ())[:1])


HEADER = ("", "crossover [rad/s]", "phase margin [°]", "gain up [dB]")
METHOD = (
    "The open loop at the controller's command, outer loops included, from an excitation that was added to it. The 95 % "
    "intervals come from what the excitation does not explain."
)


def margin_rows(now: Measured, model: Model | None, advice: Advice | None) -> list[tuple[str, ...]]:
    """Measured, modelled, and expected with the changes."""
    rows: list[tuple[str, ...]] = [("measured", *margin_cells(now))]
    if model:
        one = model.margins
        up = f"{one.up:.1f}" if math.isfinite(one.up) else "none"
        rows.append((f"model: {model.name}", f"{one.phase_at:.3g}", f"{math.degrees(one.phase):.1f}", up))
    if advice:
        rows.append((f"expected, gains x {advice.factor:.2f}", *margin_cells(advice.expected)))
    return rows


def margin_cells(one: Measured) -> tuple[str, str, str]:
    """A row of `HEADER` without its name."""
    assert one.phase
    phase, gain = Estimate(*map(math.degrees, one.phase.value)), one.decibels
    cells = (spelled(one.phase.at, ".3g"), spelled(phase, ".1f"))
    return *cells, spelled(gain, ".1f") if gain else f"none up to {one.highest:.3g} rad/s"


def spelled(one: Estimate, digits: str) -> str:
    """A number with its interval."""
    return f"{one.value:{digits}} ({one.low:{digits}} to {one.high:{digits}})"


def degrees(one: Estimate) -> tuple[str, str]:
    """An angle and its interval in words."""
    value, low, high = map(math.degrees, one)
    return f"{value:.1f}°", f"{low:.1f} to {high:.1f}°"


def hertz(one: Estimate) -> tuple[str, str]:
    """A frequency and its interval in words."""
    return f"{one.value:.3g} rad/s", f"{one.low:.3g} to {one.high:.3g} rad/s"


def sentence(flight: Excited, now: Measured) -> str:
    """What was measured."""
    assert now.phase
    phase, at = degrees(now.phase.value), hertz(now.phase.at)
    gain = f"the gain may grow by {spelled(now.decibels, '.1f')} dB" if now.decibels else (
        f"no gain up to {now.highest:.3g} rad/s makes it unstable"
    )  # fmt: skip
    return f"The loop of {flight.axis} has a phase margin of {phase[0]} ({phase[1]}) at {at[0]} ({at[1]}); {gain}."


def following(flight: Excited, now: Measured, advice: Advice | None) -> Sequence[str]:
    """What follows from it."""
    asked = f"{math.degrees(LEAST_PHASE):.0f}° and {LEAST_GAIN:g} dB"
    if now.sound("low") and not now.doubtful:
        return [f"A sound loop has {asked}, and so has this one: no change of its gains is advised."]
    if now.sound("high"):
        return [
            f"Whether it has the {asked} of a sound loop, the intervals leave open: no change is advised; excite for longer."
        ]
    less = f"A sound loop has {asked}, this one less"
    if advice is None:
        return [f"{less}, and no common factor on its gains gives it that: none is advised."]
    if bypassed(flight):
        return [f"{less}. Its feed-forward passes the gains by, so that no factor on them is advised."]
    assert advice.expected.phase
    names = RATE_GAINS.get(flight.axis, ())
    known = bool(names) and all(name in flight.parameters for name in names)
    what = ", ".join(names) if known else "All gains of this command"
    expected = degrees(advice.expected.phase.value)
    return [f"{less}. {what} times {advice.factor:.2f}: by the measured response that gives {expected[0]} ({expected[1]})."]


def also(flight: Excited, now: Measured) -> Sequence[str]:
    """What else the log shows."""
    said = [
        f"At {one.at.value:.3g} rad/s the gain crosses 1 too; the excitation does not tell the phase margin there."
        for one in now.open
    ]
    return [*said, f"{100 * flight.noise:.0f} % of the command's deviation lie above the excited frequencies: noise."]
