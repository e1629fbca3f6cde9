"""Small mistakes in the laws, the plant and the bounds, one at a time, and whether the quick checks see them.

python -m tests.mutations                  # all of them; exit code 1 where one survives that no reason is given for
python -m tests.mutations command_filter   # those whose place holds this text
python -m tests.mutations theory 100       # a hundred of them

An operator, a sign, a constant, an index, an argument or a term is changed in the tree of a function's source; only the
code of the running function is exchanged, and put back. Checks: the rows of `quadstep verify` for the completed law, the
rotation law and the inversion; every statement of docs/theory.md on random closed loops; and, for a mistake in a bound, closed
loops that a search found nearest to it before: there the statement must hold and use up nine tenths of each term. For a
mistake in the region of Theorem B: its certificate, and its numbers worked out a second time (tests/theorem_again.py).
"""

import ast
import contextlib
import importlib
import random
import sys
import types
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

from quadstep.engines import kernel
from tests.changes import Change, changes_of
from tests.equivalents import COMPLETED, EQUIVALENT

LAWS = {
    COMPLETED: ("half_sine_ratio", "coupling_columns", "counter_rate", "confine", "with_yaw", "countering", "law"),
    "control.backstepping": ("desired_force", "desired_torque", "position_loop", "attitude_errors", "torque_basis",
        "following_memory", "command_of", "law"),
    "control.rotation_backstepping": ("pull", "law", "follow", "share_made"),
    "control.filters": ("command_filter",),
    "interfaces.learning": ("basis", "output", "weight_rate"),
    "control.vectoring": ("invert_force", "turning_attitude", "project", "project_weights", "shrink"),
    "vehicle.paper": ("effective_inertia", "effective_inertia_partials", "coriolis", "coriolis_torque", "acceleration",
        "angular_acceleration", "thrust_direction"),
}  # fmt: skip
"""Functions of the laws and of the plant."""

BOUNDS = {
    "proofs.theory.inequalities": ("force_gap", "coupling_identity", "coupling_bound", "column_bounds", "inertia_bounds",
        "gain_bound", "skewness", "trace_bound", "projection", "small_gain", "learning_bound"),
    "proofs.theory.lyapunov": ("lyapunov_rate", "rate_terms", "closed_loop", "learning", "filtered_command"),
    "proofs.theory.region": ("bounds_of", "decay", "upper_form", "outer_form", "certify_region"),
}  # fmt: skip
"""Functions that state what is claimed."""

REVIEWED = (
    (COMPLETED, "command_filter(memory.counter, wanted,", "command_filter(memory.counter, 0.0 * wanted,"),
    (COMPLETED, "self.countering(gains, outer.u_d, tilt,", "self.countering(gains, 9.81, tilt,"),
    (COMPLETED, "tilt, before.filtered.value, outer.r1)", "tilt, outer.tilt, outer.r1)"),
    (COMPLETED, "outer, mu_2, r2, period, on)", "outer, mu_2, r2 - c, period, on)"),
    (COMPLETED, "gains.integral_bounds[0]", "gains.integral_bounds[1]"),
    (COMPLETED, "estimate_2 = on * output", "estimate_2 = output"),
)
"""Mistakes that a review found the checks of simulated time to let pass."""


class Mutant(NamedTuple):
    """module, function: the place. was, now: the part of its source. change: as made of its tree, if not by these texts."""

    module: str
    function: str
    was: str
    now: str
    change: Change | None = None

    @property
    def name(self) -> str:
        """How it is called in EQUIVALENT and in what is printed."""
        return f"{self.module}.{self.function}: {self.was} -> {self.now}"

    @property
    def equivalent(self) -> str:
        """Why it may survive; nothing where it must not."""
        return next((reason for start, reason in EQUIVALENT.items() if self.name.startswith(start)), "")

    def tree(self) -> ast.Module:
        """The module with the change."""
        text = source(self.module)
        if self.change is None:
            assert text.count(self.was) == 1, self.was
            return ast.parse(text.replace(self.was, self.now))
        return self.change.tree(text)


def source(module: str) -> str:
    """Of a module of the package."""
    return Path(str(importlib.import_module(f"quadstep.{module}").__file__)).read_text(encoding="utf-8")


def mutants_of(module: str, names: tuple[str, ...]) -> Iterator[Mutant]:
    """Every change of the named functions, one at a time."""
    tree = ast.parse(source(module))
    for function in ast.walk(tree):
        if isinstance(function, ast.FunctionDef) and function.name in names:
            for change in changes_of(function):
                yield Mutant(module, function.name, change.was, change.now, change)


def all_mutants() -> list[Mutant]:
    """Those of the review first, then every change of every function."""
    found = [Mutant(module, "law", was, now) for module, was, now in REVIEWED]
    for places in (LAWS, BOUNDS):
        for module, names in places.items():
            found += mutants_of(module, names)
    return found


def functions(module: types.ModuleType, name: str) -> dict[str, types.FunctionType]:
    """Every function and method that a module defines, by qualified name."""
    found = {}
    for key, value in vars(module).items():
        if isinstance(value, types.FunctionType) and value.__module__ == name:
            found[key] = value
        elif isinstance(value, type) and value.__module__ == name:
            for inner, member in vars(value).items():
                function = member.fget if isinstance(member, property) else getattr(member, "__func__", member)
                if isinstance(function, types.FunctionType):
                    found[f"{key}.{inner}"] = function
    return found


