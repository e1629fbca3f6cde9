"""The grade of a loop: its least margins against the limits that a mission asks for."""

import math
import re
from html import unescape

import numpy as np
import pytest

from quadstep import Mission
from quadstep.engines.fly import fly
from quadstep.linear import grade as grade_module
from quadstep.linear import worst
from quadstep.linear.analysis import analyse_rest, limits
from quadstep.linear.equilibrium import KICK, hovering
from quadstep.linear.grade import FRAGILE, NO_REST, SOUND, UNKNOWN, UNSTABLE, Grade, grade, graded, quick_grade, whole_grade
from quadstep.linear.margins import MarginLimits
from quadstep.linear.run import REMEDY, THERE, flown_from_rest, for_latency, record, with_limit
from quadstep.linear.tables import sentences
from quadstep.linear.wind_limit import cannot_hover
from quadstep.metrics.registry import UNGRADED
from quadstep.mission.read import read_mission
from quadstep.page.folder import open_result, results
from tests.commands import quadstep, strict_json, write
from tests.made_flights import true_vehicle
from tests.missions import EXAMPLES
from tests.pages import data_of
from tests.quick_gains import QUICK

pytestmark = pytest.mark.usefixtures("undrawn")

HOLD = {"type": "step", "start": [0.0, 0.0, 2.0], "end": [0.0, 0.0, 2.0], "duration": 5.0}


def hover(controller="lqr", preset="research-2.6kg", **more):
    law = {"type": controller} if isinstance(controller, str) else controller
    return Mission(vehicle={"preset": preset}, path=HOLD, controller=law, **more)


@pytest.fixture(scope="module")
def analysis():
    return analyse_rest(hover({"type": "lqr", **QUICK["lqr"]})).analysis


def test_the_limits_are_the_textbooks_and_twice_the_latency():
    assert limits(hover()) == MarginLimits(6.0, math.radians(30.0), 0.0)
    assert limits(hover(sensors={"latency": 0.02})).delay == pytest.approx(0.04)
    late = Mission(vehicle={"preset": "x500", "command": {"speed": 1000.0, "delay": 0.01}}, path=HOLD)
    assert limits(late).delay == pytest.approx(0.02)
    assert limits(hover(margins={"gain": 3.0, "phase": 0.7, "delay": 0.05})) == (3.0, 0.7, 0.05)
    assert limits(Mission(path=HOLD)).delay == 0.0


def test_gains_that_are_defaults_for_the_latency_are_said_to_be():
    late = {"sensors": {"latency": 0.02}}
    (said,) = for_latency(hover(**late))
    assert (
        said
        == "Gains that the mission leaves out are defaults chosen for its latency; with another latency they would differ."
    )
    assert not for_latency(hover())
    assert not for_latency(hover({"type": "lqr", **QUICK["lqr"]}, **late))


def test_a_whole_grade_is_computed_once_for_the_same_numbers(monkeypatch, tmp_path):
    monkeypatch.setenv("QUADSTEP_CACHE", str(tmp_path))
    found = [whole_grade(hover({"type": "lqr", **QUICK["lqr"]}))]
    assert found[0] == grade(hover({"type": "lqr", **QUICK["lqr"]}))
    assert found[0].measures
    monkeypatch.setattr(grade_module, "grade", lambda _: Grade("anew", ""))
    assert whole_grade(hover({"type": "lqr", **QUICK["lqr"]})) == found[0]
    assert whole_grade(hover("lqr")).word == "anew"  # other gains


def test_a_flight_says_that_its_law_finds_no_rest(recwarn):
    pytest.importorskip("foundation_policy")
    found = quick_grade(hover("raptor", "hummingbird", simulation={"control_period": 0.01, "guidance_period": 0.01}))
    assert found["grade"] == NO_REST
    assert " tries " in found["why"] and " still changed by " in found["why"]
    assert not recwarn.list


