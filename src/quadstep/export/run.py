"""`quadstep export` from mission file to folder, and what is measured of the law as far as the tools for it are here.

The folder of `--target c99`: header, source, parameters, a test with golden vectors, a build file, a data sheet.
"""

import hashlib
import shutil
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import numpy as np

from quadstep.engines.fly import FlightPlan, fingerprint, fly
from quadstep.export import arm
from quadstep.export.arm import BITS, WARNINGS, InstructionCounts, Sizes, instruction_counts, state_size
from quadstep.export.c.compiled import exported, fly_c
from quadstep.export.c.golden import golden, golden_header, test_source
from quadstep.export.c.header import Exported, header, loops, title
from quadstep.export.c.source import parameters, source
from quadstep.export.c.structs import filled
from quadstep.export.law_sheet import NOTHING, Facts, Measurements, datasheet, deviations
from quadstep.interfaces.closed_loop import Outcome
from quadstep.io import __version__
from quadstep.io.doors import Door
from quadstep.io.errors import ToolError, UserError, errors_in
from quadstep.io.files import TOML, read_bytes
from quadstep.mission.read import plan_mission, read_mission
from quadstep.numbers import Table, flatten
from quadstep.report.publish import publishing, write_json

TEMPLATES = Path(__file__).parent / "templates"


def c99_files(exported: Exported, plan: FlightPlan) -> dict[str, str]:
    """Name and text of every file but the data sheet. Raises UserError for a number that does not fit f32."""
    name = exported.name
    vectors = golden(exported, lambda t: plan.loop.reference(t, plan.parameters))
    words = {
        "LABEL": title(exported),
        "LAW": name,
        "test_LAW": f"test_{name}",
        "BITS": " ".join(BITS),
        "WARNINGS": " ".join(WARNINGS),
    }
    return {
        f"{name}.h": header(exported),
        f"{name}.c": source(exported),
        f"{name}_params.c": parameters(exported),
        f"{name}_golden.h": golden_header(exported, vectors),
        f"test_{name}.c": test_source(exported),
        "CMakeLists.txt": filled(TEMPLATES / "CMakeLists.txt", words),
    }


def as_they_are(_: Exported, files: dict[str, str]) -> dict[str, str]:
    return files


class StandaloneLaw(NamedTuple):
    """law: in f32. folder: where it was built, as long as it is there."""

    law: Exported
    sizes: Sizes
    counted: InstructionCounts
    folder: Path

    @property
    def worst(self) -> dict[str, int]:
        """Instructions of each loop at worst."""
        return {name: self.counted.worst[name] for name in ("law", *loops(self.law))}


@contextmanager
def measured_standalone(plan: FlightPlan, processor: str) -> Iterator[StandaloneLaw]:
    """The law of a flight. Raises UserError where it cannot be exported, ToolError where a tool fails or bits differ."""
    law = exported(plan, precise=False)
    with tempfile.TemporaryDirectory() as place:
        folder, work = Path(place) / "c99", Path(place) / "build"
        folder.mkdir()
        work.mkdir()
        for name, text in c99_files(law, plan).items():
            (folder / name).write_text(text, encoding="utf-8")
        found = instruction_counts(law, folder, work, [processor])[processor]
        if not found.counted or not found.counted.same_bits:
            raise ToolError("QEMU did not give the same bits")
        (build,) = work.iterdir()
        yield StandaloneLaw(law, found.sizes, found.counted, build)


LONGEST = 8.0
"""Seconds of the flight in f32."""


def measurements(exported: Exported, plan: FlightPlan, folder: Path, say: Callable[[str], None]) -> Measurements:
    absent: list[str] = []
    on_arm: dict[str, arm.OnArm] = {}
    lacking = arm.missing_programs()
    if tools := [tool for tool in (arm.COMPILER, arm.SIZE) if tool in lacking]:
        packages = "gcc-arm-none-eabi libnewlib-arm-none-eabi"  # they bring both
        absent.append(f"code, stack and instructions: {' and '.join(tools)} not found (Debian: {packages})")
    elif exported.precise:
        absent.append("code, stack and instructions: Cortex-M4F computes in f32")
    else:
        say("measuring on Cortex-M")
        if lacking:
            absent.append(f"instructions: {arm.MACHINE} not found (Debian: qemu-system-arm)")
        with tempfile.TemporaryDirectory() as work:
            try:
                on_arm = arm.instruction_counts(exported, folder, Path(work))
            except UserError as error:
                absent.append(f"code, stack and instructions: {error}")
    found = None
    if shutil.which("cppcheck") is None:
        absent.append("MISRA: cppcheck not found (Debian: cppcheck)")
    else:
        say("checking MISRA rules")
        try:
            found = deviations(folder, [f"{exported.name}.c", f"{exported.name}_params.c"])
        except UserError as error:
            absent.append(f"MISRA: {error}")
    return Measurements(on_arm, found, None if exported.precise else in_f32(plan, absent, say), tuple(absent))


