"""Autopilots as described by their logs and parameters: rate loops, motors and their limits, notches, descent rates; and
the part of a rate loop's command that its setpoint alone produced.

A rate loop commands u = F r - K y of its setpoint r and the rate y. An attitude loop responds to the angle: r = w - P
(angle). What is left, w, comes from sticks, an attitude setpoint or an autotune and does not respond to the gyro. With y =
G u, then, u = F w - (K + F P / s) G u: d = F w excites the command as if it were added there, and u / d is the sensitivity
1 / (1 + L).
"""

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from quadstep.control.registry import controller
from quadstep.identify.response import Complex
from quadstep.interfaces.controller import Controller, Measured
from quadstep.io.errors import UserError
from quadstep.io.parameter_files import I_SCALE, P_SCALE, PER_MOTOR, YAW_I

Limits = dict[str, tuple[float, float]]
"""Least and largest value in flight of each motor, by column."""


class Notch(NamedTuple):
    """A filter of the gyro against a peak: what its parameters begin with, which frequencies it may take [Hz], and whether it
    follows one of them.
    """

    name: str
    low: float
    high: float
    follows: bool = False


PX4_MOTORS = tuple(f"actuator_motors.control[{place}]" for place in range(12))
ARDUPILOT_MOTORS = tuple(f"RCOU.C{number}" for number in range(1, 15))
BETAFLIGHT_MOTORS = tuple(f"main.motor[{place}]" for place in range(8))
COLUMNS = {"px4": PX4_MOTORS, "ardupilot": ARDUPILOT_MOTORS, "betaflight": BETAFLIGHT_MOTORS}
"""Columns of motors."""

SINKING = {"px4": "vehicle_local_position.vz", "ardupilot": "XKF1.VD"}
"""Columns of the velocity downwards [m/s], where there is one."""

FUNCTIONS = {*range(33, 41), *range(82, 86)}
"""SERVOn_FUNCTION of ArduPilot's motors 1 to 12."""


def limits(form: str, parameters: Mapping[str, float]) -> Limits:
    """Of the motors; empty where the parameters do not tell them."""
    if form == "px4":
        return dict.fromkeys(PX4_MOTORS, (0.0, 1.0))
    if form == "betaflight":
        low, high = (parameters.get(f"motorOutput[{place}]", 0.0) for place in range(2))
        return dict.fromkeys(BETAFLIGHT_MOTORS, (low, high)) if low < high else {}
    least, most = (parameters.get(f"MOT_PWM_{name}", 0.0) for name in ("MIN", "MAX"))
    if not 0.0 < least < most:
        return {}
    ends = [
        least + (most - least) * parameters.get(f"MOT_SPIN_{name}", share) for name, share in (("MIN", 0.15), ("MAX", 0.95))
    ]
    numbers = enumerate(ARDUPILOT_MOTORS, 1)
    return {name: (ends[0], ends[1]) for number, name in numbers if parameters.get(f"SERVO{number}_FUNCTION") in FUNCTIONS}


def notches(form: str, parameters: Mapping[str, float]) -> list[Notch]:
    """Those that are on, by name. Where one follows a frequency, it may take any from its least one on."""
    found = []
    if form == "px4":
        for place in range(2):
            at, wide = (parameters.get(f"IMU_GYRO_NF{place}_{name}", 0.0) for name in ("FRQ", "BW"))
            if at > 0.0:
                found.append(Notch(f"IMU_GYRO_NF{place}", at - 0.5 * wide, at + 0.5 * wide))
        if parameters.get("IMU_GYRO_DNF_EN", 0.0) > 0.0:
            found.append(Notch("IMU_GYRO_DNF", parameters.get("IMU_GYRO_DNF_MIN", 25.0), math.inf, follows=True))
        return found
    if form == "betaflight":
        for place in range(2):
            at, cut = (parameters.get(f"gyro_notch_{name}[{place}]", 0.0) for name in ("hz", "cutoff"))
            if 0.0 < cut < at:
                found.append(Notch("gyro_notch", cut, at * at / cut))
        if parameters.get("dyn_notch_count", 0.0) > 0.0:
            low, high = (parameters.get(f"dyn_notch_{name}_hz", usual) for name, usual in (("min", 100.0), ("max", 600.0)))
            found.append(Notch("dyn_notch", low, high, follows=True))
        if parameters.get("gyro_rpm_notch_harmonics", 0.0) > 0.0:
            found.append(Notch("rpm_filter", parameters.get("gyro_rpm_notch_min", 100.0), math.inf, follows=True))
        return found
    for stem in ("INS_HNTCH_", "INS_HNTC2_"):
        at, wide = (parameters.get(f"{stem}{name}", 0.0) for name in ("FREQ", "BW"))
        if parameters.get(f"{stem}ENABLE", 0.0) > 0.0 and at > 0.0:
            fixed = parameters.get(f"{stem}MODE", 1.0) == 0.0
            each = harmonics(parameters.get(f"{stem}HMNCS", 3.0))
            ends = [(k * at - 0.5 * wide, k * at + 0.5 * wide) for k in each] if fixed else [(at - 0.5 * wide, math.inf)]
            found += [Notch(stem.removesuffix("_"), *one, follows=not fixed) for one in ends]
    return found


