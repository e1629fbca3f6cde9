"""The report of `quadstep prove`: what it says, draws, and replaces."""

import html
import re
import tomllib
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from quadstep.io import errors
from quadstep.mission.schema import Mission
from quadstep.proofs.prove.certificate_file import off_path, read_certificate
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


def test_a_report_says_the_answer_and_draws_the_tube(proved):
    run, _, folder = proved
    assert (run.code, run.err) == (0, "")
    assert f"Report: {folder / 'tube.html'}" in " ".join(run.out.split())
    text = (folder / "tube.html").read_text(encoding="utf-8")
    assert MARK in text
    assert "<title>Sideways" in text
    assert re.search(
        r"Proved: from any start within 0.1.mm of the mission’s on each axis, the vehicle\s+stays", html.unescape(text)
    )
    assert text.count("<figure") == 1
    assert "a box for each block of 25 control periods" in text
    assert '<a href="tube.json">tube.json</a>' in text
    assert "<code>quadstep prove --check tube.json</code>" in text
    for bound in (line.split()[-2] for line in run.out.splitlines() if line.startswith(("x ", "z "))):
        assert bound in text


def test_every_number_of_the_text_is_one_of_the_table(proved):
    """The caption's bound and the first sentence's are the table's, and those of the certificate."""
    run, _, folder = proved
    text = re.sub(r"<svg.*?</svg>", "", (folder / "tube.html").read_text(encoding="utf-8"), flags=re.S)
    text = text.replace("\u00a0", " ")
    table = dict(re.findall(r"<tr><td>([xz])</td><td>([\d.]+) mm</td>", text))
    away = dict(re.findall(r"<tr><td>([xz])</td><td>[\d.]+ mm</td><td>([\d.]+) mm</td>", text))
    assert f"widest along x, {table['x']} mm" in text
    assert f"stays within {away['x']} mm along x and {away['z']} mm along z of its path" in text
    kept = read_certificate(folder / "tube.json").position.tolist()
    for one, said in zip(kept, (table["x"], table["z"]), strict=True):
        assert 1e3 * one <= float(said) <= 1.001e3 * one
    assert f"{away['x']} mm" in run.out


@pytest.mark.parametrize(("unit", "factor"), [("mm", 1e3), ("m", 1.0)])
def test_the_tube_is_drawn_as_a_band_along_every_axis_in_one_unit(tmp_path, unit, factor):
    loop = SampledLoop(Mission.model_validate(tomllib.loads(MISSION)).plan())
    bound = np.full((11, 2), 0.10005)
    bound[-1, 0] += 1e-9  # less than is written
    error = np.cumsum(bound, axis=0) * (1.0 if unit == "m" else 0.5)
    (figure,) = of_tube(loop, error, bound)
    assert "It is widest along x and z, 100.1 mm to each side at" in figure.caption.replace("\u00a0", " ")
    for panel, off, half in zip(figure.panels, factor * error.T, factor * bound.T, strict=True):
        low, high = panel.band
        np.testing.assert_allclose(0.5 * (low + high), off)
        np.testing.assert_allclose(0.5 * (high - low), half)
    axes = figure.picture().axes
    assert {one.get_ylabel().partition("[")[2] for one in axes} == {f"{unit}]"}
    assert all(len(one.collections) >= 1 for one in axes)
    figure.draw(tmp_path)


def test_progress_is_told_with_its_total(proved, monkeypatch):
    told = []
    monkeypatch.setattr(
        "quadstep.proofs.prove.run.bar", lambda *_: nullcontext(SimpleNamespace(to=lambda *one: told.append(one)))
    )
    prove_mission(proved[1], others=Unknown(start=1e-4))
    samples = SampledLoop(Mission.model_validate(tomllib.loads(MISSION)).plan()).samples
    assert told[0][:2] == (0, samples) and told[-1][:2] == (samples, samples)


def test_the_band_is_the_tube_of_the_proof(proved):
    _, file, folder = proved
    (first,) = prove_mission(file, others=Unknown(start=1e-4)).pictures
    bound = np.array([0.5 * (panel.band[1] - panel.band[0]) for panel in first.panels]).T
    assert np.all(bound[0] >= 0.1)
    assert (1e-3 * bound).max(axis=0) == pytest.approx(read_certificate(folder / "tube.json").position.tolist(), rel=1e-12)


