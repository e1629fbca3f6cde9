"""Flights whose log tells how a loop answers an excitation of its command: reading them, and why some tell nothing."""

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from quadstep.identify.logs.flight import Floats, damage
from quadstep.identify.logs.read import of_topics, read_topics, refuse_empty
from quadstep.identify.logs.series import Series, Topics, refuse_backward
from quadstep.identify.measured import measured
from quadstep.identify.rate_loops import ARDUPILOT, AXES, BETAFLIGHT, COLUMNS, PX4, SINKING, RateLoop, limits
from quadstep.identify.response import FREE, Response, response
from quadstep.identify.setpoint_response import (
    EXPLAINED,
    SHORTEST,
    axis_excitation,
    columns_of,
    faster,
    latest,
    refuse_not_finite,
    refuse_slow,
    refuse_unchanged,
)
from quadstep.io.errors import UserError

LOOPS = {".bin": ARDUPILOT, ".ulg": PX4, ".ulog": PX4, ".bbl": BETAFLIGHT, ".bfl": BETAFLIGHT}
"""Whose logs these are."""

LOOPS_OF = {"px4": PX4, "ardupilot": ARDUPILOT, "betaflight": BETAFLIGHT}
"""All axes of an autopilot."""

EXCITATION = "SIDD.Targ"
"""The waveform of ArduPilot's mode System Identification, which is in the commands of the rate controllers."""

CLIPPED, LARGEST = 0.999, 0.1
"""A command within this share of its largest counts as held there; largest share of time in which it may be."""

HEARD = 0.6
"""Least median coherence, as usual for frequency responses of aircraft (Tischler and Remple, "Aircraft and Rotorcraft System
Identification", 2nd edition, 2012).
"""


FEWEST = 200
"""Fewest samples of motors that tell a share, and a spectrum."""

FEWEST_POINTS, NARROWEST = 16, 2.0
"""Fewest frequencies at which a setpoint must be heard, and the least ratio of the highest to the lowest."""

ADVICE = {
    "px4": "or PX4's autotune, with the high-rate profile (bit 4 of SDLOG_PROFILE)",
    "ardupilot": "or the mode System Identification with SID_AXIS 10 (roll), 11 (pitch) or 12 (yaw)",
    "betaflight": "in acro, logged at 500 Hz or more",
}
"""What to fly."""


class Excited(NamedTuple):
    """An excitation in flight. axis: whose command it is in; source: the columns. measured: what the loop answered.
    excitation, command (n,): samples a `period` [s] apart. parameters: of the autopilot, by name, where the log has them.
    damaged: places of the log that could not be read. loop: of the autopilot, where its columns are known. levelled: whether
    the attitude loop gave the setpoint. others: the other axes whose response the same log tells. begin: time of the first
    sample [s]; rate: the gyro (n,), filtered, None where it is not known which; columns: all that was read of the log.
    changed: parameters of the loop that were something else before.
    """

    axis: str
    source: tuple[str, ...]
    measured: Response
    excitation: Floats
    command: Floats
    period: float
    parameters: Mapping[str, float]
    damaged: int = 0
    loop: RateLoop | None = None
    levelled: bool = True
    others: tuple["Excited", ...] = ()
    begin: float = 0.0
    rate: Floats | None = None
    columns: Mapping[str, Series] = MappingProxyType({})
    changed: tuple[str, ...] = ()

    @property
    def end(self) -> float:
        """Time of the last sample [s]."""
        return self.begin + self.period * (len(self.command) - 1)

    @property
    def beyond(self) -> float:
        """What lies above the excited frequencies does so from here on [rad/s]."""
        return 1.05 * float(self.measured.omega[-1])

    @property
    def above(self) -> tuple[Floats, Floats]:
        """Frequencies above the excited ones [rad/s], and the power of the command there, the whole command's being 1."""
        spectrum = np.abs(np.fft.rfft(self.command - self.command.mean())) ** 2
        omega = (2.0 * np.pi * np.fft.rfftfreq(len(self.command), self.period)).astype(np.float64)
        beyond = omega > self.beyond
        return omega[beyond], spectrum[beyond] / max(float(spectrum.sum()), 1e-300)

    @property
    def noise(self) -> float:
        """The share of the command's standard deviation above the excited frequencies."""
        return float(np.sqrt(self.above[1].sum()))


