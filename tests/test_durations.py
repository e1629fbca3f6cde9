"""Tests are marked slow by what was measured, and the dearest files come first."""

import json
from pathlib import Path
from types import SimpleNamespace

from tests import conftest, durations


def test_every_test_recorded_as_slow_exists():
    folder = durations.PLACE.parent
    for name in durations.recorded():
        path, *_, function = name.split("::")
        assert f"def {function}(" in (folder / path.removeprefix("tests/")).read_text(encoding="utf-8"), name


def test_the_slowest_case_counts_and_quick_tests_are_left_out(tmp_path, monkeypatch):
    monkeypatch.setattr(durations, "PLACE", tmp_path / "durations.json")
    durations.write({"t.py::kept": 2.0, "t.py::now_quick": 3.0})
    recorder = durations.Recorder()
    for nodeid, *seconds in (("t.py::a[1]", 0.3, 0.4), ("t.py::a[2]", 0.6), ("t.py::b", 0.4), ("t.py::now_quick", 0.1)):
        measured = [(durations.PROPERTY, one) for one in seconds]
        recorder.pytest_runtest_logreport(SimpleNamespace(when="teardown", nodeid=nodeid, user_properties=measured))
    recorder.pytest_sessionfinish(SimpleNamespace(config=SimpleNamespace()))
    assert json.loads(durations.PLACE.read_text(encoding="utf-8")) == {"t.py::a": 0.7, "t.py::kept": 2.0}


def test_files_come_first_that_take_long_or_open_pages(monkeypatch):
    monkeypatch.setattr(durations, "recorded", lambda: {"b.py::test": 4.0})

    def item(file, *fixtures):
        quiet = {"add_marker": lambda _: None, "get_closest_marker": lambda _: None}
        return SimpleNamespace(path=Path(file), nodeid=f"{file}::test", fixturenames=fixtures, **quiet)

    items = [item("a.py"), item("b.py"), item("a.py"), *[item("c.py", "browsers")] * 3, item("d.py", "firefox")]
    conftest.pytest_collection_modifyitems(SimpleNamespace(getoption=lambda _: True), items)
    assert [one.path.name for one in items] == ["c.py", "c.py", "c.py", "b.py", "d.py", "a.py", "a.py"]
