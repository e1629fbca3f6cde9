"""The pages of the keys of each kind of file, from the models that check these files."""

import re
import types
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, Union, get_args, get_origin

import annotated_types
from pydantic import AfterValidator, BaseModel
from pydantic.fields import FieldInfo

from docs.site.reference.markdown import code, plain, prose, table
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
from quadstep.mission.fields import Quantity, Section, as_diagonal, non_negative, positive
from quadstep.mission.lagrange import LagrangeMission
from quadstep.mission.multirotor import MultirotorMission
from quadstep.mission.schema import Mission
from quadstep.mission.template import template
from quadstep.studies.campaign.schema import CampaignFile
from quadstep.studies.comparison.schema import StudyFile

Model = type[BaseModel]


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
        f"What `quadstep fly` reads; `quadstep new` writes one with every key explained. {UNITS} Only `path` is needed. "
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

NAMES = ("Dryden",)
"""Words with which a meaning begins in a capital letter."""


class Key(NamedTuple):
    """One key of a table, as text."""

    name: str
    takes: str
    unit: str
    default: str
    meaning: str


def opened(kind: Any) -> tuple[Any, list[Any]]:
    """A type without its annotations, and these, outermost last."""
    notes: list[Any] = []
    while True:
        if get_origin(kind) is Annotated:
            kind, *more = get_args(kind)
            notes = [*more, *notes]
        elif get_origin(kind) is not None and "SerializeAsAny" in str(get_origin(kind)):
            (kind,) = get_args(kind)
        else:
            return kind, [one for note in notes for one in (note.metadata if isinstance(note, FieldInfo) else [note])]


def models_in(kind: Any) -> list[Model]:
    """Every table that a key may hold."""
    kind, _ = opened(kind)
    if isinstance(kind, type) and get_origin(kind) is None:
        return [kind] if issubclass(kind, BaseModel) else []
    return [found for one in get_args(kind) if not isinstance(one, str) for found in models_in(one)]


def tables_in(model: Model, field: FieldInfo) -> list[Model]:
    """Every table that a key may hold; of a mission's controller, those of the package that its vehicle can have."""
    found = models_in(field.annotation)
    if found == [ControllerSection] and issubclass(model, Mission):
        found = [section_of(law) for law in controllers(model.measures).values()]
        return [*found, AutopilotSection] if model.measures is Measured else found
    return found


ENDS = ((annotated_types.Gt, "gt", "above"), (annotated_types.Ge, "ge", "from"), (annotated_types.Lt, "lt", "below"))

SIGNS = {"above 0": "positive ", "from 0": "non-negative "}
"""Of numbers whose range has but one end, at 0: said before them."""


def ends(notes: list[Any]) -> str:
    """A range in words; nothing where there is none that matters."""
    found = {
        word: max(getattr(note, key) for note in notes if isinstance(note, kind))
        for kind, key, word in ENDS
        if any(isinstance(note, kind) for note in notes)
    }
    if len({"above", "from"} & found.keys()) == 2:
        del found["from" if found["from"] <= found["above"] else "above"]  # the stricter says it
    found = {word: end for word, end in found.items() if abs(end) < 1e9}
    most = [
        note.le
        for note in notes
        if isinstance(note, annotated_types.Le) and isinstance(note.le, int | float) and note.le < 1e6
    ]
    if list(found) == ["from"] and most:
        return f"from {found['from']:g} to {min(most):g}"
    return " and ".join([*(f"{word} {end:g}" for word, end in found.items()), *(f"at most {min(most):g}" for _ in most[:1])])


WORDS = {bool: "`true`, `false`", int: "a whole number", float: "a number", str: "text"}

ANY = "values of any kind"

SEVERAL = {bool: "`true` or `false`", int: "whole numbers", float: "numbers", str: "strings"}


def several(kind: Any, least: str = "") -> str:
    """What a list or a table of such entries takes."""
    kind, notes = opened(kind)
    origin, arguments = get_origin(kind), get_args(kind)
    if origin is Literal:
        return f"{least}values, each {' or '.join(code(repr(one)) for one in arguments)}"
    if origin in (tuple, list):
        return f"{least}lists of {several(arguments[0])}"
    if isinstance(kind, type) and issubclass(kind, BaseModel):
        return f"{least}[tables](#{anchor(kind)})"
    within = ends(notes)
    sign = SIGNS.get(within, "")
    return f"{least}{sign}{SEVERAL.get(kind, ANY)}{f' {within}' if within and not sign else ''}"


