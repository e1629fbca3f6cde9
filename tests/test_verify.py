"""`quadstep verify`: every equation has a row, every row its evidence, and the page of errata is made from them."""

import importlib
import json
import sys
import types
from functools import cache
from pathlib import Path

import pytest

from quadstep.commands import cli
from quadstep.numbers import atan2, clip, sin, where
from quadstep.proofs.verify.equation_row import Check, Checks, EquationRow, EquationVerdict, judge
from quadstep.proofs.verify.registry import (
    EQUATIONS,
    FACTS,
    FOLLOWS,
    all_rows,
    cells,
    chosen,
    closing,
    document,
    facts,
    page,
    verify,
)

PAGE = Path(__file__).parents[1] / "docs" / "errata.md"


@cache
def results():
    return verify(all_rows())


def run(monkeypatch, *arguments):
    """Exit code of the command line."""
    monkeypatch.setattr(sys, "argv", ["quadstep", *arguments])
    with pytest.raises(SystemExit) as ending:
        cli.main()
    return ending.value.code or 0


def test_all_evidence_holds():
    assert [f"{r.row.number}: {r.failure}" for r in results() if not r.passed] == []


def test_every_number_and_name_has_one_row_in_order():
    numbers = [row.number for row in all_rows()]
    assert [int(n) for n in numbers if n.isdigit()] == list(range(1, EQUATIONS + 1))
    assert {n for n in numbers if not n.isdigit()} == set(FOLLOWS)
    assert len(numbers) == EQUATIONS + len(FOLLOWS)


def test_every_row_says_where_and_the_place_exists():
    for row in all_rows():
        module, _, path = row.where.partition(":")
        thing = importlib.import_module(module)
        for name in path.split("."):
            thing = getattr(thing, name)
        assert isinstance(thing, types.FunctionType), row.where
        assert not module.startswith("quadstep.proofs.verify")


def test_every_correction_has_a_reason_and_numbers_and_shows_that_the_printed_form_fails():
    corrected = [r for r in results() if r.row.verdict is EquationVerdict.CORRECTED]
    assert len(corrected) >= 20
    for result in corrected:
        assert result.row.reason, result.row.number
        assert any(letter.isdigit() for letter in result.evidence.counterexample), result.row.number
        assert len(result.evidence.checks) >= 2, result.row.number


def test_texts_are_single_lines():
    for result in results():
        for text in (*result.row[:5], result.row.reason, result.evidence.counterexample):
            assert "\n" not in text


@pytest.mark.parametrize(("number", "numbers"), [
    ("6", ["2.763", "-6.362", "8.199"]),
    ("67", ["0.9375"]),
    ("gain conditions", ["-16.83"]),
    ("chi_2", ["-4.5 N m"]),
    ("52", ["7.211"]),
    ("63", ["is 4;", "b_r = 1,"]),
])  # fmt: skip
def test_counterexamples_have_the_known_numbers(number, numbers):
    (result,) = verify(chosen(number))
    assert all(part in result.evidence.counterexample for part in numbers)


def test_page_of_errata_is_made_from_the_rows():
    assert page(results()) == PAGE.read_text(encoding="utf-8"), "run `make errata`"
    assert facts(results()) == (PAGE.parents[1] / FACTS).read_text(encoding="utf-8"), "run `make errata`"


def test_laws_take_symbols():
    import sympy

    x, y = sympy.symbols("x y")
    assert sin(x) == sympy.sin(x)
    assert atan2(y, x) == sympy.atan2(y, x)
    chosen_by = where(x > 0, x, y)
    assert (chosen_by.subs({x: 2, y: 5}), chosen_by.subs({x: -2, y: 5})) == (2, 5)
    assert [clip(x, -1.0, 1.0).subs(x, value) for value in (-3, 0.5, 7)] == [-1.0, 0.5, 1.0]
    assert where(sympy.true, x, y) is x
    with pytest.raises(TypeError, match="str is not a number"):
        sin("x")


