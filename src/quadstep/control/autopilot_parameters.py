"""Parameters of autopilots by their own names, with units, ranges and defaults: ArduPilot's (Copter 4.6.2), of the cascade in
`ardupilot_cascade.py`; and Betaflight's of rates, filters and motors (release 4.5).

Betaflight's are facts of its documentation and behaviour, which `tests/test_control_betaflight_rates.py` compares with the
firmware itself. Choices are numbers in the order of `CHOICES`, as `dterm_lpf1_type = 1` for BIQUAD.
"""

from functools import partial
from typing import NamedTuple, TypeAlias

from quadstep.control.ardupilot_loops import PidGains
from quadstep.interfaces.gain import nested, parameter, switch
from quadstep.io.parameter_files import CHOICES
from quadstep.numbers import Number

RENAMED = {
    f"{other}{ending}": f"{here}{ending}"
    for other, here, endings in (
        ("PSC_NE_POS_", "PSC_POSXY_", "P"),
        ("PSC_NE_VEL_", "PSC_VELXY_", "P I D FF IMAX FLTE FLTD"),
        ("PSC_D_POS_", "PSC_POSZ_", "P"),
        ("PSC_D_VEL_", "PSC_VELZ_", "P I D FF IMAX FLTE FLTD"),
        ("PSC_D_ACC_", "PSC_ACCZ_", "P I D FF D_FF IMAX PDMX FLTT FLTE FLTD"),
        ("POS_XY_", "PSC_POSXY_", "P"),
        ("VEL_XY_", "PSC_VELXY_", "P I IMAX"),
        ("POS_Z_", "PSC_POSZ_", "P"),
        ("VEL_Z_", "PSC_VELZ_", "P"),
        ("ACCEL_Z_", "PSC_ACCZ_", "P I D IMAX"),
        ("STB_RLL_", "ATC_ANG_RLL_", "P"),
        ("STB_PIT_", "ATC_ANG_PIT_", "P"),
        ("STB_YAW_", "ATC_ANG_YAW_", "P"),
        ("RATE_RLL_", "ATC_RAT_RLL_", "P I D IMAX"),
        ("RATE_PIT_", "ATC_RAT_PIT_", "P I D IMAX"),
        ("RATE_YAW_", "ATC_RAT_YAW_", "P I D IMAX"),
    )
    for ending in endings.split()
}
"""Names of Copter 4.7, and of 3.5 and before."""


Range: TypeAlias = tuple[float, float | None, float]
"""A default, and the lowest and highest value that the autopilot documents."""

fixed = partial(parameter, tunable=False)


def cutoff(name: str, default: float, what: str, high: float | None = None) -> Number:
    """Declares the cut-off of a filter of ArduPilot's, which 0 switches off."""
    return fixed(name, default, "Hz", f"cut-off of the {what}; 0: none", high=high)


def rate_parameters(
    axis: str, name: str, p: Range, i: Range, d: Range, error_cut: tuple[float, float], most_cut: float
) -> PidGains:
    """Declares ATC_RAT of an axis: from rad/s to shares of torque. p, i, d: default, and range there."""
    start, rate = f"ATC_RAT_{axis}_", f"{name} rate"
    return nested(
        p=parameter(f"{start}P", p[0], "s/rad", f"P gain of the {rate}", low=p[1], high=p[2]),
        i=parameter(f"{start}I", i[0], "1/rad", f"I gain of the {rate}", low=i[1], high=i[2]),
        d=parameter(f"{start}D", d[0], "s^2/rad", f"D gain of the {rate}", low=d[1], high=d[2]),
        ff=parameter(f"{start}FF", 0.0, "s/rad", f"feed-forward gain of the {rate}", high=0.5),
        d_ff=parameter(f"{start}D_FF", 0.0, "s^2/rad", f"feed-forward gain of the {rate}'s slope", high=0.02),
        most=fixed(f"{start}IMAX", 0.5, "-", f"limit of the {rate}'s integral"),
        most_pd=fixed(f"{start}PDMX", 0.0, "-", f"limit of the {rate}'s P and D; 0: none"),
        target_cut=cutoff(f"{start}FLTT", 20.0, f"{rate}'s target", most_cut),
        error_cut=cutoff(f"{start}FLTE", error_cut[0], f"{rate}'s error", error_cut[1]),
        slope_cut=cutoff(f"{start}FLTD", 20.0, f"{rate}'s D part", most_cut),
    )