def of_entries(kind: Any, notes: list[Any]) -> str:
    """What a list takes."""
    inner = get_args(kind)
    checks = [note.func for note in notes if isinstance(note, AfterValidator)]
    each = "positive " if positive in checks else "non-negative " if non_negative in checks else ""
    sizes = [note.min_length for note in notes if isinstance(note, annotated_types.MinLen)]
    if len(inner) == 2 and inner[1] is Ellipsis:
        return f"a list of {several(inner[0], f'at least {sizes[0]} ' if sizes and sizes[0] > 1 else '')}"
    words = {2: "two", 3: "three", 4: "four"}.get(len(inner), str(len(inner)))
    alone = "one or " if any(getattr(note, "func", None) is as_diagonal for note in notes) else ""
    return f"{alone}{words} {each}numbers"


def takes(kind: Any, notes: tuple[Any, ...] = ()) -> str:
    """What a key may hold, in words."""
    kind, inner = opened(kind)
    said, origin, arguments = [*inner, *notes], get_origin(kind), get_args(kind)
    if origin in (Union, types.UnionType):
        parts = [takes(one, tuple(said)) for one in arguments if one is not type(None)]
        text = " or ".join(dict.fromkeys(parts))
    elif origin is Literal:
        text = ", ".join(code(f'"{one}"' if isinstance(one, str) else repr(one)) for one in arguments)
    elif origin is tuple:
        text = of_entries(kind, said)
    elif origin is dict:
        text = f"a table of {several(arguments[1])}".removesuffix(f" of {ANY}")
    elif origin is list:
        text = f"a list of {several(arguments[0])}"
    elif isinstance(kind, type) and issubclass(kind, BaseModel):
        text = f"[{kind_name(kind)}](#{anchor(kind)})"
    else:
        within = ends(said)
        sign = SIGNS.get(within) if kind is float else None
        text = f"a {sign}number" if sign else f"{WORDS.get(kind, 'anything')} {within}".strip()
    return text


def kind_name(model: Model) -> str:
    """How a table is called: by its type where it has one, else by its class."""
    field = model.model_fields.get("type")
    if field is not None and get_origin(field.annotation) is Literal:
        return " or ".join(map(str, get_args(field.annotation)))
    return "a table"


def anchor(model: Model) -> str:
    """Where a table stands on its page."""
    return model.__name__.lower()


@cache
def laws() -> dict[Model, tuple[str | None, str]]:
    """The tables of every controller and of its nets: the vehicle that has its defaults (None: the paper's), and its type."""
    found: dict[Model, tuple[str | None, str]] = {}
    for vehicle, mission in zip(("x500", None, "planar"), MISSIONS.values(), strict=True):
        for law in tables_in(mission(), mission().model_fields["controller"]):
            nets = models_in(law.model_fields["nets"].annotation) if "nets" in law.model_fields else []
            found |= dict.fromkeys((law, *nets), (vehicle, kind_name(law)))
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
    value = field.get_default(call_default_factory=True)
    if value is None and model in laws() and name in BELIEVED_UNITS:
        return "the vehicle's"
    if (
        value is None
        and model in laws()
        and name in (numbers := scaled(*laws()[model]))
        and name not in ("weights", "parameters")
    ):
        return f"{code(numbers[name])} ({laws()[model][0] or 'the paper'})"
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
            whole = f"one of the tables {', '.join(f'[{kind_name(one)}](#{anchor(one)})' for one in inner)}"
        text = MEANINGS.get(name) or (f"the firmware's parameters `{name}`" if inner else "")
        meaning = note.meaning or (summary(inner[0]) if len(inner) == 1 else "") or text
        yield Key(name, whole, note.unit if note.unit != "-" else "", default_of(name, field, model), meaning)


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
        return laws()[model][1] + (f": {path.rpartition('.')[2]}" if kind == "a table" else "")
    shown = f"[[{path[:-2]}]]" if path.endswith("[]") else f"[{path}]"
    return f"`{shown}`" + (f', type = "{kind}"' if kind != "a table" else "")


def first_paragraph(model: Model) -> str:
    """What a table is."""
    text = (model.__doc__ or "").strip().partition("\n\n")[0]
    return " ".join(text.split())


def summary(model: Model) -> str:
    """What a table is, as its key says it; nothing of a table that says no more than that it is one."""
    text = "" if model.__doc__ == Section.__doc__ else re.split(r"\.(?: (?=[A-Z])|$)", first_paragraph(model))[0]
    return text if text.startswith(NAMES) else text[:1].lower() + text[1:]


def section(model: Model, path: str) -> str:
    """One table."""
    rows = [(code(one.name), prose(one.meaning), one.takes, plain(one.unit), one.default) for one in keys(model)]
    body = table(("key", "meaning", "takes", "unit", "if left out"), rows)
    body = f":::{{container}} keys\n\n{body}\n:::\n"
    title = f"({anchor(model)})=\n### {heading(model, path)}\n\n" if path else ""
    return f"{title}{prose(first_paragraph(model))}\n\n{body}"


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
