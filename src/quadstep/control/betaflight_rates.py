"""Betaflight's rate loop, filters and mixer (release 4.5), led by our own outer loops: Betaflight alone follows rates only.

With the setpoint w and the filtered gyro y of an axis [deg/s], its output is P + I + D + F:

    P = kp (w - y),   I <- clip(I + ki (w - y) T, +-limit),   D = -kd d(low_pass(y))/dt,   F = kf dw/dt

where I waits for a setpoint that changes (`iterm_relax`) and for motors near their limits (`iterm_windup`), rises with a
moving throttle (anti-gravity), D rises with activity (`d_min`) and falls with throttle (TPA). Axes: roll to the right, pitch
nose down, yaw to the left, which are the body's x, y and z.
"""

import math
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

from quadstep.control.autopilot_parameters import AxisParameters, Filters, Shared, axis_parameters
from quadstep.control.cascaded_pid import OuterGains, OuterMemory, asked_rates, first_memory, guided
from quadstep.control.filters import SHARPER, cut_off, low_passed, notch, share_in_a_sample, twice
from quadstep.control.mixers import FULL, OnQuarters
from quadstep.control.vectoring import up_axis
from quadstep.interfaces.controller import Controller, Measured, RotorThrusts
from quadstep.interfaces.gain import nested
from quadstep.interfaces.plant import Model, Reference
from quadstep.io.parameter_files import D_SCALE, F_SCALE, I_SCALE, P_SCALE, PER_MOTOR, YAW_I
from quadstep.numbers import Number, Vector, absolute, clip, largest, maximum, minimum, smallest, sqrt, vector, where
from quadstep.numbers.rotations import rotation_matrix, yaw_pitch_roll

DEGREES = 180.0 / math.pi

RELAXED = 40.0
"""A change of the setpoint that stops I altogether [deg/s]."""

D_SHARE, D_SMOOTH = 0.00008, 35.0
"""Of a 1 of `d_max_gain`; the cut-off that smooths what activity does [Hz]."""

D_ACTIVE, D_EACH = 829.825256, 341.69278
"""Cut-offs of each of the two low-passes that tell activity, at 85 Hz together, and that smooth [rad/s], as f32 has them."""

GRAVITY_I, GRAVITY_P, STEADY = 0.34, 0.0034, 50.0
"""Of anti-gravity, into I and P; the setpoint from which P gets less of it [deg/s]."""


class BetaflightRatesGains(NamedTuple):
    """The outer loops', the firmware's parameters, and the thrust of a rotor at full command [N]."""

    outer: OuterGains
    roll: AxisParameters = axis_parameters("roll", 45.0, 80.0, 40.0, 120.0, 30.0)
    pitch: AxisParameters = axis_parameters("pitch", 47.0, 84.0, 46.0, 125.0, 34.0)
    yaw: AxisParameters = axis_parameters("yaw", 45.0, 80.0, 0.0, 120.0, 0.0)
    filters: Filters = nested()
    shared: Shared = nested()
    full_thrust: Number = FULL


class Axis(NamedTuple):
    """Of one axis. gyro2, notch, gyro1: states of the gyro's filters. d_notch, d1, d2: states of the D part's filters. before:
    the gyro [deg/s] behind these. relax: low-pass of the setpoint [deg/s]. asked: the setpoint before [deg/s]. active, smooth:
    states of what activity does to D. p: low-pass of yaw's P part. integral: the I part.
    """

    gyro2: Vector
    notch: Vector
    gyro1: Vector
    d_notch: Vector
    d1: Vector
    d2: Vector
    before: Number
    relax: Number
    asked: Number
    active: Vector
    smooth: Vector
    p: Number
    integral: Number


class MixerState(NamedTuple):
    """What the mixer leaves for the next sample. throttle: from 0 to 1. range: of what axes ask of motors. gravity: states of
    anti-gravity's filter. boost: low-pass of the throttle.
    """

    throttle: Number
    range: Number
    gravity: Vector
    boost: Number


