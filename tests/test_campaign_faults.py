"""A campaign that is killed, interrupted, short of disk or not alone: one line, flights are kept, and it can be resumed."""

import ctypes
import gc
import os
import random
import re
import resource
import signal
import subprocess
import sys
import time
from threading import Event, Thread
from types import SimpleNamespace
from weakref import ref

import numpy as np
import pyarrow.parquet as pq
import pytest

from quadstep.engines.sweep import Sweep
from tests.campaigns import (
    MASS,
    SHORT,
    WITHOUT_REPORT,
    ended,
    flights,
    fly,
    leftovers,
    manifest,
    refused,
    rows,
    soon,
    started,
    written,
)  # fmt: skip
from tests.commands import heeding_interrupts
from tests.patience import PATIENCE

LONG = SHORT.replace("duration = 0.4", "duration = 8.0")
VARY = MASS + '"start.position.2" = {type="uniform", low=-0.1, high=0.1}\n'
HEAD = "chunk = 64\nflights = 1024\n"


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A campaign of 16 files that takes a second, flown without a fault: (its file, its folder)."""
    folder = tmp_path_factory.mktemp("whole")
    path = written(folder, VARY, LONG, HEAD)
    assert fly(path, folder / "out").code == 0
    return path, folder / "out"


def wait_for(process, found):
    """Until something is there, or the process is over."""
    deadline = time.monotonic() + PATIENCE
    while not found() and process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.002)


def readable(out):
    """Every file in the folder can be read, whatever happened."""
    for path in (out / "flights").glob("*.parquet"):
        assert pq.read_table(path).num_rows == 64
    return len(flights(out))


def one_line(err, *parts):
    assert re.fullmatch(r"quadstep: [^\n]+\n", err), err
    for part in parts:
        assert str(part) in err
    return err


# Killed


@pytest.mark.parametrize("seed", range(2))
def test_a_campaign_that_is_killed_again_and_again_ends_with_the_same_files(whole, tmp_path, seed):
    path, straight = whole
    out, chance, kept = tmp_path / "out", random.Random(seed), 0
    for attempt in range(2):
        more = ["--resume"] if (out / "campaign.json").exists() else []
        process = started(path, out, *more)
        wanted = kept + chance.randint(0 if attempt else 1, 7)
        wait_for(process, lambda wanted=wanted: out.exists() and len(flights(out)) >= wanted)
        time.sleep(chance.uniform(0.0, 0.08))
        process.kill()
        process.communicate()
        now = readable(out)
        assert now >= kept
        kept = now
    run = fly(path, out, "--resume")
    assert run.code == 0, run.err
    assert flights(out) == flights(straight)
    assert manifest(out) == manifest(straight)
    assert not leftovers(out)


# Interrupted


@pytest.mark.parametrize(("number", "files"), [(signal.SIGINT, 2), (signal.SIGTERM, 0)])
def test_an_interrupted_campaign_says_so_in_one_line_and_goes_on(whole, tmp_path, number, files):
    path, straight = whole
    out = tmp_path / "out"
    process = started(path, out, "--flights", 64 * 500)  # of which 1,024 are flown again: it must not be over too soon
    wait_for(process, lambda: (out / "campaign.json").exists() and len(flights(out)) >= files)
    os.kill(process.pid, number)
    code, said, err = ended(process)
    assert (code, said) == (130, "")
    named = len(manifest(out)["chunks"])
    assert named <= readable(out) <= named + 1 <= 500  # a file that came just before the interrupt is not named yet
    one_line(err, "interrupted", f"{named} of 500 files", out, "--resume")
    assert not leftovers(out)
    assert fly(path, out, "--resume").code == 0
    assert flights(out) == flights(straight)


def test_ctrl_c_while_a_thread_starts_leaves_it_the_memory_that_it_writes_to(monkeypatch):
    """Nobody waits for that thread; with its buffers gone it once wrote over what the allocator kept there, which aborts."""
    start, zeros, made, over, alive = Thread.start, np.zeros, [], Event(), []

    def zeros_noted(*shape, **more):
        found = zeros(*shape, **more)
        made.append(ref(found))
        return found

    def fly(*_):
        over.wait(10.0)
        alive.append(made[0]() is not None)

    monkeypatch.setattr(Thread, "start", lambda self: (start(self), interrupted()))
    monkeypatch.setattr("quadstep.engines.sweep.np.zeros", zeros_noted)
    sweep, one = object.__new__(Sweep), np.ones((1, 8))
    sweep.width, sweep.row_count, sweep.number, sweep.ticks = 8, 2, np.float64, SimpleNamespace(last=10, step=0.1)
    sweep.every = sweep.constants = sweep.tables = one
    sweep.rows, sweep.columns = lambda values: values, lambda *_: one
    sweep.portions, sweep.kernel = lambda _: iter([(0, 8)]), SimpleNamespace(fly=fly)
    with pytest.raises(KeyboardInterrupt):
        sweep.fly(zeros((8, 1)), threads=1)
    gc.collect()
    over.set()
    assert soon(lambda: alive)
    assert alive == [True]


def interrupted():
    raise KeyboardInterrupt


# A disk that is full


def small_files(limit):
    """No file may grow beyond this many bytes; as a full disk, but of one process."""

    def set_up():
        heeding_interrupts()
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

    return set_up


@pytest.mark.parametrize("beyond", [-1000, 300])
def test_a_file_that_cannot_grow_is_one_line_and_the_campaign_goes_on_afterwards(whole, tmp_path, beyond):
    """The manifest is made the largest file by a long remark, and grows with every chunk."""
    path, out = written(tmp_path, VARY, LONG, HEAD + "# " + 100_000 * "x" + "\n"), tmp_path / "out"
    assert fly(path, tmp_path / "first", "--flights", 64).code == 0
    size = len((tmp_path / "first" / "campaign.json").read_bytes())
    assert all(len(content) < size for content in flights(tmp_path / "first").values())
    code, said, err = ended(started(path, out, before=small_files(size + beyond)))
    assert (code, said) == (2, "")
    kept = readable(out) if (out / "flights").exists() else 0
    one_line(err, "error", out, "File too large", *["--resume"] * bool(kept))
    assert kept < 16
    assert kept > 0 or beyond < 0
    assert not leftovers(out)
    assert fly(path, out, *(["--resume"] if (out / "campaign.json").exists() else [])).code == 0
    assert flights(out) == flights(whole[1])


# Not alone, or not allowed


def test_two_campaigns_at_once_in_one_folder(whole, tmp_path):
    path, straight = whole
    out = tmp_path / "out"
    first = started(path, out)
    try:
        wait_for(first, lambda: len(flights(out)) >= 1 if out.exists() else False)
        for more in ([], ["--resume"], ["--overwrite"]):
            refused(fly(path, out, *more), out, "another run is writing into this folder")
        assert first.poll() is None
    finally:
        code, _, err = ended(first)
    assert (code, err) == (0, "")
    assert flights(out) == flights(straight)


def as_anybody():
    """Without the right to do anything, should the tests be run by who has it."""
    heeding_interrupts()
    drop_capability = 24  # PR_CAPBSET_DROP
    for override in (1, 2):  # CAP_DAC_OVERRIDE, CAP_DAC_READ_SEARCH
        ctypes.CDLL(None).prctl(drop_capability, override)


@pytest.mark.parametrize("what", ["folder", "folder above", "flights", "chunk"])
def test_a_folder_that_may_not_be_written_is_one_line(tmp_path, what):
    path, out = written(tmp_path, MASS, head="chunk = 16\nflights = 40"), tmp_path / "place" / "out"
    (tmp_path / "place").mkdir()
    more = []
    if what != "folder above":
        assert fly(path, out).code == 0
        (out / "flights/00001.parquet").unlink()
        more = ["--resume"]
    closed = {"folder above": out.parent, "flights": out / "flights", "chunk": out / "flights/00000.parquet"}.get(what, out)
    closed.chmod(0o000 if what == "chunk" else 0o555)
    try:
        code, said, err = ended(started(path, out, *more, before=as_anybody))
    finally:
        closed.chmod(0o755)
    assert (code, said) == (2, ""), err
    one_line(err, out, "ermission denied")


def test_a_reader_may_look_while_it_flies(whole, tmp_path):
    """Whatever is there under its name is whole."""
    path, straight = whole
    out = tmp_path / "out"
    process = started(path, out)
    seen = 0
    try:
        while process.poll() is None:
            process.send_signal(signal.SIGSTOP)  # or, on a busy machine, it would be over before the second look
            if (out / "campaign.json").exists():
                named = [one["file"] for one in manifest(out)["chunks"]]
                assert all((out / name).exists() for name in named)
                seen = max(seen, readable(out))
            process.send_signal(signal.SIGCONT)
            time.sleep(0.05)
    finally:
        process.send_signal(signal.SIGCONT)
        code, _, _ = ended(process)
    assert code == 0
    assert seen > 1
    assert rows(out).num_rows == 1024
    assert flights(out) == flights(straight)


def test_the_reader_of_what_it_says_may_go_away(whole, tmp_path):
    """`quadstep campaign ... | head -1` is no reason for a traceback."""
    path, _ = whole
    command = [sys.executable, "-c", WITHOUT_REPORT, "campaign", str(path), "--flights", "64", "--out", str(tmp_path / "out")]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    process.stdout.close()
    err = process.stderr.read()
    process.wait(timeout=PATIENCE)
    assert "Traceback" not in err
    assert rows(tmp_path / "out").num_rows == 64
