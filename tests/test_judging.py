"""Verdicts for machines: requirements, JSON, JUnit files, exit codes."""

import io
import json
import math
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from quadstep.commands.options import Delivery
from quadstep.io.errors import UserError
from quadstep.metrics import requirements
from quadstep.metrics.statistics import share as interval
from quadstep.metrics.verdict import Case, Verdict, junit_xml, scalars
from quadstep.report.evidence import Evidence
from tests.commands import LINE, quadstep, write
from tests.verdicts import checked, properties

DIVERGING = f"{LINE}[start]\nposition = [0.0, 0.0, 30.0]\n[limits]\ndistance = 20.0\n"


@pytest.fixture
def mission(tmp_path):
    return write(tmp_path, LINE)


@pytest.fixture
def diverging(tmp_path):
    return write(tmp_path, DIVERGING, "diverging.toml")


def flown(mission, tmp_path, *options):
    return quadstep("fly", mission, "--out", tmp_path / "out", *options)


# Requirements of one flight


@pytest.mark.parametrize("metric", ["position_rmse", "position_rmse[m]", "position.x.largest", "u.total_variation[N]"])
def test_a_flight_passes_up_to_what_is_required_and_fails_above(mission, tmp_path, no_figures, metric):
    known = json.loads(flown(mission, tmp_path, "--json").out)
    name = next(name for name in scalars(known) if metric in (name, name.partition("[")[0]))
    value = scalars(known)[name]
    assert value > 0.0
    met = flown(mission, tmp_path, "--require", f"{metric}={value!r}")
    assert (met.code, met.err) == (0, "")
    assert f"Met: {name.partition('[')[0]} at most " in met.out
    missed = flown(mission, tmp_path, "--require", f"{metric}={math.nextafter(value, 0.0)!r}")
    assert missed.code == 4
    assert f"NOT MET: {name.partition('[')[0]} should be at most " in missed.out


def test_one_requirement_of_several_is_enough_to_fail(mission, tmp_path, no_figures):
    run = flown(mission, tmp_path, "--require", "position_rmse=100", "--require", "largest_tilt=0", "--json")
    assert run.code == 4
    found = json.loads(run.out)
    assert [(one["metric"], one["met"]) for one in found["requirements"]] == [
        ("position_rmse[m]", True),
        ("largest_tilt[rad]", False),
    ]
    assert (found["passed"], found["exit_code"]) == (False, 4)
    assert run.err.splitlines() == [f"quadstep: NOT MET: {line}" for line in re.findall(r"largest_tilt should.*", run.err)]
    assert len(run.err.splitlines()) == 1


def test_every_number_in_metrics_json_may_be_named(mission, tmp_path, no_figures):
    flown(mission, tmp_path)
    content = json.loads((tmp_path / "out" / "metrics.json").read_text(encoding="utf-8"))
    del content["mission"]
    names = list(scalars(content))
    assert "attitude.theta.angle_settling[s]" in names
    options = [part for name in names for part in ("--require", f"{name}={requirements.BOUNDS.get(name, 1e9)!r}")]
    run = flown(mission, tmp_path, *options, "--json")
    assert run.code in (0, 4)
    assert [one["metric"] for one in json.loads(run.out)["requirements"]] == names


@pytest.mark.parametrize(
    ("required", "said"),
    [
        ("largest_tilt=45", "every flight meets that: an angle is in rad (45° are 0.785)"),
        ("saturated_share=10", "every flight meets that: a share is from 0 to 1"),
    ],
)
def test_a_requirement_in_degrees_or_percent_which_every_flight_would_meet_is_refused(mission, tmp_path, required, said):
    path = write(tmp_path, "vehicle = { preset = 'x500' }\n" + LINE, "real.toml")
    run = flown(path, tmp_path, "--require", required)
    assert run.refused
    assert said in run.err


def test_a_time_that_is_never_reached_meets_no_requirement():
    one = requirements.judge(requirements.Requirement("settling[s]", 1e9), {"settling[s]": None}, None)
    assert one.failure == "settling should be at most 1e+09 s, but is never reached"


