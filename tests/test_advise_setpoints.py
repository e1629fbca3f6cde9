"""Margins from a rate loop's own setpoint, as PX4 and ArduPilot log it, against those of the flown loop; and refusals."""

import math
import re
from functools import cache

import numpy as np
import pytest

from quadstep.identify.changes import WORTH, Advice, changed_parameters, changes, tuned, within_limits
from quadstep.identify.excited import excited
from quadstep.identify.measured import HIDDEN, MeasuredLoop, measured
from quadstep.identify.plant import loop_margins, plant
from quadstep.identify.rate_loops import ARDUPILOT, PX4
from quadstep.identify.response import Crossing
from quadstep.identify.symptoms import noise
from quadstep.io.errors import UserError
from quadstep.io.parameter_files import read_parameters
from quadstep.metrics.statistics import Estimate
from quadstep.report.sheet import sheet
from quadstep.studies.advise import advise, evidence, expected_result, next_steps, sentence
from tests.challenge import setpoints, symptoms
from tests.made_logs import rate_loop, ulog_of
from tests.rate_flights import PERIOD, Axis, Ring, flown, stepped

STEP = 0.004
WEAK, SOUND, DULL = 0, 1, 2


def axes() -> Axis:
    """A fragile rate loop, a sound one, and a fragile one with a slow filter of its gyro, which no smaller gains repair."""
    same = {"effect": 100.0, "lag": 0.02, "delay": 4, "cut": 60.0, "slope": 30.0}
    same |= {"period": PERIOD, "target": math.inf, "error": math.inf, "after": 0}
    fragile, sound = {"p": 0.75, "i": 3.75, "d": 0.003, "attitude": 5.0}, {"p": 0.25, "i": 0.25, "d": 0.002, "attitude": 4.0}
    dull = {"cut": 12.0, "p": 0.13, "i": 0.507, "d": 0.0, "attitude": 3.9}
    return Axis(**{name: np.array([{**same, **one}[name] for one in (fragile, sound, dull)]) for name in Axis._fields})


@cache
def flight(seconds=30.0):
    """Setpoint, rate and command of both, led by snaps of a stick, with a gyro's noise, in gusts."""
    angle = stepped(np.random.default_rng(3), seconds)
    return flown(axes(), angle[:, None] * axes().attitude, noise=5e-4, gust=0.1)


def parameters(place: int) -> dict[str, float]:
    one = axes()
    gains = {"P": one.p, "I": one.i, "D": one.d}
    found = {f"MC_ROLLRATE_{name}": value[place] / 0.5 for name, value in gains.items()}
    cuts = {"IMU_GYRO_CUTOFF": one.cut[place], "IMU_DGYRO_CUTOFF": one.slope[place]}
    return {**found, "MC_ROLLRATE_K": 0.5, "MC_ROLL_P": one.attitude[place], **cuts}


def logged(tmp_path, place: int, change=None, later=0, seconds=30.0, **more):
    """A ULog of one of them. change: of the parameters. later: rows from a setpoint to the command that it is used for."""
    path = tmp_path / "flight.ulg"
    r, y, u = (column[:, place] for column in flight(seconds))
    path.write_bytes(rate_loop(np.roll(r, -later), y, u, STEP, {**parameters(place), **(change or {})}, **more))
    return path


def truth(place: int) -> tuple[float, float]:
    """Crossover [rad/s] and phase margin [rad] of the flown loop."""
    omega = np.geomspace(1.0, 300.0, 20_000)
    loop = axes().opened(omega)[place]
    at = np.flatnonzero(np.diff(np.abs(loop) > 1.0))
    margins = np.abs(np.angle(-loop[at]))
    return float(omega[at[margins.argmin()]]), float(margins.min())


@pytest.mark.parametrize("later", [0, 1])
@pytest.mark.parametrize("place", [WEAK, SOUND])
def test_a_ulog_of_an_ordinary_flight_tells_crossover_and_phase_margin(tmp_path, place, later):
    now = measured(excited(logged(tmp_path, place, later=later), None).measured)
    at, phase = truth(place)
    assert now.phase.at.value == pytest.approx(at, rel=0.05)
    assert now.phase.value.value == pytest.approx(phase, abs=math.radians(3.0))
    assert now.phase.value.low < phase < now.phase.value.high


def test_a_log_of_a_release_before_1_14_tells_the_same(tmp_path):
    old = excited(logged(tmp_path, SOUND, old=True), None)
    assert old.source[2] == "actuator_controls_0.control[0]"
    new = excited(logged(tmp_path, SOUND), None)
    assert measured(old.measured).phase.value == measured(new.measured).phase.value


