"""The folder of results: never half-written, never another mission's results overwritten without being asked to."""

import json
from pathlib import Path

import pytest

from tests.commands import LINE, files, quadstep, write

pytestmark = pytest.mark.usefixtures("no_figures", "ungraded")

OTHER = LINE.replace("[1.0, 0.5, 0.5]", "[2.0, 0.5, 0.5]")
NESTED = LINE + '[controller]\ntype = "nested-saturation"\n'


@pytest.fixture
def out(tmp_path):
    """The results of a first mission."""
    assert quadstep("fly", write(tmp_path, 'name = "first"\n' + LINE), "--out", tmp_path / "out").code == 0
    return tmp_path / "out"


def test_the_same_mission_again_overwrites_quietly(tmp_path, out):
    before = files(out)
    run = quadstep("fly", tmp_path / "mission.toml", "--out", out)
    assert run.code == 0
    assert files(out) == before


def test_the_same_flight_under_another_name_is_the_same_mission(tmp_path, out):
    assert quadstep("fly", write(tmp_path, 'name = "renamed"\n' + LINE, "b.toml"), "--out", out).code == 0
    assert json.loads((out / "metrics.json").read_text(encoding="utf-8"))["name"] == "renamed"


DIFFERENT = {
    "end": OTHER,
    "controller": NESTED,
    "mass": LINE + "[vehicle]\nmass = 1.1\n",
    "duration": LINE + "[simulation]\nduration = 2.0\n",
    "log period": LINE + "[simulation]\nlog_period = 0.02\n",
    "rotor limits": LINE + "[vehicle]\nrotors.limits = [0.0, 100.0]\n",
    "kinematics": LINE + '[vehicle]\nkinematics = "printed"\n',
    "disturbance": LINE + "[disturbance]\nscale = 2.0\n",
    "limits": LINE + "[limits]\ndistance = 50.0\n",
    "seed": LINE + '[controller]\ntype = "backstepping"\nnets.seed = 2\n',
}


@pytest.mark.parametrize("what", DIFFERENT)
def test_a_different_mission_is_refused_and_the_old_files_stay(tmp_path, out, what):
    before = files(out)
    run = quadstep("fly", write(tmp_path, DIFFERENT[what], "other.toml"), "--out", out)
    assert run.refused
    assert all(part in run.err for part in (str(out), "first", "--overwrite"))
    assert files(out) == before


def test_overwrite_replaces_and_removes_what_only_the_old_result_had(tmp_path, out):
    (out / "notes.txt").write_text("mine", encoding="utf-8")
    assert (out / "weights.json").exists()
    run = quadstep("fly", write(tmp_path, NESTED, "other.toml"), "--out", out, "--overwrite")
    assert run.code == 0
    assert set(files(out)) == {"flight.csv", "metrics.json", "notes.txt", "page.html", "report.html"}
    assert files(out)["notes.txt"] == b"mine"


@pytest.mark.parametrize("manifest", ["campaign.json", "rare.json", "export.json"])
def test_results_of_another_kind_are_not_replaced(tmp_path, manifest):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / manifest).write_text("{}", encoding="utf-8")
    run = quadstep("fly", write(tmp_path, LINE), "--out", tmp_path / "out", "--overwrite")
    assert run.refused
    assert f"{tmp_path / 'out'}: holds " in run.err
    assert set(files(tmp_path / "out")) == {manifest}


def test_an_exported_law_does_not_replace_a_flight(tmp_path, out):
    before = files(out)
    run = quadstep("export", write(tmp_path, LINE), "--out", out, "--overwrite")
    assert run.refused
    assert f"{out}: holds results of another kind; choose another --out" in run.err
    assert files(out) == before


def test_a_folder_with_other_files_is_refused(tmp_path):
    out = tmp_path / "home"
    out.mkdir()
    (out / "thesis.tex").write_text("years of work", encoding="utf-8")
    run = quadstep("fly", write(tmp_path, LINE), "--out", out)
    assert run.refused
    assert str(out) in run.err
    assert set(files(out)) == {"thesis.tex"}


def test_an_empty_folder_is_used(tmp_path):
    (tmp_path / "out").mkdir()
    assert quadstep("fly", write(tmp_path, LINE), "--out", tmp_path / "out").code == 0


FOREIGN = ["", "null", "[]", "{", '{"files": null}', '{"files": 5}', '{"files": [1, null]}', '{"name": 3, "fingerprint": []}']


@pytest.mark.parametrize("content", FOREIGN)
def test_a_foreign_metrics_json_is_refused_and_with_overwrite_replaced(tmp_path, content):
    out = tmp_path / "out"
    out.mkdir()
    (out / "metrics.json").write_text(content, encoding="utf-8")
    mission = write(tmp_path, LINE)
    assert quadstep("fly", mission, "--out", out).refused
    assert files(out) == {"metrics.json": content.encode()}
    assert quadstep("fly", mission, "--out", out, "--overwrite").code == 0
    assert set(files(out)) == {"flight.csv", "metrics.json", "page.html", "report.html", "weights.json"}


PLACES = ["file", "file/out", "file/deep/out", "/proc/nowhere/out", "/proc/out", "x" * 300, "new/deep/" + "x" * 300]


@pytest.mark.parametrize("place", PLACES)
def test_a_folder_that_cannot_be_written_is_one_line_and_nothing_is_left(tmp_path, place):
    mission = write(tmp_path, LINE)
    (tmp_path / "file").write_text("here first", encoding="utf-8")
    run = quadstep("fly", mission, "--out", tmp_path / place)  # an absolute place stays absolute
    assert run.refused
    assert str(tmp_path / place) in run.err
    assert files(tmp_path) == {"mission.toml": LINE.encode(), "file": b"here first"}
    assert {path.name for path in tmp_path.iterdir()} == {"mission.toml", "file"}


def test_a_folder_with_something_in_the_way_is_refused_before_any_file_is_moved(tmp_path):
    out = tmp_path / "out"
    (out / "metrics.json").mkdir(parents=True)
    run = quadstep("fly", write(tmp_path, LINE), "--out", out, "--overwrite")
    assert run.refused
    assert files(out) == {}


def test_reproduce_refuses_the_same_places(tmp_path):
    (tmp_path / "file").touch()
    for place in ("file", "file/out"):
        assert quadstep("reproduce", "--out", tmp_path / place).refused
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "thesis.tex").touch()
    assert quadstep("reproduce", "--out", tmp_path / "full").refused
    assert {path.relative_to(tmp_path).as_posix() for path in Path(tmp_path).rglob("*")} == {"file", "full", "full/thesis.tex"}


def test_a_failure_while_writing_leaves_nothing(tmp_path, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("quadstep.studies.fly.write_log", full)
    run = quadstep("fly", write(tmp_path, LINE), "--out", tmp_path / "new" / "out")
    assert run.refused
    assert "No space left on device" in run.err
    assert {path.name for path in tmp_path.iterdir()} == {"mission.toml"}


def test_a_failure_while_writing_leaves_the_old_result(tmp_path, out, monkeypatch):
    def broken(*_):
        raise KeyboardInterrupt

    before = files(out)
    monkeypatch.setattr("quadstep.studies.fly.write_log", broken)
    run = quadstep("fly", write(tmp_path, OTHER, "other.toml"), "--out", out, "--overwrite")
    assert run.code == 130
    assert files(out) == before
    assert not list(out.glob(".*"))