@pytest.mark.parametrize(
    "text", ["", "abc", "position_rmse", "position_rmse=", "x=1=2", "=3", "=", "position_rmse=nan", "position_rmse=inf",
             "position_rmse=-1", "position_rmse=1e999", "position_rmse=0.05m", "position_rmse=\x1b[31m"],
)  # fmt: skip
def test_a_requirement_that_is_none_is_refused(mission, tmp_path, text):
    run = flown(mission, tmp_path, "--require", text)
    assert run.refused, run
    assert ("METRIC=LIMIT" if text else "--require: is empty") in run.err
    assert "\x1b" not in run.err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("name", ["speed", "position", "outcome", "position.x", "position_rmse[mm]", "name", "mission.path"])
def test_an_unknown_metric_is_refused_with_what_is_allowed(mission, tmp_path, name):
    run = flown(mission, tmp_path, "--require", f"{name}=1")
    assert run.refused, run
    assert repr(name) in run.err
    assert "llowed: any number of its metrics.json, with or without the unit" in run.err
    assert not (tmp_path / "out").exists()


def test_metrics_of_a_real_vehicle_are_known_before_it_flies(tmp_path):
    path = tmp_path / "mission.toml"
    path.write_text(f'{LINE}[vehicle]\npreset = "x500"\n', encoding="utf-8")
    run = flown(path, tmp_path, "--require", "rotors.activity[N/s]=0", "--require", "saturated_share=1")
    assert run.code == 4
    assert "NOT MET: rotors.activity should be at most 0 N/s, but is " in run.out
    assert "Met: saturated_share at most 1\n" in run.out


# A flight that diverges


def test_a_flight_that_diverges_fails_whatever_is_required(diverging, tmp_path, no_figures):
    """With the exit code that it has without requirements."""
    run = flown(diverging, tmp_path, "--require", "position_rmse=1e9", "--json", "--junit", tmp_path / "junit.xml")
    assert run.code == 3
    found = json.loads(run.out)
    assert (found["passed"], found["exit_code"], found["requirements"][0]["met"]) == (False, 3, False)
    _, cases = checked((tmp_path / "junit.xml").read_text(encoding="utf-8"))
    assert cases["completed"].startswith("Lost at ")
    assert "but the flight was lost at " in cases["position_rmse at most 1e+09 m"]
    assert flown(diverging, tmp_path).code == 3


# JSON


def test_json_is_one_object_and_nothing_else_is_printed(mission, tmp_path, no_figures):
    run = flown(mission, tmp_path, "--json")
    assert (run.code, run.err) == (0, "")
    found = json.loads(run.out)
    assert (found["command"], found["outcome"], found["passed"], found["exit_code"]) == ("fly", "completed", True, 0)
    written = json.loads((tmp_path / "out" / "metrics.json").read_text(encoding="utf-8"))
    assert found["position"] == written["position"]
    assert found["position_rmse[m]"] == written["position_rmse[m]"]


def test_bad_input_prints_no_json_and_leaves_no_junit_file(tmp_path):
    run = quadstep("fly", tmp_path / "missing.toml", "--json", "--junit", tmp_path / "junit.xml")
    assert run.refused
    assert not list(tmp_path.iterdir())


def test_an_object_is_printed_whole_or_not_at_all(monkeypatch):
    """Whatever asks the program to end while it prints."""

    class Interrupted(io.StringIO):
        def write(self, text):
            for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
                signal.raise_signal(number)
            return super().write(text)

    stream = Interrupted()
    monkeypatch.setattr(sys, "stdout", stream)
    before = signal.getsignal(signal.SIGINT)
    Delivery(as_json=True).deliver(Verdict("fly", "x", (), {"a": 1}, 0))
    assert json.loads(stream.getvalue()) == {"command": "fly", "a": 1, "passed": True, "exit_code": 0}
    assert signal.getsignal(signal.SIGINT) is before


# JUnit


