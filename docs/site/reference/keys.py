"""The pages of the keys of each kind of file, from the models that check these files."""

import re
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple, cast, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from docs.site.reference.markdown import code, plain, prose, table
from docs.site.reference.takes import Model, anchor, kind_name, models_in, opened, takes
from quadstep.bridges.autopilots import AutopilotSection
from quadstep.control.registry import controllers
from quadstep.identify.datasheet import Datasheet
from quadstep.identify.logs.mapping import Mapping
from quadstep.interfaces.controller import Measured
from quadstep.interfaces.gain import BELIEVED_UNITS
from quadstep.mission.airframe import AirframeSection
from quadstep.mission.declared import declared_kind
from quadstep.mission.derived import ControllerSection, section_of
from quadstep.mission.distributions import Choice, CorrelatedKeys, Grid, LogNormal, Normal, Sobol, Uniform
from quadstep.mission.fields import Quantity, Section
from quadstep.mission.lagrange import LagrangeMission
from quadstep.mission.multirotor import MultirotorMission
from quadstep.mission.schema import Mission
from quadstep.mission.template import template
from quadstep.studies.campaign.schema import CampaignFile
from quadstep.studies.comparison.schema import StudyFile


class File(NamedTuple):
    """A kind of file. title, text: of its page. models: its outermost tables, under a heading each."""

    title: str
    text: str
    models: dict[str, Callable[[], Model]]


UNITS = "SI units, angles in radians; a table `[a.b]` may also be written as `a.b.key = value`."

MISSIONS: dict[str, Callable[[], Model]] = {
    "For a real vehicle": lambda: MultirotorMission,
    "For the paper's plant": lambda: LagrangeMission,
    "For the planar quadrotor": lambda: declared_kind("planar", Path()),
}

FILES = {
    "mission-file": File(
        "Mission files",
        f"What `quadstep fly` reads; `quadstep new` writes one with every key explained. {UNITS} "
        "A real vehicle needs `vehicle` and `path`, the paper's plant only `path`. "
        "Three kinds of table have their own pages: docs/reference/mission-path.md, docs/reference/mission-controller.md, "
        "docs/reference/mission-autopilot.md.",
        MISSIONS,
    ),
    "mission-path": File("Paths in mission files", "The keys of a mission's `[path]`, for each `type`.", MISSIONS),
    "mission-controller": File(
        "Controllers in mission files",
        "The keys of a mission's `[controller]`, for each `type` (docs/controllers.md, docs/reference/mission-autopilot.md). "
        "A default that names a vehicle is scaled to the one that flies; its number is for that one, as in `quadstep new`.",
        MISSIONS,
    ),
    "mission-autopilot": File(
        "Autopilots in mission files",
        "The keys of a mission's `[controller]` whose `type` is an autopilot or one of its controllers (docs/stock.md, "
        "docs/autopilot.md). They have the firmware's names.",
        MISSIONS,
    ),
    "vehicle-file": File(
        "Vehicle files",
        f"What `[vehicle] file = ...` names, and the keys of `[vehicle]` itself (docs/vehicles.md). {UNITS}",
        {"Keys": lambda: AirframeSection},
    ),
    "campaign-file": File(
        "Campaign files", "What `quadstep campaign` reads (docs/campaigns.md).", {"Keys": lambda: CampaignFile}
    ),
    "study-file": File("Study files", "What `quadstep compare` reads (docs/compare.md).", {"Keys": lambda: StudyFile}),
    "mapping-file": File(
        "Mapping files", "What `--mapping` names: a log's columns (docs/logs.md).", {"Keys": lambda: Mapping}
    ),
    "data-sheet": File("Data sheets", "What `quadstep vehicle fit` reads (docs/logs.md).", {"Keys": lambda: Datasheet}),
}


HOMES: dict[Model, str] = {
    AirframeSection: "vehicle-file",
    **dict.fromkeys((Uniform, Sobol, Normal, LogNormal, Choice, Grid, CorrelatedKeys), "campaign-file"),
}
"""Tables that several kinds of file have, and the page that has them."""


