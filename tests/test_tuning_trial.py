"""A race: few flights for most candidates, all of them for those that would win, margins for whoever then does."""

import math

import numpy as np
import pytest

from quadstep.io.errors import UserError
from quadstep.mission.tune import Constraint
from quadstep.studies.tuning.objective import Judged, squashed
from quadstep.studies.tuning.trial import MarginGuess, Stability, TrialFlights, Tried, flights_of, looked_at, trial_flights

LIMITS = {"phase_margin": Constraint(least=0.5)}


def judged(objective, lost=0):
    return Judged(objective, {}, lost, 0.0, squashed(objective) + (2.0 + lost if lost else 0.0))


def generation(*objectives, whole=()):
    """Candidates with these objectives on the first flights, and on all flights."""
    return [Tried(judged(one), judged(whole[i]) if i < len(whole) else None) for i, one in enumerate(objectives)]


class Loops:
    """Margins of candidates by their only gain, and who was asked for."""

    def __init__(self, margins):
        self.known, self.asked = margins, []
        self.stability = Stability(LIMITS, self.margins)

    def margins(self, values):
        self.asked.append(values["k"])
        if self.known[values["k"]] is None:
            raise UserError("no rest")
        return {"phase_margin": self.known[values["k"]]}


def test_most_candidates_fly_a_quarter_of_the_flights_and_at_least_four():
    assert [trial_flights(seeds) for seeds in (1, 3, 4, 8, 16, 64)] == [1, 3, 4, 4, 4, 16]
    assert flights_of([16, 16, 1]) == TrialFlights(9, 33)
    assert TrialFlights(8, 32).most(10) == 10 * 8 + 3 * 24
    assert TrialFlights(1, 1).most(10) == 10


@pytest.mark.parametrize("margins", [{0.1: 0.25, 0.2: 0.5, 0.3: 0.9}, {0.1: None, 0.2: 0.5, 0.3: 0.9}])
def test_margins_are_looked_at_from_the_cheapest_on_until_one_keeps_them(margins):
    loops = Loops(margins)
    tried = generation(0.3, 0.1, 0.2, 0.7, whole=(0.3, 0.1, 0.2))
    found = looked_at(tried, [{"k": k} for k in (0.3, 0.1, 0.2, 0.7)], loops.stability, 0.9)
    assert loops.asked == [0.1, 0.2]  # 0.3 costs more than 0.2, which keeps its margins
    assert min((one for one in found if one.whole), key=lambda one: one.judged.cost).judged.objective == 0.2
    assert not found[1].judged.feasible
    assert 1.0 < found[1].judged.cost < judged(0.1, lost=1).cost
    assert found[1].cost > 1.0
    assert found[3] == tried[3]


def test_what_would_not_be_the_best_on_all_flights_is_not_linearised():
    loops = Loops({})
    tried = generation(0.1, whole=(0.8,))
    assert looked_at(tried, [{"k": 0.1}], loops.stability, judged(0.5).cost) == tried
    assert not loops.asked


def test_margins_are_guessed_from_those_looked_at():
    """Of margins that are linear in the point the guess is near; within the doubt nothing is believed to be missed."""

    def margin(point):
        return 0.5 + 1.0 * point[0] - 0.5 * point[1]

    def looked(point):
        return Tried(judged(0.1), judged(0.1)._replace(parts={"phase_margin": margin(point)}))

    guess, random = MarginGuess(LIMITS), np.random.default_rng(1)
    assert guess.missed([[0.5, 0.5]], [0.5, 0.5]) == [0.0]
    for point in random.uniform(0.0, 0.4, (12, 2)).tolist():
        guess.learn(point, looked(point))
        guess.learn(point, Tried(judged(0.1)))
        guess.learn(point, Tried(judged(0.1), judged(0.1)._replace(parts={"phase_margin": math.nan})))
    assert len(guess.points) == 12
    points = random.uniform(0.0, 0.4, (20, 2)).tolist()
    truth = [max(0.0, 1.0 - margin(point) / 0.5 - 0.02) for point in points]
    assert min(truth) == 0.0 < max(truth)
    assert guess.missed(points, [0.2, 0.2]) == pytest.approx(truth, abs=0.02)


def test_a_guess_is_what_the_search_is_told_and_not_what_decides():
    thought = Tried(judged(0.1), judged(0.1), 0.3)
    assert thought.cost > 1.0
    loops = Loops({0.1: 0.9})
    (found,) = looked_at([thought], [{"k": 0.1}], loops.stability, 0.9)
    assert found.judged.feasible
    assert found.cost == judged(0.1).cost


def test_a_loop_without_margins_misses_all_of_them_unless_it_must_have_some():
    loops = Loops({0.1: None})
    tried = Tried(judged(0.1), judged(0.1))
    assert loops.stability.sought(tried, {"k": 0.1}).missed == math.inf
    assert loops.stability.sought(tried, {"k": 0.1}).judged.cost == pytest.approx(judged(0.1).cost + 2.0)
    with pytest.raises(UserError, match="no rest"):
        loops.stability.with_margins(tried, {"k": 0.1})


def test_lost_flights_come_before_margins():
    loops = Loops({})
    tried = Tried(judged(0.1, lost=1), judged(0.1, lost=1))
    assert looked_at([tried], [{"k": 0.1}], loops.stability, 9.0) == [tried]
    assert not loops.asked
    assert Tried(judged(0.1, lost=1)).cost > Tried(judged(0.1), missed=5.0).cost
