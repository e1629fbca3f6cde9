"""A campaign on a real cluster of several nodes, which are lost in mid-run: the same files as from one machine."""

import contextlib
import json
import os
import pickle
import re
import signal
import subprocess
import sys
from types import SimpleNamespace

import pyarrow as pa
import pytest

from quadstep.engines.engine import Engine
from quadstep.io.errors import UserError
from quadstep.report.progress import Progress
from quadstep.studies.campaign import cluster, cluster_connection
from quadstep.studies.campaign.cluster import (
    ChunkSpan,
    Pieces,
    finished_tasks,
    flown_on_cluster,
    fly_span,
    order,
    span_size,
    spans,
)
from quadstep.studies.campaign.flyer import Chunk, Flyer
from quadstep.studies.campaign.run import CampaignRequest, fly_campaign
from quadstep.studies.campaign.schema import read_campaign
from quadstep.studies.campaign.store import parquet
from quadstep.studies.comparison import jobs
from tests.campaigns import (
    NOISY,
    SHORT,
    flights,
    fly,
    leftovers,
    manifest,
    no_report,
    processes,
    rows,
    soon,
    started,
    written,
)
from tests.commands import quadstep, write
from tests.needs import package
from tests.patience import PATIENCE

LONG = SHORT.replace("duration = 0.4", "duration = 16.0")
HEAD = "chunk = 600\nflights = 3600\n"
VARY = """
"vehicle.mass" = { type = "normal", mean = 1.0, deviation = 0.1, low = 0.7, high = 1.3 }
"disturbance.scale" = { type = "sobol", low = 0.0, high = 300.0 }
"controller.nets.enabled" = { type = "choice", values = [true, false] }
"""
"""The stronger disturbances end some flights early, so that columns have gaps."""

STORE = 80 * 2**20
TASK = "ray::quadstep_task"


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A campaign of six files and a second or two, flown on this machine's lanes: (its file, its folder)."""
    folder = tmp_path_factory.mktemp("whole")
    path = written(folder, VARY, LONG, HEAD)
    assert fly(path, folder / "out").code == 0
    return path, folder / "out"


@pytest.fixture(scope="module")
def patient():
    """Ray's module, whose nodes may take their time to start: its own 30 s are too few on a busy machine."""
    ray = package("ray")
    from ray._private import services

    find, wait = services.get_node, services.wait_for_node

    def found(*asked):
        """A node's entry, once there is one: Ray asks again for 30 s only."""
        entries = []

        def here():
            with contextlib.suppress(RuntimeError):
                entries.append(find(*asked))
            return entries

        return entries[0] if soon(here) else find(*asked)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(services, "get_node", found)
        patch.setattr(services, "wait_for_node", lambda address, name, *_: wait(address, name, PATIENCE))
        yield ray


@pytest.fixture(scope="module")
def nodes(patient):
    """A head and a node of one core each, at RAY_ADDRESS; nothing of it runs on afterwards."""
    from ray.cluster_utils import Cluster

    head = {"num_cpus": 1, "object_store_memory": STORE, "include_dashboard": False}
    whole = Cluster(initialize_head=True, head_node_args=head)
    whole.add_node(num_cpus=1, object_store_memory=STORE)
    os.environ["RAY_ADDRESS"] = whole.address
    yield whole
    del os.environ["RAY_ADDRESS"]
    mark = whole.head_node.get_session_dir_path()  # in the command line of its servers
    patient.shutdown()
    whole.shutdown()
    assert soon(lambda: not any(mark in line for *_, line in processes())), "a server runs on"


@pytest.fixture(scope="module")
def joined(nodes):
    """The cluster, joined once for several tests, which meet workers that are awake."""
    handler = signal.getsignal(signal.SIGTERM)
    with cluster_connection.connected():
        assert signal.getsignal(signal.SIGTERM) is handler, "Ray's way with SIGTERM has taken over"
        yield nodes


