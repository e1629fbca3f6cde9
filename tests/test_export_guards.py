"""Guards of exported laws: defined commands and statuses; each guard that is taken away is seen."""

import subprocess

import pytest

from quadstep.export.arm import BITS
from quadstep.export.c.guards import fields_read
from quadstep.export.c.law import measured_part
from quadstep.export.c.structs import fields_of, filled
from quadstep.numbers import flatten
from tests.adapters import STUBS
from tests.exports import COMPILERS, real_mission, written
from tests.needs import C_COMPILER, needs
from tests.patience import PATIENCE

FEW, MANY = "pid", "rotation-backstepping"
"""A law whose inputs are added where they are asked for, and one with a function for that."""


def guarded(folder, kind):
    """A law, and the program that tries its guards, in a folder."""
    plan = real_mission({"type": kind}).plan()
    law = written(folder, plan, False)
    measured, reference = measured_part(law.subject.measured), law.subject.reference

    def places(functions, pointer, value):
        """Of the numbers that they take."""
        names, found, place = fields_read(law, functions, pointer, value), [], 0
        for name, field in fields_of(value).items():
            size = len(flatten(field))
            found += range(place, place + size) if name in names else []
            place += size
        return ", ".join(map(str, found))

    airframe = plan.parameters.airframe
    words = {
        "NAME": law.name,
        "UPPER": law.name.upper(),
        "START": places(["start"], "measured", measured),
        "GUIDE": places(["guide"], "measured", measured),
        "LAW": places(["law"], "measured", measured),
        "WANTED": places(["guide"], "reference", reference),
        "WEIGHT": f"{float(airframe.mass * airframe.gravity)!r}f",
        "FASTEST": f"{float(airframe.rotor.fastest)!r}f",
    }
    (folder / "guards.c").write_text(filled(STUBS.parent / "guards.c", words), encoding="utf-8")
    return law.name


def tried(folder, name):
    """What the program finds broken."""
    line = [COMPILERS[0], "-std=c99", *BITS, "-O1", "-I.", f"{name}.c", f"{name}_params.c", "guards.c", "-lm", "-o", "guards"]
    subprocess.run(line, cwd=folder, check=True, capture_output=True)
    run = subprocess.run([folder / "guards"], capture_output=True, text=True, check=False, timeout=PATIENCE)
    assert (run.returncode == 0) == (run.stdout == "")
    return run.stdout


BROKEN = {
    "nothing is asked about finite numbers": ("!= 0x7F800000u;", "!= 1u;"),
    "an infinite number passes": ("!= 0x7F800000u;", "!= 0x7FC00000u;"),
    "it runs before start": ("    if (state->ready == 0u)\n", "    if (false)\n"),
    "an age that is NaN passes": ("!(clock->age <= params->most_age)", "clock->age > params->most_age"),
    "nothing is old": ("!(clock->age <= params->most_age)", "false"),
    "what diverged goes on": ("            state->ready = 0u;\n", ""),
    "the last command is not held": ("        *command = state->held;\n", ""),
    "no command is kept": ("        state->held = *command;\n", ""),
    "start is not ready": ("        state->ready = 1u;\n", ""),
    "nothing is saturated": ("_SATURATED :", "_OK :"),
    "NaN may start it": ("    if (qs_", "    if (true || qs_"),
}
"""What a guard may lack, as a change of the C."""

READ = "qs_all_finite(&((const real *)(const void *)"

OWN = {
    FEW: {"a rate is not asked about": (" + measured->rates[2])", ")"),
        "a place of the path is not asked about": ("reference->position[0] + ", ""),
        "the command is not asked about": ("        if (!(qs_finite(", "        if (false && !(qs_finite(")},
    MANY: {"the last number is left out": ("i < count;", "i < (count - 1u);"),
        "the path is not asked about": (f" && {READ}reference)", f" || {READ}reference)"),
        "the command is not asked about": (f"if (!({READ}command)", f"if (false && !({READ}command)")},
}  # fmt: skip


@needs(C_COMPILER)
@pytest.mark.parametrize(
    ("kind", "broken"), [(FEW, BROKEN), (MANY, {}), pytest.param(MANY, BROKEN, marks=pytest.mark.thorough)],
    ids=["all of few", "own of many", "all of many"],
)  # fmt: skip
def test_every_guard_holds_and_its_lack_is_seen(tmp_path, kind, broken):
    name = guarded(tmp_path, kind)
    assert tried(tmp_path, name) == ""
    source = tmp_path / f"{name}.c"
    text = source.read_text(encoding="utf-8")
    for what, (old, new) in (broken | OWN[kind]).items():
        assert old in text, what
        source.write_text(text.replace(old, new), encoding="utf-8")
        assert tried(tmp_path, name) != "", what
