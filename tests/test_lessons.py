"""The exercises of the lessons grade themselves: each can be solved, none is by the lesson's own mission."""

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
import tomlkit

from docs.site.listings import Kind, listings
from docs.site.notebooks import lessons, notebook
from docs.site.writing import write_pages
from quadstep import fly, fly_all, read_mission
from quadstep.io.errors import UserError
from quadstep.linear.grade import Grade
from quadstep.mission.fields import plain
from quadstep.studies.lessons import LessonTask, MeasuredMission, check_tasks, differing_keys, judge_flight, tasks
from tests.commands import quadstep

ROOT = Path(__file__).parent.parent
LESSONS = {path.name[:2]: path for path in sorted(Path("docs/lessons").glob("[01]*.toml"))}

CIRCLE = {"type": "circle", "radius": 2.0, "period": 5.0, "ramp": 2.2}
SIDEWAYS = {"type": "minimum-jerk", "start": [0.0, 0.0, 2.0], "end": [0.0, 2.0, 2.0], "duration": 3.8}
SLOWER = {"type": "backstepping", "nets": {"F1": 2.0}}
INTEGRAL = {"type": "backstepping", "nets": {"enabled": False}, "K_i1": 2.0}
FAR = {"start.position": [-20.0, 0.0, 0.0], "simulation.duration": 20.0}
OWN_INTEGRAL = {"type": "my_backstepping.py:MyBackstepping", "integral": 30.0}
ROTOR = [{"type": "rotor", "time": 3.0, "rotor": 1, "efficiency": 0.7}]

SOLUTIONS = {
    "1.4": {"start.velocity": [0.02, 0.0, 0.0]},
    "1.5": {"path": SIDEWAYS, "start": {}},
    "2.4": {"path.duration": 11.4},
    "2.5": {"path": CIRCLE},
    "3.4": {"controller.Lambda1": 3.0, "controller.K_r1": 6.0},
    "3.5": {"controller.mass": 0.8, "controller.K_i1": 2.0},
    "3.6": {"controller": {"type": "my_backstepping.py:MyBackstepping"}},
    "4.4": {"path.duration": 4.25},
    "4.5": {"path.duration": 6.15},
    "5.4": {"controller.K_r2": 100.0, "controller.Lambda2": 6.0},
    "5.5": {"controller.type": "completed-backstepping", "controller.K_r2": 10.0, "controller.Lambda2": 0.5},
    "6.4": {"controller.nets.F1": 10.0},
    "6.5": {"controller.nets.neurons": 8, "controller.nets.F1": 11.0},
    "6.7": {"controller": {**OWN_INTEGRAL, "stiffness": 6000.0, "damping": 250.0}},
    "7.4": {"controller.nets.F1": 3.0},
    "7.5": {"controller.nets.F1": 2.0, "path.duration": 2.75},
    "7.6": {"path.duration": 8.0, "controller.K_r1": 6.0, "controller.nets.F1": 6.0},
    "8.4": {"disturbance.scale": 2.5, "controller": SLOWER},
    "8.5": {"disturbance.scale": 3.0, "controller": INTEGRAL},
    "8.6": {"disturbance.scale": 0.0, "controller.Lambda2": 0.6, "controller.K_r2": 6.1},
    "9.4": {"controller.pace": 1.25},
    "9.5": {"controller": {"type": "catching_up.py:CatchingUp"}, **FAR},
    "10.4": {"controller": {"type": "indi"}, "events": ROTOR},
    "10.5": {"controller.K_r1": 4.5, "controller.nets.F1": 2.5, "wind.mean": [10.0, 0.0, 0.0]},
}


def mission_of(name, folder, changes):
    file = folder / "mine.toml"
    file.write_text(LESSONS[name.partition(".")[0].zfill(2)].read_text())
    lesson = read_mission(file)
    file.write_text(tomlkit.dumps(plain(lesson.with_(changes).model_dump(exclude_unset=True))))
    return file


def write_laws(folder):
    """The laws of the solutions: an example, and the model answers that lessons 3 and 9 show."""
    (folder / "own_controller.py").write_text(Path("examples/own_controller.py").read_text())
    for lesson in ("03", "09"):
        (law,) = (one for one in listings(LESSONS[lesson].with_suffix(".md").read_text()) if "file" in one.marks)
        (folder / law.marks["file"]).write_text(law.text)
    mine = (folder / "my_backstepping.py").read_text()
    (folder / "wrong_sign.py").write_text(mine.replace("+ gains.k_r * r1", "- gains.k_r * r1"))


