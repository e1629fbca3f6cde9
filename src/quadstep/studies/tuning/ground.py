"""The proving ground: flies many candidates over the same draws, all in one sweep.

Flight i of a candidate has the draws and the noise of flight number i, for every candidate of every generation alike:
candidates differ only in their gains, and the objective is one fixed function of them.
"""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadstep.engines.scored import names_without_units
from quadstep.engines.sweep import Sweep
from quadstep.interfaces.closed_loop import Advance, Outcome
from quadstep.io import files
from quadstep.io.documents import read_toml
from quadstep.io.errors import UserError, errors_in
from quadstep.linear.analysis import limits
from quadstep.linear.grade import margin_metrics
from quadstep.metrics.registry import MARGINS
from quadstep.mission.check import check
from quadstep.mission.read import MISSION, check_mission, refuse_others
from quadstep.mission.schema import Mission
from quadstep.mission.tune import Constraint, TuneSection
from quadstep.studies.campaign.draws import DrawnColumn, draw
from quadstep.studies.campaign.flyer import Flyer, Sweeper
from quadstep.studies.campaign.schema import Campaign, CampaignFile, campaign_of
from quadstep.studies.tuning.gains import Conditions, TunedGain, gains_of, tunable, with_numbers
from quadstep.studies.tuning.objective import CandidateFlights
from quadstep.studies.tuning.trial import Stability

UNSEEN = 2**20
"""The first flight of those that no gain is tuned on."""

Numbers = Mapping[str, float]


class TuningRequest(NamedTuple):
    """A mission to be tuned. content: as the user wrote it. gains: what may change. different: whether flights differ."""

    path: Path
    text: str
    content: dict[str, object]
    mission: Mission
    section: TuneSection
    gains: list[TunedGain]
    different: bool

    @property
    def seeds(self) -> int:
        """Flights of each candidate; one where all flights are alike."""
        return self.section.seeds if self.different else 1

    @property
    def unseen(self) -> int:
        """Flights of each set of gains in the comparison."""
        return self.section.unseen if self.different else 1

    @property
    def names(self) -> dict[str, str]:
        """What is measured of a candidate: metrics without unit, and with it; of flights first, then the margins asked for."""
        return {**names_without_units(self.mission.scores), **{name: name + MARGINS[name] for name in self.section.margins}}

    def numbers(self, point: Sequence[float]) -> dict[str, float]:
        """What a point of the unit box puts at every key."""
        pairs = zip(self.gains, point, strict=True)
        return {key: number for one, place in pairs for key, number in one.numbers(one.value(place)).items()}

    @property
    def present(self) -> dict[str, float]:
        """What is at every key now."""
        return {leaf.key: leaf.present for one in self.gains for leaf in one.leaves}

    @property
    def start(self) -> list[float]:
        """The present gains in the unit box."""
        return [min(max(one.range.place(one.leaves[0].present), 0.0), 1.0) for one in self.gains]

    def campaign(self, vary: Mapping[str, object], **settings: object) -> CampaignFile:
        """Flights in which this varies. settings: of the campaign file."""
        shared: dict[str, object] = {
            "precision": self.section.precision,
            "score_period": self.section.score_period,
            "mission": str(self.path),
            "correlated": self.section.correlated,
        }
        return check(CampaignFile, {**shared, "vary": dict(vary), **settings}, f"{self.path}: tune")

    def with_gains(self, values: dict[str, float]) -> dict[str, object]:
        """The user's mission with these gains."""
        changed = {key: value for key, value in values.items() if value != self.present[key]}
        return with_numbers(self.content, self.mission, changed) if changed else self.content


def read_request(path: Path) -> TuningRequest:
    """The tuning request in a mission file; one that names no margin keeps those of its loop. Raises UserError."""
    content = read_toml(path)
    refuse_others(content, MISSION, str(path), "`quadstep tune` takes a mission with a table [tune]")
    asked = tuning_request(path, files.read_text(path, files.TOML), content, path.parent)
    given = asked.section.constraints if "constraints" in asked.section.model_fields_set else None

    def present() -> dict[str, Constraint]:
        return required_margins(check_mission(with_numbers(content, asked.mission, asked.present), str(path), path.parent))

    constraints = {**asked.section.of_flights, **margins_of(given, present)}
    return asked._replace(section=asked.section.model_copy(update={"constraints": constraints}))


