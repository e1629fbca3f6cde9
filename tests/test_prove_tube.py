"""`quadstep prove`: tubes in which every flight stays, and certificates that an independent check confirms or refuses."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from quadstep import Mission
from quadstep.numbers import Vector, sqrt
from quadstep.proofs.prove.certificate_file import read_certificate
from quadstep.proofs.prove.check_loop import CONSTANTS, PUSHES
from quadstep.proofs.prove.checker import STRIDE, block, check_certificate, from_the_start, grown, passage
from quadstep.proofs.prove.linear_maps import coordinates
from quadstep.proofs.prove.sampled import SampledLoop
from quadstep.proofs.prove.tube import SAMPLES, Tube, tube
from quadstep.proofs.prove.unknown import Unknown
from tests.commands import quadstep, write
from tests.planar_proofs import forged

NETS_OFF = '[controller]\ntype = "backstepping"\nnets.enabled = false\n'
SHORT = f'[path]\ntype = "minimum-jerk"\nend = [1.0, 0.5, 0.5]\nduration = 4.0\n{NETS_OFF}[simulation]\nduration = 0.3\n'
UNKNOWN = Unknown(force=2.3e-4, torque=2.3e-4, mass=0.003, inertia=0.02, start=1e-3)


@pytest.fixture(scope="module")
def loop():
    controller = {"type": "backstepping", "nets": {"enabled": False}}
    path = {"type": "minimum-jerk", "end": [1.0, 0.5, 0.5], "duration": 4.0}
    return SampledLoop(Mission(path=path, controller=controller, simulation={"duration": 0.5}).plan())


@pytest.fixture(scope="module")
def found(loop):
    flown, _ = loop.flown()
    chosen = coordinates(loop, flown, UNKNOWN)
    result = tube(loop, flown, UNKNOWN, chosen, 3)
    assert isinstance(result, Tube)
    return flown, chosen, result


def test_the_centre_line_is_the_flight_bit_by_bit(loop, found):
    flown, _, _ = found
    x = list(map(float, flown[0]))
    for sample in range(3):
        x = loop.step(x, float(sample))
        assert np.array_equal(x, flown[sample + 1])


def test_random_flights_never_leave_the_tube(loop, found):
    flown, chosen, result = found
    rng, flights = np.random.default_rng(7), 24
    p = loop.parameters

    def sign():
        drawn = rng.uniform(-1.0, 1.0, (3, flights))
        return np.sign(drawn) * np.where(np.arange(flights) % 2, 1.0, np.abs(drawn))

    vehicle = p.vehicle._replace(
        mass=p.vehicle.mass * (1.0 + UNKNOWN.mass * sign()[0]),
        inertia=Vector([one * (1.0 + UNKNOWN.inertia * way) for one, way in zip(p.vehicle.inertia, sign(), strict=True)]),
    )
    x = [np.full(flights, one) for one in flown[0]]
    x[:3] = [one + UNKNOWN.start * way for one, way in zip(x[:3], sign(), strict=True)]
    steady, nearest = sign(), 0.0
    for sample in range(len(flown) - 1):
        push = steady if sample < 80 else sign()
        disturbance = p.disturbance._replace(force=Vector(UNKNOWN.force * push), torque=Vector(UNKNOWN.torque * sign()))
        x = loop.step(x, float(sample), p._replace(vehicle=vehicle, disturbance=disturbance))
        off = np.array([np.broadcast_to(one, flights) for one in x]) - flown[sample + 1][:, None]
        assert np.all(np.abs(chosen.into @ off) <= result.boxes[sample // SAMPLES][:, None] * (1.0 + 1e-9))
        assert np.all(np.abs(off[:3]) <= result.position[sample + 1][:, None] * (1.0 + 1e-9))
        nearest = max(nearest, float((np.abs(off[:3]) / result.position[sample + 1][:, None]).max()))
    assert nearest > 0.5  # the tube is not idle


def test_coordinates_are_inverse_to_each_other(found):
    _, chosen, _ = found
    assert np.array_equal(chosen.into @ chosen.spread, np.eye(len(chosen.into)))
    assert np.array_equal(chosen.into[:3], np.eye(len(chosen.into))[:3])


@pytest.fixture(scope="module")
def certificate(tmp_path_factory):
    folder = tmp_path_factory.mktemp("proof")
    run = quadstep("prove", write(folder, SHORT), "--out", folder / "proof.json")
    assert (run.code, run.err) == (0, "")
    assert (
        "Proved: under any force up to 0.00023 N and any torque up to 0.00023 N m on each axis (free to change at" in run.out
    )
    return json.loads((folder / "proof.json").read_text())


def written(folder, content):
    (folder / "proof.json").write_bytes(forged(content))
    return folder / "proof.json"


def checked(folder, content):
    return quadstep("prove", "--check", written(folder, content))


def test_the_check_confirms_a_certificate(tmp_path, certificate):
    run = checked(tmp_path, certificate)
    assert (run.code, run.err) == (0, "")
    assert "of its path at all samples of the 0.3 s flight." in run.out
    again = quadstep("prove", write(tmp_path, SHORT), "--out", tmp_path / "again.json")
    rows = [[line for line in out.splitlines() if line[:1] in "xyz" and " mm " in f"{line} "] for out in (run.out, again.out)]
    assert len(rows[0]) == 3
    assert rows[0] == rows[1]


LONGER = {
    "nets": (SHORT.replace("nets.enabled = false", ""), []),
    "unknown constants": (SHORT, ["--mass", "0.003", "--inertia", "0.02", "--start", "0.001"]),
}


@pytest.mark.parametrize("name", LONGER)
def test_tubes_longer_than_the_recent_past_are_confirmed(tmp_path, name):
    text, options = LONGER[name]
    file = write(tmp_path, text.replace("duration = 0.3", "duration = 0.444"))  # the last block is a short one
    run = quadstep("prove", file, *options, "--out", tmp_path / "proof.json")
    assert (run.code, run.err) == (0, "")
    assert "at all 223 samples" in run.out
    assert len(read_certificate(tmp_path / "proof.json").boxes) == 9
    assert quadstep("prove", "--check", tmp_path / "proof.json").code == 0


class CaughtError(Exception):
    pass


def test_remainders_of_different_numbers_have_different_directions(tmp_path, monkeypatch, certificate):
    """In the check as in the prover: sqrt(a) - sqrt(b) is as wide as the two together."""

    def after(self, x, ticks, p):
        raise CaughtError(x)

    monkeypatch.setattr("quadstep.proofs.prove.check_loop.CheckedLoop.after", after)
    with pytest.raises(CaughtError) as caught:
        check_certificate(written(tmp_path, certificate))
    (numbers,) = caught.value.args
    assert len({id(number.fresh) for number in numbers}) == 1
    half = [number * (0.5 / number.tight.max()) for number in numbers[:2]]
    a, b = (1.0 + one - one.centre for one in half)
    assert np.all((sqrt(a) - sqrt(b)).high >= np.sqrt(1.5) - np.sqrt(0.5))


@pytest.mark.parametrize("curved", [0.0, 1.0])
def test_bounds_of_the_check_hold_the_worst_flight_and_without_remainders_are_met_by_it(curved):
    """Of random linear loops, in sheared coordinates: the worst pushes, constants and remainders, summed exactly."""
    rng, n, axes, samples, count = np.random.default_rng(4), 4, 2, 12, 10
    spread = np.eye(n)
    spread[2, [0, 3]] = 0.7, -0.4
    into, start, box = 2.0 * np.eye(n) - spread, np.array([0.3, 0.2, 0.0, 0.0]), np.full(n, 200.0)
    blocks, moving, constant, worst = [], np.diag(start), np.zeros((n, CONSTANTS)), []
    for _ in range(count):
        step = 0.9 * np.linalg.qr(rng.normal(size=(n, n)))[0]
        pushes, steady, rest = rng.normal(size=(n, PUSHES)), rng.normal(size=(n, CONSTANTS)), curved * rng.uniform(0.5, 2.0, n)
        once = passage(step, pushes, steady, rest, np.abs(spread) @ box)
        assert np.all(once.box >= rest + 2.0**-52 * (np.abs(step) @ (np.abs(spread) @ box)))
        blocks.append(block(once, samples, box, into, spread))
        worst.append([])
        for _ in range(samples + 1):
            worst[-1].append(np.abs(into @ moving).sum(axis=1) + np.abs(into @ constant).sum(axis=1))
            before = moving, constant
            moving, constant = np.hstack([step @ moving, pushes, np.diag(rest)]), step @ constant + steady
        moving, constant = before
    begun = passage(np.zeros((n, n)), np.diag(start), np.zeros((n, CONSTANTS)), np.zeros(n), np.zeros(n))
    known = from_the_start(blocks, begun, axes)
    for place, exact in enumerate(map(np.array, worst)):
        found = grown(blocks, begun, place, known, axes)
        assert np.all(found >= exact)
        assert np.all(found <= 4.0 * exact)
        if not curved:
            assert np.all(found[0] <= exact[0] * (1.0 + 1e-9))
            assert np.all(found[STRIDE::STRIDE, :axes] <= exact[STRIDE::STRIDE, :axes] * (1.0 + 1e-9))


SOURCES = Path(__file__).parent.parent / "src" / "quadstep" / "proofs" / "prove"
SHARED = {"certificate_file", "unknown"}
"""What files and options hold."""


@pytest.mark.parametrize("own", [{"checker", "check_loop"}, {"check_set", "check_loop"}])
def test_a_check_is_short_and_shares_nothing_with_the_prover(own):
    texts = [(SOURCES / f"{name}.py").read_text() for name in own]
    assert {name for text in texts for name in re.findall(r"from quadstep\.proofs\.prove\.(\w+) import", text)} <= own | SHARED
    assert sum(len(text.splitlines()) for text in texts) < 400


def scaled(key, factor):
    return lambda content: content.update({key: (np.array(content[key]) * factor).tolist()})


def wider(name, value):
    return lambda content: content["unknown"].update({name: value})


def shrunk_box(content):
    content["boxes"][1][3] *= 0.5


def other_gain(content):
    content["mission"] = content["mission"].replace("nets.enabled = false", "nets.enabled = false\nK_r1 = 2.9")


MUTATIONS = {
    "all boxes": scaled("boxes", 0.5),
    "one box": shrunk_box,
    "the position claimed": scaled("position[m]", 0.9),
    "force": wider("force[N]", 3e-4),
    "torque": wider("torque[N m]", 1.0),
    "mass": wider("mass[-]", 1e-3),
    "inertia": wider("inertia[-]", 0.05),
    "start": wider("start[m]", 1e-4),
    "the law": other_gain,
}


@pytest.mark.parametrize("name", MUTATIONS)
def test_the_check_refuses_a_certificate_that_says_more_than_was_proved(tmp_path, certificate, name):
    content = json.loads(json.dumps(certificate))
    MUTATIONS[name](content)
    run = checked(tmp_path, content)
    assert (run.code, run.err) == (1, "")
    assert "Not confirmed: " in run.out
    assert "proved" not in run.out


BROKEN = {
    "no JSON": lambda text: text[:-20],
    "another format": lambda text: text.replace("quadstep tube 3", "quadstep tube 9"),
    "no states": lambda text: text.replace('"integral_1.0"', '"integral_9.0"'),
    "not a flight": lambda text: text.replace('"flown": "', '"flown": "!'),
    "blocks of nothing": lambda text: text.replace('"samples_per_block": 25', '"samples_per_block": 0'),
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_broken_certificate_is_one_line(tmp_path, certificate, name):
    (tmp_path / "proof.json").write_bytes(forged(BROKEN[name](json.dumps(certificate))))
    run = quadstep("prove", "--check", tmp_path / "proof.json")
    assert run.refused
    assert "proof.json" in run.err


WAY = '[path]\ntype = "minimum-jerk"\nstart = [0.0, 0.0, 2.0]\nend = [1.0, 0.0, 2.0]\nduration = 2.0\n'
X500 = '[vehicle]\npreset = "x500"\n' + WAY

REFUSED = {
    "force": (SHORT, ["--force", "-1.0"], "--force: should be from 0"),
    "mass": (SHORT, ["--mass", "nan"], "--mass: should be from 0"),
    "airframe": (X500 + '[controller]\ntype = "pid"\n', ["--force", "0.1"], "--force: supported only on the paper's plant"),
    "too heavy": (X500.replace('x500"\n', 'x500"\nmass = 50.0\n'), [],
        "its rotors lift at most 48.5 N; it could with a mass below 4.944 kg"),
    "singular": (SHORT, ["--start", "30.0"], "no bound of the first sample over the starts and unknowns: an angle"),
    "noise": (X500 + "[sensors]\ngyro_noise = 0.01\n", [], "sensors: nothing can be proved with unbounded noise"),
    "late": (X500 + "[sensors]\nlatency = 3.0\n", [], "latency"),
    "random law": (X500 + '[controller]\ntype = "mppi"\n', [], "controller: nothing can be proved about it"),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_proved_is_one_line(tmp_path, name):
    text, options, needed = REFUSED[name]
    run = quadstep("prove", write(tmp_path, text), *options)
    assert run.refused
    assert "mission.toml" in run.err
    assert needed in run.err
    assert list(tmp_path.iterdir()) == [tmp_path / "mission.toml"]


def test_a_mission_or_a_certificate_is_needed():
    assert quadstep("prove").refused


def test_a_mission_and_a_certificate_are_not_both_taken(tmp_path):
    run = quadstep("prove", write(tmp_path, SHORT), "--check", tmp_path / "proof.json")
    assert run.refused
    assert "not both" in run.err


NO_PLACES = {
    "a folder": ("", "is a folder; name a file"),
    "no certificate": ("precious.txt", "exists and is not a certificate of `quadstep prove`; choose another --out"),
    "other JSON": ("precious.json", "exists and is not a certificate of `quadstep prove`; choose another --out"),
    "through an absent folder": ("absent/../precious.txt", "cannot be written: no folder"),
    "in a file": ("precious.txt/proof.json", "cannot be written: no folder"),
    "a folder that takes no file": ("/proc/proof.json", "cannot be written: "),
}


@pytest.mark.parametrize("name", NO_PLACES)
def test_where_a_certificate_cannot_be_written_is_said_before_the_proof(tmp_path, monkeypatch, name):
    monkeypatch.setattr("quadstep.proofs.prove.run.prove_mission", None)
    place, needed = NO_PLACES[name]
    for file, content in (("precious.txt", "mine"), ("precious.json", "[1]")):
        (tmp_path / file).write_text(content)
    run = quadstep("prove", write(tmp_path, SHORT), "--out", tmp_path / place)
    assert run.refused
    assert needed in run.err
    assert (tmp_path / "precious.txt").read_text() == "mine"


def test_an_earlier_certificate_is_replaced(tmp_path, certificate):
    (tmp_path / "proof.json").write_text(json.dumps(certificate).replace("0.3", "0.2"))
    run = quadstep("prove", write(tmp_path, SHORT), "--out", tmp_path / "proof.json")
    assert (run.code, run.err) == (0, "")
    assert json.loads((tmp_path / "proof.json").read_text()) == certificate


OWN = """
from dataclasses import dataclass
from typing import NamedTuple

