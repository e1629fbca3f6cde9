"""The targets that are firmware: an adapter of each around the files of `--target c99`."""

import math
import operator
from functools import partial
from operator import attrgetter
from pathlib import Path
from typing import NamedTuple, cast

from quadstep.export.c.header import Exported, loops, title
from quadstep.export.c.structs import as_array, fields_of, filled, literal
from quadstep.interfaces.controller import Measured
from quadstep.interfaces.gain import gains_in
from quadstep.io.errors import UserError
from quadstep.numbers import Structure
from quadstep.vehicle.allocation import mixing
from quadstep.vehicle.multirotor import AirframeParameters, Multirotor
from quadstep.vehicle.rigid_body import Geometry

TEMPLATES = Path(__file__).parent / "templates"

CRAZYFLIE_STEP = 0.001
"""The firmware's stabilizer loop [s]."""

ROOM = 1e-6
"""Relative: sample times are as good as multiples of each other."""


CONTRACTION = """#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC optimize("fp-contract=off") /* for builds that take no flags for one file */
#endif
"""
"""Before a law whose firmware compiles all files with the same flags."""


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
    law = {f"{exported.name}.c": CONTRACTION + files[f"{exported.name}.c"]} if target == "ardupilot" and files else {}
    return {**{name: text for name, text in files.items() if name != "CMakeLists.txt"}, **law, **own}


def geometry_of(exported: Exported) -> Geometry:
    plant = exported.subject.plant
    assert isinstance(plant, Multirotor)
    return plant.geometry


def common(exported: Exported) -> dict[str, str]:
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
        f"        if ((ticks % {ticks[loop]}u) == 0u)\n        {{\n"
        f"            clock.period = {ticks[loop] // ticks['law']}.0f * period;\n"
        f"            outer[{place}] = {exported.name}_{loop}({given});\n"
        "            clock.period = period;\n        }\n"
        for place, loop in enumerate(loops(exported))
    ]
    most = "mission.vehicle.allocation.most"
    _, roll, pitch, yaw = mix_of(exported)
    left, ahead = [[math.copysign(1.0, one) for one in row] for row in (roll, [-one for one in pitch])]
    levers = (
        0.5 * sum(map(operator.mul, roll, left)),
        0.5 * sum(map(operator.mul, pitch, ahead)),
        -sum(map(math.prod, zip(yaw, left, ahead, strict=True))),
    )
    return {
        "LAW_TICKS": str(ticks["law"]),
        "LOOPS\n": "".join(calls),
        "CEILING\n": f"    {most} = fminf({most}, THRUST_MAX);\n" if hasattr(exported.code.vehicle, "allocation") else "",
        "HOVER_THRUST": f"{weight(cast(AirframeParameters, exported.subject.parameters))!r}f",
        "ROTOR_COUNT": str(len(roll)),
        "GAIN_TABLE\n": "".join(
            f"PARAM_ADD(PARAM_FLOAT, {name}, &mission.gains.{one.member})\n" for name, one in parameters_of(exported).items()
        ),
        **{word: f"{lever!r}f" for word, lever in zip(("ROLL_LEVER", "PITCH_LEVER", "YAW_LEVER"), levers, strict=True)},
        **outer(exported, "outer"),
    }


def outer(exported: Exported, array: str) -> dict[str, str]:
    """What the slower loops returned: how many there are, and all of it."""
    count = len(loops(exported))
    return {"OUTER_COUNT": str(max(1, count)), "OUTER_SUM": " | ".join(f"{array}[{i}]" for i in range(max(1, count)))}


def every_so_many(exported: Exported, indent: str, tick: str) -> str:
    """Calls of the slower loops, counted in samples of the law."""
    text = ""
    for place, loop in enumerate(loops(exported)):
        count = max(1, round(exported.clocked.period(loop) / exported.clocked.period("law")))
        call = f"_outer[{place}] = {exported.name}_{loop}(&_params, &_state, &measured, &reference, &slower);"
        name = f"{exported.name}_clock"
        text += (
            f"{indent}if (({tick} % {count}u) == 0u) {{\n{indent}\t{name} slower = clock;\n"
            f"{indent}\tslower.period = {count}.0f * clock.period;\n{indent}\t{call}\n{indent}}}\n"
        )
    return text


def mix_of(exported: Exported) -> list[list[float]]:
    """Thrust [-] and torques about the body's axes [m] of a newton of each rotor, in the mission's order."""
    rotor = cast(AirframeParameters, exported.subject.parameters).airframe.rotor
    return [[float(one) for one in row] for row in mixing(geometry_of(exported), rotor.torque / rotor.thrust)]


def weight(parameters: AirframeParameters) -> float:
    """The thrust of hovering [N]."""
    return float(parameters.airframe.mass * parameters.airframe.gravity)


AXES = "XYZ"
LONGEST_NAME, MOST_GAINS = 12, 60
"""Of parameters: letters after `CC3_` or `QS_`, where 16 are allowed; entries of one of ArduPilot's groups."""


LEAST = 1e-6
"""Of a gain that must be above 0."""


class Parameter(NamedTuple):
    """A gain that is changed in flight. member: of `gains` in C. least, most: as declared; infinite where it is not."""

    member: str
    value: float
    least: float
    most: float


