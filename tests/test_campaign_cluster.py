"""A campaign on a real cluster of several nodes, which are lost in mid-run: the same files as from one machine."""

import os
import signal
import subprocess
import sys
import time

import pyarrow as pa
import pytest

from quadstep.campaign import cluster
from quadstep.campaign.cluster import Pieces, Span, connected, fly_span, spans
from quadstep.campaign.engine import CampaignEngine
from quadstep.campaign.run import fly_campaign
from quadstep.campaign.schema import read_campaign
from quadstep.campaign.store import Chunk
from quadstep.errors import UserError
from tests.campaigns import SHORT
from tests.needs import package

CAMPAIGN = """
mission = "mission.toml"
flights = 1500
chunk = 400
[vary]
"vehicle.mass" = { type = "normal", mean = 1.0, deviation = 0.1, low = 0.7, high = 1.3 }
"disturbance.scale" = { type = "sobol", low = 0.0, high = 1.0 }
"controller.nets.enabled" = { type = "choice", values = [true, false] }
"""
FILES = [f"{i:05d}.parquet" for i in range(4)]
DRIVER = """
import sys
from pathlib import Path
from quadstep.campaign import cluster
from quadstep.campaign.engine import CampaignEngine
from quadstep.campaign.run import fly_campaign
cluster.SPAN = 50
fly_campaign(Path(sys.argv[1]), Path(sys.argv[2]), engine=CampaignEngine.RAY, resume="resume" in sys.argv)
"""


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    folder = tmp_path_factory.mktemp("campaign")
    (folder / "mission.toml").write_text(SHORT.replace("duration = 0.4", "duration = 4.0"))
    (folder / "campaign.toml").write_text(CAMPAIGN)
    fly_campaign(folder / "campaign.toml", folder / "wanted")
    return folder / "campaign.toml"


@pytest.fixture(scope="module")
def nodes():
    """A head that flies nothing and two nodes of one core, which `connected` finds."""
    ray = package("ray")
    from ray.cluster_utils import Cluster

    size = {"object_store_memory": 80 * 2**20, "include_dashboard": False}
    whole = Cluster(initialize_head=True, head_node_args={"num_cpus": 0, **size})
    workers = [whole.add_node(num_cpus=1, object_store_memory=80 * 2**20) for _ in range(2)]
    os.environ["RAY_ADDRESS"] = whole.address
    yield whole, workers
    del os.environ["RAY_ADDRESS"]
    ray.shutdown()
    whole.shutdown()


def content(folder):
    return [(folder / "flights" / name).read_bytes() for name in FILES]


@pytest.mark.slow
def test_a_node_and_a_worker_lost_in_mid_run_change_nothing(campaign, nodes, tmp_path, monkeypatch):
    whole, workers = nodes
    monkeypatch.setattr(cluster, "SPAN", 50)
    over, lost = [], []

    def progress(flights, _):
        over.append(flights)
        if flights >= 200 and not lost:
            lost.append("worker")
            found = subprocess.run(["pgrep", "-f", "ray::fly_span"], check=False, capture_output=True, text=True).stdout
            os.kill(int(found.split()[0]), signal.SIGKILL)
        if flights >= 500 and len(lost) == 1:
            lost.append("node")
            whole.remove_node(workers.pop())
            whole.add_node(num_cpus=1, object_store_memory=80 * 2**20)

    fly_campaign(campaign, tmp_path / "out", engine=CampaignEngine.RAY, progress=progress)
    assert lost == ["worker", "node"]
    assert over[-1] == 1500
    assert content(tmp_path / "out") == content(campaign.parent / "wanted")


@pytest.mark.slow
def test_a_driver_that_was_killed_is_gone_on_with(campaign, nodes, tmp_path):
    command = [sys.executable, "-c", DRIVER, str(campaign), str(tmp_path / "out")]
    driver = subprocess.Popen(command)
    while not (tmp_path / "out" / "flights" / FILES[0]).exists():
        assert driver.poll() is None
        time.sleep(0.02)
    driver.kill()
    driver.wait()
    assert not (tmp_path / "out" / "flights" / FILES[-1]).exists()
    subprocess.run([*command, "resume"], check=True)
    assert content(tmp_path / "out") == content(campaign.parent / "wanted")


@pytest.mark.slow
def test_what_a_worker_refuses_is_said_in_one_line_and_not_tried_again(campaign, nodes, tmp_path, monkeypatch):
    monkeypatch.setattr(cluster, "__version__", "0.0")
    with pytest.raises(UserError, match=r"^--engine ray: a worker has quadstep .*, here is 0\.0"):
        fly_campaign(campaign, tmp_path / "out", engine=CampaignEngine.RAY)


def test_a_cluster_that_is_not_there_is_said_in_one_line(monkeypatch):
    ray = package("ray")
    monkeypatch.setenv("RAY_ADDRESS", "127.0.0.1:1")
    monkeypatch.setattr(ray, "is_initialized", lambda: False)
    monkeypatch.setattr(ray, "init", refuse)
    with pytest.raises(UserError, match=r"the cluster at RAY_ADDRESS = 127\.0\.0\.1:1 cannot be reached"), connected():
        pass


def refuse(**_):
    raise ConnectionError("nobody answers")


def test_spans_cover_the_chunks_in_order(monkeypatch):
    monkeypatch.setattr(cluster, "SPAN", 30)
    chunks = [Chunk("a", 0, 64), Chunk("b", 64, 70)]
    assert [tuple(span) for span in spans(chunks)] == [
        (chunks[0], 0, 30), (chunks[0], 30, 60), (chunks[0], 60, 64), (chunks[1], 64, 70)
    ]  # fmt: skip


def test_pieces_are_put_together_in_order_whichever_comes_first():
    chunk, pieces = Chunk("a", 0, 3), Pieces()
    one, two = (pa.table({"flight": flights}) for flights in ([0, 1], [2]))
    assert pieces.add(Span(chunk, 2, 3), two) is None
    assert pieces.add(Span(chunk, 0, 2), one)["flight"].to_pylist() == [0, 1, 2]


def test_a_worker_keeps_its_program(campaign):
    known = read_campaign(campaign)
    first = fly_span(known, "one", cluster.__version__, 0, 20)
    flyer = cluster.FLYERS["one"]
    fly_span(known, "one", cluster.__version__, 20, 40)
    assert {"one": flyer} == cluster.FLYERS
    assert first.num_rows == 20
