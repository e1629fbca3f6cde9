"""Autopilots that fly our vehicle, and exports built in firmware trees and flown where a host can: `make firmware`.

Trees are those of the variables in `tests/firmware_trees.py`; nothing is fetched.
"""

import ctypes
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping
from itertools import chain
from pathlib import Path
from typing import NamedTuple

import numpy as np

from quadstep.export.arm import BITS
from tests import firmware_sitl
from tests.adapters import STUBS, adapter
from tests.firmware_trees import VARIABLES, built, lacking, missing
from tests.patience import PATIENCE

LAWS = ("geometric", "rotation-backstepping", "pid")
"""The last one is in the simulators that then fly."""

PERIODS = {"crazyflie": 0.002, "px4": 0.004, "ardupilot": 0.0025}
"""Of the law, in the firmware [s]."""

MISSION = """[vehicle]
preset = "{}"
[controller]
type = "{}"
[path]
type = "circle"
radius = 2.0
period = 10.0
[simulation]
duration = 1.0
step = 0.0005
control_period = {}
"""

FIRMWARE = (
    "modules/src/controller/controller_pid.c",
    "modules/src/controller/position_controller_pid.c",
    "modules/src/controller/attitude_pid_controller.c",
    "modules/src/power_distribution_quadrotor.c",
    "utils/src/pid.c",
    "utils/src/filter.c",
    "utils/src/num.c",
)
"""Of the Crazyflie's `src`, what flies beside the exported law."""

CONFIGURATION = "".join(
    f"#define CONFIG_{word} 1\n"
    for word in ("PLATFORM_CF2", "CRAZYFLIE_21_PLUS", "ENABLE_THRUST_BAT_COMPENSATED", "CONTROLLER_OOT")
)


class Scenario(NamedTuple):
    """Of `closed.c`: the height [m], the distance from the place asked for [m], the yaw [deg], the lowest height [m], the
    largest tilt [deg], and the largest distance [m].
    """

    height: float
    away: float
    yaw: float
    lowest: float
    tilt: float
    farthest: float


def flown_crazyflie(folder: Path, tree: Path, law: str) -> dict[str, Scenario]:
    """The scenarios of `closed.c` with the firmware's own sources and headers."""
    name, _ = adapter(folder, "crazyflie", law)
    (folder / "closed.c").write_text((STUBS / "crazyflie/closed.c").read_text(encoding="utf-8"), encoding="utf-8")
    sources, found = tree / "src", included(folder, tree)
    objects = []
    for number, unit in enumerate([*(sources / one for one in FIRMWARE), "closed.c", "controller_quadstep.c"]):
        objects.append(f"{number}.o")
        run(["gcc", "-std=gnu11", "-O1", *found, "-c", str(unit), "-o", objects[-1]], folder)
    for unit in (f"{name}.c", f"{name}_params.c"):
        objects.append(f"{unit}.o")
        run(["gcc", "-std=c99", "-O1", *BITS, "-I.", "-c", unit, "-o", objects[-1]], folder)
    run(["gcc", *objects, "-lm", "-o", "closed"], folder)
    lines = run(["./closed"], folder).splitlines()
    return {line.split()[0]: Scenario(*(float(one) for one in line.split()[1:])) for line in lines}


def included(folder: Path, tree: Path) -> list[str]:
    """Where the Crazyflie's headers are, with its configuration in the folder; the firmware's before the folder's own, as
    one of both may be called pid.h.
    """
    (folder / "config").mkdir()
    (folder / "config/autoconf.h").write_text(CONFIGURATION, encoding="utf-8")
    places = sorted(path for path in (tree / "src").rglob("interface") if path.is_dir())
    places += [path for place in places for path in sorted(place.rglob("*")) if path.is_dir()]
    return [f"-I{path}" for path in (folder / "config", *places, tree / "src/config", folder)]


def run(line: list[str], folder: Path) -> str:
    """A command's output; its errors if it fails."""
    done = subprocess.run(line, cwd=folder, capture_output=True, text=True, check=False, timeout=PATIENCE)
    assert done.returncode == 0, done.stderr
    return done.stdout


