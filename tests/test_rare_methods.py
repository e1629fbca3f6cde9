"""The methods behind `--rare`, on functions of normal numbers whose probabilities are known, and their intervals."""

import math
import re

import numpy as np
import pytest

from quadstep.numbers.noise import probability
from quadstep.report import units
from quadstep.studies.campaign.schema import Method
from quadstep.studies.rare.cross_entropy import LEAST, beyond, cross_entropy
from quadstep.studies.rare.mixture import FIRST, Points, Random
from quadstep.studies.rare.point_flyer import Failure
from quadstep.studies.rare.replicates import PieceKind, subset_simulation
from quadstep.studies.rare.run_folder import FinishedPiece, Nearest
from quadstep.studies.rare.summary import HOW, Crude, Estimate, crude_of, interval, sentences, summarise

METHODS = (subset_simulation, cross_entropy)


def failing(score, limit):
    """A score that is infinite beyond a limit."""

    def evaluate(points):
        values = score(points.latent)
        return np.where(values > limit, np.inf, values)

    return evaluate


def replicate(method, evaluate, random, size):
    """Of one kind of failure, and the flights that it took."""
    flown = []

    def counted(points):
        flown.append(len(points.noise))
        return evaluate(points)[None]

    (found,) = method(counted, 1, random, size)
    return found, sum(flown)


def mean(method, evaluate, dimensions, count=6, size=1000):
    """Of some replicates."""
    return float(np.mean([replicate(method, evaluate, Random(1, r, dimensions), size)[0].probability for r in range(count)]))


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("limit", [3.719, 4.753, 5.998])
def test_a_normal_tail_from_1e_4_to_1e_9(method, limit):
    found = mean(method, failing(lambda u: u.sum(axis=1) / math.sqrt(5.0), limit), 5)
    assert found == pytest.approx(probability(-limit), rel=0.6 if method is subset_simulation else 0.1)


@pytest.mark.parametrize("method", METHODS)
def test_two_sides_are_both_found(method):
    found = mean(method, failing(lambda u: np.abs(u[:, 0]), 4.417), 3)
    assert found == pytest.approx(2.0 * probability(-4.417), rel=0.4)


@pytest.mark.parametrize("dimensions", [2, 3, 6])
def test_failures_that_the_score_says_nothing_of_are_found_by_wide_flights(dimensions):
    """Half of the failures are at the other side of another number than the score's."""
    limit = 4.2

    def evaluate(points):
        x, y = points.latent[:, 0], points.latent[:, 1]
        return np.where((x > limit) | (y < -limit), np.inf, x)

    found = mean(cross_entropy, evaluate, dimensions)
    assert found == pytest.approx(2.0 * probability(-limit), rel=0.15)


@pytest.mark.parametrize("method", METHODS)
def test_kinds_of_failure_are_told_apart(method):
    """Each has its own score and its own probability, and the second is 2.5 times as rare."""

    def evaluate(points):
        first, second = points.latent[:, 0], points.latent[:, 1]
        return np.array([np.where(first > 3.719, np.inf, first), np.where(second < -3.944, np.inf, -second)])

    found = np.mean([[one.probability for one in method(evaluate, 2, Random(1, 2 * r, 3), 1000)] for r in range(6)], axis=0)
    assert found == pytest.approx([1e-4, 4e-5], rel=0.5 if method is subset_simulation else 0.1)


@pytest.mark.parametrize("method", METHODS)
def test_a_score_that_rises_only_near_failure_is_led_there_by_another_metric(method):
    """Failure need not be beyond a score: it belongs to every level whatever its score is."""
    found = mean(method, lambda points: np.where(points.latent[:, 0] > 4.265, np.inf, points.latent[:, :2].sum(axis=1)), 2)
    assert found == pytest.approx(1e-5, rel=0.6)