def flying():
    """The workers that fly, of those that descend from this process: other clusters are nobody's business here."""
    running = processes()
    parents = {process: parent for process, parent, *_ in running}

    def descends(process):
        while process in parents and process != os.getpid():
            process = parents[process]
        return process == os.getpid()

    return [process for process, *_, line in running if TASK in line and descends(process)]


def a_worker():
    """One that flies."""
    seen = []
    assert soon(lambda: seen.extend(flying()) or seen), "no worker flies"
    return seen[0]


def finished(out):
    """How many files of flights the manifest names: one that was just written is not among them yet."""
    return len(manifest(out)["chunks"]) if (out / "campaign.json").is_file() else 0


def interrupted_after_one(*told, flown=cluster.flown_on_cluster):
    """A driver that is interrupted, as by SIGINT, while it waits for the second file of flights."""
    with contextlib.closing(flown(*told)) as files:
        yield next(files)
        raise KeyboardInterrupt


def under_way(path, out, *more):
    """A process that flies on the cluster, and has finished one more file."""
    before = finished(out)
    process = started(path, out, "--engine", "ray", *more)
    assert soon(lambda: finished(out) > before or process.poll() is not None)
    assert process.poll() is None, process.communicate()
    return process


# Lost, killed, interrupted


def unsealed(folder):
    """campaign.json without its digest of itself, which holds the engine too."""
    return {name: value for name, value in manifest(folder).items() if name != "sha256"}


def test_a_worker_and_a_node_lost_in_mid_run_change_nothing(whole, joined, tmp_path, monkeypatch):
    path, straight = whole
    monkeypatch.setattr(cluster, "SPAN", 100)
    monkeypatch.setattr(cluster, "SMALLEST_SPAN", 100)
    counts, lost = [], []

    class Killing(Progress):
        def to(self, done, total=None, note=""):
            counts.append(done)
            if done >= 500 and not lost:
                lost.append("worker")
                os.kill(a_worker(), signal.SIGKILL)
            if done >= 1200 and len(lost) == 1:
                lost.append("node")
                joined.remove_node(*joined.worker_nodes, allow_graceful=False)

    with no_report():
        fly_campaign(CampaignRequest(path, tmp_path / "out", engine=Engine.RAY, progress=Killing()))
    assert lost == ["worker", "node"]
    assert counts == sorted(counts)
    assert counts[-1] == 3600
    assert flights(tmp_path / "out") == flights(straight)
    assert unsealed(tmp_path / "out") == {**unsealed(straight), "engine": "ray"}


def test_a_driver_that_was_interrupted_and_killed_is_gone_on_with(whole, joined, monkeypatch, tmp_path):
    path, straight = whole
    out = tmp_path / "out"
    with monkeypatch.context() as patch:
        patch.setattr(cluster, "flown_on_cluster", interrupted_after_one)
        run = fly(path, out, "--engine", "ray")
    kept = finished(out)
    assert (run.code, "succeeded" in run.out) == (130, False)  # on a busy machine Ray itself may say something
    ours = [line for line in run.err.splitlines() if line.startswith("quadstep: ")]  # Ray tells its drivers of dead nodes
    *progress, last = ours  # a line a minute, where the machine is busy
    assert last == f"quadstep: interrupted; {kept} of 6 files of flights are kept in {out}; continue with --resume"
    assert [line for line in progress if not line.startswith("quadstep: flying: ")] == []
    assert 0 < kept < 6
    assert soon(lambda: not flying()), "its workers fly on"

    driver = under_way(path, out, "--resume")
    driver.kill()
    driver.communicate()
    assert kept < finished(out) < 6
    assert soon(lambda: not flying()), "its workers fly on"

    with no_report():
        fly_campaign(CampaignRequest(path, out, engine=Engine.RAY, resume=True))
    assert flights(out) == flights(straight)
    assert not leftovers(out)


# Refused


