"""The page's data, as its front end reads it. Names and meanings are those of `frontend/src/data/contract.ts`."""

import base64
import math
import re
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

FORMAT = 1


class Effect(NamedTuple):
    """What a control's value v changes: factor * v + offset, or factor / v + offset where power is -1.

    what: "parameter", "start" or "duration"; or "hover", of rotor speeds at the start. add: on top of what is there.
    """

    what: str
    name: str
    factor: float = 1.0
    power: int = 1
    offset: float = 0.0
    add: bool = False


class Component(NamedTuple):
    """One number of a control. value: the file's."""

    label: str
    value: float
    sets: tuple[Effect, ...]


class Control(NamedTuple):
    """A slider, a switch ("toggle") or the number of neurons. low, high: hard bounds; min, max: of the slider."""

    id: str
    label: str
    unit: str
    group: str
    hint: str
    kind: str
    scale: str
    min: float
    max: float
    low: float
    high: float
    step: float
    components: tuple[Component, ...]


class ConditionData(NamedTuple):
    """left > right must hold, or left >= right. A term is a number, {"name": parameter} or {"op": ..., "of": [terms]}."""

    text: str
    left: object
    right: object
    orEqual: bool  # noqa: N815 (the front end's names)
    source: str
    order: bool  # of two parameters, not of a theory
    unit: str


class ControllerData(NamedTuple):
    """A law that can fly the flight. preset, tables: keys; overrides: (place, value) on top of the preset. off_command: of its
    `Controller`.
    """

    id: str
    label: str
    law: str
    preset: str
    overrides: tuple[tuple[int, float], ...]
    tables: tuple[str, ...]
    start: tuple[float, ...]
    controls: tuple[Control, ...]
    conditions: tuple[ConditionData, ...]
    offCommand: str = ""  # noqa: N815


class Line(NamedTuple):
    """A line of a plot: column, or column - minus."""

    label: str
    column: str
    minus: str | None = None
    dashed: bool = False


class PanelData(NamedTuple):
    """A plot over time. optional: of what a flight may lack, which is zero throughout then."""

    id: str
    title: str
    unit: str
    lines: tuple[Line, ...]
    log: bool = False
    optional: bool = False


class RotorView(NamedTuple):
    """A rotor of the drawn vehicle; position in body axes [m], z along the thrust."""

    position: tuple[float, float, float]
    spin: int
    force: str | None


class Arrow(NamedTuple):
    """A vector of the world, by columns of the row or by parameters."""

    label: str
    unit: str
    kind: str
    columns: tuple[str, str, str] | None
    parameters: tuple[str, str, str] | None


class Scene(NamedTuple):
    """How the flight is drawn. hover: thrust of one rotor at hover [N]; ground: height of the grid [m]."""

    arm: float
    radius: float
    rotors: tuple[RotorView, ...]
    hover: float
    position: tuple[str, str, str]
    wanted: tuple[str, str, str]
    attitude: dict[str, object]
    thrust: str | None
    arrows: tuple[Arrow, ...]
    ground: float


class RecordedData(NamedTuple):
    """A flight as flown by Python; rows in base64. period: from row to row [s]."""

    columns: tuple[tuple[str, str], ...]
    rows: str
    type: str
    count: int  # type: ignore[assignment]  # hides a method of tuples that nobody calls
    period: float


class Summary(NamedTuple):
    """What the page sums up of a flight. since: errors count from this time on [s]. limit, least: the parameters that hold a
    rotor's greatest and least thrust [N]. upward: what rotors lift at one newton each [N]. arm, cut: as `Mission` has them.
    filed: what Python measured of the file's flight, by the front end's names.
    """

    since: float
    limit: str | None
    least: str | None
    upward: float
    arm: float
    cut: str
    filed: dict[str, float]


class Cell(NamedTuple):
    """Where a flight stands in the table of its group; the names of the axes with it. colour: of many flights like it, instead
    of its own mark; empty: none.
    """

    block: str
    row: str
    column: str
    rowAxis: str  # noqa: N815
    columnAxis: str  # noqa: N815
    colour: str = ""


class Rate(NamedTuple):
    """Many flights of which the page counts the failures, as `quadstep campaign` flies them.

    module: WebAssembly (`engines/wasm.py`), in base64. double: whether in f64, else f32. constants: names of the numbers
    that all flights share, as the module reads them. varies: of the others; rows: these, one row a name, one column a flight.
    every: ticks from one run of each task to the next. results: rows that a module writes. failure: the most that a metric,
    by its name without unit, may be. keys: what the campaign varies, and how, in words. random: what else
    differs from flight to flight.
    """

    module: str
    double: bool
    flights: int
    constants: tuple[str, ...]
    varies: tuple[str, ...]
    rows: str
    every: tuple[int, ...]
    results: int
    failure: dict[str, float]
    keys: tuple[str, ...]
    random: tuple[str, ...]