@pytest.mark.parametrize("method", METHODS)
def test_noise_of_its_own_counts_in_the_probability(method):
    """Failure by the sum of a drawn number and of noise that belongs to the flight's number: variance 1 + 0.25."""

    def evaluate(points):
        numbers = np.sort(np.unique(points.noise))
        noise = dict(zip(numbers.tolist(), (normal(number) for number in numbers.tolist()), strict=True))
        return failing(lambda u: u[:, 0] + 0.5 * np.array([noise[n] for n in points.noise.tolist()]), 4.158)(points)

    def normal(number):
        return float(np.random.default_rng(number).standard_normal())

    assert mean(method, evaluate, 1, count=4, size=600) == pytest.approx(1e-4, rel=0.5)


@pytest.mark.parametrize("method", METHODS)
def test_what_cannot_fail_is_given_up_below_1e_12(method):
    found, flown = replicate(method, lambda points: points.latent[:, 0], Random(1, 0, 2), 500)
    assert found.probability == 0.0
    assert [level.probability for level in found.levels if level.threshold is not None][-1] < 30.0 * LEAST
    assert flown <= 31 * 500


@pytest.mark.parametrize("method", METHODS)
def test_a_score_of_one_value_leads_nowhere_and_ends(method):
    found, flown = replicate(method, lambda points: np.zeros(len(points.noise)), Random(1, 0, 2), 200)
    first = 200 if method is subset_simulation else 400  # and as many wider ones
    assert (found.probability, flown, found.levels[1:]) == (0.0, first, ())


@pytest.mark.parametrize("method", METHODS)
def test_a_replicate_is_decided_by_its_seed_and_number(method):
    evaluate = failing(lambda u: u[:, 0], 4.0)
    (one, flown), (same, again), (other, _) = (replicate(method, evaluate, Random(seed, 3, 2), 300) for seed in (1, 1, 2))
    assert (one.probability, flown, one.levels) == (same.probability, again, same.levels)
    assert one.probability != other.probability


def test_points_are_numbered_beyond_the_flights_of_campaigns_and_standard_normal():
    random = Random(7, 2, 3)
    first, second = random.points(4000), random.points(10)
    assert first.noise[0] >= FIRST
    assert second.noise[0] == first.noise[-1] + 1
    assert np.abs(first.latent.mean(axis=0)).max() < 0.06
    assert np.abs(np.cov(first.latent.T) - np.eye(3)).max() < 0.08
    assert Random(7, 2, 200).points(5).latent.shape == (5, 200)


def test_a_threshold_keeps_equal_scores_together():
    assert beyond(np.arange(1000.0), 0.1) == 900.0
    assert beyond(np.array([0.0] * 850 + [1.0] * 150), 0.1) == 1.0


def test_plain_flights_that_look_for_several_kinds_of_failure_add_their_rates():
    one = piece(1e-3, crude_failures=2)
    (event,) = one.events
    both = one.model_copy(update={"events": [event.model_copy(update={"failure": kind}) for kind in ("a", "b")]})
    found = summarise([both, both]).crude
    assert (found.flights, found.failures) == (4 * event.crude, 8)
    assert found.rate.value == pytest.approx(2.0 * 2 / event.crude)
    share = f"4 of {2 * event.crude:,}"
    assert found.sentence.endswith(f": of flights drawn as in the campaign, {share} a and {share} others b")
    parts = "All failures found a. From"
    assert (
        "It is the sum of 0.00100 for flights that a and 0.00100 for flights that b. From"
        in sentences(summarise([both] * 3), Method.SUBSET)[0]
    )
    one = both.model_copy(update={"events": [both.events[0], both.events[1].model_copy(update={"probability": 0.0})]})
    assert parts in sentences(summarise([one] * 3), Method.SUBSET)[0]
    (early,) = crude_of([one.model_copy(update={"events": [event.model_copy(update={"failure": "ended early"})]})]).kinds
    assert early in HOW