USUAL_RATE = 400.0
"""Loops of ArduPilot in a second, where the log does not say how many."""

RISING = "d_min", "d_max"
"""Headers of Betaflight, a number an axis: with one above 0, D rises with activity."""


AXES = "roll", "pitch", "yaw"


def harmonics(bits: float) -> list[int]:
    """The multiples of its frequency that a harmonic notch stops, of the bits of `INS_HNTCH_HMNCS`."""
    return [number for number in range(1, 9) if int(bits) >> (number - 1) & 1]


class Filter(NamedTuple):
    """A low-pass: the name of its cut-off [Hz], 0 where it is off; shared: whether it is that of other axes too."""

    name: str
    shared: bool


class Notches(NamedTuple):
    """Fixed notches of an autopilot's gyro, as the loops here have them. stems: what names begin with; centre, band: how those
    of the frequency and the bandwidth [Hz] end. rate: parameter of the loop's rate [Hz]. on: endings that switch one on, the
    first being 0 where it is off; usual: what a log does not tell while it is. depth: how the name of the attenuation [dB]
    ends, where bandwidths are octaves.
    """

    stems: tuple[str, ...]
    centre: str
    band: str
    rate: str
    on: Mapping[str, float] = MappingProxyType({})
    usual: Mapping[str, float] = MappingProxyType({})
    depth: str = ""

    def shape(self, stem: str, parameters: Mapping[str, float]) -> tuple[float, float, float]:
        """Frequency and half-power bandwidth [Hz] of one, 0 where it is off or moves, and its gain at the frequency: 60 dB
        deep where it is deeper, so that controllers have a ratio.
        """
        centre, band = (parameters.get(f"{stem}{ending}", 0.0) for ending in (self.centre, self.band))
        if not self.depth:
            return centre, band, 1e-3
        if parameters.get(f"{stem}ENABLE", 0.0) <= 0.0 or parameters.get(f"{stem}MODE", 0.0) != 0.0 or centre <= 0.5 * band:
            return 0.0, 0.0, 1.0
        edge = centre / (centre - 0.5 * band)
        return centre, (edge - 1.0 / edge) * centre, 10.0 ** (-parameters.get(f"{stem}{self.depth}", 40.0) / 20.0)

    @property
    def off(self) -> str:
        """The ending that is 0 where a notch is off."""
        return next(iter(self.on), self.centre)

    def switches(self, name: str) -> bool:
        """Whether a parameter only switches a notch."""
        return any(name == f"{stem}{ending}" for stem in self.stems for ending in self.on)


HARMONIC = {"ENABLE": 1.0, "MODE": 0.0, "HMNCS": 1.0}
"""Of ArduPilot's harmonic notch: on, at a fixed frequency, at that alone."""

NOTCHES = {
    "px4": Notches(("IMU_GYRO_NF0_", "IMU_GYRO_NF1_"), "FRQ", "BW", "IMU_GYRO_RATEMAX", usual={"BW": 20.0}),
    "ardupilot": Notches(
        ("INS_HNTCH_", "INS_HNTC2_"), "FREQ", "BW", "SCHED_LOOP_RATE", HARMONIC,
        {"MODE": 1.0, "HMNCS": 3.0, "FREQ": 80.0, "BW": 40.0}, "ATT",
    ),
}  # fmt: skip


NOTCH_RANGES = {"FREQ": (10.0, 495.0), "BW": (5.0, 250.0)}
"""Documented of ArduPilot's harmonic notches [Hz], which its law here has not."""

LAWS = {"px4": "px4-cascade", "ardupilot": "ardupilot-cascade", "betaflight": "betaflight-rates"}
"""With the parameters of autopilots, by the form of their files."""


