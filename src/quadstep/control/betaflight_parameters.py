"""Betaflight's parameters of rates, filters and motors (release 4.5), by the names of its command line.

Facts of its documentation and behaviour, which `tests/test_control_betaflight_rates.py` compares with the firmware itself.
Choices are numbers in the order of `CHOICES`, as `dterm_lpf1_type = 1` for BIQUAD.
"""

from typing import NamedTuple

from quadstep.interfaces.gain import parameter, switch
from quadstep.io.parameter_files import CHOICES
from quadstep.numbers import Number


def setting(
    name: str, default: float, unit: str, meaning: str, low: float, high: float, zero: bool = True, tunable: bool = False
) -> Number:
    """Declares a setting, which the command line takes from `low` to `high` only."""
    declared: Number = parameter(name, default, unit, meaning, low=low, high=high, zero=zero, tunable=tunable, only="range")
    return declared


def hertz(name: str, default: float, meaning: str, most: float = 1000.0) -> Number:
    """Declares a cut-off or centre, of which 0 switches the filter off."""
    return setting(name, default, "Hz", f"{meaning}; 0: none", 0.0, most)


def choice(name: str, default: str, meaning: str) -> Number:
    """Declares one of `CHOICES`."""
    every = CHOICES[name]
    said = ", ".join(f"{place} {one}" for place, one in enumerate(every))
    declared: Number = switch(name, float(every.index(default)), f"{meaning}: {said}", len(every) - 1)
    return declared


def scale(name: str, default: float, meaning: str, most: float = 250.0, tunable: bool = True) -> Number:
    """Declares a number without unit."""
    return setting(name, default, "-", meaning, 0.0, most, tunable=tunable)


class Roll(NamedTuple):
    """Of roll. d: the largest; d_min: where all is calm."""

    p: Number = scale("p_roll", 45.0, "P gain of the roll rate")
    i: Number = scale("i_roll", 80.0, "I gain of the roll rate")
    d: Number = scale("d_roll", 40.0, "D gain of the roll rate")
    f: Number = scale("f_roll", 120.0, "feed-forward gain of the roll rate", 1000.0)
    d_min: Number = scale("d_min_roll", 30.0, "D gain of the roll rate where all is calm; 0: the same always")


class Pitch(NamedTuple):
    """Of pitch."""

    p: Number = scale("p_pitch", 47.0, "P gain of the pitch rate")
    i: Number = scale("i_pitch", 84.0, "I gain of the pitch rate")
    d: Number = scale("d_pitch", 46.0, "D gain of the pitch rate")
    f: Number = scale("f_pitch", 125.0, "feed-forward gain of the pitch rate", 1000.0)
    d_min: Number = scale("d_min_pitch", 34.0, "D gain of the pitch rate where all is calm; 0: the same always")


class Yaw(NamedTuple):
    """Of yaw."""

    p: Number = scale("p_yaw", 45.0, "P gain of the yaw rate")
    i: Number = scale("i_yaw", 80.0, "I gain of the yaw rate")
    d: Number = scale("d_yaw", 0.0, "D gain of the yaw rate")
    f: Number = scale("f_yaw", 120.0, "feed-forward gain of the yaw rate", 1000.0)
    d_min: Number = scale("d_min_yaw", 0.0, "D gain of the yaw rate where all is calm; 0: the same always")


