"""`quadstep what-if`: the same winds before and after, what is worse is said so, and what makes no sense is refused."""

import json
import math
import re
from pathlib import Path
from types import SimpleNamespace
from uuid import uuid4

import numpy as np
import pytest

from quadstep.io.errors import UserError
from quadstep.io.parameter_files import CrazyflieYaml
from quadstep.linear.grade import FRAGILE, UNSTABLE
from quadstep.metrics.statistics import Estimate
from quadstep.studies import what_if as run
from quadstep.studies.tuning.ground import CandidateFlyer
from quadstep.studies.tuning.objective import Row
from quadstep.studies.what_if import answer, changes_of
from quadstep.studies.what_if_report import (
    Question,
    at_once,
    better_or_worse,
    changed_words,
    compared,
    hidden_effects,
    in_flight,
    picture,
)
from tests.commands import quadstep
from tests.needs import CHROMIUM, needs, package

LAW = "crazyflie-pid"


def asked(flights=16, law=LAW, wind=3.0, **changes):
    return Question(law, {name.replace("__", "."): value for name, value in changes.items()}, "crazyflie", wind, flights)


def test_a_change_that_breaks_the_loop_is_told_so(tmp_path):
    done = answer(asked(pid_rate__roll_kp=2.0, pid_rate__pitch_kp=2.0), tmp_path / "out")
    found, both = done.record, {row[0]: row[1:] for row in done.sections[0].rows}
    assert both["grade"] == (FRAGILE, UNSTABLE, "")
    assert "rise time" not in both
    assert "Before and after differ by at most " in done.figures[0].caption
    assert set(found["step"]["after"].values()) == {None}
    assert found["grades"]["before"]["grade"] == FRAGILE
    assert found["grades"]["after"]["grade"] == UNSTABLE
    assert found["failed"]["before"]["value"] == 0.0
    assert found["failed"]["after"]["value"] > 0.5
    assert found["failed"]["difference"]["low"] > 0.0
    assert json.loads((tmp_path / "out" / "metrics.json").read_text())["failed"] == found["failed"]
    assert (tmp_path / "out" / "report.html").is_file()


def test_a_parameter_without_effect_changes_no_flight_by_a_bit(tmp_path):
    done = answer(asked(pid_rate__omzFiltCut=40.0), tmp_path / "out")  # of a filter that is off
    assert re.search(
        r"\) no flight differs from before by a single bit, .* they do not show what the change does\. "
        r"There the loop at rest stays fragile .*, and 0 \[",
        done.answer,
    )
    assert "no difference is shown" not in done.answer
    found = done.record
    assert all(one["before"] == one["after"] for one in found["metrics"].values())
    assert {one["difference"]["value"] for one in found["metrics"].values()} == {0.0}
    assert found["step"]["before"] == found["step"]["after"]
    assert found["grades"]["before"] == found["grades"]["after"]


def test_a_lower_gain_is_less_busy_and_a_faster_loop_rises_sooner(tmp_path):
    found = answer(asked(posCtlPid__xKp=1.0, posCtlPid__yKp=1.0), tmp_path / "out")
    stays = r"the loop at rest stays fragile \(phase margin in [^;]* below 30\.0°\); better: .*; worse: "
    assert re.search(stays, found.answer)
    assert re.search(r"; worse: .*position RMSE", found.answer)
    air = "in turbulent wind with a mean of up to 3 m/s along x and along y"
    assert f". None of 16 flights {air} is lost or ever more than 1 m from its target, " in found.answer
    assert any(card.what.startswith("phase margin") for card in found.facts), "whose number the sentence leaves to it"
    assert "phase margin" not in found.answer.partition("; better: ")[2], "which is named before"
    found = found.record
    assert found["step"]["after"]["rise time [s]"] > 1.2 * found["step"]["before"]["rise time [s]"]
    assert found["metrics"]["position_rmse[m]"]["difference"]["low"] > 0.0


def test_a_step_is_drawn_where_before_and_after_are_seen_apart():
    """A rate that differs for a tenth of a second, and a position that follows slowly and hardly differs."""
    t = np.arange(0.0, 8.0, 0.01)
    still, pulse = np.zeros_like(t), np.exp(-(((t - 1.1) / 0.03) ** 2))

    def log(size):
        columns = dict.fromkeys(("x", "z", "roll", "pitch", "yaw", "q", "r"), still)
        columns |= {"t": t, "y": np.clip(t - 1.0, 0.0, 0.5) + 1e-3 * size * np.clip(t - 1.0, 0.0, 1.0), "p": size * pulse}
        return SimpleNamespace(column=columns.__getitem__)

    drawn = picture(log(1.0), log(1.5))
    assert [one.label for one in drawn.panels] == ["p"]
    assert 0.7 < drawn.t[0] < 1.1 < drawn.t[-1] < 1.5  # of 8 s