def parameters_of(exported: Exported) -> dict[str, Parameter]:
    """The declared gains that become the autopilot's parameters, by name.

    Vectors get a letter for each axis; nets and matrices, and what does not fit a group, stay constants.
    """
    found: dict[str, Parameter] = {}
    for path, one in gains_in(type(exported.subject.gains)).items():
        value = cast(Structure, attrgetter(path)(exported.subject.gains))
        array = as_array(value)
        if (array is not None and (len(array.sizes) != 1 or array.sizes[0] > len(AXES))) or fields_of(value):
            continue
        declared = -math.inf if one.signed else 0.0 if one.zero else LEAST
        least = one.low if one.only and one.low is not None else declared
        most = one.high if one.only and one.high is not None else math.inf
        for place, entry in enumerate(array.entries if array else (value,)):
            words = "_".join(word[:3] for word in path.rpartition(".")[2].split("_")).upper()
            name = f"{words[: LONGEST_NAME - 2]}_{AXES[place]}" if array else words[:LONGEST_NAME]
            while name in found:
                name = f"{name[: LONGEST_NAME - 2]}{len(found):02d}"
            if len(found) < MOST_GAINS:
                member = f"{path}[{place}]" if array else path
                found[name] = Parameter(member, float(cast(float, entry)), least, most)
    return found


def bounds(one: Parameter) -> str:
    """Those of a parameter in PX4's list of them."""
    words = zip(("min", "max"), (one.least, one.most), strict=True)
    return "".join(f"      {word}: {as_yaml(bound)}\n" for word, bound in words if math.isfinite(bound))


def as_yaml(value: float) -> str:
    """A number with a point, without which YAML reads 1e-06 as text."""
    text = repr(value)
    return text if "." in text else text.replace("e", ".0e")


def c_bound(bound: float) -> str:
    return literal(bound, False) if math.isfinite(bound) else "-INFINITY" if bound < 0.0 else "INFINITY"


def px4(exported: Exported) -> dict[str, str]:
    """Its motors, and the law at each sample of the gyro."""
    parameters = cast(AirframeParameters, exported.subject.parameters)
    count, gains = len(geometry_of(exported).mounts), parameters_of(exported)
    return {
        "ROTOR_COUNT": str(count),
        "PARAMETERS\n": "".join(
            f"    QS_{name}:\n      description: {{short: 'gains.{one.member}'}}\n      type: float\n      decimal: 6\n"
            f"      default: {as_yaml(one.value)}\n{bounds(one)}"
            for name, one in gains.items()
        ),
        "GAIN_COUNT": str(len(gains)),
        "GAIN_TABLE\n": "".join(
            f'\t{{"QS_{name}", {c_bound(one.least)}, {c_bound(one.most)}}},\n' for name, one in gains.items()
        ),
        "GAIN_PLACES\n": "".join(f"\t\t&_params.gains.{one.member},\n" for one in gains.values()),
        "MOTOR_ORDER": ", ".join(map(str, range(count))),
        "FASTEST_SPEED": f"{float(parameters.airframe.rotor.fastest)!r}f",
        "STEP_SECONDS": f"{exported.clocked.period('law')!r}f",
        "FULL_THRUST": f"{float(parameters.airframe.rotor.thrust * parameters.airframe.rotor.fastest**2)!r}f",
        "MIX_ROWS": ", ".join("{" + ", ".join(f"{one!r}f" for one in row) + "}" for row in mix_of(exported)),
        "HOVER_THRUST": f"{weight(parameters)!r}f",
        "LOOPS\n": every_so_many(exported, "\t", "(clock.tick - 1u)"),
        **outer(exported, "_outer"),
    }


def mixer_torque(exported: Exported) -> list[float]:
    """The torque about roll, pitch and yaw [N m] of ArduPilot's mixer at an input of 1.

    Each rotor then makes up to half of its largest thrust more or less, in proportion to its part in the axis
    (`AP_MotorsMatrix`, whose factors are normalised to 0.5).
    """
    half = 0.5 * float(cast(AirframeParameters, exported.subject.parameters).allocation.most)
    return [half * math.fsum(one * one for one in row) / max(map(abs, row)) for row in mix_of(exported)[1:]]


def ardupilot(exported: Exported) -> dict[str, str]:
    """The torque of a full mixer input, and the gains as parameters."""
    parameters = cast(AirframeParameters, exported.subject.parameters)
    gains = parameters_of(exported)
    owner = "AC_CustomControl_Quadstep"
    return {
        "FULL_TORQUE": ", ".join(f"{one!r}f" for one in mixer_torque(exported)),
        "HOVER_THRUST": f"{weight(parameters)!r}f",
        "LOOPS\n": every_so_many(exported, "    ", "clock.tick"),
        "GAIN_COUNT": str(max(1, len(gains))),
        "GAIN_TABLE\n": "".join(
            f'    AP_GROUPINFO("{name}", {place + 1}, {owner}, _gain[{place}], {literal(value, False)}),\n'
            for place, (name, (_, value, _, _)) in enumerate(gains.items())
        ),
        "GAIN_COPIES\n": "".join(
            f"    _params.gains.{one.member} = _gain[{place}].get();\n" for place, one in enumerate(gains.values())
        ),
        **outer(exported, "_outer"),
    }


OWN = {"crazyflie": crazyflie, "px4": px4, "ardupilot": ardupilot}
for_crazyflie, for_px4, for_ardupilot = (partial(firmware_files, target) for target in OWN)
