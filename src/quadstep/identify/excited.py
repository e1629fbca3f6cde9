"""Flights with an excitation added to a controller's command: reading them from logs, and why some tell nothing."""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from quadstep.identify.logs import ardupilot
from quadstep.identify.logs.flight import Floats, damage
from quadstep.identify.logs.read import of_topics, read_topics
from quadstep.identify.logs.series import Columns, Series
from quadstep.identify.response import Response, response
from quadstep.io.errors import UserError

AXES = "roll", "pitch", "yaw"
EXCITATION = "SIDD.Targ"
COMMANDS = dict(zip(AXES, ("RATE.ROut", "RATE.POut", "RATE.YOut"), strict=True))
"""ArduPilot's: the waveform of its mode System Identification, and what its rate controllers command, with the waveform."""

SHORTEST = 10.0
"""Shortest excitation [s]."""

SLOWEST = 0.02
"""Longest time between two logged commands [s]."""

FREE = 0.3
"""At the highest frequencies the loop no longer answers, and the command is the excitation: largest distance of S from 1."""

CLIPPED, LARGEST = 0.999, 0.1
"""A command within this share of its largest counts as held there; largest share of time in which it may be."""

HEARD = 0.6
"""Least median coherence, as usual for frequency responses of aircraft (Tischler and Remple, "Aircraft and Rotorcraft System
Identification", 2nd edition, 2012).
"""


class Excited(NamedTuple):
    """An excitation in flight. axis: which command it was added to; source: the columns. measured: what the loop answered.
    excitation, command (n,): samples a `period` [s] apart. parameters: of the autopilot, by name, where the log has them.
    damaged: places of the log that could not be read.
    """

    axis: str
    source: tuple[str, str]
    measured: Response
    excitation: Floats
    command: Floats
    period: float
    parameters: Mapping[str, float]
    damaged: int = 0

    @property
    def noise(self) -> float:
        """The share of the command's standard deviation above the excited frequencies."""
        spectrum = np.abs(np.fft.rfft(self.command - self.command.mean())) ** 2
        omega = 2.0 * np.pi * np.fft.rfftfreq(len(self.command), self.period)
        return float(np.sqrt(spectrum[omega > 1.05 * self.measured.omega[-1]].sum() / max(spectrum.sum(), 1e-300)))


def excited(path: Path, columns: tuple[str, str] | None) -> Excited:
    """The excitation in a log. columns: that of the excitation and that of the command which holds it; ArduPilot's have known
    names. Raises UserError where there is none, or where it tells nothing of the loop.
    """
    if not of_topics(path):
        raise UserError(f"{path}: should be a log of topics: .bin, .ulg or .mcap")
    if columns is None and path.suffix.lower() != ".bin":
        raise UserError(f"{path}: which columns hold an excitation and the command that it was added to? give --columns X,Y")
    wanted = [EXCITATION, *COMMANDS.values()] if columns is None else list(columns)
    found, damaged = read_topics(path, wanted)
    given, *commands = wanted
    if given not in found or len(found[given].time) < 2:
        fly = "; fly the mode System Identification with SID_AXIS 10 (roll), 11 (pitch) or 12 (yaw)" if columns is None else ""
        broken = f" ({damage(damaged)})" if damaged else ""
        raise UserError(
            f"{path}: {given} is not in the log{broken}: without an excitation its margins cannot be measured{fly}"
        )
    commands = [one for one in commands if one in found and len(found[one].time) > 1]
    if not commands:
        raise UserError(f"{path}: {' and '.join(wanted[1:])}: the commands are not in the log")
    several = [sampled(path, found, given, one) for one in commands]
    measured = [response(*one) for one in several]
    best = max(range(len(measured)), key=lambda i: float(np.median(measured[i].coherence)))
    axis = {name: axis for axis, name in COMMANDS.items()}.get(commands[best], commands[best])
    parameters = ardupilot.parameters(path) if path.suffix.lower() == ".bin" else {}
    one = Excited(axis, (given, commands[best]), measured[best], *several[best], parameters, damaged)
    refuse(path, one)
    return one


def sampled(path: Path, columns: Columns, excitation: str, command: str) -> tuple[Floats, Floats, float]:
    """Both at the command's even times while the excitation was logged, and their period [s]. Raises UserError."""
    d, u = columns[excitation], columns[command]
    for name, one in ((excitation, d), (command, u)):
        if (np.diff(one.time) < 0.0).any():
            raise UserError(f"{path}: {name}: time goes backward")
    u = Series(*(one[(u.time >= d.time[0]) & (u.time <= d.time[-1])] for one in u))
    if len(u.time) < 2 or u.time[-1] - u.time[0] < SHORTEST:
        raise UserError(f"{path}: {command}: less than {SHORTEST:g} s with an excitation; a chirp of a minute tells most")
    period = float(np.median(np.diff(u.time)))
    if not 0.0 < period <= SLOWEST:
        raise UserError(
            f"{path}: {command}: logged every {1e3 * period:.3g} ms; margins need {1e3 * SLOWEST:g} ms or less "
            "(ArduPilot: bit 0 of LOG_BITMASK, fast attitude)"
        )
    time = np.arange(u.time[0], u.time[-1], period)
    values = [np.interp(time, one.time, one.value) for one in (d, u)]
    if not all(np.isfinite(one).all() for one in values):
        raise UserError(f"{path}: {excitation}, {command}: hold numbers that are not finite")
    if not np.ptp(values[0]) > 0.0 or not np.ptp(values[1]) > 0.0:
        raise UserError(f"{path}: {excitation}, {command}: one of them never changes; nothing was excited")
    return values[0], values[1], period


def refuse(path: Path, one: Excited) -> None:
    """Raises UserError where an excitation cannot tell the margins, with the reason."""
    u, name = one.command - np.median(one.command), one.source[1]
    held = float(np.mean(np.abs(u) >= CLIPPED * np.abs(u).max()))
    if held > LARGEST:
        raise UserError(f"{path}: {name}: saturated for {100 * held:.0f} % of the time; excite with a smaller magnitude")
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
            f"{path}: {name}: is not the excitation itself at the highest frequencies (their ratio is {off:.2f} from 1): it "
            "was added elsewhere than to this command (SID_AXIS 10, 11 or 12 add it there), or should reach higher frequencies"
        )
