"""Terms that laws write for Coq and Gappa, the statements made of them, and what `python -m proofs` refuses."""

import ast
import math
import os
import random
import re
import shutil
import subprocess
from fractions import Fraction
from graphlib import CycleError
from pathlib import Path

import numpy as np
import pytest

from proofs import coq_run, decrease, geometry, inertia, lines, turning
from proofs.__main__ import all_statements
from proofs.approximation import Polynomial, largest_error
from proofs.coq_run import UnprovedError, prove
from proofs.kernels import (
    KERNELS,
    Kernel,
    arctangent_tail,
    cosine,
    exponential,
    logarithm_tail,
    power_of_two,
    reduced,
    sine_tail,
)
from proofs.rounding import script
from proofs.statement import Claim, Statement, variables_of
from proofs.terms import Term, coq, decimal, gappa, generalised, term, variable, variables
from quadstep.control.completed_backstepping import coupling_columns
from quadstep.control.vectoring import invert_force
from quadstep.interfaces.plant import Kinematics
from quadstep.numbers import atan2, cos, exp, flatten, log, sigmoid, sin, sqrt, vector, where
from quadstep.numbers.elementary import limited
from quadstep.numbers.kinds import FLOATS
from quadstep.proofs.theory.region import decay
from quadstep.vehicle.paper import coriolis, effective_inertia
from tests.mutations import exchanged, source


def value(root: Term, at: dict[str, float]) -> float:
    """A term's value in floats, operation by operation."""
    op, parts = root.op, root.parts
    if op == "var":
        return at[root.leaf]
    if op == "const":
        return float(root.leaf)
    if op == "where":
        test = parts[0]
        a, b = (value(part, at) for part in test.parts)
        truth = {"<": a < b, "<=": a <= b, ">": a > b, ">=": a >= b}[test.op]
        return value(parts[1] if truth else parts[2], at)
    inside = [value(part, at) for part in parts]
    return {
        "+": lambda x, y: x + y, "-": lambda x, y: x - y, "*": lambda x, y: x * y, "/": lambda x, y: x / y,
        "negative": lambda x: -x, "magnitude": abs, "sin": sin, "cos": cos, "exp": exp, "sigmoid": sigmoid, "sqrt": sqrt,
        "log": log, "atan2": atan2,
    }[op](*inside)  # fmt: skip


def test_a_term_is_the_laws_own_arithmetic_to_the_bit():
    numbers = [0.3, -0.4, 1.1, 0.5, -0.7, 0.9, 5.0, 8.0, 12.0]
    names = [f"x{i}" for i in range(9)]
    at = dict(zip(names, numbers, strict=True))
    for build in (
        lambda v: coriolis(vector(*v[:3]), vector(*v[3:6]), vector(*v[6:]), Kinematics.STANDARD),
        lambda v: effective_inertia(vector(*v[:3]), vector(*v[6:]), Kinematics.STANDARD),
        lambda v: coupling_columns(vector(*v[:2]), vector(*v[2:4])),
        lambda v: vector(where(v[0] < v[1], exp(v[2]), sigmoid(v[3])), atan2(v[4], v[5]), log(v[6]), vector(*v[7:]).norm()),
    ):
        terms, floats = flatten(build([variable(name) for name in names])), flatten(build(numbers))
        assert [value(term(t), at) for t in terms] == floats


def test_equal_terms_are_one_and_nothing_is_decided():
    x = variable("x")
    assert x + 1.0 is x + 1.0
    assert x + 1.0 is not 1.0 + x
    with pytest.raises(TypeError):
        bool(x < 1.0)
    assert coq(0.1 * x) == "((3602879701896397 / 36028797018963968) * x)"
    assert coq(where(x < 1.0, -x, abs(x))) == "(if (Rlt_dec x 1) then (- x) else (Rabs x))"
    assert variables(x * variable("y") + x) == ["x", "y"]


def test_parts_become_variables_the_same_for_the_same_argument():
    x, y = variable("x"), variable("y")
    general = generalised(sin(x + y) * sin(x + y) + cos(x + y), {x + y: variable("z")}, frozenset({"sin"}))
    first, second = general.parts[0].parts
    assert first is second
    assert first.op == "var"
    assert coq(general.parts[1]) == "(cos z)"


