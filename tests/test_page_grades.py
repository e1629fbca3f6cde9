"""The page measures and grades flights as Python does, from the same log."""

import pytest

from quadstep.engines.fly import fly
from quadstep.linear.grade import grade
from quadstep.metrics.verdict import graded
from quadstep.mission.schema import Mission
from quadstep.page.build import missions_page
from quadstep.page.flights import SUMMED_UP
from quadstep.report.panels import left_path
from quadstep.studies.campaign.page import limit
from tests.graded import CASE_1, CIRCLE, FLIGHTS, X500
from tests.needs import CHROMIUM, needs, package
from tests.pages import flown

package("playwright")
pytestmark = needs(CHROMIUM)

MORE = {
    "rotors with limits": {"path": {**CASE_1, "duration": 3.0}, "vehicle": {"rotors": {"limits": [0.0, 2.7]}}},
    "lost": {"path": {**CASE_1, "duration": 2.0}, "controller": {"type": "backstepping", "K_r1": 30.0}},
    "sinking": {"vehicle": {"preset": "x500"}, "controller": {"type": "rotation-backstepping"},
        "path": {"type": "circle", "centre": [0.0, 0.0, 4.0], "radius": 3.0, "ramp": 1.0, "period": 9.0},
        "simulation": {"duration": 9.0}, "events": [{"type": "rotor", "time": 2.0, "rotor": 1, "efficiency": 0.3}]},
    "short": {"path": {**CASE_1, "end": [4.0, 1.0, 2.0], "duration": 6.0}},
    "scored late": {"vehicle": {"preset": "x500"}, "path": {"type": "circle", "radius": 2.0, "period": 3.0},
        "score_from": 2.0},
}  # fmt: skip

LIMIT = limit("largest_error[m]", 1e-3)

CONTENTS = {name: content for name, (content, _) in FLIGHTS.items() if "long after" not in name} | MORE
"""As many as a page has room for the laws of."""


@pytest.fixture(scope="module")
def logs():
    missions = {name: Mission.model_validate({**content, "name": name}) for name, content in CONTENTS.items()}
    return {name: (mission, fly(mission.plan())) for name, mission in missions.items()}


@pytest.fixture(scope="module")
def page_file(tmp_path_factory, logs):
    file = tmp_path_factory.mktemp("grades") / "page.html"
    shown = [flown(name, mission, log=log) for name, (mission, log) in logs.items()]
    (late,) = (one for one in shown if one.name == "scored late")
    shown.append(late._replace(id="limited", name="limited", limits=(LIMIT, limit("effort_u[N]", 5.0))))
    grouped = [one._replace(group="Others") if one.name == "lost" else one for one in shown]
    file.write_text(missions_page(grouped), encoding="utf-8")
    return file


def test_page_and_python_measure_and_grade_alike(open_page, logs):
    page, seen, left = open_page(), set(), ""
    for name, (mission, log) in logs.items():
        metrics, _ = mission.flight_metrics(log)
        page.evaluate("id => quadstep.select(id)", name.replace(" ", "-"))
        outcome, summary = page.evaluate("quadstep.outcome()"), page.evaluate("quadstep.summary()")
        assert outcome["live"], name
        wanted = graded(metrics)
        assert (outcome["grade"], tuple(outcome["reasons"])) == (wanted.grade.value, wanted.reasons), name
        assert outcome["left"] == left_path(log, metrics), name
        left += outcome["left"]
        for measure, metric in SUMMED_UP.items():
            if metric in metrics:
                assert summary[measure] == pytest.approx(metrics[metric], rel=1e-12, abs=1e-15), (name, measure)
        seen |= {outcome["grade"]}
    assert seen == {"as commanded", "flew, but", "lost"}
    assert all(words in left for words in ("did not keep its path", "did not hold its position", "and it sank to"))


def test_a_flight_above_the_limit_of_its_campaign_is_no_good_one(open_page, logs):
    page, (mission, log) = open_page(), logs["scored late"]
    wanted = graded(mission.flight_metrics(log)[0], [LIMIT, limit("effort_u[N]", 5.0)])
    page.evaluate("quadstep.select('limited')")
    outcome = page.evaluate("quadstep.outcome()")
    assert (outcome["grade"], tuple(outcome["reasons"])) == ("above the limit", wanted.reasons)
    said = page.locator("#outcome").inner_text().replace("\xa0", " ")
    assert said.startswith("Above the limit (largest error ") and said.endswith(" mm, limit 1.00 mm)")
    assert page.locator(".badge summary .mark").inner_text() == "✕"
    assert "does not measure its u effort" in page.locator("#summary-words").inner_text()
    assert page.locator("#walk [aria-current] .dot").get_attribute("class").split()[1] == "bad"


