"""`quadstep prove`: hover that is unstable, on vehicles whose rest is no exact equilibrium and under laws with limits."""

import inspect
import warnings
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from quadstep import Mission
from quadstep.engines.fly import fly
from quadstep.io import errors
from quadstep.mission.read import check_mission
from quadstep.numbers import Vector, maximum, minimum, sqrt, where
from quadstep.numbers.enclosure import UndefinedError
from quadstep.page.folder import results
from quadstep.proofs.prove.hold import Departure, escape, escaped, inner, invariant_set, narrow
from quadstep.proofs.prove.hover import hover, instability, is_equilibrium, jacobian
from quadstep.proofs.prove.invariant import Growth, SetArithmetic
from quadstep.proofs.prove.jet import bounded, jets
from quadstep.proofs.prove.linear_maps import modes
from quadstep.proofs.prove.rest import rest
from quadstep.proofs.prove.sampled import SampledLoop
from quadstep.proofs.prove.unknown import Unknown
from tests.commands import quadstep, write

PAGE = Path(__file__).parent.parent / "docs" / "prove.md"
PLACE = [0.0, 0.0, 5.0]

HOVER = """\
[vehicle]
preset = "research-2.6kg"
[path]
type = "step"
start = [0.0, 0.0, 5.0]
end = [0.0, 0.0, 5.0]
duration = 4.0
[controller]
type = "pid"
"""

FAST = {"attitude": [60.0, 60.0, 20.0]}
"""Attitude gains that rotors with lag do not allow."""


def loop_of(controller, **more):
    content = {
        "vehicle": {"preset": "research-2.6kg"},
        "path": {"type": "step", "start": PLACE, "end": PLACE, "duration": 4.0},
        "controller": {"type": "pid", **controller},
        **more,
    }
    return SampledLoop(Mission.model_validate(content).plan())


@pytest.fixture(scope="module")
def found():
    """The loop, its set's arithmetic, and the proof that flights leave."""
    loop = loop_of(FAST)
    at = rest(loop)
    chosen = modes(at.slopes)
    arithmetic = SetArithmetic(loop, at, chosen, Unknown())
    return loop, arithmetic, escape(arithmetic, int(np.argmax(np.abs(chosen.values))))


