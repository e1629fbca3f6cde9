"""Margins measured in flight against those of the flown loop, the advice that follows, and logs that carry none."""

import math
import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from quadstep.engines.fly import fly_all
from quadstep.identify.changes import advised, changes
from quadstep.identify.excited import EXCITATION, Excited, excited
from quadstep.identify.logs.read import read_topics
from quadstep.identify.measured import MeasuredLoop, measured
from quadstep.identify.plant import plant
from quadstep.identify.rate_loops import ARDUPILOT
from quadstep.identify.response import Crossing, Response, crossovers, margin, response
from quadstep.io.errors import UserError
from quadstep.linear.analysis import analyse_rest
from quadstep.metrics.statistics import Estimate
from quadstep.mission.read import check_mission
from quadstep.report.sheet import sheet
from quadstep.studies.advise import advise, loops, next_steps, sentence
from tests.challenge import advice
from tests.injected import injected, signals
from tests.made_logs import excited as in_ardupilots_log
from tests.random_sheets import HOVER

GAINS = {"ATC_RAT_RLL_P": 0.2, "ATC_RAT_RLL_I": 0.3, "ATC_RAT_RLL_D": 0.01}
WEAK, SOUND = 3.0, 1.0


def hover(factor: float, noise: float = 0.0, outer: float = 1.0):
    """An x500 at rest whose rate loop has so many times gentle gains, and its position loop too."""
    rate = 15.0 * factor
    gains = {"rate": [rate, rate, 5.0], "rate_derivative": [0.0] * 3, "rate_integral": [0.5 * rate] * 2 + [1.0]}
    gains |= {"attitude": [5.0, 5.0, 2.0], "position": outer, "velocity": 4.0 * outer, "velocity_integral": 0.1}
    path = {**HOVER, "duration": 42.0}
    content = {"vehicle": {"preset": "x500"}, "path": path, "controller": {"type": "pid", **gains}}
    content["sensors"] = {"imu_period": 0.002, "imu_latency": 0.006, "gyro_noise": noise}
    content["simulation"] = {"duration": 42.0, "log_period": 0.002}
    return check_mission(content, "hover.toml", Path())


@cache
def flown(factor: float, noise: float = 0.0, outer: float = 1.0):
    """Excitation, command [N m] and period [s] of a flight with a chirp on roll."""
    plan = injected(hover(factor, noise, outer), strength=1.0)
    return signals(plan, *fly_all([plan]))


@cache
def true(factor: float):
    """The margins of roll, of the flown loop."""
    return analyse_rest(hover(factor)).analysis.margins[1]


@pytest.mark.parametrize("factor", [SOUND, WEAK])
def test_margins_measured_in_flight_are_those_of_the_loop(factor):
    found, model = measured(response(*flown(factor))), true(factor)
    assert found.phase.at.value == pytest.approx(model.phase_at, rel=0.01)
    assert found.phase.value.value == pytest.approx(model.phase, abs=math.radians(0.5))
    assert found.gain_up.value == pytest.approx(model.up, abs=0.1)
    assert found.gain_down.value == pytest.approx(model.down, abs=0.1)


def test_noise_widens_the_interval_which_holds():
    still, loud = (margin(crossovers(response(*flown(SOUND, noise)))) for noise in (0.0, 3e-3))
    assert loud.value.high - loud.value.low > 2.0 * (still.value.high - still.value.low)
    assert loud.value.low < true(SOUND).phase < loud.value.high


def test_a_weak_loop_gets_a_factor_with_which_it_is_sound_and_a_sound_one_none():
    weak, sound = (response(*flown(factor)) for factor in (WEAK, SOUND))
    assert not measured(sound).lacking
    advice = advised(weak)
    after = true(WEAK * advice.factor)
    assert true(WEAK).phase < math.radians(30.0) <= after.phase
    assert after.up > 6.0
    assert after.down > 6.0
    assert advice.expected.phase.value.value == pytest.approx(after.phase, abs=math.radians(0.5))
    assert not measured(weak.scaled(1.05 * advice.factor)).sound  # no smaller than needed


