"""`quadstep advise`: margins measured in flight, beside a model's, and which gains would repair them."""

import hashlib
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadstep.identify.changes import FINE, NOISY, Advice, changed_parameters, changes, factors, lags, loud
from quadstep.identify.excited import Excited, excited
from quadstep.identify.logs.flight import damage
from quadstep.identify.measured import HIDDEN, HiddenResonance, MeasuredLoop, degrees, hertz, measured, spelled
from quadstep.identify.plant import IdentifiedPlant, loop_margins
from quadstep.identify.rate_loops import RateLoop
from quadstep.identify.response import UNSURE
from quadstep.identify.setpoint_response import faster
from quadstep.identify.symptoms import OFTEN, saturation, symptoms
from quadstep.io import __version__, files
from quadstep.io.errors import UserError, errors_in
from quadstep.io.parameter_files import FORMATS, Format
from quadstep.io.run_record import FIGURES
from quadstep.linear.analysis import analyse_rest
from quadstep.linear.margins import Margins
from quadstep.linear.states import Channel
from quadstep.linear.tables import OpenLoop, draw_bode
from quadstep.linear.transfer import harmonic, opened
from quadstep.metrics.registry import LEAST_GAIN, LEAST_PHASE, SOUND
from quadstep.metrics.statistics import NORMAL, student_quantile
from quadstep.mission.read import read_mission
from quadstep.report.evidence import Evidence, Figure, TableSection
from quadstep.report.markup import Fact
from quadstep.report.publish import publishing
from quadstep.report.sheet import Sheet, sheet
from quadstep.report.units import listed


def advise(
    path: Path,
    columns: tuple[str, str] | None,
    mission: Path | None,
    folder: Path,
    overwrite: bool,
    drawn_on: Sheet,
    name: str = "",
) -> Evidence:
    """The advice that a log carries, in its folder. mission: whose model stands beside; name: of the log, if not its path.

    Raises UserError.
    """
    flight = excited(path, columns)
    now, behind = loop_margins(flight)
    now = now._replace(limited=any(one.shows for one in saturation(flight)))
    if now.phase is None:
        raise UserError(why_no_phase_margin(path, flight, now))
    identity = hashlib.sha256(files.read_bytes(path, files.LOG) + repr((columns, mission)).encode()).hexdigest()
    model, advice = modelled_loop(mission, flight) if mission else None, changes(flight, now, behind)
    new, loaded = changed_parameters(flight, advice) if advice else {}, ""
    with publishing(folder, f"advise-{identity}", overwrite) as out:
        if new and flight.loop:
            form: Format = FORMATS.load(flight.loop.form)
            loaded = f"advised{form.suffixes[0]}"
            (out / loaded).write_text(form.write({name: value for name, (_, value) in new.items()}, {}), encoding="utf-8")
        (out / FIGURES).mkdir()
        draw_bode(out / FIGURES / "bode", loops(flight, now, model, advice), drawn_on.with_svg())
        found = evidence(path.stem, name or str(path), flight, now, behind, model, advice, new)
        found.write(out)
    return found._replace(commands=[f"Parameters to load: {folder / loaded}"] if new else [])


def advise_dropped(log: Path, name: str, root: Path) -> Path:
    """The advice that a log carries, in a folder below `root` that is named by the log's name and content; the folder.
    name: the log's, for its readers. Raises UserError.
    """
    folder = root / f"{Path(name).stem}-{hashlib.sha256(files.read_bytes(log, files.LOG)).hexdigest()[:8]}-advise"
    try:
        advise(log, None, None, folder, True, sheet("svg"), name)
    except UserError as error:
        raise UserError(str(error).replace(str(log), name)) from None
    return folder