def test_a_loop_that_is_too_fast_for_its_rotors_is_disproved(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run = quadstep("prove", write(tmp_path, HOVER + "attitude = [60.0, 60.0, 20.0]\n"))
    assert (run.code, run.err) == (errors.DIVERGED, "")
    said = " ".join(run.out.split())
    assert said.startswith("Hover is proved unstable. There is a state, off its rest by no more than the first column of the")
    assert "from which the flight leaves the box of the second within 0.53 s" in said
    assert "rates 0.184°/s 1, 1, 0.0337°/s" in said
    assert "mm; rates 1, 1, 0.0337°/s | 0.53 s |" in PAGE.read_text()
    assert [file.name for file in (tmp_path / "out").iterdir()] == ["mission-proof.html"]
    assert [one.loop for one in results(tmp_path / "out")] == ["unstable"], "serve marks it"


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_the_flight_from_the_start_named_leaves_the_box_in_time(found, way):
    """As the law flies, sample by sample, in floats."""
    loop, arithmetic, proof = found
    at, live = arithmetic.at, list(arithmetic.at.live)
    state = at.state.copy()
    state[live] += way * proof.begun
    turn = slice(at.unit, at.unit + 4)
    state[turn] /= np.linalg.norm(state[turn])
    inside = [True]
    assert np.all(np.abs(state[live] - at.state[live]) <= proof.box)
    for sample in range(1, proof.samples + 1):
        state = np.array(loop.step(state.tolist(), float(sample * loop.span)))
        inside.append(bool(np.all(np.abs(state[live] - at.state[live]) <= proof.box)))
    assert not all(inside)
    assert inside[1]


def test_a_smaller_start_would_need_longer(found):
    """The time is no idle bound: a hundredth of the start is still inside then."""
    loop, arithmetic, proof = found
    at, live = arithmetic.at, list(arithmetic.at.live)
    state = at.state.copy()
    state[live] += 0.01 * proof.begun
    for sample in range(1, proof.samples // 2):
        state = np.array(loop.step(state.tolist(), float(sample * loop.span)))
    assert np.all(np.abs(state[live] - at.state[live]) <= proof.box)


def test_a_set_of_a_stable_loop_shows_nothing():
    loop = loop_of({})
    at = rest(loop)
    chosen = modes(at.slopes)
    arithmetic = SetArithmetic(loop, at, chosen, Unknown())
    mode, slowest = int(np.argmax(np.abs(chosen.values))), np.abs(chosen.values) >= np.abs(chosen.values).max()
    radii, growth = narrow(arithmetic, slowest, arithmetic.even(1e-2 / np.abs(chosen.spread).max(axis=0)))
    assert escaped(arithmetic, mode, slowest, radii, growth, inner(arithmetic, slowest, radii)) is None


def test_coordinates_that_are_astray_make_the_start_larger_or_show_nothing():
    """A mode that grows tenfold leaves the set, and what is astray of its image is more than of the set."""
    grows, radii, box = np.array([True, True]), np.ones(2), np.full(2, 0.5)
    shares = []
    for astray in (0.0, 5e-4, 4e-3, 0.6):
        off = np.array([[0.0, astray], [0.0, 0.0]])
        lines = np.diag([1.1, 10.0]) + off * radii
        seen = Growth(lines, np.zeros((2, 2, 2)), np.zeros(2), np.full(2, 1e-6))
        at = SimpleNamespace(
            astray=off,
            into=np.eye(2),
            modes=SimpleNamespace(spread=np.eye(2)),
            at=SimpleNamespace(state=np.zeros(2)),
            place=[0, 1],
        )
        found = escaped(at, 0, grows, radii, seen, box)
        shares.append(None if found is None else found.begun[0])
    least = [2.0 * (1e-6 + 10.0 * astray) / 0.1 for astray in (0.0, 5e-4)]
    assert shares[0] >= least[0]
    assert shares[1] >= least[1]
    assert shares[2:] == [None, None]


@pytest.mark.parametrize("error", [1e-4, 1.0])
def test_a_bad_inverse_of_the_modes_shows_nothing(found, error):
    """One that would pass if only the set, and not its image, were taken for astray."""
    loop, arithmetic, _ = found
    bad = SetArithmetic(loop, arithmetic.at, arithmetic.modes, Unknown())
    bad.into = bad.into + error * np.ones_like(bad.into)
    bad.astray = np.abs(np.eye(len(bad.into)) - bad.into @ bad.modes.spread @ bad.parted) + arithmetic.astray
    assert escape(bad, int(np.argmax(np.abs(bad.modes.values)))) is None


def test_a_mode_that_grows_in_the_closest_vicinity_only_disproves_nothing():
    """Its sign is smoothed within so thin a layer that the samples cannot follow it there."""
    loop = loop_of({"type": "super-twisting", "layer": 1e-4})
    said = invariant_set(loop, Unknown())
    assert not isinstance(said, Departure)
    assert said == "the loop does not return to its rest: a mode grows at 23 1/s"


def test_a_loop_of_a_thousand_numbers_has_no_set():
    """A latency is kept sample by sample."""
    said = invariant_set(loop_of({"type": "lqr"}, sensors={"latency": 0.2}), Unknown())
    assert said == "1019 numbers move from sample to sample, and sets are computed for 200 at the most"


LIMITED = """\
from dataclasses import dataclass
from typing import NamedTuple

from quadstep.interfaces.controller import Command, Controller
from quadstep.interfaces.gain import believed, gain, given
from quadstep.control.vectoring import invert_force
from quadstep.numbers import Number, minimum, vector
from quadstep.vehicle.paper import State


class Gains(NamedTuple):
    mass: Number = believed("mass")
    gravity: Number = given(lambda model: model.gravity)
    k_w: Number = gain(300.0, "N m s", "angular rates")


class Memory(NamedTuple):
    pass


@dataclass(frozen=True)
class Limited(Controller):
    name = "limited"
    label = "limited"
    Gains = Gains
    measures = State

    def start(self, measured, gains):
        return Memory()

    def law(self, memory, measured, reference, gains, t, period):
        wanted = 2.0 * (reference.position - measured.position) - 3.0 * measured.velocity + vector(0.0, 0.0, gains.gravity)
        thrust, theta_d, phi_d = invert_force(gains.mass * wanted)
        desired = vector(reference.yaw, theta_d, phi_d)
        torque = 400.0 * (desired - measured.attitude) - gains.k_w * measured.rates
        return Command(minimum(thrust, 50.0), torque, desired), memory
"""


def test_a_law_with_a_limit_is_disproved_on_the_papers_plant(tmp_path):
    (tmp_path / "limited.py").write_text(LIMITED)
    place = "start = [0.0, 0.0, 5.0]\nend = [0.0, 0.0, 5.0]\n"
    text = f'[path]\ntype = "step"\n{place}duration = 4.0\n[controller]\ntype = "limited.py:Limited"\nk_w = 0.01\n'
    run = quadstep("prove", write(tmp_path, text), "--out", tmp_path / "out" / "mission-proof.json")
    assert (run.code, run.err) == (errors.DIVERGED, "")
    said, page = " ".join(run.out.split()), (tmp_path / "out" / "mission-proof.html").read_text(encoding="utf-8")
    assert said.startswith(
        "Hover at the path's end, (0, 0, 5) m, is proved unstable. Flights that begin near it do not all stay near it."
    )
    assert "eigenvalues outside the unit circle 6 of 12" in said
    assert [one.loop for one in results(tmp_path / "out")] == ["unstable"]
    assert "begins 1\u00a0mm from that hover" in page  # and no figure of the mission's own flight


EDGES = (
    "where(v >= 0.0, 0.5 * v, -4.0 * v)",
    "where(v < 0.0, -4.0 * v, 0.5 * v)",
    "maximum(0.5 * v, -4.0 * v)",
    "2.25 * abs(v) - 1.75 * v",
)
"""Written in several ways: a climb gathers speed, a descent is damped, more strongly. All in all, hover is stable."""


def settled(folder, law, axis, away, duration, within):
    """The loop of a law of one's own and the hover that it comes to, from so far away along an axis."""
    (folder / "limited.py").write_text(law)
    content = {
        "path": {"type": "step", "start": PLACE, "end": PLACE, "duration": duration},
        "controller": {"type": "limited.py:Limited", "k_w": 40.0},
        "disturbance": {"scale": 0.0},
        "start": {"position": [place + away * (name == axis) for name, place in zip("xyz", PLACE, strict=True)]},
    }
    mission = check_mission(content, "mission", folder)
    plan = mission.plan(folder)
    assert abs(fly(plan).table(axis)[-1, 0] - PLACE["xyz".index(axis)]) < within
    loop = SampledLoop(plan)
    at = hover(mission, plan, loop)
    assert is_equilibrium(loop, at)
    return loop, at


@pytest.mark.parametrize("edge", EDGES)
def test_one_side_of_an_edge_at_rest_disproves_nothing(tmp_path, edge):
    law = LIMITED.replace("import Number, minimum, vector", "import Number, maximum, minimum, vector, where")
    law = law.replace(
        "        thrust, ",
        f"        v = measured.velocity[2]\n        wanted += vector(0.0, 0.0, 3.0 * v + {edge})\n        thrust, ",
    )
    loop, at = settled(tmp_path, law, "z", -4.5, 60.0, 1e-6)
    with pytest.raises(UndefinedError, match="has no derivative there"):
        jacobian(loop, at)
    assert instability(loop, at) is None


def test_a_bend_times_what_is_zero_there_has_a_slope():
    """As of drag, |v| v; and a choice between smooth functions that touch there."""
    (x,) = jets([0.0])
    for number in (abs(x) * x, x * maximum(x, -2.0 * x), where(x > 0.0, x * x, -(x * x))):
        assert not number.kinked
        assert number.slopes.size.max() == 0.0
    for number in (abs(x), minimum(x, 2.0 * x), where(x > 0.0, x * x, x)):
        assert number.kinked
    for number in (where(x > 0.0, x, 1.0), where(x * x > 0.0, 1.0 + x, x)):
        assert not np.isfinite(number.slopes.tight).any()
    assert where(x + 1.0 > 0.0, x, 1.0).slopes.centre == 1.0


def rooted(x):
    """sign(x) |x|^(1/2) |x|^(1/2), which is x."""
    size = Vector([sqrt(sqrt(x * x))]).norm()
    return where(x > 0.0, size, -size) * size


@np.errstate(all="ignore")
def test_slopes_without_bound_stay_so_whatever_is_computed_from_them():
    x, y = jets([0.0, 0.0])
    root = sqrt(abs(x))
    for number in (
        root,
        sqrt(root * root),
        root * root,
        Vector([root, y]).norm(),
        rooted(x),
        3.0 * root - root,
        abs(root) * y,
    ):
        assert not bounded(number)
    for number in (sqrt(where(y > 0.0, x * x, abs(x))), sqrt(maximum(x * x, abs(y)))):
        assert not bounded(number)
    for number in (sqrt(maximum(x * x, y * y)), Vector([abs(x), y]).norm()):
        assert number.kinked
        assert bounded(number)


def test_a_law_written_with_roots_is_not_said_to_be_unstable(tmp_path):
    """A damped offset, with the law's answer to it computed as sign(e) |e|^(1/2) |e|^(1/2); without that answer it grows."""
    law = LIMITED.replace("import Number, minimum, vector", "import Number, Vector, minimum, sqrt, vector, where")
    law = law.replace("@dataclass", f"{inspect.getsource(rooted)}\n\n@dataclass").replace(
        "        thrust, ",
        "        x = reference.position[0] - measured.position[0]\n"
        "        wanted += vector(4.0 * rooted(x) - 4.5 * x, 0.0, 0.0)\n        thrust, ",
    )
    loop, at = settled(tmp_path, law, "x", 0.1, 30.0, 1e-3)
    assert instability(loop, at) is None


BENT = """\
        size = (reference.position - measured.position).norm()
        lost = 0.001 * size * measured.position[0] * sqrt(2.0 * size + 1e-300)
        return Command(thrust + lost"""


def test_a_force_without_slopes_at_rest_is_no_warning(tmp_path):
    law = LIMITED.replace("        return Command(minimum(thrust, 50.0)", BENT)
    (tmp_path / "limited.py").write_text(law.replace("import Number, minimum, vector", "import Number, sqrt, vector"))
    place = "start = [0.0, 0.0, 5.0]\nend = [0.0, 0.0, 5.0]\n"
    text = f'[path]\ntype = "step"\n{place}duration = 4.0\n[controller]\ntype = "limited.py:Limited"\nk_w = 0.01\n'
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run = quadstep("prove", write(tmp_path, text))
    assert run.refused
    assert "a square root of a number that may be negative (limited.py" in run.err