from quadstep.interfaces.controller import Command, Controller, Measured
from quadstep.interfaces.gain import believed
from quadstep.numbers import Number, Vector, vector


class Gains(NamedTuple):
    mass: Number = believed("mass")
    inertia: Vector = believed("inertia")


@dataclass(frozen=True)
class Still(Controller):
    name = "still"
    Gains = Gains
    measures = Measured

    def start(self, measured, gains):
        return ()

    def law(self, memory, measured, reference, gains, t, period):
        thrust = gains.mass * (9.81 - measured.velocity[2])
        return Command(thrust, -4.0 * gains.inertia * measured.rates{more}), memory
"""
STILL = """
vehicle.preset = "x500"
path = { type = "step", start = [0.0, 0.0, 3.0], end = [0.0, 0.0, 3.0] }
controller.type = "own.py:Still"
simulation.duration = 0.1
"""


def test_a_command_without_a_desired_attitude_is_proved_like_one_of_zeros(tmp_path):
    shown = []
    for more in ("", ", vector(0.0, 0.0, 0.0)"):
        (tmp_path / "own.py").write_text(OWN.replace("{more}", more))
        run = quadstep("prove", write(tmp_path, STILL), "--start", "0.001", "--out", tmp_path / "proof.json")
        assert (run.code, run.err) == (0, "")
        assert quadstep("prove", "--check", tmp_path / "proof.json", "--controller", tmp_path / "own.py").code == 0
        shown.append((run.out, (tmp_path / "proof.json").read_text()))
    assert shown[0] == shown[1]


def test_a_singularity_in_the_box_leaves_it_open_with_its_place(tmp_path):
    run = quadstep("prove", write(tmp_path, SHORT), "--start", "0.6", "--out", tmp_path / "proof.json")
    assert (run.code, run.err) == (1, "")
    assert "Undecided: " in run.out
    assert ".py, line" in run.out
    assert not (tmp_path / "proof.json").exists()
