"""A closed loop as JavaScript: the laws are called once with recorded numbers, the loop around them is written here.

The laws of a page: each structure of a closed loop is compiled once, whatever its numbers.
"""

import base64
import json
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any, NamedTuple, cast

from quadstep.control.backstepping import Backstepping, BacksteppingGains, BacksteppingMemory, position_loop
from quadstep.control.completed_backstepping import CompletedBackstepping
from quadstep.engines.fly import FlightPlan
from quadstep.engines.loop import Cycle, Loop, Numbers
from quadstep.interfaces.closed_loop import Clock, ClosedLoop
from quadstep.interfaces.learning import DeclaredNet, StartWeights, output, random_input_weights
from quadstep.interfaces.log import SAID
from quadstep.io.errors import UserError
from quadstep.numbers import Matrix, Number, Table, Vector, flatten, leaf_names, rebuild, where
from quadstep.numbers.operation import OPERATIONS, Operation
from quadstep.page.model import numbers_text
from quadstep.page.writing import Output, Writer
from quadstep.program.assignments import Record, ScriptRecord
from quadstep.program.recorded import RECORDED
from quadstep.vehicle.lagrange import Lagrange, Parameters
from quadstep.vehicle.paper import State


def library() -> str:
    """These functions in JavaScript; D and W: the bits of one number, as a double and as two words."""
    return "\n".join(
        ["const D=new Float64Array(1),W=new Int32Array(D.buffer);", *(function(one) for one in OPERATIONS.values())]
    )


@cache
def function(operation: Operation) -> str:
    record = Record(inline=True)
    result = operation.steps(RECORDED, *map(record.input, operation.arguments))
    (text,) = Writer(record, ()).functions([Output("const result", record.at(result))])
    return f"function {operation.name}({','.join(operation.arguments)}){{{text}return result}}"


def net_row(loop: ClosedLoop, cycle: object, p: object, time: Number) -> list[Number]:
    """Of a flight at time t [s], for the N neurons of the net: mu_1 (N), W_1 (N rows of 3), W_1^T mu_1 [N], -A_xyz [N].

    Empty where the loop has no such net, or its plant no such disturbance.
    """
    if not isinstance(loop, Loop) or not isinstance(loop.plant, Lagrange):
        return []
    flown, numbers = cast(Cycle, cycle), cast(Numbers, p)
    state, parameters = cast(State, flown.state), cast(Parameters, p)
    if not isinstance(loop.controller, Backstepping | CompletedBackstepping):
        return []
    gains = cast(BacksteppingGains, getattr(numbers.gains, "paper", numbers.gains))
    memory = cast(BacksteppingMemory, getattr(flown.memory, "paper", flown.memory))
    on = where(time >= gains.learning_start, 1.0, 0.0)
    outer = position_loop(gains, memory, cast(State, loop.measurement(flown, numbers)), loop.reference(time, numbers), on)
    force, _ = loop.plant.disturbed(parameters, state, time)
    weights = [entry for row in memory.weights_1 for entry in row]
    return [*outer.mu_1, *weights, *(on * output(memory.weights_1, outer.mu_1)), *(-force)]


class Law(NamedTuple):
    """A compiled loop.

    text: a JavaScript expression, an object with `fly`, and with the cosine and arc tangent of every engine; its `run`, if a
    page sets it, flies in place of the loop in JavaScript. names, starts,
    tables: of its numeric parameters, its start and its tables, in the order in which `fly` takes them. columns: name and
    unit. tasks: names of the sampled laws. net: neurons of the net that `fly` shows in its last argument, as `net_row` orders
    it, 0 for none or where something else is shown.
    """

    text: str
    names: list[str]
    starts: list[str]
    tables: list[str]
    columns: list[tuple[str, str]]
    tasks: list[str]
    net: int = 0


class TickSection(NamedTuple):
    """A part of a tick, or what comes before the first. outputs: where its results go. extra: arguments only it takes."""

    name: str
    outputs: list[Output]
    extra: tuple[str, ...] = ()


Showing = Callable[[ClosedLoop, object, object, Number], list[Number]]
"""What a law shows beside its log, of a loop, its cycle, its parameters and the time [s]."""