MOVED = {  # control and values, and the keys that say the same
    "a circle": [("wind", [4.0, 0.0, 0.0], {"wind": {"mean": [4.0, 0.0, 0.0]}}),
        ("radius", [2.0], {"path": {**CONTENTS["a circle"]["path"], "radius": 2.0}})],
    "short": [("torque", [0.0, 0.1, 0.0], {"disturbance": {"torque": [0.0, 0.1, 0.0]}}),
        ("disturbance", [0.5], {"disturbance": {"scale": 0.5}})],
}  # fmt: skip


@pytest.mark.parametrize("name", MOVED)
def test_margins_are_unknown_where_a_control_may_change_the_loop_at_rest(open_page, name):
    page = open_page()
    page.evaluate("id => quadstep.select(id)", name.replace(" ", "-"))
    told = []
    for control, values, keys in MOVED[name]:
        page.evaluate("([control, values]) => quadstep.setControl(control, values)", [control, values])
        told.append("changed loop" in page.locator("#margins").inner_text())
        page.click("#reset")
        least = [
            [one.value for one in grade(Mission.model_validate({**CONTENTS[name], **more})).measures] for more in ({}, keys)
        ]
        assert told[-1] == (least[0] != pytest.approx(least[1], rel=1e-9)), control
    assert told == [True, False]


def test_conditions_are_counted_where_they_say_something_of_the_vehicle(open_page, tmp_path):
    file = tmp_path / "page.html"
    laws = ("px4-cascade", "rotation-backstepping")
    short = {"vehicle": X500, "path": CIRCLE, "simulation": {"duration": 2.0}}
    missions = [Mission.model_validate({**short, "name": law, "controller": {"type": law}}) for law in laws]
    file.write_text(missions_page([flown(one.name, one) for one in missions]), encoding="utf-8")
    page = open_page(file=file)
    for law, control, value, said in zip(
        laws,
        ("MPC_THR_MIN", "Lambda1"),
        (0.6, 6.0),
        ("MPC_THR_HOVER ≥ MPC_THR_MIN is violated (PX4 v1.15)", "Theorem 5.1, per unit mass: 0 of 3 gain conditions hold"),
        strict=True,
    ):
        page.evaluate("id => quadstep.select(id)", law)
        assert not page.locator("#conditions, #promise").count()
        page.evaluate("([control, value]) => quadstep.setControl(control, [value, value, value])", [control, value])
        assert page.locator("#conditions").inner_text() == said
        page.evaluate("document.querySelector('.badge').open = true")
        assert ("assume unlimited rotors" in page.locator(".sheet").inner_text()) == (law == laws[1])


def test_the_mark_of_a_flight_is_that_of_its_grade(open_page):
    page = open_page()
    assert not page.locator(".others .stop").is_visible() and not page.locator(".key-line").is_visible()
    marks, kinds = {}, {"a-circle": "good", "a-circle-too-fast": "fair", "blown-off-a-hover": "bad", "lost": "bad"}
    for name in ("a-circle", "a-circle-too-fast", "blown-off-a-hover", "lost"):
        page.evaluate("id => quadstep.select(id)", name)
        marks[name] = page.locator(".badge summary .mark").inner_text()
        assert page.locator("#walk [aria-current] .dot").get_attribute("class").split()[1] == kinds[name]
    assert page.locator(".others .stop").is_visible() and page.locator(".key-line").is_visible()
    assert marks == {"a-circle": "✓", "a-circle-too-fast": "!", "blown-off-a-hover": "!", "lost": "✕"}
    assert "left its path" in page.locator(".key-line").inner_text()
    page.evaluate("quadstep.select('blown-off-a-hover')")
    assert page.locator("#outcome").inner_text() == "Flew 4.00 s, but did not hold its position"
    mark, words = page.locator(".badge .mark").first, page.locator("#summary-words")
    assert len({one.evaluate("one => getComputedStyle(one).color") for one in (mark, words)}) == 1
