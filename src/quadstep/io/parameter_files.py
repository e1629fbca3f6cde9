"""Files in which autopilots keep their parameters: read into numbers by the parameters' own names, and written.

A format is a class with `read` and `write`, as `CrazyflieYaml`; another distribution adds one at the door `FORMATS`.
"""

import math
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple, Protocol, TypeVar

from quadstep.io import files
from quadstep.io.doors import Door
from quadstep.io.errors import UserError, number_in

Entry = TypeVar("Entry")

KIND = files.FileKind("a file of parameters", 1_000_000)


class AutopilotParameters(NamedTuple):
    """values: by name, what the autopilot flies with. defaults: what the file says that its firmware has without it. version:
    of its firmware, as "1.15", where the file says it. whole: whether such a file has what is at its default, too.
    """

    values: Mapping[str, float]
    defaults: Mapping[str, float] = {}
    version: str = ""
    whole: bool = False


class Format(Protocol):
    """How an autopilot's parameters are written."""

    suffixes: tuple[str, ...]
    """Of such files; the first is written."""

    @staticmethod
    def read(text: str) -> AutopilotParameters:
        """What a file says. Raises UserError: one line without the file's name."""
        ...

    @staticmethod
    def write(values: Mapping[str, float], defaults: Mapping[str, float]) -> str:
        """A file that sets these values, and no others. defaults: what the firmware has without it, by name."""
        ...


class CrazyflieYaml:
    """What cfclient saves of the parameters stored in a Crazyflie, version 1: a small part of YAML, read without a library."""

    suffixes = (".yaml",)
    TOP = re.compile(r"(type|version|params):(?: (.*))?")
    NAME = re.compile(r" {2}([A-Za-z]\w*\.\w+):")
    ENTRY = re.compile(r" {4}(default_value|is_stored|stored_value): (.+)")

    @staticmethod
    def read(text: str) -> AutopilotParameters:
        """A parameter that is not stored has its default."""
        top: dict[str, str] = {}
        found: dict[str, dict[str, str]] = {}
        entries: dict[str, str] = {}
        for number, line in uncommented(text):
            if match := CrazyflieYaml.TOP.fullmatch(line):
                once(top, match[1], (match[2] or "").strip("'\""), number)
            elif "params" in top and (match := CrazyflieYaml.NAME.fullmatch(line)):
                entries = {}
                once(found, match[1], entries, number)
            elif found and (match := CrazyflieYaml.ENTRY.fullmatch(line)):
                once(entries, match[1], match[2], number)
            else:
                raise UserError(f"line {number} is not from a parameter file of cfclient: {line.strip()!r:.60}")
        if top.get("type") != "persistent_param_state":
            raise UserError("is not a parameter file of cfclient (type: persistent_param_state)")
        if top.get("version") != "1":
            raise UserError(f"has version {top.get('version', 'none')!r:.20}; only version 1 is supported")
        values, defaults = {}, {}
        for name, said in found.items():
            stored = said.get("is_stored")
            if stored not in ("true", "false"):
                raise UserError(f"{name}: is_stored should be true or false")
            key = "stored_value" if stored == "true" else "default_value"
            values[name] = number_of(said.get(key, ""), f"{name}: {key}")
            if "default_value" in said:
                defaults[name] = number_of(said["default_value"], f"{name}: default_value")
        return AutopilotParameters(values, defaults)

    @staticmethod
    def write(values: Mapping[str, float], defaults: Mapping[str, float]) -> str:
        """As cfclient writes them, in the order of their names."""
        lines = ["params:"] if values else ["params: {}"]
        for name in sorted(values):
            lines += [f"  {name}:", f"    default_value: {defaults[name]!r}", "    is_stored: true"]
            lines += [f"    stored_value: {values[name]!r}"]
        return "\n".join([*lines, "type: persistent_param_state", "version: '1'", ""])


