import math

from tests.challenge.search import Attempt, Search, attempted, coverage, searches


def search(*reached: float) -> Search:
    return Search(
        "planted", "nothing is above 1", lambda seed: [Attempt(each, f"{each} with seed {seed}") for each in reached]
    )


def test_a_planted_contradiction_is_found_and_ends_the_search():
    found = attempted(search(0.2, 1.5, 0.3), 7, 10.0)
    assert found.failed
    assert (found.tried, found.nearest) == (2, Attempt(1.5, "1.5 with seed 7"))


def test_a_nan_contradicts_and_the_nearest_of_kept_promises_is_told():
    assert attempted(search(0.2, math.nan), 0, 10.0).nearest.contradicts
    kept = attempted(search(0.2, 0.9, 0.3), 0, 10.0)
    assert not kept.failed
    assert kept.nearest.reached == 0.9


def test_a_search_that_fails_or_tries_nothing_is_a_failure():
    def broken(seed: int):
        yield Attempt(0.1, "first")
        raise RuntimeError("broken")

    assert "broken" in attempted(Search("broken", "", broken), 0, 10.0).error
    assert attempted(search(), 0, 10.0).failed


def test_coverage_tells_intervals_that_miss_too_often():
    assert not any(each.contradicts for each in coverage([True] * 19 * 200 + [False] * 200))
    assert any(each.contradicts for each in coverage([True, True, True, False] * 500))


def test_names_are_unique_and_each_search_says_what_it_attacks():
    assert all(each.verdict for each in searches().values())