def why_no_phase_margin(path: Path, flight: Excited, now: MeasuredLoop) -> str:
    """Why a log tells no phase margin."""
    omega = flight.measured.omega
    where = f"{path}: {flight.source[-1]}: between {omega[0]:.3g} and {omega[-1]:.3g} rad/s, which were excited, "
    stamps = flight.columns.get(flight.source[0]) if flight.loop and len(flight.source) == 3 else None
    if flight.loop and stamps and now.open:  # the time of a setpoint is known to within its logging period
        every = float(np.median(np.diff(stamps.time)))
        vague = min(NORMAL * one.at.value * every / math.sqrt(12.0) for one in now.open)
        if vague > UNSURE:
            said = f"{flight.source[0]} is logged every {1e3 * every:.3g} ms, which leaves the phase margin uncertain by"
            return f"{where}{said} {math.degrees(vague):.0f} degrees{faster(flight.loop.form, flight.parameters)}"
    if now.open:
        return where + "the phase margin is not known within 10 degrees; excite with a larger magnitude, or for longer"
    return where + "the open loop's gain does not cross 1; excite a wider range of frequencies"


class ModelledLoop(NamedTuple):
    """The loop of a mission. margins: of the same command; loop: L at the frequencies of the measured one."""

    name: str
    margins: Margins
    loop: NDArray[np.complex128]


def modelled_loop(path: Path, flight: Excited) -> ModelledLoop:
    """The loop that a mission models. Raises UserError where it has none, or no such command."""
    mission = read_mission(path)
    with errors_in(path):
        found = analyse_rest(mission).analysis
    names = [one.name for one in found.channels]
    if not found.stable or flight.axis not in names:
        what = f"has no command {flight.axis}" if found.stable else "its loop at rest is unstable, so it has no margins"
        raise UserError(f"{path}: {what}")
    place = names.index(flight.axis)
    return ModelledLoop(mission.name, found.margins[place], harmonic(opened(found.loop), flight.measured.omega)[:, place])


def evidence(
    stem: str, log: str, flight: Excited, now: MeasuredLoop, behind: IdentifiedPlant | None,
    model: ModelledLoop | None, advice: Advice | None, new: dict[str, tuple[float, float]],
) -> Evidence:  # fmt: skip
    """What was measured and what follows, for its readers. stem, log: name of the log, and where it is; new: parameters."""
    assert now.phase
    first = [verdict(flight, now, advice, new), sentence(flight, now)]
    answer, seen = " ".join(first[::-1] if flight.changed or now.limited else first), symptoms(flight, now, advice)
    more = [
        *next_steps(flight, now, advice),
        *of_other_axes(flight),
        *([behind.sentence] if behind else []),
        *further_remarks(flight, now),
    ]
    more += [one.sentence for one in seen if one.shows]
    rows = margin_rows(now, behind, model, advice, flight.loop, new)
    lines = [(one.name, one.measured, one.threshold) for one in seen]
    cuts = [
        (name, f"{flight.parameters[name]:.4g}", f"{math.degrees(lag):.1f}")
        for name, lag in lags(flight, now.phase.at.value).items()
    ]
    cells = [(name, *(f"{one:.4g}" for one in both)) for name, both in new.items()]
    tables = [
        TableSection("Margins", "margins", HEADER, rows, METHOD, shown=f"{stem}: margins of {flight.axis}"),
        TableSection("Symptoms", "symptoms", SYMPTOMS, lines, ELSE, shown=f"{stem}: besides margins"),
        TableSection("Low-passes", "filters", FILTERS, cuts, COST, shown=f"{stem}: low-passes of {flight.axis}"),
        TableSection("Changes", "changes", ("parameter", "now", "advised"), cells, shown="Changes"),
    ]
    return Evidence(
        name=f"{stem}, {flight.axis}",
        kind="Advice",
        answer=answer,
        sentences=[answer, *more],
        record={
            "name": stem, "version": __version__, "log": log, "axis": flight.axis, "columns": list(flight.source),
            "crossover[rad/s]": now.phase.at.as_json(), "phase_margin[rad]": now.phase.value.as_json(),
            "gain_margin_up[dB]": now.gain_up and now.gain_up.as_json(),
            "gain_margin_down[dB]": now.gain_down and now.gain_down.as_json(), "least_gain_margin_down[dB]": now.floor,
            "grade": now.grade, "hidden_resonance": hidden_record(now, advice),
            "changed_in_log": list(flight.changed), "excited[rad/s]": [now.lowest, now.highest],
            "modelled": model and {"phase_margin[rad]": model.margins.phase, "crossover[rad/s]": model.margins.phase_at},
            "plant": behind and behind.as_json(),
            "symptoms": {one.name: one.measured for one in seen},
            "factor": advice and advice.factor, "changes": {name: then for name, (_, then) in new.items()},
        },
        facts=facts(now, advice),
        figures=[Figure(f"{FIGURES}/bode", caption(now, advice, model), label="Open loop")],
        sections=[one for one in tables if one.rows],
        more=more,
        fold=("filters", "symptoms"),
        warnings=[f"{damage(flight.damaged)}; what could not be read is left out"] if flight.damaged else [],
    )  # fmt: skip


