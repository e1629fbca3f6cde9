"""The page as a file: its content, that a user's text is never more than text, and its message on flights it cannot fly."""

import base64
import json
import math
import re

import numpy as np
import pytest

from quadstep.engines.fly import fly
from quadstep.interfaces.closed_loop import Outcome, Ticks
from quadstep.interfaces.controller import Controller
from quadstep.io.errors import UserError
from quadstep.mission.schema import Mission
from quadstep.page import build
from quadstep.page.build import build_page, fill, fly_missions, identity, missions_page, page_data
from quadstep.page.flights import ShownFlight, check_length, facts
from quadstep.page.laws import Laws
from quadstep.page.model import ClaimView, json_number
from quadstep.page.scenes import PANELS, panels, scene
from quadstep.page.story import OWN
from quadstep.studies.paper.cases import NEURONS, case_1, fly_study, plan_study
from quadstep.studies.paper.claims import check_claims, counts
from quadstep.studies.paper.page import TURN_NEURONS, paper_page
from quadstep.vehicle.paper import rotor_map
from tests.missions import EXAMPLES, MISSIONS, RECORDED
from tests.pages import FLIGHTS, STAND_IN, data_of, flown, fly_page, needs_node

HOSTILE = "</script><script>alert('x')</script><!-- & \"quotes\" \\u003c ]]> é 飛"


@pytest.fixture(autouse=True)
def stand_in(monkeypatch):
    """A front end without a front end."""
    monkeypatch.setattr(build, "template", lambda: STAND_IN)


@pytest.fixture(scope="module")
def paper_text():
    plans = plan_study()
    study = fly_study(plans)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(build, "template", lambda: STAND_IN)
        text = paper_page(study, plans, check_claims(study))
    assert data_of(text)["intro"][1] == counts(check_claims(study))
    return text


def test_every_flight_of_the_paper_is_there_and_live(paper_text):
    data = data_of(paper_text)
    assert len(data["flights"]) == 6 + 2 + 36
    assert len({flight["id"] for flight in data["flights"]}) == 44
    assert [flight["whyNot"] for flight in data["flights"]] == [""] * 44
    assert all(len(flight["controllers"]) == 3 and flight["recorded"] is None for flight in data["flights"])
    assert all(re.fullmatch("[a-z0-9-]+", flight["id"].replace(".", "-")) for flight in data["flights"])
    lost = [flight for flight in data["flights"] if flight["outcome"]["code"] != 0]
    assert all("lost at" in flight["outcome"]["text"] for flight in lost)
    assert 0 < len(lost) < 20
    margins = {flight["id"]: flight["margins"] for flight in data["flights"]}
    assert margins["case1"] == margins["stress-3s-x1-nets"] == "fragile, phase margin 29.4° in thrust (less than 30.0°)"
    assert margins["case1-without-nets"] == margins["stress-3s-x1-no-nets"] == "sound"


def test_stress_flights_are_a_table(paper_text):
    cells = [flight["cell"] for flight in data_of(paper_text)["flights"] if flight["cell"]]
    places = {(cell["block"], cell["row"], cell["column"]) for cell in cells}
    assert len(cells) == len(places) == 36
    assert {len({place[axis] for place in places}) for axis in (0, 1, 2)} == {2, 3, 6}


def test_every_claim_says_where_to_look_and_each_flight_which_claims(paper_text):
    data = data_of(paper_text)
    flights = {flight["id"]: flight for flight in data["flights"]}
    assert len(data["claims"]) == 17
    assert {claim["verdict"] for claim in data["claims"]} == {"holds", "fails", "undecided"}
    for number, claim in enumerate(data["claims"]):
        assert claim["flights"] and claim["panels"] and claim["look"] and claim["measured"]
        for flight in claim["flights"]:
            assert number in flights[flight]["claims"]
            assert set(claim["panels"]) <= {panel["id"] for panel in flights[flight]["panels"]}
    assert all(claim in range(17) for flight in data["flights"] for claim in flight["claims"])
    assert str(NEURONS[0]) in TURN_NEURONS


def test_the_pages_own_part_is_small(paper_text):
    assert len(paper_text.encode()) < 500_000


def test_a_page_is_the_same_whenever_it_is_made():
    one, two = (missions_page([flown("case", FLIGHTS["backstepping"])]) for _ in range(2))
    assert one == two