def test_each_margin_is_held_against_its_limit(analysis):
    gain, phase, delay = (one.value for one in graded(analysis).measures)
    least = 20.0 * math.log10(min(min(one.gain_up, 1.0 / max(one.gain_down, 1e-9)) for one in analysis.margins))
    assert gain == pytest.approx(least)
    smallest = min(one.phase for one in analysis.margins), min(one.delay for one in analysis.margins)
    assert (phase, delay) == pytest.approx(smallest)  # of equal channels the first is named, whose last bits may differ
    assert graded(analysis._replace(limits=MarginLimits(gain, phase, delay))).word == SOUND
    for limit, what in (
        (MarginLimits(1.001 * gain, phase, delay), "gain"),
        (MarginLimits(gain, 1.001 * phase, delay), "phase"),
        (MarginLimits(gain, phase, 1.001 * delay), "delay"),
    ):
        found = graded(analysis._replace(limits=limit))
        assert found.word == FRAGILE
        assert re.match(rf"{what} margin [\d.]+( dB|°| ms) in .* \(less than ", found.why)
        assert [one.what for one in found.measures if not one.met] == [what]


@pytest.mark.parametrize(("delay", "written"), [(2.5746, "2.6 s"), (0.9, "900.0 ms"), (math.inf, "none")])
def test_a_long_delay_is_in_seconds(analysis, delay, written):
    late = analysis._replace(margins=[one._replace(delay=delay) for one in analysis.margins])
    assert graded(late).measures[-1].words == written


def test_the_first_sentence_gives_the_least_margins_with_their_channels(analysis):
    gain, phase, delay = graded(analysis).measures
    fragile = f"the loop is fragile: phase margin {math.degrees(phase.value):.1f}° in {phase.channel} (less than 30.0°)"
    assert worst.finding(analysis) == f"Hovering at the start of its path, {fragile}."
    assert worst.finding(analysis, "its flight was lost") == (
        f"Hovering at the start of its path, {fragile}. However, its flight was lost."
    )
    sound = "Hovering at the start of its path, the loop is sound"
    asked = analysis._replace(limits=MarginLimits(0.9 * gain.value, 0.5 * phase.value, 0.0))
    assert worst.finding(asked) == f"{sound}: smallest gain margin {gain.value:.1f} dB ({gain.channel})."
    assert worst.finding(asked, "its flight was lost") == f"{sound}. However, its flight was lost."
    assert worst.finding(analysis._replace(limits=MarginLimits(0.0, 0.0, 0.0))) == (
        f"{sound}: smallest gain margin {gain.value:.1f} dB ({gain.channel}), phase margin "
        f"{math.degrees(phase.value):.1f}° ({phase.channel}), delay margin {1e3 * delay.value:.1f} ms ({delay.channel})."
    )
    with_limits = [with_limit(one, analysis).more for one in worst.facts([("", analysis)])]
    assert [one.partition("; a sound loop has at least ")[2] for one in with_limits] == ["6.0 dB", "30.0°", "", ""]
    warned = [with_limit(one, analysis).kind for one in worst.facts([("", analysis)])]
    assert warned == ["", "fair", "", ""]
    kinked = analysis._replace(tried="all different", kinked=True)
    peak, both = (worst.by_channel(one)[1][5][1:] for one in (analysis, kinked))
    assert all(0.0 <= float(cut) - float(exact) < 0.1 for exact, cut in zip(peak, both, strict=True))
    assert [kinked.written(one) for one in (math.inf, 6.49, -8.99, 49.9, 0.66)] == ["none", "6.4", "-8.9", "49", "0.6"]
    assert [kinked.written(one, 2, up=True) for one in (1.28, 1.3, 2.01, 12.34)] == ["1.3", "1.3", "2.1", "13"]
    disk = next(one for one in worst.facts([("", kinked)]) if one.what == worst.DISK)
    angle = kinked.written(math.degrees(2.0 * math.atan(0.5 * float(disk.value))))
    assert f"a phase of {angle}°" in with_limit(disk, kinked).more  # of the number shown, not of the one that was cut
    content = record(analysis, [])
    assert (content["grade"], content["stable"]) == (FRAGILE, True)
    assert content["limits"] == {"gain[dB]": 6.0, "phase[rad]": math.radians(30.0), "delay[s]": 0.0}


def test_a_loop_that_grows_is_unstable_and_names_what_grows():
    found = grade(hover({"type": "geometric", "k_Omega": 2000.0}))
    assert found.word == UNSTABLE
    analysis = analyse_rest(hover({"type": "geometric", "k_Omega": 2000.0})).analysis
    growth = max(abs(np.linalg.eigvals(analysis.loop.map)))
    doubling = math.log(2.0) / math.log(growth) * analysis.loop.period.length
    said = re.fullmatch(
        r"a deviation doubles every (\d+\.\d+) ms \(body rate about z\); other modes grow more slowly", found.why
    )
    assert 1e-3 * float(said[1]) == pytest.approx(doubling, rel=5e-3)