def facts(now: MeasuredLoop, advice: Advice | None) -> list[Fact]:
    """The margins measured, and the phase margin with what is advised."""
    assert now.phase
    gains = (("gain margin up", now.gain_up), ("gain margin down", now.gain_down))
    found = [Fact("phase margin", *degrees(now.phase.value)), Fact("crossover", *hertz(now.phase.at))]
    found += [Fact(name, f"{one.value:.1f}\u00a0dB", f"{one.low:.1f} to {one.high:.1f}\u00a0dB") for name, one in gains if one]
    expected = advice.expected.phase if advice else None
    return [*found, *([Fact("phase margin as advised", *degrees(expected.value))] if expected else [])]


def hidden_record(now: MeasuredLoop, advice: Advice | None) -> dict[str, float | None] | None:
    """What noise may hide, as flown and as advised; with more than `most` no loop is called sound."""
    if now.hidden is None:
        return None
    then = advice.expected.hidden.gain if advice and advice.expected.hidden else None
    return {"at[rad/s]": now.hidden.at, "gain": now.hidden.gain, "gain_as_advised": then, "most": HIDDEN}


def loops(flight: Excited, now: MeasuredLoop, model: ModelledLoop | None, advice: Advice | None) -> OpenLoop:
    """The open loop as measured, with its interval and margins, as it would be with what is advised, and as modelled."""
    found = flight.measured
    drawn = {"measured": found.opened}
    if advice:
        drawn["with the advised changes"] = found.scaled(factors(flight, advice, found.omega)).opened
    if model:
        drawn["modelled"] = model.loop
    half = np.array([student_quantile(0.975, float(freedom)) for freedom in found.freedom]) * found.opened_error
    channels = tuple(Channel(name, "") for name in drawn)
    told = [one.phase for one in (now, *([advice.expected] if advice else []))]
    phases = [(i, math.degrees(one.value.value), one.at.value) for i, one in enumerate(told) if one]
    gains = [(0, sign * one.value) for sign, one in ((1.0, now.gain_up), (-1.0, now.gain_down)) if one]
    return OpenLoop(channels, found.omega, np.stack([*drawn.values()], axis=1), half / np.abs(found.opened), phases, gains)


def caption(now: MeasuredLoop, advice: Advice | None, model: ModelledLoop | None = None) -> str:
    """What to see in the open loop."""
    assert now.phase
    said = (
        "The open loop at the controller's command, measured with its 95 % interval. Where |L| crosses 0 dB, at "
        f"{hertz(now.phase.at)[0]}, its phase is {degrees(now.phase.value)[0]} from -180°"
    )
    if advice and (then := advice.expected.phase):
        said += f"; with the advised changes (dashed) it crosses at {hertz(then.at)[0]}, {degrees(then.value)[0]} from -180°"
    modelled = "; “modelled” is the mission's loop" * bool(model)
    return f"{said}. The bars are these distances and, left, the gain margins that are known{modelled}."


HEADER = ("", "crossover [rad/s]", "phase margin [°]", "gain up [dB]", "gain down [dB]")
METHOD = (
    "The open loop at the controller's command, outer loops included, measured with an excitation that was added to the "
    "command or came from the setpoint. Resonances beyond the excited frequencies do not count. The 95 % intervals come from "
    "the part of the command that the excitation does not explain."
)


SYMPTOMS = ("", "measured", "based on")
ELSE = "Other findings from the same stretch of flight. Quantities that the log does not show are omitted."
FILTERS = ("parameter", "cut-off [Hz]", "phase at the crossover [°]")
COST = (
    "The phase lag that each low-pass adds to the open loop at the measured crossover, by the log's parameters (negative: "
    "a lead). Notches are not counted."
)


