"""`quadstep advise`: margins measured in flight, beside a model's, and which gains would repair them."""

import hashlib
import math
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadstep.identify.excited import Excited, excited
from quadstep.identify.logs.flight import damage
from quadstep.identify.response import Crossing, Response, crossovers, determined, gain_margins, margin
from quadstep.io import files
from quadstep.io.errors import UserError
from quadstep.io.parameter_files import FORMATS, Format
from quadstep.io.results.record import FIGURES
from quadstep.io.version import __version__
from quadstep.linear.analysis import studied
from quadstep.linear.margins import Margins
from quadstep.linear.picture import Open, draw_bode
from quadstep.linear.states import Channel
from quadstep.linear.transfer import harmonic, opened
from quadstep.metrics.margins import LEAST_GAIN, LEAST_PHASE, SOUND
from quadstep.metrics.statistics import Estimate
from quadstep.mission.read import read_mission
from quadstep.report.evidence import Evidence, Figure, Table
from quadstep.report.page import Fact
from quadstep.report.publish import publishing
from quadstep.report.sheet import Sheet

FACTORS = np.geomspace(1.0, 0.25, 57)
"""Factors on the gains that are tried, the largest first."""


class Measured(NamedTuple):
    """phase: the crossover with the smallest phase margin [rad], as `sized`, None if the excitation tells of none; up, down:
    where the gain may grow and fall least, by which factor, None where the phase crosses -180 degrees at no excited frequency
    and the gain margin is unknown. open: crossovers whose phase margin it does not tell. lowest, highest: excited [rad/s].
    """

    phase: Crossing | None
    up: Crossing | None
    down: Crossing | None
    open: tuple[Crossing, ...]
    lowest: float
    highest: float

    @property
    def gain_up(self) -> Estimate | None:
        """How far the gain may grow [dB]."""
        return self.up and decibels(self.up.value)

    @property
    def gain_down(self) -> Estimate | None:
        """How far the gain may fall [dB], above 0."""
        if self.down is None:
            return None
        value, low, high = decibels(self.down.value)
        return Estimate(-value, -high, -low)

    @property
    def shares(self) -> list[Estimate]:
        """The margins that are known, in units of a sound loop's."""
        gains = [(one, LEAST_GAIN) for one in (self.gain_up, self.gain_down) if one]
        phases = [(self.phase.value, LEAST_PHASE)] if self.phase else []
        return [Estimate(*(end / least for end in one)) for one, least in gains + phases]

    @property
    def fragile(self) -> bool:
        """Whether a margin is below that of a sound loop with 95 % confidence."""
        return any(one.high < 1.0 for one in self.shares)

    @property
    def sound(self) -> bool:
        """Whether all margins are those of a sound loop with 95 % confidence; never where one of them is unknown."""
        doubtful = any(sized(one.value).low < LEAST_PHASE for one in self.open)
        return len(self.shares) == 3 and not doubtful and all(one.low >= 1.0 for one in self.shares)

    @property
    def grade(self) -> str:
        return SOUND if self.sound else "fragile" if self.fragile else "unknown"


class Advice(NamedTuple):
    """A factor on the gains of a command, and what the measured response says of the loop with it."""

    factor: float
    expected: Measured


def measured(found: Response) -> Measured:
    crossings, turns = crossovers(found), gain_margins(found)
    up = min((one for one in turns if one.value.value >= 1.0), key=lambda one: one.value.value, default=None)
    down = max((one for one in turns if one.value.value < 1.0), key=lambda one: one.value.value, default=None)
    phase = margin(crossings)
    left = tuple(one for one in crossings if not determined(one))
    ends = float(found.omega[0]), float(found.omega[-1])
    return Measured(phase and phase._replace(value=sized(phase.value)), up, down, left, *ends)


def sized(one: Estimate) -> Estimate:
    """A phase margin either way, lag or lead, as a size."""
    return one if one.value >= 0.0 else Estimate(-one.value, -one.high, -one.low)


