"""The report of `quadstep prove`: what it says, draws, and replaces."""

import re

import numpy as np
import pytest

from quadstep.proofs.prove.report import MARK, ProofVerdict, TubeRecord, VerdictKind, tube, widest, write_report
from quadstep.proofs.prove.run import prove_mission
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
    assert re.search(r"Proved: from the path at most [\d.]+\s[mµ]?m along x.*?\.</p><p>Every flight of ", text)
    assert text.count("<figure") == 2
    boxes = text[text.rindex("<table>") :]
    quantities = re.findall(r"<tr><td>([^<]*)</td>", boxes)
    assert len(quantities) < 10
    assert quantities[:2] == ["position", "velocity"]
    assert re.search(r"<td>position</td><td>[\d.]+\s[mµ]?m</td>", boxes)
    for bound in (line.split()[-2] for line in run.out.splitlines() if line.startswith(("x ", "z "))):
        assert bound in text


def test_quantities_are_named_in_words():
    states = "position.0", "integral_1.0", "roll_rate.integral.1", "weights_1.3.2"
    traced = TubeRecord((), *[np.zeros(0)] * 3, states, np.zeros(1), np.array([[1e-3, 2e-3, 3e-3, 4e-3]]))
    assert dict(widest(traced)) == {
        "position": "1.00\N{NO-BREAK SPACE}mm",
        "the integral of r1": "2.00\N{NO-BREAK SPACE}mm",
        "roll rate integral": "0.00300",
        "weights of the first net": "0.00400",
    }


def test_a_tube_of_a_long_flight_is_drawn_with_few_points_and_its_extremes():
    time = np.linspace(0.0, 40.0, 20_001)
    error, bound = np.sin(time)[:, None], np.where(time == time[7_001], 0.5, 0.1)[:, None]
    figure = tube(TubeRecord(("x",), time, error, bound, ("position.0",), time[:1], np.ones((1, 1))))
    path, band = figure.axes
    (outline,) = path.patches
    assert all(len(line.get_xdata()) < 3_000 for axes in figure.axes for line in axes.lines)
    assert len(outline.get_xy()) < 5_000
    assert band.lines[0].get_ydata().max() == 500.0
    heights = outline.get_xy()[:, 1]
    assert (heights.max(), heights.min()) == pytest.approx((1e3 * (error + bound).max(), 1e3 * (error - bound).min()))


def test_a_bound_that_stays_the_same_lies_below_the_edge_and_is_named_along_every_axis(tmp_path):
    bound = np.full((11, 2), 0.10005)
    bound[-1, 0] += 1e-9  # less than is written
    traced = TubeRecord(("x", "z"), np.linspace(0.0, 1.0, 11), 0.0 * bound, bound, (), np.zeros(0), np.zeros((0, 0)))
    for band in tube(traced).axes[1::2]:
        assert band.get_ylim()[0] == 0.0 and band.get_ylim()[1] > 1.03 * band.lines[0].get_ydata().max()
    verdict = ProofVerdict("Still", VerdictKind.PROVED, [["x", "proved", "1", "1"]], ["proved: every flight."], traced=traced)
    write_report(tmp_path / "one.html", verdict)
    assert "it is largest along x and z, 100.1 mm at" in (tmp_path / "one.html").read_text().replace("\u00a0", " ")


def test_the_band_is_the_tube_of_the_proof(proved):
    _, file, _ = proved
    verdict = prove_mission(file, others=Unknown(start=1e-4))
    traced = verdict.traced
    assert traced.bound.shape == traced.error.shape == (len(traced.time), 2)
    assert np.all(traced.bound[0] >= 1e-4)
    assert len(traced.boxes) == len(traced.blocks)
    position = [traced.states.index(name) for name in traced.states[:2]]
    inside = traced.boxes[:, position]
    last = np.searchsorted(traced.blocks, traced.time[1:], side="left") - 1
    assert np.all(traced.bound[1:] <= inside[last] * (1.0 + 1e-9))


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