def margin_rows(
    now: MeasuredLoop, behind: IdentifiedPlant | None, model: ModelledLoop | None, advice: Advice | None,
    loop: RateLoop | None, new: dict[str, tuple[float, float]],
) -> list[tuple[str, ...]]:  # fmt: skip
    """Measured, by the plant, modelled, and expected with the changes."""
    rows: list[tuple[str, ...]] = [] if now.by_plant else [("measured", *now.cells)]
    by_plant = measured(behind.loop) if behind and behind.explains else None
    rows += [("by the plant", *by_plant.cells)] if by_plant and by_plant.phase else []
    if model:
        one = model.margins
        gains = [f"{gain:.1f}" if math.isfinite(gain) else "none" for gain in (one.up, one.down)]
        rows.append((f"model: {model.name}", f"{one.phase_at:.3g}", f"{math.degrees(one.phase):.1f}", *gains))
    if advice:
        changed = [f"{name} {loop.valued(name, new[name][1])}" for name in advice.others] if loop else []
        changed += [f"gains × {advice.factor:.2f}"] if advice.factor != 1.0 or not changed else []
        rows.append((f"expected, {', '.join(changed)}", *advice.expected.cells))
    return rows


def verdict(flight: Excited, now: MeasuredLoop, advice: Advice | None, new: dict[str, tuple[float, float]]) -> str:
    """The grade, and what to change."""
    whole = f"The loop of {flight.axis} is {now.grade}"
    whole = f"Whether the loop of {flight.axis} is sound is not known" if now.grade == "unknown" else whole
    if new:
        return f"{whole}: set {listed([f'{name} to {then:.4g}' for name, (_, then) in new.items()])}."
    if advice and not (flight.loop and flight.loop.bypassed(flight.parameters)):
        return f"{whole}: multiply all gains of this command by {advice.factor:.2f}."
    return f"{whole}: no change is advised."


def sentence(flight: Excited, now: MeasuredLoop) -> str:
    """The margins."""
    assert now.phase
    phase, at = degrees(now.phase.value), hertz(now.phase.at)
    gains = [f"{way} {one}" for way, one in zip(("upwards", "downwards"), now.gains(" dB"), strict=True)]
    by = "According to the fitted plant, the" if now.by_plant else "The"
    if flight.changed:
        by = f"{listed(flight.changed)} changed in this log, so these may be the margins of no single loop. {by}"
    if now.limited:
        by = f"Motors were at a limit for more than {100.0 * OFTEN:g} % of the time: small motions may have less margin. {by}"
    less = now.hidden and now.doubtful and now.gain_up and now.hidden.leaves < now.gain_up.high
    hidden = f", unless {now.hidden.words} leaves less" if now.hidden and less else ""
    return (
        f"{by} loop of {flight.axis} has a phase margin of {phase[0]} ({phase[1]}) at {at[0]} ({at[1]}); "
        f"gain margins: {', '.join(gains)}{hidden}."
    )


def next_steps(flight: Excited, now: MeasuredLoop, advice: Advice | None) -> Sequence[str]:
    asked = f"{math.degrees(LEAST_PHASE):.0f}° and {LEAST_GAIN:g} dB both ways"
    wider = [*([] if now.up else ["faster"]), *([] if now.down or now.floor is not None else ["slower"])]
    untold = f"excite {' and '.join(wider)}: its phase crosses -180° outside what was excited" if wider else ""
    where = f"between {now.lowest:.3g} and {now.highest:.3g} rad/s, where it was excited"
    if now.lacking:
        first = f"A sound loop has {asked}; this one lacks {listed(now.lacking)}"
    elif now.grade == SOUND:
        first = f"A sound loop has {asked}, and so does this one {where}"
        first += "" if now.hidden else "; a resonance beyond that is not judged"
    elif now.sound and not now.by_plant and now.limited:
        first = f"It has the {asked} of a sound loop {where}, but in motions that drove motors to a limit: fly more gently"
    elif now.sound and not now.by_plant and now.hidden:
        first = f"It has the {asked} of a sound loop {where}, but {less_left(now.hidden)}"
    else:
        what = "excitation does" if wider or now.by_plant else "intervals do"
        first = f"The {what} not show whether it has the {asked} of a sound loop: "
        first += "excite slower: its crossover was not excited" if now.by_plant else untold or "excite for longer"
    if advice is None:
        if now.lacking:
            none = "No gains or cut-offs within their documented ranges are known to give it that: no change is advised"
            return [f"{first}. {none}{f'; {untold}' * bool(wider)}."]
        return [f"{first}{': no change of its gains' if now.grade == SOUND else '. No change'} is advised."]
    if advice.factor != 1.0 and flight.loop and flight.loop.bypassed(flight.parameters):
        return [f"{first}. Its feed-forward bypasses the gains, so no factor on them is advised."]
    return [f"{first}. {expected_result(flight, advice)}"]


