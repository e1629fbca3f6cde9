"""A notch against a resonance that makes a command noisy: advised where it fits, flown, and else refused with the reason."""

import math
import re
from functools import cache
from unittest import mock

import numpy as np
import pytest

from quadstep.identify.changes import NOISY, changes, loud, notches, parameter_changes
from quadstep.identify.logs.series import Series
from quadstep.identify.measured import measured
from quadstep.identify.peaks import highest
from quadstep.identify.plant import plant
from quadstep.identify.rate_loops import ARDUPILOT, BETAFLIGHT, PX4, PX4_MOTORS
from quadstep.identify.symptoms import peak
from quadstep.io.parameter_files import read_parameters
from quadstep.report.sheet import sheet
from quadstep.studies.advise import advise
from tests.challenge.setpoints import OMEGA, least, parameters, read
from tests.challenge.symptoms import slow
from tests.made_logs import rate_loop
from tests.rate_flights import Axis, Ring, flown, stepped

FRAME, ROTOR, NOISE, FAINT = range(4)
"""A resonance of 80 Hz, a rotor's tone there, a white gyro, and a resonance that is shaken little."""

PERIOD = 0.0025
"""Of PX4's usual loop [s]."""

NOTCH = {"IMU_GYRO_NF0_FRQ": 0.0, "IMU_GYRO_NF0_BW": 20.0, "IMU_GYRO_RATEMAX": 1.0 / PERIOD}


def axes(count: int = 4) -> Axis:
    """Sound loops, all alike."""
    one = {"effect": 100.0, "lag": 0.02, "delay": 2, "cut": 60.0, "slope": 30.0, "p": 0.25, "i": 0.25, "d": 0.002}
    one |= {"attitude": 4.0, "period": PERIOD, "target": math.inf, "error": math.inf, "after": 0}
    return Axis(**{name: np.full(count, one[name]) for name in Axis._fields})


def rings(*places: int) -> Ring:
    tones = Ring(
        at=np.full(4, math.sin(math.pi * 80.0 * PERIOD) / (math.pi * PERIOD)),  # 80 Hz, sampled
        damping=np.full(4, 0.015),
        by_torque=np.array([0.05, 0.0, 0.0, 0.05]),
        by_wind=np.array([38.0, 38.0, 0.0, 6.0]),
        moves=np.array([0.0, 0.7, 0.0, 0.0]),
    )
    return Ring(*(field[list(places)] for field in tones))


@cache
def sticks():
    """What a pilot asks for, and the throttle over the usual one."""
    angle = stepped(np.random.default_rng(5), 60.0, period=PERIOD)
    throttle = slow(np.random.default_rng(6), len(angle), 3.0)
    return angle[:, None] * axes().attitude, np.exp(0.03 * throttle)


@cache
def flight():
    """Setpoint, rate and command of all, logged whole."""
    wanted, throttle = sticks()
    noise = np.array([1e-3, 1e-3, 0.3, 1e-3])
    return flown(axes(), wanted, noise, 0.3, 1, 1, rings(FRAME, ROTOR, NOISE, FAINT), None, throttle)


def told(**more: float) -> dict[str, float]:
    return {**parameters(PX4[0], Axis(*(field[0] for field in axes()))), **NOTCH, **more}


def control(place: int):
    """Motors (samples, 12), as PX4 logs them."""
    found = np.full((len(sticks()[1]), 12), np.nan)
    push = 0.1 * np.outer(flight()[2][:, place], [1.0, -1.0, 1.0, -1.0])
    found[:, :4] = np.clip(0.5 * sticks()[1][:, None] + push, 0.0, 1.0)
    return found


@cache
def heard(place: int, every: int = 1, motors: bool = True):
    """What `advise` has of one of them, logged every so many samples."""
    time = PERIOD * np.arange(0, len(flight()[0]), every)
    series = {name: Series(time, control(place)[::every, number]) for number, name in enumerate(PX4_MOTORS[:4])}
    return read(PX4[0], time, [one[::every, place] for one in flight()], told(), series if motors else {})