def test_flights_without_wind_are_not_said_to_be_in_turbulence(tmp_path):
    found = answer(asked(4, wind=0.0, pid_rate__yaw_kp=60.0), tmp_path / "out")
    assert " of 4 flights in still air " in found.answer and found.answer.startswith("With ")
    assert "turbulen" not in found.html(tmp_path / "out")


def test_what_is_not_modelled_and_changes_too_is_named(tmp_path):
    files = [str(tmp_path / name) for name in ("before.param", "after.param", "slew.param")]
    for file, (gain, slew) in zip(files, ((0.135, 25), (0.1, 50), (0.135, 50)), strict=True):
        Path(file).write_text(f"ATC_RAT_RLL_P,{gain}\nATC_RAT_RLL_SMAX,{slew}\nFRAME_CLASS,1\n")
    assert changes_of(files[1:2], files[0]) == ({"ATC_RAT_RLL_P": 0.1}, ("ATC_RAT_RLL_SMAX",), ())
    assert changes_of(["ATC_RAT_RLL_P=0.1"], files[0]) == ({"ATC_RAT_RLL_P": 0.1}, (), ())
    question = Question(files[0], {"ATC_RAT_RLL_P": 0.1}, "x500", flights=2, unmodelled=("ATC_RAT_RLL_SMAX",))
    assert "ATC_RAT_RLL_SMAX changes, too, and is not modelled" in hidden_effects(question)[0]
    with pytest.raises(UserError, match=r"differs between it and .*before.param; ATC_RAT_RLL_SMAX does, but is not modelled$"):
        changes_of(files[2:], files[0])


def test_flights_before_are_flown_once_for_many_changes(tmp_path, monkeypatch):
    digest = uuid4().hex  # so that no flights of an earlier run of the tests are found
    monkeypatch.setattr(run, "source_digest", lambda: digest)
    first = answer(asked(pid_rate__roll_kp=200.0, wind=2.9), tmp_path / "1").record
    fly, flown = CandidateFlyer.fly, []
    monkeypatch.setattr(CandidateFlyer, "fly", lambda self, some, *rest: [flown.append(len(some)), fly(self, some, *rest)][1])
    second = answer(asked(pid_rate__roll_kp=190.0, wind=2.9), tmp_path / "2").record
    assert flown == [1]
    for name, one in second["metrics"].items():
        assert one["before"] == first["metrics"][name]["before"]
        assert one["before"] != one["after"] or name == "saturation"
    assert answer(asked(pid_rate__roll_kp=190.0, wind=2.8), tmp_path / "3").record["metrics"] != second["metrics"]
    assert flown == [1, 2]


WRONG = {
    "pid_rate.rol_kp=1": "is not a parameter of crazyflie-pid, crazyflie-mellinger; did you mean pid_rate.roll_kp?",
    "pid_rate.roll_kp": "pid_rate.roll_kp: file not found",
    "pid_rate.roll_kp=nan": "should be NAME=VALUE, with a number",
    "pid_rate.roll_kp=250": "pid_rate.roll_kp is already 250",
    "pid_rate.roll_kp=-1": "pid_rate.roll_kp",
    "ctrlMel.kp_z=1": "crazyflie-pid has no parameter ctrlMel.kp_z, which belongs to crazyflie-mellinger",
}


@pytest.mark.parametrize("change", WRONG)
def test_a_question_without_sense_is_refused_in_one_line(tmp_path, change):
    with pytest.raises(UserError) as error:
        answer(Question(LAW, changes_of([change], LAW).values, "crazyflie"), tmp_path / "out")
    assert WRONG[change] in str(error.value)
    assert "\n" not in str(error.value)
    assert not (tmp_path / "out" / "metrics.json").exists()