def test_a_loop_is_not_sound_where_what_decides_was_not_excited(tmp_path):
    d, u, period = flown(SOUND)
    whole = response(d, u, period)
    assert measured(whole).grade == "sound"
    up, down = (one.at.value for one in (measured(whole).up, measured(whole).down))
    for keep, said in (
        (whole.omega < 0.8 * up, "upwards unknown above .* excite faster: its phase crosses -180° outside"),
        (whole.omega > 1.3 * down, "downwards unknown below .* excite slower: its phase crosses -180° outside"),
    ):
        part = Response(*(one[keep] for one in whole[:5]))
        assert measured(part).grade == "unknown"
        flight = Excited("roll", ("SIDD.Targ", "RATE.ROut"), part, d, u, period, {})
        text = " ".join([sentence(flight, measured(part)), *next_steps(flight, measured(part), None)])
        assert re.search(said, text), text
        assert "No change is advised" in text


def test_a_weak_loop_whose_gain_may_not_fall_gets_no_factor():
    slow = response(*flown(WEAK, outer=0.25))
    now = measured(slow)
    assert (now.grade, now.down, advised(slow)) == ("fragile", None, None)


def test_no_factor_passes_gains_with_which_the_loop_is_unstable():
    needy = advice.Loop(14.37, 3.904, 5.341, 0.02043, 0.002552, (8.05, 0.1192, 3.223))
    assert (needy.stable(1.0), needy.stable(0.85), needy.stable(0.32)) == (True, False, False)
    found = advice.flown(needy, 4.45, 76.2, 0.01, np.random.default_rng(1)).measured
    assert measured(found.scaled(0.32)).sound  # by its margins alone
    assert (measured(found).grade, advised(found)) == ("fragile", None)


def test_a_log_becomes_advice_and_the_file_to_load(tmp_path):
    log = tmp_path / "chirp.BIN"
    log.write_bytes(in_ardupilots_log(*flown(WEAK), GAINS))
    crossover = measured(excited(log, None).measured).phase.at.value
    assert crossover == pytest.approx(measured(response(*flown(WEAK))).phase.at.value, rel=0.005)  # logged a loop early
    for rate in (0.0, math.nan):  # nonsense in a log is no loop rate
        assert ARDUPILOT[0].late({"SCHED_LOOP_RATE": rate}) == ARDUPILOT[0].late({}) == 0.0025
    found = advise(log, None, None, tmp_path / "out", False, sheet("svg", None, "screen"))
    factor = found.record["factor"]
    text = (tmp_path / "out" / "advised.parm").read_text()
    written = dict(line.split() for line in text.splitlines())
    assert {name: float(value) for name, value in written.items()} == pytest.approx({n: factor * v for n, v in GAINS.items()})
    told = ", ".join(f"{name} to {factor * GAINS[name]:.4g}" for name in GAINS).replace(
        ", ATC_RAT_RLL_D", " and ATC_RAT_RLL_D"
    )
    assert found.answer.startswith(f"The loop of roll is fragile: set {told}. The loop of roll has a phase margin of ")
    assert "ATC_RAT_RLL_P, ATC_RAT_RLL_I, ATC_RAT_RLL_D times" in found.more[0]
    flight = excited(log, None)
    now = measured(flight.measured)
    shown = loops(flight, now, None, changes(flight, now, plant(flight)))
    assert [one.name for one in shown.channels] == ["measured", "with the advised changes"]
    np.testing.assert_allclose(shown.loop[:, 1], factor * shown.loop[:, 0], rtol=1e-9)
    assert "with the advised changes (dashed) it crosses at" in found.figures[0].caption
    picture = (tmp_path / "out" / "figures" / "bode.svg").read_text()
    assert picture.count('style="fill: #bfbfbf') == 3  # the interval in both plots, and in the legend
    marked = [*(one[1] for one in shown.phases), *(abs(gain) for _, gain in shown.gains)]
    assert sorted(re.findall(r">([\d.]+)(?:°| dB)</text>", picture)) == sorted(f"{one:.1f}" for one in marked)
    assert [fact.what for fact in found.facts[2:]] == ["gain margin up", "gain margin down", "phase margin as advised"]
    assert np.all((shown.unsure > 0.0) & (shown.unsure < 0.5))
    assert "safe" not in (tmp_path / "out" / "report.html").read_text().partition("<body")[2].lower().replace("unsafe", "")
    before = in_ardupilots_log(*flown(WEAK), {**GAINS, "ATC_RAT_PIT_P": 0.1})
    later = in_ardupilots_log(*flown(WEAK), {**GAINS, "ATC_RAT_RLL_P": 0.1, "ATC_RAT_PIT_P": 0.2})
    log.write_bytes(before + later)  # messages of both; those of the second are no later, but its parameters are
    assert read_topics(log, [EXCITATION]).changed == ("ATC_RAT_RLL_P", "ATC_RAT_PIT_P")
    forward = in_ardupilots_log(*flown(WEAK), {**GAINS, "ATC_RAT_RLL_FF": 0.1})
    log.write_bytes(forward)
    found = advise(log, None, None, tmp_path / "other", False, sheet("svg", None, "screen"))
    assert "no factor on them is advised" in found.more[0]
    assert found.answer.startswith("The loop of roll is fragile: no change is advised.")
    assert not (tmp_path / "other" / "advised.parm").exists()


