"""Compiled code kept between runs: used when intact, replaced when damaged, skipped when it cannot be written."""

import ctypes
import gc
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest
from llvmlite import binding as llvm

import quadstep
from quadstep.control import nested_saturation
from quadstep.engines import kernel
from quadstep.engines.gpu_sweep import program
from quadstep.engines.kernel import MOST, Kernel, Kernels, Trace, fly_lanes, host, object_code
from quadstep.engines.scored import scored
from quadstep.engines.sweep import Sweep
from quadstep.engines.wasm import sweep_module
from quadstep.interfaces.closed_loop import Ticks
from quadstep.io import code_cache
from quadstep.io.code_identity import described
from quadstep.io.places import Place
from quadstep.io.user_code import load
from quadstep.own import Command
from quadstep.page.laws import emit
from tests.flights import NESTED, nested_gains, parameters, state
from tests.needs import SUPERUSER, needs

TICKS = Ticks(0.004, (1,), 5, 100)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("QUADSTEP_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture
def fly(monkeypatch):
    """A flight by a process that has compiled nothing yet."""

    def fresh():
        monkeypatch.setattr(kernel, "KERNELS", Kernels())
        return fly_lanes(NESTED, [parameters(gains=nested_gains())], [state()], TICKS)[0].rows

    return fresh


@pytest.fixture(autouse=True)
def nothing_warned_of(monkeypatch):
    monkeypatch.setattr(code_cache, "warned", set())


def entries(folder):
    return sorted(path for path in folder.iterdir() if path.is_file())


A_NAME = 32 + 64
"""Bytes of an entry that holds the name of another."""


def compiled(folder):
    """The entries that hold code."""
    return [path for path in entries(folder) if path.stat().st_size > A_NAME]


def test_code_is_kept_and_used_again(folder, fly, monkeypatch):
    first = fly()
    assert len(compiled(folder)) == 1
    monkeypatch.setattr(code_cache, "write", lambda *_: pytest.fail("compiled again"))
    np.testing.assert_array_equal(fly(), first)


def test_known_code_is_found_without_writing_its_module_unless_that_is_gone(folder, fly, monkeypatch):
    first = fly()
    monkeypatch.setattr(kernel, "Trace", traced := Mock(side_effect=Trace))
    np.testing.assert_array_equal(fly(), first)
    assert traced.call_count == 0
    compiled(folder)[0].unlink()
    np.testing.assert_array_equal(fly(), first)
    assert traced.call_count == 1


def test_a_module_is_written_where_the_package_changed_and_its_code_is_found_if_it_says_the_same(folder, fly, monkeypatch):
    first = fly()
    monkeypatch.setattr(kernel, "source_digest", Mock(return_value="of another version"))
    monkeypatch.setattr(kernel, "Trace", traced := Mock(side_effect=Trace))
    np.testing.assert_array_equal(fly(), first)
    assert (traced.call_count, len(compiled(folder))) == (1, 1)


def test_code_of_a_law_that_was_replaced_in_memory_is_not_taken_from_the_cache(folder, fly, monkeypatch):
    first = fly()
    with monkeypatch.context() as patched:
        patched.setattr(nested_saturation, "nested", lambda *given: 0.0)
        assert not kernel.structure(NESTED)
        assert np.abs(fly() - first).max() > 0.0
    np.testing.assert_array_equal(fly(), first)
    name = kernel.structure(NESTED)
    monkeypatch.setattr(nested_saturation, "SOME", 2.0, raising=False)
    assert kernel.structure(NESTED) not in ("", name)


def test_what_decides_the_code_of_a_loop_of_the_users_own_is_not_told():
    @dataclass(frozen=True)
    class Mine(type(NESTED.controller)):
        pass

    assert described(NESTED)
    assert not described(replace(NESTED, controller=Mine()))
    assert not described((NESTED, lambda t: t))
    assert not described(np.zeros(2000))  # abridged
    assert not described((np.array([0.1, 0.2]),))  # rounded
    assert not described((NESTED, Mine))
    names = {kernel.structure(NESTED, *rest) for rest in ((), (4,), (8,), ((4,),))}
    assert len(names) == 4


LAW = """
from dataclasses import dataclass
from typing import NamedTuple

import helper
from helper import PULL, damping
from quadstep.own import Command, Controller, Vector, believed, up_axis, rotation_matrix, vector


class Gains(NamedTuple):
    mass: float = believed("mass")
    inertia: Vector = believed("inertia")


def outer():
    stiffness = 6.0

    def inner(error):
        return stiffness * error

    return inner


pull = outer()
OTHER = 1.0


@dataclass(frozen=True, slots=True)
class Scale:
    value: float


@dataclass(frozen=True)
class Law(Controller):
    name = "a law"
    Gains = Gains
    SOME = 1.0
    scale: Scale = Scale(1.0)
    kind: type = Scale

    def start(self, measured, gains):
        return ()

    def law(self, memory, measured, reference, gains, t, period):
        force = pull(reference.position - measured.position) - damping(measured.velocity) + vector(0.0, 0.0, 9.81)
        force = gains.mass * force * (self.SOME * self.scale.value * OTHER * PULL[0] * helper.KNOWN)
        return Command(thrust=force @ up_axis(rotation_matrix(measured.attitude)), torque=-18.0 * measured.rates), memory
"""
MISSION = """
vehicle = { preset = "x500" }
path = { type = "step", end = [0.2, 0.0, 0.3], time = 0.01, duration = 0.1 }
controller = { type = "law.py:Law" }
"""
HELPER = """
PULL = {0: 1.0}
KNOWN = 1.0


def damping(velocity):
    return 4.0 * velocity
"""


def stand_still(self, memory, measured, reference, gains, t, period):
    return Command(thrust=9.81 * gains.mass, torque=-18.0 * measured.rates), memory


def less(velocity):
    return 2.0 * velocity


REPLACED = {
    "a method": lambda law, known, patch: patch.setattr(law, "law", stand_still),
    "the code of a method": lambda law, known, patch: patch.setattr(law.law, "__code__", stand_still.__code__),
    "the code of a function": lambda law, known, patch: patch.setattr(known["damping"], "__code__", less.__code__),
    "a function of its module": lambda law, known, patch: patch.setitem(known, "damping", less),
    "a value in a closure": lambda law, known, patch: patch.setattr(known["pull"].__closure__[0], "cell_contents", 3.0),
    "an attribute of its class": lambda law, known, patch: patch.setattr(law, "SOME", 1.1),
    "a name of its module": lambda law, known, patch: patch.setitem(known, "OTHER", 1.1),
    "an entry of a dict": lambda law, known, patch: patch.setitem(known["PULL"], 0, 1.1),
    "a name in another module": lambda law, known, patch: patch.setattr(known["helper"], "KNOWN", 1.1),
}


@pytest.fixture(scope="module")
def notebook(tmp_path_factory):
    """The law of a file, how a mission with it is flown and written, and what comes of that before anything is replaced."""
    folder = tmp_path_factory.mktemp("notebook")
    for name, text in (("law.py", LAW), ("helper.py", HELPER), ("mission.toml", MISSION)):
        (folder / name).write_text(text)
    law = load(Place("law.py", "Law"), folder)
    plan = quadstep.read_mission(folder / "mission.toml").plan()
    scored_loop, clock = scored(plan.loop, plan.ticks, 0.01)

    def flown():
        swept = Sweep(scored_loop, clock, plan.start, plan.parameters, (), True).fly(np.zeros((1, 0)))
        return quadstep.fly(plan).rows, swept.metrics

    def written():  # for the page, for its failure rate, for a graphics processor
        known = scored_loop, plan.start, plan.parameters, frozenset[int](), True
        return [emit(plan.loop, plan.parameters, plan.start).text, sweep_module(*known), program(*known)]

    first, texts = flown(), written()
    assert written() == texts
    return law, plan, flown, written, first, texts


@pytest.mark.parametrize("what", REPLACED)
def test_what_a_notebook_replaces_in_memory_flies_from_then_on(notebook, monkeypatch, what):
    law, plan, flown, written, first, texts = notebook
    monkeypatch.setattr("quadstep.engines.kernel.compile_module", made := Mock(side_effect=kernel.compile_module))
    np.testing.assert_array_equal(flown()[0], first[0])
    assert made.call_count == 0
    with monkeypatch.context() as patch:
        REPLACED[what](law, vars(sys.modules[law.__module__]), patch)
        rows, metrics = flown()
        np.testing.assert_array_equal(rows, quadstep.fly(plan, "python").rows)
        assert (rows != first[0]).any()
        assert (metrics != first[1]).any()
        assert not any(new == old for new, old in zip(written(), texts, strict=True))
    np.testing.assert_array_equal(flown()[0], first[0])


def test_a_function_of_the_package_that_a_user_replaces_flies_from_then_on(monkeypatch):
    def fly():
        return fly_lanes(NESTED, [parameters(gains=nested_gains())], [state()], TICKS)[0].rows

    first, law = fly(), type(NESTED.controller)
    whole = law.law

    def slower(*given):
        command, memory = whole(*given)
        return command._replace(thrust=0.9 * command.thrust), memory

    for holder, name, other in ((nested_saturation, "nested", lambda *_: 0.0), (law, "law", slower)):
        with monkeypatch.context() as patched:
            patched.setattr(holder, name, other)
            assert np.abs(fly() - first).max() > 0.0
        np.testing.assert_array_equal(fly(), first)


@pytest.mark.parametrize("damage", [
    lambda content: b"",
    lambda content: content[:20],
    lambda content: content[:-100],
    lambda content: content[:50] + bytes([content[50] ^ 1]) + content[51:],
    lambda content: b"\0" * len(content),
    lambda content: content + b"more",
], ids=["empty", "cut in the digest", "cut", "one bit", "zeros", "longer"])  # fmt: skip
def test_a_damaged_entry_is_compiled_again_and_replaced(folder, fly, damage):
    first = fly()
    kept = entries(folder)
    for entry in kept:
        sound = entry.read_bytes()
        entry.write_bytes(damage(sound))
        np.testing.assert_array_equal(fly(), first)
        assert entries(folder) == kept
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

    monkeypatch.setattr("quadstep.io.files.replace_in", refuse)
    assert len(fly()) == 21
    assert entries(folder) == []


def test_only_so_many_entries_are_kept_the_oldest_go(folder, monkeypatch):
    monkeypatch.setattr(code_cache, "MOST_ENTRIES", 8)
    for number in range(code_cache.MOST_ENTRIES + 5):
        name = f"{number:064d}"
        code_cache.write(name, b"code")
        os.utime(folder / name, (number, number)) if (folder / name).exists() else None
    names = [path.name for path in entries(folder)]
    assert len(names) == 7 * code_cache.MOST_ENTRIES // 8
    assert f"{code_cache.MOST_ENTRIES + 4:064d}" in names
    assert f"{0:064d}" not in names


def test_what_is_used_is_kept_however_old(folder, monkeypatch):
    monkeypatch.setattr(code_cache, "MOST_ENTRIES", 8)
    for number in range(code_cache.MOST_ENTRIES):
        code_cache.write(f"{number:064d}", b"code")
        os.utime(folder / f"{number:064d}", (number, number))
    assert code_cache.read(f"{0:064d}") == b"code"
    code_cache.write("a" * 64, b"code")
    names = [path.name for path in entries(folder)]
    assert f"{0:064d}" in names
    assert f"{1:064d}" not in names


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


def test_a_relative_cache_folder_is_ignored(monkeypatch, tmp_path):
    monkeypatch.delenv("QUADSTEP_CACHE", raising=False)
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("XDG_CACHE_HOME", "caches")
    assert code_cache.folder() == tmp_path / ".cache" / "quadstep"


def test_without_a_home_nothing_is_kept_and_nothing_said(fly, monkeypatch, caplog):
    def homeless(_path):
        raise RuntimeError("Could not determine home directory.")

    for name in ("QUADSTEP_CACHE", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(code_cache.Path, "expanduser", homeless)
    assert code_cache.folder() is None
    assert len(fly()) == 21
    assert caplog.messages == []


# Code that another user could have written is not run


@pytest.mark.parametrize(("above", "mode", "who"), [
    (False, 0o770, "its group"),
    (False, 0o777, "all users"),
    (False, 0o1777, "all users"),
    (True, 0o770, "its group"),
    (True, 0o777, "all users"),
])  # fmt: skip
def test_a_folder_that_others_may_write_is_not_used(folder, fly, caplog, above, mode, who):
    first = fly()
    kept = [path.read_bytes() for path in entries(folder)]
    opened = folder.parent if above else folder
    opened.chmod(mode)
    assert [code_cache.read(path.name) for path in entries(folder)] == [None] * len(kept)
    code_cache.write("a" * 64, b"code")
    np.testing.assert_array_equal(fly(), first)
    assert [path.read_bytes() for path in entries(folder)] == kept
    (line,) = caplog.messages
    assert f"{opened} may be written by {who}, who could plant code" in line
    assert f"`chmod go-w {opened}` or set QUADSTEP_CACHE" in line


def test_a_folder_of_ones_own_below_one_like_tmp_is_used(folder):
    code_cache.write("a" * 64, b"code")
    folder.parent.chmod(0o1777)
    assert code_cache.read("a" * 64) == b"code"


def test_an_entry_that_others_may_write_is_not_used(folder):
    code_cache.write("a" * 64, b"code")
    (entry,) = entries(folder)
    assert entry.stat().st_mode & 0o777 == 0o600
    entry.chmod(0o620)
    assert code_cache.read("a" * 64) is None
    code_cache.write("a" * 64, b"code")
    assert code_cache.read("a" * 64) == b"code"


@pytest.mark.parametrize("kind", ["link", "pipe", "folder"])
def test_an_entry_that_is_no_plain_file_is_not_used(folder, tmp_path, kind):
    code_cache.write("a" * 64, b"code")
    (entry,) = entries(folder)
    entry.rename(tmp_path / "elsewhere")
    {"link": lambda: entry.symlink_to(tmp_path / "elsewhere"), "pipe": lambda: os.mkfifo(entry), "folder": entry.mkdir}[kind]()
    assert code_cache.read("a" * 64) is None


def test_an_entry_under_the_name_of_another_is_not_used(folder):
    code_cache.write("a" * 64, b"code")
    (folder / ("a" * 64)).rename(folder / ("b" * 64))
    assert code_cache.read("b" * 64) is None


def test_folders_are_made_for_this_user_alone_whatever_the_umask(tmp_path, monkeypatch):
    before = os.umask(0)
    try:
        monkeypatch.setenv("QUADSTEP_CACHE", str(tmp_path / "new" / "cache"))
        code_cache.write("a" * 64, b"code")
    finally:
        os.umask(before)
    assert code_cache.read("a" * 64) == b"code"
    assert [path.stat().st_mode & 0o777 for path in (tmp_path / "new", tmp_path / "new" / "cache")] == [0o700, 0o700]


def test_a_link_is_judged_by_what_it_leads_to(tmp_path, monkeypatch, caplog):
    (tmp_path / "open").mkdir()
    (tmp_path / "open").chmod(0o777)
    (tmp_path / "link").symlink_to(tmp_path / "open")
    monkeypatch.setenv("QUADSTEP_CACHE", str(tmp_path / "link"))
    code_cache.write("a" * 64, b"code")
    assert entries(tmp_path / "open") == []
    assert str(tmp_path / "open") in caplog.messages[0]


SOMEONE = 12345
"""A user's id; nobody need have it."""


def planted(path, content):
    """Another user writes a file."""
    subprocess.run(
        ["/bin/sh", "-c", 'cat >"$1"', "sh", path], input=content, user=SOMEONE, group=SOMEONE, extra_groups=[], check=True
    )


@pytest.fixture
def within_reach(monkeypatch):
    """A folder for code that any user can reach and write to."""
    with tempfile.TemporaryDirectory(dir="/tmp") as top:
        Path(top).chmod(0o755)
        cache = Path(top) / "cache"
        cache.mkdir()
        cache.chmod(0o777)
        monkeypatch.setenv("QUADSTEP_CACHE", str(cache))
        yield cache


@needs(SUPERUSER)
@pytest.mark.parametrize("mode", [0o777, 0o755], ids=["still open", "closed since"])
def test_code_planted_by_another_user_is_not_run(within_reach, mode):
    name = "a" * 64
    planted(within_reach / name, code_cache.signature(name, b"theirs") + b"theirs")  # sound: only its owner tells
    within_reach.chmod(mode)
    assert (within_reach / name).stat().st_uid == SOMEONE
    assert code_cache.read(name) is None
    code_cache.write(name, b"ours")
    assert code_cache.read(name) == (b"ours" if mode == 0o755 else None)


@needs(SUPERUSER)
@pytest.mark.parametrize("above", [False, True], ids=["the folder", "the one above"])
def test_a_folder_of_another_user_is_not_used(within_reach, caplog, above):
    within_reach.chmod(0o755)
    code_cache.write("a" * 64, b"code")
    assert code_cache.read("a" * 64) == b"code"
    theirs = within_reach.parent if above else within_reach
    os.chown(theirs, SOMEONE, SOMEONE)
    assert code_cache.read("a" * 64) is None
    (line,) = caplog.messages
    assert (
        f"{theirs} belongs to another user (id {SOMEONE}), who could plant code that you would run; set QUADSTEP_CACHE" in line
    )


@needs(SUPERUSER)
def test_what_root_keeps_may_be_read_by_all(within_reach):
    within_reach.chmod(0o755)
    code_cache.write("a" * 64, b"code")
    (within_reach / ("a" * 64)).chmod(0o644)
    os.seteuid(SOMEONE)
    try:
        assert code_cache.read("a" * 64) == b"code"
        code_cache.write("b" * 64, b"code")  # may not be written: no error
        assert code_cache.read("b" * 64) is None
    finally:
        os.seteuid(0)


def test_the_kernels_of_a_process_are_bounded_and_the_one_unused_for_longest_goes():
    made = []

    def kernel(name):
        return kernels.get_or_make(name, lambda: made.append(name) or Kernel(None, name))

    kernels = Kernels()
    for name in range(MOST):
        assert kernel(name).fly == name
    kernel(0)
    kernel(MOST)
    assert len(kernels) == MOST
    assert (0 in kernels, 1 in kernels) == (True, False)
    assert made == list(range(MOST + 1))


class Allocated(ctypes.Structure):
    """The C library's count of its memory, in bytes."""

    NAMES = "arena ordblks smblks hblks hblkhd usmblks fsmblks uordblks fordblks keepcost"
    _fields_ = [(name, ctypes.c_size_t) for name in NAMES.split()]


@pytest.mark.skipif(not hasattr(ctypes.CDLL(None), "mallinfo2"), reason="this C library does not count its memory")
def test_compiling_leaves_no_memory_behind():
    count = ctypes.CDLL(None).mallinfo2
    count.restype = Allocated

    def held():
        gc.collect()
        return count().uordblks + count().hblkhd

    steps = "\n".join(f"%x{at + 1} = fadd double %x{at}, %x{at // 2}" for at in range(300))
    text = f"define double @f(double %x0) {{\n{steps}\nret double %x300\n}}"
    cpu, features, _ = host()
    target = llvm.Target.from_default_triple().create_target_machine(cpu=cpu, features=features, opt=3, jit=True)
    object_code(text, target)
    before = held()
    for _ in range(3):
        object_code(text, target)
    assert held() - before < 20_000