MEANINGS = {
    "vehicle": "what flies",
    "path": "the path to follow",
    "controller": "the control law",
    "events": "what changes during the flight",
    "limits": "bounds beyond which a flight is lost",
    "type": "chooses this table",
}
"""Of keys that hold one of several tables, or one that has no text of its own."""

SAID = "; default: "
"""Before a default in a meaning."""

ONE_OF = {tuple: "a list of the tables", dict: "a table, for each key one of"}

NAMES = ("Dryden",)
"""Words with which a meaning begins in a capital letter."""


class Key(NamedTuple):
    """One key of a table, as text."""

    name: str
    takes: str
    unit: str
    default: str
    meaning: str


def tables_in(model: Model, field: FieldInfo) -> list[Model]:
    """Every table that a key may hold; of a mission's controller, those of the package that its vehicle can have."""
    found = models_in(field.annotation)
    if found == [ControllerSection] and issubclass(model, Mission):
        found = [section_of(law) for law in controllers(model.measures).values()]
        return [*found, AutopilotSection] if model.measures is Measured else found
    return found


class Law(NamedTuple):
    """Whose table it is, or whose nets': vehicle: which has its defaults (None: the paper's). label: the full name."""

    vehicle: str | None
    type: str
    label: str


@cache
def laws() -> dict[Model, Law]:
    """The tables of every controller and of its nets."""
    found: dict[Model, Law] = {}
    for vehicle, made in zip(("x500", None, "planar"), MISSIONS.values(), strict=True):
        mission = cast("type[Mission]", made())
        labels = {kind: law.label for kind, law in controllers(mission.measures).items()}
        for law in tables_in(mission, mission.model_fields["controller"]):
            kind = kind_name(law)
            nets = models_in(law.model_fields["nets"].annotation) if "nets" in law.model_fields else []
            found |= {law: Law(vehicle, kind, labels.get(kind, "")), **dict.fromkeys(nets, Law(vehicle, kind, ""))}
    return found


@cache
def scaled(vehicle: str | None, kind: str) -> dict[str, str]:
    """The defaults of a controller's keys on a vehicle, as `quadstep new` writes them."""
    text = re.split(
        r"^\[(?!controller)", template(vehicle, kind).partition("\n[controller]")[2], maxsplit=1, flags=re.MULTILINE
    )
    return dict(re.findall(r"^# (\w+) = (.+?) +#", text[0], re.MULTILINE))


def default_of(name: str, field: FieldInfo, model: Model) -> str:
    """A default as TOML, or in words."""
    if field.is_required():
        return "needed"
    value, law = field.get_default(call_default_factory=True), laws().get(model)
    if value is None and law and name not in ("weights", "parameters", *BELIEVED_UNITS):
        numbers = scaled(law.vehicle, law.type)
        return f"{code(numbers[name])} ({law.vehicle or 'the paper'})" if name in numbers else ""
    if isinstance(value, BaseModel):
        return code(getattr(value, "type", ""))
    return "" if value in (None, (), {}, "") else code(written(value))


def written(value: Any) -> str:
    """A value as TOML."""
    if isinstance(value, tuple | list):
        return f"[{', '.join(map(written, value))}]"
    if isinstance(value, dict):
        return f"{{ {', '.join(f'{key} = {written(one)}' for key, one in value.items())} }}"
    if isinstance(value, bool):
        return str(value).lower()
    return f'"{value}"' if isinstance(value, str) else f"{value:g}" if isinstance(value, float) else str(value)


def keys(model: Model) -> Iterator[Key]:
    """The keys of a table."""
    for name, field in model.model_fields.items():
        note = next((one for one in field.metadata if isinstance(one, Quantity)), Quantity("", ""))
        inner = tables_in(model, field)
        whole = takes(field.annotation, tuple(field.metadata))
        if len(inner) > 1:
            listed = ", ".join(f"[{kind_name(one)}](#{anchor(one)})" for one in inner)
            whole = ONE_OF.get(get_origin(opened(field.annotation)[0]), "one of the tables") + f" {listed}"
        text = MEANINGS.get(name) or (f"the firmware's parameters `{name}`" if inner else "")
        meaning, _, said = note.meaning.partition(SAID)
        meaning = meaning or (summary(inner[0]) if len(inner) == 1 else "") or text
        number = default_of(name, field, model)
        default = f"{prose(said)}: {number}" if said and number.endswith(")") else prose(said) or number
        yield Key(name, whole, note.unit if note.unit != "-" else "", default, meaning)


