"""Files that users write: missions, campaigns, vehicles, recordings; good ones, how they are spoilt, what reads them."""

import json
import math
import tomllib
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

from quadstep.engines.eager import fly_floats
from quadstep.engines.fly import FlightPlan
from quadstep.interfaces.closed_loop import Outcome
from quadstep.interfaces.log import FlightLog
from quadstep.mission.listings import parameters, read_vehicle
from quadstep.mission.presets import preset_table
from quadstep.mission.read import check_mission, plan_mission, read_mission
from quadstep.mission.template import template
from quadstep.studies.campaign.flyer import Flyer
from quadstep.studies.campaign.schema import read_campaign
from quadstep.studies.campaign.single_flight import replay
from tests.fuzz.mutate import mutated, scrambled, toml

EXAMPLES = Path(__file__).parents[2] / "examples"
LINE = "[path]\ntype = 'minimum-jerk'\nend = [1.0, 0.0, 0.5]\nduration = 1.0\n"
RECORDED = "[path]\ntype = 'recorded'\nfile = 'recording.csv'\nsmoothing = 0.5\n"
WARM = LINE + "[controller]\ntype = 'backstepping'\nnets = { neurons = 2, seed = 7, weights = 'weights.json' }\n"
OWN = LINE + "[vehicle]\nfile = 'v.toml'\nmass = 0.03\n"
PLANAR = LINE + "[vehicle]\ntype = 'planar'\nmass = 0.4\n[controller]\ntype = 'planar-pd'\nk_p = 5.0\n"
GRID = "mission = 'mission.toml'\n[vary]\nvehicle.rotors.arm = { type = 'grid', low = 0.1, high = 0.4, count = 9 }\n"

WEIGHTS = {"neurons": 2, "seed": 7, "W1": [[0.1, 0.2, 0.3]] * 2, "W2": [[0.0, 0.0, 1.0]] * 2}
ROWS = "".join(f"{0.1 * i:g},{math.sin(0.3 * i):g},{0.05 * i:g},{1 + 0.01 * i:g},{0.02 * i:g}\n" for i in range(24))
RECORDING = "t [s],x,y,z,psi\n" + ROWS


def examples(has: str) -> list[str]:
    """Example files with a table or key of this name; not those that need data from elsewhere."""
    texts = [path.read_text(encoding="utf-8") for path in sorted(EXAMPLES.glob("*.toml"))]
    return [text for text in texts if has in tomllib.loads(text) and '"recorded"' not in text]


def with_defaults(content: dict[str, Any]) -> dict[str, Any]:
    """A mission with every key that it may have, but for those that name files."""
    said: dict[str, Any] = json.loads(check_mission(content, "good", EXAMPLES).model_dump_json(exclude_none=True))
    return said


def beside(folder: Path) -> None:
    """What the good files name."""
    (folder / "v.toml").write_text("preset = 'crazyflie'\nmass = 0.03\n", encoding="utf-8")
    (folder / "recording.csv").write_text(RECORDING, encoding="utf-8")
    (folder / "weights.json").write_text(json.dumps(WEIGHTS), encoding="utf-8")
    (folder / "mission.toml").write_text(LINE, encoding="utf-8")
    for name in [*EXAMPLES.glob("*.toml"), *EXAMPLES.glob("super_twisting.py")]:
        (folder / name.name).write_bytes(name.read_bytes())


class Written:
    """A kind of TOML file. texts: good ones; contents: the same as tables, and more."""

    name, file = "", "spoilt.toml"
    texts: list[str]
    contents: list[dict[str, Any]]

    def prepare(self, folder: Path) -> None:
        """Whatever else is in the folder."""
        beside(folder)

    def spoil(self, folder: Path, random: Random) -> None:
        """Write the file of a case."""
        if random.random() < 0.7:
            spoilt = toml(mutated(random.choice(self.contents), self.contents, random)).encode("utf-8", "surrogatepass")
        else:
            spoilt = scrambled(random.choice(self.texts).encode(), random)
        (folder / self.file).write_bytes(spoilt)

    def named(self, folder: Path) -> str:
        """What a refusal has to name."""
        return str(folder / self.file)

    def use(self, folder: Path) -> None:
        """Read the file and do with it what is done with such files. Raises UserError."""
        raise NotImplementedError