def untypeset(text):
    """A text without what sets its symbols: `K_r1` of a task is $K_{r1}$ in the lesson, `Lambda1` is $\\Lambda_1$."""
    return re.sub(r"\s+", " ", re.sub(r"[$\\{}_]", "", text))


def test_every_exercise_that_grades_itself_has_a_solution_here_and_stands_in_its_lesson():
    every = [one for number in range(1, 11) for one in tasks(str(number))]
    assert [one.name for one in every] == list(SOLUTIONS)
    for one in every:
        text = LESSONS[one.name.partition(".")[0].zfill(2)].with_suffix(".md").read_text()
        assert untypeset(one.asks) in untypeset(text), one.name


@pytest.mark.parametrize("name", SOLUTIONS)
def test_an_exercise_is_solved_by_a_solution_and_not_by_the_lesson_s_mission(name, tmp_path):
    write_laws(tmp_path)
    (one,) = tasks(name)
    (solved,) = check_tasks([one], read_mission(mission_of(name, tmp_path, SOLUTIONS[name])))
    assert solved.solved, solved.cases
    (given,) = check_tasks([one], read_mission(mission_of(name, tmp_path, {})))
    assert not given.solved


SLOPPY = {"controller": {"type": "nested-saturation", "pace": 0.3}}
SILENT = {"controller.nets.F1": 1e-9}
WRONG_REASON = {
    "1.5": SLOPPY,
    "2.4": SLOPPY,
    "2.5": SLOPPY,
    "4.4": SLOPPY,
    "4.5": SLOPPY,
    "6.4": {**SILENT, "controller.K_i1": 20.0},
    "6.7": {"controller": {"type": "backstepping", "nets": {"enabled": False}, "K_i1": 30.0}},
    "7.4": {**SILENT, "controller.K_i1": 20.0},
    "7.5": SILENT,
    "8.4": SILENT,
    "9.5": {"controller": {"type": "own_controller.py:CascadedPD"}},
    "10.4": {"controller": {"type": "rotation-backstepping", "nets": {"F1": 1.5}}},
}
"""Laws that hardly follow the path, so that they hardly tilt, nets that learn nothing, gains where it takes another law."""


@pytest.mark.parametrize("name", WRONG_REASON)
def test_an_exercise_is_not_solved_for_the_wrong_reason(name, tmp_path):
    write_laws(tmp_path)
    (one,) = tasks(name)
    (found,) = check_tasks([one], read_mission(mission_of(name, tmp_path, {**SOLUTIONS[name], **WRONG_REASON[name]})))
    assert not found.solved


@pytest.mark.parametrize("rate", [3.0, 3.0786, 3.08])
def test_the_derived_gains_of_3_4_solve_it(rate, tmp_path):
    mission = read_mission(mission_of("3.4", tmp_path, {"controller.Lambda1": rate, "controller.K_r1": 2.0 * rate}))
    assert math.atan(0.5 * rate**2 / 9.81) == pytest.approx(0.45, abs=0.025)
    assert 0.45 < fly(mission).metrics()["largest_tilt[rad]"] < 0.465 or rate == 3.0
    assert check_tasks(list(tasks("3.4")), mission)[0].solved


MISTAKES = {
    "1.4": ({"start.velocity": [0.035, 0.0, 0.0]}, "largest error along x should be at most 1.5 mm, but is 2.06 mm"),
    "3.4": (
        {"controller.Lambda1": 2.0, "controller.K_r1": 6.0},
        "RMSE along x should be at most 133 mm, but is 138 mm",
    ),
    "3.6": ({"controller": {"type": "wrong_sign.py:MyBackstepping"}}, "the flight should be completed, but was lost at 1.9 s"),
    "9.5": (
        {"controller": {"type": "own_controller.py:CascadedPD", "k_p": 0.1, "k_v": 0.6}},
        "final error along x should be at most 10 mm, but is 126 mm",
    ),
    "4.4": ({"path.duration": 4.2}, "tilt should be at most 45°, but is 45.8°"),
    "4.5": ({"path.duration": 6.1}, "largest thrust should be at most 11.77 N, but is 11.79 N"),
    "5.4": ({"controller.K_r2": 60.0, "controller.Lambda2": 4.0}, "phase margin should be at least 60°, but is 56.0°"),
    "6.7": ({"controller": OWN_INTEGRAL}, "RMSE should be at most 3 mm, but is 9.66 mm"),
    "7.6": ({"controller.K_r1": 3.0}, "phase margin should be at least 50°, but is 26.8°"),
    "8.6": ({"controller.Lambda2": 15.0, "controller.K_r2": 250.0}, "the flight should be lost, but was completed"),
}
"""What students may try first, and what they are told."""