def decibels(factor: Estimate) -> Estimate:
    return Estimate(*(20.0 * math.log10(max(one, 1e-300)) for one in factor))


def advised(found: Response, now: Measured) -> Advice | None:
    """The largest factor with which the loop would be sound at the lower ends of its intervals; None where the loop may be
    sound as it is, or where no factor is known to make it so. The loop is stable as flown, and with smaller gains until the
    gain has fallen to where its phase crosses -180 degrees.
    """
    floor = max((one.value.high for one in gain_margins(found) if one.value.low < 1.0), default=0.0)
    tried = FACTORS[floor < FACTORS] if now.fragile else ()
    expected = ((float(factor), measured(found.scaled(float(factor)))) for factor in tried)
    return next((Advice(*one) for one in expected if one[1].sound), None)


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
    name = advised_file(flight) if found.record["changes"] else None
    return found._replace(commands=[f"Parameters to load: {folder / name}"] if name else [])


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
        text = format_of(flight).write({name: value for name, (_, value) in changes.items()}, {})
        (out / advised_file(flight)).write_text(text, encoding="utf-8")
    (out / FIGURES).mkdir()
    loops = [flight.measured.opened, *([model.loop] if model else [])]
    channels = tuple(Channel(name, "") for name in ("measured", "modelled")[: len(loops)])
    shown = Open(channels, flight.measured.omega, np.stack(loops, axis=1))
    draw_bode(out / FIGURES / "bode", shown, sheet.with_svg())
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
            "gain_margin_up[dB]": now.gain_up and now.gain_up.as_json(),
            "gain_margin_down[dB]": now.gain_down and now.gain_down.as_json(),
            "grade": now.grade, "excited[rad/s]": [now.lowest, now.highest],
            "modelled": model and {"phase_margin[rad]": model.margins.phase, "crossover[rad/s]": model.margins.phase_at},
            "factor": advice and advice.factor, "changes": {name: new for name, (_, new) in changes.items()},
        },
        facts=[Fact("phase margin", *degrees(now.phase.value)), Fact("crossover", *hertz(now.phase.at))],
        figures=[Figure(f"{FIGURES}/bode", "The open loop at the controller's command", label="Open loop")],
        sections=tables,
        more=more,
        warnings=[f"{damage(flight.damaged)}; what could not be read is left out"] if flight.damaged else [],
    )  # fmt: skip


def format_of(flight: Excited) -> Format:
    """In which the autopilot of a flight keeps its parameters."""
    assert flight.loop
    found: Format = FORMATS.load(flight.loop.form)
    return found


def advised_file(flight: Excited) -> str:
    """The name of the file with what changes."""
    return f"advised{format_of(flight).suffixes[0]}"


def changed(flight: Excited, advice: Advice) -> dict[str, tuple[float, float]]:
    """The parameters to change, now and then; empty where the log does not name them, or a feed-forward bypasses them."""
    values = (flight.loop and not bypassed(flight) and flight.loop.gains(flight.parameters)) or {}
    return {name: (value, advice.factor * value) for name, value in values.items() if value}


def bypassed(flight: Excited) -> bool:
    """Whether part of the command does not pass the gains."""
    return flight.loop is not None and flight.loop.bypassed(flight.parameters)


HEADER = ("", "crossover [rad/s]", "phase margin [°]", "gain up [dB]", "gain down [dB]")
METHOD = (
    "The open loop at the controller's command, outer loops included, from an excitation that was added to it or that the "
    "setpoint made of it. The 95 % intervals come from what this does not explain."
)


def margin_rows(now: Measured, model: Model | None, advice: Advice | None) -> list[tuple[str, ...]]:
    """Measured, modelled, and expected with the changes."""
    rows: list[tuple[str, ...]] = [("measured", *margin_cells(now))]
    if model:
        one = model.margins
        gains = [f"{gain:.1f}" if math.isfinite(gain) else "none" for gain in (one.up, one.down)]
        rows.append((f"model: {model.name}", f"{one.phase_at:.3g}", f"{math.degrees(one.phase):.1f}", *gains))
    if advice:
        rows.append((f"expected, gains x {advice.factor:.2f}", *margin_cells(advice.expected)))
    return rows