def emit(loop: ClosedLoop, parameters: object, start: tuple[object, ...], showing: Showing = net_row) -> Law:
    """The loop as a law of the page. parameters, start: any of the right structure; their values do not matter."""
    record = ScriptRecord()
    leaves = dict(zip(leaf_names(parameters), flatten(parameters), strict=True))
    names = [name for name, leaf in leaves.items() if not isinstance(leaf, Table)]
    tables = [name for name, leaf in leaves.items() if isinstance(leaf, Table)]
    inputs: dict[str, object] = {name: record.input(f"P[{place}]") for place, name in enumerate(names)}
    inputs |= {name: record.table(f"T{place}", leaves[name].size) for place, name in enumerate(tables)}
    numbers = rebuild(parameters, iter([inputs[name] for name in leaves]))
    begin = rebuild(start, iter([record.input(f"S[{place}]") for place in range(len(flatten(start)))]))
    shape = loop.start(begin, numbers)
    size = len(flatten(shape))
    cycle = rebuild(shape, iter([record.input(f"C[{place}]") for place in range(size)]))

    def clock(period: str) -> Clock:
        return Clock(*(cast(Number, record.input(name)) for name in ("t", "n", period)))

    def stored(structure: object) -> list[Output]:
        pairs = ((f"C[{place}]", record.at(leaf)) for place, leaf in enumerate(flatten(structure)))
        return [Output(target, place) for target, place in pairs if record.nodes[place].text != target]

    sections = [TickSection("start", stored(shape), ("S",))]
    for number, task in enumerate(loop.tasks):
        after, code = task.run(cycle, numbers, clock(f"h{number}"))
        sections.append(TickSection(f"task{number}", [*stored(after), Output("code", record.at(code))]))
    row = loop.row(cycle, numbers, clock("h").time)
    sections.append(TickSection("row", [Output(f"R[r+{place}]", record.at(one)) for place, one in enumerate(row)], ("R", "r")))
    net = showing(loop, cycle, numbers, clock("h").time)
    if net:
        sections.append(
            TickSection("net", [Output(f"Q[q+{place}]", record.at(one)) for place, one in enumerate(net)], ("Q", "q"))
        )
    sections.append(TickSection("move", stored(loop.advance(cycle, numbers, clock("h")))))

    fixed = [*(f"P[{place}]" for place in range(len(names))), "h", *(f"h{number}" for number in range(len(loop.tasks)))]
    text = script(Writer(record, fixed), sections, size, list(loop.columns), len(tables), len(loop.tasks), len(net))
    tasks = [task.name for task in loop.tasks]
    neurons = max(0, (len(net) - 6) // 4) if showing is net_row else 0
    return Law(text, names, leaf_names(start), tables, list(loop.columns.items()), tasks, neurons)


def script(
    writer: Writer, sections: list[TickSection], size: int, columns: list[str], tables: int, tasks: int, net: int
) -> str:
    """The JavaScript expression of a law.

    P: parameters. T: tables. S: start. C: the cycle. K: what is computed once a flight. X: numbers between functions. R: rows.
    Q: what is shown of a net at each row, if the page asks.
    t, n: time and tick. h, h0, ...: step and the tasks' periods.
    """
    width, unsaid = len(columns), [place for place, name in enumerate(columns) if name in SAID]
    for section in sections:
        writer.keep_steady(section.outputs)
    common = ("P", *(f"T{number}" for number in range(tables)), "h", *(f"h{number}" for number in range(tasks)), "t", "n")
    functions: list[str] = []
    calls: dict[str, str] = {}

    def add(name: str, texts: list[str], extra: tuple[str, ...] = ()) -> None:
        arguments = ",".join((*common, *extra))
        for number, text in enumerate(texts):
            judges = name.startswith("task") and number == len(texts) - 1
            body = f"let code=0;{text}return code" if judges else text
            functions.append(f"function {name}_{number}({arguments}){{{body}}}")
        *first, final = (f"{name}_{number}({arguments});" for number in range(len(texts)))
        calls[name] = "".join([*first, f"code={final}" if name.startswith("task") else final])

    add("prepare", writer.preparation())
    for section in sections:
        add(section.name, writer.functions(section.outputs), section.extra)
    shown = f"if(Q){{{calls['net']}q+={net}}}" if net else ""
    due = "".join(f"if(n%e{i}===0){{{calls[f'task{i}']}if(code!==0)break}}" for i in range(tasks))
    return "\n".join(
        [
            "(()=>{'use strict';",
            library(),
            f"const C=new Float64Array({size}),K=new Float64Array({len(writer.kept)}),X=new Float64Array({writer.carried});",
            writer.declarations(),
            *functions,
            "function fly(P,T,S,ticks,R,Q){",
            "const h=ticks.step,log=ticks.log,last=ticks.last;",
            *(f"const T{i}=T[{i}];" for i in range(tables)),
            *(f"const e{i}=ticks.every[{i}],h{i}=h*e{i};" for i in range(tasks)),
            "let code=0,n=0,t=0,r=0,q=0;",
            "if(law.run&&!Q)[code,n]=law.run(P,T,S,ticks,R);else{",
            f"{calls['prepare']}{calls['start']}",
            f"for(;n<=last;n++){{t=n*h;{due}if(n%log===0){{{calls['row']}r+={width};{shown}}}if(n<last){{{calls['move']}}}}}",
            "if(n>last)n=last}",
            "let rows=code!==0?Math.ceil(n/log):Math.floor(last/log)+1;",
            f"const unsaid={unsaid};",
            f"let i=0;while(i<rows*{width}&&(Number.isFinite(R[i])||unsaid.includes(i%{width})))i++;",
            f"if(i<rows*{width}){{if(code===0)code=1;rows=Math.floor(i/{width})}}",
            "return{code,tick:n,rows}}",
            "const law={fly,cos,atan2};return law})()",
        ]
    )


NEURONS = 16
"""Neurons of each net that a law is compiled for; a flight with more gets its own law."""

OFF_BIAS = -1e4
"""A neuron with this bias and no input weights puts out exactly zero."""

ROOM = 1_200_000
"""Characters of laws that a page may hold."""


class PageNumbers(NamedTuple):
    """A plan's numbers in the page's form. preset, tables: keys."""

    law: str
    preset: str
    overrides: tuple[tuple[int, float], ...]
    tables: tuple[str, ...]
    start: tuple[float, ...]


class Laws:
    """The compiled loops, presets and tables of one page. modules: what flies a law in its stead, WebAssembly in base64."""

    def __init__(self) -> None:
        self.laws: dict[str, Law] = {}
        self.modules: dict[str, str] = {}
        self.presets: dict[str, tuple[float, ...]] = {}
        self.tables: dict[str, str] = {}
        self._ids: dict[tuple[ClosedLoop, tuple[str, ...]], str] = {}

    @property
    def size(self) -> int:
        return sum(len(law.text) for law in self.laws.values())

    def add(self, plan: FlightPlan, quick: bool = False) -> PageNumbers:
        """The plan's numbers, its loop compiled if that is new. quick: as WebAssembly too, if the page has room for it.

        Raises UserError for a loop that the page cannot hold.
        """
        named = list(zip(leaf_names(plan.parameters), flatten(plan.parameters), strict=True))
        key = (plan.loop, tuple(f"{name}:{leaf.size}" if isinstance(leaf, Table) else name for name, leaf in named))
        if key not in self._ids:
            law = compiled(plan)
            if self.size + len(law.text) > ROOM:
                raise UserError(f"its laws are {len(law.text)} characters of JavaScript; the page has {ROOM - self.size} left")
            self._ids[key] = f"law{len(self._ids)}"
            self.laws[self._ids[key]] = law
        name = self._ids[key]
        if quick and name not in self.modules:
            self.modules[name] = module(plan)
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
        known = {name: law._asdict() | {"neurons": neurons(law.names)} for name, law in self.laws.items()}
        return {name: {key: value for key, value in law.items() if key != "text"} for name, law in known.items()}

    def script(self) -> str:
        texts, modules, room = {name: law.text for name, law in self.laws.items()}, {}, ROOM - self.size
        for name, text in self.modules.items():
            if len(text) <= room:
                modules[name], room = text, room - len(text)
        return f"globalThis.quadstepLaws={json.dumps(texts)};globalThis.quadstepModules={json.dumps(modules)};"


def compiled(plan: FlightPlan) -> Law:
    """The law of a plan. Raises UserError for a law that cannot be written as JavaScript."""
    try:
        return emit(plan.loop, plan.parameters, plan.start)
    except Exception as error:
        raise UserError(f"its laws cannot be written as JavaScript ({type(error).__name__}: {error})") from error


def module(plan: FlightPlan) -> str:
    """The law of a plan as WebAssembly, in base64; "" where there is none: the page flies it all the same, slower."""
    try:
        from quadstep.engines.wasm import flight_module  # noqa: PLC0415 (the compiler, which notebooks in a browser lack)

        return base64.b64encode(flight_module(plan.loop, plan.start, plan.parameters)).decode("ascii")
    except (UserError, ImportError):
        return ""


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
