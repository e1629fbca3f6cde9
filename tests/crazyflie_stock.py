"""The Crazyflie's own loops and ours over the same samples: the firmware's compiled from a tree, or what it said of some."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from quadstep.control.crazyflie_mellinger import CrazyflieMellinger
from quadstep.control.crazyflie_pid import INTEGRALS, CrazyfliePid, began, pid
from quadstep.control.filters import low_pass
from quadstep.control.mixers import COUNTS
from quadstep.interfaces.controller import Measured
from quadstep.interfaces.plant import Reference
from quadstep.mission.listings import load_preset
from quadstep.numbers import Vector
from quadstep.numbers.rotations import from_yaw_pitch_roll
from tests.firmware_flights import FIRMWARE, answers, included, run, walks
from tests.firmware_trees import STUBS

LOOPS = {"attitude": 3, "rates": 3, "filtered": 3, "position": 3, "mellinger": 4}
"""How many numbers each gives."""

HALF_TURN = 57.29577951308232


class Motion(NamedTuple):
    """What every loop is given, shape (lanes, samples, numbers); yaw, pitch, roll [rad] beside it."""

    given: dict[str, np.ndarray]
    angles: np.ndarray


def motion(lanes: int, samples: int, seed: int = 0) -> Motion:
    """Random walks, the wanted values near limits and beyond; lane by lane."""
    random = np.random.default_rng(seed)
    walk = walks(random, lanes, samples)
    degrees = np.concatenate([walk(2, 40.0, 1.0), walk(1, 170.0, 5.0)], axis=2)
    degrees[..., 2] = (degrees[..., 2] + 180.0) % 360.0 - 180.0
    wanted = np.concatenate([walk(2, 20.0, 2.0), random.uniform(-180.0, 180.0, (lanes, samples, 1))], axis=2)
    angles = np.concatenate([walk(1, 3.0, 0.05), walk(2, 0.2, 0.01)], axis=2)
    turn = np.stack(list(from_yaw_pitch_roll(Vector(np.moveaxis(angles, 2, 0)))), axis=2)
    place, speed, spin = walk(3, 2.0, 0.01), walk(3, 1.0, 0.02), walk(3, 60.0, 2.0)
    yaw = np.degrees(np.arctan2(np.sin(angles[..., :1]), np.cos(angles[..., :1])))
    near = [place + walk(3, 0.1, 0.01), speed + walk(3, 0.2, 0.01), walk(3, 1.0, 0.02)]
    path = np.concatenate([*near, np.degrees(angles[..., :1]) + walk(1, 10.0, 1.0), 0.0 * spin], axis=2)
    turning = np.concatenate([walk(3, 200.0, 5.0), walk(3, 300.0, 5.0)], axis=2)
    given = {
        "attitude": np.concatenate([degrees, wanted], axis=2),
        "rates": turning,
        "filtered": turning,
        "position": np.concatenate([place, speed, yaw, place + walk(3, 0.7, 0.01)], axis=2),
        "mellinger": np.concatenate([place, speed, turn, spin, path], axis=2),
    }
    return Motion({name: np.ascontiguousarray(one, dtype=np.float32) for name, one in given.items()}, angles)


def firmware(folder: Path, tree: Path, given: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """What the firmware's own code makes of it."""
    found = included(folder, tree)
    units = [*(tree / "src" / one for one in FIRMWARE), tree / "src/modules/src/controller/controller_mellinger.c"]
    library, harness = folder / "stock.so", folder / "stock.c"
    harness.write_text((STUBS / "crazyflie/stock.c").read_text(encoding="utf-8"), encoding="utf-8")  # away from our headers
    sources = [str(one) for one in (*units, harness)]
    flags = ["-std=gnu11", "-O1", "-ffp-contract=off", "-shared", "-fPIC", "-DCRAZYFLIE_FW"]
    run(["gcc", *flags, *found, *sources, "-lm", "-o", str(library)], folder)
    return answers(library, given, LOOPS)


def ours(motion: Motion) -> dict[str, np.ndarray]:
    """What our laws make of it: attitude and rates in f32, as the firmware, the others in f64."""
    model = load_preset("crazyflie").model()
    cascade = CrazyfliePid.gains(model)
    a, r, most = cascade.attitude, cascade.rates, INTEGRALS
    inner = {
        "attitude": (a, ("roll", "roll", "yaw"), (False, False, True)),
        "rates": (r, ("roll_rate", "roll_rate", "yaw_rate"), (False, False, False)),
        "filtered": (r, ("roll_rate", "roll_rate", "yaw_rate"), (False, False, False)),
    }
    made = {}
    for name, (gains, limits, turns) in inner.items():
        given = motion.given[name]
        lanes, samples, _ = given.shape
        made[name] = np.empty((lanes, samples, 3), np.float32)
        for axis in range(3):
            memory = began(np.zeros(lanes, np.float32))
            own, smooth = gains[4 * axis : 4 * axis + 4], low_pass(float(name == "filtered"), 30.0, 0.002)
            for i in range(samples):
                wanted, measured = given[:, i, 3 + axis], given[:, i, axis]
                made[name][:, i, axis], memory = pid(
                    own, memory, wanted, measured, most[limits[axis]], smooth, 0.002, turns[axis]
                )
    return {**made, "position": outer(motion, model), "mellinger": mellinger(motion, model)}


def outer(motion: Motion, model: object) -> np.ndarray:
    """Thrust, roll and pitch of `guide`."""
    law, gains = CrazyfliePid.for_vehicle(model), CrazyfliePid.gains(model)
    given, rows, memory = motion.given["position"].astype(float), [], None
    for i in range(given.shape[1]):
        place, speed, yaw, goal = np.split(given[:, i].T, [3, 6, 7])
        none = np.zeros_like(yaw[0])
        attitude = from_yaw_pitch_roll(Vector((yaw[0] / HALF_TURN, none, none)))
        told = Measured(Vector(place), Vector(speed), attitude, Vector([none] * 3), none, Vector([none] * 3))
        if memory is None:
            still = told._replace(position=Vector([none] * 3), attitude=Vector((1.0 + none, none, none, none)))
            memory = law.start(still, gains)
        wanted = Reference(Vector(goal), Vector([none] * 3), Vector([none] * 3), none, none)
        memory = law.guide(memory, told, wanted, gains, 0.0, 0.01)
        rows.append(np.stack([memory.thrust, *memory.tilt], axis=1))
    return np.stack(rows, axis=1)


def mellinger(motion: Motion, model: object) -> np.ndarray:
    """The motors' counts."""
    law, gains = CrazyflieMellinger.for_vehicle(model), CrazyflieMellinger.gains(model)
    given, rows, memory = motion.given["mellinger"].astype(float), [], None
    for i in range(given.shape[1]):
        place, speed, turn, spin, goal, velocity, acceleration, yaw, _ = np.split(
            given[:, i].T, [3, 6, 10, 13, 16, 19, 22, 23]
        )
        none = np.zeros_like(yaw[0])
        told = Measured(*map(Vector, (place, speed, turn, spin / HALF_TURN)), none, Vector([none] * 3))
        memory = law.start(told, gains) if memory is None else memory
        wanted = Reference(Vector(goal), Vector(velocity), Vector(acceleration), yaw[0] / HALF_TURN, none)
        command, memory = law.law(memory, told, wanted, gains, 0.0, 0.002)
        rows.append(np.stack(list(command.thrusts), axis=1) * COUNTS / gains.full_thrust)
    return np.stack(rows, axis=1)
