"""The search through the flights: it finds what a grid finds, within the budget, the same for the same seed."""

import math
import re

import numpy as np
import pytest
from matplotlib.figure import Figure

from quadstep import Mission, fly, read_mission
from quadstep.linear.grade import margin_metrics
from quadstep.mission.check import check
from quadstep.mission.read import plan_mission
from quadstep.mission.tune import Constraint
from quadstep.report.progress import SILENT
from quadstep.studies.campaign.draws import DrawnColumn
from quadstep.studies.campaign.flyer import Flyer
from quadstep.studies.campaign.schema import CampaignFile, campaign_of
from quadstep.studies.tuning import run, search
from quadstep.studies.tuning.convergence import draw_objective, led
from quadstep.studies.tuning.ground import UNSEEN, CandidateFlyer, read_request, required_margins, sound
from quadstep.studies.tuning.objective import Judge
from quadstep.studies.tuning.search import Search, population
from tests.commands import Listener, metrics
from tests.tuning import LAMBDA, PAPER, SOFT, WINDY, ground, history, tuned, written

pytestmark = pytest.mark.usefixtures("undrawn")

FREE = "theorem = false\nobjective = { position_rmse = 1.0, variation_torque_2 = 2e-4 }\n"
TWO = f"""
[tune]
{FREE}constraints = {{}}
[tune.gains]
controller.Lambda1 = {{ low = 0.3, high = 30.0 }}
controller.K_r1 = {{ low = 0.5, high = 50.0 }}
"""

ONE_LOOP = "[simulation]\nguidance_period = 0.002\n"
"""A period of one sample, over which a loop is linearised five times as soon as over ten milliseconds."""

SMALL = (
    WINDY.partition("[controller]")[0].replace("research-2.6kg", "crazyflie")
    + """[controller]
type = "pid"
[wind]
mean = [2.0, 0.0, 0.0]
"""
    + ONE_LOOP
    + """[tune]
{more}
[tune.gains]
controller.velocity = {{}}
controller.attitude = {{}}
controller.rate = {{}}
"""
)


def best_of_grid(there, per_axis):
    """The least objective on a grid over the ranges, and where."""
    axes = np.linspace(0.0, 1.0, per_axis)
    points = [
        list(one)
        for one in np.stack(np.meshgrid(*[axes] * len(there.asked.gains)), axis=-1).reshape(-1, len(there.asked.gains))
    ]
    flown = there.fly([there.asked.numbers(point) for point in points], 0, there.asked.seeds)
    judge = Judge(there.asked.section, there.duration)
    costs = [judge.judge(one).cost for one in flown]
    return min(costs), points[int(np.argmin(costs))], judge


def test_one_gain_ends_up_where_a_fine_grid_has_its_optimum(tmp_path):
    there = ground(tmp_path, PAPER + LAMBDA.replace("[tune]\n", f"[tune]\n{FREE}"))
    least, point, judge = best_of_grid(there, 401)
    assert 0.05 < point[0] < 0.95
    found = Search([there], 1200, 1, SILENT).run()
    assert found.best.point == pytest.approx(point, abs=0.01)
    assert judge.judge(there.fly([found.best.values], 0, 1)[0]).cost <= least + 1e-6


def test_two_gains_are_better_than_the_best_of_a_grid(tmp_path):
    there = ground(tmp_path, PAPER + TWO)
    least, point, judge = best_of_grid(there, 41)
    found = Search([there], 2500, 2, SILENT).run()
    assert judge.judge(there.fly([found.best.values], 0, 1)[0]).cost <= least + 1e-6
    assert math.dist(found.best.point, point) < 0.1
    runs = {one.run for one in found.history}
    assert len(runs) > 2, "it must have started again"