class Filters(NamedTuple):
    """Of the gyro, and of the D part behind it. A dynamic cut-off rises with throttle from its least to its most; with a least
    of 0 the static one holds.
    """

    gyro2: Number = hertz("gyro_lpf2_static_hz", 500.0, "cut-off of the gyro's second low-pass")
    gyro2_type: Number = choice("gyro_lpf2_type", "PT1", "kind of that")
    notch: Number = hertz("gyro_notch1_hz", 0.0, "centre of the gyro's notch")
    notch_cut: Number = hertz("gyro_notch1_cutoff", 0.0, "its lower cut-off")
    gyro1: Number = hertz("gyro_lpf1_static_hz", 250.0, "static cut-off of the gyro's first low-pass")
    gyro1_type: Number = choice("gyro_lpf1_type", "PT1", "kind of that")
    gyro_least: Number = hertz("gyro_lpf1_dyn_min_hz", 250.0, "least dynamic cut-off")
    gyro_most: Number = hertz("gyro_lpf1_dyn_max_hz", 500.0, "most dynamic cut-off")
    gyro_expo: Number = scale("gyro_lpf1_dyn_expo", 5.0, "bend of the way from least to most", 10.0, tunable=False)
    d_notch: Number = hertz("dterm_notch_hz", 0.0, "centre of the D part's notch")
    d_notch_cut: Number = hertz("dterm_notch_cutoff", 0.0, "its lower cut-off")
    d1: Number = hertz("dterm_lpf1_static_hz", 75.0, "static cut-off of the D part's first low-pass")
    d1_type: Number = choice("dterm_lpf1_type", "PT1", "kind of that")
    d_least: Number = hertz("dterm_lpf1_dyn_min_hz", 75.0, "least dynamic cut-off")
    d_most: Number = hertz("dterm_lpf1_dyn_max_hz", 150.0, "most dynamic cut-off")
    d_expo: Number = scale("dterm_lpf1_dyn_expo", 5.0, "bend of the way from least to most", 10.0, tunable=False)
    d2: Number = hertz("dterm_lpf2_static_hz", 150.0, "cut-off of the D part's second low-pass")
    d2_type: Number = choice("dterm_lpf2_type", "PT1", "kind of that")
    yaw: Number = hertz("yaw_lowpass_hz", 100.0, "cut-off of yaw's P part", 500.0)


class Shared(NamedTuple):
    """Of all axes."""

    d_gain: Number = scale("d_max_gain", 37.0, "how much D rises with what the gyro's rate does", 100.0, tunable=False)
    d_advance: Number = scale("d_max_advance", 20.0, "how much D rises with what is wanted", 200.0, tunable=False)
    i_limit: Number = scale("iterm_limit", 400.0, "limit of the I parts", 500.0, tunable=False)
    windup: Number = scale("iterm_windup", 85.0, "range of the motors' mix from which I goes slower [%]", 100.0, False)
    relax: Number = choice("iterm_relax", "RP", "axes whose I part waits for a setpoint that changes")
    relax_type: Number = choice("iterm_relax_type", "SETPOINT", "what it waits by")
    relax_cut: Number = setting("iterm_relax_cutoff", 15.0, "Hz", "cut-off that tells a change", 1.0, 50.0, zero=False)
    limit: Number = scale("pidsum_limit", 500.0, "limit of the sum in roll and pitch", 1000.0, tunable=False)
    limit_yaw: Number = scale("pidsum_limit_yaw", 400.0, "limit of the sum in yaw", 1000.0, tunable=False)
    gravity_gain: Number = scale("anti_gravity_gain", 80.0, "how much I rises with a moving throttle", tunable=False)
    gravity_p: Number = scale("anti_gravity_p_gain", 100.0, "how much P rises with it", tunable=False)
    gravity_cut: Number = setting(
        "anti_gravity_cutoff_hz", 5.0, "Hz", "cut-off that tells a moving throttle", 2.0, 50.0, zero=False
    )
    tpa_mode: Number = choice("tpa_mode", "D", "what throttle attenuates")
    tpa_rate: Number = setting("tpa_rate", 65.0, "%", "attenuation at full throttle", 0.0, 100.0)
    tpa_breakpoint: Number = setting(
        "tpa_breakpoint", 1350.0, "us", "throttle from which it attenuates", 1000.0, 2000.0, zero=False
    )
    boost: Number = scale("throttle_boost", 5.0, "how much a moving throttle is exaggerated", 100.0, tunable=False)
    boost_cut: Number = setting("throttle_boost_cutoff", 15.0, "Hz", "cut-off that tells it", 5.0, 50.0, zero=False)
    linear: Number = setting("thrust_linear", 0.0, "%", "compensation for thrust that goes with the square", 0.0, 150.0)
    output_limit: Number = setting("motor_output_limit", 100.0, "%", "most output of a motor", 1.0, 100.0, zero=False)
    idle: Number = setting("dshot_idle_value", 550.0, "0.01 %", "least output of a motor", 0.0, 2000.0)
    airmode: Number = switch("airmode", 1.0, "1: feature AIRMODE, 0: without")
