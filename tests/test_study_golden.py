"""The study gives the committed numbers to the bit. If a change is meant to move them: `make golden`, and look at the diff."""

import json

import pytest

from tests import golden

COMMITTED = json.loads(golden.FILE.read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def fresh():
    return golden.summary(golden.study())


def test_the_study_is_of_the_same_flights_and_numbers(fresh):
    assert list(fresh["flights"]) == list(COMMITTED["flights"])
    assert fresh["columns"] == COMMITTED["columns"]


@pytest.mark.parametrize("name", COMMITTED["flights"])
def test_a_flight_gives_the_committed_numbers(fresh, name):
    pairs = zip(COMMITTED["columns"], fresh["flights"][name], COMMITTED["flights"][name], strict=True)
    assert [(column, now, committed) for column, now, committed in pairs if now != committed] == []


def test_the_verdicts_are_the_committed_ones(fresh):
    assert fresh["verdicts"] == COMMITTED["verdicts"]


def test_the_committed_file_is_as_golden_writes_it():
    assert golden.FILE.read_text(encoding="utf-8") == golden.text(COMMITTED)
    assert len(COMMITTED["flights"]) > 100
    assert golden.FILE.stat().st_size < 200_000