def test_the_search_is_told_the_cost_and_more_where_a_candidate_was_moved(tmp_path, monkeypatch):
    told, original = [], search.started

    def watched(*given):
        strategy = original(*given)
        tell = strategy.tell
        monkeypatch.setattr(strategy, "tell", lambda points, costs: (told.extend(costs), tell(points, costs)))
        return strategy

    monkeypatch.setattr(search, "started", watched)
    found = Search([ground(tmp_path, PAPER + TWO.replace("theorem = false", ""))], 100, 1, SILENT).run()
    assert found.present.judged.cost == 0.5, "costs are in units of the present objective"
    assert told == [one.tried.cost * (1.0 + 10.0 * one.moved**2) for one in found.history[1:]]
    assert max(one.moved for one in found.history) > 0.01


def test_restarts_double_the_population_while_ten_generations_fit(tmp_path):
    there = ground(tmp_path, PAPER + TWO)
    found = Search([there], 2500, 2, SILENT).run()
    sizes = {}
    for one in found.history[1:]:
        sizes.setdefault(one.run, set()).add(sum(1 for other in found.history if other[:2] == one[:2]))
    assert sizes[1] == {population(2, 1)}
    assert sizes[2] == {2 * population(2, 1)}


@pytest.mark.parametrize("budget", [18, 33, 34, 64, 200])
def test_the_budget_is_never_exceeded_and_no_generation_is_left(tmp_path, monkeypatch, budget):
    flown = []
    original = CandidateFlyer.fly

    def counted(self, candidates, first, count, progress=None):
        flown.append(len(candidates) * count)
        return original(self, candidates, first, count, progress)

    monkeypatch.setattr(CandidateFlyer, "fly", counted)
    path = written(tmp_path, PAPER + TWO)
    least = 19
    if budget < least:
        with pytest.raises(Exception, match="at least 19"):
            run.tune(path, budget, tmp_path / "out")
        assert not flown
        return
    listener = Listener()
    done = run.tune(path, budget, tmp_path / "out", progress=listener)
    told = [flights for flights, _ in listener.heard]
    assert sum(flown) <= budget
    assert budget - sum(flown) < population(2, 1)
    assert told == sorted(told)
    assert told[-1] == sum(flown) == metrics(tmp_path / "out")["flights"]
    assert done.found.history[-1].flights == sum(flown) - 2


def test_the_same_seed_gives_the_same_bytes_whatever_else_draws_random_numbers(tmp_path):
    path = written(tmp_path, WINDY + SOFT)
    names = ["history.csv", "tuned.toml", "metrics.json", "convergence.png", "convergence.svg"]
    for seed, out, noise in ((5, "a", 1), (5, "b", 2), (6, "c", 1)):
        np.random.seed(noise)
        run.tune(path, 250, tmp_path / out, seed)
    for name in names:
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes(), name
    first, other = history(tmp_path / "a"), history(tmp_path / "c")
    assert first[0]["objective"] != other[0]["objective"], "another seed has other noise"
    assert first[1]["controller.k_x.0"] != other[1]["controller.k_x.0"]


def test_all_candidates_fly_the_same_draws_and_do_not_know_of_each_other(tmp_path):
    there = ground(tmp_path, WINDY + SOFT)
    points = [[0.1, 0.2], [0.9, 0.6]]
    values = [there.asked.numbers(point) for point in points]
    together = there.fly(values, 0, 8)
    for place in range(2):
        alone = there.fly([values[place]], 0, 8)[0]
        np.testing.assert_array_equal(alone.metrics, together[place].metrics)
    assert len(set(together[0].metrics[:, 0])) == 8, "and the flights of a candidate differ"


def test_the_present_gains_fly_as_the_campaign_of_the_same_draws_does(tmp_path):
    there = ground(tmp_path, WINDY + SOFT, seed=9)
    section = there.asked.section
    file = check(CampaignFile, {"mission": "m", "seed": 9, "vary": section.vary}, "c.toml")
    flown = Flyer(campaign_of(file, "", there.asked.content, "m", tmp_path)).fly(0, 8)
    ours = there.fly([there.asked.present], 0, 8)[0]
    np.testing.assert_array_equal(flown["position_rmse[m]"].to_numpy(), ours.metric("position_rmse"))
    np.testing.assert_array_equal(flown["variation_thrust[N]"].to_numpy(), ours.metric("variation_thrust"))