@contextlib.contextmanager
def exchanged(module: str, tree: ast.Module) -> Iterator[None]:
    """The functions of a module with the code of a changed source, in every module that uses them."""
    name = f"quadstep.{module}"
    here = importlib.import_module(name)
    mutant = types.ModuleType(name)
    exec(compile(tree, str(here.__file__), "exec"), mutant.__dict__)
    running, changed = functions(here, name), functions(mutant, name)
    kept = {key: function.__code__ for key, function in running.items() if function.__code__ != changed[key].__code__}
    described = kernel.described
    try:
        kernel.described = lambda _: ""  # the files say nothing of these laws
        for key in kept:
            running[key].__code__ = changed[key].__code__
        yield
    finally:
        kernel.described = described
        for key, code in kept.items():
            running[key].__code__ = code


ROWS = ("completed law", "rotation law", "21", "45", "50", "52", "40", "34", "54", "55")
SAMPLES = 200


@cache
def near():
    """Closed loops near to the bound of each statement, and where the laws that are right take the region."""
    from quadstep.proofs.theory.completion import StatementRecord, search
    from quadstep.proofs.theory.inequalities import STATEMENTS

    return {statement.number: search(statement, StatementRecord()) for statement in STATEMENTS}


def seen_by_rows() -> str:
    """The first row of `quadstep verify` that fails."""
    from quadstep.proofs.verify.equation_row import judge
    from quadstep.proofs.verify.registry import all_rows

    rows = {row.number: row for row in all_rows()}
    return next((f"row {number}" for number in ROWS if not judge(rows[number]).passed), "")


def seen_by_statements() -> str:
    """The first statement of docs/theory.md that some random closed loop breaks."""
    from quadstep.proofs.theory.completion import ROUND_OFF, StatementRecord
    from quadstep.proofs.theory.inequalities import STATEMENTS
    from quadstep.proofs.theory.trials import draw_sample

    sample = draw_sample(11, SAMPLES)
    for statement in STATEMENTS:
        seen = StatementRecord()
        seen.look(statement.sides(sample))
        if not seen.worst >= -ROUND_OFF:
            return statement.number
    return ""


def seen_by_bounds() -> str:
    """The first statement that is broken, or no longer tight, where it was nearest to its bound."""
    from quadstep.proofs.theory.completion import StatementMargin, StatementRecord
    from quadstep.proofs.theory.inequalities import STATEMENTS
    from quadstep.proofs.theory.trials import sample_at

    for statement in STATEMENTS:
        seen = StatementRecord()
        seen.look(statement.sides(sample_at(near()[statement.number])))
        margin = StatementMargin(statement.number, "", seen.worst, 1, seen.reached)
        if not margin.holds:
            return statement.number
        if not margin.bites:
            return f"{statement.number}, no longer tight"
    return ""


@cache
def region() -> tuple[object, ...]:
    """What `quadstep study region` says of the defaults while nothing is changed."""
    return found_region()


def found_region() -> tuple[object, ...]:
    from quadstep.proofs.theory.edge import default_region, least_frequency

    found = default_region(force=0.001, torque=0.001)
    return (found, found and least_frequency(found))


def seen_by_region() -> str:
    """Whether the region of the defaults is another one."""
    return "" if found_region() == region() else "another region"


def seen_by_matrices() -> str:
    """The first number that differs from that of tests/theorem_again.py."""
    from tests.theorem_again import differing, other_kappa_terms, other_learning_terms

    return next((f"{name}, a second time" for name in (*differing(), *other_kappa_terms(), *other_learning_terms())), "")


def caught_by(mutant: Mutant) -> str:
    """What sees a mutant; nothing where it survives."""
    if mutant.module not in BOUNDS:
        checks = [seen_by_rows, seen_by_statements]
    elif mutant.module == "proofs.theory.region":
        region()  # before anything is changed
        checks = [seen_by_region, seen_by_matrices]
    else:
        near()
        checks = [seen_by_statements, seen_by_bounds, seen_by_matrices]
    with exchanged(mutant.module, mutant.tree()):
        for check in checks:
            try:
                found = check()
            except Exception as error:  # a law that cannot even be evaluated is seen
                return type(error).__name__
            if found:
                return found
    return ""


def chosen(count: int, seed: int) -> list[Mutant]:
    """Those of the review, and some of the others that need no search first."""
    every = all_mutants()
    others = [m for m in every[len(REVIEWED) :] if not m.equivalent and m.module in LAWS]
    return [*every[: len(REVIEWED)], *random.Random(seed).sample(others, count)]


def main(arguments: list[str]) -> int:
    """Try them all; the exit code."""
    import numpy as np

    np.seterr(all="ignore")
    texts = [text for text in arguments if text != "-v" and not text.isdigit()]
    every = [m for m in all_mutants() if not texts or any(text in m.name for text in texts)]
    for count in map(int, filter(str.isdigit, arguments)):
        every = random.Random(1).sample(every, min(count, len(every)))
    survived = explained = 0
    for mutant in every:
        found = caught_by(mutant)
        reason = mutant.equivalent
        if not found:
            survived, explained = survived + (not reason), explained + bool(reason)
            print(f"SURVIVED  {mutant.name}" + (f"   ({reason})" if reason else ""), flush=True)
        elif "-v" in arguments:
            print(f"caught by {found}: {mutant.name}")
    caught = len(every) - survived - explained
    print(f"{len(every)} mutants: {caught} caught, {explained} survive for a reason, {survived} survived")
    return 1 if survived else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
