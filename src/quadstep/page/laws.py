"""The laws of a page: each structure of a closed loop is compiled once, whatever its numbers."""

from collections.abc import Sequence
from typing import Any, NamedTuple

from quadstep.engines.fly import FlightPlan
from quadstep.interfaces.closed_loop import ClosedLoop
from quadstep.interfaces.learning import DeclaredNet, StartWeights, random_input_weights
from quadstep.io.errors import UserError
from quadstep.numbers import Matrix, Table, Vector, flatten, leaf_names
from quadstep.page.emit import Law, emit
from quadstep.page.model import numbers_text

NEURONS = 16
"""Neurons of each net that a law is compiled for; a flight with more gets its own law."""

OFF_BIAS = -1e4
"""A neuron with this bias and no input weights puts out exactly zero."""

ROOM, ROOM_FOR_GHOSTS = 1_200_000, 800_000
"""Characters of laws that a page may hold, and those up to which controllers are added beside the missions' own."""


class PageNumbers(NamedTuple):
    """A plan's numbers in the page's form. preset, tables: keys."""

    law: str
    preset: str
    overrides: tuple[tuple[int, float], ...]
    tables: tuple[str, ...]
    start: tuple[float, ...]


class Laws:
    """The compiled loops, presets and tables of one page."""

    def __init__(self) -> None:
        self.laws: dict[str, Law] = {}
        self.presets: dict[str, tuple[float, ...]] = {}
        self.tables: dict[str, str] = {}
        self._ids: dict[tuple[ClosedLoop, tuple[str, ...]], str] = {}

    @property
    def size(self) -> int:
        return sum(len(law.text) for law in self.laws.values())

    @property
    def room_for_ghosts(self) -> bool:
        """Whether there is room for controllers beside the missions' own."""
        return self.size < ROOM_FOR_GHOSTS

    def add(self, plan: FlightPlan) -> PageNumbers:
        """The plan's numbers, its loop compiled if that is new. Raises UserError for a loop that the page cannot hold."""
        named = list(zip(leaf_names(plan.parameters), flatten(plan.parameters), strict=True))
        key = (plan.loop, tuple(f"{name}:{leaf.size}" if isinstance(leaf, Table) else name for name, leaf in named))
        if key not in self._ids:
            law = compiled(plan)
            if self.size + len(law.text) > ROOM:
                raise UserError(f"its laws are {len(law.text)} characters of JavaScript; the page has {ROOM - self.size} left")
            self._ids[key] = f"law{len(self._ids)}"
            self.laws[self._ids[key]] = law
        name = self._ids[key]
        values = tuple(float(leaf) for _, leaf in named if not isinstance(leaf, Table))
        base = self.presets.setdefault(name, values)
        overrides = tuple((i, new) for i, (new, old) in enumerate(zip(values, base, strict=True)) if repr(new) != repr(old))
        tables = tuple(self._table(leaf) for _, leaf in named if isinstance(leaf, Table))
        return PageNumbers(name, name, overrides, tables, tuple(float(leaf) for leaf in flatten(plan.start)))

    def _table(self, table: Table) -> str:
        text = numbers_text(table.array)
        for name, known in self.tables.items():
            if known == text:
                return name
        name = f"table{len(self.tables)}"
        self.tables[name] = text
        return name

    def facts(self) -> dict[str, dict[str, object]]:
        """What the page must know of each law."""
        return {
            name: {
                "names": law.names,
                "starts": law.starts,
                "tables": law.tables,
                "columns": law.columns,
                "tasks": law.tasks,
                "neurons": neurons(law.names),
                "net": law.net,
            }
            for name, law in self.laws.items()
        }

    def encoded_presets(self) -> dict[str, str]:
        """The presets as the page reads them."""
        return {name: numbers_text(values) for name, values in self.presets.items()}

    def script(self) -> str:
        entries = ",\n".join(f"{name}:{law.text}" for name, law in self.laws.items())
        return f"globalThis.quadstepLaws={{{entries}}};"


def compiled(plan: FlightPlan) -> Law:
    """The law of a plan. Raises UserError for a law that cannot be written as JavaScript."""
    try:
        return emit(plan.loop, plan.parameters, plan.start)
    except Exception as error:
        raise UserError(f"its laws cannot be written as JavaScript ({type(error).__name__}: {error})") from error


def neurons(names: Sequence[str]) -> list[dict[str, list[float]]]:
    """For each neuron of both nets, the parameters that switch it off, and the values that do: no inputs, a bias of -10^4."""
    result: list[dict[str, list[float]]] = []
    for place, name in enumerate(names):
        parts = name.split(".")
        of_input, of_output = "input_weights" in parts, bool({"weights_1", "weights_2"} & set(parts))
        if not (of_input or of_output):
            continue
        row, column = int(parts[-2]), int(parts[-1])
        beyond = ".".join([*parts[:-1], str(column + 1)])
        is_bias = of_input and not (place + 1 < len(names) and names[place + 1] == beyond)
        while len(result) <= row:
            result.append({"parameters": [], "off": []})
        result[row]["parameters"].append(place)
        result[row]["off"].append(OFF_BIAS if is_bias else 0.0)
    return result


def widened(gains: Any, seed: int) -> Any:
    """The same gains with nets of at least `NEURONS` neurons, as the seed draws them; the further weights are zero."""
    if not hasattr(gains, "_field_defaults"):
        return gains
    changed: dict[str, object] = {}
    for name, value in zip(gains._fields, gains, strict=True):
        declaration = gains._field_defaults.get(name)
        if isinstance(declaration, DeclaredNet):
            count = max(NEURONS, len(value.input_weights))
            wide = random_input_weights(seed, declaration.number, count, declaration.inputs)
            changed[name] = value._replace(input_weights=wide)
        elif isinstance(declaration, StartWeights):
            changed[name] = Matrix([*value, *[Vector((0.0, 0.0, 0.0))] * (NEURONS - len(value))])
        else:
            changed[name] = widened(value, seed)
    return gains._replace(**changed)