ROLL, PITCH = (
    rate_parameters(axis, name, (0.135, 0.01, 0.5), (0.135, 0.01, 2.0), (0.0036, None, 0.05), (0.0, 100.0), 100.0)
    for axis, name in (("RLL", "roll"), ("PIT", "pitch"))
)
YAW = rate_parameters("YAW", "yaw", (0.18, 0.1, 2.5), (0.018, 0.01, 1.0), (0.0, None, 0.02), (2.5, 20.0), 50.0)


class ArduPilotAttitudeParameters(NamedTuple):
    """ATC: from rad to rad/s, and its limits."""

    roll: Number = parameter("ATC_ANG_RLL_P", 4.5, "1/s", "P gain of roll", zero=False, low=3.0, high=12.0)
    pitch: Number = parameter("ATC_ANG_PIT_P", 4.5, "1/s", "P gain of pitch", zero=False, low=3.0, high=12.0)
    yaw: Number = parameter("ATC_ANG_YAW_P", 4.5, "1/s", "P gain of yaw", zero=False, low=3.0, high=12.0)
    roll_acc: Number = fixed("ATC_ACCEL_R_MAX", 110000.0, "cdeg/s^2", "largest angular acceleration in roll")
    pitch_acc: Number = fixed("ATC_ACCEL_P_MAX", 110000.0, "cdeg/s^2", "largest angular acceleration in pitch")
    yaw_acc: Number = fixed("ATC_ACCEL_Y_MAX", 27000.0, "cdeg/s^2", "largest angular acceleration in yaw")
    roll_most: Number = fixed("ATC_RATE_R_MAX", 0.0, "deg/s", "largest roll rate; 0: none")
    pitch_most: Number = fixed("ATC_RATE_P_MAX", 0.0, "deg/s", "largest pitch rate; 0: none")
    yaw_most: Number = fixed("ATC_RATE_Y_MAX", 0.0, "deg/s", "largest yaw rate; 0: none")
    slew: Number = fixed("ATC_SLEW_YAW", 6000.0, "cdeg/s", "largest rate of the heading's target")
    constant: Number = fixed("ATC_INPUT_TC", 0.15, "s", "time constant of the shaped target", high=1.0)
    ahead: Number = switch("ATC_RATE_FF_ENAB", 1.0, "1: the target is shaped and its rates fed forward")
    boost: Number = switch("ATC_ANGLE_BOOST", 1.0, "1: more throttle when leaning")
    lean_constant: Number = fixed("ATC_ANG_LIM_TC", 1.0, "s", "time constant of the lean limit", zero=False)
    mix: Number = fixed("ATC_THR_MIX_MAX", 0.5, "-", "priority of torques over throttle")