def test_gappa_rounds_each_operation_once():
    lines: list[str] = []
    x = variable("x")
    assert gappa(x * x + 0.5, "rnd", lines) == "t1"
    assert lines == ["t0 = rnd(x * x);", "t1 = rnd(t0 + 1b-1);"]
    assert decimal(Fraction(-3, 8)) == "-3b-3"
    with pytest.raises(ValueError, match="not a float"):
        decimal(Fraction(1, 3))


def test_kernels_are_the_functions_that_fly_to_the_bit():
    draw = np.random.default_rng(1)
    for x in draw.uniform(-0.78, 0.78, 500).tolist():
        assert x + sine_tail(x, True) == sin(x)
        assert cosine(x, True) == cos(x)
        r = reduced(x + 4.712, 3.0, True)
        assert abs(r) > 0.785 or r + sine_tail(r, True) == cos(x + 4.712)
    for x in draw.uniform(-0.34, 0.34, 500).tolist():
        assert exponential(x, True) == exp(x)
        assert x + arctangent_tail(x, True) == (atan2(x, 1.0) if x >= 0 else -atan2(-x, 1.0))
        s = x / 2.0
        f = 2.0 * s / (1.0 - s)
        s, half = f / (2.0 + f), 0.5 * f * f
        if 0.71 < 1.0 + f < 1.41 and (1.0 + f) - 1.0 == f:
            assert f - (half - s * (half + logarithm_tail(s, True))) == log(1.0 + f)
    for octaves in draw.uniform(-0.49, 0.49, 500).tolist():
        argument = -octaves * math.log(2.0)
        held = limited(
            FLOATS, argument * -float(1 / Fraction("0.69314718055994530941723212145817656807550013436026")), -1023.0, 1024.0
        )
        assert 1.0 / (1.0 + power_of_two(held, True)) == sigmoid(argument)


def test_the_error_of_a_polynomial_is_bounded_and_the_bound_is_near():
    for kernel in KERNELS[:2]:
        bound = float(largest_error(kernel, False))
        true = {"sin": math.sin, "cos": math.cos}[kernel.name]
        points = np.linspace(1e-3, float(kernel.most), 500)
        seen = max(abs(kernel.whole(r, False) - true(r)) / (r if kernel.relative else 1.0) for r in points.tolist())
        assert seen <= bound * (1 + 1e-6)
        assert bound < 1.5 * seen + 1e-15


def test_a_wrong_coefficient_is_seen():
    kernel = KERNELS[1]
    wrong = Kernel(*kernel[:2], lambda r, d: cosine(r, d) + 1e-6 * r * r, *kernel[3:])
    assert largest_error(wrong, True) > 1e9 * largest_error(kernel, True)
    assert Polynomial([Fraction(1), Fraction(2), Fraction(3)]).about(Fraction(2)) == [17, 14, 3]


def test_every_statement_has_a_theorem_and_a_name_of_its_own():
    names = [statement.name for statement in all_statements()]
    assert len(set(names)) == len(names)
    proofs = "".join(path.read_text(encoding="utf-8") for path in coq_run.SOURCES.glob("*.v"))
    stated = re.findall(r"^Theorem (\w+)_holds : (\w+)\.$", proofs, re.MULTILINE)
    assert sorted(stated) == sorted((name, name) for name in names)


def test_statements_come_from_the_functions_that_fly(monkeypatch):
    before = {s.name: s.prop for s in geometry.statements()}
    monkeypatch.setattr(geometry, "coupling_columns", lambda t, w: tuple(-b for b in coupling_columns(t, w)))
    after = {s.name: s.prop for s in geometry.statements()}
    assert before["T1"] != after["T1"]
    monkeypatch.setattr(inertia, "coriolis", lambda *a: 0.9 * coriolis(*a))
    assert "8106479329266893" in {s.name: s.prop for s in inertia.statements()}["T6"]


def test_lines_and_rates_come_from_the_functions_that_compute_them(monkeypatch):
    draw, at = random.Random(3), {}
    slope = lines.bound(lambda name: at.setdefault(name, Fraction(draw.randint(1, 99), 10)))
    assert value(term(lines.bound()), {name: float(number) for name, number in at.items()}) == pytest.approx(float(slope))
    before = [statement.prop for statement in (*lines.statements(), *turning.statements())]
    monkeypatch.setattr(lines, "decay", lambda s, *rest, **rounded: decay(s._replace(gain_1=s.gain_2), *rest, **rounded))
    monkeypatch.setattr(turning, "invert_force", lambda force: invert_force(-force))
    monkeypatch.setattr(turning, "coupling_columns", lambda t, w: tuple(-b for b in coupling_columns(t, w)))
    after = [statement.prop for statement in (*lines.statements(), *turning.statements())]
    assert all(old != new for old, new in zip(before, after, strict=True))