def exported(target: str, tree: Path, wanted: re.Pattern[str]) -> Iterator[tuple[str, str]]:
    """What is tried of exports in a tree: its name, and the result."""
    for law in LAWS:
        name = f"{law}: built in the tree"
        if wanted.search(f"{target}: {name}"):
            place = tree / "build" / "quadstep"  # kept: PX4's build goes on asking for it
            shutil.rmtree(place, ignore_errors=True)
            place.mkdir(parents=True)
            vehicle = "crazyflie" if target == "crazyflie" else "x500"
            (place / "mission.toml").write_text(MISSION.format(vehicle, law, PERIODS[target]), encoding="utf-8")
            line = [sys.executable, "-m", "quadstep", "export", "mission.toml", "--target", target, "--out", "exported"]
            run(line, place)
            done = built(target, place / "exported", tree, [STUBS / "px4/quadstep_path"])
            last = (done.stderr.strip() or done.stdout.strip() or "no reason").splitlines()[-1]
            why = lacking(done.stderr, tree) or f"FAILED: {last}"
            yield name, "built" if done.returncode == 0 else why
        name = f"{law}: flown on the host"
        if target == "crazyflie" and wanted.search(f"{target}: {name}"):
            with tempfile.TemporaryDirectory() as outside:
                for scenario, one in flown_crazyflie(Path(outside), tree, law).items():
                    text = f"{one.height:.3f} m high, {one.away:.3f} m away (at most {one.farthest:.3f}), "
                    text += f"lowest {one.lowest:.3f} m, yaw {one.yaw:.1f} deg"
                    yield f"{name}: {scenario}", text


def main() -> int:
    """The table; 2 where no tree is named, or what builds one is missing."""
    trees = {target: os.environ.get(variable) for target, variable in VARIABLES.items()}
    if not any(trees.values()):
        sys.stderr.write(f"make firmware: name your trees: {', '.join(f'{one}=DIRECTORY' for one in VARIABLES.values())}\n")
        return 2
    absent = [f"{target}: {', '.join(found)}" for target, place in trees.items() if place and (found := missing(target))]
    if absent:
        sys.stderr.write(f"make firmware: nothing is built, as these are missing on PATH: {'; '.join(absent)}\n")
        return 2
    wanted, failed = re.compile(os.environ.get("ONLY", "")), False
    sys.stdout.write("| in | what | result | RMSE [mm] | times real time |\n|---|---|---|---|---|\n")
    for target, place in trees.items():
        if not place:
            sys.stdout.write(f"| {target} | - | skipped: {VARIABLES[target]} is not set | | |\n")
            continue
        tree = Path(place).resolve()
        if not tree.is_dir():
            sys.stdout.write(f"| {target} | - | FAILED: {VARIABLES[target]}: there is no folder {place} | | |\n")
            failed = True
            continue
        flights = firmware_sitl.rows(target, tree, wanted) if target in firmware_sitl.SITL else ()
        for name, row in chain(exported(target, tree, wanted), flights):
            text = str(row)
            failed = failed or text.startswith("FAILED")
            sys.stdout.write(f"| {target} | {name} | {text} |\n")
            sys.stdout.flush()
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())


def walks(random: np.random.Generator, lanes: int, samples: int) -> Callable[[int, float, float], np.ndarray]:
    """Gives random walks of so many numbers that begin within a size and go on by normal steps, (lanes, samples, numbers)."""

    def walk(parts: int, size: float, step: float) -> np.ndarray:
        begin = random.uniform(-size, size, (lanes, 1, parts))
        return begin + np.cumsum(random.normal(0.0, step, (lanes, samples, parts)), axis=1)

    return walk


def answers(library: Path, given: dict[str, np.ndarray], loops: Mapping[str, int]) -> dict[str, np.ndarray]:
    """What a compiled firmware's own loops make of what each is given, in f32. loops: how many numbers each gives."""
    loaded, made = ctypes.CDLL(str(library)), {}
    for name, count in loops.items():
        made[name] = np.empty((*given[name].shape[:2], count), np.float32)
        place = [one.ctypes.data_as(ctypes.c_void_p) for one in (given[name], made[name])]
        getattr(loaded, name)(*given[name].shape[:2], *place)
    return made


def recorded(firmware: str) -> dict[str, np.ndarray]:
    """What its loops made of two lanes of 40 samples."""
    text = (Path(__file__).parent / "golden" / f"{firmware}_stock.json").read_text(encoding="utf-8")
    return {name: np.array(rows, np.float32) for name, rows in json.loads(text).items()}
