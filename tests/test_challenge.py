import math

from quadstep.io.results_folder import Folder
from tests.challenge import folders
from tests.challenge.search import Attempt, Search, attempted, coverage, searches, share


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


def test_the_search_of_folders_finds_a_run_that_follows_links(monkeypatch):
    def remove(self, name):
        (self.path / name).unlink(missing_ok=True)

    monkeypatch.setattr(Folder, "remove", remove)
    monkeypatch.setattr("quadstep.report.publish.names_in", list)
    assert attempted(folders.SEARCHES[0], 1, 20.0).failed


def test_the_search_of_changed_results_finds_a_run_that_checks_nothing(monkeypatch):
    monkeypatch.setattr("quadstep.io.parts.is_whole", lambda *_: True)
    assert attempted(folders.SEARCHES[1], 1, 20.0).failed


def test_all_time_is_shared_and_none_is_left_where_searches_took_more():
    assert [share(60.0, 2, waiting) for waiting in (6, 2, 1)] == [20.0, 60.0, 60.0]
    assert share(-5.0, 2, 3) == 0.0
