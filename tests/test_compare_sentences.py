"""What a comparison says of flights that were made up, against those flights."""

import re
from itertools import islice

import numpy as np
import pytest

from quadstep.studies.comparison.answer import answer, decisions
from quadstep.studies.comparison.cells import Situation
from quadstep.studies.comparison.entrants import Comparison, ranks, result
from tests.challenge.decisions import METRIC, METRICS, flown, lopsided

WHERE = Situation("", "", "calm")


def test_no_sentence_of_200_random_comparisons_contradicts_their_flights_and_pairs():
    assert not [one.case for one in islice(lopsided(31), 200) if one.contradicts]


def compared(**errors):
    """A situation of controllers with these errors."""
    own = {name: flown(np.array(one), np.zeros(len(one), bool)) for name, one in errors.items()}
    ranked, flights = ranks({WHERE: own}, METRIC), len(next(iter(own.values())).lost)
    return Comparison("", "", flights, 1, METRICS, tuple(result(WHERE, *one, METRICS, None) for one in own.items()), ranked)


@pytest.mark.parametrize("seed", range(5))
def test_a_tie_says_that_its_flights_do_not_tell_two_apart(seed):
    random = np.random.default_rng(seed)
    gusts = np.exp(0.2 * random.normal(size=200))
    one, other = gusts, gusts + 0.05 * random.normal(0.05, 1.0, size=200)
    said = answer(found := compared(a=one, b=other))
    assert "are tied for best by position RMSE: 200 flights do not tell them apart" in said
    assert decisions(found)[0][-1] in said


def test_a_tie_never_names_the_smaller_median_the_better():
    """That of `b` is smaller by 0.02 %, and `a` wins more pairs."""
    random = np.random.default_rng(1)
    gusts = np.exp(random.normal(size=60))
    said = answer(compared(a=gusts, b=gusts * (1.0 + 0.05 * random.normal(size=60)), c=3.0 * gusts))
    assert re.match(r"(a and b|b and a) are tied for best by position RMSE: 60 flights do not tell them apart", said)