def test_margins_of_a_log_in_which_gains_changed_are_said_to_be_those_of_no_single_loop(tmp_path):
    """The interval of the phase margin holds neither the first loop's nor the second's."""
    angle = stepped(np.random.default_rng(3), 30.0)
    after = flown(axes().scaled(1.4), angle[:, None] * axes().attitude, noise=5e-4, gust=0.1)
    half = len(angle) // 8  # a row every four samples
    r, y, u = (np.concatenate([a[:half, SOUND], b[half:, SOUND]]) for a, b in zip(flight(), after, strict=True))
    told = [*parameters(SOUND).items(), ("LND_FLIGHT_T_LO", 0.0), ("LND_FLIGHT_T_LO", 9.0), ("MC_ROLLRATE_K", 0.7)]
    path = tmp_path / "flight.ulg"
    path.write_bytes(rate_loop(r, y, u, STEP, told))
    found = advise(path, None, None, tmp_path / "out", False, sheet("svg", None, "screen"))
    low, high = found.record["phase_margin[rad]"]["low"], found.record["phase_margin[rad]"]["high"]
    assert not low < truth(SOUND)[1] < high or found.record["crossover[rad/s]"]["high"] > 1.2 * truth(SOUND)[0]
    assert found.answer.startswith(
        "MC_ROLLRATE_K changed in this log, so these may be the margins of no single loop. The loop"
    )
    assert found.record["changed_in_log"] == ["MC_ROLLRATE_K"]
    assert "changed in this log" not in advise(logged(tmp_path, SOUND), None, None, tmp_path / "o", False, sheet("svg")).answer


def test_a_release_that_cannot_log_fast_is_not_told_to(tmp_path):
    path = logged(tmp_path, SOUND)
    path.write_bytes(path.read_bytes().replace(b"vehicle_angular_velocity", b"vehicle_angular_velocitx"))
    with pytest.raises(
        UserError, match="; SDLOG_PROFILE, with which later releases log it, is not among the log's parameters"
    ):
        excited(path, None)


def test_a_fragile_loop_of_px4_gets_a_file_with_nothing_but_its_k(tmp_path):
    found = advise(logged(tmp_path, WEAK), None, None, tmp_path / "out", False, sheet("svg", None, "screen"))
    written = read_parameters(tmp_path / "out" / "advised.params", "px4").values
    assert dict(written) == pytest.approx({"MC_ROLLRATE_K": 0.5 * found.record["factor"]})
    assert found.commands == [f"Parameters to load: {tmp_path / 'out' / 'advised.params'}"]
    assert "MC_ROLLRATE_K times" in found.more[0]


def test_a_sound_loop_gets_the_gains_that_it_bears_from_the_plant_that_explains_it(tmp_path, monkeypatch):
    found = advise(logged(tmp_path, SOUND, seconds=180.0), None, None, tmp_path / "out", False, sheet("svg", None, "screen"))
    factor = found.record["factor"]
    omega = np.geomspace(0.3, 1000.0, 8_000)
    now, then = (setpoints.least(axes().scaled(by).opened(omega)[SOUND])[2] for by in (1.0, factor))
    assert now > then > 1.0
    assert factor > WORTH
    assert found.record["plant"]["effect[rad/s^2]"] == pytest.approx(100.0, rel=0.02)
    assert found.record["plant"]["lag[s]"] == pytest.approx(0.02, rel=0.1)
    assert found.record["plant"]["delay[s]"] == pytest.approx(0.004, abs=0.002)
    assert f"MC_ROLLRATE_K times {factor:.2f}: by the plant, this gives" in found.more[0]
    assert "Fly it for longer than 180 s and advise again: the noise" in found.more[0]
    flight = excited(logged(tmp_path, SOUND, seconds=180.0), None)
    assert tuned(flight, flight.loop, measured(flight.measured), plant(flight), [{}]).factor == pytest.approx(factor)
    monkeypatch.setattr("quadstep.identify.measured.HIDDEN", 1.15 * plant(flight).hidden.gain)
    less = changes(flight, measured(flight.measured), plant(flight))
    assert WORTH < less.factor < min(1.15, factor)
    monkeypatch.setattr("quadstep.identify.measured.HIDDEN", math.inf)
    more = changes(flight, measured(flight.measured), plant(flight))
    assert more.factor > factor
    assert expected_result(flight, more).endswith("Fly it and advise again.")
    assert "Fly it for longer than 180 s and advise again: the noise" in expected_result(flight, less)
    for other in (
        flight._replace(parameters={**flight.parameters, "MC_ROLLRATE_D": 0.05}),  # then no plant explains what was measured
        flight._replace(measured=flight.measured.only(0, 60)),  # nor are gains raised beyond what was excited
    ):
        assert changes(other, measured(other.measured), plant(other)) is None