def test_floats_do_not_load_sympy():
    import subprocess

    code = (
        "import sys; from quadstep.numbers import sin; import quadstep.commands.cli; sin(0.5); print('sympy' in sys.modules)"
    )
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert answer.stdout.strip() == "False"


@pytest.mark.parametrize("columns", [40, 80, 200])
def test_a_summary_is_printed_or_every_row_in_whole_words(monkeypatch, capsys, columns):
    monkeypatch.setenv("COLUMNS", str(columns))
    monkeypatch.setattr("quadstep.proofs.verify.registry.verify", lambda rows, progress: results())
    assert run(monkeypatch, "verify") == 0
    summary = capsys.readouterr().out
    assert len(summary.splitlines()) < 40
    assert "Use --all to list every row." in " ".join(summary.split())
    assert run(monkeypatch, "verify", "--all") == 0
    words = set(capsys.readouterr().out.split())
    for result in results():
        for text in cells(result):
            assert set(text.split()) <= words


def test_one_row_is_printed(monkeypatch, capsys):
    assert run(monkeypatch, "verify", "--only", "t_ETA") == 0
    shown = capsys.readouterr().out
    assert "T_eta" in shown
    assert "corrected" in shown
    assert "in 1 row, " in shown
    assert "1 row is wrong in the paper and corrected here." in shown


def test_json_has_every_row_with_its_checks_and_nothing_else(monkeypatch, capsys):
    assert run(monkeypatch, "verify", "--only", "5", "--json") == 0
    content = json.loads(capsys.readouterr().out)
    assert content["passed"] is True
    (row,) = content["rows"]
    assert (row["number"], row["verdict"], row["where"]) == ("5", "as printed", "quadstep.vehicle.paper:rotor_map")
    assert all(set(check) == {"what", "expected", "found", "holds"} for check in row["checks"])


def test_whole_document_is_json():
    content = json.loads(json.dumps(document(results(), 1.25), allow_nan=False))
    assert len(content["rows"]) == len(results())
    assert f" in {len(results())} rows, 1.2 s). " in closing(results(), 1.25)


@pytest.mark.parametrize(
    ("arguments", "part"),
    [(["--only", "76"], "allowed: 1 to 75"), (["--only", ""], "--only: is empty"), (["--json=a"], "--json: takes no value")],
)
def test_bad_input_is_one_line_and_exit_code_2(monkeypatch, capsys, tmp_path, arguments, part):
    monkeypatch.chdir(tmp_path)
    assert run(monkeypatch, "verify", *arguments) == 2
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert part in line
    assert not list(tmp_path.iterdir())


def test_without_sympy_one_line_says_how_to_install_it(monkeypatch, capsys):
    for name in [name for name in sys.modules if name.startswith("quadstep.proofs.verify")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.delattr("quadstep.proofs.verify", raising=False)
    for name in ("sympy", "mpmath"):
        monkeypatch.setitem(sys.modules, name, None)
    assert run(monkeypatch, "verify") == 2
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert line.startswith("quadstep: error: `quadstep verify` needs ")
    assert line.endswith(f"install it: {sys.executable} -m pip install 'sympy>=1.13'")


def failing_row(gather):
    return EquationRow("5", "what", "printed", "quadstep.vehicle.paper:mix", EquationVerdict.AS_PRINTED, "", gather)


def test_a_failing_row_is_marked_and_the_exit_code_is_1(monkeypatch, capsys):
    row = failing_row(lambda: Checks([Check("sum of thrusts", "4", "5", False)]))
    monkeypatch.setattr("quadstep.proofs.verify.registry.chosen", lambda only: [row])
    assert run(monkeypatch, "verify") == 1
    shown = capsys.readouterr().out
    assert "FAILED" in shown
    assert "sum of thrusts: expected 4, found 5" in " ".join(shown.replace("│", " ").split())
    assert "1 of 1 row FAILED (1 checks" in shown


def test_evidence_that_breaks_or_is_empty_fails():
    def broken():
        raise ValueError("no such thing")

    assert judge(failing_row(broken)).failure == "evidence: expected no error, found ValueError: no such thing"
    assert not judge(failing_row(lambda: Checks([]))).passed