def test_a_log_that_carries_no_advice_is_refused_with_the_reason(tmp_path):
    d, u, period = flown(SOUND)
    random = np.random.default_rng(0)
    cases = {
        "without an excitation": (0.0 * d, u, "never changes"),
        "drowned": (d, u + random.normal(0.0, 30.0 * u.std(), len(u)), "coherence"),
        "clipped": (d, np.clip(u, -0.3 * np.abs(u).max(), 0.3 * np.abs(u).max()), "saturated"),
        "elsewhere": (d, 3.0 * u, "added somewhere else"),
        "short": (d[:2000], u[:2000], "less than 10 s"),
    }
    for name, (excitation, command, said) in cases.items():
        log = tmp_path / f"{name}.bin"
        log.write_bytes(in_ardupilots_log(excitation, command, period, {}))
        with pytest.raises(UserError, match=said):
            excited(log, None)
    (tmp_path / "noise.bin").write_bytes(random.bytes(20_000))
    with pytest.raises(UserError, match="cannot be read as an ArduPilot log: damaged, or another kind of"):
        excited(tmp_path / "noise.bin", None)
    content = in_ardupilots_log(d, u, period, {"LOG_BITMASK": 176126})
    (tmp_path / "unlogged.bin").write_bytes(content.replace(b"RATE\0", b"CTUN\0").replace(b"SIDD", b"CTRL"))
    with pytest.raises(UserError, match=r"rate loop, such as .*: set bit 0 of LOG_BITMASK .fast attitude, 176127 instead of"):
        excited(tmp_path / "unlogged.bin", None)
    with pytest.raises(UserError, match="--columns"):
        excited(tmp_path / "a.mcap", None)
    with pytest.raises(UserError, match=r"a\.csv: file not found"):
        excited(tmp_path / "a.csv", None)
    (tmp_path / "a.csv").write_text("t,x\n0,1\n")
    with pytest.raises(UserError, match=r"a\.csv: should be the vehicle's own log, not a table made from it: \.bin, "):
        excited(tmp_path / "a.csv", None)


def test_a_loop_that_flew_has_no_gain_margin_below_0_db():
    turn = Crossing(Estimate(100.0, 90.0, 110.0), Estimate(12.0, 0.4, 900.0))
    now = MeasuredLoop(None, turn, None, (), 1.0, 200.0)
    assert now.gain_up.low == 0.0
    assert now.gain_up.value == pytest.approx(20.0 * math.log10(12.0))
    assert not now.lacking


def test_crossings_of_a_known_loop():
    omega = np.geomspace(0.1, 100.0, 400)
    opened = 10.0 * np.exp(-0.05j * omega) / (1j * omega)
    found = Response(omega, 1.0 / (1.0 + opened), 1e-9 * omega, 100.0 + 0.0 * omega, 1.0 + 0.0 * omega)
    (one,) = crossovers(found)
    assert one.at.value == pytest.approx(10.0, rel=1e-4)
    assert one.value.value == pytest.approx(0.5 * math.pi - 0.5, abs=1e-4)
    assert measured(found).up.value.value == pytest.approx(math.pi, rel=1e-3)  # at pi / (2 delay), where |L| is 1 / pi