@pytest.mark.parametrize("name", MISTAKES)
def test_a_student_is_told_what_a_wrong_answer_lacks(name, tmp_path):
    write_laws(tmp_path)
    changes, said = MISTAKES[name]
    (one,) = tasks(name)
    (found,) = check_tasks([one], read_mission(mission_of(name, tmp_path, {**SOLUTIONS[name], **changes})))
    assert not found.solved and not found.strange
    assert any(case.failure and case.failure.startswith(said) for case in found.cases), found.cases


RATE, NEURONS, SCALE = "controller.nets.F1", "controller.nets.neurons", "disturbance.scale"
NETS = "controller.nets.enabled"
QUOTED = {
    "5.5": [({"controller.K_r2": 10.0, "controller.Lambda2": 0.5}, "110 mm"), (SOLUTIONS["5.5"], "3.6 mm")],
    "6.5": [
        ({NEURONS: 8}, "3.1 mm"),
        (SOLUTIONS["6.5"], "1.4 mm"),
        ({NEURONS: 4}, "23 mm"),
    ],
    "6.7": [
        (SOLUTIONS["6.7"], "2.4 mm"),
        ({"controller": {"type": OWN_INTEGRAL["type"]}}, "36 mm"),
        ({"controller": {**SOLUTIONS["6.7"]["controller"], "integral": 100.0}}, "lost"),
    ],
    "7.4": [({RATE: 3.0}, "350 mm"), ({RATE: 4.0}, "lost"), ({RATE: 1e-9}, "1.3 m")],
    "7.5": [
        (SOLUTIONS["7.5"], "550 mm"),
        ({"path.duration": 2.75, RATE: 1.0}, "800 mm"),
        ({"path.duration": 2.75, RATE: 2.5}, "lost"),
        ({"path.duration": 2.75, NETS: False}, "1.6 m"),
    ],
    "8.4": [
        (SOLUTIONS["8.4"], "6.4 mm"),
        ({SCALE: 2.5}, "29 mm"),
        ({SCALE: 2.5, RATE: 8.0}, "lost"),
        ({}, "0.87 mm"),
        ({RATE: 2.0}, "2.1 mm"),
    ],
    "8.5": [
        (SOLUTIONS["8.5"], "37 mm"),
        ({SCALE: 3.0}, "lost"),
        *(
            ({SCALE: 3.0, "controller": {**INTEGRAL, "K_i1": value}}, said)
            for value, said in ((1.0, "48 mm"), (3.0, "33 mm"), (4.0, "34 mm"))
        ),
        ({SCALE: 3.0, RATE: 0.2}, "71 mm"),
        ({SCALE: 3.0, NETS: False}, "57 mm"),
        *(({SCALE: 3.0, NETS: False, "controller.Lambda1": value}, "53 mm") for value in (1.2, 1.5, 1.8)),
        ({SCALE: 3.0, NETS: False, "controller.K_r1": 3.2}, "87 mm"),
        ({SCALE: 3.0, NETS: False, "controller.K_r1": 3.5}, "lost"),
    ],
}
"""What answers say of flights, the RMSE to two digits."""


@pytest.mark.parametrize("name", QUOTED)
def test_an_answer_quotes_what_its_flights_do(name, tmp_path):
    write_laws(tmp_path)
    lesson, _, exercise = name.partition(".")
    text = LESSONS[lesson.zfill(2)].with_suffix(".md").read_text().partition(f"<details><summary>{exercise}</summary>")[2]
    answer = text.partition("</details>")[0]
    for changes, said in QUOTED[name]:
        flight = fly(read_mission(mission_of(name, tmp_path, changes)))
        size, _, unit = said.partition(" ")
        if said == "lost":
            assert flight.outcome.name != "COMPLETED"
        else:
            rmse = flight.metrics()["position_rmse[m]"] * {"m": 1.0, "mm": 1000.0}[unit]
            assert float(f"{rmse:.2g}") == float(size), changes
        assert said in answer, said


