"""Files that quadstep writes and reads again: logs and metrics, weights, campaigns; spoilt in between."""

import contextlib
import hashlib
import json
import shutil
import tomllib
from pathlib import Path
from random import Random
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from quadstep.engines.eager import fly_floats
from quadstep.io.parts import sealed
from quadstep.mission.read import check_mission, plan_mission, read_mission
from quadstep.page.cards import list_page
from quadstep.page.folder import open_result, results
from quadstep.report.publish import MANIFEST, files_to_replace, write_json, write_log
from quadstep.studies.campaign.flyer import Flyer
from quadstep.studies.campaign.schema import read_campaign
from quadstep.studies.campaign.store import opened, parquet
from quadstep.studies.campaign.summary import RESULTS, sentences, summarise
from quadstep.studies.campaign.varied import varied
from tests.fuzz.inputs import LINE, WARM, WEIGHTS, begun
from tests.fuzz.mutate import as_json, mutated, scrambled

CAMPAIGN = LINE + "[simulation]\nduration = 0.04\nstep = 0.004\ncontrol_period = 0.004\nlog_period = 0.02\n"
VARIED = "mission = 'm.toml'\nflights = 40\nchunk = 16\n[vary]\nvehicle.mass = { type = 'uniform', low = 0.8, high = 1.2 }\n"
VARIED += "path.yaw_end = { type = 'choice', values = [0.0, 1.0] }\n[failure]\nposition_rmse = 0.5\n"


class Stored:
    """A kind of result."""

    name, file = "", ""

    def prepare(self, folder: Path) -> None:
        """Write a good result."""
        raise NotImplementedError

    def spoil(self, folder: Path, random: Random) -> None:
        """Write the file of a case."""
        raise NotImplementedError

    def named(self, folder: Path) -> str:
        """What a refusal has to name."""
        return str(folder)

    def use(self, folder: Path) -> None:
        """Read the result as commands do. Raises UserError."""
        raise NotImplementedError


class Flights(Stored):
    """A folder of `quadstep fly`, listed and opened by `quadstep serve`, and about to be replaced."""

    name = "flights"

    def prepare(self, folder: Path) -> None:
        mission = check_mission(tomllib.loads(CAMPAIGN), "good")
        plan = mission.plan()
        log = fly_floats(plan.loop, plan.parameters, plan.start, plan.ticks)
        (folder / "out").mkdir()
        write_log(folder / "out" / "flight.csv", log)
        self.metrics: dict[str, Any] = {
            "name": mission.name, "version": "1", "engine": "lanes", "warnings": ["one"], **mission.flight_metrics(log)[0],
            "mission": json.loads(mission.model_dump_json()), "fingerprint": "0", "files": ["flight.csv", "metrics.json"],
        }  # fmt: skip
        write_json(folder / "out" / MANIFEST, self.metrics)
        self.log, self.text = ((folder / "out" / name).read_bytes() for name in ("flight.csv", MANIFEST))

    def spoil(self, folder: Path, random: Random) -> None:
        what, log, text = random.random(), self.log, self.text
        if what < 0.3:
            log = scrambled(log, random)
        elif what < 0.5:
            text = scrambled(text, random)
        else:
            spoilt = mutated(self.metrics, [self.metrics], random)
            if random.random() < 0.9:
                spoilt["mission"] = None  # a page that flies takes long to make
            text = as_json(spoilt)
        (folder / "out" / "flight.csv").write_bytes(log)
        (folder / "out" / MANIFEST).write_bytes(text)

    def use(self, folder: Path) -> None:
        list_page(folder, results(folder)).encode("utf-8", "replace")
        files_to_replace(folder / "out", "0", overwrite=True)
        open_result(folder / "out")


class Weights(Stored):
    """The weights that a flight starts from."""

    name = "weights"

    def prepare(self, folder: Path) -> None:
        (folder / "mission.toml").write_text(WARM, encoding="utf-8")

    def spoil(self, folder: Path, random: Random) -> None:
        whole = random.random() < 0.7
        spoilt = as_json(mutated(WEIGHTS, [WEIGHTS], random)) if whole else scrambled(as_json(WEIGHTS), random)
        (folder / "weights.json").write_bytes(spoilt)

    def use(self, folder: Path) -> None:
        begun(plan_mission(read_mission(folder / "mission.toml"), folder / "mission.toml"))


class Campaigned(Stored):
    """A folder of `quadstep campaign`, resumed and summarised."""

    name = "campaign results"

    def prepare(self, folder: Path) -> None:
        (folder / "m.toml").write_text(CAMPAIGN, encoding="utf-8")
        (folder / "c.toml").write_text(VARIED, encoding="utf-8")
        self.campaign = read_campaign(folder / "c.toml")
        flyer = Flyer(self.campaign)
        with opened(folder / "good", self.campaign, 40, "lanes") as store:
            for chunk in store.chunks:
                store.write(chunk, flyer.fly(chunk.first, chunk.past))
        self.manifest = json.loads((folder / "good" / "campaign.json").read_bytes())

    def spoil(self, folder: Path, random: Random) -> None:
        out, what = folder / "out", random.random()
        shutil.rmtree(out, ignore_errors=True)
        shutil.copytree(folder / "good", out)
        text = sealed(self.manifest)
        if what < 0.4:
            spoilt = mutated(self.manifest, [self.manifest], random)
            with contextlib.suppress(ValueError):  # numbers that are not JSON
                text = as_json(spoilt) if random.random() < 0.2 else sealed(spoilt)
        elif what < 0.5:
            text = scrambled(text, random)
        else:
            spoilt_chunk = self.spoilt_chunk(out / "flights" / "00001.parquet", random)
            if random.random() < 0.8:  # as one who knows how it is checked
                chunks = [dict(one) for one in self.manifest["chunks"]]
                chunks[1]["sha256"] = hashlib.sha256(spoilt_chunk).hexdigest()
                text = sealed({**self.manifest, "chunks": chunks})
        (out / "campaign.json").write_bytes(text)

    @staticmethod
    def spoilt_chunk(path: Path, random: Random) -> bytes:
        """Write a file of flights of another kind."""
        if random.random() < 0.5:
            spoilt = scrambled(path.read_bytes(), random)
        else:
            table = pq.read_table(path)
            name, count = random.choice(table.column_names), table.num_rows
            column: pa.Array = random.choice(
                [pa.array(["x"] * count), pa.nulls(count), pa.array([float("nan")] * count), pa.array([2**62] * count),
                 pa.array([[1.0]] * count), pa.array([True] * count)]
            )  # fmt: skip
            place = table.column_names.index(name)
            table = random.choice([table.drop_columns([name]), table.set_column(place, name, column), table.slice(0, 7)])
            spoilt = parquet(table)
        path.write_bytes(spoilt)
        return spoilt

    def use(self, folder: Path) -> None:
        with opened(folder / "out", self.campaign, 40, "lanes", resume=True) as store:
            if store.missing:
                return
            assert all(line.isprintable() for line in sentences(summarise(store, store.read(RESULTS))))
            for key in self.campaign.file.keys:
                varied(store.read([key])[key], self.campaign.file.vary.get(key))