@pytest.mark.parametrize("loop", [PX4[0], ARDUPILOT[0]], ids=["px4", "ardupilot"])
def test_a_loop_whose_integrator_is_too_quick_gets_less_of_it_and_flown_as_written_is_sound(loop):
    """No factor on the gains, nor a slower attitude loop, is enough."""
    own = {"effect": 102.0, "lag": 0.028, "delay": 2, "cut": 39.0, "slope": 24.0, "p": 0.338, "i": 3.25, "d": 0.0038}
    own |= {"attitude": 7.3, "period": 0.0025, "target": math.inf, "error": math.inf, "after": float(loop.form == "ardupilot")}
    one = Axis(**{name: np.array([own[name]]) for name in Axis._fields})
    angle = stepped(np.random.default_rng(3), 60.0, period=0.0025)
    signals = [column[:, 0] for column in flown(one, angle[:, None] * one.attitude, 5e-4, 0.1, every=1)]
    told = setpoints.parameters(loop, Axis(*(field[0] for field in one)))
    flight = setpoints.read(loop, 0.0025 * np.arange(len(angle)), signals, told)
    advice = changes(flight, measured(flight.measured), plant(flight))
    new = {name: then for name, (_, then) in changed_parameters(flight, advice).items()}
    assert new[f"{loop.stem}I"] < told[f"{loop.stem}I"]
    sentence = expected_result(flight, advice)
    assert f"{loop.stem}I from {told[f'{loop.stem}I']:.4g} to {new[f'{loop.stem}I']:.4g} and" in sentence
    p, i, d = (new.get("MC_ROLLRATE_K", 1.0) * new.get(f"{loop.stem}{end}", told[f"{loop.stem}{end}"]) for end in "PID")
    after = one._replace(p=one.p * 0 + p, i=one.i * 0 + i, d=one.d * 0 + d, attitude=one.attitude * 0 + new[loop.attitude])
    before, now = (setpoints.least(each.opened(setpoints.OMEGA)[0])[2] for each in (one, after))
    assert before < 0.7
    assert now > 1.0
    assert now == pytest.approx(setpoints.least(setpoints.changed(one, advice, loop).opened(setpoints.OMEGA)[0])[2])


def test_advice_stays_in_the_range_that_an_autopilot_documents(tmp_path):
    """MC_ROLLRATE_K goes from 0.01 to 5; one that flew beyond goes no further out."""
    for k, most in ((4.0, 5.0), (6.0, 6.0)):
        told = {name: value / (2.0 * k) for name, value in parameters(SOUND).items() if name.startswith("MC_ROLLRATE_")}
        change = {**told, "MC_ROLLRATE_K": k}
        path = logged(tmp_path, SOUND, change, seconds=180.0)
        found = advise(path, None, None, tmp_path / "out", True, sheet("svg", None, "screen"))
        new = found.record["changes"].get("MC_ROLLRATE_K", k)
        assert k <= new <= most
        assert ("MC_ROLLRATE_K is then at the end of the range that PX4 v1.15 documents, 0.01 to 5" in found.more[0]) == (
            k == 4.0
        )


def test_gains_do_not_rise_until_a_resonance_beyond_what_was_excited_rings(tmp_path, monkeypatch):
    one = Axis(*(field[[SOUND]] for field in axes().scaled(0.5)))
    ring = Ring(*(np.array([number]) for number in (40.0, 0.02, 0.65, 0.0, 0.0)))  # nothing but the command shakes it
    angle = stepped(np.random.default_rng(3), 30.0)
    r, y, u = (column[:, 0] for column in flown(one, angle[:, None] * one.attitude, noise=5e-4, gust=0.1, ring=ring))
    path = tmp_path / "flight.ulg"
    path.write_bytes(rate_loop(r, y, u, STEP, {**parameters(SOUND), "MC_ROLLRATE_K": 0.25}))
    shares = []
    for most in (HIDDEN, math.inf):
        monkeypatch.setattr("quadstep.identify.measured.HIDDEN", most)
        factor = advise(path, None, None, tmp_path / "out", True, sheet("svg", None, "screen")).record["factor"] or 1.0
        flew, then = (one.scaled(by).opened(setpoints.OMEGA, ring)[0] for by in (1.0, factor))
        shares.append(setpoints.least(then, flew)[2])
    assert shares[0] > 1.0, shares
    assert shares[1] < 0.5, shares