def drawn(statement: Statement, seed: int) -> dict[str, float]:
    """Values of all variables: random ones, of the bounds of a projection large ones, and what the names stand for."""
    draw = random.Random(seed)
    meant = [definition for setting in statement.settings for definition in setting.meant]
    free = (variables_of([statement.claimed]) | statement.given.variables) - {name for name, _ in meant}
    size = {"most": 10.0, "slope": 10.0, "least": 0.1, **dict.fromkeys(("nmax1", "nmax2", "wmax1", "wmax2"), 1e6)}
    at = {name: size.get(name, 1.0) * draw.uniform(0.2, 1.4) for name in sorted(free)}
    while meant:  # a part may be said with names that come later
        later = [(name, part) for name, part in meant if not at.keys() >= set(variables(part))]
        at |= {name: value(part, at) for name, part in meant if at.keys() >= set(variables(part))}
        assert len(later) < len(meant)
        meant = later
    return at


def true(claim: Claim, at: dict[str, float]) -> bool:
    """Up to round-off."""
    sides = [(value(a, at), value(b, at)) for a, b in claim.pairs]
    spare = 1e-10 * (1.0 + max(max(abs(a), abs(b)) for a, b in sides))
    if claim.relation == "<>":
        return all(a != b for a, b in sides)
    return all({"=": abs(a - b), "<=": a - b, ">": b - a}[claim.relation] <= spare for a, b in sides)


def refuted(statement: Statement, tries: int = 2) -> bool:
    """Whether the claim fails somewhere; what is given holds in every try."""
    for seed in range(tries):
        at = drawn(statement, seed)
        assert all(true(claim, at) for setting in statement.settings for claim in setting.claims)
        if not true(statement.claimed, at):
            return True
    return False


def test_what_is_stated_of_l_dot_holds_at_random_numbers():
    assert {s.name for s in decrease.statements() if refuted(s)} == set()


COMPLETED, LAW, NETS = "control.completed_backstepping", "control.backstepping", "interfaces.learning"


@pytest.mark.parametrize(
    ("place", "was", "now", "fails"),
    [
        (COMPLETED, "u_d * (b_theta @ r1) / gains", "-u_d * (b_theta @ r1) / gains", {"T9"}),
        (COMPLETED, "u_d * (b_phi @ r1) / gains.coupling[2]", "u_d * (b_phi @ r1) / gains.coupling[1]", {"T9"}),
        (COMPLETED, "c = with_yaw(0.0, memory.counter.value)", "c = with_yaw(0.0, 0.9 * memory.counter.value)", {"T9"}),
        (COMPLETED, "estimate_2) + gains.coupling * e2 + rigid", "estimate_2) + rigid", {"T9"}),
        (COMPLETED, "(paper.slope_2 * e2 + c) + c_dot", "(paper.slope_2 * e2 + c)", {"T9"}),
        (COMPLETED, "coupling @ rates\n", "0.5 * (coupling @ rates)\n", {"T9"}),
        (COMPLETED, "self.countering(gains, outer.u_d, tilt,", "self.countering(gains, 9.81, tilt,", {"T9"}),
        (COMPLETED, "outer, mu_2, r2, period, on)", "outer, mu_2, r2 - c, period, on)", {"T9"}),
        (COMPLETED, "gains.integral_bounds[0]", "1e-9 * gains.integral_bounds[0]", {"T9"}),
        (NETS, "growth - (net.damping * error_norm", "growth - (0.5 * net.damping * error_norm", {"T9", "T11"}),
        (NETS, "growth - (net.damping", "growth + (net.damping", {"T9", "T11"}),
        (LAW, "+ gains.gain_2 * r2 +", "- gains.gain_2 * r2 +", {"T9", "T11"}),
        (LAW, "+ estimate + feedback", "+ feedback", {"T9", "T11"}),
        (LAW, "integral_2=memory.integral_2 + period * r2", "integral_2=memory.integral_2 + 0.5 * period * r2", {"T9", "T11"}),
        ("control.vectoring", "atan2(-f_x, b)", "atan2(f_x, b)", {"T17", "T9", "T11"}),
        ("vehicle.paper", "torque - coriolis_torque", "torque + coriolis_torque", {"T9", "T11"}),
    ],
)  # fmt: skip
def test_what_is_stated_of_a_wrong_law_is_false(place, was, now, fails):
    text = source(place)
    assert text.count(was) == 1
    with exchanged(place, ast.parse(text.replace(was, now))):
        stated = {statement.name: statement for statement in (*geometry.statements(), *decrease.statements())}
        assert {name for name in fails if refuted(stated[name])} == fails