def test_the_answer_is_first_and_a_doubtful_estimate_comes_second():
    """Of estimates from likely to rare: a plain campaign is named where it needs fewer flights, and only there."""
    seen = set()
    for value in (0.5, 0.2, 0.03, 0.005, 1e-4, 1e-6):
        found = summarise([piece(value * one) for one in (0.9, 1.0, 1.05, 1.1, 0.95)])._replace(warnings=())
        first = sentences(found, Method.SUBSET)[0]
        plain = found.one_by_one < found.flights
        assert ("A plain campaign needs fewer flights" in first) == plain
        assert first.startswith(f"A flight fails with probability {units.number(found.probability.value)}"), (
            "the answer is first"
        )
        doubtful = sentences(found._replace(one_by_one=None, warnings=("a",)), Method.SUBSET)
        assert doubtful[0].startswith(f"{found.crude.sentence[0].upper()}{found.crude.sentence[1:]}. The estimate, ")
        assert "is doubtful: see the warning. From" in doubtful[0]
        assert len(doubtful) == 1, "nothing is said twice"
        seen.add(plain)
    assert seen == {True, False}


@pytest.mark.parametrize(("count", "sigma"), [(10, 0.8), (5, 0.05), (5, 0.4)])
def test_the_interval_holds_the_mean_of_skewed_estimates(count, sigma):
    """Of a thousand sets of log-normal estimates; Student's on the raw numbers holds it less often."""
    random = np.random.default_rng(5)
    crude = Crude(1, 0, Estimate(0.0, 0.0, 1.0))
    sets = np.exp(sigma * random.standard_normal((1000, count)) - 0.5 * sigma**2)
    held = np.mean([low <= 1.0 <= high for _, low, high in (interval(one, crude) for one in sets)])
    assert 0.93 < held < 0.985


def test_intervals_of_replicates_hold_a_known_probability():
    evaluate = failing(lambda u: np.minimum(u[:, 0], u[:, 1]), 2.6)
    crude = Crude(1, 0, Estimate(0.0, 0.0, 1.0))
    held = 0
    for k in range(10):
        own = [replicate(cross_entropy, evaluate, Random(k, r, 2), 250)[0].probability for r in range(6)]
        _, low, high = interval(np.array(own), crude)
        held += low <= probability(-2.6) ** 2 <= high
    assert held >= 8


def piece(probability, kind=PieceKind.REPLICATE, crude_failures=0, again=None):
    """A finished piece of 10,000 flights, 1000 of them crude."""
    event = {"failure": "any", "score": ["s"], "crude": 1000, "crude_failures": crude_failures, "failures": 0, "levels": []}
    events = [{**event, "probability": probability}]
    return FinishedPiece(
        kind=kind.value, method=Method.SUBSET, probability=probability, flights=10_000, events=events, again=again
    )


REPLICATES = [piece(p) for p in (0.9e-5, 1.0e-5, 1.1e-5, 0.8e-5, 1.2e-5)]


def as_number(text):
    """A number as a sentence has it, also as 2.88 × 10⁻¹¹."""
    digits = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻−", "0123456789--")
    return float(text.translate(digits).replace(",", "").replace(" × 10", "e").replace("\N{NO-BREAK SPACE}× 10", "e"))


@pytest.mark.thorough
def test_what_is_said_of_a_known_probability_holds_as_often_as_it_says():
    """Of a hundred runs of a flight that fails where one number exceeds a limit, read off the printed sentences."""
    truth, held, plain, number = probability(-3.09), [], [], r"([0-9][0-9.,]*(?:\s×\s10[⁻⁰¹²³⁴-⁹]+)?)"
    for seed in range(100):
        pieces = []
        for place in range(5):
            one, flown = replicate(cross_entropy, failing(lambda u: u[:, 0], 3.09), Random(seed, 2 * place, 2), 200)
            own = piece(one.probability).model_copy(update={"flights": flown})
            change = {"crude": one.crude, "crude_failures": len(one.crude_failures.noise)}
            pieces.append(own.model_copy(update={"events": [own.events[0].model_copy(update=change)]}))
        first, *others = sentences(summarise(pieces), Method.CROSS_ENTROPY)
        value, count = map(as_number, re.search(rf"probability {number} \(about 1 flight in {number}\)", first).groups())
        low, high = map(as_number, re.search(rf"95 % confidence {number} to {number}, ", first).groups())
        assert low <= value <= high and value * count == pytest.approx(1.0, rel=0.06)
        held.append(low <= truth <= high)
        low, high = map(as_number, re.search(rf"between {number} and {number} with 99 % confidence", others[-1]).groups())
        plain.append(low <= truth <= high)
    assert (sum(held) >= 88, sum(plain) >= 97) == (True, True), (sum(held), sum(plain))