def said(one) -> str:
    now = measured(one.measured)
    return next(peak(one, now, changes(one, now, plant(one)))).sentence


def test_a_resonance_gets_a_notch_and_flown_with_it_the_command_is_as_quiet_as_said(tmp_path):
    path = tmp_path / "flight.ulg"
    r, y, u = (one[:, FRAME] for one in flight())
    same = {name.replace("ROLL", axis): value for axis in ("ROLL", "PITCH", "YAW") for name, value in told().items()}
    path.write_bytes(rate_loop(r, y, u, PERIOD, same, 1.0, actuator_motors=("float[12] control", control(FRAME))))
    found = advise(path, None, None, tmp_path / "out", False, sheet("svg", None, "screen"))
    written = dict(read_parameters(tmp_path / "out" / "advised.params", "px4").values)
    assert {*written} == {"IMU_GYRO_NF0_FRQ", "IMU_GYRO_NF0_BW"}
    centre, band = written["IMU_GYRO_NF0_FRQ"], written["IMU_GYRO_NF0_BW"]
    assert centre == pytest.approx(80.0, rel=0.02)
    half_power = 2.0 * 0.015 * 80.0
    assert 0.7 * half_power < band < 5.0 * half_power
    assert f"IMU_GYRO_NF0_FRQ from 0 to {centre:.4g} Hz, IMU_GYRO_NF0_BW from 20 to {band:.4g} Hz" in found.more[0]
    before = heard(FRAME)
    advice = changes(before, measured(before.measured), plant(before))
    expected = advice.louder
    assert f"with {100.0 * (1.0 - expected):.0f} % less noise in the command" in found.more[0]
    assert expected * loud(before) < NOISY < loud(before)
    both, ring, stops = axes(2), rings(FRAME, FRAME), [np.array([0.0, centre]), np.array([0.0, band])]
    wanted, throttle = sticks()
    command = flown(both, wanted[:8_000, :2], 1e-3, 0.3, 2, 1, ring, stops, throttle)[2]
    above = 2.0 * math.pi * np.fft.rfftfreq(len(command), PERIOD) > before.beyond
    lines = np.fft.rfft((command - command.mean(axis=0)) * np.hanning(len(command))[:, None], axis=0)[above]
    first, second = np.linalg.norm(lines, axis=0)
    assert second / first == pytest.approx(expected, rel=0.25)
    without, notched = (least(one) for one in both.opened(OMEGA, ring, stops))
    assert notched[2] > 1.0
    cost = measured(before.measured).phase.value.value - advice.expected.phase.value.value
    assert without[1] - notched[1] == pytest.approx(cost, abs=math.radians(0.2))
    assert cost > 0.0


@pytest.mark.parametrize(
    ("one", "why"),
    [
        (lambda: heard(ROTOR), "it moves with the throttle to the power of 0.[5-9]"),
        (lambda: heard(FRAME, motors=False), "the log does not show whether it moves with the throttle"),
        (lambda: heard(FRAME, every=2), "an alias is not excluded, since the log has 200 samples a second and .* is 400 Hz"),
        (lambda: heard(FRAME)._replace(parameters=told(IMU_GYRO_RATEMAX=0.0)), "an alias is not excluded"),
        (lambda: heard(FRAME)._replace(parameters=told(IMU_GYRO_NF0_FRQ=81.0)), "one covers it already"),
        (lambda: heard(FRAME)._replace(parameters=told(IMU_GYRO_NF0_FRQ=150.0)), "of IMU_GYRO_NF0_FRQ, .* none that is 0"),
        (lambda: heard(FRAME)._replace(loop=ARDUPILOT[0]), "of INS_HNTCH_ENABLE, INS_HNTC2_ENABLE the .* none that is 0"),
        (lambda: heard(FRAME)._replace(loop=BETAFLIGHT[0]), "how notches of betaflight change the loop is not modelled"),
        (lambda: heard(FAINT), "noise makes .* % of the whole command, less than 5 %"),
        (lambda: heard(FRAME)._replace(others=()), "none is known to leave all three axes sound"),
        (lambda: with_strange_command(heard(FRAME)), r"the gains explain .* of the command there"),
    ],
)  # fmt: skip
def test_no_notch_is_advised_where_it_would_not_fit_and_the_reason_is_said(one, why):
    found = one()
    assert highest(found).at == pytest.approx(80.0, rel=0.06)
    assert re.search(f"none is advised: .*{why}", said(found)), said(found)
    advised = changes(found, measured(found.measured), plant(found)) if found.loop == PX4[0] else None
    assert advised is None or "IMU_GYRO_NF0_FRQ" not in advised.others


