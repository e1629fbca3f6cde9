"""`quadstep prove`: sets about hover that no flight ever leaves, and certificates that a check confirms or refuses."""

import itertools
import json
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import mpmath
import numpy as np
import pytest

from benchmarks.hover_boxes import hovering, row
from quadstep import Mission
from quadstep import numbers as n
from quadstep.control.registry import names
from quadstep.interfaces.controller import Measured
from quadstep.io import errors
from quadstep.mission.read import check_mission
from quadstep.numbers.enclosure import Enclosure, Fresh
from quadstep.numbers.rotations import from_rotation_vector, rotation_vector
from quadstep.proofs.prove.certificate_file import read_set
from quadstep.proofs.prove.check_loop import CheckedLoop
from quadstep.proofs.prove.check_set import UNKNOWNS, box, mapped_image, starts_of
from quadstep.proofs.prove.for_ever import sentence
from quadstep.proofs.prove.hold import Departure, invariant_set
from quadstep.proofs.prove.rest import path_rests, rest
from quadstep.proofs.prove.sampled import SampledLoop
from quadstep.proofs.prove.unknown import Unknown
from tests.commands import quadstep, write
from tests.planar_proofs import forged

PAGE = Path(__file__).parent.parent / "docs" / "prove.md"

HOVER = """\
[vehicle]
preset = "research-2.6kg"
[path]
type = "step"
start = [0.0, 0.0, 5.0]
end = [0.0, 0.0, 5.0]
duration = 4.0
[simulation]
guidance_period = 0.002
[controller]
type = "geometric"
"""


def mission(start=None, **controller):
    place = [0.0, 0.0, 5.0]
    return Mission(
        start={"position": start or place},
        vehicle={"preset": "research-2.6kg"},
        path={"type": "step", "start": place, "end": place, "duration": 4.0},
        simulation={"guidance_period": 0.002},
        controller=controller,
    )


@pytest.fixture(scope="module")
def proved(tmp_path_factory):
    folder = tmp_path_factory.mktemp("hover")
    run = quadstep("prove", write(folder, HOVER), "--out", folder / "proof.json")
    assert (run.code, run.err) == (0, "")
    return run.out, folder / "proof.json"


def test_hover_with_lagging_rotors_is_proved_to_hold_for_ever(proved):
    out, file = proved
    assert "Proved: every flight whose start is within" in out
    assert "s to 1,000,000 s (11.6 days), the longest time that this proof covers" in out
    for needed in ("attitude", "°", "rates", "°/s", "speeds", "rad/s", "m/s", "mm"):
        assert needed in out
    assert read_set(file).start > 8e-4


@pytest.mark.parametrize(
    ("start", "begun", "point"),
    [
        (3.8e-3, (0.5, 0.0, 3.0), "of (0.5, 0, 3) m"),
        (3.8e-3, (3.32347e-17, -1.44686e-22, 3.0), "of about (0, 0, 3) m"),
        (3.8e-3, (0.123456789, 0.0, 1000.25), "of about (0.123457, 0, 1000.25) m"),
        (2e-9, (1.23456789e-8, 0.0, 3.0), "of about (1.2346e-08, 0, 3) m"),
    ],
)
def test_where_a_flight_may_start_is_rounded_to_what_matters(start, begun, point):
    said = sentence(Unknown(), start, begun, True, 0.002, "1 mm along x")
    assert point in said
    shown = [float(one) for one in re.search(r"\((.*?)\) m on", said)[1].split(", ")]
    assert max(map(abs, np.subtract(shown, begun))) <= 1e-3 * start
    assert ("about" in said) == (shown != list(begun))


def test_flights_from_the_corners_and_within_stay_in_the_set(proved):
    """As they fly, by the compiled engine, every number at every sample."""
    found = read_set(proved[1])
    live, twins = list(found.live), found.twins
    into = np.linalg.inv(found.spread)
    corners = list(itertools.product((-1.0, 1.0), repeat=3))[:4]
    inner = np.random.default_rng(5).uniform(-1.0, 1.0, (2, 3)).tolist()
    most = 0.0
    for way in corners + inner:
        place = [5.0 * (axis == 2) + found.start * one for axis, one in enumerate(way)]
        loop = SampledLoop(mission(place, type="geometric").plan())
        states, _ = loop.flown()
        assert tuple(loop.names) == found.states
        off = states[1:] - found.rest
        z = off[:, live] @ into.T
        for i in found.pairs:
            z[:, i] = z[:, i + 1] = np.hypot(z[:, i], z[:, i + 1])
        most = max(most, float((np.abs(z) / found.radii).max()))
        assert all(np.array_equal(states[1:, place], states[1:, other]) for place, other in twins.items())
    assert 0.5 < most <= 1.0 + 1e-9  # the set is not idle


