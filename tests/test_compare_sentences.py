"""What a comparison says of flights that were made up, against those flights."""

import re
from itertools import islice

import numpy as np
import pytest

from quadstep.studies.comparison.answer import MOST_FLIGHTS, of_situation
from quadstep.studies.comparison.cells import Situation
from quadstep.studies.comparison.entrants import Comparison, ranks, result
from quadstep.studies.comparison.ranking import ALPHA, flights_to_decide, pair, signed_ranks
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
def test_a_tie_is_decided_by_about_as_many_flights_as_it_says_if_differences_stay_as_they_are(seed):
    random = np.random.default_rng(seed)
    gusts = np.exp(0.2 * random.normal(size=200))
    one, other = gusts, gusts + 0.05 * random.normal(0.05, 1.0, size=200)
    said = of_situation(compared(a=one, b=other), WHERE)
    assert "are tied for best: 200 flights do not tell them apart (a less b: " in said
    wanted = flights_to_decide(pair("a", "b", *(flown(x, np.zeros(200, bool)) for x in (one, other)), METRIC), 1)
    said_count = re.search(r"about ([\d,]+) would", said)
    assert said_count is None or int(said_count[1].replace(",", "")) == wanted
    assert said_count or wanted > MOST_FLIGHTS or wanted <= 200
    if 400 < wanted <= MOST_FLIGHTS:
        decided = [signed_ranks(random.choice(one - other, min(wanted, 20_000))) < ALPHA for _ in range(60)]
        assert wanted > 20_000 or 0.65 < np.mean(decided) < 0.95


def test_a_tie_never_names_the_smaller_median_the_better():
    """That of `b` is smaller by 0.02 %, and `a` wins more pairs."""
    random = np.random.default_rng(1)
    gusts = np.exp(random.normal(size=60))
    said = of_situation(compared(a=gusts, b=gusts * (1.0 + 0.05 * random.normal(size=60)), c=3.0 * gusts), WHERE)
    assert re.match(
        r"(a|b) \(median position RMSE [\d.]+ m\) and (a|b) \([\d.]+ m\) are tied for best: 60 flights do not", said
    )
    assert "c" not in re.findall(r"\b[abc]\b", said) and "smallest" not in said


def test_those_who_are_tied_by_one_metric_are_not_said_to_be_alike_where_another_tells_them_apart():
    random = np.random.default_rng(4)
    errors, metrics = np.exp(0.2 * random.normal(size=60)), {**METRICS, "largest_error": "largest_error[m]"}

    def said(factor):
        own = {
            name: flown(errors, np.zeros(60, bool))._replace(
                metrics={METRIC: errors + 0.1 * random.normal(size=60), "largest_error": largest}
            )
            for name, largest in (("a", factor * errors), ("b", errors))
        }
        ranked = ranks({WHERE: own}, METRIC)
        cells = tuple(result(WHERE, *one, metrics, None) for one in own.items())
        return of_situation(Comparison("", "", 60, 1, metrics, cells, ranked), WHERE)

    differ = r"tied for best: their medians of largest error differ, \d+ mm \(a\) and [\d,]+ mm \(b\); 60 flights do not tell"
    assert re.search(differ, said(0.6))
    assert "tied" in said(1.0) and "differ, " not in said(1.0)