def below(model: Model, path: str, page: str, seen: dict[Model, str]) -> None:
    """Collects a table and all in it that belong on a page, each with where it first stands."""
    if model in seen or HOMES.get(model, page) != page:
        return
    seen[model] = path
    for name, field in model.model_fields.items():
        for inner in tables_in(model, field):
            several = get_origin(opened(field.annotation)[0]) is tuple
            below(inner, f"{path}.{name}".lstrip(".") + ("[]" if several else ""), page, seen)


def heading(model: Model, path: str) -> str:
    """Of a table."""
    kind = kind_name(model)
    if path.startswith("controller") and model in laws():
        return laws()[model].type + (f": {path.rpartition('.')[2]}" if kind == "a table" else "")
    shown = f"[[{path[:-2]}]]" if path.endswith("[]") else f"[{path}]"
    return f"`{shown}`" + (f', type = "{kind}"' if kind != "a table" else "")


def first_paragraph(model: Model) -> str:
    """What a table is, without the fields that its text explains; nothing of one that says no more than that it is a table."""
    text = "" if model.__doc__ == Section.__doc__ else (model.__doc__ or "").strip().partition("\n\n")[0]
    return re.split(r"(?<=\.) (?=[a-z_]+: )", " ".join(text.split()))[0]


def summary(model: Model) -> str:
    """What a table is, as its key says it."""
    text = re.split(r"\.(?: (?=[A-Z])|$)", first_paragraph(model))[0]
    return text if text.startswith(NAMES) else text[:1].lower() + text[1:]


def section(model: Model, path: str) -> str:
    """One table."""
    rows = [(code(one.name), prose(one.meaning), one.takes, plain(one.unit), one.default) for one in keys(model)]
    body = table(("key", "meaning", "takes", "unit", "if left out"), rows)
    body = f":::{{container}} keys\n\n{body}\n:::\n"
    title = f"({anchor(model)})=\n### {heading(model, path)}\n\n" if path else ""
    label, said = laws()[model].label if model in laws() else "", first_paragraph(model)
    name = f"**{prose(label[:1].upper() + label[1:])}.** " if label and not said.lower().startswith(label.lower()) else ""
    return f"{title}{name}{prose(said)}\n\n{body}"


def home(model: Model, path: str, page: str) -> str:
    """The page, of those of a mission, that has a table; any other kind of file has one page."""
    table, _, inner = path.partition(".")
    if not page.startswith("mission-"):
        return page
    if table == "controller" and ("parameters" in model.model_fields or inner not in ("", "nets")):
        table = "autopilot"
    return f"mission-{table}" if table in ("path", "controller", "autopilot") else "mission-file"


def tables(name: str) -> dict[str, dict[Model, str]]:
    """Every table that the page of a kind of file has, under each heading; a table stands under the first that has it."""
    found: dict[str, dict[Model, str]] = {}
    known: set[Model] = set()
    for title, model in FILES[name].models.items():
        seen: dict[Model, str] = {}
        below(model(), "", name, seen)
        found[title] = {one: path for one, path in seen.items() if one not in known and home(one, path, name) == name}
        known |= seen.keys()
    return {title: inside for title, inside in found.items() if inside}


def page(name: str) -> str:
    """The page of one kind of file."""
    file, under = FILES[name], tables(name)
    parts = [f"# {file.title}\n\n{file.text}\n"]
    for title, found in under.items():
        outermost = next((one for one, path in found.items() if not path), None)
        parts += [f"({anchor(outermost)})=" if outermost else "", f"## {title if len(under) > 1 else 'Keys'}\n"]
        parts += [section(model, path) for model, path in found.items()]
    return "\n".join(parts)
