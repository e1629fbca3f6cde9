"""Compiled code kept between runs: used when sound, replaced when damaged, done without when it cannot be kept."""

import numpy as np
import pytest

from quadstep.flight import code_cache, lanes
from quadstep.flight.closed_loop import Ticks
from quadstep.flight.lanes import fly_lanes
from tests.flights import NESTED, nested_gains, parameters, state

TICKS = Ticks(0.004, (1,), 5, 100)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("QUADSTEP_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture
def fly(monkeypatch):
    """A flight by a process that has compiled nothing yet."""

    def fresh():
        monkeypatch.setattr(lanes, "KERNELS", {})
        return fly_lanes(NESTED, [parameters(gains=nested_gains())], [state()], TICKS)[0].rows

    return fresh


def entries(folder):
    return sorted(path for path in folder.iterdir() if path.is_file())


def test_code_is_kept_and_used_again(folder, fly, monkeypatch):
    first = fly()
    assert len(entries(folder)) == 1
    monkeypatch.setattr(code_cache, "write", lambda *_: pytest.fail("compiled again"))
    np.testing.assert_array_equal(fly(), first)


@pytest.mark.parametrize(
    "damage",
    [
        lambda content: b"",
        lambda content: content[:20],
        lambda content: content[:-100],
        lambda content: content[:500] + bytes([content[500] ^ 1]) + content[501:],
        lambda content: b"\0" * len(content),
        lambda content: content + b"more",
    ],
    ids=["empty", "cut in the digest", "cut", "one bit", "zeros", "longer"],
)
def test_a_damaged_entry_is_compiled_again_and_replaced(folder, fly, damage):
    first = fly()
    (entry,) = entries(folder)
    sound = entry.read_bytes()
    entry.write_bytes(damage(sound))
    np.testing.assert_array_equal(fly(), first)
    assert entries(folder) == [entry]
    assert code_cache.read(entry.name) is not None


def test_a_folder_that_cannot_be_made_is_no_error(tmp_path, fly, monkeypatch):
    first = fly()
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("QUADSTEP_CACHE", str(tmp_path / "file" / "cache"))
    np.testing.assert_array_equal(fly(), first)
    assert (tmp_path / "file").read_text() == "in the way"


def test_a_folder_that_cannot_be_written_is_no_error(folder, fly, monkeypatch):
    def refuse(*_, **__):
        raise PermissionError(13, "read-only")

    monkeypatch.setattr(code_cache.tempfile, "mkstemp", refuse)
    assert len(fly()) == 21
    assert entries(folder) == []


def test_an_interrupted_write_leaves_nothing_behind(folder, monkeypatch):
    def refuse(*_, **__):
        raise OSError(28, "no space left")

    monkeypatch.setattr(code_cache.os, "fdopen", refuse)
    code_cache.write("a" * 64, b"code")
    assert entries(folder) == []
    assert code_cache.read("a" * 64) is None


def test_only_so_many_entries_are_kept_the_oldest_go(folder):
    import os

    for number in range(code_cache.MOST_ENTRIES + 5):
        name = f"{number:064d}"
        code_cache.write(name, b"code")
        os.utime(folder / name, (number, number)) if (folder / name).exists() else None
    names = [path.name for path in entries(folder)]
    assert len(names) == code_cache.MOST_ENTRIES
    assert f"{code_cache.MOST_ENTRIES + 4:064d}" in names
    assert f"{0:064d}" not in names


def test_the_name_of_code_follows_from_all_its_parts():
    names = {code_cache.key(*parts) for parts in (("a", "b"), ("ab", ""), ("a", "c"), ("", "ab"), ("a", "b", ""))}
    assert len(names) == 5
    assert code_cache.key("a", "b") == code_cache.key("a", "b")


def test_the_folder_is_the_chosen_one_or_lies_in_the_users_cache(monkeypatch, tmp_path):
    monkeypatch.setenv("QUADSTEP_CACHE", str(tmp_path))
    assert code_cache.folder() == tmp_path
    monkeypatch.delenv("QUADSTEP_CACHE")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert code_cache.folder() == tmp_path / "quadstep"
