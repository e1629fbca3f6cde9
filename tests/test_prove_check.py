"""`quadstep prove --check` on certificates that somebody tampered with: whatever the numbers, no claim passes unproved."""

import json

import numpy as np
import pytest

from quadstep.io.documents import parse_toml
from quadstep.io.errors import UserError
from quadstep.mission.read import check_mission, plan_mission
from quadstep.proofs.prove import check_set, checker
from quadstep.proofs.prove.certificate_file import read_certificate, read_set
from quadstep.proofs.prove.check_loop import CheckedLoop
from tests.commands import quadstep
from tests.planar_proofs import SET, TUBE, checked, forged, proved


@pytest.fixture(scope="module")
def tube(tmp_path_factory):
    return proved(tmp_path_factory.mktemp("tube"), TUBE, "--start", "0.001")


@pytest.fixture(scope="module")
def hover(tmp_path_factory):
    return proved(tmp_path_factory.mktemp("set"), SET)


def loop_of(found, path):
    content = parse_toml(found.mission, "mission")
    return CheckedLoop(plan_mission(check_mission(content, "mission"), path), found.states, found.unknown)


@pytest.mark.parametrize("name", ["tube", "hover"])
def test_what_was_proved_is_confirmed(tmp_path, name, request):
    run = checked(tmp_path, request.getfixturevalue(name))
    assert (run.code, run.err) == (0, "")
    assert "Confirmed: " in run.out


@pytest.mark.parametrize("size", [1e60, 1.7e308])
def test_a_shear_whose_products_are_no_numbers_confirms_nothing(tmp_path, tube, size):
    """The boxes are so small that the enclosures see nothing of it; a comparison with NaN is false."""
    content = json.loads(json.dumps(tube))
    content["position[m]"] = [1e-15, 1e-15]
    (tmp_path / "proof.json").write_bytes(forged(content))
    found = read_certificate(tmp_path / "proof.json")
    spread, boxes = found.spread.copy(), found.boxes.copy()
    spread[5, 3], boxes[:, 3] = size, 1e-10 / size
    with np.errstate(all="ignore"):
        assert checker.failing(loop_of(found, tmp_path / "proof.json"), found._replace(spread=spread, boxes=boxes))


@pytest.mark.parametrize("size", [1e-90, 1e-310, 0.0])
def test_coordinates_whose_inverse_is_no_number_confirm_nothing(tmp_path, hover, size):
    (tmp_path / "proof.json").write_bytes(forged(hover))
    found = read_set(tmp_path / "proof.json")
    count = len(found.radii)
    other = found._replace(spread=size * np.eye(count), radii=np.full(count, 1e-3), start=0.5, position=np.full(2, 1e-300))
    with np.errstate(all="ignore"):
        assert check_set.failing(loop_of(found, tmp_path / "proof.json"), other)


def test_a_set_of_more_states_than_sums_are_bounded_for_is_not_confirmed(tmp_path, hover, monkeypatch):
    """Of 255 at most (`MOST_SUMMED`); here the bound is moved instead, as a set of 256 takes hours."""
    (tmp_path / "proof.json").write_bytes(forged(hover))
    found = read_set(tmp_path / "proof.json")
    loop, summed = (
        loop_of(found, tmp_path / "proof.json"),
        [n + n * n + check_set.UNKNOWNS for n in (len(found.live), 255, 256)],
    )
    assert summed[1] <= check_set.MOST_SUMMED < summed[2]
    monkeypatch.setattr(check_set, "MOST_SUMMED", summed[0])
    assert not check_set.failing(loop, found)
    monkeypatch.setattr(check_set, "MOST_SUMMED", summed[0] - 1)
    assert f"{len(found.live)} moving states have more pairs" in check_set.failing(loop, found)


def put(*where):
    *way, value = where

    def change(content):
        for key in way[:-1]:
            content = content[key]
        content[way[-1]] = value(content[way[-1]]) if callable(value) else value

    return change


def test_a_set_for_one_start_alone_is_confirmed_as_one(tmp_path, hover):
    run = checked(tmp_path, {**hover, "start[m]": 0.0})
    assert (run.code, run.err) == (0, "")
    assert "within 0 mm of" in run.out