def test_what_the_search_says_of_the_tuned_gains_is_what_their_mission_flies(tmp_path):
    path = written(tmp_path, PAPER + TWO)
    done = run.tune(path, 120, tmp_path / "out")
    saved = tmp_path / "out" / "tuned.toml"
    log = fly(plan_mission(read_mission(saved), saved))
    measured, _ = read_mission(saved).flight_metrics(log)
    assert measured["position_rmse[m]"] == pytest.approx(done.found.best.judged.parts["position_rmse"], rel=1e-6)


def test_no_flight_of_the_comparison_was_tuned_on(tmp_path, monkeypatch):
    spans = []
    original = CandidateFlyer.fly

    def noted(self, candidates, first, count, progress=None):
        spans.append((first, first + count, len(candidates)))
        return original(self, candidates, first, count, progress)

    monkeypatch.setattr(CandidateFlyer, "fly", noted)
    run.tune(written(tmp_path, WINDY + SOFT), 200, tmp_path / "out")
    assert spans[-1] == (UNSEEN, UNSEEN + 32, 2)
    assert {span[:2] for span in spans[:-1]} == {(0, 4), (4, 8)}
    there = ground(tmp_path, WINDY + SOFT)
    seen, unseen = (there.fly([there.asked.present], first, 8)[0] for first in (0, UNSEEN))
    assert not set(seen.metrics[:, 0]) & set(unseen.metrics[:, 0])


def test_poor_gains_in_the_wind_become_better_on_unseen_seeds(tmp_path):
    done = run.tune(written(tmp_path, WINDY + SOFT), 1200, tmp_path / "out")
    rmse = done.compared.rows[0]
    assert rmse.name == "position_rmse[m]"
    assert rmse.tuned.high < 0.6 * rmse.present.low
    assert rmse.difference.high < 0.0
    assert done.compared.verdict == "The tuned gains are better on flights they were not tuned on."
    assert tuned(tmp_path / "out")["controller"]["k_x"][0] == done.values["controller.k_x.0"]


def test_a_mission_without_anything_random_flies_each_candidate_once(tmp_path):
    assert read_request(written(tmp_path, PAPER + TWO)).seeds == 1
    assert read_request(written(tmp_path, WINDY + SOFT)).seeds == 8
    calm = WINDY.split("[wind]")[0]
    assert read_request(written(tmp_path, calm + SOFT.split("[tune.vary]")[0])).seeds == 1
    assert read_request(written(tmp_path, calm + SOFT)).seeds == 8


@pytest.mark.parametrize(("gains", "seeds"), [(1, 1), (3, 16), (3, 7), (9, 10), (64, 3)])
def test_a_generation_fills_whole_blocks(gains, seeds):
    count = population(gains, seeds)
    assert count * seeds % search.BLOCK == 0
    assert count >= 4 + math.floor(3 * math.log(max(2, gains)))


def test_what_is_found_is_never_worse_than_the_start_on_the_flights_tuned_on(tmp_path):
    good = WINDY.replace("k_x = [3.0, 3.0, 3.0]\nk_v = [1.0, 1.0, 1.0]\n", "k_x = [20.0, 20.0, 20.0]\nk_v = [7.0, 7.0, 7.0]\n")
    for seed in range(2):
        there = ground(tmp_path, good + SOFT, seed)
        found = Search([there], 8 + 16 * 4 + 3 * 4, seed, SILENT).run()
        assert len(found.history) > 1
        present, best = (Judge(there.asked.section, there.duration).judge(there.fly([one], 0, 8)[0]) for one in (
            found.present.values, found.best.values
        ))  # fmt: skip
        assert best.cost <= present.cost
        assert best.objective == pytest.approx(found.best.judged.objective)
        assert found.best.tried.whole, "what has flown only a few flights is not believed"