def test_the_check_confirms_it(proved):
    run = quadstep("prove", "--check", proved[1])
    assert (run.code, run.err) == (0, "")
    assert "Confirmed: every flight whose start is within" in run.out


def changed(key, change):
    def to(content):
        content[key] = change(content[key])

    return to


def one_radius(radii):
    fast = int(np.argmax(radii))
    return [0.3 * one if i == fast else one for i, one in enumerate(radii)]


MUTATIONS = {
    "the starts": changed("start[m]", lambda one: 1.2 * one),
    "all radii": changed("radii", lambda all_: [2.0 * one for one in all_]),
    "one radius": changed("radii", one_radius),
    "the rest": changed("rest", lambda all_: [all_[0] + 1e-3, *all_[1:]]),
    "a column": changed("spread", lambda rows: [[*row[:-1], (1.5 if i % 2 else 1.0) * row[-1]] for i, row in enumerate(rows)]),
    "the position claimed": changed("position[m]", lambda all_: [0.9 * one for one in all_]),
    "the law": changed("mission", lambda text: text + "k_Omega = [10.0, 10.0, 5.0]\n"),
    "another start": changed("mission", lambda text: text + "[start]\nvelocity = [0.0, 0.3, 0.0]\n"),
}


def check_of(folder, certificate, change):
    """What the check says of a certificate after a change of its content."""
    content = json.loads(certificate.read_text())
    change(content)
    (folder / "proof.json").write_bytes(forged(content))
    return quadstep("prove", "--check", folder / "proof.json")


@pytest.mark.parametrize("name", MUTATIONS)
def test_the_check_refuses_what_was_not_proved(tmp_path, proved, name):
    run = check_of(tmp_path, proved[1], MUTATIONS[name])
    assert (run.code, run.err) == (errors.FAILED, "")
    assert "Not confirmed: " in run.out
    assert "proved" not in run.out


