"""A controller that flies as its own export: compiled by this machine's C compiler and called sample by sample; and
the part of a mission that is exported.

Every call takes the whole memory and returns it, so a sample depends on nothing else, like a law over numbers.
"""

import ctypes
import math
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from quadstep.control.opaque import Opaque, OpaqueGains, memoised
from quadstep.engines.fly import FlightPlan, Flown, on_lanes
from quadstep.engines.loop import Loop
from quadstep.export.arm import compile_c
from quadstep.export.c.header import Exported, SampleClock, c_name, header
from quadstep.export.c.law import Subject, measured_part, recorded
from quadstep.export.c.source import parameters, source
from quadstep.export.c.structs import fields_of
from quadstep.interfaces.closed_loop import Advance
from quadstep.interfaces.controller import Controller
from quadstep.interfaces.log import FlightLog
from quadstep.interfaces.plant import Reference
from quadstep.io.errors import UserError
from quadstep.io.user_code import blamed
from quadstep.numbers import Number, flatten, leaf_names, rebuild
from quadstep.numbers.scan import call, raise_pending, register, release


def refuse_opaque(controller: Controller) -> None:
    """Raises UserError for a controller that cannot be written in C, whatever it flies."""
    if isinstance(controller, Opaque):
        raise UserError(
            f"controller: {controller.name or 'a function'} is {controller.nature}, which has no equations to export; "
            "write it as a law (docs/own.md)"
        )


def subject_of(plan: FlightPlan) -> Subject:
    """The law of a flight with its gains, and its vehicle's response to commands. Raises UserError for an opaque law."""
    loop, parameters = plan.loop, plan.parameters
    refuse_opaque(loop.controller)
    measured = loop.measurement(loop.start(plan.start, parameters), parameters)
    return Subject(loop.controller, parameters.gains, loop.plant, parameters, measured, loop.reference(0.0, parameters))


def clock_of(plan: FlightPlan) -> SampleClock:
    every = dict(zip((task.name for task in plan.loop.tasks), plan.ticks.every, strict=True))
    sampled = (*plan.loop.controller.loops(), "law")
    return SampleClock(plan.ticks.step, {name: every[name] for name in sampled}, plan.ticks.last)


def exported(plan: FlightPlan, precise: bool, about: tuple[str, ...] = (), logged: bool = False) -> Exported:
    """The law in C. Raises UserError if it cannot be written in C."""
    subject = subject_of(plan)
    name = c_name(subject.controller.name or type(subject.controller).__name__)
    try:
        code = recorded(subject, precise, logged)
    except (TypeError, AttributeError, ValueError, RecursionError) as error:
        if blamed(error):
            raise
        raise UserError(f"controller: {name} cannot be written in C: {error}") from error
    return Exported(subject, code, name, precise, clock_of(plan), about)


Array: TypeAlias = NDArray[np.float64]


@dataclass(frozen=True)
class CompiledLaw(Controller):
    """The law in C. inner: the law in Python. shape: names of all leaves of memory and command.

    told: fields of a measurement. memory, command: of the right structure.
    """

    inner: Controller
    shape: tuple[str, ...]
    told: tuple[str, ...]
    memory: object = field(compare=False)
    command: object = field(compare=False)

    def loops(self) -> tuple[str, ...]:  # type: ignore[override]
        return self.inner.loops()

    @property
    def also_measures(self) -> tuple[str, ...]:  # type: ignore[override]
        return self.inner.also_measures

    @property
    def preview(self) -> tuple[float, ...]:  # type: ignore[override]
        return self.inner.preview

    def start(self, measured: object, gains: OpaqueGains) -> object:
        return self._call(-1, self.memory, measured, (), gains, 0.0, 0.0)[0]

    def slower(
        self, loop: str, memory: object, measured: object, reference: Reference, gains: OpaqueGains, t: Number,
        period: Number,
    ) -> object:  # fmt: skip
        """One of its loops; does nothing if it has none of this name."""
        if loop not in self.loops():
            return memory
        return self._call(self.loops().index(loop), memory, measured, reference, gains, t, period)[0]

    def law(
        self, memory: object, measured: object, reference: Reference, gains: OpaqueGains, t: Number, period: Number
    ) -> tuple[object, object]:
        memory, command = self._call(len(self.loops()), memory, measured, reference, gains, t, period)
        return command, memory

    def _call(
        self, which: int, memory: object, measured: object, reference: object, gains: OpaqueGains, t: Number,
        period: Number,
    ) -> tuple[object, object]:  # fmt: skip
        """Memory and command after a call. which: -1 start, then the slower loops, then the law."""
        told = tuple(getattr(measured, name) for name in self.told)
        inputs = [float(which), t, period, *flatten((memory, told, reference))]
        count = len(flatten((self.memory, self.command)))
        answer = call(gains.handle, inputs, count)
        return rebuild((self.memory, self.command), iter(answer))


