"""Guided walks: read from Markdown, checked against the page's content, refused in one line."""

import numpy as np
import pytest

from quadstep.engines.fly import fly
from quadstep.io.errors import UserError
from quadstep.linear.grade import grade
from quadstep.metrics.quantities import position_errors
from quadstep.metrics.verdict import FlightGrade, graded
from quadstep.mission.read import read_mission
from quadstep.page import build
from quadstep.page.build import Walk, fly_missions, page_data
from quadstep.page.laws import NEURONS, Laws
from quadstep.page.story import OWN, read_story
from quadstep.studies.paper.cases import case_1, case_3, main_cases, stress, stress_flights
from quadstep.studies.paper.page import stress_id
from tests.commands import quadstep
from tests.pages import FLIGHTS, STAND_IN, data_of, flown, fly_page, needs_node, write_page

STEP = """## {title}

```toml
flight = "case"
{settings}
move = "K_r1"
watch = "{watch}"
```

Look: it flies.
And goes on.

A second paragraph.
"""
MISSION = """name = "a"
path = { type = "minimum-jerk", end = [1.0, 0.0, 0.0], duration = 1.0 }
"""


def written(tmp_path, *steps, title="# A walk\n\nFor readers of the file.\n\n"):
    path = tmp_path / "story.md"
    path.write_text(title + "\n".join(steps))
    return path


def one(settings="", title="First", watch="position"):
    return STEP.format(title=title, settings=settings, watch=watch)


@pytest.fixture(scope="module")
def case():
    return flown("case", FLIGHTS["backstepping"])


def viewed(path, case):
    return page_data("t", (), [case], (), (), Laws(), Walk(read_story(path), {}))["story"]


def test_a_step_is_settings_and_paragraphs(tmp_path, case):
    settings = (
        'set = { K_r1 = 4.0, neurons = 8, wind = [0.1, 0.0, 0.2] }\nghost = "nested-saturation"\ntime = 1.0\nwindow = [0, 5]'
    )
    story = viewed(written(tmp_path, one(settings), one(title="Second", watch="net")), case)
    assert story["title"] == "A walk"
    first, second = story["steps"]
    assert first["text"] == ["Look: it flies. And goes on.", "A second paragraph."]
    assert first["values"] == {"backstepping.K_r1": [4.0, 4.0, 4.0], "backstepping.neurons": [8.0], "wind": [0.1, 0.0, 0.2]}
    assert (first["flight"], first["controller"], first["ghost"], first["time"]) == (
        "case", "backstepping", "nested-saturation", 1.0)  # fmt: skip
    assert (first["window"], second["window"]) == ([0.0, 5.0], None)
    assert (second["title"], second["watch"], second["camera"]) == ("Second", "net", "orbit")


@pytest.mark.parametrize(("settings", "words"), [
    ("bogus = 1", "bogus"),
    ('mission = "a.toml"', "give either flight"),
    ("set = { K_r9 = 1.0 }", "set: unknown value 'K_r9'; did you mean K_r"),
    ("set = { K_r1 = [1.0, 2.0] }", "set.K_r1: should be one number or 3, not 2"),
    ("set = { K_r1 = -1.0 }", "set.K_r1: -1 is outside"),
    ("set = { K_r1 = nan }", "set.K_r1: should be a number, true or false, or a list of numbers, not nan"),
    ('set = { K_r1 = "big" }', "set.K_r1: should be a number, true or false, or a list of numbers, not 'big'"),
    ("set = { K_r1 = [1.0, [2.0]] }", "set.K_r1: should be a number, true or false, or a list of numbers, not [1.0, [2.0]]"),
    ('controller = "pid"', "controller: unknown value 'pid'; allowed"),
    ('ghost = "nobody"', "ghost: unknown value 'nobody'; allowed"),
    ('camera = "under"', "camera"),
    ("time = -1", "time"),
    ("window = [5, 1]", "window: should be two numbers, 0 or more, the larger one last, not [5.0, 1.0]"),
    ("success = { rmse = [2, 1] }", "success.rmse: should be two numbers, 0 or more, the larger one last"),
    ("success = { rmse = [0] }", "success.rmse: should be two numbers"),
    ("success = { speed = [0, 1] }", "success.speed"),
    ('guess = { ask = "?", choices = ["a"], answer = "a" }', "guess.choices"),
    ('guess = { ask = "?", choices = ["a", "a"], answer = "a" }', "choices: should all be different"),
    ('guess = { ask = "?", choices = ["a", "b"], answer = "c" }', "answer: 'c' is not one of a, b"),
    ('guess = { ask = "?", choices = ["a", "b"], answer = "a", show = { K_r9 = 1 } }',
        "guess.show: unknown value 'K_r9'; did you mean K_r"),
    ('guess = { ask = "?", choices = ["a", "b"], answer = "a", controller = "pid" }', "guess.controller: unknown value 'pid'"),
    ("= 3", "not valid TOML"),
])  # fmt: skip
def test_a_fault_is_one_line_with_step_and_key(tmp_path, case, settings, words):
    path = written(tmp_path, one(), one(settings, title="Bad"))
    with pytest.raises(UserError, match="step 2") as error:
        viewed(path, case)
    assert words in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "start with a title"),
        ("# T\n", "0 steps"),
        ("# T\n## S\nwords\n", "has 0 settings"),
        (f"# T\n{one()}{one().partition(chr(10))[2]}", "has 2 settings"),
        ('# T\n## S\n```toml\nflight = "case"\nmove = "t_f"\nwatch = "scene"\n```\n', "has no text"),
        ("# T\n" + "## S\n" * 41, "41 steps"),
    ],
)
def test_a_file_that_is_no_story_says_why(tmp_path, text, words):
    with pytest.raises(UserError, match=words):
        read_story(written(tmp_path, text, title=""))


