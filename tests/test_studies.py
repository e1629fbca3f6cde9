"""A new kind of study is one file: `run` gives it engines, progress, a folder and everything that shows its evidence."""

import importlib.util
import json
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from quadstep.commands.options import show
from quadstep.engines.engine import Engine
from quadstep.engines.fly import fly
from quadstep.interfaces.closed_loop import Outcome
from quadstep.io.errors import UserError
from quadstep.metrics.verdict import junit_xml
from quadstep.studies.campaign.single_flight import replay
from quadstep.studies.study import run
from tests.campaigns import SHORT
from tests.commands import Listener

SPEC = importlib.util.spec_from_file_location("bearing", Path(__file__).parent.parent / "examples" / "bearing.py")
EXAMPLE = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(EXAMPLE)
Bearing = EXAMPLE.Bearing

VALUES = (1.0, 2.0, 1e3, 1e6)


@pytest.fixture
def study(tmp_path):
    (tmp_path / "m.toml").write_text('name = "Line"\n' + SHORT, encoding="utf-8")
    return Bearing(tmp_path / "m.toml", "disturbance.scale", VALUES)


def test_it_flies_and_writes_its_evidence_for_people_and_machines(study, tmp_path, capsys):
    listener, out = Listener(), tmp_path / "out"
    found, evidence = run(study, out, progress=listener)
    assert (listener.heard[0], listener.heard[-1]) == ((0, 4), (4, 4))
    alone = [fly(replay(study.campaign, flight).plan).outcome is Outcome.COMPLETED for flight in range(4)]
    assert found.good.tolist() == alone
    assert found.most == 2.0
    record = json.loads((out / "metrics.json").read_text())
    assert record.items() >= {"name": "Line: disturbance.scale", "engine": "lanes", "most": found.most}.items()
    assert record["files"] == ["metrics.json", "report.html", "table.tex"]
    assert evidence.answer in (out / "report.html").read_text()
    assert "succeeds" in (out / "table.tex").read_text()
    show(evidence, out)
    assert capsys.readouterr().out == f"{evidence.answer}\nReport: {out / 'report.html'}\n"
    verdict = evidence.verdict("bearing", out)
    assert verdict.as_json()["passed"]
    assert "quadstep bearing: Line: disturbance.scale" in junit_xml(verdict, 1.0)


def test_it_keeps_other_results_and_refuses_what_it_cannot_fly(study, tmp_path):
    out = tmp_path / "out"
    run(study, out)
    before = (out / "metrics.json").read_bytes()
    other = Bearing(tmp_path / "m.toml", "disturbance.scale", (0.0, 2.0))
    with pytest.raises(UserError, match="holds other results"):
        run(other, out)
    bad = Bearing(tmp_path / "m.toml", "vehicle.mass", (-1.0, 1.0))
    with pytest.raises(UserError, match="mass"):
        run(bad, out, Engine.LANES, overwrite=True)
    assert (out / "metrics.json").read_bytes() == before


def test_its_function_is_a_command(study, tmp_path):
    app = typer.Typer()
    app.command()(EXAMPLE.bearing)
    said = CliRunner().invoke(app, [str(tmp_path / "m.toml"), "disturbance.scale", "1", "2", "--out", str(tmp_path / "out")])
    assert said.output == "Up to disturbance.scale = 2, every flight succeeds.\n"
    assert (tmp_path / "out/report.html").is_file()