def test_noise_that_shows_less_of_a_resonance_than_there_is_leaves_a_sound_loop():
    """Found by an hour of search: 0.26 that one flight's noise shows as 0.17. The same vehicle flies 24 times."""
    loop, count = ARDUPILOT[0], 24
    own = {"effect": 33.0, "lag": 0.0151, "delay": 2, "cut": 87.8, "slope": 24.3, "p": 0.138, "i": 0.0602, "d": 0.00087}
    own |= {"attitude": 3.48, "period": 0.0025, "target": 13.6, "error": math.inf, "after": 1.0}
    every = Axis(**{name: np.full(count, own[name]) for name in Axis._fields})
    one, ring = Axis(*(field[:1] for field in every)), Ring(*np.array([[49.4], [0.0155], [1.617], [0.0], [0.0]]))
    angle = stepped(np.random.default_rng(3), 90.0, period=0.0025)
    shaken = Ring(*(np.repeat(field, count) for field in ring))
    columns = flown(every, angle[:, None] * every.attitude, 1e-3, 0.3, 7, 1, shaken)
    told = setpoints.parameters(loop, Axis(*(field[0] for field in one)))
    opened, raised = one.opened(setpoints.OMEGA, ring)[0], 0
    for place in range(count):
        flight = setpoints.read(loop, 0.0025 * np.arange(len(angle)), [column[:, place] for column in columns], told)
        if advice := changes(flight, *loop_margins(flight)):
            then = setpoints.changed(one, advice, loop).opened(setpoints.OMEGA, ring)[0]
            assert setpoints.least(then, opened)[2] > 1.0, (place, advice.factor)
            raised += advice.factor > 1.0
    assert raised > count / 3


def ringing(loop, own, ring, seconds, every=1, noise=1e-3, gust=0.1):
    """A flight of one vehicle whose frame resonates, and its open loop."""
    after = {"target": math.inf, "error": math.inf, "after": float(loop.form == "ardupilot")}
    one = Axis(**{name: np.array([{**after, **own}[name]]) for name in Axis._fields})
    shaken = Ring(*(np.array([number]) for number in (*ring, 0.0, 0.0)))
    angle = stepped(np.random.default_rng(3), seconds, period=own["period"])
    signals = [column[:, 0] for column in flown(one, angle[:, None] * one.attitude, noise, gust, 1, every, shaken)]
    told = setpoints.parameters(loop, Axis(*(field[0] for field in one)))
    flight = setpoints.read(loop, every * own["period"] * np.arange(len(signals[0])), signals, told)
    return flight, one, one.opened(setpoints.OMEGA, shaken)[0], shaken


def test_a_loop_is_not_called_sound_where_a_resonance_beyond_what_was_excited_has_taken_its_margin():
    """What was excited of it has the margins of a sound loop; its noise shows a resonance at 43 Hz."""
    own = {"effect": 41.44, "lag": 0.01971, "delay": 4, "cut": 52.2, "slope": 21.77, "p": 0.7956, "i": 4.839, "d": 0.003304}
    own |= {"attitude": 4.707, "period": PERIOD}
    flight, _, opened, _ = ringing(PX4[0], own, (43.32, 0.0155, 1.0), 90.0, 2)
    now, behind = loop_margins(flight)
    assert setpoints.least(opened)[2] < 0.7
    assert now.sound  # by what was excited
    assert now.gain_up.low > 6.0
    assert now.grade == "unknown"
    advice = changes(flight, now, behind)
    found = evidence("flight", "flight.ulg", flight, now, behind, None, advice, {})
    hidden = r"a resonance near 4\d(\.\d)? Hz, whose gain may be up to about 0.\d+ by the noise"
    assert re.search(rf", unless {hidden} \(in simulations, at most 3 dB more\), leaves less", found.answer)
    assert "may leave less: excite beyond that frequency, or fly longer: a longer record hides less" in found.more[0]
    assert (found.record["grade"], found.record["hidden_resonance"]["gain"] > HIDDEN) == ("unknown", True)
    assert "so does this one" not in " ".join(found.sentences)