def test_nothing_is_said_against_replicates_that_agree():
    found = summarise([*REPLICATES, piece(3e-5, PieceKind.METHOD)])
    assert found.warnings == ()
    assert found.probability.value == pytest.approx(1e-5)
    assert found.flights == 60_000
    value, low, high = found.probability
    plain = math.sqrt(value * (1.0 - value) / found.one_by_one)  # the deviation of the share of so many flights that fail
    assert 2.0 * 1.96 * plain == pytest.approx(high - low)


@pytest.mark.parametrize(("done", "said"), [
    ([*REPLICATES, piece(0.0)], "1 of 6 replicates found no failure"),
    ([*REPLICATES, piece(1e-4)], "the largest is 12.5 times the smallest"),
    ([piece(p, crude_failures=3) for p in (1e-5, 1.1e-5, 0.9e-5)], "drawn as in the campaign, 9 of 3,000 failed."),
    ([piece(p) for p in (0.1, 0.11, 0.12)], "Plain Monte Carlo flights disagree: at most 0.18 % of flights fail"),
    ([*REPLICATES, piece(6e-5, PieceKind.SCORE)], "failures: 6e-05 (subset simulation, by s; one estimate, without interval)"),
    ([piece(1e-5, again={"flights": 50, "failures": 2})] * 5, "Chance decides here: 10 of 250 failed flights failed again"),
])  # fmt: skip
def test_it_warns_of_what_speaks_against_an_estimate(done, said):
    (warning,) = summarise(done).warnings
    assert said in warning


def test_second_opinions_of_one_kind_are_one_number_with_the_interval_of_as_many_replicates():
    some = 0.03, 0.06, 0.09
    found = summarise([*REPLICATES, *(piece(p, PieceKind.METHOD) for p in some)])
    alone = summarise([piece(p) for p in some]).probability
    assert found.opinions == {"subset simulation, by s": alone}
    assert alone.value == pytest.approx(0.06) and (alone.low < 0.03, alone.high > 0.09) == (True, True)
    ends = f"95 % interval {alone.low:.3g} to {alone.high:.3g}"
    assert f"finds more failures: 0.06 (subset simulation, by s; {ends}). The" in found.warnings[0]
    other = piece(2e-5, PieceKind.SCORE)
    other = other.model_copy(update={"events": [other.events[0].model_copy(update={"score": ["s", "v"]})]})
    both = summarise([*REPLICATES, piece(1e-5, PieceKind.METHOD), other, piece(1.1e-5, PieceKind.METHOD)])
    low, high = map(units.number, next(iter(both.opinions.values()))[1:])
    said = f"Second opinions by subset simulation, as a check: 1.05 × 10⁻⁵ by the same score (95 % interval {low} to {high}) "
    assert said + "and 2.00 × 10⁻⁵ by another." in sentences(both, Method.CROSS_ENTROPY)