def in_f32(plan: FlightPlan, absent: list[str], say: Callable[[str], None]) -> tuple[float, float] | None:
    """How far the flight with the controller in f32 is from that in f64, at most [m], and how long it is [s]."""
    say("flying in f32")
    whole, ticks = plan.ticks, plan.ticks
    short = plan._replace(ticks=ticks._replace(last=min(whole.last, round(LONGEST / ticks.step))))
    try:
        single = fly_c(short, precise=False)
    except UserError as error:
        absent.append(f"the error of f32: {error}")
        return None
    double = fly(short)
    if single.outcome is not double.outcome or double.outcome is not Outcome.COMPLETED:
        absent.append("the error of f32: the flight does not complete")
        return None
    axes = plan.loop.plant.axes
    apart = single.table(*axes) - double.table(*axes)
    return float(np.sqrt((apart * apart).sum(axis=1)).max()), short.ticks.last * ticks.step


MANIFEST = "export.json"
"""The file that identifies an export."""


C99 = "c99"

TARGETS = Door("quadstep.targets", {
    C99: "quadstep.export.run:as_they_are",
    "crazyflie": "quadstep.export.firmware:for_crazyflie",
    "px4": "quadstep.export.firmware:for_px4",
    "ardupilot": "quadstep.export.firmware:for_ardupilot",
})  # fmt: skip
"""What a law is exported for: each turns an `Exported` and the files of C99, texts by name, into the files of the target."""


class ExportRequest(NamedTuple):
    """How to export. measure: whether to fill the data sheet with measurements."""

    target: str = C99
    precise: bool = False
    measure: bool = False
    overwrite: bool = False


class ExportOutcome(NamedTuple):
    """What was written. lines: about it. warnings: of the mission."""

    files: list[str]
    lines: list[str]
    warnings: tuple[str, ...]


def digest(content: bytes) -> str:
    """The beginning of a SHA-256."""
    return hashlib.sha256(content).hexdigest()[:16]


def facts_of(path: Path, plan: FlightPlan, name: str) -> Facts:
    leaves = flatten(plan.parameters.gains)
    gains = digest(repr([leaf.values if isinstance(leaf, Table) else leaf for leaf in leaves]).encode())
    return Facts(__version__, name, digest(read_bytes(path, TOML)), fingerprint([plan]), gains)


def export_mission(
    path: Path, folder: Path, request: ExportRequest, say: Callable[[str], None] = lambda _: None
) -> ExportOutcome:
    """Write the law of a mission in `path` as C into `folder`. say: of every stage. Raises UserError."""
    mission = read_mission(path)
    plan = plan_mission(mission, path)
    facts = facts_of(path, plan, mission.name)
    say("recording the law")
    with errors_in(path):
        law = exported(plan, request.precise, facts.lines())
        files: dict[str, str] = c99_files(law, plan)
        files = TARGETS.load(request.target)(law, files)
    kind = "f64" if request.precise else "f32"
    identity = digest(f"{facts.flight} {request.target} {kind} {__version__}".encode())
    with publishing(folder, identity, request.overwrite, MANIFEST) as out:
        for name, text in files.items():
            place = out / name
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_text(text, encoding="utf-8")
        found = measurements(law, plan, out, say) if request.measure else NOTHING
        (out / "datasheet.md").write_text(datasheet(law, facts, found), encoding="utf-8")
        write_json(out / MANIFEST, {"name": mission.name, "target": request.target, "precision": kind, **facts._asdict()})
    say("flying the mission")
    short = mission.shortfall(plan)
    warnings = (*plan.warnings, *([f"{short}: the law is exported as it is"] if short else []))
    return ExportOutcome([*files, "datasheet.md", MANIFEST], summary(law, found), warnings)


def summary(law: Exported, measurements: Measurements) -> list[str]:
    kind = "f64" if law.precise else "f32"
    lines = [f"{law.subject.controller.label or law.name} in C99, {kind}: {state_size(law)} bytes of RAM."]
    for processor, one in measurements.arm.items():
        counts = one.counted.worst if one.counted else {}
        due = sum(count for name, count in counts.items() if name != "made")
        said = f"; all loops due at once take at most {due} instructions" if due else ""
        lines.append(f"{processor}: {one.sizes.code} bytes of code, {max(one.sizes.stack.values())} of stack{said}.")
    if measurements.apart:
        lines.append(
            f"f32 deviates from f64 by at most {1e6 * measurements.apart[0]:.3g} micrometres over {measurements.apart[1]:g} s."
        )
    lines += [f"Not measured: {one}." for one in measurements.absent] if measurements.arm or measurements.misra else []
    return lines