class BetaflightRatesMemory(NamedTuple):
    """Of the outer loops, the axes and the mixer."""

    outer: OuterMemory
    roll: Axis
    pitch: Axis
    yaw: Axis
    mixed: MixerState


def still() -> Axis:
    two, three = vector(0.0, 0.0), vector(0.0, 0.0, 0.0)
    return Axis(three, two, three, two, three, three, 0.0, 0.0, 0.0, two, two, 0.0, 0.0)


def filtered(f: Filters, m: Axis, rate: Number, throttle: Number, period: Number) -> tuple[Number, Axis]:
    """The gyro's rate [deg/s] behind its filters."""
    slow, gyro2 = low_passed(f.gyro2_type, f.gyro2, m.gyro2, rate, period)
    slow, notched = notch(f.notch, f.notch_cut, m.notch, slow, period)
    cut = cut_off(f.gyro1, f.gyro_least, f.gyro_most, f.gyro_expo, throttle)
    slow, gyro1 = low_passed(f.gyro1_type, cut, m.gyro1, slow, period)
    return slow, m._replace(gyro2=gyro2, notch=notched, gyro1=gyro1)


def pid(
    own: AxisParameters, s: Shared, f: Filters, m: Axis, mixed: MixerState, asked: Number, gyro: Number, period: Number,
    turn: bool = False,
) -> tuple[Number, Axis]:  # fmt: skip
    """An axis's output. asked, gyro: its setpoint and its filtered rate [deg/s]. turn: whether it is yaw."""
    rate, error, throttle = 1.0 / period, asked - gyro, mixed.throttle
    gravity = mixed.gravity[1] * s.gravity_gain
    knee = clip((s.tpa_breakpoint - 1000.0) / 1000.0, 0.0, 0.99)
    tpa = 1.0 - (s.tpa_rate / 100.0) / (1.0 - knee) * maximum(throttle - knee, 0.0)

    slow, d_notch = notch(f.d_notch, f.d_notch_cut, m.d_notch, gyro, period)
    slow, d1 = low_passed(f.d1_type, cut_off(f.d1, f.d_least, f.d_most, f.d_expo, throttle), m.d1, slow, period)
    slow, d2 = low_passed(f.d2_type, f.d2, m.d2, slow, period)
    delta = -(slow - m.before) * rate
    change = (asked - m.asked) * rate

    proportional = P_SCALE * own.p * error * where(s.tpa_mode < 0.5, tpa, 1.0)
    p = m.p + share_in_a_sample(f.yaw, period) * (proportional - m.p)
    if turn:
        proportional = where(f.yaw > 0.0, p, proportional)
    else:
        proportional = proportional * (
            1.0 + gravity / maximum(absolute(asked) / STEADY, 1.0) * (s.gravity_p / 100.0 * GRAVITY_P)
        )

    wished, relax = relaxed(s, m, asked, gyro, period, turn)
    ki = I_SCALE * own.i * YAW_I if turn else I_SCALE * own.i + gravity * GRAVITY_I
    room = clip((1.0 - mixed.range) * (1.0 / (1.0 - minimum(s.windup, 99.0) / 100.0)), 0.0, 1.0)
    step = ki * where(s.windup < 99.5, room, 1.0) * period * wished
    integral = clip(m.integral + step, -s.i_limit, s.i_limit)

    active, was_active = twice(m.active, delta, D_ACTIVE, period)
    least = where(own.d_min > 0.0, where(own.d_min < own.d, own.d_min / maximum(own.d, 1.0), 0.0), 0.0)
    by_gyro = absolute(active) * (D_SHARE * s.d_gain / D_SMOOTH)
    by_setpoint = absolute(change) * (D_SHARE * s.d_gain * s.d_advance / 100.0 / D_SMOOTH)
    more, smooth = twice(m.smooth, least + (1.0 - least) * maximum(by_gyro, by_setpoint), D_EACH, period)
    derivative = D_SCALE * own.d * delta * where(least > 0.0, minimum(more, 1.0), 1.0) * tpa

    output = proportional + integral + derivative + F_SCALE * (own.f * 0.01) * change
    return output, m._replace(
        d_notch=d_notch, d1=d1, d2=d2, before=slow, relax=relax, asked=asked, active=was_active, smooth=smooth, p=p,
        integral=integral,
    )  # fmt: skip