def test_a_junit_file_says_what_was_required_and_measured(mission, tmp_path, no_figures):
    target = tmp_path / "out" / "junit.xml"  # in a folder that is there only after the flight
    run = flown(mission, tmp_path, "--require", "position_rmse=1", "--require", "largest_tilt=0", "--junit", target)
    assert run.code == 4
    assert "Results: " in run.out
    suite, cases = checked(target.read_text(encoding="utf-8"))
    assert list(cases) == ["completed", "position_rmse at most 1 m", "largest_tilt at most 0 rad"]
    assert [message is None for message in cases.values()] == [True, True, False]
    measured = json.loads((tmp_path / "out" / "metrics.json").read_text(encoding="utf-8"))["position_rmse[m]"]
    assert float(properties(suite)["position_rmse[m]"]) == measured
    assert flown(mission, tmp_path, "--junit", target).code == 0  # replaced
    assert list(checked(target.read_text(encoding="utf-8"))[1]) == ["completed"]
    assert not list(target.parent.glob(".writing-*"))


def test_no_text_breaks_a_junit_file():
    nasty = "a<b>&\"']]>\x00\x1b[31m\ud800 \N{PILE OF POO} \u202e</testsuite>\n"
    verdict = Verdict("fly", nasty, (Case(nasty), Case("two", nasty)), {nasty: nasty, "n": {"x[m]": 0.1, "y": None}}, 4)
    suite, cases = checked(junit_xml(verdict, 1.5))
    assert len(cases) == 2
    assert (properties(suite)["n.x[m]"], suite.get("time")) == ("0.1", "1.500")
    assert "</testsuite>" in suite.get("name")


@pytest.mark.parametrize("kind", ["folder", "device", "mission", "through an absent folder", "file as folder", "null", "long"])
def test_a_junit_file_that_cannot_be_written_is_refused_before_the_flight(mission, tmp_path, kind):
    target = {
        "folder": tmp_path, "device": Path("/dev/null"), "mission": mission, "file as folder": mission / "junit.xml",
        "through an absent folder": tmp_path / "absent" / ".." / mission.name, "null": "a\0b", "long": tmp_path / ("x" * 300),
    }[kind]  # fmt: skip
    run = flown(mission, tmp_path, "--junit", target)
    assert run.refused, run
    assert "--junit" in run.err
    assert mission.read_text(encoding="utf-8") == LINE
    assert [path.name for path in tmp_path.iterdir()] == ["mission.toml"]


# Shares


@pytest.mark.parametrize("text", ["nan", "1.5", "-1", "", "abc", "0", "1", "inf", "99.9%", "1e-400"])
def test_a_share_that_is_none_is_refused(text):
    with pytest.raises(UserError, match="between 0 and 1"):
        requirements.parsed_share(text)


def test_the_lower_end_of_the_exact_interval_decides():
    found = interval(998, 1000)
    assert requirements.JudgedShare(found.low, found, 1000).met
    missed = requirements.JudgedShare(math.nextafter(found.low, 1.0), found, 1000)
    assert not missed.met
    assert "success rate of all flights should be at least" in missed.case.failure


@pytest.mark.parametrize("least", [0.5, 0.9, 0.999, 0.99999])
def test_the_flights_that_a_share_needs_are_the_fewest(least):
    needed = requirements.flights_needed(least)
    assert interval(needed, needed).low >= least
    assert interval(needed - 1, needed - 1).low < least
    judged = requirements.JudgedShare(least, interval(needed - 1, needed - 1), needed - 1)
    assert f"{needed} could, if none fails" in judged.case.failure


def test_the_command_line_still_starts_without_numpy():
    code = "import sys, quadstep.commands.cli; print([name for name in ('numpy', 'xml', 'pydantic') if name in sys.modules])"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout == "[]\n"


def test_what_speaks_against_a_result_reaches_json_and_junit(tmp_path):
    found = Evidence(
        "a log", "Prediction", "Off by 3 mm.", ["Off by 3 mm."], {"error": 0.003}, warnings=["it is damaged", "old"]
    )
    verdict = found.verdict("replay", tmp_path)
    assert verdict.as_json()["warnings"] == ["it is damaged", "old"]
    assert 'name="warnings" value="it is damaged; old"' in junit_xml(verdict, 1.0)
    assert "warnings" not in found._replace(warnings=()).content
