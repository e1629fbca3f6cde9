"""The question of `quadstep what-if`: which parameters change, of which law, on which vehicle, in which wind."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from quadstep.control.registry import STOCK, controller
from quadstep.interfaces.controller import Controller, Measured
from quadstep.interfaces.log import FlightLog
from quadstep.io.errors import UserError, meant, number_in, shorten
from quadstep.io.parameter_files import FORMATS, read_parameters
from quadstep.linear.grade import Grade
from quadstep.mission.data_files import briefly
from quadstep.report import units
from quadstep.studies.tuning.judge import CandidateFlights

STEP = 0.5
"""Size of the step in calm air, ahead and to the left [m]."""


class Asked(NamedTuple):
    """A question. file: of parameters, or the law's name for its defaults. changes: by name. vehicle: a preset, or its file.

    wind: largest mean wind along each horizontal axis, and that which sets the turbulence [m/s]. within: further than this
    from its place, a flight has failed [m]. unmodelled: what else changes, and no law uses.
    """

    file: str
    changes: Mapping[str, float]
    vehicle: str
    wind: float = 3.0
    flights: int = 1000
    seed: int = 1
    within: float = 1.0
    unmodelled: tuple[str, ...] = ()


class Side(NamedTuple):
    """Before or after. step: of the calm flight. flown: in gusts."""

    step: FlightLog
    grade: Grade
    flown: CandidateFlights


def changes_of(texts: Sequence[str], file: str) -> dict[str, float]:
    """`NAME=VALUE`, each name once; or another file of parameters, whose values are compared with those of `file`.

    Raises UserError.
    """
    if len(texts) == 1 and "=" not in texts[0]:
        return differences(file, texts[0])
    found: dict[str, float] = {}
    for text in texts:
        name, sign, value = text.partition("=")
        number = number_in(value)
        if not sign or not math.isfinite(number):
            raise UserError(f"{shorten(text)} should be NAME=VALUE, with a number, as pid_rate.roll_kp=200")
        if name in found:
            raise UserError(f"{name} is given twice")
        found[name] = number
    return found


def differences(file: str, other: str) -> dict[str, float]:
    """What differs in another file of parameters, or in a law's defaults by its name. Raises UserError for nothing."""
    laws = laws_of(file)
    usual = {key: gain.fixed for law in laws for key, (_, gain) in law.by_key().items() if isinstance(gain.fixed, float)}
    before, after = (
        {**usual, **(read_parameters(Path(one), laws[0].parameter_file).values if one not in STOCK else {})}
        for one in (file, other)
    )
    found = {name: after[name] for name in usual if after[name] != before[name]}
    if not found:
        more = unmodelled([other], file)
        said = f"; {briefly(more)} {'does, but is' if len(more) == 1 else 'do, but are'} not modelled" if more else ""
        raise UserError(f"{other}: no parameter of {', '.join(law.name for law in laws)} differs between it and {file}{said}")
    return found


def unmodelled(texts: Sequence[str], file: str) -> tuple[str, ...]:
    """What else differs in another file of parameters, and no law uses; nothing where no two files are compared.

    Raises UserError.
    """
    if len(texts) != 1 or "=" in texts[0] or file in STOCK or texts[0] in STOCK:
        return ()
    laws = laws_of(file)
    before, after = (read_parameters(Path(one), laws[0].parameter_file).values for one in (file, texts[0]))
    used = {key for law in laws for key in (*law.by_key(), *law.supported)}
    return tuple(name for name in sorted({**before, **after}) if name not in used and before.get(name) != after.get(name))


def laws_of(file: str) -> list[type[Controller]]:
    """The stock law of this name, with those of the same autopilot; or those whose parameters such a file has.

    Raises UserError for another file.
    """
    laws = [law for name in STOCK if (law := controller(Measured, name))]
    whose = [law.parameter_file for law in laws if file == law.name or Path(file).suffix in suffixes(law)]
    if not whose:
        known = ", ".join(dict.fromkeys(one for law in laws for one in suffixes(law)))
        raise UserError(f"{file}: should be a file of an autopilot's parameters ({known}), or one of {', '.join(STOCK)}")
    return [law for law in laws if law.parameter_file == whose[0]]


def suffixes(law: type[Controller]) -> tuple[str, ...]:
    """Of the files in which its autopilot's parameters are kept."""
    found: tuple[str, ...] = FORMATS.load(law.parameter_file).suffixes
    return found


def law_of(asked: Asked) -> type[Controller]:
    """The stock law whose parameters change. Raises UserError where there is none."""
    laws = laws_of(asked.file)
    known, named = [key for law in laws for key in law.by_key()], ", ".join(law.name for law in laws)
    for name in asked.changes:
        if name not in known:
            raise UserError(f"{name} is not a parameter of {named}{meant(name, known)}")
    fitting = [law for law in laws if all(name in law.by_key() for name in asked.changes)]
    if not fitting:
        raise UserError(f"{units.listed(list(asked.changes))} are not parameters of the same law")
    if asked.file in STOCK and asked.file not in (law.name for law in fitting):
        raise UserError(f"{asked.file} has no parameter {next(iter(asked.changes))}, which belongs to {fitting[0].name}")
    return next((law for law in fitting if law.name == asked.file), fitting[0])