@pytest.mark.parametrize("place", [0, 2], ids=["quadstep", "llvmlite"])
def test_what_a_worker_refuses_comes_out_as_itself(whole, joined, monkeypatch, place):
    known = read_campaign(whole[0])
    told = order(known)
    name, here = told.needs[place]
    needs = (*told.needs[:place], (name, "another"), *told.needs[place + 1 :])
    monkeypatch.setattr(cluster, "order", lambda _: told._replace(needs=needs))
    with pytest.raises(UserError, match=rf"^--engine ray: node \S+ has {name} {here}, .* another: ") as one:
        list(flown_on_cluster(known, [Chunk("a", 0, 500)], lambda _: None))
    assert type(one.value) is UserError


class Trap:
    """Leaves a mark where it is unpacked, and fails."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return exec, (f"open({str(self.path)!r}, 'a').write('once '); raise ZeroDivisionError('no way')",)


def test_what_fails_on_a_worker_is_raised_as_it_is_and_not_tried_again(whole, joined, tmp_path, monkeypatch):
    known = read_campaign(whole[0])
    told = order(known)._replace(campaign=pickle.dumps(Trap(tmp_path / "marks")))
    monkeypatch.setattr(cluster, "order", lambda _: told)
    with pytest.raises(ZeroDivisionError, match="no way") as one:
        list(flown_on_cluster(known, [Chunk("a", 0, 200)], lambda _: None))
    assert type(one.value) is ZeroDivisionError
    assert (tmp_path / "marks").read_text() == "once "


@pytest.mark.slow
def test_a_comparison_on_the_cluster_finds_what_this_machine_finds(joined, tmp_path):
    files = [write(tmp_path, NOISY.replace("geometric", law), f"{law}.toml") for law in ("geometric", "pid")]
    found = []
    for engine in ("lanes", "ray"):
        run = quadstep("compare", *files, "--seeds", "2", "--engine", engine, "--out", tmp_path / engine)
        assert run.code == 0, run.err
        found.append(json.loads((tmp_path / engine / "metrics.json").read_text()))
    assert found[0]["cells"] == found[1]["cells"]
    assert found[0]["pairs"] == found[1]["pairs"]


def test_a_node_without_quadstep_is_said_in_one_line(whole, joined, tmp_path):
    known = read_campaign(whole[0])
    (tmp_path / "quadstep").mkdir()
    missing = "No module named 'quadstep'"
    (tmp_path / "quadstep/__init__.py").write_text(f'raise ModuleNotFoundError("{missing}", name="quadstep")')
    bare = joined.add_node(num_cpus=4, object_store_memory=STORE, env_vars={"PYTHONPATH": str(tmp_path)})
    try:
        with pytest.raises(UserError, match=rf"worker at \d\S+ cannot import .*{missing}.*on every node$"):
            list(flown_on_cluster(known, [Chunk("a", 0, 12000)], lambda _: None))
        pieces = [jobs.Job("costs", str(i), str(i), ("", ""), None, bytes, 1) for i in range(40)]
        with pytest.raises(UserError, match=rf"worker at \d\S+ cannot import .*{missing}.*on every node$"):
            list(jobs.on_cluster(pieces, lambda: None))
    finally:
        joined.remove_node(bare, allow_graceful=False)


@pytest.mark.parametrize(("address", "said"), [
    ("127.0.0.1:1", "127.0.0.1:1 cannot be reached: Connection refused"),
    ("nobody.invalid:6379", "nobody.invalid:6379 cannot be reached: "),
    ("ray://127.0.0.1:10001", "should be HOST:PORT"),
    ("http://127.0.0.1:8265", "should be HOST:PORT"),
    ("head", "should be HOST:PORT"),
    ("head:99999", "should be HOST:PORT"),
])  # fmt: skip
def test_an_address_where_no_cluster_is(address, said):
    with pytest.raises(UserError, match=f"^--engine ray: .*RAY_ADDRESS = .*{re.escape(said)}") as one:
        cluster_connection.cluster_at(address)
    assert "\n" not in str(one.value)


@pytest.mark.parametrize("address", [" ", "\n", " local", "auto "])
def test_blanks_are_no_address_and_start_no_cluster_of_their_own(monkeypatch, address):
    monkeypatch.setitem(sys.modules, "ray", SimpleNamespace(is_initialized=lambda: False))
    monkeypatch.setenv("RAY_ADDRESS", address)
    said = f"^--engine ray: RAY_ADDRESS = {re.escape(repr(address))}: should be HOST:PORT"
    with pytest.raises(UserError, match=said), cluster_connection.connected():
        pass


TRIALS = {
    "import sys; sys.exit('Traceback:\\nValueError: 3.11 is not 3.12')": "cannot be joined: ValueError: 3.11 is not 3.12$",
    "import os; os.abort()": "cannot be joined: Ray gave up without a message$",
    "import sys; sys.exit('Unauthenticated: InvalidAuthToken')": "cannot be joined: it requires its token; set RAY_AUTH_MODE=",
    "import sys; sys.exit('Could not find any running Ray instance')": "cannot be joined: no Ray was started",
    "import time; time.sleep(30)": "cannot be joined: Ray did not answer within 0.5 s$",
}


@pytest.mark.parametrize(("trial", "said"), TRIALS.items())
def test_a_cluster_that_cannot_be_joined_is_said_in_one_line(monkeypatch, trial, said):
    monkeypatch.setattr(cluster_connection, "reach", lambda _: None)
    monkeypatch.setattr(cluster_connection, "TRIAL", trial)
    monkeypatch.setattr(cluster_connection, "JOINING", 0.5 if "sleep" in trial else 60.0)
    with pytest.raises(UserError, match=f"^--engine ray: the cluster at RAY_ADDRESS = head:6379 {said}") as one:
        cluster_connection.cluster_at("head:6379")
    assert "\n" not in str(one.value)


@pytest.mark.parametrize("error", [RuntimeError("Version mismatch: 3.11\nand 3.12"), SystemExit(15)])
def test_a_cluster_that_changes_its_mind_is_said_in_one_line(error):
    def init(**_):
        raise error

    with pytest.raises(
        UserError, match=r"cluster at head:6379 cannot be joined: (RuntimeError: Version .*3.11|SystemExit: 15)$"
    ):
        cluster_connection.join(SimpleNamespace(init=init), "head:6379")


def test_a_cluster_that_loses_all_its_cores_is_given_up():
    cores = [{"CPU": 1.0}, {}]
    ray = SimpleNamespace(wait=lambda some, **_: ([], some), cluster_resources=lambda: cores.pop(0))
    with pytest.raises(UserError, match="no core has been free on the cluster for 60 s"):
        finished_tasks(ray, ["task"])
    assert not cores


def test_files_that_are_not_on_a_worker_are_said_in_one_line(tmp_path):
    mission = SHORT.replace(
        'type = "minimum-jerk"\nend = [0.4, 0.1, 0.2]\nduration = 0.4', 'type = "recorded"\nfile = "wanted.csv"'
    )
    samples = "".join(f"{0.1 * i},{0.01 * i * i},0.0,0.0\n" for i in range(30))
    path = written(tmp_path, '"vehicle.mass" = {type="uniform", low=0.9, high=1.1}', mission)
    (tmp_path / "wanted.csv").write_text("t,x,y,z\n" + samples)
    told = tuple(order(read_campaign(path)))
    assert fly_span(told, 0, 16).num_rows == 16
    cluster.FLYERS.clear()
    for change in (lambda file: file.write_text("t,x,y,z\n" + samples.replace("0.01", "0.02")), lambda file: file.unlink()):
        change(tmp_path / "wanted.csv")
        with pytest.raises(UserError, match=r"node \S+: files named by the mission .* share ") as one:
            fly_span(told, 0, 16)
        assert str(tmp_path) in str(one.value)


# Put together


def test_spans_cover_the_chunks_in_order():
    chunks = [Chunk("a", 0, 64), Chunk("b", 64, 70)]
    assert [tuple(span) for span in spans(chunks, 30)] == [
        (chunks[0], 0, 30), (chunks[0], 30, 60), (chunks[0], 60, 64), (chunks[1], 64, 70)
    ]  # fmt: skip


def test_a_task_is_small_enough_for_all_cores_and_large_enough_to_be_worth_it():
    assert span_size(10**6, 1) == cluster.SPAN
    assert span_size(10**6, 64) == 3907
    assert span_size(1000, 4096) == cluster.SMALLEST_SPAN
    assert span_size(10, 0) == cluster.SMALLEST_SPAN


def test_pieces_are_put_together_in_order_whichever_comes_first():
    chunk, other, pieces = Chunk("a", 0, 3), Chunk("b", 3, 4), Pieces()
    one, two, three = (pa.table({"flight": numbers}) for numbers in ([0, 1], [2], [3]))
    assert pieces.add(ChunkSpan(chunk, 2, 3), two) is None
    assert pieces.add(ChunkSpan(other, 3, 4), three)["flight"].to_pylist() == [3]
    assert pieces.add(ChunkSpan(chunk, 0, 2), one)["flight"].to_pylist() == [0, 1, 2]
    assert not pieces.tables


@pytest.mark.parametrize("size", [5, 37, 250])
def test_pieces_of_any_size_make_the_same_file(whole, size):
    path, straight = whole
    flyer, chunk, pieces = Flyer(read_campaign(path)), Chunk("flights/00000.parquet", 0, 250), Pieces()
    wanted = parquet(flyer.fly(0, 250))
    assert len(set(rows(straight)["outcome"].to_pylist()[:250])) > 1, "some flights should end early"
    *none, table = [pieces.add(span, flyer.fly(span.first, span.past)) for span in reversed(list(spans([chunk], size)))]
    assert none == [None] * len(none)
    assert parquet(table) == wanted


def test_a_worker_keeps_its_program_and_no_other(whole):
    known = read_campaign(whole[0])
    told, stricter = (
        order(known),
        order(known._replace(file=known.file.model_copy(update={"failure": {"position_rmse": 1e-9}}))),
    )
    assert told.fingerprint == stricter.fingerprint
    assert any(fly_span(tuple(told), 0, 20)["success"].to_pylist())
    flyer = cluster.FLYERS[told]
    assert fly_span(tuple(told), 20, 40)["flight"].to_pylist() == list(range(20, 40))
    assert cluster.FLYERS[told] is flyer
    assert not any(fly_span(tuple(stricter), 0, 20)["success"].to_pylist())
    assert list(cluster.FLYERS) == [stricter]


def test_a_worker_uses_one_core(whole, monkeypatch):
    counts = []
    monkeypatch.setattr(cluster.Sweep, "fly", recorded(cluster.Sweep.fly, counts))
    cluster.FLYERS.clear()
    fly_span(tuple(order(read_campaign(whole[0]))), 0, 16)
    assert counts
    assert set(counts) == {1}


def recorded(real, counts):
    def fly(self, values, threads=None, progress=None):
        counts.append(threads)
        return real(self, values, threads, progress)

    return fly


# Around it


def test_ray_is_loaded_for_its_engine_only_and_matplotlib_for_reports(whole, tmp_path):
    path, _ = whole
    program = (
        "import sys, quadstep, quadstep.commands.cli\nfrom pathlib import Path\n"
        "from quadstep.studies.campaign.run import CampaignRequest, fly_campaign\n"
        "import types\n"
        "sys.modules['quadstep.studies.campaign.report'] = types.SimpleNamespace(write_report=lambda *of: of[2])\n"
        "fly_campaign(CampaignRequest(Path(sys.argv[1]), Path(sys.argv[2]), 64))\n"
        "assert not {'ray', 'quadstep.studies.campaign.cluster', 'matplotlib', 'pandas'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", program, str(path), str(tmp_path / "out")], check=True)


def test_a_cluster_that_was_joined_before_stays_so(monkeypatch):
    ray = SimpleNamespace(is_initialized=lambda: True)  # any other call would fail
    monkeypatch.setitem(sys.modules, "ray", ray)
    with cluster_connection.connected() as got:
        assert got is ray
