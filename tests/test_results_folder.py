"""A run touches nothing outside its folder of results, whatever the folder holds."""

import json
import os
import re
import shutil
from pathlib import Path

import pytest

from quadstep.io.errors import UserError
from quadstep.io.files import JSON
from quadstep.io.parts import parts_in, sealed
from quadstep.io.results_folder import RUNNING, names_in, opened, parts_of
from quadstep.report.evidence import Evidence
from quadstep.report.publish import publishing, write_json
from tests import campaigns
from tests.commands import LINE, quadstep, without_figures, write

WRITTEN = {"flight.csv": "1", "report.html": "2", "figures/a.svg": "3", "figures/b.svg": "4", "metrics.json": "{}"}


def publish(folder, identity="one", overwrite=False, more=()):
    """A run that writes a few files."""
    with publishing(folder, identity, overwrite) as out:
        (out / "figures").mkdir()
        for name, text in {**WRITTEN, **dict(more)}.items():
            (out / name).write_text(text)


def everything(folder):
    """All there is in a folder, and what would show that a file had been written anew."""
    return {
        path.relative_to(folder): (path.lstat().st_ino, path.lstat().st_mtime_ns, path.is_file() and path.read_bytes())
        for path in sorted(folder.rglob("*"))
    }


@pytest.fixture
def victim(tmp_path):
    """Somebody's own files, beside the results."""
    place = tmp_path / "victim"
    place.mkdir()
    (place / "thesis.txt").write_text("precious")
    (place / "figures").mkdir()
    (place / "figures" / "a.svg").write_text("precious too")
    return place


def doctored(folder, *names, manifest="metrics.json"):
    """The manifest of a folder names these files as well."""
    content = json.loads((folder / manifest).read_text())
    (folder / manifest).write_text(json.dumps({**content, "files": [*content["files"], *names]}))


OUTWARDS = {
    "a link to a folder": lambda out, victim: (out / "zz").symlink_to(victim),
    "a relative link": lambda out, victim: (out / "zz").symlink_to(os.path.relpath(victim, out)),
    "a link over a link": lambda out, victim: [(out / "yy").symlink_to(victim), (out / "zz").symlink_to("yy")],
    "a link to a file": lambda out, victim: [(out / "zz").mkdir(), (out / "zz/thesis.txt").symlink_to(victim / "thesis.txt")],
    "a link to the file system": lambda out, _: (out / "zz").symlink_to("/"),
    "nothing": lambda *_: None,
}


@pytest.mark.parametrize("how", OUTWARDS)
@pytest.mark.parametrize(("identity", "overwrite"), [("one", False), ("two", True)])
def test_files_that_a_manifest_names_through_links_stay(tmp_path, victim, how, identity, overwrite):
    out = tmp_path / "out"
    publish(out)
    OUTWARDS[how](out, victim)
    whole = str(victim / "thesis.txt")
    odd = ("", ".", "..", "/", "zz", "figures", 7, None, "a\0b", "\ud800", "x" * 300, "flight.csv/x")
    doctored(
        out,
        "zz/thesis.txt",
        "zz/figures/a.svg",
        f"zz{whole}",
        whole,
        "../victim/thesis.txt",
        "zz/../../victim/thesis.txt",
        *odd,
    )
    before = everything(victim)
    publish(out, identity, overwrite)
    assert everything(victim) == before
    assert {name: (out / name).read_text() for name in WRITTEN if name != "metrics.json"}.items() <= WRITTEN.items()


@pytest.mark.parametrize("name", [*WRITTEN, "figures"])
@pytest.mark.parametrize(("identity", "overwrite"), [("one", False), ("two", True)])
def test_every_name_replaced_by_a_link(tmp_path, victim, name, identity, overwrite):
    out = tmp_path / "out"
    publish(out)
    shutil.rmtree(victim)
    shutil.copytree(out, victim)
    place = out / name
    shutil.rmtree(place) if place.is_dir() else place.unlink()
    place.symlink_to(victim / name)
    before, held = everything(victim), sorted(out.rglob("*"))
    try:
        publish(out, identity, overwrite, more={"figures/c.svg": "5"}.items())
    except UserError as error:
        assert name in ("figures", "metrics.json")
        assert ("figures is not a folder" if name == "figures" else "holds other files") in str(error)
        assert sorted(out.rglob("*")) == held
    else:
        assert not [path for path in out.rglob("*") if path.is_symlink()]
    assert everything(victim) == before