def relaxed(s: Shared, m: Axis, asked: Number, gyro: Number, period: Number, turn: bool) -> tuple[Number, Number]:
    """The error that I integrates, less where the setpoint changes, and the setpoint's low-pass."""
    error = asked - gyro
    slow = m.relax + share_in_a_sample(s.relax_cut, period) * (asked - m.relax)
    quick = absolute(asked - slow)
    off = slow - gyro
    beyond = where(absolute(off) < quick, 0.0, where(off > 0.0, off - quick, off + quick))
    less = where(s.relax_type > 0.5, error * maximum(0.0, 1.0 - quick / RELAXED), beyond)
    falls = where(m.integral > 0.0, where(error < 0.0, 1.0, 0.0), where(m.integral < 0.0, where(error > 0.0, 1.0, 0.0), 0.0))
    wished = where(s.relax > 2.5, where(falls > 0.5, error, less), less)
    on = absolute(absolute(s.relax - 3.0) - 1.0) < 0.5 if turn else s.relax > 0.5
    return where(on, wished, error), slow


def mix(
    s: Shared, m: MixerState, outputs: tuple[Number, Number, Number], throttle: Number, mirrored: bool, period: Number
) -> tuple[tuple[Number, Number, Number, Number], MixerState]:
    """The motors' outputs, from idle to 1: front right, back right, back left, front left. Throttle gives way, so that what is
    asked about the axes is made, if need be all of it smaller.
    """
    roll, pitch = (clip(one, -s.limit, s.limit) / PER_MOTOR for one in outputs[:2])
    yaw = clip(outputs[2], -s.limit_yaw, s.limit_yaw) / PER_MOTOR
    left = yaw if mirrored else -yaw
    above = 1.0 - throttle
    moves = absolute(throttle - m.throttle) * (1.0 / period) * (above * above)
    moves = where(throttle > m.throttle, moves * (above * 0.5), moves)
    _, gravity = twice(m.gravity, moves, 2.0 * math.pi * (s.gravity_cut * SHARPER[2]), period)
    slow = m.boost + share_in_a_sample(s.boost_cut, period) * (throttle - m.boost)
    boosted = where(s.boost > 0.0, clip(throttle + s.boost * 0.1 * (throttle - slow), 0.0, 1.0), throttle)
    bend = s.linear / 100.0
    given = boosted / (1.0 + (bend - 0.5 * (bend * bend)) * ((1.0 - boosted) * (1.0 - boosted)))

    asked = (-roll - pitch + left, -roll + pitch - left, roll + pitch + left, roll - pitch - left)
    most, least = maximum(largest(asked), 0.0), minimum(smallest(asked), 0.0)
    span = most - least
    shy = where(s.airmode > 0.5, 1.0, where(given < 0.5, given + 0.5, 1.0))
    part = where(span > 1.0, shy / maximum(span, 1.0), shy)
    floor, ceiling = -(least * part), 1.0 - most * part
    given = where(given < floor, floor, where(given > ceiling, ceiling, given))
    low, high = s.idle / 10000.0, s.output_limit / 100.0
    whole = tuple(one * part + given for one in asked)
    bent = tuple(one * (1.0 + bend * ((1.0 - one) * (1.0 - one))) for one in whole)
    first, second, third, fourth = (clip(low + (high - low) * one, low, high) for one in bent)
    return (first, second, third, fourth), MixerState(throttle, span, gravity, slow)


