"""Exported laws in C99: the same bits as in Python, whatever compiles them, and what their guards promise."""

import math
import re
import shutil
import subprocess
from dataclasses import dataclass, fields, replace

import numpy as np
import pytest

from quadstep import fly, read_mission
from quadstep.control.cascaded_pid import CascadedPid
from quadstep.control.registry import names
from quadstep.export.arm import BITS
from quadstep.export.c.compiled import fly_c, subject_of
from quadstep.export.c.law import recorded
from quadstep.export.c.structs import literal
from quadstep.export.run import in_f32
from quadstep.interfaces.closed_loop import Outcome
from quadstep.interfaces.controller import Measured
from quadstep.io.errors import UserError
from quadstep.numbers import Matrix, atan2, cos, exp, log, sigmoid, sin, sqrt, vector, where
from quadstep.numbers.rotations import from_rotation_vector
from tests.commands import quadstep, write
from tests.exports import COMPILERS, example, paper_mission, plane_mission, real_mission, run_compiled, through_c, written
from tests.flights import through_lanes
from tests.needs import ARM_COMPILER, C_COMPILER, CMAKE, CORTEX_M, CPPCHECK, POLICY, QEMU, needs
from tests.patience import PATIENCE
from tests.single import Single

REAL = ["geometric", "pid", "lqr", "rotation-backstepping", "backstepping"]
PAPER = ["backstepping", "completed-backstepping", "nested-saturation"]
PLANE = ["planar-pd", "planar-linearisation"]
LOOPED = ("mpc", "mppi", "raptor")
"""Laws that are mostly loops: iterations, plans that are tried, neurons."""

LEVELS = ("-O0", "-O1", "-O2", "-O3")

SMALLEST = ("real pid", "paper nested-saturation", "plane planar-pd")
"""Compiled at all levels."""

MISSIONS = {
    **{f"real {kind}": (real_mission, kind) for kind in REAL},
    **{f"paper {kind}": (paper_mission, kind) for kind in PAPER},
    **{f"plane {kind}": (plane_mission, kind) for kind in PLANE},
}


def check_bits(folder, plan, precise, samples, levels):
    """What the exported test says, compiled by each compiler at its levels, or at all of them."""
    law = written(folder, plan, precise)
    for compiler in COMPILERS:
        for level in levels.get(compiler, LEVELS):
            assert run_compiled(folder, law.name, compiler, level) == (f"{samples} samples: the same bits\n", 0, ""), level


