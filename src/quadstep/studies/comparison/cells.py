"""A study read and laid out: every vehicle, path, scenario and controller that belong together are one cell."""

from collections.abc import Iterator, Mapping
from importlib import resources
from operator import attrgetter
from pathlib import Path
from typing import NamedTuple, cast

import numpy as np

from quadstep.interfaces.controller import Controller
from quadstep.io import files
from quadstep.io.documents import parse_toml, read_toml
from quadstep.io.doors import METRICS, OWN, named, own_place
from quadstep.io.doors import PLANTS as PLANTS_OF_OTHERS
from quadstep.io.errors import UserError, errors_in, unknown_name
from quadstep.io.places import place
from quadstep.io.user_code import in_one_line
from quadstep.metrics.registry import EFFORTS
from quadstep.mission.check import check
from quadstep.mission.declared import PLANTS, is_plant
from quadstep.mission.own_thing import own_metric
from quadstep.mission.presets import is_airframe, preset_names
from quadstep.mission.read import STUDY, check_mission, kind_of, refuse_others
from quadstep.mission.schema import Mission
from quadstep.studies.campaign.draws import draw
from quadstep.studies.campaign.planner import planner
from quadstep.studies.campaign.schema import Campaign, CampaignFile, campaign_of
from quadstep.studies.comparison.schema import Content, ControllerEntry, StudyFile
from quadstep.studies.tuning.gains import filled_in, learning_rates, with_numbers
from quadstep.studies.tuning.ground import UNSEEN

MOST_CELLS = 20_000
"""Of one study: each needs some seconds."""


class Situation(NamedTuple):
    """What every controller is put into alike, by the names that the study gives it."""

    vehicle: str
    path: str
    scenario: str

    @property
    def label(self) -> str:
        return ", ".join(filter(None, self))


class StudyCell(NamedTuple):
    """A controller in a situation: flights of one campaign. repeat: which search its gains are from, 0 the best."""

    situation: Situation
    controller: str
    campaign: Campaign
    repeat: int = 0

    @property
    def label(self) -> str:
        name = f"{self.controller} (tuning {self.repeat + 1})" if self.repeat else self.controller
        return ": ".join(filter(None, (name, self.situation.label)))

    @property
    def who(self) -> tuple[str, str]:
        return self.situation.vehicle, self.controller

    @property
    def mission(self) -> Mission:
        """As written, nothing of it drawn. Raises UserError."""
        return self.campaign.mission

    @property
    def law(self) -> type[Controller]:
        return self.mission.controller.controller


class ComparisonStudy(NamedTuple):
    """A study as read. source, folder: of its file, for errors and for the files it names."""

    file: StudyFile
    text: str
    source: str
    folder: Path

    # What is flown

    def situations(self) -> Iterator[Situation]:
        for vehicle in self.file.vehicles:
            for path, scenario in self.places(vehicle):
                yield Situation(vehicle, path, scenario)

    def places(self, vehicle: str) -> Iterator[tuple[str, str]]:
        for path, way in self.file.paths.items():
            for scenario, one in self.file.scenarios.items():
                if way.suits(vehicle) and one.suits(vehicle) and (one.paths is None or path in one.paths):
                    yield path, scenario

    def draws(self, scenario: str) -> Content:
        """What differs from flight to flight in a scenario, as in a campaign."""
        one = self.file.scenarios[scenario]
        varying = {key: value.model_dump(exclude_none=True) for key, value in one.vary.items()}
        return {"vary": varying, "correlated": [group.model_dump(exclude_none=True) for group in one.correlated]}

    def controllers(self, vehicle: str) -> dict[str, ControllerEntry]:
        return {name: one for name, one in self.file.controllers.items() if one.suits(vehicle)}

    # Missions

    def vehicle(self, name: str) -> Content:
        """What its missions say of a vehicle: a preset, a plant that declares itself, a vehicle in a Python file, or a file.

        Raises UserError for Python that cannot be run.
        """
        if name in preset_names():
            return {"preset": name}
        if is_plant(name, self.folder):
            return {"type": name}
        return {"preset" if place(name) else "file": name}

    def content(self, situation: Situation, controller: Content) -> Content:
        file, named = self.file, {"vehicle": self.vehicle(situation.vehicle)}
        path, scenario = file.paths[situation.path].mission, file.scenarios[situation.scenario].mission
        mission = together(file.common, path, scenario, named)
        return {**mission, "name": situation.label, "controller": controller, "metrics": self.summed(mission)}

    def summed(self, mission: Content) -> list[str]:
        """The metrics that a mission has to name: effort, where its vehicle has rotors of its own, and the user's."""
        return [*(EFFORTS if is_airframe(mission["vehicle"]) else ()), *filter(is_own, self.file.metrics)]

    def reported(self) -> list[str]:
        """The metrics that are reported, by their names in results. Raises UserError."""
        with errors_in(self.source, "metrics"):
            return [own_metric(one, self.folder).name if is_own(one) else one for one in self.file.metrics]

    def nominal(self, vehicle: str, controller: Content) -> Mission:
        """The mission of a vehicle as its makers know it, on its first path in no scenario."""
        return check_mission({**self.at_rest(vehicle), "controller": controller}, self.source, self.folder)

    def at_rest(self, vehicle: str) -> Content:
        """What a nominal mission says, but for its controller."""
        path = next(one.mission for one in self.file.paths.values() if one.suits(vehicle))
        return together(self.file.common, path, {"vehicle": self.vehicle(vehicle)})

    def knowing(self, vehicle: str, controller: Content) -> Content:
        """A controller's table with every number written out that follows from the vehicle: what it knows is the vehicle as
        its makers know it, whatever a scenario makes of it. Raises UserError.
        """
        mission = self.nominal(vehicle, controller)
        left = {key: value for key, value in filled_in(mission).items() if attrgetter(key)(mission.controller) is None}
        found = {**controller, **{key: list(one) if isinstance(one, tuple) else one for key, one in left.items()}}
        nets = mission.controller.table
        return (
            {**found, "nets": {**learning_rates(mission), **cast(Content, found.get("nets", {}))}}
            if nets and nets.enabled
            else found
        )

    def with_gains(self, vehicle: str, controller: Content, values: Mapping[str, float]) -> Content:
        """A controller's table with these gains, by key of the mission."""
        mission = self.nominal(vehicle, controller)
        return cast(Content, with_numbers({"controller": controller}, mission, dict(values))["controller"])

    def cell(self, situation: Situation, name: str, controller: Content, repeat: int = 0) -> StudyCell:
        """A controller in a situation. Raises UserError naming both."""
        mission, file = self.content(situation, controller), self.file
        asked: Content = {
            "mission": mission,
            "flights": file.seeds,
            "seed": file.seed,
            "precision": file.precision,
            **({} if file.score_period is None else {"score_period": file.score_period}),
        }
        with errors_in(self.source, f"{name} cannot fly {situation.label}"):
            checked = check(CampaignFile, asked | self.draws(situation.scenario), self.source)
            campaign = campaign_of(checked, "", mission, self.source, self.folder)
            return StudyCell(situation, name, campaign, repeat)

    def check_cell(self, cell: StudyCell) -> None:
        """Refuses a cell whose first flight cannot be built. Raises UserError."""
        first = {name: one.at(0) for name, one in draw(cell.campaign.file, np.array([FIRST])).items()}
        with errors_in(self.source, f"{cell.controller} cannot fly {cell.situation.label}"), in_one_line():
            planner(cell.campaign).plan(first)


