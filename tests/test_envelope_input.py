"""`quadstep envelope`: what it refuses, in one line, and that nothing half-written stays."""

import json
import re

import pytest

from quadstep.io.errors import UserError
from quadstep.studies.campaign.flyer import Flyer
from tests.campaigns import MASS, SHORT, leftovers, refused, written
from tests.commands import LINE, quadstep

X, Y = "path.duration=0.3:0.5:3", "disturbance.scale=0,1"


def mission(folder, text=SHORT):
    """A mission file."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "mission.toml").write_text(text, encoding="utf-8")
    return folder / "mission.toml"


def envelope(folder, *options, x=X, y=Y, file=None):
    """The command, into folder/out."""
    return quadstep("envelope", file or mission(folder), "--x", x, "--y", y, "--out", folder / "out", *options)


@pytest.mark.parametrize(("x", "said"), [
    ("path.duration", ["'path.duration'", "KEY=a:b:n"]),
    ("=1:2:3", ["'=1:2:3'", "KEY=a:b:n"]),
    ("path..duration=1:2:3", ["'path..duration=1:2:3'", "KEY=a:b:n"]),
    ("path.end.²=1:2:3", ["path.end.²", "KEY=a:b:n"]),
    ("path.duration=1:2", ["'1:2'", "KEY=a:b:n"]),
    ("path.duration=1:2:3:4", ["'1:2:3:4'", "KEY=a:b:n"]),
    ("path.duration=a:2:3", ["'a'", "not a number"]),
    ("path.duration=:2:3", ["''", "not a number"]),
    ("path.duration=1:2:x", ["n in a:b:n", "'x'"]),
    ("path.duration=1:2:2.5", ["n in a:b:n", "'2.5'"]),
    ("path.duration=1:2:0", ["from 1 to 100000", "not 0"]),
    ("path.duration=1:2:-3", ["from 1 to 100000", "not -3"]),
    ("path.duration=1:2:1000000000", ["from 1 to 100000", "not 1000000000"]),
    ("path.duration=2:2:3", ["a in a:b:n should be below b", "2 and 2"]),
    ("path.duration=3:2:3", ["a in a:b:n should be below b", "3 and 2"]),
    ("path.duration=1:nan:3", ["'nan'", "-1e+09 to 1e+09"]),
    ("path.duration=-inf:1:3", ["'-inf'", "-1e+09 to 1e+09"]),
    ("path.duration=1:1e300:3", ["'1e300'", "-1e+09 to 1e+09"]),
    ("path.duration=1,inf", ["'inf'", "-1e+09 to 1e+09"]),
    ("path.duration=", ["a value is missing"]),
    ("path.duration=1,,2", ["a value is missing", "'1,,2'"]),
    ("path.duration=1,true", ["all numbers, all true or false, or all words"]),
    ("path.duration=1,2,1.0", ["1 is given twice"]),
    ("path.duration=0.3,word", ["all numbers, all true or false, or all words"]),
    ("path.duration=long,short", ["mission.toml", "path.duration", "should be a number in s", "'long'"]),
    ("path.duration=true,false", ["mission.toml", "path.duration", "should be a number in s", "True"]),
    ("path.duraton=1:2:3", ["mission.toml: cannot vary path.duraton", "unknown key", "duration, end"]),
    ("paths.duration=1:2:3", ["mission.toml", "paths", "unknown key"]),
    ("path=1:2:3", ["mission.toml", "path", "1.0"]),
    ("path.end.3=1:2:3", ["path.end.3", "entry 3 does not exist", "0 to 2"]),
    ("path.duration.x=1:2:3", ["path.duration.x", "cannot be inside"]),
    ("controller.type=backstepping,nothing", ["controller.type", "unknown value 'nothing'", "nested-saturation"]),
    ("controller.nets.neurons=1:2:4", ["controller.nets.neurons", "a whole number"]),
    ("vehicle.mass=-1:1:3", ["vehicle.mass", "greater than 0"]),
    ("vehicle.mass=1:-1:3", ["below b"]),
    ("vehicle.kinematics=1:2:3", ["vehicle.kinematics", "standard"]),
    ("name=a,b", ["--x name: a name does not affect flights"]),
    ("seed=1:3:3", ["--x seed", "already has its own noise"]),
    ("disturbance.scale=0:1:3", ["--x disturbance.scale", "--y too", "only once"]),
    ("disturbance=0,1", ["--x disturbance", "disturbance.scale is inside disturbance (--y)"]),
    ("disturbance.scale.x=0,1", ["disturbance.scale.x is inside disturbance.scale (--y)"]),
])  # fmt: skip
def test_axes_that_make_no_map(tmp_path, x, said):
    refused(envelope(tmp_path, x=x), *said)
    assert not (tmp_path / "out").exists()


def test_the_same_entry_written_in_two_ways(tmp_path):
    refused(envelope(tmp_path, x="path.end.2=0.1,0.2", y="path.end.02=0.3,0.4"), "--x path.end.2", "--y too")


def test_a_value_in_the_middle_that_cannot_be_flown(tmp_path):
    refused(envelope(tmp_path, x="sensors.latency=0,0.0003", file=mission(tmp_path, "")), "mission.toml: path", "is required")
    refused(envelope(tmp_path, x="simulation.log_period=0.02,0.03,0.04"), "log_period = 0.03", "whole multiple")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(("options", "said"), [
    (["--by", "path.duration=1,2"], ["--x path.duration: is --by too"]),
    (["--by", "vehicle.mass=1:2:13"], ["--by vehicle.mass", "from 1 to 12", "not 13"]),
    (["--by", "vehicle.mass=" + ",".join(map(str, range(1, 15)))], ["--by vehicle.mass", "14 values", "at most 12"]),
    (["--flights", "0"], ["--flights", "from 1", "not 0"]),
    (["--flights", "-1"], ["--flights", "not -1"]),
    (["--flights", "100000000"], ["--flights", "at most 50000000 flights"]),
    (["--failure", "position_rmse"], ["--failure", "METRIC=LIMIT"]),
    (["--failure", "rmse=1"], ["--failure", "unknown metric 'rmse'", "position_rmse, largest_error"]),
    (["--failure", "position_rmse=x"], ["--failure position_rmse", "'x' is not a number"]),
    (["--failure", "position_rmse=0"], ["--failure position_rmse", "above 0"]),
    (["--failure", "position_rmse=nan"], ["--failure position_rmse", "'nan'"]),
    (["--engine", "python"], ["--engine", "lanes, gpu, ray"]),
])  # fmt: skip
def test_options_that_make_no_map(tmp_path, options, said):
    refused(envelope(tmp_path, *options), *said)
    assert not (tmp_path / "out").exists()


def test_too_many_cells(tmp_path):
    big = envelope(tmp_path, x="vehicle.mass=1:2:2000", y="disturbance.scale=0:1:501")
    refused(big, "--x, --y", "1002000 cells", "at most 1000000")


def test_both_axes_are_needed(tmp_path):
    refused(quadstep("envelope", mission(tmp_path), "--x", X), "--y")


def test_files_that_are_none(tmp_path):
    refused(envelope(tmp_path, file=tmp_path / "none.toml"), "none.toml", "file not found")
    refused(envelope(tmp_path, file=mission(tmp_path, "x = [")), "mission.toml", "not valid TOML")
    refused(envelope(tmp_path, file=mission(tmp_path, f"flights = 3\n{LINE}")), "mission.toml: flights", "unknown key")


@pytest.mark.parametrize(("vary", "x", "said"), [
    (MASS, "vehicle.mass=1:2:3", ["--x vehicle.mass: is what varies in", "camp.toml", "only once"]),
    (MASS, "vehicle=1,2", ["vehicle.mass is inside vehicle"]),
    ('path = {type="choice", values=[{type="step", end=[0.0, 0.0, 1.0]}]}\n', X, ["path.duration is inside path"]),
])  # fmt: skip
def test_keys_that_the_campaign_varies_already(tmp_path, vary, x, said):
    refused(envelope(tmp_path, x=x, file=written(tmp_path, vary)), *said)


def test_a_folder_of_other_results_is_kept(tmp_path):
    assert envelope(tmp_path).code == 0
    before = {path.name: path.read_bytes() for path in (tmp_path / "out").iterdir()}
    assert envelope(tmp_path).code == 0  # the same map again
    for more in (["--flights", "2"], ["--failure", "position_rmse=1"], ["--by", "vehicle.mass=1,2"]):
        refused(envelope(tmp_path, *more), "out", "other results (mission)", "--overwrite")
    refused(envelope(tmp_path, x="disturbance.scale=0,1", y=X), "--overwrite")
    assert {path.name: path.read_bytes() for path in (tmp_path / "out").iterdir()} == before
    assert envelope(tmp_path, "--flights", "2", "--overwrite").code == 0
    (tmp_path / "file").write_text("")
    refused(quadstep("envelope", mission(tmp_path), "--x", X, "--y", Y, "--out", tmp_path / "file"), "is a file")


def test_ctrl_c_writes_nothing(tmp_path, monkeypatch):
    flown = []

    def fly(*_):
        flown.append(sorted(path.name for path in (tmp_path / "out").iterdir()))
        raise KeyboardInterrupt

    monkeypatch.setattr(Flyer, "fly", fly)
    run = envelope(tmp_path)
    assert (run.code, run.err, run.out) == (130, "quadstep: interrupted; nothing was written\n", "")
    assert len(flown) == 1
    assert not (tmp_path / "out").exists()


def test_ctrl_c_while_drawing_keeps_the_map_before(tmp_path, monkeypatch):
    assert envelope(tmp_path).code == 0
    before = {path.name: path.read_bytes() for path in (tmp_path / "out").iterdir()}

    def draw(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("quadstep.studies.envelope.draw_map", draw)
    assert envelope(tmp_path, "--flights", "2", "--overwrite").code == 130
    assert {path.name: path.read_bytes() for path in (tmp_path / "out").iterdir()} == before
    assert not leftovers(tmp_path)


def test_without_a_graphics_processor(tmp_path, monkeypatch):
    def none():
        raise UserError("none here; --engine lanes flies on this machine's cores")

    monkeypatch.setattr("quadstep.studies.campaign.flyer.Device", none)
    refused(envelope(tmp_path, "--engine", "gpu"), "none here; --engine lanes")
    assert not (tmp_path / "out").exists()


def test_a_graphics_processor_flies_where_asked_for(tmp_path, monkeypatch):
    asked = []
    monkeypatch.setattr("quadstep.studies.campaign.flyer.device_flyer", lambda campaign: asked.append(1) or Flyer(campaign))
    assert envelope(tmp_path).code == 0
    assert not asked
    assert envelope(tmp_path, "--engine", "gpu").code == 0
    assert asked


def test_a_machine_is_told_the_same(tmp_path):
    done = envelope(tmp_path, "--json", "--junit", str(tmp_path / "j.xml"))
    said = json.loads(done.out)
    assert done.code == said["exit_code"] == 0
    assert (said["command"], said["passed"], said["report"]) == ("envelope", True, str(tmp_path / "out/report.html"))
    assert said["panels"] == json.loads((tmp_path / "out/metrics.json").read_text())["panels"]
    report = (tmp_path / "out/report.html").read_text()
    assert all(sentence in report for sentence in re.split(r"(?<=\.) ", said["answer"]))
    assert 'failures="0"' in (tmp_path / "j.xml").read_text()


def test_a_junit_file_that_cannot_be_written_is_refused_before_anything_flies(tmp_path):
    refused(envelope(tmp_path, "--junit", str(tmp_path)), "--junit", "is a folder")
    assert not (tmp_path / "out").exists()
