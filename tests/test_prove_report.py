"""The report of `quadstep prove`: what it says, draws, and replaces."""

import html
import re
import tomllib

import numpy as np
import pytest

from quadstep.mission.schema import Mission
from quadstep.proofs.prove.certificate_file import read_certificate
from quadstep.proofs.prove.proof_pictures import of_tube
from quadstep.proofs.prove.report import MARK
from quadstep.proofs.prove.run import prove_mission
from quadstep.proofs.prove.sampled import SampledLoop
from quadstep.proofs.prove.unknown import Unknown
from tests.commands import quadstep, write

MISSION = """
name = "Sideways"
vehicle = { type = "planar" }
path = { type = "minimum-jerk", start = [0.0, 0.0, 5.0], end = [0.5, 0.0, 5.0], duration = 1.0 }
controller = { type = "planar-pd" }
"""


@pytest.fixture(scope="module")
def proved(tmp_path_factory):
    folder = tmp_path_factory.mktemp("proof")
    file = write(folder, MISSION, "m.toml")
    run = quadstep("prove", file, "--start", 1e-4, "--out", folder / "tube.json")
    return run, file, folder


def test_a_report_says_the_answer_and_draws_tube_and_boxes(proved):
    run, _, folder = proved
    assert (run.code, run.err) == (0, "")
    assert f"Report: {folder / 'tube.html'}" in " ".join(run.out.split())
    text = (folder / "tube.html").read_text(encoding="utf-8")
    assert MARK in text
    assert "<title>Sideways" in text
    assert re.search(
        r"Proved: every flight of 1.s from any start within 0.1.mm of the mission's on each axis\s+stays", html.unescape(text)
    )
    assert text.count("<figure") == 2
    for bound in (line.split()[-2] for line in run.out.splitlines() if line.startswith(("x ", "z "))):
        assert bound in text


def test_every_number_of_the_text_is_one_of_the_table(proved):
    """The caption's bound, the first sentence's, and the cards' are the table's, and those of the certificate."""
    run, _, folder = proved
    text = re.sub(r"<svg.*?</svg>", "", (folder / "tube.html").read_text(encoding="utf-8"), flags=re.S)
    text = text.replace("\u00a0", " ")
    table = dict(re.findall(r"<tr><td>([xz])</td><td>([\d.]+) mm</td>", text))
    away = dict(re.findall(r"<tr><td>([xz])</td><td>[\d.]+ mm</td><td>([\d.]+) mm</td>", text))
    assert f"largest along x, {table['x']} mm" in text
    assert f"stays within {away['x']} mm along x and {away['z']} mm along z of its path" in text
    assert re.findall(r"<dd>([\d.]+) mm", text) == [away["x"], away["z"]]
    kept = read_certificate(folder / "tube.json").position.tolist()
    for one, said in zip(kept, (table["x"], table["z"]), strict=True):
        assert 1e3 * one <= float(said) <= 1.001e3 * one
    assert f"{away['x']} mm" in run.out


def test_the_tube_is_drawn_with_its_bound_along_every_axis_and_boxes_in_words():
    loop = SampledLoop(Mission.model_validate(tomllib.loads(MISSION)).plan())
    bound = np.full((11, 2), 0.10005)
    bound[-1, 0] += 1e-9  # less than is written
    boxes = np.ones((2, len(loop.names)))
    figure, widths = of_tube(loop, 0.0 * bound, bound, boxes, 8)
    assert "it is largest along x and z, 100.1 mm at" in figure.caption.replace("\u00a0", " ")
    assert [len(panel.lines) for panel in figure.panels] == [3, 3, 1, 1]
    assert [*widths.panels[0].lines][:2] == ["position", "velocity"]
    (narrow, *_) = of_tube(loop, np.cumsum(bound, axis=0), 1e-3 * bound, boxes[:0], 8)
    assert [len(panel.lines) for panel in narrow.panels] == [1, 1, 1, 1]


def test_the_band_is_the_tube_of_the_proof(proved):
    _, file, folder = proved
    first, _ = prove_mission(file, others=Unknown(start=1e-4)).pictures
    bound = np.array([*(panel.lines["bound"] for panel in first.panels[2:])]).T
    assert np.all(bound[0] >= 1e-4)
    assert bound.max(axis=0) == pytest.approx(read_certificate(folder / "tube.json").position.tolist(), rel=1e-12)


def test_hover_is_drawn_with_flights_that_stay_within_what_is_proved(tmp_path):
    text = MISSION.replace("end = [0.5, 0.0, 5.0]", "end = [0.0, 0.0, 5.0]")
    (picture,) = prove_mission(write(tmp_path, text, "m.toml")).pictures
    for panel in picture.panels:
        assert np.all(panel.lines["flown"] <= panel.lines["proved"])
    share = max(float((panel.lines["flown"] / panel.lines["proved"]).max()) for panel in picture.panels)
    assert f"up to {100.0 * share:.0f} % of it" in picture.caption
    assert share > 0.1


def test_what_is_no_such_report_is_not_replaced(proved):
    _, file, folder = proved
    again = quadstep("prove", file, "--start", 1e-4, "--out", folder / "tube.json")
    assert again.code == 0
    (folder / "own.html").write_text("mine", encoding="utf-8")
    refused = quadstep("prove", file, "--out", folder / "own.json")
    assert refused.refused
    assert "own.html: exists and is not a report of `quadstep prove`" in refused.err
    assert (folder / "own.html").read_text(encoding="utf-8") == "mine"
    assert quadstep("prove", file, "--out", folder / "new.html").refused


def test_a_tube_that_stays_open_is_reported_as_far_as_it_is_closed(tmp_path):
    run = quadstep("prove", write(tmp_path, MISSION, "m.toml"), "--start", 0.5, "--out", tmp_path / "tube.json")
    assert run.code == 1
    text = (tmp_path / "tube.html").read_text(encoding="utf-8")
    assert "Open: from any start within" in text
    assert not (tmp_path / "tube.json").exists()