@pytest.mark.parametrize(("old", "new", "said"), [
    ('"fingerprint": "one"', '"fingerprint": "onf"', "holds other results (Flight), says metrics.json; choose"),
    ('"files": [', '"files": {', "holds other files (metrics.json: not valid JSON: line 5"),
])  # fmt: skip
def test_a_manifest_with_a_changed_bit_is_refused_by_its_name(tmp_path, old, new, said):
    out, named = tmp_path / "out", {"metrics.json": '{"name": "Flight"}'}
    publish(out, more=named)
    file = out / "metrics.json"
    file.write_text(file.read_text().replace(old, new))
    with pytest.raises(UserError, match=re.escape(f"{out}: {said}")):
        publish(out, more=named)
    publish(out, overwrite=True, more=named)


def test_a_folder_that_is_replaced_by_a_link_while_a_run_writes(tmp_path, victim):
    out = tmp_path / "out"
    publish(out)
    before = everything(victim)
    with pytest.raises(UserError, match="figures is not a folder"), publishing(out, "one", overwrite=False) as draft:
        write_json(draft / "metrics.json", {})
        (draft / "figures").mkdir()
        (draft / "figures" / "a.svg").write_text("new")
        shutil.rmtree(out / "figures")
        (out / "figures").symlink_to(victim / "figures")
    assert everything(victim) == before
    (out / "figures").unlink()
    with publishing(out, "two", overwrite=True) as draft:
        write_json(draft / "metrics.json", {})
        draft.rename(tmp_path / "elsewhere")
        draft.symlink_to(victim)
    assert everything(victim) == before
    assert [path.name for path in out.iterdir()] == ["metrics.json"]


def test_what_killed_runs_left_is_swept_up_but_not_what_a_run_is_writing(tmp_path, victim):
    out = tmp_path / "out"
    publish(out)
    (out / ".writing-0123456789abcdef" / "figures").mkdir(parents=True)
    (out / ".writing-0123456789abcdef" / "figures" / "a.svg").write_text("half")
    (out / ".writing-0123").write_text("half")
    (out / ".writing-link").symlink_to(victim)
    (out / RUNNING).mkdir()
    before = everything(victim)
    with publishing(out, "one", overwrite=False) as first:
        with publishing(out, "one", overwrite=False) as second:
            write_json(second / "metrics.json", {})
        write_json(first / "metrics.json", {"first": 1})
    assert sorted(path.name for path in out.iterdir()) == [RUNNING, "metrics.json"]
    assert json.loads((out / "metrics.json").read_text())["first"] == 1
    assert everything(victim) == before


# Commands


def test_a_folder_that_somebody_gave_away_deletes_no_file_of_whoever_flies_into_it(tmp_path, victim, monkeypatch):
    without_figures(monkeypatch)
    mission, out = write(tmp_path, LINE), tmp_path / "out"
    assert quadstep("fly", mission, "--out", out).code == 0
    (out / "zz").symlink_to(victim)
    doctored(out, "zz/thesis.txt")
    before = everything(victim)
    for more in ([], ["--overwrite"]):
        assert quadstep("fly", mission, "--out", out, *more).code == 0
        assert everything(victim) == before


def quickly(patch):
    """Reports of one figure each, without what they draw."""

    def drawn(of):
        of.folder.mkdir(exist_ok=True)
        (of.folder / "a.svg").write_text("a")
        return Evidence("", "Campaign", "", (), {})

    patch.setattr("quadstep.studies.campaign.report.evidence", drawn)
    patch.setattr("quadstep.studies.rare.run.draw_levels", lambda path, *_: path.with_suffix(".svg").write_text("<svg></svg>"))


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """A campaign and an estimate, each with the command that flew it."""
    folder = tmp_path_factory.mktemp("flown")
    rare = '[failure]\nposition_rmse = 1e-5\n[rare]\nmethod = "subset"\nflights = 200\nreplicates = 5\nopinions = 0\n'
    file = campaigns.written(folder, campaigns.MASS, head=f"chunk = 16\nflights = 32\n{rare}")
    commands = {"campaign.json": ("campaign", file), "rare.json": ("campaign", file, "--rare")}
    with pytest.MonkeyPatch.context() as patch:
        quickly(patch)
        for name, command in commands.items():
            run = quadstep(*command, "--out", folder / name)
            assert run.code == 0, run.err
    return folder, commands


