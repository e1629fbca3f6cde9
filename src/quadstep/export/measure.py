"""What is measured of an exported law, as far as the tools for it are here."""

import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from quadstep.engines.fly import FlightPlan, fly
from quadstep.export import arm, misra
from quadstep.export.c.flown import fly_c
from quadstep.export.c.interface import Exported
from quadstep.export.datasheet import Measurements
from quadstep.interfaces.closed_loop import Outcome
from quadstep.io.errors import UserError

LONGEST = 8.0
"""Seconds of the flight in f32."""


def measurements(exported: Exported, plan: FlightPlan, folder: Path, told: Callable[[str], None]) -> Measurements:
    """The measurements of the law in a folder."""
    absent: list[str] = []
    on_arm: dict[str, arm.OnArm] = {}
    lacking = arm.missing()
    if tools := [tool for tool in (arm.COMPILER, arm.SIZE) if tool in lacking]:
        packages = "gcc-arm-none-eabi libnewlib-arm-none-eabi"  # they bring both
        absent.append(f"code, stack and instructions: {' and '.join(tools)} not found (Debian: {packages})")
    elif exported.precise:
        absent.append("code, stack and instructions: Cortex-M4F computes in f32")
    else:
        told("measuring on Cortex-M")
        if lacking:
            absent.append(f"instructions: {arm.MACHINE} not found (Debian: qemu-system-arm)")
        with tempfile.TemporaryDirectory() as work:
            try:
                on_arm = arm.measured(exported, folder, Path(work))
            except UserError as error:
                absent.append(f"code, stack and instructions: {error}")
    found = None
    if misra.missing():
        absent.append("MISRA: cppcheck not found (Debian: cppcheck)")
    else:
        told("checking MISRA rules")
        try:
            found = misra.deviations(folder, [f"{exported.name}.c", f"{exported.name}_params.c"])
        except UserError as error:
            absent.append(f"MISRA: {error}")
    return Measurements(on_arm, found, None if exported.precise else in_f32(plan, absent, told), tuple(absent))


def in_f32(plan: FlightPlan, absent: list[str], told: Callable[[str], None]) -> tuple[float, float] | None:
    """How far the flight with the controller in f32 is from that in f64, at most [m], and how long it is [s]."""
    told("flying in f32")
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