EVENINGS = {
    "02": "4.25 s: jerk 7.70 m^2/s^5, tilt 9.0 deg; same path: True\n"
    "5.0 s: jerk 10.18 m^2/s^5, tilt 12.0 deg; same path: True\n",
    "04": "rise 1.39: thrust\nflown and computed differ by at most 0.28 deg, 0.033 N\n",
    "05": "68.8 deg; downwards 24.4 dB at 7.0 rad/s\n19.8 rad/s: 64.0 deg; downwards 17.6 dB at 4.6 rad/s\n",
    "07": "2.5 s: 1.7; exceptions: [1.0, 4.25]\n3.0 s: 3.6; exceptions: []\n3.5 s: 5.2; exceptions: []\n"
    "4.0 s: 6.9; exceptions: []\n5.0 s: 9.2; exceptions: []\n6.0 s: 10.9; exceptions: []\n",
    "08": "median of the ratio 2.2, of the means 0.42\nterm: 0.053 mJ\nat most: 0.152 mJ\n"
    "K |r|^2: 0.365 mJ\ndamping: 25.562 mJ\n",
}
"""What the answers to exercises of an evening print at their end, from which their sentences have their numbers."""


@pytest.mark.parametrize("lesson", EVENINGS)
def test_the_answer_to_an_exercise_of_an_evening_prints_what_it_says(lesson, capsys):
    text = LESSONS[lesson].with_suffix(".md").read_text()
    *_, answer = (one.text for one in listings(text) if one.kind is Kind.PYTHON)
    mission = read_mission(LESSONS[lesson])
    known = {"np": np, "degrees": math.degrees, "fly": fly, "fly_all": fly_all, "mission": mission, "flight": fly(mission)}
    exec(answer, known)
    printed = capsys.readouterr().out
    assert printed.endswith(EVENINGS[lesson])
    if lesson == "04":
        decided = re.findall(r"rise (.*): (\w+)", printed)
        assert {by for _, by in decided} == {"tilt", "thrust"}
        assert all((float(rise) > 0.49) == (by == "thrust") for rise, by in decided)


def test_a_flight_is_not_lost_as_asked_by_gains_that_the_exercise_excludes(tmp_path):
    (one,) = tasks("8.6")
    (found,) = check_tasks([one], read_mission(mission_of("8.6", tmp_path, {**SOLUTIONS["8.6"], "controller.K_r2": 5.0})))
    assert [case.failure for case in found.cases if case.failure] == [
        "controller.K_r2 should be at least 6.1 N m s, but is 5.00 N m s"
    ]


MEDDLING = {
    "1.4": [{"vehicle.mass": 1.1}, {"controller.K_r1": 9.0}, {"start.position": [0.0, 0.0, 2.1]}],
    "2.4": [{"vehicle.inertia": [1.0, 1.0, 1.0]}, {"simulation.duration": 2.0}],
    "3.5": [{"vehicle.mass": 0.8}, {"controller.K_r1": [3.0, 3.0, 250.0]}],
    "10.5": [{"controller": {"type": "indi"}}],
    "10.4": [{"vehicle.mass": 2.0}, {"margins.gain": 0.0}, {"sensors.position_noise": 0.0}, {"wind.turbulence.wind_20": 0.0},
        {"path.width": 0.1}, {"events": [*ROTOR, {"type": "rotor", "time": 3.1, "rotor": 1, "efficiency": 1.0}]}],
}  # fmt: skip


@pytest.mark.parametrize(("name", "changes"), [(name, one) for name, listed in MEDDLING.items() for one in listed])
def test_a_student_who_changes_more_than_the_exercise_lets_them_solves_nothing(name, changes, tmp_path):
    (one,) = tasks(name)
    (found,) = check_tasks([one], read_mission(mission_of(name, tmp_path, {**SOLUTIONS[name], **changes})))
    assert found.strange and not found.solved
    assert all(case.name.startswith(next(iter(changes))) for case in found.cases), found.cases