class Missions(Written):
    """Read, planned, flown for three steps."""

    name = "missions"
    texts = [*examples("path"), template(), template("x500"), WARM, RECORDED, PLANAR, OWN]
    contents = [tomllib.loads(text) for text in texts]
    contents += [with_defaults(content) for content in contents[:-1]]

    def use(self, folder: Path) -> None:
        mission = read_mission(folder / self.file)
        log = begun(plan_mission(mission, folder / self.file))
        _, warnings = mission.flight_metrics(log)
        assert all(line.isprintable() for line in warnings)


class Campaigns(Written):
    """Read, two of its flights planned, and its first flights built where few keys vary."""

    name = "campaigns"
    texts = [*examples("mission"), GRID]
    contents = [tomllib.loads(text) for text in texts]
    contents += [{**contents[0], "mission": tomllib.loads(LINE)}]

    def use(self, folder: Path) -> None:
        campaign = read_campaign(folder / self.file)
        campaign.check_count(campaign.flights)
        for flight in (0, 10**6):
            begun(replay(campaign, flight).plan)
        if campaign.fingerprint.startswith("0"):  # one in sixteen: it takes half a second
            Flyer(campaign).rehearse()

    def named(self, folder: Path) -> str:
        return str(folder)  # of the mission, where that is refused


class Vehicles(Written):
    """Read, listed, and flown for three steps."""

    name = "vehicles"
    contents = [preset_table(name) for name in ("crazyflie", "x500", "research-2.6kg", "hummingbird")]
    contents += [{"file": "v.toml", "mass": 0.1}, {"preset": "x500", "rotor": {"fastest": 900.0}}]
    texts = [toml(content) for content in contents]

    def use(self, folder: Path) -> None:
        for row in parameters(read_vehicle(folder / self.file)):
            assert all(cell.isprintable() for cell in row)
        flown = check_mission({**tomllib.loads(LINE), "vehicle": {"file": self.file}}, str(folder / "mission.toml"), folder)
        begun(plan_mission(flown, folder / self.file))


class Recordings(Written):
    """Read as a path, which is followed for three steps and looked at to its end."""

    name, file = "recordings", "recording.csv"

    def prepare(self, folder: Path) -> None:
        beside(folder)
        (folder / "mission.toml").write_text(RECORDED, encoding="utf-8")

    def spoil(self, folder: Path, random: Random) -> None:
        lines = [line.split(",") for line in RECORDING.splitlines()]
        for _ in range(random.choice((0, 1, 1, 2, 6))):
            line = random.choice(lines)
            line[random.randrange(len(line))] = random.choice(CELLS)
            if random.random() < 0.2:
                lines[random.randrange(1, len(lines))] = list(random.choice(lines))
            if random.random() < 0.1:
                for scaled in lines[1:]:
                    scaled[0] = f"{numeric(scaled[0]) * random.choice((1e-4, 1e-2, 3.0, 40.0)):g}"
        spoilt = ("\n" if random.random() < 0.9 else "\r\n").join(map(",".join, lines)).encode()
        (folder / self.file).write_bytes(spoilt if random.random() < 0.7 else scrambled(spoilt, random))

    def named(self, folder: Path) -> str:
        return str(folder)  # of the mission, where a recording makes a flight too long

    def use(self, folder: Path) -> None:
        plan = plan_mission(read_mission(folder / "mission.toml"), folder / "mission.toml")
        begun(plan)
        end = plan.ticks.last * plan.ticks.step
        wanted = [plan.loop.path.reference(share * end, plan.parameters.path) for share in (0.0, 0.3, 0.7, 1.0)]
        assert np.isfinite([[*one.position, *one.velocity, one.yaw] for one in wanted]).all()


CELLS = [
    "", "nan", "inf", "-1", "0", "1e308", "1e9", "1e10", "1e-9", "-0.0", "x", "t", "psi", "1_0", "0x1", "9" * 400, '"',
    "1\x00", "\u202e", "1 2", "\ufeff1", "0.1", "0.2", "0.100001", "5", "z" * 3000, "1;2", "'1'", "٣", "1e", "t [", "]",
    "\x1b[2J",
]  # fmt: skip


def numeric(text: str) -> float:
    """A number, zero where it is none."""
    try:
        return float(text)
    except ValueError:
        return 0.0


def begun(plan: FlightPlan) -> FlightLog:
    """The first three steps of a flight: nothing but numbers, and a line for each warning."""
    log = fly_floats(plan.loop, plan.parameters, plan.start, plan.ticks._replace(log=1, last=min(2, plan.ticks.last)))
    assert np.isfinite(log.rows).all() or log.outcome is not Outcome.COMPLETED
    assert all(line.isprintable() for line in plan.warnings)
    return log