def test_where_no_failure_is_found_the_interval_is_that_of_the_crude_flights():
    found = summarise([piece(0.0)] * 5)
    assert found.probability.value == found.probability.low == 0.0
    assert found.probability.high == pytest.approx(1.0 - 0.005 ** (1 / 5000), rel=1e-6)
    said, *others = sentences(found, Method.SUBSET)
    most = units.percent(found.probability.high)
    assert said.startswith(
        f"At most {most} of flights fail, with 99 % confidence: of flights drawn as in the campaign, none of"
    )
    assert " No replicate found a failure. " in said
    assert "probability 0" not in said and not others
    both = summarise(
        [
            *[piece(0.0)] * 5,
            piece(6e-9, PieceKind.METHOD),
            piece(7e-9, PieceKind.SCORE).model_copy(update={"method": Method.CROSS_ENTROPY}),
        ]
    )
    assert "A second opinion finds more failures: 7e-09" in both.warnings[1], "which no replicate did"
    assert len(both.warnings) == 2, "one is enough"


def test_intervals_by_the_values_of_a_choice_hold_what_is_known():
    """Where failures with one are 28 times as rare and elsewhere; and where no failure with it was found."""
    held, limits = [], (2.7, 1.3)

    def evaluate(points):
        first, second, choice = points.latent.T
        score = np.where(choice < 0.0, first - limits[0], -second - limits[1])
        return np.where(score > 0.0, np.inf, score)

    def found(one):
        parts = [[(some.latent[:, 2] < 0.0) == on for some in (one.failures, one.crude_failures)] for on in (True, False)]
        options = {
            name: (float(one.weights @ part), int(few.sum()), 0.5) for name, (part, few) in zip("ab", parts, strict=True)
        }
        made = piece(one.probability)
        return made.model_copy(update={"events": [made.events[0].model_copy(update={"options": options})]})

    for seed in range(100, 120):
        some = [found(replicate(cross_entropy, evaluate, Random(seed, 2 * place, 3), 250)[0]) for place in range(5)]
        summary = summarise(some)
        parts = summary.by_choice.values()
        assert sum(0.5 * one.value for one in parts) == pytest.approx(summary.probability.value)
        held += [low <= probability(-limit) <= high for limit, (_, low, high) in zip(limits, parts, strict=True)]
    assert sum(held) >= 36
    rare = [one.events[0].model_copy(update={"options": {"a": (0.0, 0, 0.5), "b": (0.1, 90, 0.5)}}) for one in some]
    rare = [one.model_copy(update={"probability": 0.1, "crude_failures": 90}) for one in rare]
    summary = summarise([piece(0.1).model_copy(update={"events": [one]}) for one in rare])
    most = 2.0 * (1.0 - 0.005 ** (1 / 5000))
    assert summary.by_choice["a"] == (0.0, 0.0, pytest.approx(most))
    assert (
        f"fails with probability at most {units.number(most)} with a and 0.200 with b (95 %"
        in sentences(summary, Method.SUBSET)[0]
    )


def test_each_kind_of_failure_has_its_own_most_likely_flight():
    def flown(*found, kind=PieceKind.REPLICATE):
        (event,) = (one := piece(1e-5, kind)).events
        near = [Nearest(failure=kind, deviations=away, values={}, deviations_by_key={}) for kind, away in found]
        events = [event.model_copy(update={"failure": each.failure, "nearest": each}) for each in near]
        return one.model_copy(update={"events": events})

    above, early, either = (one.value for one in (Failure.ABOVE, Failure.EARLY, Failure.ANY))
    pieces = [flown((above, 3.0), (early, 5.0)), flown((above, 2.0), (early, 6.0)), flown((either, 1.0), kind=PieceKind.SCORE)]
    assert [(one.failure, one.deviations) for one in summarise(pieces).nearest] == [(above, 2.0), (early, 5.0)]


def test_some_points_are_chosen_by_place():
    points = Points(np.arange(6.0).reshape(3, 2), np.arange(3))
    assert points.at(np.array([True, False, True])).noise.tolist() == [0, 2]


def test_what_a_failure_is_judged_by_is_said():
    found = summarise(REPLICATES)
    plain, early = (sentences(found, Method.CROSS_ENTROPY, meaning)[0] for meaning in ("", " (judged by ...)"))
    assert plain.startswith("A flight fails with probability ")
    assert early == f"{plain[:-1]} (judged by ...)."