def test_a_course_that_leaves_out_what_a_mission_needs_says_so(tmp_path):
    mission = read_mission(mission_of("4.4", tmp_path, {}))
    task = LessonTask(name="a", asks="Fly.", same={"path.type": "minimum-jerk"}, free=("path.duration",))
    (case,) = differing_keys(task, mission, plain(mission.model_dump()))
    assert case.failure == "only path.type, path.duration may be given; with these alone: path.end is required: end point [m]"


def test_what_moves_no_flight_may_be_given(tmp_path):
    (one,) = tasks("4.4")
    tune = {"gains": {"controller.K_r1": {"low": 1.0, "high": 9.0}}}
    mission = read_mission(mission_of("4.4", tmp_path, {**SOLUTIONS["4.4"], "name": "Mine", "tune": tune}))
    assert not differing_keys(one, mission, plain(mission.model_dump()))


def test_hints_are_folded_below_their_exercises_and_a_lesson_says_what_its_row_of_the_table_does():
    table = (ROOT / "docs/lessons/index.md").read_text()
    for page in lessons():
        text = (ROOT / page).read_text()
        exercises = text.partition("## Exercises")[2].partition("## Answers")[0]
        count = len(re.findall(r"^\d\. ", exercises, re.MULTILINE))
        assert count >= 5
        assert len(re.findall(r"^<details><summary>\d</summary>", text, re.MULTILINE)) == count
        hints = re.findall(r"^ {3}<details><summary>Hint</summary>", exercises, re.MULTILINE)
        assert len(hints) == exercises.count("Hint") > 0
        needs, hours, half = re.search(rf"{page.name}\) \| .* \| (.*) \| \d \| (\d)(½?) h", table).groups()
        assert f"You need {needs}. The exercises take about {60 * int(hours) + 30 * bool(half)} minutes" in text, page.name


