"""A TOML listing of a page: a whole file of some kind, or a part of a mission or campaign, checked as quadstep reads it."""

import contextlib
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from quadstep.identify.datasheet import Datasheet
from quadstep.identify.logs.mapping import Mapping
from quadstep.io.errors import UserError
from quadstep.mission.airframe import AirframeSection
from quadstep.mission.check import check
from quadstep.mission.read import check_mission
from quadstep.studies.campaign.schema import CampaignFile, campaign_of
from quadstep.studies.classroom import ClassSection
from quadstep.studies.comparison.schema import StudyFile
from quadstep.studies.lessons import Tasks

Content = dict[str, Any]

LINE = {"type": "minimum-jerk", "end": [1.0, 0.5, 3.0], "duration": 2.0}
PAPER: Content = {"path": LINE}
REAL: Content = {"vehicle": {"preset": "research-2.6kg"}, "path": LINE, "controller": {"type": "pid"}}
BASES = (PAPER, REAL)
"""Missions that a part of one is tried in."""


def merged(base: Content, part: Content) -> Content:
    """A mission with a part of it replaced; a table that says its type, or whose kind changes, as a whole."""
    found = dict(base)
    for key, value in part.items():
        whole = not isinstance(value, dict) or {"type", "preset"} & value.keys() or not isinstance(base.get(key), dict)
        found[key] = value if whole else merged(base[key], value)
    return found


def check_campaign(content: Content, source: str, folder: Path) -> None:
    """A whole campaign; a mission that it names and that is not there is taken for one of ours."""
    file = check(CampaignFile, content, source, folder)
    for base in (None, *BASES):
        mission = file.mission if isinstance(file.mission, dict) else base
        if mission is not None:
            with contextlib.suppress(UserError):
                campaign_of(file, source, mission, source, folder)
                return
    campaign_of(file, source, REAL, source, folder)


def check_part(content: Content, source: str, folder: Path) -> None:
    """A part of a mission, or of a campaign."""
    if content.keys() <= CampaignFile.model_fields.keys():
        check_campaign({"mission": "mission.toml", **content}, source, folder)
        return
    errors = []
    for base in BASES:
        try:
            check_mission(merged(base, content), source, folder)
        except UserError as error:
            errors.append(str(error))
        else:
            return
    raise UserError(" | ".join(errors))


def model(kind: type[Any]) -> Callable[[Content, str, Path], object]:
    """Checks files of one model."""
    return lambda content, source, folder: check(kind, content, source, folder)


KINDS: tuple[tuple[set[str], Callable[[Content, str, Path], object]], ...] = (
    ({"vehicles", "controllers"}, model(StudyFile)),
    ({"kv"}, model(Datasheet)),
    ({"motors"}, model(Mapping)),
    ({"tasks"}, model(Tasks)),
    ({"students"}, model(ClassSection)),
    ({"mission"}, check_campaign),
    ({"rotor", "mass"}, model(AirframeSection)),
    ({"path"}, check_mission),
)
"""Keys by which a whole file is known, and what checks it; the first that fits."""


def check_toml(text: str, source: str, folder: Path) -> None:
    """Raises UserError for a listing that quadstep would refuse. folder: where files that it names are."""
    content = tomllib.loads(text)
    whole = next((checks for keys, checks in KINDS if keys <= content.keys()), None)
    if whole is not None:
        with contextlib.suppress(UserError):  # [path] alone may be a part of a mission for a real vehicle
            whole(content, source, folder)
            return
    (whole if whole is not None and whole is not check_mission else check_part)(content, source, folder)