@pytest.mark.parametrize("manifest", ["campaign.json", "rare.json"])
def test_every_name_of_other_results_replaced_by_a_link(flown, tmp_path, victim, monkeypatch, manifest):
    quickly(monkeypatch)
    folder, commands = flown
    for name in sorted(path.name for path in (folder / manifest).iterdir()):
        for more in ["--overwrite"], ["--resume"]:
            out, target = tmp_path / "out", victim / "results"
            shutil.rmtree(out, ignore_errors=True)
            shutil.copytree(folder / manifest, out)
            (out / "zz").symlink_to(victim)
            with_names = json.loads((out / manifest).read_text())
            listed = [*with_names["files"], "zz/thesis.txt", "../victim/thesis.txt", str(victim / "thesis.txt"), "sub", 5, ""]
            (out / "sub").mkdir(exist_ok=True)
            (out / manifest).write_bytes(sealed({**with_names, "files": listed}))
            shutil.rmtree(target) if target.is_dir() else target.unlink(missing_ok=True)
            (out / name).rename(target)
            (out / name).symlink_to(target)
            before = everything(victim)
            run = quadstep(*commands[manifest], "--out", out, *more)
            assert run.code == 0 or run.refused, run
            assert everything(victim) == before
            assert not list(out.glob(".writing-*"))


def test_the_place_of_parts_is_no_link(tmp_path, victim):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / RUNNING).symlink_to(victim)
    before = everything(victim)
    with pytest.raises(UserError, match=f"{RUNNING} is not a folder"), parts_in(tmp_path / "out"):
        pass
    (tmp_path / "out" / RUNNING).unlink()
    with pytest.raises(UserError, match="gains is not a folder"), parts_in(tmp_path / "out") as parts:
        (tmp_path / "out" / RUNNING / "gains").symlink_to(victim)
        parts.add("gains", "a", b"1")
    assert everything(victim) == before


# The folder itself


@pytest.mark.parametrize("name", ["", ".", "..", "/", "/etc/passwd", "a/../../b", "a\0b", "\ud800"])
def test_names_that_lead_elsewhere(name):
    with pytest.raises(OSError, match="is not the name of a file"):
        parts_of(name)
    assert names_in([name, "a/b", "ü", 5]) == ["a/b", "ü"]


def test_a_folder_writes_reads_and_removes(tmp_path):
    with opened(tmp_path / "a" / "b") as folder:
        folder.write("c/d/e.txt", b"1")
        folder.append("c/d/e.txt", b"2")
        assert (folder.names("c"), folder.files()) == (["d"], ["c/d/e.txt"])
        assert (folder.has("c"), folder.is_folder("c")) == (False, True)
        assert folder.read("c/d/e.txt", JSON) == b"12"
        with pytest.raises(UserError, match="cannot be read: it is a folder"):
            folder.read("c", JSON)
        for nothing in ("c", "c/d", "c/d/e.txt/f", "g"):
            folder.remove(nothing)
        assert folder.files() == ["c/d/e.txt"]
        folder.remove("c/d/e.txt")
        assert folder.names() == []
    assert not (tmp_path / "a").exists()


def test_only_the_folder_of_results_and_single_files_remove_or_replace_anything():
    source = Path(__file__).parent.parent / "src" / "quadstep"
    signs = (
        "rmtree(",
        ".unlink(",
        "os.remove(",
        "os.replace(",
        "os.rename(",
        ".rename(",
        "os.rmdir(",
        ".rmdir(",
        ".symlink_to(",
    )
    found = {
        path.relative_to(source).as_posix()
        for path in source.rglob("*.py")
        if any(sign in path.read_text(encoding="utf-8") for sign in signs)
    }
    temporary = {"report/pool.py"}  # its own, in the place for temporary files
    assert found - temporary == {"io/files.py", "io/results_folder.py", "io/code_cache.py"}
