"""The summary of a campaign: every number of a small table by hand."""

import json

import numpy as np
import pyarrow as pa
import pytest
from scipy.stats import binomtest

from quadstep.metrics.statistics import exact_share, share
from quadstep.studies.campaign.flyer import FLIGHT, OUTCOME, OUTCOMES, SUCCESS, TIME
from quadstep.studies.campaign.report_text import facts, outcome_of, outcomes, percent
from quadstep.studies.campaign.summary import FEW, LARGEST, RESULTS, RMSE, answer, as_json, sentences, summarise


class Made:
    """A store with a table in it. Each row: outcome, time, RMSE, largest error, success."""

    def __init__(self, rows, kind=None, chunks=1, first=0):
        outcomes, times, errors, largest, success = zip(*rows, strict=True)
        kind = kind or pa.float64()
        table = pa.table(
            {
                FLIGHT: pa.array(range(first, first + len(rows)), pa.int64()),
                OUTCOME: pa.DictionaryArray.from_arrays(pa.array([OUTCOMES.index(o) for o in outcomes], pa.int8()), OUTCOMES),
                TIME: pa.array(times, pa.float64()),
                RMSE: pa.array(errors, kind),
                LARGEST: pa.array(largest, kind),
                SUCCESS: pa.array(success),
            }
        )
        size = -(-len(rows) // chunks)
        self.table = pa.concat_tables([table.slice(i, size) for i in range(0, len(rows), size)]).unify_dictionaries()

        self.manifest = {"metrics": [RMSE, LARGEST]}

    def read(self, columns):
        return self.table.select(columns)


def summarised(store, **more):
    return summarise(store, store.read(RESULTS), **more)


def through(error, largest=None, success=True):
    return ("completed", None, error, largest if largest is not None else 2.0 * error, success)


def lost(time, error=None, largest=None, outcome="off-path"):
    return (outcome, time, error, largest, False)


TABLE = [
    through(0.1),  # 0
    lost(2.0, 0.5, 1.0),
    through(0.2, 9.0, False),
    lost(1.0, 0.4, 3.0, "spinning"),
    through(0.3, 5.0),
    lost(1.0, 0.4, 4.0),  # 5
    lost(0.0),
    through(0.4, 5.0),
    lost(0.0, None, None, "not-finite"),
    through(0.5, 0.6),
]


def test_shares_outcomes_and_quantiles_by_hand():
    found = summarised(Made(TABLE))
    exact = binomtest(4, 10).proportion_ci(0.95, "exact")
    assert found.flights == 10
    assert tuple(found.success) == pytest.approx((0.4, exact.low, exact.high), rel=1e-9)
    assert found.outcomes == {"completed": 5, "off-path": 3, "spinning": 1, "not-finite": 1}
    rmse, largest = found.spreads
    assert (rmse.metric, rmse.flights, list(rmse.quantiles)) == (RMSE, 5, [0.5])
    assert rmse.quantiles[0.5].value == pytest.approx(0.3)
    assert (largest.metric, largest.quantiles[0.5].value) == (LARGEST, 5.0)
    assert not rmse.quantiles[0.5].bounded


def test_the_worst_are_those_that_ended_first_then_those_farthest_off_then_the_lower_number():
    assert [one.flight for one in summarised(Made(TABLE)).worst] == [6, 8, 5, 3, 2]
    some = [through(0.1, 5.0), through(0.3, 5.0), lost(3.0, 0.1, 0.2), through(0.1, 7.0), through(0.0, 0.0), through(0.2, 5.0)]
    worst = summarised(Made(some)).worst
    assert [one.flight for one in worst] == [2, 3, 0, 1, 5]
    assert [one.time for one in worst] == [3.0, None, None, None, None]
    assert worst[0]._asdict() == {
        "flight": 2,
        "outcome": "off-path",
        "time": 3.0,
        "rmse": 0.1,
        "largest": 0.2,
        "success": False,
    }


@pytest.mark.parametrize("chunks", [1, 3, 10])
@pytest.mark.parametrize("kind", [pa.float64(), pa.float32()])
def test_it_makes_no_difference_in_how_many_files_flights_are(chunks, kind):
    one, all_of = summarised(Made(TABLE, kind, chunks)), summarised(Made(TABLE, kind))
    assert one == all_of


def test_worst_flights_that_tie_are_those_of_the_lowest_numbers_in_any_table():
    rng = np.random.default_rng(2)
    for _ in range(20):
        rows = [through(0.1, float(rng.integers(3))) if rng.random() < 0.8 else lost(float(rng.integers(2)), 0.1, 1.0)
                for _ in range(200)]  # fmt: skip
        wanted = sorted(range(200), key=lambda i: (rows[i][1] is None, rows[i][1] or 0.0, -rows[i][3], i))[:5]
        assert [one.flight for one in summarised(Made(rows, chunks=7)).worst] == wanted


def test_without_limits_it_says_how_many_reach_the_end_and_what_the_graded_ones_lack():
    found = summarised(Made([through(0.1), lost(1.0), through(0.2)]))._replace(limited=False)
    for lacking, said in (
        ({}, ". No flight that reaches the end is graded. "),
        ({0: (), 2: ()}, ". All of the 2 that reach the end are as commanded. "),
        (
            {2: ("shaking",)},
            "; the only one of the graded flights that reaches the end is not as commanded. Shaking; the other is ",
        ),
        ({0: (), 2: ("shaking",)}, ". 1 of the 2 that reach the end is not as commanded: shaking in 1. "),
        ({0: ("shaking",), 2: ("shaking",)}, "; none of the 2 is as commanded. Shaking in 2. "),
    ):
        text = f"{answer(found._replace(lacking=lacking, meaning=' (success means this)'))} "
        assert text.startswith(f"66.7 % of 3 flights reached the end (95 % interval 9.4 % to 99.16 %){said}"), text
    by = found._replace(lacking={0: ("shaking",), 2: ()}, by="100 % of 2 flights reached the end with a, 0 % of 1 with b.")
    assert answer(by) == (
        "100 % of 2 flights reached the end with a, 0 % of 1 with b. 1 of the 2 that reach the end is not as commanded: "
        "shaking in 1."
    )
    ends = [outcome_of(one, found._replace(lacking={0: (), 2: ("shaking",)})) for one in found.worst]
    assert ends == ["lost: off-path", "completed, not as commanded", "completed, as commanded"]
    assert outcomes(found)[0][0] == "completed"
    told = as_json(found._replace(lacking={0: (), 2: ("shaking",)}))
    assert told["graded"] == {"flights": 2, "not as commanded": 1, "lacks": {"shaking": 1}}
    assert [one["lacks"] for one in told["worst"]] == [None, ("shaking",), ()]


def test_flights_that_failed_come_before_those_that_went_farther_and_succeeded():
    some = [through(0.1, 9.0), through(0.2, 1.0, False), through(0.1, 8.0), lost(3.0, 0.1, 0.2), through(0.2, 2.0, False)]
    assert [one.flight for one in summarised(Made(some)).worst] == [3, 4, 1, 0, 2]
    many = [*some, *(lost(1.0, 0.1, 0.2) for _ in range(9))]
    assert [one.flight for one in summarised(Made(many)).worst] == [5, 6, 7, 4, 1], "lost ones do not hide those above a limit"


def test_fewer_flights_than_worst():
    assert [one.flight for one in summarised(Made(TABLE[:2])).worst] == [1, 0]


def test_all_lost():
    found = summarised(Made([lost(0.0), lost(1.0)]))
    assert found.success.value == 0.0
    assert found.success.low == 0.0
    assert found.success.high == pytest.approx(1 - 0.025**0.5, rel=1e-9)
    assert found.spreads == []
    assert "nan" not in " ".join(sentences(found)).lower()


def test_all_good_and_only_one():
    found = summarised(Made([through(0.1)]))
    assert tuple(found.success) == pytest.approx((1.0, 0.025, 1.0))
    assert found.spreads[0].quantiles[0.5].value == 0.1
    assert sentences(found)[0] == answer(found)
    assert [one.what for one in facts(found)] == ["position RMSE", "largest error"], "one flight has no median"
    assert facts(found, "nets on", " from 5 s on")[0].what == "position RMSE from 5 s on, nets on"
    alone = "The only flight succeeded. It is a single flight, which gives no success rate."
    assert [answer(found), answer(found._replace(decision="Shown."))] == [alone, f"Shown. {alone}"]
    late = found._replace(flights=2, meaning=" (limit: largest error 0.3 m; the first 9.9 s are not counted)")
    assert answer(late).startswith("All 2 flights succeeded (95 % interval ")
    assert answer(late).endswith(" %). Limit: largest error 0.3 m; the first 9.9 s are not counted.")
    assert answer(late._replace(decision="Not met: ...")).startswith("Not met: ... All 2 flights succeeded (95 %")


def test_quantiles_are_given_where_enough_flights_are_beyond_them():
    def given(count):
        return list(summarised(Made([through(float(i + 1)) for i in range(count)])).spreads[0].quantiles)

    assert given(20) == [0.5]
    assert given(199) == [0.5]
    assert given(200) == [0.5, 0.9]
    assert given(1999) == [0.5, 0.9]
    assert given(2000) == [0.5, 0.9, 0.99]
    assert given(20_000) == [0.5, 0.9, 0.99, 0.999]


def test_quantiles_and_their_intervals_between_order_statistics():
    count = 2000
    order = np.random.default_rng(3).permutation(count)
    spread = summarised(Made([through(float(i)) for i in order])).spreads[0]
    for q, estimate in spread.quantiles.items():
        assert estimate.value == pytest.approx(q * (count - 1))
        reach = 1.96 * np.sqrt(count * q * (1 - q))
        assert estimate.low == pytest.approx(count * q - reach, abs=2.0)
        assert estimate.high == pytest.approx(count * q + reach, abs=2.0)


def test_a_number_that_is_none_reaches_no_statistic():
    rows = [through(float(i + 1)) for i in range(10)]
    ill = [*rows, ("completed", None, float("nan"), float("inf"), False), ("completed", None, None, None, False)]
    well, found = summarised(Made(rows)), summarised(Made(ill))
    assert [(spread.flights, spread.quantiles) for spread in found.spreads] == [
        (spread.flights, spread.quantiles) for spread in well.spreads
    ]
    assert found.success.value == pytest.approx(10 / 12)


def test_every_interval_of_flights_whose_number_chance_decided_is_that_of_all_looks():
    found = summarised(Made(TABLE), tail=0.005)
    assert found.success == exact_share(4, 10, 0.005)
    shares = {row[0]: row[2] for row in outcomes(found)}
    assert shares["lost: off-path"] == percent(exact_share(3, 10, 0.005))
    assert shares["lost: off-path"] != percent(exact_share(3, 10, 0.025))


def test_the_words_have_the_numbers():
    text = "\n".join(sentences(summarised(Made(TABLE))))
    exact = binomtest(4, 10).proportion_ci(0.95, "exact")
    assert f"40 % of 10 flights succeeded (95 % interval {100 * exact.low:.1f} % to {100 * exact.high:.1f} %)." in text
    assert "1 not-finite, 3 off-path, 1 spinning" in text
    assert "Position RMSE of the 5 completed flights: 50 % below 300" in text


@pytest.mark.parametrize("count", [1, 5, 6])
def test_a_median_of_fewer_than_six_flights_has_no_interval(count):
    found = summarised(Made([through(float(i + 1)) for i in range(count)]), varied=True)
    median = found.spreads[0].quantiles[0.5]
    text = "\n".join(sentences(found))
    ends = as_json(found)["quantiles"][RMSE]["0.5"]
    if count == 6:
        assert (median.low, median.high) == (1.0, 6.0)  # that half a chance falls six times on one side: 2/64 < 5 %
        assert "6 completed flights: 50 % below 3.50 m" in text
    else:
        assert np.isnan([median.low, median.high]).all()
        assert (ends["low"], ends["high"]) == (None, None)
        assert ("of the completed flight: 1.00 m." if count == 1 else "50 % below 3.00 m.") in text
        assert count == 1 or facts(found)[0].more == FEW


def test_rates_near_one_are_not_rounded_to_it():
    summary = summarised(Made([through(0.1), lost(1.0, 0.1, 0.1)]))
    text = sentences(summary._replace(flights=10**7, success=share(10**7 - 3, 10**7)))[0]
    assert "99.99997" in text
    assert "100 %" not in text


def test_the_manifest_has_the_same_numbers():
    found = summarised(Made(TABLE))
    written = json.loads(json.dumps(as_json(found), allow_nan=False))
    assert written["success"] == found.success._asdict()
    assert written["outcomes"] == found.outcomes
    assert written["quantiles"][RMSE]["0.5"]["value"] == found.spreads[0].quantiles[0.5].value
    assert [one["flight"] for one in written["worst"]] == [6, 8, 5, 3, 2]


@pytest.mark.parametrize("chunks", [1, 2])
@pytest.mark.parametrize("one", [through(0.1), through(0.1, success=False), lost(2.0, 0.5, 1.0), lost(0.0)])
def test_flights_that_do_not_differ_are_said_to_be_copies(one, chunks):
    said = "Its 3 flights do not differ, so there are no statistics."
    found = summarised(Made([one] * 3, chunks=chunks))
    assert said in sentences(found)[0]
    assert "95 %" not in " ".join(sentences(found))
    assert "[" not in " ".join(sentences(found))
    assert as_json(found)["copies"]
    for other in (through(0.2), lost(1.0, 0.5, 1.0)):
        assert not summarised(Made([one, one, other], chunks=chunks)).copies
    assert not summarised(Made([one])).copies
    known = one[2] is not None
    assert summarised(Made([one] * 3), varied=True).copies == known  # lost at once, they may differ nonetheless