@pytest.mark.parametrize("cheat", ["Admitted.", "Axiom a : False.", "Proof. admit."])
def test_a_file_that_admits_is_refused(monkeypatch, tmp_path, cheat):
    sources, work = tmp_path / "coq", tmp_path / "work"
    sources.mkdir()
    work.mkdir()
    (sources / "Basics.v").write_text(f"(* Admitted in a comment is fine *)\n{cheat}\n")
    monkeypatch.setattr(coq_run, "SOURCES", sources)
    monkeypatch.setattr(coq_run, "compiled", lambda folder, name: "")
    with pytest.raises(UnprovedError, match="holds"):
        prove([], work)


def test_an_axiom_beyond_the_reals_is_refused(monkeypatch, tmp_path):
    monkeypatch.setattr(coq_run, "compiled", lambda folder, name: "T1_holds\n     : T1\nAxioms:\nMine.falsehood : False\n")
    with pytest.raises(UnprovedError, match=re.escape("assumed beyond the real numbers: Mine.falsehood")):
        prove(geometry.statements(), tmp_path)


def test_files_come_after_what_they_need():
    order = coq_run.files()
    assert order.index("Basics") < order.index("Plant")
    assert set(order) == {coq_run.STATEMENTS, *(path.stem for path in coq_run.SOURCES.glob("*.v"))}
    assert order.index(coq_run.FUNCTIONS) < order.index(coq_run.STATEMENTS) < order.index("Plant")


def test_files_that_need_one_another_are_no_endless_search(monkeypatch, tmp_path):
    (tmp_path / "A.v").write_text("Require Import B.\n")
    (tmp_path / "B.v").write_text("Require Import A.\n")
    monkeypatch.setattr(coq_run, "SOURCES", tmp_path)
    with pytest.raises(CycleError):
        coq_run.files()


def test_scripts_for_gappa_ask_for_the_rounding_of_the_code():
    text = script(KERNELS[0], True)
    assert "@rnd = float<ieee_64, ne>;" in text
    assert "|r| in [1b-60,0.7855] -> (sum - M) / r in ?" in text


@pytest.mark.parametrize("has_apt", [True, False])
def test_make_proofs_installs_the_provers_on_a_machine_without_them(tmp_path, has_apt):
    """With stand-ins for apt-get and for the environment's Python."""
    tools, venv, asked = tmp_path / "tools", tmp_path / "venv", tmp_path / "asked"
    (venv / "bin").mkdir(parents=True)
    tools.mkdir()
    for name in ("sh", "id", "env"):
        (tools / name).symlink_to(str(shutil.which(name)))
    written = {venv / "bin" / "python": f'echo "python $*" >> {asked}', tools / "sudo": '[ "$1" = -n ] && shift; exec "$@"'}
    if has_apt:
        written[tools / "apt-get"] = f'echo "apt-get $*" >> {asked}'
    for path, line in written.items():
        path.write_text(f"#!/bin/sh\n{line}\n")
        path.chmod(0o755)
    for name in ("core", "ready"):
        (venv / name).touch()
    root, make = Path(__file__).parents[1], str(shutil.which("make"))
    done = subprocess.run(
        [make, "proofs", f"VENV={venv}"],
        cwd=root,
        env={**os.environ, "PATH": str(tools)},
        capture_output=True,
        text=True,
        check=False,
    )
    if has_apt:
        assert done.returncode == 0, done.stderr
        assert asked.read_text().splitlines() == [
            "apt-get update -qq",
            "apt-get install -y -qq --no-install-recommends coq libcoq-stdlib gappa",
            "python -m proofs",
        ]
    else:
        assert done.returncode == 2
        assert "make proofs needs Coq 8.16 or newer and Gappa" in done.stdout
        assert not asked.exists()