def excited(path: Path, columns: tuple[str, str] | None) -> Excited:
    """The excitation in a log. columns: that of the excitation and that of the command which holds it; autopilots' are known.
    Raises UserError where there is none, or where it tells nothing of the loop.
    """
    if not of_topics(path):
        refuse_empty(path)
        raise UserError(f"{path}: should be the vehicle's own log, not a table made from it: .bin, .ulg, .bbl or .mcap")
    loops = LOOPS.get(path.suffix.lower(), ())
    if columns is None and not loops:
        raise UserError(
            f"{path}: which columns contain an excitation and the command that it was added to? give --columns X,Y"
        )
    symptoms = [one for loop in loops[:1] for one in (*COLUMNS[loop.form], SINKING.get(loop.form)) if one]
    found = read_topics(path, list(columns) if columns else [EXCITATION, *columns_of(loops), *symptoms])
    if columns is None and EXCITATION not in found.columns:
        return by_setpoint(path, found, loops)
    given, commands = (EXCITATION, [one.command for one in loops]) if columns is None else (columns[0], [columns[1]])
    if missing := {given, *commands[:1]} - {*found.columns} if columns else set():
        raise UserError(f"{path}: {' and '.join(sorted(missing))}: not in the log{damage_note(found)}")
    commands = [one for one in commands if one in found.columns and len(found.columns[one].time) > 1]
    if not commands:
        raise UserError(f"{path}: {given} is in the log, but not a command that contains it{damage_note(found)}")
    late, form = (loops[0].late(found.parameters), loops[0].form) if columns is None else (0.0, "")
    several = [sampled(path, found, given, one, late, form) for one in commands]
    measured = [response(*one[:3]) for one in several]
    best = max(range(len(measured)), key=lambda i: float(np.median(measured[i].coherence)))
    loop = next((one for one in loops if columns is None and one.command == commands[best]), None)
    axis, source = loop.axis if loop else commands[best], (given, commands[best])
    one = Excited(axis, source, measured[best], *several[best][:3], found.parameters, found.damaged, loop)
    changed = tuple(name for name in found.changed if any(each.has(name) for each in ([loop] if loop else loops)))
    one = one._replace(begin=several[best][3], columns=found.columns, changed=changed)
    refuse(path, one)
    return one


def motors(one: Excited, loop: RateLoop) -> tuple[Floats, Floats] | None:
    """Times of samples in the stretch (n,) and motors as shares of their range (n, motors); None where the log has too few."""
    ends = limits(loop.form, one.parameters)
    found = [(one.columns[name], ends[name]) for name in ends if name in one.columns]
    spinning = [(motor, both) for motor, both in found if len(motor.time) and np.isfinite(motor.value).all()]
    if len(spinning) < 3:
        return None
    time: Floats = spinning[0][0].time
    time = time[(time >= one.begin) & (time <= one.end)]
    if len(time) < FEWEST:
        return None
    return time, np.stack([(latest(motor, time, 0.0) - low) / (high - low) for motor, (low, high) in spinning], axis=1)


def damage_note(topics: Topics) -> str:
    return f" ({damage(topics.damaged)})" if topics.damaged else ""


def by_setpoint(path: Path, topics: Topics, loops: tuple[RateLoop, ...]) -> Excited:
    """What setpoints excited, of an axis that lacks margin, or else of that where they tell most. Raises UserError."""
    logged = [
        (AXES.index(one.axis), one) for one in loops
        if all(len(topics.columns.get(name, ((),))[0]) > 1 for name in (one.setpoint, one.rate, one.command))
    ]  # fmt: skip
    if not logged:
        wanted = ", ".join((loops[0].setpoint, loops[0].rate, loops[0].command))
        set_it = faster(loops[0].form, topics.parameters)
        raise UserError(
            f"{path}: has no setpoint, rate and command of a rate loop{damage_note(topics)}, such as {wanted}{set_it}"
        )
    several, refused = [], []
    for place, one in logged:
        try:
            several.append(setpoint_excitation(path, topics, one, place))
        except UserError as error:
            refused.append(error)
    if not several:
        raise refused[0]
    told = [one for one in several if wide(one.measured) >= NARROWEST]
    best = max(told or several, key=lambda one: (bool(told and measured(one.measured).lacking), wide(one.measured)))
    refuse_narrow(path, best)
    return best._replace(others=tuple(one for one in told if one is not best))