class ArduPilotPositionParameters(NamedTuple):
    """PSC, WPNAV and ANGLE_MAX."""

    xy: Number = parameter("PSC_POSXY_P", 1.0, "1/s", "P gain of the horizontal position", zero=False, low=0.5, high=2.0)
    xy_p: Number = parameter("PSC_VELXY_P", 2.0, "1/s", "P gain of the horizontal velocity", low=0.1, high=6.0)
    xy_i: Number = parameter("PSC_VELXY_I", 1.0, "1/s^2", "I gain of the horizontal velocity", low=0.02, high=1.0)
    xy_d: Number = parameter("PSC_VELXY_D", 0.25, "-", "D gain of the horizontal velocity", high=1.0)
    xy_ff: Number = parameter("PSC_VELXY_FF", 0.0, "1/s", "feed-forward gain of the horizontal velocity", high=6.0)
    xy_most: Number = fixed("PSC_VELXY_IMAX", 1000.0, "cm/s^2", "limit of the horizontal velocity's integral")
    xy_error: Number = cutoff("PSC_VELXY_FLTE", 5.0, "horizontal velocity's error")
    xy_slope: Number = cutoff("PSC_VELXY_FLTD", 5.0, "horizontal velocity's D part")
    z: Number = parameter("PSC_POSZ_P", 1.0, "1/s", "P gain of the height", zero=False, low=1.0, high=3.0)
    z_p: Number = parameter("PSC_VELZ_P", 5.0, "1/s", "P gain of the vertical velocity", low=1.0, high=8.0)
    z_i: Number = parameter("PSC_VELZ_I", 0.0, "1/s^2", "I gain of the vertical velocity", low=0.0, high=1.0)
    z_d: Number = parameter("PSC_VELZ_D", 0.0, "-", "D gain of the vertical velocity", high=1.0)
    z_ff: Number = parameter("PSC_VELZ_FF", 0.0, "1/s", "feed-forward gain of the vertical velocity", high=1.0)
    z_most: Number = fixed("PSC_VELZ_IMAX", 1000.0, "cm/s^2", "limit of the vertical velocity's integral")
    z_error: Number = cutoff("PSC_VELZ_FLTE", 5.0, "vertical velocity's error")
    z_slope: Number = cutoff("PSC_VELZ_FLTD", 5.0, "vertical velocity's D part")
    acc_p: Number = parameter("PSC_ACCZ_P", 0.5, "0.001 s^2/cm", "P gain of the vertical acceleration", low=0.2, high=1.5)
    acc_i: Number = parameter("PSC_ACCZ_I", 1.0, "0.001 s/cm", "I gain of the vertical acceleration", high=3.0)
    acc_d: Number = parameter("PSC_ACCZ_D", 0.0, "0.001 s^3/cm", "D gain of the vertical acceleration", high=0.4)
    acc_ff: Number = parameter("PSC_ACCZ_FF", 0.0, "0.001 s^2/cm", "feed-forward gain of the vertical acceleration", high=0.5)
    acc_d_ff: Number = parameter("PSC_ACCZ_D_FF", 0.0, "0.001 s^3/cm", "feed-forward gain of the vertical jerk", high=0.02)
    acc_most: Number = fixed("PSC_ACCZ_IMAX", 800.0, "0.001", "limit of the vertical acceleration's integral")
    acc_pd: Number = fixed("PSC_ACCZ_PDMX", 0.0, "0.001", "limit of the vertical acceleration's P and D; 0: none")
    acc_target: Number = cutoff("PSC_ACCZ_FLTT", 0.0, "vertical acceleration's target")
    acc_error: Number = cutoff("PSC_ACCZ_FLTE", 20.0, "vertical acceleration's error")
    acc_slope: Number = cutoff("PSC_ACCZ_FLTD", 0.0, "vertical acceleration's D part")
    lean: Number = fixed("PSC_ANGLE_MAX", 0.0, "deg", "largest lean; 0: ANGLE_MAX")
    copter_lean: Number = fixed("ANGLE_MAX", 3000.0, "cdeg", "largest lean", zero=False)
    speed: Number = fixed("WPNAV_SPEED", 1000.0, "cm/s", "speed of the horizontal correction", zero=False)
    up: Number = fixed("WPNAV_SPEED_UP", 250.0, "cm/s", "speed of a climbing correction", zero=False)
    down: Number = fixed("WPNAV_SPEED_DN", 150.0, "cm/s", "speed of a descending correction", zero=False)
    brake: Number = fixed("WPNAV_ACCEL", 250.0, "cm/s^2", "deceleration of horizontal corrections", zero=False)
    brake_z: Number = fixed("WPNAV_ACCEL_Z", 100.0, "cm/s^2", "deceleration of vertical corrections", zero=False)