def test_hover_is_drawn_with_flights_that_stay_within_what_is_proved(tmp_path):
    text = MISSION.replace("end = [0.5, 0.0, 5.0]", "end = [0.0, 0.0, 5.0]")
    (picture,) = prove_mission(write(tmp_path, text, "m.toml")).pictures
    for panel in picture.panels:
        assert np.all(panel.lines["flown"] <= panel.lines["proved"])
    share = max(float((panel.lines["flown"] / panel.lines["proved"]).max()) for panel in picture.panels)
    assert f"up to {100.0 * share:.0f} % of the bound" in picture.caption
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
    run = quadstep("prove", write(tmp_path, MISSION, "m.toml"), "--start", 0.03, "--out", tmp_path / "tube.json")
    assert run.code == 1
    text = (tmp_path / "tube.html").read_text(encoding="utf-8")
    assert re.search(r"Undecided: from any start within .* the bounds are proved until 0\.25.s but not beyond", text)
    assert text.count("<figure") == 1
    assert not (tmp_path / "tube.json").exists()


def test_the_bound_from_the_path_is_taken_block_by_block_and_holds_at_every_sample():
    rng = np.random.default_rng(3)
    for _ in range(20):
        block, samples = int(rng.integers(1, 9)), int(rng.integers(9, 60))
        count = -(-samples // block)
        boxes, position = rng.uniform(0.1, 1.0, (count, 4)), rng.uniform(0.1, 1.0, 2)
        off = rng.uniform(0.0, 1.0, (samples + 1, 2))
        bounds = np.minimum(boxes[:, :2], position)
        each = np.array(
            [np.maximum(bounds[max(0, (k - 1) // block)], bounds[min(k // block, count - 1)]) for k in range(samples + 1)]
        )
        found = off_path(off, block, boxes, position)
        assert np.all(found >= (off + each).max(axis=0))
        assert np.all(found <= (off.max(axis=0) + position) * (1.0 + 1e-9))


def test_a_certificate_has_an_ending(proved, tmp_path):
    _, file, _ = proved
    run = quadstep("prove", file, "--start", 1e-4, "--out", tmp_path / "tube")
    assert run.code == 0
    assert {one.name for one in tmp_path.iterdir()} == {"tube.json", "tube.html"}


def test_unstable_hover_has_its_cards_and_a_flight_that_leaves_it(tmp_path):
    run = quadstep("prove", Path(__file__).parent.parent / "examples" / "theorem_fails.toml", "--out", tmp_path / "p.json")
    text = re.sub(r"<svg.*?</svg>", "", (tmp_path / "p.html").read_text(encoding="utf-8"), flags=re.S).replace("\u00a0", " ")
    assert run.code == errors.DIVERGED
    assert '<span class="fails">Hover at the path’s end, (20, 5, 10) m, is proved unstable.</span>' in html.unescape(text)
    cards = re.findall(r"<dt>([^<]*)</dt><dd>([^<]*)<small>(.*?)</small>", text)
    assert [one[:2] for one in cards] == [
        ("eigenvalues outside the unit circle", "4 of 82"),
        ("growth of the fastest error", "2.15 1/s"),
    ]
    assert [re.sub("<.*?>", "", one[2]) for one in cards] == [
        "of the linearised loop from sample to sample, enclosed by interval arithmetic",
        "it doubles every 0.322 s",
    ]
    assert "the rate differs: nets take position as an input." in text
    far, *_ = re.findall(r"a flight that begins 1 mm from that hover along each axis: ([\d.]+) m at", text)
    assert float(far) > 95.0  # flown until it is beyond the limit of 100 m


def test_where_nothing_is_proved_there_is_no_table_and_no_figure(tmp_path):
    run = quadstep("prove", write(tmp_path, MISSION, "m.toml"), "--start", 0.5, "--out", tmp_path / "p.json")
    assert run.code == 1
    text = (tmp_path / "p.html").read_text(encoding="utf-8")
    assert "no bound is proved: " in text
    assert "<figure" not in text and "<table" not in text.partition("How it was computed")[0]
    assert "Undecided: " in run.out and "axis" not in run.out.replace("on each axis", "")
