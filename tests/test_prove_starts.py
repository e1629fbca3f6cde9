"""`quadstep prove --start`: whatever a start determines moves with it: memories, observers, delay lines, estimates."""

import itertools
import json
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from quadstep.io.documents import parse_toml
from quadstep.mission.read import check_mission, plan_mission, read_mission
from quadstep.numbers import vector
from quadstep.proofs.prove.certificate_file import read_certificate, read_set
from quadstep.proofs.prove.sampled import SampledLoop
from quadstep.proofs.prove.unknown import Unknown, started
from tests.commands import quadstep, write
from tests.planar_proofs import SET, TUBE, forged
from tests.started import begun, flown

MEMORY = """
from dataclasses import dataclass
from typing import NamedTuple

from quadstep.interfaces.controller import Controller
from quadstep.interfaces.gain import believed, gain, given
from quadstep.numbers import Number, Vector, atan2, vector
from quadstep.vehicle.planar import PlanarCommand, PlanarState, plane


class Gains(NamedTuple):
    mass: Number = believed("mass")
    inertia: Vector = believed("inertia")
    gravity: Number = given(lambda model: model.gravity)
    leak: Number = gain({leak}, "1/s", "of what is remembered", zero=True)


class Memory(NamedTuple):
    place: Vector
    velocity: Vector


@dataclass(frozen=True)
class Remembering(Controller):
    name = "remembering"
    Gains = Gains
    measures = PlanarState

    def start(self, measured, gains):
        return Memory(measured.position, measured.velocity)

    def law(self, memory, measured, reference, gains, t, period):
        wanted = plane(reference.position)
        place = memory.place + period * gains.leak * (wanted - memory.place)
        pull = 4.0 * (wanted - measured.position) + {share} * (memory.place - wanted) - 3.5 * measured.velocity
        pull = pull - 0.5 * memory.velocity + vector(0.0, gains.gravity)
        pitch = atan2(-pull[0], pull[1])
        turn = 120.0 * (pitch - measured.pitch) - 20.0 * measured.rate
        return PlanarCommand(gains.mass * pull.norm(), gains.inertia[1] * turn, pitch), Memory(place, memory.velocity)
"""
LATE = """\
[vehicle]
preset = "research-2.6kg"
[path]
type = "minimum-jerk"
start = [0.0, 0.0, 5.0]
end = [0.0001, 0.0, 5.0]
duration = 1.2
[simulation]
guidance_period = 0.004
control_period = 0.004
step = 0.004
air_period = 0.004
log_period = 0.004
duration = 0.06
[sensors]
fix_period = 0.004
latency = 0.04
gyro_noise = 0.0
accelerometer_noise = 0.0
position_noise = 0.0
velocity_noise = 0.0
attitude_noise = 0.0
[controller]
type = "pid"
velocity = 20.0
"""
OPTIONS = {
    "start": "--start",
    "start_velocity": "--start-velocity",
    "start_attitude": "--start-attitude",
    "start_rates": "--start-rates",
}


def loop_of(folder, text):
    return SampledLoop(
        plan_mission(check_mission(parse_toml(text, "mission"), "mission", folder), folder / "mission.toml", folder)
    )


def proved(folder, text, **starts):
    """The certificate's file, and what is printed."""
    options = [one for name, value in starts.items() for one in (OPTIONS[name], value)]
    run = quadstep("prove", write(folder, text), *options, "--out", folder / "proof.json")
    assert (run.code, run.err) == (0, "")
    return folder / "proof.json", " ".join(run.out.split())


CORNERS = [np.array(way)[[[0, 1, 2], [1, 0, 2], [2, 1, 0], [1, 2, 0]]] for way in itertools.product((-1.0, 1.0), repeat=3)]