def test_what_may_be_watched_is_what_is_there(tmp_path):
    nested = flown("case", FLIGHTS["nested saturation"])
    path = written(tmp_path, one(watch="net").replace("K_r1", "t_f"))
    with pytest.raises(UserError, match="watch: unknown value 'net'; allowed: scene, position"):
        viewed(path, nested)


def test_the_command_refuses_in_one_line_and_writes_nothing(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    written(tmp_path, one('controller = "x"').replace('flight = "case"', 'mission = "a.toml"'))
    (tmp_path / "a.toml").write_text(MISSION)
    for story, words in (("story.md", "unknown value 'x'"), ("nowhere.md", "file not found"), (".", "must be a regular file")):
        done = quadstep("page", "--story", story, "--engine", "python")
        assert done.code == 2
        assert words in done.err
        assert done.err.count("\n") == 1
    written(tmp_path, one().replace('flight = "case"', 'mission = "absent.toml"'))
    done = quadstep("page", "--story", "story.md")
    assert done.code == 2
    assert "step 1 (First): mission: 'absent.toml': no such file next to story.md" in done.err
    assert not (tmp_path / "out").exists()


def test_a_story_brings_its_own_missions(tmp_path, monkeypatch):
    monkeypatch.setattr(build, "template", lambda: STAND_IN)
    (tmp_path / "a.toml").write_text(MISSION)
    path = written(tmp_path, one().replace('flight = "case"', 'mission = "a.toml"'), one().replace("case", "a"))
    story = read_story(path)
    assert story.of_others
    assert story.missions == [tmp_path / "a.toml"]
    data = data_of(fly_missions([], story=story))
    assert [flight["id"] for flight in data["flights"]] == ["a"]
    assert [step["flight"] for step in data["story"]["steps"]] == ["a", "a"]


def test_the_walk_that_ships_has_its_topics_and_its_flights():
    story = read_story(OWN)
    assert 8 <= len(story.steps) <= 12
    assert all(path.is_file() for path in story.missions)
    known = {name.replace("_", "-") for name in main_cases()} | {stress_id(t, 1.0, True) for t in (6.0, 3.0)}
    assert {step.settings.flight for step in story.steps} - {None} <= known
    assert {"net", "weights", "attitude"} <= {step.settings.watch for step in story.steps}
    for step in story.steps:
        assert 2 <= sum(text.count(". ") + text.count("? ") + text.endswith((".", "?")) for text in step.text) <= 4


def step_on(flight, moved):
    """The first step of the walk that ships which moves this of this flight."""
    steps = (one.settings for one in read_story(OWN).steps)
    return next(one for one in steps if moved == one.move and flight in (one.flight, one.mission))


def measured(mission):
    log = fly(mission.plan())
    return log, mission.flight_metrics(log)[0]


def test_what_a_step_says_of_nets_is_what_flies():
    step = step_on(stress_id(6.0, 1.0, True), "nets")
    with_nets, without = (measured(stress(6.0, 1.0, enabled=nets))[1]["position_rmse[m]"] for nets in (True, False))
    assert f"the position is {1e3 * with_nets:.0f} mm" in step.guess.ask
    assert step.guess.answer == f"about {1e3 * without:.0f} mm"


def test_what_the_first_step_says_of_its_gain_is_what_flies():
    step, text = step_on("case3-adaptive", "K_r1"), " ".join(read_story(OWN).steps[0].text)
    start, found = main_cases()["case3_adaptive"].start, {}
    for gain in (1.5, 3.0, 6.0):
        log, metrics = measured(case_3({"type": "backstepping", "K_r1": gain}, start.model_dump(exclude_none=True)))
        outside = np.abs(position_errors(log)[:, :2]).max(axis=1) > 0.05
        found[gain] = log.column("t")[np.flatnonzero(outside)[-1] + 1], np.degrees(metrics["largest_tilt[rad]"])
    assert step.guess.show == {"K_r1": 1.5} and step.guess.answer == "later"
    assert f"5 cm after {found[1.5][0]:.1f} s instead of {found[3.0][0]:.1f} s." in text
    assert f"{found[6.0][0]:.1f} s, for a tilt of {found[6.0][1]:.0f}° instead of {found[3.0][1]:.0f}°." in text
    assert found[1.5][0] < step.window[1]


def test_what_a_step_says_of_tilt_and_time_is_what_flies_and_what_physics_says():
    step = step_on("case1", "t_f")
    text = " ".join(next(one for one in read_story(OWN).steps if one.settings == step).text)

    def tilt(duration, scale, nets=True):
        own = {"type": "backstepping", "nets": {"enabled": nets}}
        simulation, disturbance = {"duration": duration}, {"scale": scale}
        mission = case_1(duration=duration, simulation=simulation, disturbance=disturbance, controller=own)
        return measured(mission)[1]["largest_tilt[rad]"]

    calm, fast = tilt(6.0, 0.0), tilt(4.0, 0.0)
    assert step.set == {"t_f": 6.0, "disturbance": 0.0} and f"up to {np.degrees(calm):.0f}°" in step.guess.ask
    squared = np.arctan(np.tan(calm) * (6.0 / 4.0) ** 2)
    assert [one.split("°")[0] for one in step.guess.choices] == [
        f"{np.degrees(one):.0f}" for one in (1.5 * calm, squared, fast)
    ]
    assert step.guess.answer == step.guess.choices[2]
    assert f"it would be {np.degrees(tilt(4.0, 1.0)):.0f}° in 4 s" in text
    assert f"(without them, {np.degrees(tilt(4.0, 1.0, nets=False)):.0f}°)" in text
    share, climbs = np.linspace(0.0, 1.0, 4001), []
    for duration, largest in ((4.0, fast), (6.0, calm)):
        x, y, z = ((60 * share - 180 * share**2 + 120 * share**3) * way / duration**2 for way in (20.0, 5.0, 10.0))
        tangent = np.hypot(x, y) / (9.81 + z)
        assert np.arctan(tangent.max()) == pytest.approx(largest, abs=0.01)
        climbs.append(f"−{-z[tangent.argmax()]:.1f} m/s²")
    assert f"{climbs[0]} instead of {climbs[1]} at the largest tilt" in text


def test_the_lowest_gain_that_flies_as_commanded_is_within_what_its_step_wants():
    step = step_on("case1", "K_r2")
    (low,) = step.success["tilt"]
    assert step.set == {"t_f": 6.0}

    def flown(gain):
        controller = {"type": "backstepping", "K_r2": gain}
        _, metrics = measured(case_1(duration=6.0, simulation={"duration": 6.0}, controller=controller))
        return graded(metrics).grade, metrics["largest_tilt[rad]"]

    assert step.as_commanded and flown(83.0)[0] is FlightGrade.LOST
    assert flown(84.0)[0] is flown(94.0)[0] is FlightGrade.FLEW_BUT  # which are not done, whatever their tilt
    (lowest, tilt), (higher, less) = flown(95.0), flown(97.0)
    assert lowest is higher is FlightGrade.AS_COMMANDED and less < low < tilt
    assert step.solution == {"K_r2": 95.0}


def test_where_the_printed_theorem_ends_a_flight_is_done_only_if_its_swings_die_out():
    step = next(one.settings for one in read_story(OWN).steps if "Lambda2" in one.settings.set)
    _, most = step.success["rmse"]

    def flown(gain):
        controller = {"type": "backstepping", "Lambda2": step.set["Lambda2"], "K_r2": gain}
        log, metrics = measured(case_1(controller=controller, disturbance={"scale": 0.0}))
        off = np.abs(log.column("theta_d") - log.column("theta"))
        end = off[log.column("t") >= 35.0].max()
        return graded(metrics).grade is FlightGrade.AS_COMMANDED and metrics["position_rmse[m]"] <= most, end

    _, calm = flown(step.set["K_r2"])
    judged = [(gain, *flown(gain)) for gain in (75.0, 80.0, 85.0, 87.0, step.solution["K_r2"], 400.0)]
    assert [done for _, done, _ in judged] == [False, False, False, True, True, True]
    assert all((end < 1.25 * calm) == done for _, done, end in judged), judged


def test_what_the_repair_achieves_is_what_flies():
    step = step_on(stress_id(3.0, 1.0, True), "controller")
    printed = stress(3.0, 1.0)
    assert graded(measured(printed)[1]).grade is FlightGrade.LOST
    laws = {
        "disturbance": printed.disturbance,
        "simulation": printed.simulation,
        "controller": {"type": step.guess.controller},
    }
    assert graded(measured(case_1(duration=3.0, **laws))[1]).labels == ("shaking",) and step.guess.answer.endswith(
        "but not as commanded"
    )


def test_the_loops_at_rest_of_a_walks_own_missions_are_graded(tmp_path):
    mission = (OWN.parent / "wind.toml").read_text(encoding="utf-8")
    (tmp_path / "a.toml").write_text(mission, encoding="utf-8")
    story = read_story(written(tmp_path, one().replace('flight = "case"', 'mission = "a.toml"').replace("K_r1", "k_x")))
    data = data_of(fly_missions([], story=story, grading=lambda _: {"grade": "fragile", "why": "phase margin 1°"}))
    assert [flight["margins"] for flight in data["flights"]] == ["fragile, phase margin 1°"]


def test_what_a_step_says_of_wind_is_what_flies():
    step = step_on("wind.toml", "wind")
    mission = read_mission(OWN.parent / "wind.toml")
    winds = [mission, mission.model_copy(update={"wind": mission.wind.model_copy(update={"mean": step.guess.show["wind"]})})]
    weak, strong = (measured(one) for one in winds)
    assert f"its RMSE is {weak[1]['position_rmse[m]']:.2f} m" in step.guess.ask
    assert step.guess.answer.startswith(f"{strong[1]['position_rmse[m]']:.2f} m, less than twice")
    for log, _ in (weak, strong):
        t, off = log.column("t"), np.linalg.norm(position_errors(log), axis=1)
        assert f"{np.sqrt(np.mean(off[t >= 5.0] ** 2)):.2f}" == "0.12" and t[off.argmax()] < 2.0


def test_the_wind_of_a_step_can_be_raised_further():
    step = step_on("wind.toml", "wind")
    (flight,) = data_of(fly_missions([OWN.parent / "wind.toml"]))["flights"]
    (wind,) = (one for one in flight["controls"] if one["id"] == "wind")
    assert max(step.guess.show["wind"]) <= 0.7 * wind["max"]


@pytest.mark.parametrize(("left", "above"), [(0.46, True), (0.45, False)])
def test_a_rotor_may_fail_as_far_as_its_step_wants(left, above):
    mission = read_mission(OWN.parent / "rotor.toml")
    (event,) = mission.events
    log, metrics = measured(mission.model_copy(update={"events": (event.model_copy(update={"efficiency": left}),)}))
    step = step_on("rotor.toml", "fault_1")
    low, high = step.success["largest"]
    assert (step.solution == {"fault_1": left}) == above
    assert (low < metrics["largest_error[m]"] < high) == above == (log.column("z").min() > 0.0)
    assert log.column("z_d").min() == high


def test_the_loop_at_rest_of_a_stress_flight_is_that_of_case_1():
    flights = [case_1(), stress_flights()[3.0, 5.0, True], stress_flights()[20.0, 0.0, True]]
    assert {grade(one)[:2] for one in flights} == {("fragile", "phase margin 29.4° in thrust (less than 30.0°)")}


@needs_node
def test_the_net_that_is_shown_is_the_one_that_flies(tmp_path, case):
    """Its weights have the norm of the log, its force is W^T mu, and what it should make is Eq. 67 the other way round."""
    (answer,) = fly_page(write_page(tmp_path / "page.html", case), {"flight": "case", "net": True})
    rows = np.reshape(answer["net"], (-1, 4 * NEURONS + 6))[: answer["rows"]]
    names = [name for name, _ in answer["columns"]]
    x_dot, phi_dot, norm = (answer["values"][:, names.index(name)] for name in ("x_dot", "phi_dot", "norm_W1"))
    mu, weights = rows[:, :NEURONS], rows[:, NEURONS : 4 * NEURONS].reshape(-1, NEURONS, 3)
    assert (mu[:, 10:] == 0.0).all()  # neurons that the file does not have
    assert (mu[:, :10] > 0.0).all() and (mu[:, :10] < 1.0).all()
    np.testing.assert_allclose(rows[:, -6:-3], np.einsum("rn,rna->ra", mu, weights), atol=1e-12)
    assert np.abs(np.linalg.norm(weights, axis=(1, 2)) - norm).max() < 0.05 * norm.max()  # a sample later than the log's
    np.testing.assert_array_equal(rows[:, -3], -(x_dot * phi_dot))