class QgcParams:
    """What QGroundControl saves of PX4's parameters: vehicle, component, name, value and type, tabs between them."""

    suffixes = (".params",)
    WHOLE, REAL = "6", "9"
    """MAVLink's types of an int32 and a float."""
    AUTOPILOT = "1"
    """The component that flies; a gimbal's parameters may be in the same file."""
    SAVED = "save one there: Vehicle Configuration, Parameters, Tools, Save to file"
    STACK = re.compile(r"^# Stack: (.*\S)", re.MULTILINE)
    VERSION = re.compile(r"^# Version: (\d+\.\d+)", re.MULTILINE)
    INTEGERS = ("CA_AIRFRAME", "CA_ROTOR_COUNT", "MC_AIRMODE", "MPC_ACC_DECOUPLE", "MPC_USE_HTE", "PWM_MAIN_FUNC")
    """Beginnings of the names of whole numbers, among those that are written here."""

    @staticmethod
    def read(text: str) -> AutopilotParameters:
        """One vehicle's; defaults are not in it."""
        values: dict[str, float] = {}
        stack, version = QgcParams.STACK.search(text), QgcParams.VERSION.search(text)
        if stack and not stack[1].startswith("PX4"):
            raise UserError(f"has parameters of {stack[1]:.30}, not of PX4")
        for number, line in uncommented(text):
            fields = line.split("\t")
            if len(fields) == 5 and fields[1] != QgcParams.AUTOPILOT:
                continue
            if len(fields) != 5 or fields[4] not in (QgcParams.WHOLE, QgcParams.REAL):
                raise UserError(
                    f"line {number} is not from a parameter file of QGroundControl: {line.strip()!r:.60}; {QgcParams.SAVED}"
                )
            once(values, fields[2], number_of(fields[3], f"line {number}: {fields[2]:.20}"), number)
        return AutopilotParameters(some(values, "QGroundControl"), version=version[1] if version else "", whole=True)

    @staticmethod
    def write(values: Mapping[str, float], defaults: Mapping[str, float]) -> str:  # noqa: ARG004 (files do not say them)
        """In the order of their names, as of vehicle 1 and its autopilot."""
        lines = ["# Vehicle-Id\tComponent-Id\tName\tValue\tType"]
        for name in sorted(values):
            kind = QgcParams.WHOLE if name.startswith(QgcParams.INTEGERS) else QgcParams.REAL
            lines.append(f"1\t1\t{name}\t{values[name]:.9g}\t{kind}")
        return "\n".join([*lines, ""])


class ArduPilotParm:
    """What ground stations save of ArduPilot's parameters: a name and a value a line, a comma or spaces between them; in the
    firmware's own files @READONLY may follow.
    """

    suffixes = (".parm", ".param")
    LINE = re.compile(r"([A-Z][A-Z0-9_]*)(?:\s*,\s*|\s+)(\S+)(?:\s+@READONLY)?")
    SAVED = "save one with a ground station, such as Mission Planner: Config, Full Parameter List, Save to file"

    @staticmethod
    def read(text: str) -> AutopilotParameters:
        """Defaults are not in it."""
        values: dict[str, float] = {}
        for number, line in uncommented(text):
            found = ArduPilotParm.LINE.fullmatch(line.strip())
            if not found:
                raise UserError(
                    f"line {number} is not from a parameter file of ArduPilot: {line.strip()!r:.60}; {ArduPilotParm.SAVED}"
                )
            once(values, found[1], number_of(found[2], f"line {number}: {found[1]:.20}"), number)
        return AutopilotParameters(some(values, "ArduPilot"), whole=True)

    @staticmethod
    def write(values: Mapping[str, float], defaults: Mapping[str, float]) -> str:  # noqa: ARG004 (files do not say them)
        """In the order of their names."""
        return "".join(f"{name} {values[name]:.9g}\n" for name in sorted(values))


HERE = "quadstep.io.parameter_files:"
FORMATS = Door(
    "quadstep.parameter_files",
    {
        "crazyflie": f"{HERE}CrazyflieYaml",
        "px4": f"{HERE}QgcParams",
        "ardupilot": f"{HERE}ArduPilotParm",
        "betaflight": "quadstep.io.parameter_files:BetaflightDiff",
    },
)


def read_parameters(path: Path, form: str) -> AutopilotParameters:
    """What a file of one of the `FORMATS` says. Raises UserError naming it."""
    try:
        found: AutopilotParameters = FORMATS.load(form).read(files.read_text(path, KIND))
    except UserError as error:
        raise UserError(f"{error}" if str(path) in str(error) else f"{path}: {error}") from None
    return found


def uncommented(text: str) -> Iterator[tuple[int, str]]:
    """Lines with their numbers, from 1; comments and what is empty left out."""
    for number, line in enumerate(text.splitlines(), 1):
        said = line.partition("#")[0].rstrip()
        if said:
            yield number, said


def some(values: dict[str, float], whose: str) -> dict[str, float]:
    """What a file says. Raises UserError for nothing."""
    if not values:
        raise UserError(f"is not a parameter file of {whose}: it has no parameters")
    return values


def once(entries: dict[str, Entry], key: str, value: Entry, line: int) -> None:
    """Enter what may be said once only. Raises UserError."""
    if key in entries:
        raise UserError(f"line {line}: {key} is given twice")
    entries[key] = value


def number_of(text: str, what: str) -> float:
    """A finite number. Raises UserError."""
    value = number_in(text)
    if not math.isfinite(value):
        raise UserError(f"{what} should be a number, not {text!r:.40}")
    return value