def test_advice_says_what_a_resonance_may_leave_where_one_has_taken_the_margin():
    own = {"effect": 23.23, "lag": 0.01315, "delay": 1, "cut": 82.5, "slope": 30.77, "p": 0.2035, "i": 1.024, "d": 0.001108}
    own |= {"attitude": 4.12, "period": 0.0025, "target": 47.6}
    loop = ARDUPILOT[0]
    flight, one, opened, ring = ringing(loop, own, (47.85, 0.0223, 4.22), 90.0)
    now, behind = loop_margins(flight)
    advice = changes(flight, now, behind)
    then = setpoints.changed(one, advice, loop).opened(setpoints.OMEGA, ring)[0]
    assert advice.expected.sound  # by its plant, which has no resonance
    assert setpoints.least(then, opened)[2] < 0.8
    assert advice.expected.doubtful
    said = expected_result(flight, advice)
    assert re.search(r"; but a resonance near 4\d(\.\d)? Hz, whose gain may be up to about .*, may leave less: ", said)
    assert now.gain_up.low > 6.0  # by its plant too
    assert re.search(r"; gain margins: upwards .* unless a resonance near 4\d", sentence(flight, now))


def test_what_begins_and_ends_with_a_record_does_not_cover_a_resonance_in_its_noise():
    """Found by search: the edges covered the noise at 139 Hz, and gains rose 4.4 times, to a loop that diverges."""
    own = {"effect": 143.4, "lag": 0.01311, "delay": 2, "cut": 82.07, "slope": 39.19, "p": 0.06188, "i": 0.2038}
    own |= {"d": 0.0003108, "attitude": 6.915, "period": 0.0025, "target": 38.1}
    flight, one, opened, ring = ringing(ARDUPILOT[0], own, (110.48, 0.01902, 28.92), 90.0)
    now, behind = loop_margins(flight)
    assert behind.hidden.gain > 0.25, behind.hidden
    assert behind.hidden.at == pytest.approx(2.0 * math.pi * 139.0, rel=0.03)
    if advice := changes(flight, now, behind):
        then = setpoints.changed(one, advice, ARDUPILOT[0]).opened(setpoints.OMEGA, ring)[0]
        assert setpoints.least(then, opened)[2] > 1.0


def test_no_higher_cut_off_lets_a_resonance_grow_that_noise_shows():
    """Found by search: a higher cut-off took one near 111 Hz from -7 to -3 dB, with gains times 0.72."""
    own = {"effect": 87.45, "lag": 0.01513, "delay": 3, "cut": 73.16, "slope": 23.16, "p": 0.3791, "i": 1.0736}
    own |= {"d": 0.0012933, "attitude": 8.872, "period": 0.0025, "target": 31.48, "error": 31.52}
    flight, one, opened, ring = ringing(ARDUPILOT[0], own, (95.951, 0.02124, 19.71), 90.0, noise=3.8e-3, gust=0.3)
    now, behind = loop_margins(flight)
    assert now.lacking
    assert behind.hidden.at == pytest.approx(2.0 * math.pi * 111.0, rel=0.03)
    if advice := changes(flight, now, behind):
        then = setpoints.changed(one, advice, ARDUPILOT[0]).opened(setpoints.OMEGA, ring)[0]
        assert setpoints.least(then, opened)[2] > setpoints.least(opened)[2]
    higher = Advice(1.0, now, {"ATC_RAT_RLL_FLTE": (31.52, 35.0)})
    assert not within_limits(flight, higher, behind)
    assert within_limits(flight, higher._replace(factor=0.9), behind)  # the loop is then smaller at the resonance


def test_a_loop_whose_crossover_was_not_excited_is_told_by_its_plant_and_never_called_sound(tmp_path):
    flight = excited(logged(tmp_path, SOUND), None)
    at = measured(flight.measured).phase.at.value
    beyond = flight.measured.only(int(np.searchsorted(flight.measured.omega, 1.2 * at)), len(flight.measured.omega) - 1)
    assert measured(beyond).phase is None
    now = measured(plant(flight._replace(measured=beyond)).loop)
    assert now.phase.value.low < truth(SOUND)[1] < now.phase.value.high
    whole = measured(plant(flight).loop)
    assert (whole.sound, whole._replace(by_plant=True).grade) == (True, "unknown")