def test_a_hostile_name_is_only_a_name(tmp_path):
    given = Mission.model_validate({**FLIGHTS["backstepping"].model_dump(), "name": HOSTILE})
    text = missions_page([flown("case", given)._replace(name=HOSTILE, note=HOSTILE, warnings=(HOSTILE,), group=HOSTILE)])
    assert "alert('x')</script>" not in text
    assert text.count("<script") == 2 == text.count("</script>")
    assert "<!--" not in text
    data = data_of(text)
    assert data["title"] == data["flights"][0]["name"] == data["flights"][0]["warnings"][0] == HOSTILE
    assert re.search("<title>(.*?)</title>", text).group(1).startswith("&lt;/script&gt;")


def test_hostile_claims_and_links_are_only_text():
    claim = ClaimView(HOSTILE, HOSTILE, HOSTILE, "undecided", (), HOSTILE, ())
    text = build_page(HOSTILE, [HOSTILE], [], [claim])
    assert text.count("<script") == 2
    assert data_of(text)["claims"][0]["sentence"] == HOSTILE
    assert data_of(text)["flights"] == []


def test_laws_that_would_end_their_script_are_refused():
    with pytest.raises(ValueError, match="script"):
        fill(STAND_IN, "t", {}, "x</script>")


@pytest.mark.parametrize("broken", [STAND_IN.replace("{}", "{ }"), STAND_IN * 2, ""])
def test_a_template_without_its_places_is_refused(broken):
    with pytest.raises(ValueError, match="once"):
        fill(broken, "t", {}, "0")


def test_text_in_one_place_is_not_taken_for_another_place():
    text = fill(STAND_IN, '<script id="quadstep-laws">0</script>', {"title": '<script id="quadstep-laws">0</script>'}, "LAWS")
    assert text.count("LAWS") == 1
    assert json.loads(re.search(r"json\">(.*?)</script>", text).group(1))["title"].startswith("<script")


def test_no_law_holds_text_of_the_mission():
    laws = Laws()
    page_data("t", (), [flown("case", FLIGHTS["waypoints"])], (), (), laws)
    text = laws.script()
    assert "vehicle" not in text
    assert "gains" not in text
    assert not re.search(r"eval|Function\(|import|fetch|document|window", text)
    assert "</" not in text


def test_json_has_no_infinity_and_short_whole_numbers():
    assert [json_number(value) for value in (1.0, 0.5, float("inf"), float("-inf"), 1e300)] == [
        1, 0.5, "Infinity", "-Infinity", 1e300]  # fmt: skip


@pytest.mark.parametrize(("ticks", "held"), [
    (Ticks(0.002, (1,), 5, 20_000), True),
    (Ticks(0.002, (1,), 1000, 300_000), True),
    (Ticks(0.002, (1,), 1000, 300_001), False),
    (Ticks(0.002, (1,), 1, 60_000), False),
])  # fmt: skip
def test_a_flight_too_long_is_refused(ticks, held):
    if held:
        check_length(ticks)
        return
    with pytest.raises(UserError, match="at most"):
        check_length(ticks)


def test_a_flight_that_is_too_long_shows_its_recording_thinned():
    given = case_1(simulation={"duration": 40.0, "step": 0.0001, "log_period": 0.0005, "control_period": 0.002})
    plan = given.plan()
    log = fly(plan)
    data = data_of(build_page("long", (), [ShownFlight("long", "long", "m", given, plan, log, {})]))
    (flight,) = data["flights"]
    assert "400000 steps" in flight["whyNot"]
    assert flight["controllers"] == []
    recorded = flight["recorded"]
    rows = np.frombuffer(base64.b64decode(recorded["rows"])).reshape(recorded["count"], len(recorded["columns"]))
    assert 2000 < recorded["count"] < 5000
    assert recorded["period"] == pytest.approx(0.0005 * round(len(log.rows) / recorded["count"]), rel=0.05)
    assert rows[0].tolist() == log.rows[0].tolist()
    assert recorded["columns"][0] == ["t", "s"]


class Opaque(Controller):
    """A controller that is no law: it decides with `if`."""

    def start(self, measured, gains):
        return gains

    def law(self, memory, measured, reference, gains, t, period):
        raise AssertionError if measured.position[0] > 0.0 else ValueError("a library that knows only floats")