def test_notebooks_have_cells_that_nbgrader_strips_and_grades(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for page in lessons():
        made = notebook(page)["cells"]
        graded = [one for one in made if "nbgrader" in one["metadata"]]
        named = [one["metadata"]["nbgrader"]["grade_id"] for one in graded]
        numbers = [one.name.replace(".", "-") for one in tasks(f"{int(page.name[:2])}")]
        assert named == [f"{kind}-{number}" for number in numbers for kind in ("exercise", "check")]
        assert len({one["id"] for one in made}) == len(made)
        for text in (one["source"] for one in made if one["cell_type"] == "markdown"):
            folds = re.findall(r"<(/?)details>", text)
            assert folds == ["", "/"] * (len(folds) // 2), "a hint or an answer would stand open, or hide what follows it"
    made = notebook(lessons()[3])["cells"]
    text = "\n".join(one["source"] for one in made)
    assert "**Exercise 4.4.** Fly the lesson's path within 4.26 s" in text
    assert "`exercise_4_4 = mission.with_(" in text, "nbgrader empties the cell that is to be filled"
    assert "well conditioned only far from the x axis" in text
    assert "`duration = 4.25`" not in text, "the answers to what is graded stay on the site"
    monkeypatch.setattr("docs.site.writing.pages", lambda: {lessons()[3]: "lessons/04-inversion.md"})
    for answers in (True, False):
        write_pages(tmp_path / "site", {}, tmp_path, answers)
        page = (tmp_path / "site/lessons/04-inversion.md").read_text()
        assert ("`duration = 4.25`" in page) == answers and "<summary>3</summary>" in page
    assert [one["metadata"]["nbgrader"] for one in made if "nbgrader" in one["metadata"]][:2] == [
        {"schema_version": 3, "grade_id": "exercise-4-4", "grade": False, "solution": True, "locked": False, "task": False},
        {
            "schema_version": 3,
            "grade_id": "check-4-4",
            "grade": True,
            "solution": False,
            "locked": True,
            "task": False,
            "points": 1,
        },
    ]
    check = next(one["source"] for one in made if one["metadata"].get("nbgrader", {}).get("grade_id") == "check-4-4")
    mission = read_mission(ROOT / LESSONS["04"])
    exec(check, {"exercise_4_4": mission.with_(path__duration=4.25)})
    with pytest.raises(AssertionError, match=r"path\.duration should be at most 4\.26 s, but is 5.00 s$"):
        exec(check, {"exercise_4_4": mission})


def test_check_says_what_is_not_met_and_gives_a_hint(tmp_path):
    file = mission_of("4.4", tmp_path, {})
    alone = quadstep("check", "4.4", "--hint")
    assert alone.code == 0 and alone.out.startswith("4.4: ")
    run = quadstep("check", "4.4", file, "--hint")
    assert run.code == 4
    assert "4.4 not solved" in run.out
    assert "NOT MET: path.duration should be at most 4.26 s, but is 5.00 s\n" in run.out
    assert "Hint: The vehicle tilts most while it brakes" in run.out


def test_a_missing_fault_is_one_line(tmp_path):
    (found,) = check_tasks(tasks("10.4"), read_mission(LESSONS["10"]))
    assert [one.sentence for one in found.cases] == [
        'NOT MET: the mission has no [[events]] with type = "rotor", time = 3.0, efficiency = 0.7, rotor = 1'
    ]


@pytest.mark.parametrize(("name", "said"), [
    ("9.1", "lesson 9 has no graded exercise 9.1, only 9.4 and 9.5"),
    ("8.9", "lesson 8 has no graded exercise 8.9, only 8.4, 8.5 and 8.6"),
    ("11", "unknown lesson or exercise '11'; allowed: 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 1.4, 1.5, "),
])  # fmt: skip
def test_an_exercise_that_grades_nothing_is_said_to_be_none(name, said):
    with pytest.raises(UserError, match=f"^{re.escape(said)}") as refused:
        tasks(name)
    assert "did you mean" not in str(refused.value)


def test_of_a_lesson_those_exercises_are_checked_that_the_mission_is_for(tmp_path):
    run = quadstep("check", "6", mission_of("6.4", tmp_path, SOLUTIONS["6.4"]), "--json")
    assert run.code == 0
    found = json.loads(run.out)["exercises"]
    assert [(one["name"], one["solved"], one["checked"]) for one in found] == [
        ("6.4", True, True),
        ("6.5", False, False),
        ("6.7", False, False),
    ]


def test_what_of_a_lesson_is_not_checked_is_named(tmp_path):
    junit = tmp_path / "verdict.xml"
    run = quadstep("check", "6", mission_of("6.4", tmp_path, SOLUTIONS["6.4"]), "--junit", junit)
    assert run.out.startswith("Not counted (asks for a different mission): 6.5, 6.7.\n6.4 solved")
    assert 'name="quadstep check: 6 (not counted: 6.5, 6.7)"' in junit.read_text(encoding="utf-8")


def test_a_lesson_is_solved_by_a_solution_of_one_of_two_exercises_that_the_mission_fits(tmp_path):
    run = quadstep("check", "4", mission_of("4.5", tmp_path, SOLUTIONS["4.5"]))
    assert run.code == 0
    assert run.out.startswith("Not counted (for such a mission, but not solved): 4.4.\n4.5 solved")
    assert "NOT MET" not in run.out
    neither = quadstep("check", "4", mission_of("4.5", tmp_path, {"path.duration": 4.2}))
    assert neither.code == 4
    assert "4.4 not solved" in neither.out and "4.5 not solved" in neither.out


def test_what_is_asked_stands_alone_and_its_limits_are_those_that_check_prints(tmp_path):
    said = {one.name: one.asks for number in range(1, 11) for one in tasks(str(number))}
    assert not [asks for asks in said.values() if re.search(r"\b[Tt]he same (with|in)\b|\bfly it\b", asks)]
    for name in ("1.5", "2.5", "9.5"):
        write_laws(tmp_path)
        (found,) = check_tasks(tasks(name), read_mission(mission_of(name, tmp_path, SOLUTIONS[name])))
        (tilt,) = (case.name for case in found.cases if case.name.startswith("tilt at most "))
        assert f"({tilt.removeprefix('tilt at most ')})" in said[name]


def test_a_mission_of_another_lesson_is_said_to_be_one():
    run = quadstep("check", "5", LESSONS["07"])
    assert run.code == 4
    assert run.out.startswith("This is not a mission of lesson 5: it fits none of its exercises.")
    assert "NOT MET" not in run.out + run.err


def test_a_flight_that_is_lost_solves_nothing(tmp_path):
    run = quadstep("check", "7.4", LESSONS["07"])
    assert run.code == 4
    assert [line.partition(" at ")[0] for line in run.out.splitlines() if "NOT MET" in line] == [
        "  NOT MET: the flight should be completed, but was lost"
    ]


def test_limits_of_a_flight_that_has_to_be_lost_are_those_of_its_metrics():
    task, lost = LessonTask(name="a", asks="Lose it.", lost=True, most={"largest_tilt": 1.0}), "was lost at 2 s"
    for tilt, met in ((0.5, True), (1.5, False)):
        measured = MeasuredMission({"largest_tilt[rad]": tilt}, None, lost)
        cases = judge_flight(task, read_mission(LESSONS["07"]), {}, measured)
        assert [case.failure is None for case in cases] == [True, met]


def test_a_course_may_have_exercises_of_its_own(tmp_path):
    course = tmp_path / "course.toml"
    course.write_text('[[tasks]]\nname = "a"\nasks = "Fly well."\nmost = { position_rmse = 1.0 }\n')
    assert quadstep("check", "a", LESSONS["02"], "--course", course).code == 0


def test_a_limit_may_be_of_a_gain_that_the_mission_leaves_out(tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text(
        '[vehicle]\npreset = "x500"\n[controller]\ntype = "pid"\n[simulation]\nduration = 0.1\n'
        '[path]\ntype = "step"\nstart = [0, 0, 5]\nend = [0, 0, 5]\ntime = 0.0\nduration = 0.1\n'
    )
    for most, solved in ((1000.0, True), (1e-3, False)):
        task = LessonTask(name="a", asks="Be gentle.", most={"controller.rate": most})
        mission = read_mission(file)
        (_, limit) = judge_flight(task, mission, plain(mission.model_dump()), MeasuredMission({}, None, None))
        assert (limit.failure is None) == solved, limit


def test_a_loop_is_graded_where_a_course_asks_for_it():
    mission = read_mission(LESSONS["02"])
    task = LessonTask(name="a", asks="Fly.", grade="sound")
    said = {
        word: judge_flight(task, mission, {}, MeasuredMission({}, Grade(word, "30.1 ms"), None))[-1].failure
        for word in ("sound", "fragile", "unstable")
    }
    assert said["sound"] is None
    assert said["fragile"] == "the loop should be sound, but is fragile: 30.1 ms"
    assert said["unstable"]


@pytest.mark.parametrize(("content", "said"), [
    ('[[tasks]]\nname = "a"\nasks = "Fly."\nmost = { postion_rmse = 1.0 }\n', "did you mean position_rmse? Allowed: any"),
    ('[[tasks]]\nname = "a"\nasks = "Fly."\ngrade = "good"\n', "tasks[0].grade"),
    ("tasks = []\n", "tasks: "),
    ('[[tasks]]\nname = "b"\nasks = "Fly."\n', "unknown lesson or exercise 'a'; allowed: b"),
    ('[[tasks]]\nname = "a"\nasks = "Fly."\nmost = { position_rmse = nan }\n', "most"),
])  # fmt: skip
def test_wrong_exercises_are_one_line(content, said, tmp_path):
    course = tmp_path / "course.toml"
    course.write_text(content)
    run = quadstep("check", "a", LESSONS["02"], "--course", course)
    assert run.refused
    assert said in run.err


@pytest.mark.parametrize("mission", ["nowhere.toml", "docs", "docs/index.md"])
def test_a_mission_that_cannot_be_read_is_one_line(mission):
    assert quadstep("check", "2", mission).refused


def test_a_mission_may_change_by_dotted_keys_and_by_words():
    lesson = read_mission(LESSONS["03"])
    changed = lesson.with_({"path.end.2": 4.0}, controller__K_r1=5.0, controller__nets__enabled=True)
    assert changed.path.end == (5.0, 2.0, 4.0)
    assert changed.controller.K_r1 == (5.0, 5.0, 5.0)
    assert changed.controller.nets.enabled
    assert lesson.with_() == lesson
    assert changed.folder == lesson.folder
    with pytest.raises(UserError, match="finish: unknown key"):
        lesson.with_(path__finish=1.0)