class RateLoop(NamedTuple):
    """One axis. setpoint, rate, command: columns; unit: of the first two [rad/s]. form: of a file of its parameters, as in
    `io/parameter_files.py`. stem: what the names of its gains begin with. scaled: endings of those that together scale all of
    its command but feed-forward. attitude: gain of the loop around it [1/s]. apart: columns of
    feed-forward and D, where what they make of the command is logged by itself; F and K are then those of the rest.
    """

    axis: str
    setpoint: str
    rate: str
    command: str
    unit: float
    form: str
    stem: str
    scaled: tuple[str, ...]
    attitude: str
    apart: tuple[str, ...] = ()

    def gains(self, parameters: Mapping[str, float]) -> dict[str, float] | None:
        """The parameters that together scale its command; None where the log has them not."""
        names = [f"{self.stem}{ending}" for ending in self.scaled]
        if any(parameters.get(f"{name}[{AXES.index(self.axis)}]", 0.0) > 0.0 for name in RISING if self.form == "betaflight"):
            return None
        return {name: parameters[name] for name in names} if all(name in parameters for name in names) else None

    def bypassed(self, parameters: Mapping[str, float]) -> bool:
        """Whether a feed-forward, which these do not scale, makes part of the command from what the attitude loop answers."""
        return parameters.get(f"{self.stem}FF", 0.0) != 0.0

    def transfers(self, parameters: Mapping[str, float], s: Complex) -> tuple[Complex, Complex]:
        """F and K at s = j omega [rad/s]. Raises UserError for a gain that is not known."""

        def parameter(ending: str, otherwise: float | None = None) -> float:
            found = parameters.get(f"{self.stem}{ending}", otherwise)
            if found is None:
                raise UserError(f"{self.stem}{ending} is not among the log's parameters")
            return found

        if self.form == "betaflight":
            p, i = P_SCALE * parameter(f"p_{self.axis}") / self.unit, I_SCALE * parameter(f"i_{self.axis}") / self.unit
            inner = p + i * (YAW_I if self.axis == "yaw" else 1.0) / s
            return inner, inner
        if self.form == "px4":
            scale, cuts, on_rate = parameter("K", 1.0), (0.0, 0.0, parameters.get("IMU_DGYRO_CUTOFF", 30.0)), True
        else:
            scale, cuts, on_rate = 1.0, (parameter("FLTT", 0.0), parameter("FLTE", 0.0), parameter("FLTD", 0.0)), False
        period = self.late(parameters)
        delayed: Complex = np.exp(-period * s).astype(np.complex128)
        s = (1.0 - delayed) / period if period else s  # ArduPilot takes slopes and sums from sample to sample
        target, error, slope = (1.0 / (1.0 + s / (2.0 * math.pi * cut)) if cut > 0.0 else 1.0 + 0.0 * s for cut in cuts)
        p, i, d = (scale * parameter(ending) for ending in "PID")
        inner, sloped = p + i / s, d * s * slope
        forward = inner if on_rate else inner + sloped
        return delayed * target * (error * forward + parameter("FF", 0.0)), error * (inner + sloped)

    def controller(self, parameters: Mapping[str, float], s: Complex, levelled: bool) -> Complex:
        """From the rate, before its low-pass, to the command, times -1, at s = j omega [rad/s]. levelled: whether the attitude
        loop gives the setpoint. Raises UserError for a gain that is not known.
        """
        forward, back = self.transfers(parameters, s)
        around = parameters.get(self.attitude) if levelled else 0.0
        if around is None:
            raise UserError(f"{self.attitude} is not among the log's parameters")
        return back * self.notched(parameters, s) / self.unfiltered(parameters, s) + forward * around / s

    @property
    def law(self) -> type[Controller]:
        """The law with its parameters, their documented ranges and the release."""
        found = controller(Measured, LAWS[self.form])
        assert found
        return found

    def documented(self, name: str) -> tuple[float, float]:
        """The range that the autopilot documents for a parameter."""
        found = self.law.by_key().get(name)
        low, high = (found[1].low, found[1].high) if found else NOTCH_RANGES.get(name.rpartition("_")[2], (None, None))
        return low or 0.0, math.inf if high is None else high

    @property
    def notches(self) -> Notches:
        """The fixed notches of its gyro; none where `controller` does not count them."""
        return NOTCHES.get(self.form, Notches((), "", "", ""))

    def notched(self, parameters: Mapping[str, float], s: Complex) -> Complex:
        """What its notches make of the rate at s = j omega [rad/s]."""
        found: Complex = 1.0 + 0.0 * s
        for stem in self.notches.stems:
            centre, band, depth = self.notches.shape(stem, parameters)
            for number in harmonics(parameters.get(f"{stem}HMNCS", 1.0)) if centre > 0.0 and band > 0.0 else ():
                at, wide = (2.0 * math.pi * number * value for value in (centre, band))
                found = found * (s**2 + depth * wide * s + at**2) / (s**2 + wide * s + at**2)
        return found

    def changed(self, name: str, before: float, after: float) -> str:
        """That a parameter changes, in words."""
        return f"{name} from {before:.4g} to {self.valued(name, after)}"

    def valued(self, name: str, value: float) -> str:
        bare = name == self.integral or self.notches.switches(name)
        return f"{value:.4g}" + (" 1/s" if name == self.attitude else "" if bare else " Hz")

    @property
    def integral(self) -> str:
        """Its I gain, where a plant tells what that does."""
        return f"{self.stem}I" if self.stem else ""

    @property
    def whole_gains(self) -> bool:
        """Whether its gains are whole numbers."""
        return self.form == "betaflight"

    def has(self, name: str) -> bool:
        """Whether a parameter is one of its gains, filters or notches, or the gain of the attitude loop."""
        stems = (self.stem or " ", *self.notches.stems)
        return name.startswith(stems) or name in (self.attitude, *self.scaled, *(one.name for one in self.filters))

    @property
    def named(self) -> str:
        """Its gains, in words."""
        return f"{self.stem}*" if self.stem else ", ".join(self.scaled)

    @property
    def filters(self) -> tuple[Filter, ...]:
        """What its rate and its error pass."""
        if self.form == "betaflight":
            return ()
        if self.form == "px4":
            return Filter("IMU_GYRO_CUTOFF", True), Filter("IMU_DGYRO_CUTOFF", True)
        return Filter("INS_GYRO_FILTER", True), *(Filter(f"{self.stem}FLT{one}", False) for one in "DET")

    @property
    def whole(self) -> float:
        """The largest command."""
        return PER_MOTOR if self.form == "betaflight" else 1.0

    def late(self, parameters: Mapping[str, float]) -> float:
        """Time [s] from a logged setpoint to the logged command that answers it. A loop of ArduPilot runs its rate controllers
        before it makes their next setpoint, or the next value of an excitation, and logs both after that.
        """
        rate = parameters.get("SCHED_LOOP_RATE", USUAL_RATE)
        return 0.0 if self.form != "ardupilot" else 1.0 / (rate if rate > 0.0 else USUAL_RATE)

    def unfiltered(self, parameters: Mapping[str, float], s: Complex) -> Complex:
        """What undoes the low-pass of the gyro (Butterworth's, of second order) at s = j omega [rad/s]: angles have none."""
        px4 = self.form == "px4"
        cut = 2.0 * math.pi * parameters.get("IMU_GYRO_CUTOFF" if px4 else "INS_GYRO_FILTER", 40.0 if px4 else 20.0)
        return 1.0 + math.sqrt(2.0) * s / cut + (s / cut) ** 2 if cut > 0.0 else 1.0 + 0.0 * s