@pytest.mark.parametrize("better", [False, True])
def test_where_flights_are_lost_the_best_is_one_of_the_history_whatever_its_margins(tmp_path, monkeypatch, better):
    original = CandidateFlyer.fly

    def losing(self, candidates, first, count, progress=None):
        flown = original(self, candidates, first, count, progress)
        for one, values in zip(flown, candidates, strict=True):
            one.outcome[:] = 1
            one.ended[:] = 0.5 if values == self.asked.present else 0.9 if better else 0.1
        return flown

    monkeypatch.setattr(CandidateFlyer, "fly", losing)
    monkeypatch.setattr(CandidateFlyer, "margins", lambda *_: {"phase_margin": 0.1})
    limits = "constraints = { phase_margin = 0.4 }\n"
    done = run.tune(written(tmp_path, WINDY + SOFT.replace("constraints = {}\n", limits)), 250, tmp_path / "out")
    found = done.found
    assert any(one is found.best for one in found.history) and found.best.judged.violation == pytest.approx(0.75)
    assert (found.best is found.present) is not better
    assert (tmp_path / "out" / "before_after.png").exists() is better
    assert not (tmp_path / "out" / "convergence.png").exists(), "no candidate has an objective"


def test_the_curve_of_the_best_is_that_of_the_rule_of_the_search_and_ends_at_the_tuned_gains(tmp_path):
    asked = WINDY + SOFT.replace("constraints = {}\n", "constraints = { largest_error = 0.1 }\n")
    for seed in range(3):
        found = run.tune(written(tmp_path, asked), 250, tmp_path / str(seed), seed).found
        steps = led(found)
        assert steps[-1] is found.best and len({one.flights for one in steps}) == len(steps)
        axes = Figure().subplots()
        draw_objective(axes, read_request(tmp_path / "mission.toml"), found)
        curve = axes.get_lines()[-1]
        (ring,) = curve.get_markevery()
        assert (curve.get_xdata()[ring], curve.get_ydata()[ring]) == (found.best.flights, found.best.judged.objective)
        for one in steps:
            there = [each for each in found.history if each.flights <= one.flights and each.tried.whole]
            assert one.judged.cost == min(each.judged.cost for each in there)


def test_candidates_whose_margins_nobody_computed_are_drawn_hollow(tmp_path):
    found = run.tune(path := written(tmp_path, SMALL.format(more="")), 80, tmp_path / "out").found
    axes = Figure().subplots()
    draw_objective(axes, asked := read_request(path), found)
    hollow = {tuple(map(float, at)) for one in axes.collections if not len(one.get_facecolors()) for at in one.get_offsets()}
    finite = [one for one in found.history if math.isfinite(one.judged.objective) and one.judged.feasible]
    known = [
        one.tried.whole and all(map(math.isfinite, map(one.tried.whole.parts.get, asked.section.margins))) for one in finite
    ]
    assert asked.section.margins and any(known)
    assert hollow == {(one.flights, one.judged.objective) for one, told in zip(finite, known, strict=True) if not told}


def test_a_sound_loop_stays_sound_unless_its_margins_are_given_up(tmp_path):
    def least(text, out, budget):
        run.tune(written(tmp_path, text), budget, tmp_path / out)
        return margin_metrics(read_mission(tmp_path / out / "tuned.toml"), wanted)

    text = SMALL.format(more="")
    wanted = sound(mission := read_mission(written(tmp_path, text)))
    before, after, free = (
        margin_metrics(mission, wanted),
        least(text, "kept", 80),
        least(SMALL.format(more="constraints = {}"), "free", 150),
    )
    for name, one in wanted.items():
        assert before[name] >= one.least
        assert after[name] >= one.least
    assert free["phase_margin"] < 0.5 * wanted["phase_margin"].least, "which the path alone asks for"


@pytest.mark.parametrize(("given", "wanted"), [
    ("", {"phase_margin"}),
    ("constraints = {}", set()),
    ("constraints = { largest_error = 1.0 }", {"largest_error", "phase_margin"}),
    ("constraints = { largest_error = 1.0, phase_margin = 0.0 }", {"largest_error"}),
    ("constraints = { gain_margin_up = 3.0 }", {"gain_margin_up"}),
])  # fmt: skip
def test_margins_are_kept_unless_one_is_named_or_nothing_is_constrained(tmp_path, monkeypatch, given, wanted):
    monkeypatch.setattr("quadstep.studies.tuning.ground.required_margins", lambda _: {"phase_margin": Constraint(least=0.5)})
    asked = read_request(written(tmp_path, SMALL.format(more=given)))
    assert set(asked.section.constraints) == wanted
    assert {one.least for one in asked.section.constraints.values()} <= {None, 0.5, 3.0}