def test_an_opaque_controller_shows_its_recording():
    flight = flown("case", FLIGHTS["backstepping"])
    plan = flight.plan.with_controller(Opaque(), flight.plan.parameters.gains)
    data = data_of(build_page("opaque", (), [flight._replace(mission=None, plan=plan)]))
    (shown,) = data["flights"]
    assert "cannot be written as JavaScript" in shown["whyNot"]
    assert shown["recorded"]["count"] == len(flight.log.rows)
    assert shown["panels"]


def test_an_own_controller_flies_with_a_slider_for_each_of_its_gains():
    from examples.own_controller import CascadedPD, Gains
    from quadstep.numbers import vector

    gains = Gains(
        1.0, 9.81, vector(1.0, 1.0, 1.0), vector(2.0, 2.0, 2.0), vector(100.0, 100.0, 100.0), vector(50.0, 50.0, 50.0)
    )
    plan = case_1().plan().with_controller(CascadedPD(), gains)
    log = fly(plan)
    data = data_of(build_page("own", (), [ShownFlight("own", "own", "m", None, plan, log, {})]))
    (flight,) = data["flights"]
    assert flight["whyNot"] == ""
    assert {control["id"] for control in flight["controllers"][0]["controls"]} >= set(Gains._fields) - {"mass", "gravity"}


def test_a_flight_of_a_single_row_is_shown():
    path = {"type": "minimum-jerk", "end": [0, 0, 1], "duration": 1.0}
    start = {"position": [1.0, 0.0, 0.0]}
    given = Mission.model_validate({"path": path, "limits": {"distance": 1e-9}, "start": start})
    flight = flown("lost", given)
    assert flight.log.outcome is Outcome.OFF_PATH
    assert len(flight.log.rows) == 0
    shown = data_of(missions_page([flight]))["flights"][0]
    assert shown["outcome"]["text"].startswith("lost at 0 s: more than 1e-09 m from its path")
    unknown = data_of(missions_page([flight._replace(plan=None, mission=None)]))["flights"][0]
    assert unknown["recorded"]["count"] == 0
    assert "only its recording" in unknown["whyNot"]


def test_missions_get_ids_of_their_own(tmp_path):
    path = tmp_path / "m.toml"
    path.write_text('name = "Größe <b>"\n[path]\ntype="minimum-jerk"\nend=[0.0,0.0,1.0]\nduration=1.0\n', encoding="utf-8")
    data = data_of(fly_missions([path, path]))
    assert [flight["id"] for flight in data["flights"]] == ["gr-e-b", "gr-e-b-2"]
    assert data["title"] == "2 missions"
    assert identity("", []) == "flight" == identity("飛行", [])
    assert identity("a", ["a", "a-2"]) == "a-3"


def test_examples_fit_a_page_and_all_are_live():
    missions = [EXAMPLES / f"{name}.toml" for name in MISSIONS if name != RECORDED]
    data = data_of(fly_missions(missions))
    assert len(data["flights"]) == len(missions)
    assert {flight["whyNot"] for flight in data["flights"] if flight["controls"] or not flight["whyNot"]} == {""}


def test_each_panel_is_of_columns_that_are_there_and_every_column_of_a_flight_is_in_one():
    columns = FLIGHTS["backstepping"].plan().loop.columns
    found = panels(columns)
    assert len({panel.id for panel in found}) == len(found)
    used = {name for panel in found for line in panel.lines for name in (line.column, line.minus) if name}
    velocities = {name for name in columns if name.endswith("_dot")}
    assert used == set(columns) - {"t"} - velocities
    assert all(panel.unit == columns[line.column] for panel in found for line in panel.lines)
    assert {panel.id for panel in PANELS} >= {panel.id for panel in found}


def test_facts_have_the_units_of_a_report():
    assert facts({"position_rmse[m]": 3.6e-6}) == (("position RMSE", "3.60\N{NO-BREAK SPACE}µm"),)
    assert facts({}) == ()


def test_the_drawn_rotors_are_those_of_eq_5():
    """Pushing harder with a rotor raises its side; one that turns counter-clockwise turns the vehicle clockwise, +psi."""
    flight = flown("case", FLIGHTS["backstepping"])
    rotors = flight.plan.parameters.vehicle.rotors
    drawn = scene(flight.plan, flight.log).rotors
    for i, (rotor, column) in enumerate(zip(drawn, rotor_map(rotors).T.rows, strict=True)):
        _, tau_phi, tau_theta, tau_psi = column
        assert rotor.position == (tau_theta, -tau_phi, 0.0)
        assert rotor.spin == math.copysign(1, tau_psi)
        assert rotor.force == f"f{i + 1}"


