"""What is measured of an exported law, as far as the tools for it are here."""

import tempfile
from collections.abc import Callable
from pathlib import Path

from quadstep.c99.source import Exported
from quadstep.errors import UserError
from quadstep.export import arm, misra
from quadstep.export.datasheet import Measured
from quadstep.flight.engines import FlightPlan


def measurements(exported: Exported, plan: FlightPlan, folder: Path, told: Callable[[str], None]) -> Measured:
    """The measurements of the law in a folder."""
    absent: list[str] = []
    on_arm: dict[str, arm.OnArm] = {}
    lacking = arm.missing()
    if arm.COMPILER in lacking:
        absent.append(f"code, stack and instructions: {arm.COMPILER} is not here (Debian: gcc-arm-none-eabi libnewlib-arm-none-eabi)")
    elif exported.precise:
        absent.append("code, stack and instructions: Cortex-M4F computes in f32")
    else:
        told("measuring on Cortex-M")
        if lacking:
            absent.append(f"instructions: {arm.MACHINE} is not here (Debian: qemu-system-arm)")
        with tempfile.TemporaryDirectory() as work:
            try:
                on_arm = arm.measured(exported, folder, Path(work))
            except UserError as error:
                absent.append(f"code, stack and instructions: {error}")
    found = None
    if misra.missing():
        absent.append("MISRA: cppcheck is not here (Debian: cppcheck)")
    else:
        told("checking MISRA rules")
        found = misra.deviations(folder, [f"{exported.name}.c", f"{exported.name}_params.c"])
    return Measured(on_arm, found, None, tuple(absent))