def nearest(folder, text, file, starts, corners=4):
    """The largest share of a box and of a bound of the position that flights from corners of the starts reach."""
    loop, found, most = loop_of(folder, text), read_certificate(file), [0.0, 0.0]
    into, samples = np.linalg.inv(found.spread), len(found.flown) - 1
    boxes = found.boxes[np.minimum(np.arange(samples) // found.block, len(found.boxes) - 1)]
    for shares in CORNERS[:corners]:
        off = flown(loop, begun(loop, Unknown(**starts), shares), samples) - found.flown
        most[0] = max(most[0], float((np.abs(off[1:] @ into.T) / boxes).max()))
        most[1] = max(most[1], float((np.abs(off[:, : len(found.position)]) / found.position).max()))
    return most


PLANAR = {
    "an observer": (1.0, 200.0, {"start": 1e-5}),
    "a place that is remembered for ever": (0.0, 40.0, {"start": 1e-5}),
    "a velocity that is remembered for ever": (1.0, 0.0, {"start_velocity": 1e-3}),
    "all of the state": (1.0, 20.0, {"start": 1e-5, "start_velocity": 1e-4, "start_attitude": 1e-3, "start_rates": 1e-3}),
}


@pytest.mark.parametrize("name", PLANAR)
def test_what_a_law_remembers_from_the_start_moves_with_it(tmp_path, name):
    leak, share, starts = PLANAR[name]
    (tmp_path / "remembering.py").write_text(MEMORY.replace("{leak}", str(leak)).replace("{share}", str(share)))
    text = TUBE.replace("planar-pd", "remembering.py:Remembering")
    file, said = proved(tmp_path, text, **starts)
    for needed in (
        "0.01 mm" * ("start" in starts),
        "° of attitude" * ("start_attitude" in starts),
        "of the mission's on each axis",
    ):
        assert needed in said
    boxes, position = nearest(tmp_path, text, file, starts)
    assert 0.3 < max(boxes, position) <= 1.0
    known = ("--controller", tmp_path / "remembering.py")
    assert quadstep("prove", "--check", file, *known).code == 0
    content = json.loads(file.read_text())
    content["unknown"] = {key: 1.5 * value for key, value in content["unknown"].items()}
    file.write_bytes(forged(content))
    assert quadstep("prove", "--check", file, *known).code == 1


def test_what_sensors_still_owe_moves_with_the_start(tmp_path):
    file, _ = proved(tmp_path, LATE, start=1e-8)
    boxes, position = nearest(tmp_path, LATE, file, {"start": 1e-8}, 1)
    assert 0.3 < boxes <= 1.0
    assert position <= 1.0
    assert quadstep("prove", "--check", file).code == 0


@pytest.mark.parametrize("law", ["adrc", "hedged-inversion", "indi"])
def test_the_enclosure_of_a_start_holds_its_starts(law):
    text = LATE.replace('"pid"\nvelocity = 20.0', f'"{law}"').replace("latency = 0.04", "latency = 0.04\nestimator = true")
    mission = check_mission(parse_toml(text, "mission"), "mission")
    loop, unknown = SampledLoop(mission.plan()), Unknown(start=1e-2, start_velocity=0.1, start_attitude=0.2, start_rates=0.3)
    found = loop.starts(unknown)
    moving = 0
    for shares in CORNERS:
        for one, value in zip(found, begun(loop, unknown, shares), strict=True):
            low, high = (one, one) if isinstance(one, float) else (one.low[0], one.high[0])
            assert low <= value <= high
            moving += not isinstance(one, float)
    assert moving > len(CORNERS) * 13
    assert len(started(loop.loop, loop.plan.start, loop.parameters, unknown)) == len(loop.start)


def test_flights_from_starts_with_any_velocity_attitude_and_rates_stay_in_the_set(tmp_path):
    starts = {"start": 1e-3, "start_velocity": 1e-3, "start_attitude": 1e-3, "start_rates": 1e-3}
    file, said = proved(tmp_path, SET, **starts)
    assert "within 0.001 m/s and 0.0572958° of attitude and 0.0572958°/s of the mission's" in said
    assert quadstep("prove", "--check", file).code == 0
    found, loop = read_set(file), loop_of(tmp_path, SET)
    into, unknown = np.linalg.inv(found.spread), Unknown(**starts)._replace(start=found.start)
    for shares in CORNERS:
        z = (flown(loop, begun(loop, unknown, shares), 400)[1:] - found.rest)[:, list(found.live)] @ into.T
        size = np.abs(z)
        for i in found.pairs:
            size[:, i] = size[:, i + 1] = np.hypot(z[:, i], z[:, i + 1])
        assert np.all(size <= found.radii * (1.0 + 1e-9))


@pytest.mark.parametrize("option", OPTIONS.values())
def test_a_start_that_is_none_is_one_line(tmp_path, option):
    for value in ("-1", "nan", "1e9"):
        run = quadstep("prove", write(tmp_path, SET), option, value)
        assert run.refused
        assert f"{option}: should be from 0 to" in run.err


QUAD = Path(__file__).parent.parent / "examples" / "twelve_states.toml"


def test_the_twelve_states_of_the_benchmark_meet_its_demands(tmp_path):
    starts = {"start": 0.4, "start_velocity": 0.4}
    run = quadstep("prove", QUAD, "--start", 0.4, "--start-velocity", 0.4, "--out", tmp_path / "proof.json")
    assert (run.code, run.err) == (0, "")
    assert "from any start within 400 mm and 0.4 m/s of the mission's on each axis" in " ".join(run.out.split())
    found = read_certificate(tmp_path / "proof.json")
    assert len(found.states) == 12
    z, box = found.flown[:-1, 2], np.repeat(found.boxes[:, 2], found.block)
    later = np.arange(len(z)) * 0.005 >= 1.0
    assert np.max(z + box) < 1.4
    assert np.min((z - box)[later]) > 0.9
    assert 0.98 < z[-1] - box[-1] < z[-1] + box[-1] < 1.02
    loop, most = SampledLoop(plan_mission(read_mission(QUAD), QUAD)), []
    for shares in CORNERS[::7]:
        off = flown(loop, begun(loop, Unknown(**starts), shares), len(z))[:-1] - found.flown[:-1]
        most.append(np.abs(off[:, 2] / box).max())
    assert 0.9 < max(most) <= 1.0


def test_the_twelve_states_move_as_a_rigid_body_does():
    plan = plan_mission(read_mission(QUAD), QUAD)
    parts = [vector(0.1, -0.2, 0.3), vector(0.5, -0.4, 0.2), vector(0.3, -0.5, 1.2), vector(0.7, -0.6, 0.9)]
    push = vector(15.0, 0.1, -0.2)
    position, velocity, attitude, rates = plan.loop.plant.rate(plan.parameters, type(plan.start)(*parts), push, None, 0.0)
    v, w, (roll, pitch, yaw) = np.array([*parts[1]]), np.array([*parts[3]]), parts[2]
    turn = Rotation.from_euler("ZYX", [yaw, pitch, roll])
    world = turn.apply(v)
    assert np.allclose([*position], [world[0], world[1], -world[2]], atol=1e-14)
    force = turn.inv().apply([0.0, 0.0, 9.81]) - [0.0, 0.0, 15.0 / 1.4]
    assert np.allclose([*velocity], force - np.cross(w, v), atol=1e-14)
    inertia = np.diag([0.054, 0.054, 0.104])
    assert np.allclose([*rates], np.linalg.solve(inertia, [0.1, -0.2, 0.0] - np.cross(w, inertia @ w)), atol=1e-14)
    later = turn * Rotation.from_rotvec(1e-6 * w)
    assert np.allclose([*attitude], (later.as_euler("ZYX")[::-1] - [roll, pitch, yaw]) / 1e-6, atol=1e-5)