def less_left(hidden: HiddenResonance) -> str:
    """What noise may hide, and what excludes it."""
    longer = ", or fly longer: a longer record hides less" if hidden.gain < 1.0 else ""
    return f"{hidden.words} may leave less: excite beyond that frequency{longer}"


def expected_result(flight: Excited, advice: Advice) -> str:
    """What is advised and what it would bring, in a sentence."""
    expected = advice.expected
    assert expected.phase
    new, loop = changed_parameters(flight, advice), flight.loop
    gains = ", ".join(name for name in new if name not in advice.others) or "All gains of this command"
    changed = [loop.changed(name, *new[name]) for name in advice.others] if loop else []
    scaled = [f"{gains} times {advice.factor:.2f}"] if advice.factor != 1.0 else []
    phase = degrees(expected.phase.value)
    by = "plant" if expected.by_plant else "measured response"
    said = f"{' and '.join([', '.join(changed)] * bool(changed) + scaled)}: by the {by}, this gives {phase[0]} ({phase[1]})"
    if expected.by_plant and expected.gain_up:
        said += f" and {spelled(expected.gain_up, '.1f')} dB upwards"
    if expected.hidden and expected.doubtful:
        said += f"; but {less_left(expected.hidden)}"
    if advice.louder != 1.0:
        most = "at most " if advice.others and advice.louder > 1.0 and not expected.by_plant else ""
        said += f", with {most}{100.0 * abs(advice.louder - 1.0):.0f} % {'more' if advice.louder > 1.0 else 'less'} noise"
        said += " in the command"
    said += "".join(f". {one}" for one in range_ends(flight, new))
    if not expected.by_plant:
        return f"{said}."
    longer = f" for longer than {flight.end - flight.begin:.0f} s" if advice.held else ""
    why = ": the noise of a longer flight rules out smaller resonances, so gains may rise further" if advice.held else ""
    return f"{said}. Fly it{longer} and advise again{why}."


def range_ends(flight: Excited, new: dict[str, tuple[float, float]]) -> Iterator[str]:
    """Which new parameters reach the end of their documented ranges, to within a step of what is tried."""
    if loop := flight.loop:
        for name, (_, then) in new.items():
            low, high = loop.documented(name)
            if then * FINE > high or then < low * FINE:
                yield f"{name} is then at the end of the range that {loop.law.source} documents, {low:g} to {high:g}"


def of_other_axes(flight: Excited) -> Iterator[str]:
    """What the same log tells of the other axes."""
    for axis, one in ((other.axis, measured(other.measured)) for other in flight.others):
        if one.phase:
            phase, at = degrees(one.phase.value), hertz(one.phase.at)
            lacks = "; it lacks a sound loop's margins too: fly and advise again" if one.lacking else ""
            yield f"In the same log {axis} has a phase margin of {phase[0]} ({phase[1]}) at {at[0]} ({at[1]}){lacks}."


def further_remarks(flight: Excited, now: MeasuredLoop) -> Sequence[str]:
    said = [
        f"The gain also crosses 1 at {one.at.value:.3g} rad/s; the excitation does not determine the phase margin there."
        for one in now.open
    ]
    noise = f"Noise above the excited frequencies makes {100 * flight.noise:.0f} % of the command's standard deviation"
    if flight.loop:
        share = loud(flight)
        noise += (
            f". That is {100 * share:.2g} % of the whole command, {'more' if share > NOISY else 'less'} than {100 * NOISY:g} %"
        )
    return [*said, f"{noise}."]
