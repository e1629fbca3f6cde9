"""The folder of a campaign: what is written, resumed, found corrupted, and refused."""

import errno
import os
import shutil
from contextlib import contextmanager

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from quadstep import __version__
from quadstep.io import results_folder as folder_module
from quadstep.io.errors import UserError
from quadstep.io.parts import sealed
from quadstep.studies.campaign import draws
from quadstep.studies.campaign.store import opened, parquet
from tests.campaigns import MASS, campaign, flights, fly, leftovers, manifest, refused, rows, written
from tests.commands import quadstep

pytestmark = pytest.mark.usefixtures("no_figures", "ungraded")

HEAD = "chunk = 16\nflights = 40\n"


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A campaign of three files, flown to its end: (its file, its folder)."""
    folder = tmp_path_factory.mktemp("whole")
    path = written(folder, MASS, head=HEAD)
    run = fly(path, folder / "out")
    assert (run.code, run.err) == (0, "")
    return path, folder / "out"


@pytest.fixture
def flown(whole, tmp_path):
    """A copy of it to be spoilt."""
    path, out = whole
    for name in ("camp.toml", "mission.toml"):
        shutil.copy(path.parent / name, tmp_path / name)
    shutil.copytree(out, tmp_path / "out")
    return tmp_path / "camp.toml", tmp_path / "out"


@contextmanager
def store(folder, resume=False, overwrite=False, count=40, **more):
    with opened(folder / "out", campaign(folder, MASS, head=HEAD, **more), count, "lanes", resume, overwrite) as one:
        yield one


def fake(chunk):
    """A table that no flight gave."""
    return pa.table({"flight": pa.array(np.arange(chunk.first, chunk.past))})


# What is written


def test_the_folder_has_the_flights_in_chunks_and_a_manifest_that_names_them(whole):
    path, out = whole
    assert {name.relative_to(out).as_posix() for name in out.rglob("*") if name.is_file()} >= {
        "campaign.json", *(f"flights/0000{i}.parquet" for i in range(3))}  # fmt: skip
    about = manifest(out)
    assert [(one["first"], one["past"]) for one in about["chunks"]] == [(0, 16), (16, 32), (32, 40)]
    assert about["complete"] is True
    assert (about["flights"], about["chunk"], about["seed"], about["version"]) == (40, 16, 1, __version__)
    assert about["campaign"] == path.read_text(encoding="utf-8")
    assert about["mission"]["path"]["duration"] == 0.4
    assert about["packages"].keys() >= {"numpy", "llvmlite", "pyarrow"}
    assert all(one["processor"] and one["python"] for one in about["machines"])
    assert not leftovers(out)
    for i, one in enumerate(about["chunks"]):
        assert pq.read_table(out / f"flights/0000{i}.parquet")["flight"].to_pylist() == list(range(one["first"], one["past"]))
    assert rows(out)["flight"].to_pylist() == list(range(40))


def test_the_same_campaign_again_is_the_same_to_the_byte(whole, tmp_path):
    path, out = whole
    assert fly(path, tmp_path / "again").code == 0
    assert flights(tmp_path / "again") == flights(out)
    assert (tmp_path / "again" / "campaign.json").read_bytes() == (out / "campaign.json").read_bytes()


def test_a_chunk_counts_once_the_manifest_names_it(tmp_path):
    with store(tmp_path) as one:
        first, second, third = one.chunks
        one.write(second, fake(second))
        assert one.missing == [first, third]
        assert one.has(second)
    with store(tmp_path, resume=True) as one:
        assert one.missing == [first, third]
        assert one.read(["flight"])["flight"].to_pylist() == list(range(16, 32))
        (tmp_path / "out" / first.file).write_bytes(parquet(fake(first)))  # killed before the manifest named it
        assert one.missing == [first, third]


# Going on


def test_a_complete_campaign_is_left_as_it_is(flown):
    path, out = flown
    before, about = flights(out), (out / "campaign.json").read_bytes()
    run = fly(path, out, "--resume")
    assert run.code == 0
    assert "40 flights" in run.out
    assert flights(out) == before
    assert (out / "campaign.json").read_bytes() == about


@pytest.mark.parametrize("lost", [[0], [1], [2], [0, 2], [0, 1, 2]])
def test_chunks_that_are_gone_are_flown_again_to_the_same_content(flown, lost):
    path, out = flown
    before = flights(out)
    for i in lost:
        (out / f"flights/0000{i}.parquet").unlink()
    assert fly(path, out, "--resume").code == 0
    assert flights(out) == before


def test_more_flights_than_before(flown, tmp_path):
    path, out = flown
    before = flights(out)
    assert fly(path, out, "--resume", "--flights", 70).code == 0
    after = flights(out)
    assert [after[name] == before[name] for name in sorted(before)] == [True, True, False]
    assert fly(path, tmp_path / "straight", "--flights", 70).code == 0
    assert flights(tmp_path / "straight") == after
    assert manifest(out)["flights"] == 70


def test_fewer_flights_than_before_leave_no_others_in_the_folder(flown, tmp_path):
    path, out = flown
    assert fly(path, out, "--resume", "--flights", 20).code == 0
    assert manifest(out)["flights"] == 20
    assert rows(out)["flight"].to_pylist() == list(range(20))
    assert [one["past"] for one in manifest(out)["chunks"]] == [16, 20]
    assert fly(path, tmp_path / "straight", "--flights", 20).code == 0
    assert flights(tmp_path / "straight") == flights(out)


def test_another_meaning_of_failure_holds_for_all_flights_that_are_there(flown):
    path, out = flown
    (out / "flights/00002.parquet").unlink()
    middle = float(np.median(rows(out)["largest_error[m]"].to_numpy()))
    path.write_text(path.read_text() + f"\n[failure]\nlargest_error = {middle}\n")
    run = fly(path, out, "--resume")
    assert run.code == 0, run.err
    table = rows(out)
    wanted = table["largest_error[m]"].to_numpy() <= middle
    assert table["success"].to_pylist() == wanted.tolist()
    assert manifest(out)["summary"]["success"]["value"] == wanted.mean()


# Corruption


SPOILT = {
    "cut": lambda path: path.write_bytes(path.read_bytes()[:-20]),
    "empty": lambda path: path.write_bytes(b""),
    "longer": lambda path: path.write_bytes(path.read_bytes() + b"x"),
    "another chunk": lambda path: shutil.copy(path.parent / "00000.parquet", path),
    "a folder": lambda path: (path.unlink(), path.mkdir()),
}


@pytest.mark.parametrize("how", SPOILT)
def test_a_corrupted_chunk_is_one_line_that_says_what_to_do_and_doing_it_helps(flown, how):
    path, out = flown
    before, bad = flights(out), out / "flights/00001.parquet"
    SPOILT[how](bad)
    spoilt = {file.name for file in out.rglob("*")}
    line = refused(fly(path, out, "--resume"), bad)
    assert {file.name for file in out.rglob("*")} == spoilt
    if how != "a folder":
        assert "corrupted" in line
        assert "flights 16 to 31" in line
        bad.unlink()
        assert fly(path, out, "--resume").code == 0
        assert flights(out) == before


FOREIGN = {
    "empty": "",
    "null": "null",
    "a list": "[]",
    "cut": '{"name": "Ca',
    "not text": None,
    "deep": "[" * 100_000,
    "another": '{"name": "x", "version": "1"}',
}


@pytest.mark.parametrize("how", FOREIGN)
@pytest.mark.parametrize("more", [[], ["--resume"]])
def test_a_manifest_that_is_none_is_one_line(flown, how, more):
    path, out = flown
    content = b"\xff\xfe\x00" if FOREIGN[how] is None else FOREIGN[how].encode()
    (out / "campaign.json").write_bytes(content)
    before = flights(out)
    refused(fly(path, out, *more), "campaign.json")
    assert flights(out) == before


DOCTORED = {
    "no chunk": {"chunk": 0},
    "chunk below zero": {"chunk": -5},
    "chunk a truth": {"chunk": True},
    "no flights": {"flights": 0},
    "flights below zero": {"flights": -3},
    "another size of chunks": {"chunk": 20},
    "a chunk that is a number": {"chunks": [5]},
    "a chunk without a name": {"chunks": [{"first": 0}]},
    "a chunk of no name": {"chunks": [{"file": ["a"], "first": 0, "past": 16, "sha256": ""}]},
    "a chunk without a digest": {"chunks": [{"file": "flights/00000.parquet", "first": 0, "past": 16}]},
    "machines that are none": {"machines": [5]},
    "files that are none": {"files": 5},
    "metrics that are none": {"metrics": 1.5},
    "metrics without names": {"metrics": [["position_rmse[m]"]]},
    "other metrics": {"metrics": ["energy[J]"]},
    "no version": {"version": None},
    "no name": {"name": None},
}


@pytest.mark.parametrize("how", DOCTORED)
@pytest.mark.parametrize("more", [[], ["--resume"], ["--overwrite"]])
def test_a_doctored_manifest_ends_in_one_line_or_in_the_right_flights(flown, whole, how, more):
    path, out = flown
    (out / "campaign.json").write_bytes(sealed({**manifest(out), **DOCTORED[how]}))
    run = fly(path, out, *more)
    if run.code == 0:
        assert rows(out).sort_by("flight").to_pylist() == rows(whole[1]).to_pylist()
    else:
        refused(run, out)


# Refused


CHANGES = {
    "the campaign": lambda path: path.write_text(path.read_text().replace("0.6", "0.7")),
    "the seed": lambda path: path.write_text("seed = 2\n" + path.read_text()),
    "the size of a chunk": lambda path: path.write_text(path.read_text().replace("chunk = 16", "chunk = 17")),
    "the mission": lambda path: (path.parent / "mission.toml").write_text(
        (path.parent / "mission.toml").read_text().replace("0.1, 0.2", "0.1, 0.3")
    ),
}


@pytest.mark.parametrize("what", CHANGES)
@pytest.mark.parametrize("complete", [True, False])
def test_a_campaign_that_has_changed_is_refused_and_what_was_flown_is_kept(flown, what, complete):
    path, out = flown
    if not complete:
        (out / "flights/00001.parquet").unlink()
    before, about = flights(out), (out / "campaign.json").read_bytes()
    CHANGES[what](path)
    refused(fly(path, out, "--resume"), out, "changed", "--overwrite")
    assert (flights(out), (out / "campaign.json").read_bytes()) == (before, about)
    assert fly(path, out, "--overwrite").code == 0
    assert flights(out) != before
    assert not leftovers(out)


@pytest.mark.parametrize("earlier", [1, None])
def test_a_campaign_of_other_draws_is_neither_gone_on_with_nor_replayed(flown, monkeypatch, earlier):
    path, out = flown
    about = {**manifest(out), "version": "0.0.1", "draws": earlier}
    assert manifest(out)["draws"] == draws.VERSION
    if earlier is None:  # as before there were versions
        del about["draws"]
    (out / "campaign.json").write_bytes(sealed(about))
    said = ("quadstep 0.0.1 (draws version 1)", f"quadstep {__version__} (draws version {draws.VERSION})", "--overwrite")
    refused(fly(path, out, "--resume"), out, "cannot be resumed", *said)
    replayed = ["fly", str(path), "--flight", "3", "--out", str(out.parent / "again")]
    refused(quadstep(*replayed, "--results", str(out)), out, "cannot be replayed", *said)
    monkeypatch.chdir(out.parent)
    out.rename(out.parent / "moved")
    (out.parent / "out").mkdir()
    (out.parent / "moved").rename(out.parent / "out" / path.stem)
    refused(quadstep(*replayed), "cannot be replayed", *said)
    assert not (out.parent / "again").exists()
    path.write_text(path.read_text() + "\n# another campaign\n")
    assert quadstep(*replayed).code == 0


def test_where_a_replayed_campaign_was_flown_is_looked_at_only_where_it_can_be(flown):
    path, out = flown
    replayed = ["fly", str(path), "--flight", "3", "--out", str(out.parent / "again")]
    assert quadstep(*replayed, "--results", str(out)).code == 0
    refused(quadstep(*replayed, "--results", str(out.parent / "nowhere")), "--results", "nowhere", "no campaign")
    refused(quadstep("fly", str(path), "--results", str(out), "--out", str(out.parent / "a")), "--results", "--flight")


def test_another_version_of_the_package_is_refused(flown, monkeypatch):
    path, out = flown
    (out / "campaign.json").write_bytes(sealed({**manifest(out), "version": "0.0.1"}))
    refused(fly(path, out, "--resume"), "0.0.1", __version__)


def test_a_folder_with_a_campaign_is_refused_unless_asked(flown):
    path, out = flown
    before = flights(out)
    refused(fly(path, out), out, "campaign 'camp'", "complete", "--resume", "--overwrite")
    (out / "flights/00001.parquet").unlink()
    refused(fly(path, out), "2 of 3 files")
    assert flights(out) == {name: content for name, content in before.items() if name != "00001.parquet"}


def test_overwriting_removes_what_the_campaign_wrote_and_nothing_else(flown):
    path, out = flown
    (out / "notes.txt").write_text("mine")
    (out / "flights" / "notes.txt").write_text("mine too")
    assert fly(path, out, "--overwrite", "--flights", 20).code == 0
    assert sorted(flights(out)) == ["00000.parquet", "00001.parquet"]
    assert (out / "notes.txt").read_text() == "mine"
    assert (out / "flights" / "notes.txt").read_text() == "mine too"


@pytest.mark.parametrize("more", [[], ["--overwrite"], ["--resume"]])
def test_a_folder_with_other_files_is_refused(tmp_path, more):
    path, out = written(tmp_path, MASS, head=HEAD), tmp_path / "out"
    (out / "flights").mkdir(parents=True)
    (out / "flights" / "00000.parquet").write_text("years of work")
    (out / "thesis.tex").write_text("years of work")
    refused(fly(path, out, *more), out)
    assert {file.name for file in out.rglob("*")} == {"flights", "00000.parquet", "thesis.tex"}


def test_there_must_be_something_to_go_on_with(tmp_path):
    path = written(tmp_path, MASS, head=HEAD)
    refused(fly(path, tmp_path / "out", "--resume"), tmp_path / "out", "no campaign to resume")
    assert not (tmp_path / "out").exists()


def test_an_empty_folder_is_used_and_a_file_is_refused(tmp_path):
    path = written(tmp_path, MASS, head=HEAD)
    (tmp_path / "out").mkdir()
    assert fly(path, tmp_path / "out", "--flights", 5).code == 0
    (tmp_path / "file").write_text("mine")
    for place in ("file", "file/deep", "x" * 300, "/proc/nowhere/out", "/proc/out", "/dev/null", "/dev/null/out"):
        refused(fly(path, tmp_path / place), tmp_path / place)
    assert (tmp_path / "file").read_text() == "mine"


@pytest.mark.parametrize("left", [["flights"], ["flights", ".writing-abc"], [".writing-abc"]])
def test_what_a_run_left_that_was_killed_at_its_very_start_is_in_nobodys_way(tmp_path, left):
    """Made the folder, or was writing the first manifest, when it was killed."""
    path, out = written(tmp_path, MASS, head=HEAD), tmp_path / "out"
    out.mkdir()
    for name in left:
        (out / name).mkdir() if name == "flights" else (out / name).write_bytes(b"half")
    run = fly(path, out)
    assert run.code == 0, run.err
    assert rows(out).num_rows == 40
    assert not leftovers(out)


def test_the_lock_goes_with_an_error(tmp_path):
    with pytest.raises(RuntimeError), store(tmp_path):
        raise RuntimeError
    with store(tmp_path, resume=True) as one, pytest.raises(UserError, match="another run"), store(tmp_path, resume=True):
        pass
    assert len(one.missing) == 3


# A disk that is full


def full_after(count, monkeypatch):
    """Writing fails from the `count`-th file on; gives what says how often it was tried."""
    write, tried = folder_module.replace_in, []

    def fails(folder, name, content, **how):
        tried.append(name)
        if len(tried) > count:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        write(folder, name, content, **how)

    monkeypatch.setattr(folder_module, "replace_in", fails)
    return tried


@pytest.mark.parametrize("count", range(8))
def test_a_full_disk_is_one_line_and_what_was_written_is_kept(whole, tmp_path, monkeypatch, count):
    path, out = whole[0], tmp_path / "out"
    with monkeypatch.context() as patch:
        tried = full_after(count, patch)
        run = fly(path, out)
        if len(tried) <= count:
            assert run.code == 0
            return
        refused(run, out, "No space left on device")
    assert not leftovers(tmp_path)
    kept = flights(out) if out.exists() else {}
    assert kept.items() <= flights(whole[1]).items()
    assert fly(path, out, *(["--resume"] if (out / "campaign.json").exists() else [])).code == 0
    assert flights(out) == flights(whole[1])
