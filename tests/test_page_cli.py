"""`quadstep page`, and the page that `fly` and `reproduce` leave."""

from pathlib import Path

import pytest

from quadstep.commands import serve as commands
from quadstep.io.errors import UserError
from quadstep.page import build
from quadstep.page.build import template
from tests.commands import quadstep
from tests.pages import data_of

MISSION = 'name = "{name}"\n[path]\ntype = "minimum-jerk"\nend = [0.0, 0.0, 1.0]\nduration = 1.0\n{more}'


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def mission(tmp_path):
    path = tmp_path / "mission.toml"
    path.write_text(MISSION.format(name="<script>alert(1)</script>", more=""))
    return path


def test_page_writes_one_file_that_opens_by_itself(tmp_path, mission):
    done = quadstep("page", mission)
    assert (done.code, done.err) == (0, "")
    assert "out/mission.html" in done.out
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["mission.html"]
    text = (tmp_path / "out" / "mission.html").read_text()
    assert len(text) < 3_000_000
    assert "<script>alert(1)" not in text
    assert data_of(text)["flights"][0]["name"] == "<script>alert(1)</script>"
    assert quadstep("page", mission, mission, "--out", "two.html", "--engine", "python").code == 0
    assert len(data_of((tmp_path / "two.html").read_text())["flights"]) == 2
    assert quadstep("page", mission).code == 0  # a page is replaced
    assert "Page: named.html (" in quadstep("page", mission, "--out", "named").out  # a desktop opens it by its ending


def test_page_keeps_other_files_and_says_so_in_one_line(tmp_path, mission):
    for out, words in (
        (mission, "exists and is not a page"),
        (tmp_path, "is a folder"),
        (mission / "x.html", "cannot be written"),
        ("/dev/full", "/dev/full: cannot be written: not a regular file"),
    ):
        done = quadstep("page", mission, "--out", out)
        assert done.code == 2
        assert words in done.err
        assert done.err.count("\n") == 1
    assert "alert" in mission.read_text()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["mission.toml"]


@pytest.mark.parametrize(
    ("text", "words"),
    [("[path]\n", "path.type"), ("name = [", "not valid TOML"), (MISSION.format(name="x", more="bogus = 1"), "bogus")],
)
def test_a_mission_that_is_none_is_one_line(tmp_path, text, words):
    (tmp_path / "bad.toml").write_text(text)
    done = quadstep("page", "bad.toml")
    assert done.code == 2
    assert words in done.err
    assert "bad.toml" in done.err
    assert done.err.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_a_diverging_mission_is_a_page_too(tmp_path):
    (tmp_path / "lost.toml").write_text(MISSION.format(name="lost", more="[limits]\ndistance = 1e-6"))
    assert quadstep("page", "lost.toml").code == 0
    assert data_of((tmp_path / "out" / "lost.html").read_text())["flights"][0]["outcome"]["code"] == 2


def test_fly_leaves_its_page_beside_the_results(tmp_path, mission):
    assert quadstep("fly", mission).code == 0
    data = data_of((tmp_path / "out" / "mission" / "page.html").read_text())
    assert data["flights"][0]["whyNot"] == ""
    assert '"page.html"' in (tmp_path / "out" / "mission" / "metrics.json").read_text()


@pytest.mark.parametrize(("arguments", "words"), [
    (["serve", "nowhere"], "not a folder"),
    (["serve", ".", "--port", "70000"], "65535"),
    (["serve", ".", "--port", "x"], "--port: should be a whole number, not 'x'"),
])  # fmt: skip
def test_serve_refuses_in_one_line(tmp_path, arguments, words):
    done = quadstep(*arguments)
    assert done.code == 2
    assert words in done.err
    assert done.err.count("\n") == 1


def test_an_installation_without_its_front_end_says_so(tmp_path, monkeypatch):
    monkeypatch.setattr(build, "files", lambda _: tmp_path)
    with pytest.raises(UserError, match="front end"):
        template()


def test_no_browser_is_a_warning(monkeypatch, capsys):
    monkeypatch.setattr(commands.webbrowser, "open", lambda _: False)
    commands.open_in_browser("file:///x.html")
    assert "no browser found; open file:///x.html" in capsys.readouterr().err


def test_the_shipped_front_end_takes_the_data():
    text = template()
    for mark in (build.TITLE, build.DATA, build.LAWS):
        assert text.count(mark) == 1
    page = build.build_page("t", (), [])
    assert data_of(page)["flights"] == []
    assert len(page.encode()) < 2_000_000


def test_the_shipped_front_end_asks_no_network():
    text = template()
    assert "http-equiv" not in text or "http" not in text.split("http-equiv", 1)[1].split(">")[0].replace("http-equiv", "")
    assert not any(f'{attribute}="{scheme}' in text for attribute in ("src", "href") for scheme in ("http:", "https:", "//"))
    assert Path(build.__file__).parent.joinpath("assets", "page.html").stat().st_size < 2_000_000