class MotorParameters(NamedTuple):
    """MOT and INS."""

    expo: Number = fixed("MOT_THST_EXPO", 0.65, "-", "share of a motor's thrust that is quadratic in its command")
    spin_min: Number = fixed("MOT_SPIN_MIN", 0.15, "-", "command of no thrust")
    spin_max: Number = fixed("MOT_SPIN_MAX", 0.95, "-", "command of full thrust", zero=False)
    hover: Number = fixed("MOT_THST_HOVER", 0.35, "-", "hover throttle", zero=False)
    learn: Number = switch("MOT_HOVER_LEARN", 2.0, "1 or 2: the hover throttle is learnt", most=2)
    headroom: Number = fixed("MOT_YAW_HEADROOM", 200.0, "0.001", "headroom reserved for yaw")
    gyro_cut: Number = fixed("INS_GYRO_FILTER", 20.0, "Hz", "cut-off of the gyro's low-pass; 0: none", high=256.0)
    acc_cut: Number = fixed("INS_ACCEL_FILTER", 20.0, "Hz", "cut-off of the accelerometer's low-pass; 0: none")


def setting(name: str, default: float, unit: str, meaning: str, low: float, high: float, tunable: bool = False) -> Number:
    """Declares a setting, which the command line takes from `low` to `high` only."""
    return parameter(name, default, unit, meaning, low=low, high=high, zero=low <= 0.0, tunable=tunable, only="range")


def hertz(name: str, default: float, meaning: str, most: float = 1000.0) -> Number:
    """Declares a cut-off or centre, of which 0 switches the filter off."""
    return setting(name, default, "Hz", f"{meaning}; 0: none", 0.0, most)


def choice(name: str, default: str, meaning: str) -> Number:
    """Declares one of `CHOICES`."""
    every = CHOICES[name]
    said = ", ".join(f"{place} {one}" for place, one in enumerate(every))
    return switch(name, float(every.index(default)), f"{meaning}: {said}", len(every) - 1)


def scale(name: str, default: float, meaning: str, most: float = 250.0, tunable: bool = True) -> Number:
    """Declares a number without unit."""
    return setting(name, default, "-", meaning, 0.0, most, tunable=tunable)


class AxisParameters(NamedTuple):
    """Of an axis, as `axis_parameters` declares them. d: the largest; d_min: where all is calm."""

    p: Number
    i: Number
    d: Number
    f: Number
    d_min: Number


def axis_parameters(axis: str, p: float, i: float, d: float, f: float, d_min: float) -> AxisParameters:
    rate = f"of the {axis} rate"
    return nested(
        p=scale(f"p_{axis}", p, f"P gain {rate}"),
        i=scale(f"i_{axis}", i, f"I gain {rate}"),
        d=scale(f"d_{axis}", d, f"D gain {rate}"),
        f=scale(f"f_{axis}", f, f"feed-forward gain {rate}", 1000.0),
        d_min=scale(f"d_min_{axis}", d_min, f"D gain {rate} in calm flight; 0: no change"),
    )


class Filters(NamedTuple):
    """Of the gyro, and of the D part behind it. A dynamic cut-off rises with throttle from its least to its most; with a least
    of 0 the static one holds.
    """

    gyro2: Number = hertz("gyro_lpf2_static_hz", 500.0, "cut-off of the gyro's second low-pass")
    gyro2_type: Number = choice("gyro_lpf2_type", "PT1", "kind of the gyro's second low-pass")
    notch: Number = hertz("gyro_notch1_hz", 0.0, "centre of the gyro's notch")
    notch_cut: Number = hertz("gyro_notch1_cutoff", 0.0, "lower cut-off of the gyro's notch")
    gyro1: Number = hertz("gyro_lpf1_static_hz", 250.0, "static cut-off of the gyro's first low-pass")
    gyro1_type: Number = choice("gyro_lpf1_type", "PT1", "kind of the gyro's first low-pass")
    gyro_least: Number = hertz("gyro_lpf1_dyn_min_hz", 250.0, "lowest dynamic cut-off of the gyro's first low-pass")
    gyro_most: Number = hertz("gyro_lpf1_dyn_max_hz", 500.0, "highest dynamic cut-off of the gyro's first low-pass")
    gyro_expo: Number = scale("gyro_lpf1_dyn_expo", 5.0, "curvature of the gyro's dynamic cut-off", 10.0, tunable=False)
    d_notch: Number = hertz("dterm_notch_hz", 0.0, "centre of the D part's notch")
    d_notch_cut: Number = hertz("dterm_notch_cutoff", 0.0, "lower cut-off of the D part's notch")
    d1: Number = hertz("dterm_lpf1_static_hz", 75.0, "static cut-off of the D part's first low-pass")
    d1_type: Number = choice("dterm_lpf1_type", "PT1", "kind of the D part's first low-pass")
    d_least: Number = hertz("dterm_lpf1_dyn_min_hz", 75.0, "lowest dynamic cut-off of the D part's first low-pass")
    d_most: Number = hertz("dterm_lpf1_dyn_max_hz", 150.0, "highest dynamic cut-off of the D part's first low-pass")
    d_expo: Number = scale("dterm_lpf1_dyn_expo", 5.0, "curvature of the D part's dynamic cut-off", 10.0, tunable=False)
    d2: Number = hertz("dterm_lpf2_static_hz", 150.0, "cut-off of the D part's second low-pass")
    d2_type: Number = choice("dterm_lpf2_type", "PT1", "kind of the D part's second low-pass")
    yaw: Number = hertz("yaw_lowpass_hz", 100.0, "cut-off of yaw's P part", 500.0)