def setpoint_excitation(path: Path, topics: Topics, loop: RateLoop, place: int) -> Excited:
    """What the setpoint of an axis excited, where the command follows it. Raises UserError."""
    one = axis_excitation(path, topics, loop, place)
    if one.explained < EXPLAINED:
        raise UserError(
            f"{path}: {loop.command}: {loop.named} of the log explain {100 * max(one.explained, 0.0):.0f} % of it from "
            f"{loop.setpoint} and {loop.rate}; {100 * EXPLAINED:g} % are needed: gains changed, or another controller flew"
        )
    source = loop.setpoint, loop.rate, loop.command
    answer = response(one.excitation, one.command, one.period, HEARD, one.told).blurred(one.late)
    answer = answer._replace(rising=not one.levelled)
    flight = Excited(loop.axis, source, answer, *one[:3], topics.parameters, topics.damaged, loop, one.levelled)
    changed = tuple(name for name in topics.changed if loop.has(name))
    return flight._replace(begin=one.begin, rate=one.rate, columns=topics.columns, changed=changed)


def sampled(
    path: Path, topics: Topics, excitation: str, command: str, late: float, form: str
) -> tuple[Floats, Floats, float, float]:
    """Both at the command's even times while the excitation was logged, their period and the first time [s]. late: time [s]
    from a logged excitation to the logged command that holds it. form: of the autopilot's parameters. Raises UserError.
    """
    columns, parameters = topics.columns, topics.parameters
    d, u = columns[excitation], columns[command]
    refuse_backward(path, columns, (excitation, command))
    d = d._replace(time=d.time + late)
    u = Series(*(one[(u.time >= d.time[0]) & (u.time <= d.time[-1])] for one in u))
    if len(u.time) < 2 or u.time[-1] - u.time[0] < SHORTEST:
        raise UserError(f"{path}: {command}: less than {SHORTEST:g} s with an excitation; a one-minute chirp is best")
    period = float(np.median(np.diff(u.time)))
    refuse_slow(path, command, period, form, parameters)
    time = np.arange(u.time[0], u.time[-1], period)
    signals = {name: np.interp(time, one.time, one.value) for name, one in ((excitation, d), (command, u))}
    refuse_not_finite(path, signals)
    refuse_unchanged(path, signals)
    return signals[excitation], signals[command], period, float(time[0])


def refuse_clipped(path: Path, one: Excited) -> None:
    """Raises UserError where a command stayed at its limits."""
    u = one.command - np.median(one.command)
    held = float(np.mean(np.abs(u) >= CLIPPED * np.abs(u).max()))
    if held > LARGEST:
        what = f"{path}: {one.source[-1]}: saturated for {100 * held:.0f} % of the time"
        raise UserError(f"{what}; excite with a smaller magnitude")


def wide(response: Response) -> float:
    """The ratio of the highest frequency to the lowest; 0 where there is none."""
    return float(response.omega[-1] / response.omega[0]) if len(response.omega) >= FEWEST_POINTS else 0.0


def refuse_narrow(path: Path, one: Excited) -> None:
    """Raises UserError where a setpoint cannot tell the margins, with the reason."""
    refuse_clipped(path, one)
    omega = one.measured.omega
    if wide(one.measured) < NARROWEST:
        heard = f"only between {omega[0]:.3g} and {omega[-1]:.3g} rad/s" if len(omega) > 1 else "nowhere"
        raise UserError(
            f"{path}: setpoints excite the commands too little: no axis's explains {100 * HEARD:g} % of its command "
            f"(coherence) over a factor of {NARROWEST:g} in frequency, the best {heard}; snap the sticks often, "
            + ADVICE[one.loop.form if one.loop else ""]
        )


def refuse(path: Path, one: Excited) -> None:
    """Raises UserError where an excitation cannot tell the margins, with the reason."""
    refuse_clipped(path, one)
    name = one.source[-1]
    median = float(np.median(one.measured.coherence))
    if median < HEARD:
        raise UserError(
            f"{path}: {name}: the excitation explains {100 * median:.0f} % of it (coherence); {100 * HEARD:g} % are needed: "
            "excite with a larger magnitude, for longer, or in less wind"
        )
    top = one.measured.omega > 0.8 * one.measured.omega[-1]
    off = float(np.median(np.abs(one.measured.sensitivity[top] - 1.0)))
    if off > FREE:
        raise UserError(
            f"{path}: {name}: does not equal the excitation at the highest frequencies (their ratio is {off:.2f} from 1): it "
            "was added somewhere else (SID_AXIS 10, 11 or 12 add it to this command), or should reach higher frequencies"
        )