PROTOCOLS = (
    "PWM", "ONESHOT125", "ONESHOT42", "MULTISHOT", "BRUSHED", "DSHOT150", "DSHOT300", "DSHOT600", "PROSHOT1000", "DISABLED",
)  # fmt: skip
LOWPASS = ("PT1", "BIQUAD", "PT2", "PT3")
CHOICES: Mapping[str, tuple[str, ...]] = {
    "dterm_lpf1_type": LOWPASS,
    "dterm_lpf2_type": LOWPASS,
    "gyro_lpf1_type": LOWPASS,
    "gyro_lpf2_type": LOWPASS,
    "iterm_relax": ("OFF", "RP", "RPY", "RP_INC", "RPY_INC"),
    "iterm_relax_type": ("GYRO", "SETPOINT"),
    "tpa_mode": ("PD", "D"),
    "motor_pwm_protocol": PROTOCOLS,
    "yaw_motors_reversed": ("OFF", "ON"),
}
"""Settings whose values have names, which stand for numbers from 0."""

VERSION = "4.5"

P_SCALE, I_SCALE, D_SCALE, F_SCALE = 0.032029, 0.244381, 0.000529, 0.013754
"""What a parameter's 1 is, from deg/s, deg, deg/s^2 and 100 deg/s^2 to thousandths of a motor's range."""

YAW_I = 2.5
"""How much more a 1 of `i_yaw` is."""

PER_MOTOR = 1000.0
"""Of an output, for a motor's whole range."""


class BetaflightDiff:
    """The text of `diff` or `diff all` of Betaflight 4.5. Feature AIRMODE counts as a setting `airmode`."""

    suffixes = (".txt",)
    ABOUT = re.compile(r"^#\s*(Betaflight|\w+(?=.* [A-Z][a-z]{2} +\d))\s*/.*?\s(\d+\.\d+)\.\d+", re.MULTILINE)
    """What firmware it is from: any that says when it was built, which other comments do not."""
    SET = re.compile(r"set (\w+) = (.*)")
    PROFILE = re.compile(r"(rateprofile|profile) (\d)")
    OTHER = re.compile(r"(batch (start|end)|[a-z]\w*( .*)?|Entering CLI Mode, .*)")
    """What else its command line says; Betaflight Configurator saves the greeting, too."""

    @staticmethod
    def read(text: str) -> AutopilotParameters:
        """Of the profiles, those that the text chooses last. A setting that is no number is NaN, unless `CHOICES` has it."""
        about = BetaflightDiff.ABOUT.search(text)
        if about and about.groups() != ("Betaflight", VERSION):
            raise UserError(f"is from {about[1]} {about[2]}; only Betaflight {VERSION} is supported")
        found: dict[tuple[str, str], dict[str, float]] = {("", ""): {}}
        chosen = {"": "", "profile": "", "rateprofile": ""}
        place = ("", "")
        for number, line in enumerate(text.splitlines(), 1):
            said = line.partition("#")[0].strip()
            if match := BetaflightDiff.PROFILE.fullmatch(said):
                place = (match[1], match[2])
                chosen[match[1]] = match[2]
                found.setdefault(place, {})
            elif match := BetaflightDiff.SET.fullmatch(said):
                found[place][match[1]] = value_of(match[1], match[2])
            elif match := re.fullmatch(r"feature (-?)AIRMODE", said):
                found[("", "")]["airmode"] = 0.0 if match[1] else 1.0
            elif said and said != "save" and not (about and BetaflightDiff.OTHER.fullmatch(said)):
                raise UserError(f"line {number} is not output of Betaflight's `diff all`: {said!r:.60}")
        values = {name: one for kind in chosen for name, one in found.get((kind, chosen[kind]), {}).items()}
        if not (about or values):
            raise UserError("is not output of Betaflight's `diff all`")
        return AutopilotParameters(values)

    @staticmethod
    def write(values: Mapping[str, float], defaults: Mapping[str, float]) -> str:  # noqa: ARG004 (a diff does not say them)
        """Lines for the command line, for the profile that is chosen there; numbers become whole, as Betaflight's are."""
        lines = [f"set {name} = {written(name, values[name])}" for name in sorted(values) if name != "airmode"]
        feature = [f"feature {'' if values['airmode'] > 0.5 else '-'}AIRMODE"] if "airmode" in values else []
        return "\n".join([*feature, *lines, "save", ""])


def value_of(name: str, text: str) -> float:
    """The number of a setting. Raises UserError for none of its choices."""
    if name in CHOICES:
        if text not in CHOICES[name]:
            raise UserError(f"{name} is {text!r:.30}; allowed: {', '.join(CHOICES[name])}")
        return float(CHOICES[name].index(text))
    try:
        return number_of(text, name)
    except UserError:
        return float("nan")


def written(name: str, value: float) -> str:
    """A setting's value as the command line takes it."""
    return CHOICES[name][round(value)] if name in CHOICES else f"{value:.0f}"