def test_every_axis_that_grows_alike_is_named_and_that_others_grow_more_slowly_is_said():
    fails = read_mission(EXAMPLES / "theorem_fails.toml")
    assert re.fullmatch(r"a deviation doubles every \d.\d+ s \(pitch and roll\)", grade(fails).why)
    for gains in ({"k_v": 0.01}, {"k_v": [0.01, 0.02, 3.77]}, {"k_i": 70.0}, {"k_Omega": 2000.0}):
        found = analyse_rest(hover({"type": "geometric", **gains})).analysis
        assert not found.stable
        fastest = max(pole.real for pole in found.growing)
        slower = any(pole.real < (1.0 - 1e-3) * fastest for pole in found.growing)
        assert slower == graded(found).why.endswith("; other modes grow more slowly")


def test_a_loop_without_rest_or_slopes_is_said_to_be_so():
    heavy = Mission(vehicle={"preset": "crazyflie", "mass": 0.2}, path=HOLD)
    assert grade(heavy).word == NO_REST
    storm = grade(hover("geometric", wind={"mean": [0.0, 40.0, 0.0]}))
    assert storm.word == NO_REST
    assert not cannot_hover(hovering(Mission(path=HOLD)))  # the paper's plant, in no wind
    assert storm.why.startswith("it cannot hover in this wind of 40 m/s: ")
    assert grade(hover("mppi")).word == UNKNOWN


def test_a_loop_that_changes_with_time_has_the_worst_grade_of_its_flight():
    """Nets that learn too fast from 1 s on, which a sound loop without them does not show at its start."""
    fast = {"F1": 400.0, "F2": 4000.0}
    late, after = (Mission(path=HOLD, controller={"type": "backstepping", "nets": fast | {"start": t}}) for t in (1.0, 9.0))
    assert grade(after).word == SOUND  # they begin when the flight is over
    found = analyse_rest(late).analysis
    assert graded(found).word == UNSTABLE
    assert len(found.later) == 1
    assert 1.0 < found.later[0] < 2.0
    assert (
        f"The loop changes with time: this is the worst of the loops at the start and at t = {found.later[0]:.3g} s"
        in sentences(found)[0]
    )
    assert record(found, [])["changes_until[s]"] == list(found.later)
    assert quick_grade(late) == {"grade": UNSTABLE, "why": graded(found).why}


TIRED = """
from typing import NamedTuple
from own_airframe_controller import ProportionalDerivative
from quadstep.own import Number, where

class Memory(NamedTuple):
    seconds: Number

class Tired(ProportionalDerivative):
    def start(self, measured, gains):
        return Memory(0.0)

    def law(self, memory, measured, reference, gains, t, period):
        felt = where(memory.seconds < 1.0, 1.0, -0.2) * measured.velocity
        command, _ = super().law((), measured._replace(velocity=felt), reference, gains, t, period)
        return command, Memory(memory.seconds + period)
"""


@pytest.mark.parametrize(
    "grows",
    ["memory.seconds + period", "memory.seconds + 0.003", "1.005 * memory.seconds + 0.0002", "0.997 * memory.seconds + 0.005"],
)
def test_a_law_whose_memory_grows_by_itself_is_graded_later_too(tmp_path, grows):
    write(tmp_path, TIRED.replace("memory.seconds + period", grows), "tired.py")
    write(tmp_path, (EXAMPLES / "own_airframe_controller.py").read_text(encoding="utf-8"), "own_airframe_controller.py")
    found = analyse_rest(read_mission(write(tmp_path, MISSION.replace('"lqr"', '"tired.py:Tired"')))).analysis
    assert graded(found).word == UNSTABLE
    assert len(found.later) == 1


def test_a_memory_that_stops_at_a_limit_is_not_followed_beyond_it(tmp_path):
    grows = "where(memory.seconds < 1.0, memory.seconds + 0.01, memory.seconds)"
    law = TIRED.replace("memory.seconds < 1.0", "memory.seconds < 1.5").replace("memory.seconds + period", grows)
    write(tmp_path, law, "tired.py")
    write(tmp_path, (EXAMPLES / "own_airframe_controller.py").read_text(encoding="utf-8"), "own_airframe_controller.py")
    found = analyse_rest(read_mission(write(tmp_path, MISSION.replace('"lqr"', '"tired.py:Tired"')))).analysis
    assert graded(found).word == SOUND
    assert found.later == ()