class Library:
    """The compiled code, in a folder of its own."""

    def __init__(self, law: Exported, folder: Path) -> None:
        for end, text in ((".h", header(law)), (".c", source(law)), ("_params.c", parameters(law))):
            (folder / f"{law.name}{end}").write_text(text, encoding="utf-8")
        compile_c(folder, ["-O2", "-fPIC", "-shared", "-o", "law.so", f"{law.name}.c", f"{law.name}_params.c", "-lm"])
        self.law, self.code = law, ctypes.CDLL(str(folder / "law.so"))
        self.real = ctypes.c_double if law.precise else ctypes.c_float
        self.names = (*law.subject.controller.loops(), "law")
        self.memory, self.command = len(flatten(law.code.memory)), len(flatten(law.code.command))
        self.measured = len(flatten(measured_part(law.subject.measured)))
        self.params = ctypes.byref((ctypes.c_char * 1).in_dll(self.code, f"{law.name}_mission"))

        class CState(ctypes.Structure):
            _fields_ = [("memory", self.real * self.memory), ("held", self.real * self.command), ("ready", ctypes.c_uint32)]

        class CClock(ctypes.Structure):
            _fields_ = [("tick", ctypes.c_uint32), ("step", self.real), ("period", self.real), ("age", self.real)]

        self.state, self.clock = CState, CClock

    def answer(self, inputs: Array) -> list[float]:
        """Memory and command after a call; NaN if the code rejects its input."""
        which, t, period = int(inputs[0]), float(inputs[1]), float(inputs[2])
        after = 3 + self.memory
        state = self.state()
        state.ready = 1
        state.memory[:] = inputs[3:after].tolist()
        measured = (self.real * self.measured)(*inputs[after : after + self.measured].tolist())
        name = self.law.name
        if which < 0:
            status = getattr(self.code, f"{name}_start")(self.params, ctypes.byref(state), measured)
            return self.outputs(state, status, [0.0] * self.command)
        wanted = inputs[after + self.measured :].tolist()
        reference = (self.real * len(wanted))(*wanted)
        step = self.law.clocked.step
        clock = self.clock(round(t / step), step, period, 0.0)
        command = (self.real * self.command)()
        function = getattr(self.code, f"{name}_{self.names[which]}")
        given = [self.params, ctypes.byref(state), measured, reference, ctypes.byref(clock)]
        if self.names[which] == "law":
            given.append(command)
        return self.outputs(state, function(*given), list(command))

    def outputs(self, state: ctypes.Structure, status: int, command: list[float]) -> list[float]:
        if status:
            return [math.nan] * (self.memory + self.command)
        return [*state.memory, *command]


@contextmanager
def through_c(plan: FlightPlan, precise: bool) -> Iterator[tuple[CompiledLaw, OpaqueGains]]:
    """A controller and gains that fly the plan's own controller as compiled C while the block runs.

    Raises UserError for a law that cannot be written in C, and if there is no C compiler.
    """
    law = exported(plan, precise, logged=True)
    with tempfile.TemporaryDirectory(prefix="quadstep-c-") as folder:
        library = Library(law, Path(folder))
        handle = register(memoised(library.answer))
        try:
            controller = plan.loop.controller
            memory = controller.start(law.subject.measured, law.subject.gains)
            told = tuple(fields_of(measured_part(law.subject.measured)))
            shape = tuple(leaf_names((memory, law.code.asked)))
            yield CompiledLaw(controller, shape, told, memory, law.code.asked), OpaqueGains(float(handle))
            raise_pending(handle)
        finally:
            release(handle)


def on_c(plans: Sequence[FlightPlan]) -> Flown:
    """What flies these on lanes, each controller as C. Raises UserError for one that cannot be written in C."""
    for plan in plans:
        if isinstance(plan.loop, Loop):
            refuse_opaque(plan.loop.controller)
    return lambda progress: [fly_c(plan, progress) for plan in plans]


def fly_c(plan: FlightPlan, progress: Advance | None = None, precise: bool = True) -> FlightLog:
    """A flight whose controller is compiled from C. precise: in f64; else in f32, the rest of the loop in f64.

    Raises UserError for a controller that cannot be written in C, and if there is no C compiler.
    """
    with through_c(plan, precise) as (law, gains):
        loop, parameters = replace(plan.loop, controller=law), plan.parameters._replace(gains=gains)
        return on_lanes([plan._replace(loop=loop, parameters=parameters)])(progress)[0]