def test_only_the_stretch_in_the_air_and_of_the_autotune_counts(tmp_path):
    count = len(flight()[0])
    landed = np.zeros((count, 1))
    landed[: count // 4] = 1.0
    one = excited(logged(tmp_path, SOUND, vehicle_land_detected=("float landed", landed)), None)
    assert len(one.command) == pytest.approx(0.75 * count, abs=3)
    tuned = np.zeros((count, 3))
    tuned[count // 2 :: 25, 0] = 0.7
    one = excited(logged(tmp_path, SOUND, autotune_attitude_control_status=("float[3] rate_sp", tuned)), None)
    assert len(one.command) == pytest.approx(0.5 * count, abs=30)


def test_what_a_setpoint_does_not_tell_is_refused_with_the_reason(tmp_path):
    with pytest.raises(
        UserError, match=r"vehicle_torque_setpoint.xyz\[0\]: MC_ROLLRATE_\* of the log explain \d+ % of it from"
    ):
        excited(logged(tmp_path, SOUND, {"MC_ROLLRATE_K": 1.0}), None)
    with pytest.raises(UserError, match="no 10 s of uninterrupted flight in one mode"):
        excited(logged(tmp_path, SOUND, vehicle_land_detected=("float landed", np.ones((len(flight()[0]), 1)))), None)
    bare = tmp_path / "bare.ulg"
    r, y, u = (column[:, SOUND] for column in flight())
    bare.write_bytes(rate_loop(r, y, u, STEP, {}))
    with pytest.raises(UserError, match="MC_ROLL_P is not among the log's parameters"):
        excited(bare, None)
    bare.write_bytes(rate_loop(r[::8], y[::8], u[::8], 8 * STEP, {**parameters(SOUND), "SDLOG_PROFILE": 131}))
    said = r"logged every 32 ms; margins need 20 ms or less: set bit 4 of SDLOG_PROFILE .high rate, 147 instead of 131."
    with pytest.raises(UserError, match=said):
        excited(bare, None)
    time = STEP * np.arange(len(r))
    with pytest.raises(UserError, match="flight in one mode; 5 gaps of 20 ms or more: log less, or to a"):
        setpoints.read(PX4[0], time + 0.1 * (time // 5.0), (r, y, u), parameters(SOUND))
    bare.write_bytes(rate_loop(r[:40:5], y[:40:5], u[:40:5], 5 * STEP, parameters(SOUND)))  # 20 ms, but for rounding
    with pytest.raises(UserError, match="no 10 s of uninterrupted flight in one mode"):
        excited(bare, None)


def test_an_integral_that_drifts_through_a_log_is_no_other_controllers():
    """A setpoint that drifts makes a parabola of the command, as slow as the log is long."""
    r, y, u = (column[:, SOUND] for column in flight())
    time, one = STEP * np.arange(len(r)), axes()
    drift = 0.5 * np.linspace(-1.0, 1.0, len(r))
    follows = u + one.p[SOUND] * drift + one.i[SOUND] * STEP * np.cumsum(drift)
    found = setpoints.read(PX4[0], time, (r + drift, y, follows), parameters(SOUND))
    assert measured(found.measured).phase.value.value == pytest.approx(truth(SOUND)[1], abs=math.radians(3.0))


def test_a_setpoint_that_is_logged_too_slowly_is_blamed_for_it_and_not_the_sticks(tmp_path):
    path = tmp_path / "slow.ulg"
    r, y, u = (column[::5, SOUND] for column in flight())
    path.write_bytes(rate_loop(r, y, u, 5 * STEP, {**parameters(SOUND), "SDLOG_PROFILE": 1}))
    said = r"torque_setpoint.xyz\[0\]: .* vehicle_rates_setpoint.roll is logged every 20 ms, .* by \d\d degrees: set bit 4 of"
    with pytest.raises(UserError, match=said):
        advise(path, None, None, tmp_path / "out", False, sheet("svg"))


@pytest.mark.parametrize(("pitch", "said"), [(WEAK, "In the same log roll has"), (SOUND, "In the same log pitch has")])
def test_of_several_axes_that_a_log_tells_one_that_lacks_margin_is_advised(tmp_path, pitch, said):
    """Roll is told over a wider range, and lacks none."""
    angle = stepped(np.random.default_rng(3), 90.0)[:, None] * [0.1, 1.0, 1.0]  # the weak loop is excited less
    columns = flown(axes(), angle * axes().attitude, noise=np.array([1e-2, 1e-4, 1e-4]), gust=np.array([0.1, 0.01, 0.01]))
    r, y, u = (np.stack([column[:, SOUND], column[:, pitch], 0.0 * column[:, SOUND]], axis=1) for column in columns)
    told = {**parameters(SOUND), **{name.replace("ROLL", "PITCH"): one for name, one in parameters(pitch).items()}}
    topics = {"vehicle_rates_setpoint": ("float roll;float pitch;float yaw", r)}
    topics |= {"vehicle_angular_velocity": ("float[3] xyz", y), "vehicle_torque_setpoint": ("float[3] xyz", u)}
    path = tmp_path / "flight.ulg"
    path.write_bytes(ulog_of(topics, STEP * np.arange(len(r)), told))
    found = advise(path, None, None, tmp_path / "out", False, sheet("svg"))
    weak = pitch == WEAK
    assert f" The loop of {'pitch' if weak else 'roll'} has" in found.answer
    assert {*found.record["changes"]} == {"MC_PITCHRATE_K" if weak else "MC_ROLLRATE_K"}
    assert found.more[1].startswith(said)


def test_margins_of_motions_that_took_motors_to_a_limit_are_said_to_be_those_and_no_more(tmp_path):
    """Of a fragile loop, whose motors follow four tenths of the command, the interval misses the phase margin."""
    angle = stepped(np.random.default_rng(3), 40.0)
    r, y, u = (column[:, WEAK] for column in flown(axes(), angle[:, None] * axes().attitude, 5e-4, 0.1, limit=0.4))
    path, told = tmp_path / "flight.ulg", parameters(WEAK)
    control = np.full((len(u), 12), np.nan)
    control[:, :4] = np.clip(0.5 + np.outer(u, [1.0, -1.0, 1.0, -1.0]) / 0.8, 0.0, 1.0)
    path.write_bytes(rate_loop(r, y, u, STEP, told, actuator_motors=("float[12] control", control)))
    found = advise(path, None, None, tmp_path / "out", False, sheet("svg"))
    assert found.record["phase_margin[rad]"]["low"] > 1.4 * truth(WEAK)[1]
    assert found.answer.startswith("Motors were at a limit for more than 1 % of the time: small motions may have less")
    phase, up, down = (Crossing(Estimate(9.0, 8.0, 10.0), Estimate(one, one, one)) for one in (1.0, 4.0, 0.25))
    calm = MeasuredLoop(phase, up, down, (), 1.0, 90.0)
    assert (calm.grade, calm._replace(limited=True).grade) == ("sound", "unknown")
    said = next_steps(excited(path, None), calm._replace(limited=True), None)[0]
    assert said.endswith("but in motions that drove motors to a limit: fly more gently. No change is advised.")


def test_a_hover_in_gusts_is_no_excitation(tmp_path):
    still = flown(axes(), np.zeros((20_000, 3)), noise=0.01, gust=2.0)
    path = tmp_path / "hover.ulg"
    path.write_bytes(rate_loop(*(column[:, SOUND] for column in still), STEP, parameters(SOUND)))
    with pytest.raises(UserError, match=r"excite the commands too little: no axis's explains 60 % .* snap the sticks often"):
        excited(path, None)


def every(change):
    """Parameters of all axes, alike."""
    return {
        name.replace("ROLL", axis): value
        for axis in ("ROLL", "PITCH", "YAW")
        for name, value in {**parameters(DULL), **change}.items()
    }


def test_a_slow_filter_that_no_gain_makes_up_for_is_raised_where_all_its_axes_are_told(tmp_path, monkeypatch):
    found = advise(
        logged(tmp_path, DULL, every({}), alike=1.0), None, None, tmp_path / "held", False, sheet("svg", None, "screen")
    )
    assert "IMU_GYRO_CUTOFF" not in found.record["changes"]  # half a minute of noise may hide what it would let grow
    monkeypatch.setattr("quadstep.identify.measured.HIDDEN", math.inf)
    found = advise(
        logged(tmp_path, DULL, every({}), alike=1.0), None, None, tmp_path / "out", False, sheet("svg", None, "screen")
    )
    written = dict(read_parameters(tmp_path / "out" / "advised.params", "px4").values)
    cut = written.pop("IMU_GYRO_CUTOFF")
    assert (written, 12.0 < cut <= 48.0) == ({}, True)
    omega = np.geomspace(0.3, 1000.0, 8_000)
    before, after = (setpoints.least(one.opened(omega)[DULL]) for one in (axes(), axes()._replace(cut=np.full(3, cut))))
    assert before[2] < 0.9
    assert after[2] > 1.0
    assert f"IMU_GYRO_CUTOFF from 12 to {cut:.4g} Hz: by the measured response, this gives" in found.more[0]
    (lag,) = [row for row in table(found, "Low-passes") if row[0] == "IMU_GYRO_CUTOFF"]
    crossover = before[0] / (2.0 * math.pi * 12.0)
    alone = math.degrees(math.atan2(math.sqrt(2.0) * crossover, 1.0 - crossover**2))
    assert 0.5 * alone < float(lag[2]) < alone  # angles, of the loop around, do not pass it
    found = advise(logged(tmp_path, DULL), None, None, tmp_path / "roll", False, sheet("svg", None, "screen"))
    written = dict(read_parameters(tmp_path / "roll" / "advised.params", "px4").values)
    assert "MC_ROLL_P" in written  # pitch and yaw pass the same filter, and this log does not tell them
    assert f"MC_ROLL_P from 3.9 to {written['MC_ROLL_P']:.4g} 1/s" in found.more[0]
    slower = axes()._replace(attitude=np.full(3, written["MC_ROLL_P"])).scaled(written.get("MC_ROLLRATE_K", 0.5) / 0.5)
    assert setpoints.least(slower.opened(omega)[DULL])[2] > 1.0


def table(found, name):
    return next(one.rows for one in found.sections if one.title == name)


def test_what_the_motors_did_a_tone_and_descents_are_told_with_their_thresholds(tmp_path):
    r, y, u = (column[:, SOUND] for column in flight())
    time = STEP * np.arange(len(u))
    sinks = np.where(np.sin(0.4 * math.pi * time) > 0.0, 2.0, 0.0)
    stirred = u + 0.02 * np.where(sinks > 1.0, 1.0, 0.1) * np.random.default_rng(1).normal(size=len(u))
    control = np.full((len(u), 12), np.nan)
    control[:, :4] = np.clip(0.8 + 2.0 * np.outer(stirred, [1.0, -1.0, 1.0, -1.0]), 0.0, 1.0)
    tone = 2e-3 * np.sin(2.0 * math.pi * 80.0 * time)
    told = {**parameters(SOUND), "IMU_GYRO_NF0_FRQ": 82.0, "IMU_GYRO_NF0_BW": 10.0}
    more = {"actuator_motors": ("float[12] control", control), "vehicle_local_position": ("float vz", sinks[:, None])}
    path = tmp_path / "flight.ulg"
    path.write_bytes(rate_loop(r, y + tone, stirred, STEP, told, **more))
    found = advise(path, None, None, tmp_path / "out", False, sheet("svg", None, "screen"))
    share = 100.0 * np.mean(control[:, :4].max(axis=1) >= 0.999)
    text = " ".join(found.more)
    told = re.search("A motor was at its upper limit for (.*) % of the time; what drove it there: roll", text)
    assert float(told[1]) == pytest.approx(share, rel=0.05)
    assert "a peak at 80 Hz, " in text
    assert "dB above its surroundings" in text
    assert "an alias of it, such as 170 Hz, since" in text
    assert "IMU_GYRO_NF0 covers 80 Hz" in text
    assert "In descents of more than 1 m/s" in text
    assert "propeller wash, or gusts" in text
    names = [row[0] for row in table(found, "Symptoms")]
    assert names == [
        "motors at the upper limit",
        "motors at the lower limit",
        "noise",
        "peak of the gyro",
        "oscillation in descents",
    ]
    calm = advise(logged(tmp_path, SOUND), None, None, tmp_path / "calm", False, sheet("svg", None, "screen"))
    assert [row[0] for row in table(calm, "Symptoms")] == ["noise", "peak of the gyro"]  # no motors, no height in that log
    assert "stands" not in " ".join(calm.more)


@pytest.mark.parametrize("seed", range(3))
def test_the_axis_that_took_the_motors_to_a_limit_is_named(seed):
    assert symptoms.mixed(np.random.default_rng(seed)).reached <= 1.0


def test_noise_is_that_of_gyro_d_part_and_command():
    hover = excited_by_noise(5e-3)
    (one,) = noise(hover)
    gyro, d, command = (float(part) for part in re.findall(r"([\d.e+-]+) (?:rad/s|%)", one.measured))
    above = 1.0 - symptoms.HIGHEST * symptoms.PERIOD / math.pi * 1.05
    assert gyro == pytest.approx(5e-3 * math.sqrt(above), rel=0.05)
    omega = np.linspace(1.05 * symptoms.HIGHEST, math.pi / symptoms.PERIOD, 4000)
    by = 0.01 * omega / np.abs(1.0 + 1j * omega / (2.0 * math.pi * 30.0))
    assert d == pytest.approx(100.0 * 5e-3 * math.sqrt(above * np.mean(by**2)), rel=0.05)
    assert command == pytest.approx(100.0 * 0.1 * math.sqrt(above), rel=0.05)
    assert one.shows


def excited_by_noise(size):
    random = np.random.default_rng(1)
    told = {"MC_ROLLRATE_P": 0.1, "MC_ROLLRATE_I": 0.1, "MC_ROLLRATE_D": 0.01}
    one = symptoms.flight(0.1 * random.normal(size=20_000), size * random.normal(size=20_000))
    return one._replace(parameters=told)