BROKEN = {
    "no such state": changed("live", lambda names: [*names[:-1], "nothing.9"]),
    "no square": changed("spread", lambda rows: rows[:-1]),
    "no number": changed("radii", lambda all_: [*all_[:-1], "wide"]),
    "unknowns of another plant": changed("unknown", lambda known: {**known, "force[N]": 1e-3}),
    "a state too few": changed("live", lambda names: names[:-1]),
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_broken_certificate_is_one_line(tmp_path, proved, name):
    run = check_of(tmp_path, proved[1], BROKEN[name])
    assert run.refused
    assert "proof.json" in run.err


def test_a_loop_that_does_not_return_is_not_proved():
    loop = SampledLoop(mission(type="geometric", k_Omega=[1.0, 1.0, 1.0]).plan())
    assert path_rests(loop)
    assert isinstance(invariant_set(loop, Unknown()), Departure)


def test_estimates_that_nothing_moves_are_named():
    found = invariant_set(SampledLoop(mission(type="geometric-adaptive").plan()), Unknown())
    assert isinstance(found, str)
    assert "drag" in found
    assert "do not return by themselves" in found


def test_states_are_named_in_words():
    words = SampledLoop(mission(type="geometric").plan()).in_words("integral.2", "velocity.0", "held.torque.1")
    assert words == "the law's integral along z, velocity along x and held torque"


def test_a_law_that_rests_on_an_edge_has_no_slopes_there():
    found = invariant_set(SampledLoop(mission(type="mpc").plan()), Unknown())
    assert isinstance(found, str)
    assert " more have no slopes" in found
    assert "the loop rests exactly on an edge of the law" in found


def test_a_combination_of_estimates_that_stays_is_named():
    law = hovering("filtered-backstepping")
    assert "weights of the second net" in invariant_set(SampledLoop(law.plan()), Unknown())


PAPER = """\
path = { type = "step", start = [0.0, 0.0, 5.0], end = [0.0, 0.0, 5.0], duration = 2.0 }
controller = { type = "backstepping", nets.enabled = false }
"""


PUSHED = Unknown(force=2.3e-4, torque=2.3e-4)


def test_hover_of_the_papers_plant_holds_under_unknown_forces_and_torques(tmp_path):
    run = quadstep("prove", write(tmp_path, PAPER), "--out", tmp_path / "proof.json")
    assert (run.code, run.err) == (0, "")
    assert "any force up to 0.00023 N" in run.out
    assert "the longest time that this proof covers" in run.out.replace("\n", " ")
    assert read_set(tmp_path / "proof.json").unknown == PUSHED
    assert "| 0.976 mm | 3.42, 3.42, 3.53 mm" in PAGE.read_text()
    assert run.out.count("0.976 mm ") == 4
    assert quadstep("prove", "--check", tmp_path / "proof.json").code == 0


def test_flights_pushed_at_random_stay_in_the_papers_set():
    loop = SampledLoop(Mission(**tomllib.loads(PAPER)).plan())
    kept = invariant_set(loop, PUSHED)
    rng, flights = np.random.default_rng(3), 16
    x = [np.full(flights, one) for one in loop.at_rest(loop.like)]
    x[:3] = [one + kept.found.start * rng.choice([-1.0, 1.0], flights) for one in x[:3]]
    steady, most = rng.choice([-1.0, 1.0], (3, flights)), np.zeros(3)
    for sample in range(300):
        push = steady if sample < 150 else rng.choice([-1.0, 1.0], (3, flights))
        disturbance = loop.parameters.disturbance._replace(
            force=n.Vector(PUSHED.force * push), torque=n.Vector(PUSHED.torque * push)
        )
        x = loop.step(x, float(sample), loop.parameters._replace(disturbance=disturbance))
        off = np.array([np.broadcast_to(one, flights) for one in x]) - kept.at.state[:, None]
        assert np.all(np.abs(off) <= kept.reach[:, None])
        most = np.maximum(most, np.abs(off[:3]).max(axis=1))
    assert np.all(most > 0.1 * kept.reach[:3])  # the set is not idle


def test_a_path_that_moves_is_no_hover():
    way = {"type": "minimum-jerk", "end": [1.0, 0.0, 1.0], "duration": 2.0}
    assert not path_rests(
        SampledLoop(Mission(path=way, controller={"type": "backstepping", "nets": {"enabled": False}}).plan())
    )


def test_a_rest_is_one_and_its_slopes_are_those_of_flights():
    loop = SampledLoop(mission(type="geometric").plan())
    at = rest(loop)
    live, step = list(at.live), 1e-6
    after = np.array(loop.step(at.state.tolist(), float(loop.span)))
    assert np.abs(after - at.state).max() < 1e-9
    for i in (0, 4, len(live) - 1):
        ahead, behind = at.state.copy(), at.state.copy()
        ahead[live[i]] += step
        behind[live[i]] -= step
        slope = (np.array(loop.step(ahead.tolist(), 1e3)) - np.array(loop.step(behind.tolist(), 1e3))) / (2.0 * step)
        assert np.abs(slope[live] - at.slopes[:, i]).max() < 1e-4 * max(1.0, np.abs(slope).max())


# Forms of second order


def unit(x, y):
    """A quaternion of length one."""
    return n.vector(n.sqrt(1.0 - (x * x + y * y)), x, y, 0.0)


SMOOTH = {
    "product": lambda a, b: a * b * a,
    "quotient": lambda a, b: b / (a * a + 2.0),
    "sin": lambda a, b: n.sin(a * b),
    "cos": lambda a, b: n.cos(a + b),
    "exp": lambda a, b: n.exp(0.1 * a * b),
    "sqrt": lambda a, b: n.sqrt(a * a + b + 2.0),
    "atan2": lambda a, b: n.atan2(a * b, a + b + 2.5),
    "half a turn": lambda a, b: from_rotation_vector(n.vector(a - 0.3, b - 0.7, a * b))[1],
    "cosine of half": lambda a, b: from_rotation_vector(n.vector(a - 0.3, b - 0.7, 0.1))[0],
    "a whole turn": lambda a, b: rotation_vector(unit(0.2 * (a - 0.3), 0.3 * (b - 0.7)))[1],
}
MIDDLE = np.array([0.3, 0.7])


def second(radius):
    """Numbers about the middle whose squares have directions of their own."""
    parts = np.zeros((2, 6, 1))
    parts[0, 0], parts[1, 1] = radius, radius
    nothing, reach = np.zeros(1), np.full(1, radius)
    fresh = Fresh(6, 6, 2)
    return [Enclosure(MIDDLE[i : i + 1], parts[i], nothing, reach, fresh) for i in range(2)]


@pytest.mark.parametrize("name", SMOOTH)
def test_what_is_left_of_a_form_of_second_order_is_of_third_and_holds_all_points(name):
    rng, rests = np.random.default_rng(3), []
    for radius in (0.1, 0.01):
        found = SMOOTH[name](*second(radius))
        assert found.parts is not None
        for e in rng.choice([-1.0, 1.0, 0.3, -0.7], (60, 2)):
            value = SMOOTH[name](*(MIDDLE + radius * e).tolist())
            line = found.centre + found.parts[:2, 0] @ e + found.parts[2:, 0] @ np.outer(e, e).ravel()
            assert abs(value - line) <= found.rest + 1e-15
        rests.append(found.rest[0])
    assert rests[1] < 2.2e-3 * rests[0] + 1e-8  # a tenth of the box, a thousandth of what is left


@pytest.mark.parametrize("angle", [0.0, 1e-7, 1e-5, 2e-5, 0.3, 1.0])
def test_turns_are_held_where_a_root_would_vanish(angle):
    """At the angle itself, and in f64 as it flies."""
    axis = n.vector(0.6, 0.0, 0.8)
    zero = np.zeros(1)
    made = from_rotation_vector(axis * Enclosure(np.array([angle]), None, zero, zero))
    flown = from_rotation_vector(axis * angle)
    with mpmath.workdps(40):
        half = mpmath.mpf(angle) / 2
        for entry, by, true in zip(made, flown, (mpmath.cos(half), 0.6 * mpmath.sin(half)), strict=False):
            assert abs(true - mpmath.mpf(float(entry.centre[0]))) <= entry.rest[0] < 1e-13
            assert abs(by - float(entry.centre[0])) <= entry.rest[0]
    q = n.vector(*(Enclosure(np.array([float(one)]), None, zero, zero) for one in flown))
    back, plain = rotation_vector(q), rotation_vector(flown)
    for entry, by, part in zip(back, plain, axis, strict=True):
        assert abs(by - float(entry.centre[0])) <= entry.rest[0] + 1e-300
        assert abs(angle * part - by) < 1e-12


# The table of docs/prove.md


def test_a_state_that_a_law_writes_whatever_it_was_is_checked_as_one(proved, monkeypatch):
    """As a flag that a loop has begun: out of the sample comes a float."""
    found, after = read_set(proved[1]), CheckedLoop.after
    count, place = len(found.live), found.live[-1]
    plan = check_mission(tomllib.loads(found.mission), "proof").plan()
    loop = CheckedLoop(plan, found.states, starts_of(found))
    directions = count + count * count + UNKNOWNS
    numbers = box(found, found.spread * found.radii, count, directions)
    usual = mapped_image(loop, found, numbers, np.array([100.0]), directions)

    def written(self, *arguments):
        numbers = after(self, *arguments)
        assert not isinstance(numbers[place], float)
        numbers[place] = float(found.rest[place]) + 0.5
        return numbers

    monkeypatch.setattr(CheckedLoop, "after", written)
    image = mapped_image(loop, found, numbers, np.array([100.0]), directions)
    assert image.gap[-1] == pytest.approx(0.5)
    assert not image.parts[-1].any()
    assert image.left[-1] < 1e-14
    for one, other in zip(image, usual, strict=True):
        np.testing.assert_array_equal(one[:-1], other[:-1])
    assert usual.parts[-1].any()


@pytest.mark.thorough
def test_a_law_with_a_flag_that_its_loop_has_begun_is_proved_and_checked(tmp_path):
    law = '"hedged-backstepping"\nnets.enabled = false\nLambda1 = 1.85\nK_r1 = 8.1'
    text = HOVER.replace('"geometric"', law).replace("guidance_period = 0.002\n", "")
    run = quadstep("prove", write(tmp_path, text), "--out", tmp_path / "proof.json")
    assert (run.code, run.err) == (0, "")
    assert quadstep("prove", "--check", tmp_path / "proof.json").code == 0


ROWS = {line.split("`")[1]: line for line in PAGE.read_text().splitlines() if " mm" in line and line.startswith("| `")}
ROWS = {law: line for law, line in ROWS.items() if law in names(Measured) and "with" not in line}
QUICK = {"pid", "lqr", "adrc", "thrust-extended-backstepping", "h-infinity-linearisation"}


@pytest.mark.parametrize("law", [law if law in QUICK else pytest.param(law, marks=pytest.mark.thorough) for law in ROWS])
def test_rows_of_the_table_are_those_of_the_page(law):
    if law == "raptor":
        pytest.importorskip("foundation_policy")
    alike(ROWS[law], row(law))


@pytest.mark.parametrize("kernels", ["Nehalem", "Haswell"])
def test_a_row_does_not_depend_on_how_blas_rounds(kernels):
    """Along x and y modes are equal, and each of these mixes them in its own way; another processor ignores the name."""
    computed = [sys.executable, "-c", "from benchmarks.hover_boxes import row; print(row('lqr'))"]
    environment = os.environ | {"OPENBLAS_CORETYPE": kernels}
    done = subprocess.run(
        computed, capture_output=True, text=True, check=True, cwd=Path(__file__).parent.parent, env=environment
    )
    alike(ROWS["lqr"], done.stdout.strip())


def alike(*rows):
    """All numbers of two rows but the time that it takes, to 3 %: BLAS may still round the search otherwise."""
    said, found = (
        [float(one) for one in re.findall(r"[\d.e-]*\d", text.rpartition("|")[0].rpartition("|")[0].partition("` |")[2])]
        for text in rows
    )
    assert said == pytest.approx(found, rel=0.03)
    assert len(said) >= 8