def margin_cells(one: Measured) -> tuple[str, ...]:
    """A row of `HEADER` without its name."""
    assert one.phase
    phase = Estimate(*map(math.degrees, one.phase.value))
    sides = (one.gain_up, f"above {one.highest:.3g}"), (one.gain_down, f"below {one.lowest:.3g}")
    gains = (spelled(gain, ".1f") if gain else f"unknown {where} rad/s" for gain, where in sides)
    return spelled(one.phase.at, ".3g"), spelled(phase, ".1f"), *gains


def spelled(one: Estimate, digits: str) -> str:
    return f"{one.value:{digits}} ({one.low:{digits}} to {one.high:{digits}})"


def degrees(one: Estimate) -> tuple[str, str]:
    """An angle and its interval in words."""
    value, low, high = map(math.degrees, one)
    return f"{value:.1f}°", f"{low:.1f} to {high:.1f}°"


def hertz(one: Estimate) -> tuple[str, str]:
    """A frequency and its interval in words."""
    return f"{one.value:.3g} rad/s", f"{one.low:.3g} to {one.high:.3g} rad/s"


def sentence(flight: Excited, now: Measured) -> str:
    assert now.phase
    phase, at = degrees(now.phase.value), hertz(now.phase.at)
    up, down = now.gain_up, now.gain_down
    gains = (
        f"up by {spelled(up, '.1f')} dB" if up else f"upwards unknown above {now.highest:.3g} rad/s",
        f"down by {spelled(down, '.1f')} dB" if down else f"downwards unknown below {now.lowest:.3g} rad/s",
    )
    return (
        f"The loop of {flight.axis} has a phase margin of {phase[0]} ({phase[1]}) at {at[0]} ({at[1]}); "
        f"its gain margin is {', '.join(gains)}."
    )


def following(flight: Excited, now: Measured, advice: Advice | None) -> Sequence[str]:
    asked = f"{math.degrees(LEAST_PHASE):.0f}° and {LEAST_GAIN:g} dB both ways"
    if now.sound:
        where = f"between {now.lowest:.3g} and {now.highest:.3g} rad/s, where it was excited"
        return [f"A sound loop has {asked}, and so has this one {where}: no change of its gains is advised."]
    wider = [*([] if now.up else ["faster"]), *([] if now.down else ["slower"])]
    untold = f"excite {' and '.join(wider)}: its phase crosses -180° outside what was excited" if wider else ""
    if not now.fragile:
        why = f"the excitation does not tell: {untold}" if wider else "the intervals leave open: excite for longer"
        return [f"Whether it has the {asked} of a sound loop, {why}. No change is advised."]
    less = f"A sound loop has {asked}, this one less"
    if advice is None:
        return [
            f"{less}. No common factor on its gains is known to give it that: none is advised{f'; {untold}' * bool(wider)}."
        ]
    if bypassed(flight):
        return [f"{less}. Its feed-forward passes the gains by, so that no factor on them is advised."]
    assert advice.expected.phase
    what = ", ".join((flight.loop and flight.loop.gains(flight.parameters)) or ["All gains of this command"])
    expected = degrees(advice.expected.phase.value)
    return [f"{less}. {what} times {advice.factor:.2f}: by the measured response that gives {expected[0]} ({expected[1]})."]


def also(flight: Excited, now: Measured) -> Sequence[str]:
    said = [
        f"At {one.at.value:.3g} rad/s the gain crosses 1 too; the excitation does not tell the phase margin there."
        for one in now.open
    ]
    return [*said, f"{100 * flight.noise:.0f} % of the command's deviation lie above the excited frequencies: noise."]
