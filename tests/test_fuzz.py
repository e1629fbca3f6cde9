"""Spoilt files are read, or refused with one clean line: 600 of them, 5,000 in `make thorough`, 100,000 in `make fuzz`; the
judge knows the other verdicts.
"""

import os
import warnings

import pytest

from quadstep.io.errors import UserError
from tests.fuzz.judge import judge
from tests.fuzz.run import KINDS, SHARES, some


@pytest.mark.parametrize("cases", [600, pytest.param(5000, marks=pytest.mark.thorough)])
@pytest.mark.parametrize("kind", SHARES)
def test_whatever_a_file_holds_it_is_read_or_refused_with_one_clean_line(kind, cases):
    found = some(kind, 0, round(cases * SHARES[kind]))
    assert not found.failures
    assert min(found.outcomes["accepted"], found.outcomes["refused"]) > 0


def test_the_shares_make_a_whole():
    assert SHARES.keys() == KINDS.keys()
    assert sum(SHARES.values()) == pytest.approx(1.0)


def refuse(line):
    raise UserError(line)


def warn():
    warnings.warn("overflow", RuntimeWarning, stacklevel=1)


@pytest.mark.parametrize(("case", "outcome"), [
    (lambda: None, "accepted"),
    (lambda: refuse("a.toml: mass: should be above 0"), "refused"),
    (lambda: refuse("mass: should be above 0"), "failed"),
    (lambda: refuse("a.toml: ValueError('x')"), "failed"),
    (lambda: 1 / 0, "failed"),
    (warn, "failed"),
])  # fmt: skip
def test_the_judge_knows_a_clean_line(case, outcome):
    assert judge(case, "a.toml").outcome == outcome


@pytest.mark.parametrize("line", ["a.toml: \x1b[31m", "a.toml: two\nlines", "a.toml: " + "x" * 2000])
def test_the_judge_would_see_a_line_that_was_not_made_safe(line):
    error = UserError("")
    error.args = (line,)

    def case():
        raise error

    assert judge(case, "a.toml").outcome == "failed"


def test_an_endless_case_is_a_failure(monkeypatch, tmp_path):
    monkeypatch.setattr("tests.fuzz.judge.SECONDS", 0.2)
    os.mkfifo(tmp_path / "pipe")
    verdict = judge((tmp_path / "pipe").read_bytes, "a.toml")
    assert verdict.outcome == "failed"
    assert "0.2 s" in verdict.said
