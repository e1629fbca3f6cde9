"""A kind of study in one file: how much latency does a mission bear?"""

import json
from typing import NamedTuple

import numpy as np

from quadstep.mission.distributions import Grid
from quadstep.report.page import Fact
from quadstep.report.sheet import Sheet
from quadstep.studies.campaign.flown import SUCCESS
from quadstep.studies.envelope.request import read_base
from quadstep.studies.study import Evidence, Study, Table


class Borne(NamedTuple):
    """values: tried, rising. good: whether the flight succeeds."""

    values: tuple[float, ...]
    good: np.ndarray

    @property
    def most(self):
        """The largest value up to which all flights succeed; None if the first is lost."""
        count = int(np.argmin([*self.good, False]))
        return self.values[count - 1] if count else None


class Bearing(Study[Borne]):
    """One flight for each value of a key."""

    def __init__(self, path, key, values):
        base = read_base(path)
        file = base.file.model_copy(update={"vary": {key: Grid(type="grid", values=values)}})
        self.key, self.values = key, values
        self.campaign, self.flights = base._replace(file=file), len(values)
        self.identity = f"bearing {key} {json.dumps(values)} {self.campaign.fingerprint}"

    def fold(self, flown):
        good = np.zeros(self.flights, dtype=bool)
        for (first, past), flights in flown:
            good[first:past] = flights[SUCCESS].to_numpy()
        return Borne(self.values, good)

    def evidence(self, found, out, sheet: Sheet):
        answer = "The first value is lost."
        if found.most is not None:
            answer = f"Up to {self.key} = {found.most:g}, every flight succeeds."
        rows = [(f"{value:g}", "succeeds" if good else "fails") for value, good in zip(found.values, found.good, strict=True)]
        return Evidence(
            name=f"{self.campaign.defaults['name']}: {self.key}",
            kind="Bearing",
            answer=answer,
            sentences=[answer],
            record={"key": self.key, "most": found.most},
            facts=[Fact("most", "none" if found.most is None else f"{found.most:g}")],
            tables=[Table("Every flight", "flights", (self.key, ""), rows, paper=True)],
        )