def test_an_error_is_what_was_wanted_less_what_is():
    found = {panel.id: panel for panel in panels(FLIGHTS["backstepping"].plan().loop.columns)}
    assert [(line.column, line.minus) for line in found["position-error"].lines] == [("x_d", "x"), ("y_d", "y"), ("z_d", "z")]
    assert [line.dashed for line in found["position"].lines] == [False] * 3 + [True] * 3


def test_the_smallest_difference_between_two_flights_is_kept():
    laws = Laws()
    one = FLIGHTS["backstepping"].plan()
    laws.add(one)
    vehicle = one.parameters.vehicle._replace(mass=math.nextafter(1.0, 2.0))
    other = laws.add(one._replace(parameters=one.parameters._replace(vehicle=vehicle)))
    assert other.overrides == ((0, math.nextafter(1.0, 2.0)),)


def test_a_full_page_has_fewer_ghosts_then_recordings(monkeypatch):
    flights = [flown(name, FLIGHTS[name]) for name in ("backstepping", "waypoints", "circle", "forty neurons")]
    own = Laws()
    own.add(flights[0].plan)
    monkeypatch.setattr("quadstep.page.controllers.ROOM_FOR_GHOSTS", 4 * own.size)
    monkeypatch.setattr("quadstep.page.laws.ROOM", 7 * own.size)
    shown = data_of(missions_page(flights))["flights"]
    counts = [len(flight["controllers"]) for flight in shown]
    assert counts[0] == 3
    assert counts[-1] == 0
    assert counts == sorted(counts, reverse=True)
    assert "left" in shown[-1]["whyNot"]
    assert shown[-1]["recorded"]["count"] == len(flights[-1].log.rows)


@needs_node
def test_the_walk_says_what_its_guesses_fly(paper_text, tmp_path):
    pages = {"paper.html": paper_text, "own.html": fly_missions([OWN.with_name("wind.toml"), OWN.with_name("rotor.toml")])}
    for name, text in pages.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    own = data_of(pages["own.html"])["flights"]
    stress = "stress-6s-x1-nets"
    asked = {
        "paper.html": [
            {"flight": "case1", "values": {"t_f": [6.0], "K_r2": [100.0] * 3}},
            {"flight": "case1", "values": {"t_f": [6.0], "K_r2": [75.0] * 3}},
            {"flight": stress},
            {"flight": stress, "values": {"nets": [0.0]}},
            {"flight": stress, "values": {"disturbance": [1.5]}},
            {"flight": stress, "values": {"disturbance": [2.0]}},
            {"flight": "stress-3s-x1-nets", "controller": 1},
        ],
        "own.html": [
            {"flight": own[0]["id"]},
            {"flight": own[0]["id"], "values": {"wind": [12.0, 0.0, 0.0]}},
            {"flight": own[1]["id"]},
            {"flight": own[1]["id"], "values": {"fault_1": [0.5]}},
        ],
    }
    flown = [one for name in asked for one in fly_page(tmp_path / name, *asked[name])]
    assert [place for place, one in enumerate(flown) if one["code"] > 0] == [1, 5]
    slow, _, nets, none, more, _, repaired, wind, gale, weak, half = flown
    assert tilt(slow) == pytest.approx(26.4, abs=0.5)
    assert [1e3 * rmse(one) for one in (nets, none, more)] == pytest.approx([9.0, 93.0, 19.7], abs=0.5)
    late = column(repaired, "t") > 6.0
    assert rmse(repaired) == pytest.approx(0.21, abs=0.01)
    assert np.degrees(np.abs(column(repaired, "theta")[late]).max()) == pytest.approx(20.0, abs=3.0)  # it goes on shaking
    assert [largest(one) for one in (wind, gale, weak, half)] == pytest.approx([0.32, 0.655, 0.107, 0.744], abs=0.002)


def column(answer, name):
    return answer["values"][:, [one for one, _ in answer["columns"]].index(name)]


def distances(answer):
    return np.linalg.norm([column(answer, f"{axis}_d") - column(answer, axis) for axis in "xyz"], axis=0)


def rmse(answer):
    return np.sqrt(np.mean(distances(answer) ** 2))


def largest(answer):
    return distances(answer).max()


def tilt(answer):
    return np.degrees(np.arccos(np.cos(column(answer, "theta")) * np.cos(column(answer, "phi"))).max())