def margins_of(
    constraints: Mapping[str, Constraint] | None, usual: Callable[[], dict[str, Constraint]]
) -> dict[str, Constraint]:
    """The margins that gains must leave: those that constraints name, but for limits of 0, and the usual ones where none is
    named; none where it is said that nothing is constrained.
    """
    named = {name: one for name, one in (constraints or {}).items() if name in MARGINS}
    if constraints is None or (constraints and not named):
        return usual()
    return {name: one for name, one in named.items() if one.least != 0.0}


def tuning_request(path: Path, text: str, content: dict[str, object], folder: Path, apart: bool = True) -> TuningRequest:
    """The tuning request in the content of a mission. path: of its file, for errors. apart: whether gains change one without
    the other, so that each must fit the present others at both its ends. Raises UserError.
    """
    mission = check_mission(content, str(path), folder)
    section = mission.tune
    if section is None:
        if not (keys := tunable(mission)):
            raise UserError(f"{path}: [tune] is missing, and the controller has no gains to tune")
        listing = f'list the gains to tune, as in gains = {{ "{keys[0]}" = {{}} }}; allowed: {", ".join(keys)}'
        raise UserError(f"{path}: [tune] is missing; {listing}")
    with errors_in(path):
        gains = gains_of(section, mission)
    for one in gains if apart else ():
        for end in (one.range.low, one.range.high):
            tried = with_numbers(content, mission, one.numbers(end))
            with errors_in(path, f"tune.gains: {one.key} cannot be {end:g}"):
                check_mission(tried, str(path), folder)
    different = bool(section.vary or section.correlated) or mission.noisy
    return TuningRequest(path, text, content, mission, section, gains, different)


def sound(mission: Mission) -> dict[str, Constraint]:
    """The margins of a sound loop of a mission, as constraints."""
    gain, phase, delay = limits(mission)
    least = {"gain_margin_up": gain, "gain_margin_down": gain, "phase_margin": phase, "delay_margin": delay}
    return {name: Constraint(least=value) for name, value in least.items() if value > 0.0}


ROUNDING = 1e-9
"""Share by which the margins of the same loop may differ where it was built otherwise."""


def required_margins(mission: Mission) -> dict[str, Constraint]:
    """The margins that better gains leave where nothing else is asked for: those of a sound loop, or the present ones where
    these are smaller; none of a loop that is unstable or cannot be linearised.
    """
    wanted = sound(mission)
    try:
        now = margin_metrics(mission, wanted)
    except UserError:
        return {}
    least = {name: min(now[name] * (1.0 - ROUNDING), one.least or 0.0) for name, one in wanted.items()}
    return {name: Constraint(least=value) for name, value in least.items() if value > 0.0}


