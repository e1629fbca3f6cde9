"""Logs of real flights, of every format: read, judged against their mapping, and some replayed."""

from functools import partial
from pathlib import Path
from random import Random

import numpy as np

from quadstep.identify.logs.flight import FlightRecord
from quadstep.identify.logs.judge import judge
from quadstep.identify.logs.read import read_log
from quadstep.identify.replay import compare, ready
from quadstep.mission.airframe import AirframeSection
from quadstep.mission.presets import preset_table
from tests import made_flights, made_logs
from tests.fuzz.inputs import CELLS
from tests.fuzz.mutate import scrambled
from tests.made_logs import MCAP_MAPPING

MAPPINGS = {".csv": made_flights.MAPPING, ".mcap": MCAP_MAPPING, ".ulg": None, ".BIN": None}
VEHICLE = AirframeSection.model_validate(preset_table("crazyflie"))
REPLAYED = 0.02
"""Share of the cases that are also replayed."""


class Logs:
    """A log in one of four formats, some of its bytes, bits or cells changed."""

    name = "logs"

    def prepare(self, folder: Path) -> None:
        from mcap.writer import CompressionType, Writer

        flight = steady(6.0)
        motors = flight.motors
        made_flights.write(folder / "good.csv", *made_flights.table(flight))
        for compression in CompressionType:
            ways = {"compression": compression, "chunk_size": 20_000, "enable_crcs": False}
            made_logs.mcap(folder / f"{compression.name}.mcap", flight, motors, partial(Writer, **ways))
        several = [path.read_bytes() for path in sorted(folder.glob("*.mcap"))]
        self.good = {
            ".csv": [(folder / "good.csv").read_bytes()],
            ".mcap": several,
            ".ulg": [made_logs.ulog(flight, motors)],
            ".BIN": [made_logs.ardupilot(flight, motors)],
        }
        (folder / "mapping.toml").write_text("", encoding="utf-8")

    def spoil(self, folder: Path, random: Random) -> None:
        kind = random.choice(list(self.good))
        content = random.choice(self.good[kind])
        self.file, self.mapping, self.replayed = folder / f"spoilt{kind}", None, random.random() < REPLAYED
        if text := MAPPINGS[kind]:
            self.mapping = str(folder / "mapping.toml")
            (folder / "mapping.toml").write_text(text, encoding="utf-8")
        if kind == ".csv" and random.random() < 0.6:
            lines = [line.split(b",") for line in content.splitlines()]
            for _ in range(random.choice((1, 2, 6, 40))):
                line = random.choice(lines)
                line[random.randrange(len(line))] = random.choice(CELLS).encode("utf-8", "surrogatepass")
            content = b"\n".join(map(b",".join, lines))
        elif random.random() < 0.5:
            content = scrambled(content, random)
        else:
            changed = bytearray(content)
            for _ in range(random.choice((1, 3, 30, 300))):
                changed[random.randrange(len(changed))] ^= 1 << random.randrange(8)
            content = bytes(changed)
        self.file.write_bytes(content)

    def named(self, folder: Path) -> str:
        return "spoilt"

    def use(self, folder: Path) -> None:
        flight = read_log(self.file, self.mapping)
        found = judge(flight, VEHICLE.geometry())
        assert all(one.text.isprintable() and "nan" not in one.text for one in found), found
        if self.replayed:
            numbers, guided = ready([flight], VEHICLE)
            compare([flight], VEHICLE, numbers, guided)


def steady(duration: float) -> FlightRecord:
    """A short flight up and round, without the dynamics of any vehicle."""
    time = np.arange(0.0, duration, 0.01)
    count = len(time)
    random = np.random.default_rng(0)
    place = np.stack([np.sin(time), np.cos(time), np.minimum(time, 1.0)], axis=1)
    tilt = 0.2 * np.stack([np.ones(count), np.sin(time), np.cos(time), 0.0 * time], axis=1)
    tilt[:, 0] = 1.0
    channels = {
        "position": place,
        "velocity": np.gradient(place, time, axis=0),
        "attitude": tilt / np.linalg.norm(tilt, axis=1, keepdims=True),
        "rates": random.normal(0.0, 0.3, (count, 3)),
        "voltage": 4.0 - 0.01 * time[:, None],
        "setpoint": place,
    }
    motors = random.uniform(0.4, 0.6, (count, 4))
    return FlightRecord("steady", time, 0.01, motors, False, channels, (), np.zeros(count, dtype=bool))
