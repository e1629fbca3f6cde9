"""A kind of study in one file: up to what value of a key does every flight succeed?

As a command: `bearing = "bearing:bearing"` under `[project.entry-points."quadstep.commands"]`, see docs/extending.md.
"""

import hashlib
import json
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
import typer
from numpy.typing import NDArray

from quadstep.mission.distributions import Grid
from quadstep.report.evidence import Evidence, TableSection
from quadstep.report.markup import Fact
from quadstep.report.publish import booktabs
from quadstep.report.sheet import Sheet
from quadstep.studies.campaign.flyer import SUCCESS
from quadstep.studies.envelope_request import read_base
from quadstep.studies.study import Flown, Study, run


class Borne(NamedTuple):
    """values: that were tried, in order. good: whether the flight with each succeeds."""

    values: tuple[float, ...]
    good: NDArray[np.bool_]

    @property
    def most(self) -> float | None:
        """The value up to which all flights succeed; None if the first is lost."""
        count = int(np.argmin([*self.good, False]))
        return self.values[count - 1] if count else None


class Bearing(Study[Borne]):
    """One flight of a mission for each value of a key."""

    def __init__(self, path: Path, key: str, values: tuple[float, ...]) -> None:
        base = read_base(path)
        file = base.file.model_copy(update={"vary": {key: Grid(type="grid", values=values)}})
        self.key, self.values = key, values
        self.campaign, self.flights = base._replace(file=file), len(values)
        text = json.dumps(["bearing", key, values, self.campaign.fingerprint])
        self.identity = hashlib.sha256(text.encode()).hexdigest()[:16]

    def fold(self, flown: Flown) -> Borne:
        """Which flights succeed."""
        good = np.zeros(self.flights, dtype=bool)
        for chunk, flights in flown:
            good[chunk.first : chunk.past] = flights[SUCCESS].to_numpy()
        return Borne(self.values, good)

    def evidence(self, found: Borne, out: Path, sheet: Sheet) -> Evidence:
        """The answer, and every flight."""
        answer = f"With {self.key} = {self.values[0]:g}, the flight already fails."
        if found.most is not None:
            answer = f"Up to {self.key} = {found.most:g}, every flight succeeds."
        rows = [(f"{value:g}", "succeeds" if good else "fails") for value, good in zip(found.values, found.good, strict=True)]
        return Evidence(
            name=f"{self.campaign.defaults['name']}: {self.key}",
            kind="Bearing",
            answer=answer,
            sentences=[answer],
            record={"key": self.key, "most": found.most},
            facts=[Fact("every flight succeeds up to", "none" if found.most is None else f"{found.most:g}")],
            sections=[TableSection("Every flight", "flights", (self.key, ""), rows)],
            paper=booktabs((self.key, ""), [rows], [answer]),
        )


def bearing(mission: Path, key: str, values: list[float], out: Annotated[Path, typer.Option()] = Path("out/bearing")) -> None:
    """Find up to which value of a key every flight succeeds."""
    typer.echo(run(Bearing(mission, key, tuple(values)), out).evidence.answer)