class FlightData(NamedTuple):
    """One flight of the page. cell: in its group's table, if that is one. rate: of flights like it. limits: its own rules."""

    id: str
    name: str
    group: str
    note: str
    claims: tuple[int, ...]
    outcome: dict[str, object]
    facts: tuple[tuple[str, str], ...]
    summary: Summary
    whyNot: str  # noqa: N815
    warnings: tuple[str, ...]
    margins: str
    recorded: RecordedData | None
    controllers: tuple[ControllerData, ...]
    controls: tuple[Control, ...]
    ticks: dict[str, object]
    scene: Scene
    panels: tuple[PanelData, ...]
    cell: Cell | None
    rate: Rate | None
    limits: tuple[dict[str, object], ...] = ()


class ClaimView(NamedTuple):
    """A claim of the paper on the page. flights, panels: ids."""

    name: str
    sentence: str
    measured: str
    verdict: str
    flights: tuple[str, ...]
    look: str
    panels: tuple[str, ...]


class GuessView(NamedTuple):
    """A question before a step's flight. answer: the right choice's place, from 0. controller, values: of what it shows."""

    ask: str
    choices: list[str]
    answer: int
    controller: str
    values: dict[str, list[float]]


class StepView(NamedTuple):
    """A step of a walk. values: by the key under which the page keeps settings. move: a control, "controller" or "ghost".

    watch: a panel's id, "net" or "scene". look: at what of it. time: where the cursor starts [s]. window: the stretch of
    time of the plots [s].
    success: within what a completed flight's numbers have to be, by the names of measures [m, rad]. asCommanded: its
    grade, too.
    solution: what reaches it, as values.
    """

    title: str
    text: tuple[str, ...]
    flight: str
    controller: str
    ghost: str
    values: dict[str, list[float]]
    move: str
    watch: str
    look: str
    time: float | None
    window: list[float] | None
    camera: str
    guess: GuessView | None
    success: dict[str, list[float]]
    asCommanded: bool  # noqa: N815
    solution: dict[str, list[float]]


class StoryView(NamedTuple):
    """A guided walk over a page's flights."""

    title: str
    steps: tuple[StepView, ...]


class Link(NamedTuple):
    """A link to something beside the page."""

    label: str
    href: str


def numbers_text(values: Iterable[float] | NDArray[np.float64]) -> str:
    """Numbers as little-endian doubles in base64."""
    return base64.b64encode(np.asarray(values, dtype="<f8").tobytes()).decode("ascii")


SHARED = (Control, PanelData, Scene, ConditionData)
"""Records that are often the same from flight to flight, and are written once."""


class Sharing:
    """Turns records into JSON values; equal ones are kept once and referred to by their place."""

    def __init__(self) -> None:
        self.values: list[object] = []
        self.places: dict[object, int] = {}

    def value(self, thing: object, inside: bool = False) -> object:
        """The JSON value of a record. inside: within a shared one, where nothing is shared again."""
        if isinstance(thing, SHARED) and not inside:
            key = repr(thing)
            if key not in self.places:
                self.places[key] = len(self.values)
                self.values.append(self.value(thing, inside=True))
            return {"$": self.places[key]}
        if isinstance(thing, tuple) and hasattr(thing, "_fields"):
            return {name: self.value(part, inside) for name, part in zip(thing._fields, thing, strict=True)}
        if isinstance(thing, dict):
            return {name: self.value(part, inside) for name, part in thing.items()}
        if isinstance(thing, list | tuple):
            return [self.value(part, inside) for part in thing]
        return json_number(thing) if isinstance(thing, float) else thing


def json_number(value: float) -> float | int | str:
    """A number as JSON can hold it: infinite ones as text, whole ones short."""
    if not math.isfinite(value):
        return "NaN" if math.isnan(value) else "Infinity" if value > 0.0 else "-Infinity"
    negative_zero = value == 0.0 and math.copysign(1.0, value) < 0.0
    return int(value) if value == int(value) and abs(value) < 2**53 and not negative_zero else value


def identity(name: str, names: Sequence[str]) -> str:
    """An id of letters, digits and hyphens that is not taken."""
    base = re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-")[:40].strip("-") or "flight"
    candidates = [base, *(f"{base}-{number}" for number in range(2, len(names) + 3))]
    return next(candidate for candidate in candidates if candidate not in names)