def test_a_loop_that_swings_about_a_rest_is_unstable_there_and_said_to_swing(tmp_path):
    run = quadstep("linear", EXAMPLES / "super_twisting.toml", "--out", tmp_path / "out")
    unstable, (swings, remedy) = run.out.splitlines()[0], run.out.splitlines()[-3:-1]
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert page.index("does not settle") < page.index("<figure") < page.index("in that flight")
    (job,) = flown_from_rest(read_mission(EXAMPLES / "super_twisting.toml"))[1]
    far = job.panels[0].lines["flown"]
    swing = float(re.search(r"swings by ([\d.]+)\smm", run.out)[1])
    assert 1e3 * far[len(far) // 2 :].max() == pytest.approx(swing, rel=1.0)
    assert remedy == REMEDY
    assert unstable.startswith("Hovering at the start of its path, the loop is unstable: a deviation doubles every ")
    said = rf"{THERE} does not settle: it swings by 1\d(\.\d)? mm along [xy] every 0.\d+ s\."
    assert re.fullmatch(said.replace("\u00a0", " "), swings.replace("\u00a0", " "))
    assert strict_json(tmp_path / "out" / "linear.json")["sentences"] == [unstable, swings, remedy]


def test_a_fragile_loop_is_not_called_sound_without_its_nets_where_the_flight_is_far_worse_without_them():
    pushed = read_mission(EXAMPLES / "case1.toml").with_({"disturbance.force": [2.0, 0.0, 0.0], "simulation.duration": 12.0})
    bare = pushed.with_({"controller.nets.enabled": False})
    assert quick_grade(pushed) == {"grade": FRAGILE, "why": "phase margin 29° in thrust (less than 30.0°)"}
    assert quick_grade(bare)["grade"] == SOUND
    rmse, without = (one.flight_metrics(fly(one.plan()))[0]["position_rmse[m]"] for one in (pushed, bare))
    assert without > 5.0 * rmse


def test_what_a_flight_of_an_unstable_loop_does_is_said():
    wild = hover({"type": "geometric", "k_Omega": 2000.0})
    said, (job,) = flown_from_rest(wild)
    assert re.match(rf"{THERE} (is lost after|does not settle)", said)
    begun = job.t[0], job.panels[0].lines["flown"][0]
    assert begun == pytest.approx((0.0, np.sqrt(3.0) * KICK), abs=1e-5)  # drawn from the step on
    assert "too slowly to be seen" in flown_from_rest(hover())[0]


MISSION = """
name = "circle"
vehicle = { preset = "x500" }
path = { type = "circle", centre = [0.0, 0.0, 5.0], radius = 1.0, period = 4.0, turns = 0.25, ramp = 1.0 }
controller = { type = "lqr" }
"""


def test_fly_says_the_grade_in_its_output_its_report_and_its_metrics(tmp_path):
    mission = write(tmp_path, MISSION)
    run = quadstep("fly", mission, "--out", tmp_path / "out", "--figures", "svg")
    assert run.code == 0
    found = grade(read_mission(mission))
    assert f"Hovering at the start of its path, the loop is {found.word}: {found.why}." in " ".join(run.out.split())
    assert strict_json(tmp_path / "out" / "metrics.json")["margins_at_rest"] == {"grade": found.word, "why": found.why}
    report = (tmp_path / "out" / "report.html").read_text(encoding="utf-8").replace("\u00a0", " ")
    assert found.why.split(";")[0] in report
    (one,) = data_of((tmp_path / "out" / "page.html").read_text(encoding="utf-8"))["flights"]
    assert ["loop at rest", f"{found.word}: {found.why}"] in one["facts"]
    (again,) = data_of(open_result(tmp_path / "out"))["flights"]
    assert again["facts"] == one["facts"]
    (listed,) = results(tmp_path)
    assert listed.says.endswith(f"; hovering at the start of its path, the loop is {found.word}")
    page = quadstep("page", mission, "--out", tmp_path / "page.html")
    assert page.code == 0
    (shown,) = data_of((tmp_path / "page.html").read_text(encoding="utf-8"))["flights"]
    assert shown["facts"] == one["facts"]


LOST = '[[events]]\ntype = "rotor"\ntime = 1.0\nrotor = 1\nefficiency = 0.0\n[simulation]\nduration = 12.0\n'


def test_what_the_mission_s_flight_does_comes_before_a_grade_that_leaves_it_out(tmp_path):
    mission = write(tmp_path, MISSION + LOST)
    run = quadstep("linear", mission, "--out", tmp_path / "linear")
    said = strict_json(tmp_path / "linear" / "linear.json")["sentences"][0]
    lost = r"\. However, the mission's flight is lost at [\d.]+ s \(more than 100 m from its path\)\."
    assert re.fullmatch("Hovering at the start of its path, the loop is sound: events are ignored" + lost, said)
    assert quick_grade(read_mission(mission))["why"].endswith("; events are ignored")
    assert said in " ".join(run.out.split())
    report = unescape((tmp_path / "linear" / "report.html").read_text(encoding="utf-8"))
    assert said.replace(". However", ".</p><p>However").replace("'", "’") in report.replace("\u00a0", " ").replace(
        "</p>\n", "</p>"
    )
    ending = said.partition(". However, the ")[2]
    file = write(tmp_path, CAMPAIGN, "campaign.toml")
    for asked in ((file, "--samples", 1), (mission, "--controllers", "lqr")):
        several = quadstep("linear", *asked, "--out", tmp_path / "several", "--overwrite")
        shown = " ".join(several.out.split())
        assert f"The {ending} 1 of 1 loop at rest is sound." in shown
    exported = quadstep("export", mission, "--out", tmp_path / "c99")
    assert exported.code == 0
    assert "warning: " in exported.err
    assert ending.removesuffix(".") in " ".join(exported.err.split())


def test_a_loop_that_rests_elsewhere_says_how_far(tmp_path):
    wind = MISSION.replace('"lqr"', '"px4-cascade"') + "wind = { mean = [8.0, 0.0, 0.0] }\n"
    mission = read_mission(write(tmp_path, wind))
    still = mission.with_(path={"type": "step", "start": [0.0, 0.0, 5.0], "end": [0.0, 0.0, 5.0], "duration": 120.0})
    away = fly(still.plan()).column("x")[-1]
    assert away > 0.02
    found = analyse_rest(mission).analysis
    assert found.aside == pytest.approx(away, rel=1e-2)
    assert f"; it rests {1e3 * away:.3g}" in graded(found).why.replace("\u00a0", " ")
    assert "rests" not in grade(read_mission(write(tmp_path, wind.replace("8.0", "0.0")))).why


CAMPAIGN = """
mission = "mission.toml"
flights = 40
failure = { largest_error = 0.05 }
vary = { "vehicle.mass" = { type = "uniform", low = 2.0, high = 2.2 } }
"""


@pytest.mark.parametrize(("k_omega", "more"), [(30.0, ("--flights", 2)), (60.0, ("--flights", 2)), (30.0, ("--rare",))])
def test_a_campaign_says_the_grade_of_the_mission_as_written(tmp_path, k_omega, more):
    """The verdict on its flights stands alone where the loop is sound."""
    mission = write(tmp_path, MISSION.replace('"lqr"', f'"geometric", k_Omega = {k_omega}'))
    rare = "rare = { flights = 200, replicates = 5, opinions = 0 }" if "--rare" in more else ""
    file = write(tmp_path, CAMPAIGN + rare, "campaign.toml")
    run = quadstep("campaign", file, "--out", tmp_path / "out", *more)
    assert run.code in (0, 4), run.err  # 4: a probability that is not shown
    found = grade(read_mission(mission))
    sentence = f"Hovering at the start of its path, the loop of the mission as written is {found.word}: {found.why}."
    assert (sentence in " ".join(run.out.split())) == (found.word != SOUND or "--rare" in more)
    report = (tmp_path / "out" / "report.html").read_text(encoding="utf-8").replace("\u00a0", " ")
    assert (found.why.split(";")[0] in report) == (found.word != SOUND or "--rare" in more)
    kept = strict_json(tmp_path / "out" / ("rare.json" if "--rare" in more else "campaign.json"))
    assert kept["summary"]["margins_at_rest"] == {"grade": found.word, "why": found.why}


def test_a_quick_grade_is_cached_and_leaves_out_what_takes_long(monkeypatch):
    mission = hover("pid")
    found = quick_grade(mission)
    assert found == {"grade": grade(mission).word, "why": grade(mission).why}
    monkeypatch.setattr(grade_module, "at_once", None)
    assert quick_grade(mission) == found
    monkeypatch.undo()
    assert quick_grade(hover("mppi")) == {}
    assert quick_grade(hover("lqr", sensors={"estimator": True, "latency": 0.1})) == {}


def test_a_quick_grade_hides_no_mistake_of_the_program(monkeypatch):
    monkeypatch.setattr(grade_module, "cached", lambda *_: {}["absent"])
    with pytest.raises(KeyError, match="absent"):
        quick_grade(hover("pid"))


def test_a_law_of_ones_own_is_graded_anew_once_its_code_has_changed(tmp_path):
    name = "own_airframe_controller.py"
    text = (EXAMPLES / name).read_text(encoding="utf-8")
    write(tmp_path, text, name)
    path = '[path]\ntype = "step"\nend = [0.0, 0.0, 2.0]\nduration = 5.0\n'
    law = f'[controller]\ntype = "{name}:ProportionalDerivative"\n'
    mission = write(tmp_path, f'[vehicle]\npreset = "x500"\n{path}{law}')
    assert quick_grade(read_mission(mission))["grade"] == SOUND
    write(tmp_path, text.replace("-120.0", "-1200.0"), name)
    assert quick_grade(read_mission(mission))["grade"] == UNSTABLE


def test_a_loop_that_bends_near_rest_is_graded_beside_other_results_by_its_worst_piece():
    mission = hover({"type": "rotation-backstepping", "nets": {"enabled": False}})
    found = grade(mission)
    assert quick_grade(mission) == {"grade": found.word, "why": found.why}


def test_a_loop_that_bends_only_where_it_does_not_matter_is_graded_beside_other_results():
    found = quick_grade(hover("betaflight-rates", "hummingbird"))
    assert found["grade"] == SOUND
    assert found["why"].startswith("smallest gain margin ")


def test_an_estimator_in_wind_is_graded_without_moving_its_covariance_to_what_is_none():
    noise = {"position_noise": 0.02, "gyro_noise": 0.01, "accelerometer_noise": 0.1}
    found = grade(hover("lqr", "x500", sensors={**noise, "latency": 0.02, "estimator": True}, wind={"mean": [6.0, 2.0, 0.0]}))
    assert found.word == SOUND, found.why  # a mode of its covariance was said to grow by e in 3 ms


def test_the_report_of_an_unstable_loop_is_red_shows_its_poles_and_exits_as_before(tmp_path):
    run = quadstep("linear", EXAMPLES / "theorem_fails.toml", "--out", tmp_path / "out")
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8").replace("\u00a0", " ")
    assert (run.code, '<span class="fails">Hovering at the start of its path, the loop is unstable' in page) == (0, True)
    assert re.search(r"<dt>fastest growing poles</dt><dd[^>]*>1.739 ± 3.245j 1/s<small>of pitch and roll", page)
    assert page.index('id="poles"') and "<details" not in page
    (job,) = flown_from_rest(read_mission(EXAMPLES / "theorem_fails.toml"))[1]
    assert (np.diff(job.panels[0].lines["flown"]) < 0.0).sum() > 100  # it falls again and again: the line is that of the peaks
    assert "where an error oscillates, it is that of the peaks" in page


def test_a_flight_whose_loop_is_not_graded_says_so_and_what_examines_it(tmp_path):
    path = '[path]\ntype = "step"\nend = [0.0, 0.0, 1.0]\nduration = 1.5\n'
    mission = write(tmp_path, f'[vehicle]\npreset = "x500"\n{path}[controller]\ntype = "mpc"\n')
    assert quick_grade(read_mission(mission)) == {}
    run = quadstep("fly", mission, "--out", tmp_path / "out")
    report = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert UNGRADED in " ".join(run.out.split())
    assert "The loop at rest is not graded here; <code>quadstep linear</code> examines it." in report.replace("\u00a0", " ")


def test_default_gains_are_called_fragile_on_a_small_vehicle_of_slow_rotors_and_late_commands():
    command = {"speed": 2900.0, "exponent": 0.95, "nominal_voltage": 3.8, "delay": 0.013}
    found = grade(Mission(vehicle={**true_vehicle(), "command": command}, path=HOLD, controller={"type": "pid"}))
    assert found.word == FRAGILE, "as docs/controllers.md says"
    assert found.why.startswith("gain margin 3.4 dB in pitch")