class CandidateFlyer:
    """Flies candidates. drawing: what varies; flying: the same and the gains. sweeper: as of a `Flyer`."""

    def __init__(self, request: TuningRequest, seed: int, sweeper: Callable[..., Sweeper] = Sweep) -> None:
        section, source = request.section, str(request.path)
        self.asked = request
        self.drawing = request.campaign(section.vary, seed=seed)
        ends = {
            leaf.key: {"type": "uniform", "low": min(pair), "high": max(pair)}
            for one in request.gains
            for leaf in one.leaves
            for pair in [(leaf.share * one.range.low, leaf.share * one.range.high)]
        }
        flying = request.campaign({**section.vary, **ends}, seed=seed)
        content = with_numbers(request.content, request.mission, request.present)
        self.campaign: Campaign = campaign_of(flying, "", content, source, request.path.parent)
        self.flyer = Flyer(self.campaign, sweeper)
        plan = self.flyer.planner.plan(self.draws(0).at(0))
        self.duration = plan.ticks.last * plan.ticks.step

    def draws(self, first: int, count: int = 1) -> "Draws":
        """The draws of the flights from this number on."""
        return Draws(np.arange(first, first + count), draw(self.drawing, np.arange(first, first + count)))

    def fly(
        self, candidates: Sequence[Numbers], first: int, count: int, progress: Advance | None = None
    ) -> list[CandidateFlights]:
        """Each candidate over the draws of `count` flights from `first` on; one that cannot be flown loses them all.

        Raises UserError where none can be flown.
        """
        names = self.asked.names
        if count == 0 or not candidates:
            return [CandidateFlights(np.zeros(0, np.int8), np.zeros(0), np.zeros((0, len(names))), names) for _ in candidates]
        try:
            return self.flown(candidates, first, count, progress)
        except UserError:
            found = [self.flown_or_lost(one, first, count, progress) for one in candidates]
            if all(isinstance(one, UserError) for one in found):
                raise
        lost = CandidateFlights(
            np.full(count, Outcome.NOT_FINITE), np.zeros(count), np.full((count, len(names)), np.nan), names
        )
        return [lost if isinstance(one, UserError) else one for one in found]

    def flown_or_lost(
        self, candidate: Numbers, first: int, count: int, progress: Advance | None
    ) -> CandidateFlights | UserError:
        """One candidate, or why it cannot be flown."""
        try:
            return self.flown([candidate], first, count, progress)[0]
        except UserError as error:
            return error

    def flown(self, candidates: Sequence[Numbers], first: int, count: int, progress: Advance | None) -> list[CandidateFlights]:
        """Candidates all of which can be flown. Raises UserError."""
        draws = self.draws(first, count)
        every = len(candidates)
        flights = np.tile(draws.flights, every)
        drawn = {key: DrawnColumn(np.tile(one.values, every), one.options) for key, one in draws.drawn.items()}
        drawn |= {key: DrawnColumn(np.repeat([one[key] for one in candidates], count)) for key in self.asked.present}
        outcome, ended, metrics = self.flyer.sweep_all(flights, drawn, progress)
        metrics = np.hstack([metrics, np.full((len(metrics), len(self.asked.section.margins)), np.nan)])
        parts = (outcome.reshape(every, count), ended.reshape(every, count), metrics.reshape(every, count, -1))
        found = [CandidateFlights(*one, self.asked.names) for one in zip(*parts, strict=True)]
        costly = [name for name in self.asked.section.objective if name in MARGINS]
        return [one.with_values(self.margins(values, costly)) for one, values in zip(found, candidates, strict=True)]

    def margins(self, candidate: Numbers, names: Sequence[str]) -> dict[str, float]:
        """Of the mission with these gains. Raises UserError where it cannot be linearised."""
        if not names:
            return {}
        with errors_in(self.asked.path, f"tune: {names[0]}"):
            return margin_metrics(self.flyer.planner.mission(candidate), names)

    @property
    def stability(self) -> Stability:
        """The margins that the gains must leave."""
        limits = {name: one for name, one in self.asked.section.constraints.items() if name in MARGINS}
        return Stability(limits, lambda values: self.margins(values, list(limits)))

    def conditions(self) -> Conditions | None:
        """The conditions on the gains, for the mission and each draw of vehicle and controller; None if not requested."""
        if not self.asked.section.theorem:
            return None
        planner, base = self.flyer.planner, self.flyer.planner.mission({})
        draws = self.draws(0, self.asked.seeds)
        touching = [key for key in draws.drawn if key.partition(".")[0] in ("vehicle", "controller")]
        missions = {"": base}
        for place in range(self.asked.seeds if touching else 0):
            values = {key: draws.drawn[key].at(place) for key in touching}
            missions.setdefault(repr(values), planner.mission(values, place))
        return Conditions(list(missions.values()), self.asked.numbers)


class Draws(NamedTuple):
    """The numbers of some flights, and what varies in them."""

    flights: NDArray[np.int64]
    drawn: dict[str, DrawnColumn]

    def at(self, place: int) -> dict[str, object]:
        return {key: one.at(place) for key, one in self.drawn.items()}