def with_strange_command(one):
    """A flight whose command has a tone at the peak which is not the gyro's."""
    time = one.period * np.arange(len(one.command))
    return one._replace(command=one.command + 0.3 * np.sin(2.0 * math.pi * highest(one).middle * time))


def test_ardupilots_notch_is_switched_on_at_one_frequency_and_its_shape_is_its_own():
    """The table of INS_HNTCH_*: 4 dB and half the attenuation's, from its definition of bandwidth in octaves."""
    loop, told = ARDUPILOT[0], {"INS_HNTCH_ENABLE": 1.0, "INS_HNTCH_MODE": 0.0, "INS_HNTCH_FREQ": 80.0, "INS_HNTCH_BW": 40.0}
    told["INS_HNTCH_HMNCS"] = 1.0

    def stopped(hertz, **more):
        return abs(loop.notched({**told, **more}, np.array([2j * math.pi * hertz]))[0])

    assert stopped(80.0) == pytest.approx(0.01)  # INS_HNTCH_ATT is 40 dB unless the log says another
    assert stopped(80.0, INS_HNTCH_ATT=20.0) == pytest.approx(0.1)
    edges = 60.0, 80.0 * 80.0 / 60.0  # half of the bandwidth below, as many octaves above
    assert [stopped(one) for one in edges] == pytest.approx([math.sqrt(0.5)] * 2, rel=1e-3)
    assert stopped(160.0) > 0.8
    assert stopped(160.0, INS_HNTCH_HMNCS=3.0) < 0.011
    assert stopped(80.0, INS_HNTCH_MODE=1.0) == stopped(80.0, INS_HNTCH_ENABLE=0.0) == 1.0
    hidden = {"INS_HNTCH_ENABLE": 0.0, "SCHED_LOOP_RATE": 400.0}
    one = heard(FRAME)._replace(loop=loop, parameters={**parameters(loop, Axis(*(f[0] for f in axes()))), **hidden})
    with mock.patch("quadstep.identify.changes.unfit", return_value=""):
        first = notches(one, loop)[0]
    switches = {"INS_HNTCH_ENABLE": 1.0, "INS_HNTCH_MODE": 0.0, "INS_HNTCH_HMNCS": 1.0}
    assert first.items() >= switches.items()
    assert first["INS_HNTCH_FREQ"] == pytest.approx(80.0, rel=0.02)
    assert {*first} - {*switches} == {"INS_HNTCH_FREQ", "INS_HNTCH_BW"}
    assert parameter_changes(one, first)["INS_HNTCH_MODE"] == (1.0, 0.0)
    assert loop.changed("INS_HNTCH_MODE", 1.0, 0.0) == "INS_HNTCH_MODE from 1 to 0"


def test_a_white_gyro_gets_no_notch():
    one = heard(NOISE)
    assert loud(one) > NOISY
    assert "no peak of the gyro's spectrum rises 10 dB above" in said(one)
    assert notches(one, PX4[0]) == [] != notches(heard(FRAME), PX4[0])
