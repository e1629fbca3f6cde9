"""`quadstep campaign --until`: looks with jointly valid intervals, the output, and resumed runs."""

import json
import re
from itertools import islice

import numpy as np
import pytest
from scipy.stats import binom

from quadstep.io.errors import UserError
from quadstep.metrics.statistics import exact_share, ordered_quantile
from quadstep.studies.campaign.run import Look, looks, parsed
from tests.campaigns import MASS, SHORT, fly, manifest, no_report, refused, rows, written
from tests.commands import quadstep


@pytest.mark.parametrize("target", [0.3, 1e-2, 1e-4])
def test_a_look_is_at_the_fewest_flights_that_can_show_the_target(target):
    for look in islice(looks(target), 5):
        assert exact_share(look.failures, look.flights, look.tail).high <= target * (1.0 + 1e-9)
        assert binom.cdf(look.failures, look.flights - 1, target) > look.tail
        assert binom.cdf(look.failures, look.flights, target) <= look.tail


def test_the_looks_together_spend_no_more_than_one_interval_may():
    assert next(looks(1e-4)) == Look(43819, 0, pytest.approx(0.0125))
    assert sum(look.tail for look in islice(looks(1e-2), 20)) <= 0.025


@pytest.mark.parametrize(("probability", "wrong"), [(0.1, "below"), (0.0999999, "above")])
def test_what_is_shown_is_wrong_in_less_than_one_run_in_forty(probability, wrong):
    """At the target itself, where it is hardest; six looks, exactly: the chance of each number of failures that goes on."""
    chance, before, going_on = 0.0, 0, np.array([1.0])
    for look in islice(looks(0.1), 6):
        more = binom.pmf(np.arange(look.flights - before + 1), look.flights - before, probability)
        going_on, before = np.convolve(going_on, more), look.flights
        for failures in np.flatnonzero(going_on > 1e-12):
            rate = exact_share(int(failures), look.flights, look.tail)
            if rate.high <= 0.1 or rate.low >= 0.1:
                chance += going_on[failures] * ((rate.high <= 0.1) == (wrong == "below"))
                going_on[failures] = 0.0
    assert 0.005 < chance < 0.025


def test_it_stops_as_soon_as_the_probability_is_known_to_be_below(tmp_path):
    path, out = written(tmp_path, MASS), tmp_path / "out"
    run = fly(path, out, "--until", "0.05", "--json")
    told = json.loads(run.out)
    first = next(looks(0.05)).flights
    assert (run.code, told["until"]["decision"], told["flights"]) == (0, "below", first)
    assert [one["failures"] for one in told["until"]["looks"]] == [0]
    with no_report():
        more = quadstep("campaign", path, "--out", out, "--resume", "--until", "0.02")
    assert more.code == 0
    assert re.search(r"Shown: fewer than 0.02 of the flights fail. 0 of \d+ flights failed: a probability ", more.out)
    assert "Success means reaching the end, however large the error." in more.out
    summary = manifest(out)["summary"]
    look = next(looks(0.02))
    low = 1.0 - exact_share(0, look.flights, look.tail).high
    assert summary["success"]["low"] == pytest.approx(low), "as looks have it, not as flights of a fixed number"
    assert rows(out).num_rows == manifest(out)["flights"] == next(looks(0.02)).flights


def test_it_ends_where_the_probability_is_above_and_says_what_to_do(tmp_path):
    head = "[failure]\nlargest_error = 1e-9\n"
    path = written(tmp_path, MASS)
    path.write_text(path.read_text() + head)
    run = fly(path, tmp_path / "out", "--until", "0.5")
    assert run.code == 4
    assert "Not met: 0.5 of the flights or more fail." in run.out
    assert " flights failed: a probability from " in run.out and "Limit: largest error 1e-09 m." in run.out
    assert "with 95 % confidence: shown not to be so; the probability is from " in " ".join((run.out + run.err).split())
    assert "Next: the report shows" in run.out


def test_undecided_it_says_the_command_that_goes_on(tmp_path):
    """A quarter of the flights begins too far off; the target is a little above."""
    vary = 'start.position.0 = { type = "uniform", low = 0.0, high = 1.0 }\n[failure]\nlargest_error = 0.75\n'
    path = written(tmp_path, vary, SHORT)
    run = fly(path, tmp_path / "out", "--until", "0.3", "--flights", "40")
    assert run.code == 4
    assert "Not decided." in run.out
    assert "Next:" in run.out
    told, flown = manifest(tmp_path / "out")["summary"], rows(tmp_path / "out")
    look = [one for one in islice(looks(0.3), 9) if one.flights <= 40][-1]
    assert flown.num_rows == look.flights
    above = ordered_quantile(flown["position_rmse[m]"].to_numpy(), 0.5, look.tail)
    half = told["quantiles"]["position_rmse[m]"]["0.5"]
    assert (half["low"], half["high"]) == pytest.approx((above.low, above.high))
    assert half["high"] > ordered_quantile(flown["position_rmse[m]"].to_numpy(), 0.5).high, "of all looks, and so wider"
    refused(fly(path, tmp_path / "new", "--until", "0.3", "--flights", "5"), "--flights 5: --until needs at least 13")


@pytest.mark.parametrize("text", ["0", "1", "-0.1", "nan", "often", "1e-12"])
def test_no_probability_that_can_be_shown(text):
    with pytest.raises(UserError, match="--until"):
        parsed(text)


@pytest.mark.parametrize(("kind", "said"), [
    ('"grid", values = [1.0, 1.1]', "--until: its flights are points of a grid, without noise, and say nothing about others"),
    ('"sobol", low = 0.9, high = 1.1', "vary.vehicle.mass: --until counts independent flights"),
])  # fmt: skip
def test_flights_that_are_not_drawn_are_refused(tmp_path, kind, said):
    path = written(tmp_path, f"vehicle.mass = {{ type = {kind} }}\n")
    refused(fly(path, tmp_path / "out", "--until", "0.1"), said)