@pytest.mark.parametrize("text", ["nonsense", "1\t1\tMC_ROLLRATE_Q\t0.2\t9\n"])
def test_a_refused_file_is_named_once(tmp_path, text, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("mine.params").write_text(text)
    with pytest.raises(UserError, match=r"^mine.params: (?!.*mine.params)(?!.*controller)"):
        answer(Question("mine.params", {"MC_ROLLRATE_P": 0.2}, "x500"), tmp_path / "out")


def test_two_files_differ_by_what_changes_between_them(tmp_path):
    defaults = {"pid_rate.roll_kp": 250.0, "posCtlPid.xKp": 2.0, "pid_attitude.yawMaxDelta": 0.0}
    names = []
    for values in ({"pid_rate.roll_kp": 200.0, "posCtlPid.xKp": 1.5}, {"posCtlPid.xKp": 1.5, "pid_attitude.yawMaxDelta": 1.0}):
        names.append(str(tmp_path / f"{len(names)}.yaml"))
        (tmp_path / f"{len(names) - 1}.yaml").write_text(CrazyflieYaml.write(values, defaults))
    said = f"{names[1]} does not have pid_rate.roll_kp: its default counts"
    assert changes_of([names[1]], names[0]) == ({"pid_rate.roll_kp": 250.0}, ("pid_attitude.yawMaxDelta",), (said,))
    assert changes_of([names[0]], names[1]).notes == ()
    assert changes_of([names[0]], LAW) == ({"pid_rate.roll_kp": 200.0, "posCtlPid.xKp": 1.5}, (), ())
    with pytest.raises(UserError, match=r"no parameter of .* differs between it and"):
        changes_of([names[0]], names[0])
    found = answer(Question(names[1], {"pid_rate.roll_kp": 240.0}, "crazyflie", flights=2), tmp_path / "out")
    assert found.record["before"] == {"pid_rate.roll_kp": 250.0}
    assert found.warnings == [f"{names[1]}: crazyflie-pid does not use pid_attitude.yawMaxDelta"]


def test_the_file_says_whose_parameters_they_are(tmp_path):
    texts = {"a.params": "1\t1\tMC_ROLL_P\t6\t9\n1\t1\tEKF2_EN\t1\t6\n", "b.params": "1\t1\tMC_YAW_P\t3\t9\n"}
    files = [tmp_path / name for name in texts]
    for file in files:
        file.write_text(texts[file.name])
    assert changes_of([str(files[1])], str(files[0])).values == {"MC_ROLL_P": 6.5, "MC_YAW_P": 3.0}
    found = answer(Question(str(files[0]), {"MC_ROLLRATE_K": 0.1}, "x500", flights=2), tmp_path / "out").record
    assert (found["law"], found["before"]) == ("px4-cascade", {"MC_ROLLRATE_K": 1.0})
    with pytest.raises(UserError, match=r"mine.csv: should be a file of an autopilot's parameters \(.yaml, .params"):
        answer(Question("mine.csv", {"MC_ROLL_P": 1.0}, "x500"), None)
    with pytest.raises(UserError, match=r"MC_ROLP_P is not a parameter of px4-cascade; did you mean MC_ROLL_P\?"):
        answer(Question("px4-cascade", {"MC_ROLP_P": 1.0}, "x500"), None)


def test_values_that_are_one_in_f32_are_the_same(tmp_path):
    file = tmp_path / "saved.params"
    file.write_text("1\t1\tMC_ROLLRATE_P\t0.150000005960464478\t9\n1\t1\tMC_ROLL_P\t6\t9\n")
    assert changes_of([str(file)], "px4-cascade").values == {"MC_ROLL_P": 6.0}
    with pytest.raises(UserError, match=r"MC_ROLLRATE_P is already 0\.15"):
        answer(Question(str(file), {"MC_ROLLRATE_P": 0.15}, "x500"), None)


def test_parameters_of_two_laws_and_one_twice_are_refused():
    with pytest.raises(UserError, match="are not parameters of the same law"):
        answer(asked(pid_rate__roll_kp=1.0, ctrlMel__kp_z=1.0), None)
    with pytest.raises(UserError, match="is given twice"):
        changes_of(["a=1", "a=2"], LAW)


def test_the_command_says_it_and_prints_json(tmp_path):
    out = tmp_path / "out"
    done = quadstep("what-if", LAW, "pid_rate.yaw_kp=60", "--vehicle", "crazyflie", "--flights", "4", "--out", out, "--json")
    assert done.code == 0
    assert json.loads(done.out)["law"] == LAW
    assert quadstep("what-if", LAW, "pid_rate.yaw_kp=60", "--vehicle", "crazyflie", "--flights", "1").code == 2


@pytest.fixture(scope="module")
def page_file(tmp_path_factory):
    return tmp_path_factory.mktemp("page") / "out" / "page.html"


@needs(CHROMIUM)
def test_the_page_counts_the_failures_of_the_report_where_the_slider_is(open_page, page_file):
    package("playwright")
    change = Question(LAW, {"pid_rate.roll_kp": 3.0, "pid_rate.pitch_kp": 3.0}, "crazyflie", 5.0, 48, within=0.12)
    failed = answer(change, page_file.parent, paged=True).record["failed"]
    counts = [round(48 * failed[side]["value"]) for side in ("before", "after")]
    assert 0 < counts[0] < counts[1]
    page = open_page()
    for link, count in zip(("before", "after"), counts, strict=True):
        page.get_by_role("link", name=link).click()
        said = f"document.querySelector('#rate-words').innerText.startsWith('{count} of 48')"
        page.wait_for_function(f"() => quadstep.rate()?.done && {said}")
    difference = failed["difference"]
    said = " That is {1:.1f} points more than with the original values ({0}; "
    said += "95 % interval of the difference {2:.1f} to {3:.1f})."
    shown = [100.0 * difference[part] for part in ("value", "low", "high")]
    assert page.locator("#rate-words").inner_text().endswith(said.format(counts[0], *shown))
    assert page.locator("#controls .group input[type=range]").first.get_attribute("aria-label").startswith("pid rate.roll kp")


def test_a_difference_is_that_of_the_numbers_shown():
    """43.74 and 28.66 are shown as 43.7 and 28.7; they differ by 15.08, which was shown as 15.1."""
    assert at_once("phase margin", 43.74, 28.66, "°", True, 1)[1:4] == ("43.7°", "28.7°", "−15.0°")
    assert at_once("overshoot", 8.3649, 8.3651, " %", False)[1:4] == ("8.36 %", "8.37 %", "0.01 %")
    assert at_once("gain margin", -2.0, 1.54, " dB", True, 1)[1:4] == ("−2.0 dB", "1.5 dB", "3.5 dB")
    assert at_once("rise time", 1.0, 1.0, " s", False)[1:4] == ("1.00 s", "1.00 s", "0 s")
    assert at_once("delay margin", math.inf, 3.0, " ms", True, 1)[1:5] == ("none", "3.0 ms", "–", 0.0)
    assert at_once("rise time", math.nan, 3.0, " s", False)[1:5] == ("–", "3.00 s", "–", 0.0)


def test_the_sentence_says_by_how_many_points_more_or_fewer_flights_fail():
    assert compared(Estimate(1.0, 0.832, 1.0)) == ": more, by 100 points (83.2 to 100)"
    assert compared(Estimate(-0.25, -0.4, -0.1)) == ": fewer, by 25 points (10 to 40)"
    assert compared(Estimate(0.0, -0.1, 0.2)) == "; no difference is shown, 0 [−10, +20] points"


def test_a_change_that_saves_the_hardest_flights_is_not_said_to_fly_worse():
    """The mean of all rises with the flights that only the change completes; each that both complete is closer."""
    before, after, closer = Estimate(0.04, 0.03, 0.05), Estimate(0.06, 0.05, 0.07), Estimate(-0.01, -0.012, -0.008)
    found = in_flight(Row("position_rmse[m]", before, after, closer))
    assert found.before == "40\N{NO-BREAK SPACE}mm"
    assert found.after == "60\N{NO-BREAK SPACE}mm"
    assert better_or_worse([found]) == "; better: position RMSE; nothing else that is shown is better or worse by 1 %"


def test_what_is_not_shown_or_is_small_is_neither_better_nor_worse():
    before, after = Estimate(1.35, 1.34, 1.36), Estimate(3.23, 3.21, 3.24)
    busier = in_flight(Row("rotor_activity[N/s]", before, after, Estimate(1.88, 1.86, 1.89)))
    small = in_flight(Row("rotor_activity[N/s]", before, after, Estimate(0.013, 0.012, 0.014)))
    unknown = in_flight(Row("rotor_activity[N/s]", before, after, Estimate(0.9, -0.1, 1.9)))
    first = in_flight(Row("saturation", Estimate(0.0, 0.0, 0.0), before, Estimate(0.2, 0.1, 0.3)))
    rest = "; nothing else that is shown is better or worse by 1 %"
    assert better_or_worse([busier]) == f"; worse: rotor activity{rest}"
    assert better_or_worse([small, unknown]) == "; nothing that is shown is better or worse by 1 %"
    assert better_or_worse([busier, small, first]) == f"; worse: saturation and rotor activity{rest}"


def test_of_many_parameters_the_first_are_named_and_of_those_that_stay_each_is_said(tmp_path):
    changed = [(f"P{i}", None, 1.0, 2.0) for i in range(5)]
    assert changed_words(changed[:2]) == "P0 = 2 (1 before) and P1 = 2 (1 before)"
    assert changed_words(changed) == "P0 = 2 (1 before), P1 = 2 (1 before), P2 = 2 (1 before) and 2 more"
    assert "more" not in changed_words(changed[:4]), "one is named"
    found = answer(asked(2, pid_rate__roll_kp=250.0, pid_rate__yaw_kp=60.0), tmp_path / "out")
    assert found.warnings == ["pid_rate.roll_kp is already 250"]
    assert found.record["before"] == {"pid_rate.yaw_kp": 120.0}
    assert found.answer.startswith("With pid_rate.yaw_kp = 60 (120 before) the loop at rest ")
    panels = [row for row in ("x", "y", "z", "yaw", "r") if f" in {row} (at " in found.figures[0].caption]
    assert panels[-2:] == ["yaw", "r"], "the axis whose gain changes is drawn"
