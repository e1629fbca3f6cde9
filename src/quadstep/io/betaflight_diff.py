"""What Betaflight answers to `diff all`, and takes: settings by their own names, of the profiles that are chosen."""

import re
from collections.abc import Mapping

from quadstep.io.errors import UserError
from quadstep.io.parameter_files import AutopilotParameters, number_of

LOWPASS = ("PT1", "BIQUAD", "PT2", "PT3")
CHOICES: Mapping[str, tuple[str, ...]] = {
    "dterm_lpf1_type": LOWPASS,
    "dterm_lpf2_type": LOWPASS,
    "gyro_lpf1_type": LOWPASS,
    "gyro_lpf2_type": LOWPASS,
    "iterm_relax": ("OFF", "RP", "RPY", "RP_INC", "RPY_INC"),
    "iterm_relax_type": ("GYRO", "SETPOINT"),
    "tpa_mode": ("PD", "D"),
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
    ABOUT = re.compile(r"^#\s*Betaflight /.*?\s(\d+\.\d+)\.\d+", re.MULTILINE)
    SET = re.compile(r"set (\w+) = (.*)")
    PROFILE = re.compile(r"(rateprofile|profile) (\d)")
    OTHER = re.compile(r"(batch (start|end)|[a-z]\w*( .*)?)")

    @staticmethod
    def read(text: str) -> AutopilotParameters:
        """Of the profiles, those that the text chooses last. A setting that is no number is NaN, unless `CHOICES` has it."""
        about = BetaflightDiff.ABOUT.search(text)
        if about and about[1] != VERSION:
            raise UserError(f"is from Betaflight {about[1]}; only {VERSION} is supported")
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