OUT_OF_RANGE = {
    "a negative start": ("tube", put("unknown", "start[m]", -5e-6)),
    "a negative force": ("tube", put("unknown", "force[N]", -1e-3)),
    "a share of the mass below nothing": ("tube", put("unknown", "mass[-]", -0.1)),
    "an inertia that may be zero": ("tube", put("unknown", "inertia[-]", 1.0)),
    "a negative box": ("tube", put("boxes", 0, 2, lambda box: -box)),
    "a box below all numbers": ("tube", put("boxes", 0, 2, 1e-318)),
    "a shear above all numbers": ("tube", put("spread", 5, 3, 1.7e308)),
    "a number of 400 digits": ("tube", put("boxes", 0, 2, 10**400)),
    "a negative claim": ("tube", put("position[m]", 0, -1.0)),
    "a block of all samples": ("tube", put("samples_per_block", 10**6)),
    "a set from a negative start": ("hover", put("start[m]", -1e-3)),
    "a set of nothing": ("hover", put("radii", 0, 0.0)),
    "a negative radius": ("hover", put("radii", 0, lambda radius: -radius)),
    "coordinates below all numbers": ("hover", put("spread", 0, 0, 1e-310)),
    "a start that is neither": ("hover", put("own_start", "false")),
}


@pytest.mark.parametrize("name", OUT_OF_RANGE)
def test_numbers_out_of_their_range_are_one_line(tmp_path, name, request):
    base, change = OUT_OF_RANGE[name]
    content = json.loads(json.dumps(request.getfixturevalue(base)))
    change(content)
    run = checked(tmp_path, content)
    assert run.refused
    assert "tampered.json" in run.err


RUNS = """
from pathlib import Path

Path(__file__).with_name("ran").touch()
"""


@pytest.mark.parametrize("where", ["stranger.py", "stranger", "../stranger.py", "antigravity"])
@pytest.mark.parametrize("base", ["tube", "hover"])
def test_a_stranger_s_certificate_runs_no_code_that_the_reader_does_not_name(tmp_path, where, base, request):
    (tmp_path / "far").mkdir()
    for folder in (tmp_path, tmp_path / "far"):
        (folder / "stranger.py").write_text(RUNS)
    content = json.loads(json.dumps(request.getfixturevalue(base)))
    content["mission"] = content["mission"].replace("planar-pd", f"{where}:Law")
    content["folder"] = "."
    run = checked(tmp_path / "far", content)
    assert run.refused
    assert f"is code, which is not run unless you name its file: --controller {where}" in run.err
    assert not list(tmp_path.rglob("ran"))


def test_the_code_that_the_reader_names_is_run_and_no_other(tmp_path, tube):
    (tmp_path / "stranger.py").write_text(RUNS)
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "stranger.py").write_text(
        "from dataclasses import dataclass\nfrom quadstep.control.planar import PlanarPd\n\n"
        "@dataclass(frozen=True)\nclass Law(PlanarPd):\n    name = 'law'\n"
    )
    content = json.loads(json.dumps(tube))
    content["mission"] = content["mission"].replace("planar-pd", "stranger.py:Law")
    (tmp_path / "tampered.json").write_bytes(forged(content))
    run = quadstep("prove", "--check", tmp_path / "tampered.json", "--controller", tmp_path / "mine" / "stranger.py")
    assert (run.code, run.err) == (0, "")
    assert "Of users' code, only" in run.out
    assert not list(tmp_path.rglob("ran"))
    assert quadstep("prove", "mission.toml", "--controller", "stranger.py").refused


@pytest.mark.parametrize("content", [[], 3, {}, {"format": "quadstep-invariant-99"}, {"format": 7}], ids=str)
def test_a_format_of_no_kind_is_refused_without_the_name_of_one(tmp_path, content):
    path = tmp_path / "proof.json"
    path.write_text(json.dumps(content))
    with pytest.raises(UserError, match=r"not a certificate of `quadstep prove`(: this version does not write its format)?$"):
        read_certificate(path)


@pytest.mark.parametrize("name", ["tube", "hover"])
def test_no_changed_byte_of_a_certificate_is_believed(tmp_path, name, request):
    """Whoever changes it must compute its digest again; then it is proved anew, as in the tests above."""
    path, whole, read = (
        tmp_path / "proof.json",
        forged(request.getfixturevalue(name)),
        {"tube": read_certificate, "hover": read_set},
    )
    for place in range(0, len(whole), 7):
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 1 << place % 8]) + whole[place + 1 :])
        with pytest.raises(UserError, match=r"proof\.json: "):
            read[name](path)
    path.write_bytes(whole.replace(b'"sha256"', b'"sha257"'))
    with pytest.raises(UserError, match=r"proof\.json: has no digest of its content \('sha256'\)"):
        read[name](path)
    path.write_bytes(whole)
    read[name](path)


def test_what_a_certificate_lacks_is_said(tmp_path, tube, hover):
    path = tmp_path / "proof.json"
    for whole, read in ((tube, read_certificate), (hover, read_set)):
        path.write_bytes(forged({key: value for key, value in whole.items() if key != "states"}))
        with pytest.raises(UserError, match="not a certificate of `quadstep prove`: 'states' is missing"):
            read(path)