def test_a_loop_that_lacks_margin_must_not_lose_any(monkeypatch):
    mission = Mission(
        controller={"type": "geometric"}, vehicle={"preset": "crazyflie"}, path={"type": "step", "end": [0.0, 0.0, 1.0]}
    )
    now = {"gain_margin_up": 20.0, "gain_margin_down": 4.0, "phase_margin": 0.1}
    monkeypatch.setattr("quadstep.studies.tuning.ground.margin_metrics", lambda *_: now)
    assert {name: one.least for name, one in required_margins(mission).items()} == pytest.approx(
        {**now, "gain_margin_up": 6.0}
    )
    now.update(dict.fromkeys(now, 0.0))  # unstable
    assert required_margins(mission) == {}


def test_the_margins_that_were_asked_for_hold_for_the_mission_that_is_written(tmp_path):
    limits = "constraints = { phase_margin = 0.4, gain_margin_up = 7.0 }\n"
    stiff = WINDY.replace("[3.0, 3.0, 3.0]", "[30.0, 30.0, 30.0]").replace("[1.0, 1.0, 1.0]", "[10.0, 10.0, 10.0]")
    path = written(tmp_path, stiff + ONE_LOOP + SOFT.replace("constraints = {}\n", limits))
    done = run.tune(path, 180, tmp_path / "out")
    found = margin_metrics(read_mission(tmp_path / "out" / "tuned.toml"), ["phase_margin", "gain_margin_up"])
    assert found["phase_margin"] >= 0.4
    assert found["gain_margin_up"] >= 7.0
    assert done.found.best.judged.parts["phase_margin"] == pytest.approx(found["phase_margin"])
    assert done.found.best is not done.found.present, "whose margins are too small"
    looked = [one for one in done.found.history if math.isfinite(one.judged.parts["phase_margin"])]
    assert all(one.tried.whole for one in looked)


def test_a_loop_is_graded_at_the_ends_of_what_varies_too(tmp_path):
    """A loop that is sound with the mass as written is not called so where a heavier vehicle's is fragile."""
    there = ground(tmp_path, WINDY + SOFT)
    drawn = there.draws(UNSEEN, there.asked.unseen).drawn

    def worst(fragile):
        def graded(one):
            return {"grade": "fragile" if fragile(one.vehicle.mass) else "sound", "why": "so"}

        found = run.worst_grade(there, drawn, there.asked.present, graded)
        return f"{found['grade']}: {found['why']}"

    heavy = r"fragile: at the largest vehicle mass flown, (2\.9\d+|3) kg, so; as the mission is written, it is sound"
    assert re.fullmatch(heavy, worst(lambda mass: mass > 2.9))
    assert worst(lambda mass: mass < 2.45).startswith("fragile: at the smallest vehicle mass flown, 2.4")
    both = "sound: so; sound with the least and the largest vehicle mass that fly, too"
    assert worst(lambda mass: False) == both
    assert run.worst_grade(there, drawn, there.asked.present, lambda _: {}) == {}
    drawn["controller.mass"] = DrawnColumn(np.array([2.5, 2.7]))
    light = r"fragile: at the largest vehicle mass flown, \S+ kg and the smallest controller mass flown, 2\.5 kg, so; .*"

    def corner(one):
        return {"grade": "fragile" if one.vehicle.mass > 2.9 and one.controller.mass < 2.6 else "sound", "why": "so"}

    found = run.worst_grade(there, drawn, there.asked.present, corner)
    assert re.fullmatch(light, f"{found['grade']}: {found['why']}"), "which neither end is alone"
    found = run.worst_grade(there, drawn, there.asked.present, lambda _: {"grade": "sound", "why": "so"})
    assert found["why"].endswith("vehicle mass and controller mass that fly, too, in every combination")
