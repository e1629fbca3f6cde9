"""The targets that are firmware: an adapter of each around the files of `--target c99`."""

from pathlib import Path
from typing import cast

from quadstep.airframe.allocation import allocate
from quadstep.airframe.geometry import Geometry
from quadstep.c99.interface import Exported, loops, title
from quadstep.c99.templates import filled
from quadstep.control.controller import Measured
from quadstep.errors import UserError
from quadstep.numbers import Vector
from quadstep.plants.multirotor import AirframeParameters, Multirotor

TEMPLATES = Path(__file__).parent / "templates"

CRAZYFLIE_STEP = 0.001
"""The firmware's stabilizer loop [s]."""

ROOM = 1e-6
"""Relative: sample times are as good as multiples of each other."""


def check_firmware(target: str, exported: Exported) -> None:
    """Refuses what the firmware cannot give. Raises UserError."""
    law = exported.subject.controller
    if not isinstance(exported.subject.plant, Multirotor) or not isinstance(exported.subject.measured, Measured):
        raise UserError(f"--target {target}: needs a mission for a real vehicle (docs/vehicles.md); c99 accepts any")
    if exported.precise:
        raise UserError(f"--target {target}: uses f32; --precision f64 requires --target c99")
    if law.also_measures:
        raise UserError(
            f"--target {target}: the law measures {', '.join(law.also_measures)}, which the adapter does not provide"
        )
    if law.preview:
        raise UserError(f"--target {target}: the law looks ahead on the path; setpoints describe only the present")


def firmware_files(target: str, exported: Exported, files: dict[str, str]) -> dict[str, str]:
    """The files of a target. files: those of c99. Raises UserError for a law that it cannot fly."""
    check_firmware(target, exported)
    folder = TEMPLATES / target
    words = {**common(exported), **OWN[target](exported)}
    own = {path.name: filled(path, words) for path in sorted(folder.iterdir())}
    return {**{name: text for name, text in files.items() if name != "CMakeLists.txt"}, **own}


def geometry_of(exported: Exported) -> Geometry:
    """Where its rotors are."""
    plant = exported.subject.plant
    assert isinstance(plant, Multirotor)
    return plant.geometry


def common(exported: Exported) -> dict[str, str]:
    """What every adapter says."""
    name = exported.name
    return {"TITLE": title(exported), "NAME": name, "CFLAGS_NAME": f"CFLAGS_{name}", "UPPER": name.upper()}


def multiple(long: float, short: float) -> int:
    """How many times one period fits into another; 0 where it does not."""
    count = round(long / short)
    return count if abs(count * short - long) <= ROOM * long else 0


def crazyflie(exported: Exported) -> dict[str, str]:
    """Its loop runs at 1 kHz; the law and its loops every so many of these."""
    ticks = {name: multiple(exported.clocked.period(name), CRAZYFLIE_STEP) for name in (*loops(exported), "law")}
    for name, count in ticks.items():
        if not count or count % max(ticks["law"], 1):
            said = "1 ms, the firmware's loop" if name == "law" or not count else "the law's own"
            raise UserError(
                f"--target crazyflie: {name} runs every {exported.clocked.period(name):g} s, not a multiple of {said}"
            )
    given = "&mission, &state_of_law, &measured, &reference, &clock"
    calls = [
        f"        if ((ticks % {ticks[loop]}u) == 0u)\n        {{\n            clock.period = STEP * {ticks[loop]}.0f;\n"
        f"            outer[{place}] = {exported.name}_{loop}({given});\n"
        "            clock.period = STEP * (float)LAW_EVERY;\n        }\n"
        for place, loop in enumerate(loops(exported))
    ]
    most = "mission.vehicle.allocation.most"
    return {
        "LAW_TICKS": str(ticks["law"]),
        "LOOPS\n": "".join(calls),
        "CEILING\n": f"    {most} = fminf({most}, THRUST_MAX);\n" if hasattr(exported.code.vehicle, "allocation") else "",
        "HOVER_THRUST": f"{weight(cast(AirframeParameters, exported.subject.parameters))!r}f",
        **outer(exported, "outer"),
    }


def outer(exported: Exported, array: str) -> dict[str, str]:
    """What the slower loops returned: how many there are, and all of it."""
    count = len(loops(exported))
    return {"OUTER_COUNT": str(max(1, count)), "OUTER_SUM": " | ".join(f"{array}[{i}]" for i in range(max(1, count)))}


def every_so_many(exported: Exported, indent: str, state: str, tick: str) -> str:
    """Calls of the slower loops, counted in samples of the law."""
    text = ""
    for place, loop in enumerate(loops(exported)):
        count = max(1, round(exported.clocked.period(loop) / exported.clocked.period("law")))
        call = f"_outer[{place}] = {exported.name}_{loop}(&{exported.name}_mission, &{state}, &measured, &reference, &slower);"
        name = f"{exported.name}_clock"
        text += (
            f"{indent}if (({tick} % {count}u) == 0u) {{\n{indent}\t{name} slower = clock;\n"
            f"{indent}\tslower.period = {count}.0f * clock.period;\n{indent}\t{call}\n{indent}}}\n"
        )
    return text


def weight(parameters: AirframeParameters) -> float:
    """The thrust of hovering [N]."""
    return float(parameters.airframe.mass * parameters.airframe.gravity)


def px4(exported: Exported) -> dict[str, str]:
    """Its motors, and the law at each sample of the gyro."""
    parameters = cast(AirframeParameters, exported.subject.parameters)
    count = len(geometry_of(exported).mounts)
    return {
        "ROTOR_COUNT": str(count),
        "MOTOR_ORDER": ", ".join(map(str, range(count))),
        "FASTEST_SPEED": f"{float(parameters.airframe.rotor.fastest)!r}f",
        "STEP_SECONDS": f"{exported.clocked.period('law')!r}f",
        "HOVER_THRUST": f"{weight(parameters)!r}f",
        "LOOPS\n": every_so_many(exported, "\t", "_state", "(clock.tick - 1u)"),
        **outer(exported, "_outer"),
    }


def ardupilot(exported: Exported) -> dict[str, str]:
    """The torque of a full mixer input at hover."""
    parameters, geometry = cast(AirframeParameters, exported.subject.parameters), geometry_of(exported)
    full = []
    for axis in range(3):
        torque = [0.0, 0.0, 0.0]
        torque[axis] = 1e6
        full.append(float(allocate(geometry, parameters.allocation, weight(parameters), Vector(torque))[2][axis]))
    return {
        "FULL_TORQUE": ", ".join(f"{one!r}f" for one in full),
        "HOVER_THRUST": f"{weight(parameters)!r}f",
        "LOOPS\n": every_so_many(exported, "    ", "_state", "clock.tick"),
        **outer(exported, "_outer"),
    }


OWN = {"crazyflie": crazyflie, "px4": px4, "ardupilot": ardupilot}