FIRST = UNSEEN
"""The number of the first flight that is reported: none of these was used to find a gain."""


def is_own(metric: str) -> bool:
    """Whether this names a metric of the user's own, not one that flights have."""
    return own_place(metric, METRICS) is not None


def together(*tables: Mapping[str, object]) -> Content:
    """Tables key by key, the later ones on top; tables in them likewise."""
    found: Content = {}
    for table in tables:
        for key, value in table.items():
            before = found.get(key)
            found[key] = together(before, value) if isinstance(before, dict) and isinstance(value, dict) else value
    return found


def read_study(path: Path) -> ComparisonStudy:
    """The study in a TOML file. Raises UserError naming file, key and what is allowed."""
    content = read_toml(path)
    refuse_others(content, STUDY, str(path))
    return study_of(files.read_text(path, files.TOML), str(path), path.parent.resolve())


def study_of(text: str, source: str, folder: Path) -> ComparisonStudy:
    """The study in TOML. Raises UserError."""
    study = ComparisonStudy(check(StudyFile, parse_toml(text, source), source, folder), text, source, folder)
    empty = [vehicle for vehicle in study.file.vehicles if not list(study.places(vehicle))]
    if empty:
        raise UserError(f"{source}: vehicles: {empty[0]} has no suitable path and scenario")
    cells = sum(len(study.controllers(one.vehicle)) for one in study.situations())
    if cells > MOST_CELLS:
        raise UserError(f"{source}: {cells} cells; allowed: at most {MOST_CELLS}")
    check_vehicles(study)
    return study


def check_vehicles(study: ComparisonStudy) -> None:
    """Refuses vehicles that are not there, or of which nothing is known. Raises UserError."""
    for vehicle in study.file.vehicles:
        with errors_in(study.source, "vehicles"):
            table = study.vehicle(vehicle)
            kind_of(table, study.folder)
        if "file" in table and not (study.folder / vehicle).exists():
            names = named((*preset_names(), *PLANTS), PLANTS_OF_OTHERS)
            told = unknown_name("vehicle", vehicle, names, f"the file of one, or {OWN}")
            raise UserError(f"{study.source}: vehicles: {told}")
        if not study.controllers(vehicle):
            raise UserError(f"{study.source}: vehicles: no controller flies {vehicle}")


def shipped_study() -> ComparisonStudy:
    """The study that comes with the package, with its gains. Raises UserError where a file of the user's own is in the way."""
    with resources.as_file(resources.files("quadstep.studies.comparison") / "studies") as folder:
        return read_study(folder / "controllers.toml")