@needs(C_COMPILER)
@pytest.mark.parametrize(
    ("name", "precise", "every_level"),
    [
        pytest.param(name, precise, every, marks=pytest.mark.thorough if every or precise != place % 2 else ())
        for place, name in enumerate(MISSIONS)
        for precise in (False, True)
        for every in (False, True)
    ],
)
def test_every_law_gives_the_bits_of_python(tmp_path, name, precise, every_level):
    """In one precision, each compiler with one of its levels, the smallest at all; every level is some laws'."""
    mission, kind = MISSIONS[name]
    place = list(MISSIONS).index(name)
    one = {compiler: (LEVELS[(place // 2 + 2 * turn) % 4],) for turn, compiler in enumerate(COMPILERS)}
    levels = {} if every_level or name in SMALLEST else one
    check_bits(tmp_path, mission({"type": kind}).plan(), precise, 80, levels)


OTHERS = [kind for kind in names(Measured) if kind not in (*REAL, *LOOPED)]


@needs(C_COMPILER)
@pytest.mark.parametrize(
    ("kind", "way"),
    [
        pytest.param(kind, way, marks=() if way == place % 4 else pytest.mark.thorough)
        for place, kind in enumerate(OTHERS)
        for way in range(4)
    ],
)
def test_every_other_law_of_real_vehicles_gives_the_bits_of_python(tmp_path, kind, way):
    """With one compiler, and every level in one of the four ways."""
    precise, compiler, level = way % 2 == 1, COMPILERS[-(way in (1, 2))], ("-O2", "-O3", "-O0", "-O1")[way]
    check_bits(tmp_path, real_mission({"type": kind}).plan(), precise, 80, dict.fromkeys(COMPILERS, ()) | {compiler: (level,)})


@needs(C_COMPILER)
@pytest.mark.parametrize(
    ("kind", "precise"),
    [
        pytest.param(kind, precise, marks=[*skip, *([] if precise == usual else [pytest.mark.thorough])])
        for kind, usual, skip in (("mpc", False, []), ("mppi", True, []), ("raptor", False, [needs(POLICY)]))
        for precise in (False, True)
    ],
)
def test_laws_of_many_turns_give_the_bits_of_python(tmp_path, monkeypatch, kind, precise):
    monkeypatch.setattr("quadstep.export.c.golden.MOST_OPERATIONS", 0)  # the fewest samples
    check_bits(tmp_path, real_mission({"type": kind}).plan(), precise, 8, {"gcc": ("-O2",), "clang": ("-O0", "-O3")})


@pytest.mark.parametrize(("kind", "turns"), [("mpc", "ITERATIONS"), ("mppi", "SAMPLES")])
def test_code_does_not_grow_with_turns(monkeypatch, kind, turns):
    sizes = []
    for count in (2, 90):
        monkeypatch.setattr(f"quadstep.control.{kind}.{turns}", count)
        functions = recorded(subject_of(real_mission({"type": kind}).plan()), False).functions
        sizes.append([sum(len(line) for line in lines) for lines in functions.values()])
    assert max(abs(many - few) for few, many in zip(*sizes, strict=True)) <= 2  # the digits of a count


@needs(C_COMPILER)
def test_a_law_of_the_users_own_file_is_exported(tmp_path):
    for file, place in (("super_twisting.toml", "examples"), ("own_airframe_controller.py", "")):
        if place:
            plan = read_mission(example(file)).plan()
        else:
            plan = real_mission({"type": f"{example(file)}:{own_class(example(file))}"}).plan()
        law = written(tmp_path, plan, False)
        assert run_compiled(tmp_path, law.name, COMPILERS[0], "-O2")[1] == 0


def own_class(path):
    return re.search(r"class (\w+)\(Controller\)", path.read_text(encoding="utf-8"))[1]


@needs(C_COMPILER)
def test_the_test_in_c_finds_another_law(tmp_path):
    law = written(tmp_path, real_mission({"type": "pid"}).plan(), False)
    source = tmp_path / f"{law.name}.c"
    text = source.read_text(encoding="utf-8")
    changed = text.replace("(params->gains.rate[0] * rate_error_0)", "(-(params->gains.rate[0] * rate_error_0))")
    assert changed != text
    source.write_text(changed, encoding="utf-8")
    said, code, _ = run_compiled(tmp_path, law.name, COMPILERS[0], "-O1")
    assert code == 1
    assert "command[1]" in said


@needs(C_COMPILER)
def test_contraction_breaks_the_bits_and_is_found(tmp_path):
    law = written(tmp_path, real_mission({"type": "pid"}).plan(), False)
    flags = ("-O2", "-march=haswell", "-ffp-contract=fast")
    if "gcc" not in COMPILERS:
        pytest.skip("clang heeds the pragma")
    assert run_compiled(tmp_path, law.name, "gcc", *flags)[1] != 0


def test_f32_numbers_are_those_of_lanes():
    turns, wide = [0.0, 0.3, -2.0, 100.5, 12000.0, 2e4], [0.0, 1.0, -80.0, 88.0, 90.0, -90.0]
    for function, values in ((sin, turns), (cos, turns), (exp, wide), (sigmoid, wide), (log, [1e-30, 1.0, 7.0, 0.0, -1.0])):
        ours = np.array([float(function(Single(value))) for value in values], dtype=np.float32)
        np.testing.assert_array_equal(ours, through_lanes(function, values, double=False))
    sides = [[1.0, -1.0, 0.0, 3.0], [0.5, -2.0, 0.0, -1e-3]]
    ours = np.array([float(atan2(Single(y), Single(x))) for y, x in zip(*sides, strict=True)], dtype=np.float32)
    np.testing.assert_array_equal(ours, through_lanes(atan2, *sides, double=False))


def test_nets_are_loops_and_code_does_not_grow_with_neurons(tmp_path):
    sizes = []
    for neurons in (8, 32):
        mission = real_mission({"type": "rotation-backstepping", "nets": {"neurons": neurons}})
        functions = recorded(subject_of(mission.plan()), False).functions
        sizes.append(sum(len(line) for line in functions["law"]))
    assert sizes[1] - sizes[0] < 20  # the digits of a count


def test_code_reads_like_its_law(tmp_path):
    functions = recorded(subject_of(real_mission({"type": "rotation-backstepping"}).plan()), False).functions
    text = "\n".join(line for lines in functions.values() for line in lines)
    assert "e2 = rotation_vector(between) # Eq. 27" in text
    for name in ("airspeed_0", "r1_2", "wanted_rates_1", "e2_0"):
        assert re.search(rf"const real \w*{name}\b", text), name


def test_the_f32_build_has_no_double(tmp_path):
    law = written(tmp_path, real_mission({"type": "rotation-backstepping"}).plan(), False)
    for file in (f"{law.name}.c", f"{law.name}.h", f"{law.name}_params.c"):
        text = re.sub(r"/\*.*?\*/", "", (tmp_path / file).read_text(encoding="utf-8"), flags=re.S)
        assert "double" not in text
        assert not re.search(r"(?<![\w.])\d+\.\d+(e[+-]?\d+)?(?![\w.f])", text)
        assert not re.search(r"\b(malloc|printf|goto)\b|\bstatic real \w+\s*[;=[]", text)  # functions may be static


def test_literals_are_the_numbers_they_stand_for():
    assert literal(0.1, False) == "0.1f"
    assert literal(-2.0, True) == "(-2.0)"
    assert literal(math.inf, False) == "((real)INFINITY)"
    value = 1.0 + 2.0**-24  # between two f32: to the even one, whatever the digits say
    assert literal(value, False) == "1.0f"
    with pytest.raises(UserError, match="does not fit f32"):
        literal(1e39, False)
    with pytest.raises(UserError, match="does not fit f32"):
        literal(1e-60, False)


@needs(C_COMPILER)
def test_branches_compute_what_only_they_need(tmp_path):
    def law(x, y, z):
        """Shared, alone and nested: in C every number is computed in the innermost branch that needs it."""
        sine, cosine = sin(y), cos(y)
        steep = where(x < 1.0, sqrt(x * x + y * y) * sin(x) / cos(x), sine)
        both = where(z > 0.0, exp(z) * where(z > 1.0, log(z), x), cosine), where(z > 0.0, exp(z) - x, atan2(y, z))
        columns, best = (x, y, z, x - y), x
        for new in (y, z):
            better = new > best
            columns = [where(better, new - 2.0 * one, one) for one in columns]
            best = where(better, new, best)
        angle = where(x < 0.0, exp(y), y)
        apart = where(x > y, sin(x * z), cos(x * z)), where(y > z, sin(y - z), cos(y - z)), where(y > z, cos(y - z), x)
        return steep, *both, *columns, best, where(y > 0.0, sin(angle), cos(angle)), cos(angle), sin(z), *apart

    rng = np.random.default_rng(3)
    samples = rng.uniform(-3.0, 3.0, size=(3, 400))
    found = through_c(tmp_path, law, *samples)
    wanted = np.array([law(*map(float, sample)) for sample in samples.T]).T
    np.testing.assert_array_equal(found, wanted)
    text = (tmp_path / "law.c").read_text(encoding="utf-8").partition("void law(")[2]
    assert [text.count(f"qs_{name}(") for name in ("sincos", "exp", "log", "atan2")] == [5, 2, 1, 1]
    assert text.count("\nif (") == 4  # of z for both values, of each column for all of them


@dataclass(frozen=True)
class Turning(CascadedPid):
    """Turns by its rates, in one branch only: there is no sine without its cosine but in that branch."""

    def law(self, memory, measured, reference, gains, t, period):
        command, memory = super().law(memory, measured, reference, gains, t, period)
        q = from_rotation_vector(0.001 * measured.rates)
        more = where(measured.position[2] > 1.0, q[0] * q[1] + q[2] * q[3], 0.0)
        return command._replace(thrust=command.thrust + more), memory


@needs(C_COMPILER)
def test_a_sine_that_only_one_branch_needs_has_its_function(tmp_path):
    plan = real_mission({"type": "pid"}).plan()
    turning = Turning(**{field.name: getattr(plan.loop.controller, field.name) for field in fields(plan.loop.controller)})
    law = written(tmp_path, plan._replace(loop=replace(plan.loop, controller=turning)), True)
    assert run_compiled(tmp_path, law.name, COMPILERS[0])[1] == 0


def test_a_row_map_is_the_rows_one_by_one():
    rows = Matrix([vector(1.0, 2.0), vector(3.0, 4.0)])
    assert list(rows.map_rows(lambda row: row[0] - row[1])) == [-1.0, -1.0]


# Bad input


def refused(*arguments):
    run = quadstep("export", *arguments)
    assert run.refused, run
    return run.err


TEXT = '[vehicle]\npreset = "crazyflie"\n[path]\ntype = "step"\nend = [0.0, 0.0, 1.0]\nduration = 2.0\n'


def test_bad_input_is_one_line(tmp_path):
    mission = write(tmp_path, TEXT + '[controller]\ntype = "pid"\n')
    out = tmp_path / "out"
    assert "--target: unknown value 'risc'; allowed: c99" in refused(mission, "--target", "risc", "--out", out)
    assert "--precision: unknown value 'f16'" in refused(mission, "--precision", "f16", "--out", out)
    assert "file not found" in refused(tmp_path / "nowhere.toml", "--out", out)
    write(tmp_path, "def law(t, measured, reference):\n    return 1.0, (0.0, 0.0, 0.0)\n", "mine.py")
    opaque = write(tmp_path, TEXT + '[controller]\ntype = "mine.py:law"\n', "opaque.toml")
    assert "has no equations to export" in refused(opaque, "--out", out)
    large = write(tmp_path, TEXT + '[controller]\ntype = "pid"\nrate_derivative = 1e-60\n', "large.toml")
    assert "rate_derivative: 1e-60 does not fit f32" in refused(large, "--out", out)
    assert not out.exists()
    out.mkdir()
    (out / "letter.txt").write_text("dear", encoding="utf-8")
    assert "holds other files" in refused(mission, "--out", out)
    assert [path.name for path in out.iterdir()] == ["letter.txt"]


def test_an_export_is_a_whole_folder(tmp_path):
    mission = write(tmp_path, TEXT + '[controller]\ntype = "pid"\n')
    run = quadstep("export", mission, "--out", tmp_path / "pid")
    assert run.code == 0, run.err
    names = {path.name for path in (tmp_path / "pid").iterdir()}
    assert names == {
        "pid.h", "pid.c", "pid_params.c", "pid_golden.h", "test_pid.c", "CMakeLists.txt", "datasheet.md", "export.json",
    }  # fmt: skip
    sheet = (tmp_path / "pid" / "datasheet.md").read_text(encoding="utf-8")
    assert "RAM: 88 bytes of state" in sheet
    assert "are yours" in sheet
    assert quadstep("export", mission, "--out", tmp_path / "pid").code == 0  # the same again
    other = write(tmp_path, TEXT + '[controller]\ntype = "pid"\nmass = 0.03\n', "other.toml")
    assert quadstep("export", other, "--out", tmp_path / "pid").code == 2


@needs(C_COMPILER, CMAKE)
def test_its_test_is_built_and_passes_by_the_commands_that_the_build_file_names(tmp_path):
    mission = write(tmp_path, TEXT + '[controller]\ntype = "pid"\n')
    assert quadstep("export", mission, "--out", tmp_path / "pid").code == 0
    for command in ("cmake -B build", "cmake --build build", "ctest --test-dir build --output-on-failure"):
        done = subprocess.run(command.split(), cwd=tmp_path / "pid", capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
    assert "100% tests passed" in done.stdout


# Flown


@needs(C_COMPILER)
@pytest.mark.parametrize("name", ["real pid", "paper backstepping", "plane planar-pd"])
def test_a_mission_flies_through_the_compiled_code_to_the_same_log(name):
    mission, kind = MISSIONS[name]
    flown = mission({"type": kind}, simulation={"duration": 1.0})
    lanes, c = fly(flown), fly(flown, engine="c")
    assert lanes.columns == c.columns
    assert lanes.outcome is c.outcome
    np.testing.assert_array_equal(lanes.rows, c.rows)


@needs(C_COMPILER)
@pytest.mark.parametrize("kind", ["indi", "planned-lqr", "mpc"])
def test_compiled_code_is_given_what_its_law_measures_and_sees_ahead(kind):
    flown = real_mission({"type": kind}, simulation={"duration": 0.2})
    np.testing.assert_array_equal(fly(flown).rows, fly(flown, engine="c").rows)
    single = fly_c(flown.plan(), precise=False)
    assert single.outcome is Outcome.COMPLETED


@needs(C_COMPILER)
def test_a_lost_flight_is_lost_alike():
    lost = real_mission(
        {"type": "pid"}, start={"rates": [90.0, 0.0, 0.0]}, limits={"rate": 50.0}, simulation={"duration": 1.0}
    )
    lanes, c = fly(lost), fly(lost, engine="c")
    assert lanes.outcome is c.outcome is not Outcome.COMPLETED
    np.testing.assert_array_equal(lanes.rows, c.rows)


@needs(C_COMPILER)
def test_f32_stays_within_three_micrometres_on_the_crazyflie():
    plan = real_mission({"type": "rotation-backstepping"}).plan()
    apart, seconds = in_f32(plan, [], lambda _: None)
    assert seconds == 8.0
    assert 0.0 < apart < 3e-6
    text = " ".join((example("").parent / "docs" / "export.md").read_text(encoding="utf-8").split())
    assert f"stays within {1e6 * apart:.2f} micrometres of the f64 flight (rotation-backstepping, 8 s)" in text


def test_without_a_compiler_the_engine_says_what_is_missing(monkeypatch):
    monkeypatch.setenv("CC", "no-such-compiler")
    with pytest.raises(UserError, match="no-such-compiler named by CC is not on the path"):
        fly(real_mission({"type": "pid"}), engine="c")


@pytest.mark.parametrize(("program", "said"), [("false", "ended with exit code 1 and no message"), ("true", "wrote nothing")])
def test_what_is_no_compiler_is_named(monkeypatch, program, said):
    monkeypatch.setenv("CC", program)
    with pytest.raises(UserError, match=f"the C compiler {program} {said}"):
        fly(real_mission({"type": "pid"}), engine="c")


# Measured


@pytest.mark.parametrize("tool", ["arm-none-eabi-gcc", "arm-none-eabi-size"])
def test_the_data_sheet_says_which_program_is_missing(tmp_path, monkeypatch, tool):
    monkeypatch.setattr("quadstep.export.arm.missing_programs", lambda: [tool])
    monkeypatch.setattr("shutil.which", lambda name, which=shutil.which: None if name == "cppcheck" else which(name))
    mission = write(tmp_path, TEXT + '[controller]\ntype = "pid"\n')
    run = quadstep("export", mission, "--out", tmp_path / "pid", "--measure", "--precision", "f64")
    assert run.code == 0, run.err
    assert f"code, stack and instructions: {tool} not found" in (tmp_path / "pid" / "datasheet.md").read_text(encoding="utf-8")


@needs(C_COMPILER, CORTEX_M, CPPCHECK)
def test_the_data_sheet_is_measured(tmp_path):
    mission = write(tmp_path, TEXT + '[controller]\ntype = "pid"\n')
    run = quadstep("export", mission, "--out", tmp_path / "pid", "--measure")
    assert run.code == 0, run.err
    sheet = (tmp_path / "pid" / "datasheet.md").read_text(encoding="utf-8")
    assert sheet.count("| golden vectors | the same bits |") == 2  # Cortex-M4F and M7
    assert sheet.count("| compiler warnings | 0 |") == 2
    law = re.search(r"instructions of law \| (\d+) at worst", sheet)
    assert 200 < int(law[1]) < 1000
    assert "micrometres from the flight in f64" in sheet
    assert "not judged yet" not in sheet
    assert "Not measured" not in sheet


@needs(C_COMPILER, QEMU, ARM_COMPILER)
@pytest.mark.parametrize("precise", [False, True], ids=["f32", "f64"])
def test_arm_gives_the_same_bits(tmp_path, precise):
    law = written(tmp_path, real_mission({"type": "rotation-backstepping"}).plan(), precise)
    sources = [f"{law.name}.c", f"{law.name}_params.c", f"test_{law.name}.c"]
    line = ["aarch64-linux-gnu-gcc", "-std=c99", "-O3", "-static", *BITS, "-I.", *sources, "-lm", "-o", "on_arm"]
    subprocess.run(line, cwd=tmp_path, check=True, capture_output=True)
    run = subprocess.run(["qemu-aarch64", tmp_path / "on_arm"], capture_output=True, text=True, check=False, timeout=PATIENCE)
    assert run.stdout == "80 samples: the same bits\n"


@needs(C_COMPILER)
def test_a_policy_of_the_users_own_keeps_its_layers_in_memory(tmp_path):
    write(tmp_path, POLICY, "policy.py")
    plan = real_mission({"type": f"{tmp_path / 'policy.py'}:Policy"}).plan()
    law = written(tmp_path, plan, False)
    text = (tmp_path / f"{law.name}.c").read_text(encoding="utf-8")
    assert text.count("for (int32_t i = 0; i < 24; ++i)") == 3
    assert run_compiled(tmp_path, law.name, COMPILERS[0], "-O2")[1] == 0


POLICY = '''
from dataclasses import dataclass
from typing import NamedTuple

from quadstep.interfaces.controller import Command, Controller
from quadstep.interfaces.gain import given
from quadstep.numbers import Matrix, Vector, sigmoid


def layer(rows, columns):
    """Weights that somebody has learnt."""
    return Matrix([Vector([((i * 7 + j * 3) % 11 - 5.0) / 60.0 for j in range(columns)]) for i in range(rows)])


class Gains(NamedTuple):
    first: Matrix = given(lambda model: layer(24, 13))
    bias: Vector = given(lambda model: Vector([0.01 * i for i in range(24)]))
    second: Matrix = given(lambda model: layer(24, 24))
    last: Matrix = given(lambda model: layer(4, 24))
    weight: float = given(lambda model: model.mass * model.gravity)


@dataclass(frozen=True)
class Policy(Controller):
    name = "policy"
    Gains = Gains

    def law(self, memory, measured, reference, gains, t, period):
        seen = Vector((*(reference.position - measured.position), *measured.velocity, *measured.attitude, *measured.rates))
        hidden = gains.first @ seen + gains.bias
        hidden = (gains.second @ hidden).map(sigmoid)
        thrust, *torque = gains.last @ hidden
        return Command(gains.weight * (1.0 + thrust), 1e-4 * Vector(torque)), memory
'''