def throttle_for(s: Shared, thrust: Number, full: Number) -> Number:
    """The throttle with which four rotors make a thrust [N]: each makes `full` times its motor's output squared."""
    low, high = s.idle / 10000.0, s.output_limit / 100.0
    return clip((sqrt(maximum(thrust, 0.0) / (4.0 * full)) - low) / (high - low), 0.0, 1.0)


@dataclass(frozen=True)
class BetaflightRates(OnQuarters, Controller[BetaflightRatesMemory, Measured, BetaflightRatesGains, RotorThrusts]):
    """The autopilot's rate loops beneath quadstep's position and attitude loops. mirrored: `yaw_motors_reversed`."""

    name = "betaflight-rates"
    label = "Betaflight's rates"
    source = "Betaflight 4.5"
    Gains = BetaflightRatesGains
    commands = RotorThrusts
    rates: ClassVar = {"guide": 0.004, "law": 0.001}
    parameter_file = "betaflight"
    ordered = (
        "gyro_lpf1_dyn_min_hz <= gyro_lpf1_dyn_max_hz", "dterm_lpf1_dyn_min_hz <= dterm_lpf1_dyn_max_hz",
        "gyro_notch1_cutoff < gyro_notch1_hz", "dterm_notch_cutoff < dterm_notch_hz",
    )  # fmt: skip

    def prepare(self, gains: BetaflightRatesGains, model: Model) -> BetaflightRatesGains:
        """The same. Raises ValueError for motors without a range."""
        idle, most = gains.shared.idle / 100.0, gains.shared.output_limit
        if not idle < most:
            raise ValueError(f"motors have no range: dshot_idle_value is {idle:g} %, motor_output_limit {most:g} %")
        return gains

    def start(self, measured: Measured, gains: BetaflightRatesGains) -> BetaflightRatesMemory:
        throttle = throttle_for(gains.shared, gains.outer.mass * gains.outer.gravity, gains.full_thrust)
        mixed = MixerState(throttle, 0.0, vector(0.0, 0.0), throttle)
        return BetaflightRatesMemory(first_memory(measured, gains.outer), still(), still(), still(), mixed)

    def guide(
        self, memory: BetaflightRatesMemory, measured: Measured, reference: Reference, gains: BetaflightRatesGains,
        t: Number, period: Number,
    ) -> BetaflightRatesMemory:  # fmt: skip
        return memory._replace(outer=guided(memory.outer, measured, reference, gains.outer, period))

    def law(
        self, memory: BetaflightRatesMemory, measured: Measured, reference: Reference, gains: BetaflightRatesGains,
        t: Number, period: Number,
    ) -> tuple[RotorThrusts, BetaflightRatesMemory]:  # fmt: skip
        """The attitude loop gives a setpoint, the rate loop motors."""
        s, f, before, outer = gains.shared, gains.filters, memory.mixed, memory.outer
        setpoints = DEGREES * asked_rates(outer, measured, gains.outer)
        rates = DEGREES * measured.rates
        outputs, axes = [], []
        every = (gains.roll, memory.roll), (gains.pitch, memory.pitch), (gains.yaw, memory.yaw)
        for axis, (own, kept) in enumerate(every):
            gyro, behind = filtered(f, kept, rates[axis], before.throttle, period)
            output, after = pid(own, s, f, behind, before, setpoints[axis], gyro, period, turn=axis == 2)
            outputs.append(output)
            axes.append(after)
        throttle = throttle_for(s, outer.force @ up_axis(rotation_matrix(measured.attitude)), gains.full_thrust)
        motors, mixed = mix(s, before, (outputs[0], outputs[1], outputs[2]), throttle, self.mirrored, period)
        made = {rotor: gains.full_thrust * (one * one) for rotor, one in zip(self.rotors, motors, strict=True)}
        command = RotorThrusts(Vector(made[rotor] for rotor in sorted(made)), yaw_pitch_roll(outer.wanted))
        return command, BetaflightRatesMemory(outer, axes[0], axes[1], axes[2], mixed)