class Shared(NamedTuple):
    """Of all axes."""

    d_gain: Number = scale("d_max_gain", 37.0, "how much D rises with changes of the gyro's rate", 100.0, tunable=False)
    d_advance: Number = scale("d_max_advance", 20.0, "how much D rises with changes of the setpoint", 200.0, tunable=False)
    i_limit: Number = scale("iterm_limit", 400.0, "limit of the I parts", 500.0, tunable=False)
    windup: Number = scale("iterm_windup", 85.0, "range of the motors' mix above which I slows down [%]", 100.0, False)
    relax: Number = choice("iterm_relax", "RP", "axes whose I part is relaxed while the setpoint changes")
    relax_type: Number = choice("iterm_relax_type", "SETPOINT", "signal that relaxes the I part")
    relax_cut: Number = setting("iterm_relax_cutoff", 15.0, "Hz", "cut-off of the I relaxation's filter", 1.0, 50.0)
    limit: Number = scale("pidsum_limit", 500.0, "limit of the sum of all parts in roll and pitch", 1000.0, tunable=False)
    limit_yaw: Number = scale("pidsum_limit_yaw", 400.0, "limit of the sum of all parts in yaw", 1000.0, tunable=False)
    gravity_gain: Number = scale("anti_gravity_gain", 80.0, "how much I rises with a moving throttle", tunable=False)
    gravity_p: Number = scale("anti_gravity_p_gain", 100.0, "how much P rises with a moving throttle", tunable=False)
    gravity_cut: Number = setting("anti_gravity_cutoff_hz", 5.0, "Hz", "cut-off of the anti-gravity filter", 2.0, 50.0)
    tpa_mode: Number = choice("tpa_mode", "D", "what a high throttle attenuates")
    tpa_rate: Number = setting("tpa_rate", 65.0, "%", "attenuation at full throttle of what tpa_mode names", 0.0, 100.0)
    tpa_breakpoint: Number = setting(
        "tpa_breakpoint", 1350.0, "us", "throttle above which tpa_mode attenuates", 1000.0, 2000.0
    )
    boost: Number = scale("throttle_boost", 5.0, "boost of a moving throttle", 100.0, tunable=False)
    boost_cut: Number = setting("throttle_boost_cutoff", 15.0, "Hz", "cut-off of the throttle boost's filter", 5.0, 50.0)
    linear: Number = setting("thrust_linear", 0.0, "%", "compensation for thrust that is quadratic in the command", 0.0, 150.0)
    output_limit: Number = setting("motor_output_limit", 100.0, "%", "largest output of a motor", 1.0, 100.0)
    idle: Number = setting("dshot_idle_value", 550.0, "0.01 %", "smallest output of a motor", 0.0, 2000.0)
    airmode: Number = switch("airmode", 1.0, "1: with the feature AIRMODE; 0: without")