NAMES = ("ROLL", "RLL"), ("PITCH", "PIT"), ("YAW", "YAW")
PX4 = tuple(
    RateLoop(
        axis, f"vehicle_rates_setpoint.{axis}", f"vehicle_angular_velocity.xyz[{place}]",
        f"{command}[{place}]", 1.0, "px4", f"MC_{name}RATE_", ("K",), f"MC_{name}_P",
    )
    for command in ("vehicle_torque_setpoint.xyz", "actuator_controls_0.control")  # from 1.14 on, and before
    for place, (axis, (name, _)) in enumerate(zip(AXES, NAMES, strict=True))
)  # fmt: skip
ARDUPILOT = tuple(
    RateLoop(
        axis, f"RATE.{axis[0].upper()}Des", f"RATE.{axis[0].upper()}", f"RATE.{axis[0].upper()}Out", math.radians(1.0),
        "ardupilot", f"ATC_RAT_{name}_", ("P", "I", "D"), f"ATC_ANG_{name}_P",
    )
    for axis, (_, name) in zip(AXES, NAMES, strict=True)
)  # fmt: skip
BETAFLIGHT = tuple(
    RateLoop(
        axis, f"main.setpoint[{place}]", f"main.gyroADC[{place}]", f"main.axisSum[{place}]", math.radians(1.0),
        "betaflight", "", (f"p_{axis}", f"i_{axis}", f"d_{axis}"), "", (f"main.axisF[{place}]", f"main.axisD[{place}]"),
    )
    for place, axis in enumerate(AXES)
)  # fmt: skip
