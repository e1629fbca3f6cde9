"""`quadstep tune` as a user runs it: its files and output, and one line for every mistake."""

import re
import sys
import tomllib

import pytest

from quadstep import read_mission
from quadstep.engines.fly import fingerprint
from quadstep.metrics.registry import NO_REST
from quadstep.mission.read import plan_mission
from quadstep.report import canvas
from quadstep.report.sheet import Sheet
from quadstep.studies.tuning import run
from quadstep.studies.tuning.ground import UNSEEN, CandidateFlyer, read_request
from quadstep.studies.tuning.report import caution, near_ends
from tests.commands import metrics, quadstep
from tests.missions import EXAMPLES
from tests.tuning import LAMBDA, PAPER, SOFT, WINDY, history, lasting, tuned, written

pytestmark = pytest.mark.usefixtures("undrawn", "ungraded")

QUICK = PAPER + LAMBDA


def tune(path, out, budget=60, *more):
    return quadstep("tune", path, "--budget", budget, "--out", out, *more)


def test_what_it_writes_and_says(tmp_path, monkeypatch):
    monkeypatch.undo()
    path, out = written(tmp_path, QUICK), tmp_path / "out"
    done = tune(path, out)
    assert (done.code, done.err) == (0, "")
    better = "The tuned gains are better on the one flight that they were tuned on"
    assert better in done.out
    assert "\nLambda1 [1/s] " in done.out
    report = (out / "report.html").read_text(encoding="utf-8")
    assert "<p>Nothing is random in this mission, so there is one flight with each set of gains." in report
    grade = metrics(out)["margins_at_rest"]
    assert grade["grade"] in ("fragile", "unstable")
    rest = f"Hovering at the start of its path, the loop with the tuned gains is {grade['grade']}: "
    between = r"(The price: [^<]*\. )?The flight shown [^<]*: large error\. "
    assert re.search(rf"{better}: the objective falls by [\d.]+\s%\.</p><p>{between}{rest}", report)
    assert rest in done.out.replace("\n", " ")
    assert "unseen flights" not in report
    assert "1/s]" in report
    assert "bound" not in report + done.out
    figures = ["before_after.png", "before_after.svg", "convergence.png", "convergence.svg"]
    assert "The one flight: a position RMSE of " in report and "decay rate of the position error" in report
    assert re.search(r"^Lambda1 \[1/s\] +1\.000 +([\d.]+)\d +\1$", done.out, re.MULTILINE), "by what factor it changes"
    assert lasting(out) == [*figures, "history.csv", "metrics.json", "report.html", "table.tex", "tuned.toml"]
    table = (out / "table.tex").read_text(encoding="utf-8")
    assert "& current & tuned & tuned - current" in table
    assert r"position RMSE" in table
    before, after = tomllib.loads(QUICK), tuned(out)
    gains = after["controller"].pop("Lambda1")
    assert after == before, "nothing else has changed"
    assert gains == [metrics(out)["tuned"][f"controller.Lambda1.{i}"] for i in range(3)]
    text = (out / "tuned.toml").read_text(encoding="utf-8")
    assert all(line in text for line in QUICK.splitlines()), "every line of the user's is still there"
    flown = quadstep("fly", out / "tuned.toml", "--out", tmp_path / "flown")
    assert flown.code == 0
    rows = history(out)
    assert (rows[0]["run"], rows[0]["generation"], rows[0]["controller.Lambda1.0"]) == ("0", "0", "1.0")
    assert min(float(row["objective"]) for row in rows) == metrics(out)["unseen"]["rows"][0]["tuned"]["value"]


REST = " the loop with the tuned gains"


@pytest.mark.parametrize(("present", "tuned", "said"), [
    ("sound", "fragile", f"hovering at the start of its path,{REST} is fragile"),
    ("fragile", "unstable", f"hovering at the start of its path,{REST} is unstable"),
    ("unstable", "unstable", f"hovering at the start of its path,{REST} is unstable"),
    ("not linearised", "unstable", f"hovering at the start of its path,{REST} is unstable"),
    ("sound", None, f"hovering at the start of its path,{REST} is not linearised: ask `quadstep linear`"),
    ("sound", NO_REST, f"no rest was found for{REST}"),
    ("fragile", "fragile", ""),
    ("fragile", "sound", ""),
    (None, None, ""),
])  # fmt: skip
def test_gains_whose_loop_is_worse_say_so_first(present, tuned, said):
    words = caution(*({"grade": one} if one else {} for one in (present, tuned)))
    assert words == (f"Before you fly them: {said}." if said else "")


def test_a_gain_near_the_end_of_its_range_is_named(tmp_path, monkeypatch):
    text = QUICK.replace("high = 30.0", "high = 1.2")
    grades = iter(({"grade": "unstable", "why": "it grows"}, {"grade": "sound", "why": "so"}))
    monkeypatch.setattr("quadstep.linear.grade.quick_grade", lambda _: next(grades))
    done = tune(written(tmp_path, text), tmp_path / "out")
    assert "controller.Lambda1 is near its upper bound; a wider range may give more." in done.out
    assert "near its upper bound" in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    rest = "hovering at the start of its path, the loop with the tuned gains is unstable"
    said = f"Before you fly them: {rest}: it grows."
    assert done.out.lower().count(rest) == 1, "not again below"
    assert done.out.replace("\n", " ").startswith(said)
    assert (tmp_path / "out" / "tuned.toml").read_text().startswith(f"# {said}\n")
    report = re.sub("</p><p>", " ", (tmp_path / "out" / "report.html").read_text(encoding="utf-8"))
    assert f'<p class="answer">{said} The tuned gains' in report


@pytest.mark.parametrize("width", [None, 84.0])
@pytest.mark.parametrize("many", [1, 2])
def test_every_legend_is_inside_its_picture(tmp_path, monkeypatch, width, many):
    monkeypatch.undo()
    seen = []

    def look(figure, path, sheet):
        original(figure, path, sheet)
        figure.draw_without_rendering()
        legends = [*figure.legends, *(axes.get_legend() for axes in figure.axes if axes.get_legend())]
        seen.extend((one.get_window_extent(), figure.bbox) for one in legends)

    original = canvas.write
    monkeypatch.setattr(canvas, "write", look)
    text = QUICK + "controller.K_r1 = { low = 0.3, high = 30.0 }\n" * (many - 1)
    run.tune(written(tmp_path, text), 60, tmp_path / "out", sheet=Sheet(width=width))
    assert seen and all(whole.y0 <= one.y0 and one.y1 <= whole.y1 and one.x1 <= whole.x1 for one, whole in seen)


def test_what_the_gains_cannot_change_and_where_they_end_is_said(tmp_path):
    text = QUICK.replace("controller.Lambda1 = { low = 0.3", "controller.Lambda1 = { low = 0.99").replace(
        "high = 30.0", "high = 2.999"
    )
    out = tmp_path / "out"
    done = tune(written(tmp_path, text), out)
    begun = (
        "With the tuned gains: in 1 of 1 completed flight the largest error is the one at the start, which is off the path."
    )
    assert begun in done.out and begun in (out / "report.html").read_text(encoding="utf-8")
    assert "The objective is position RMSE [m].\n" in done.out
    flown = f"{len(history(out)):,} in the search and 2 in the comparison, {metrics(out)['flights']:,} of a budget of 60."
    assert flown in (out / "report.html").read_text(encoding="utf-8")
    values = {f"controller.{name}.{axis}": value for name, value in (("Lambda1", 2.98), ("K_r1", 3.0)) for axis in range(3)}
    near = near_ends(read_request(written(tmp_path, QUICK + "controller.K_r1 = { low = 0.3, high = 40.0 }\n")), values)
    assert near == {"controller.K_r1": "just above 2.98, its limit by Theorem 5.1"}
    one = {key: value for key, value in values.items() if "Lambda1" in key}
    near = near_ends(read_request(written(tmp_path, QUICK.replace("30.0", "3.0"))), one)
    assert near == {"controller.Lambda1": "near its upper bound"}


@pytest.mark.parametrize("start", [0.2, 0.0])
def test_better_gains_with_which_the_flight_is_not_as_commanded_are_said_to_be_so(tmp_path, start):
    """As `fly` grades the mission that is written."""
    text = QUICK.replace("0.2, 0.0, 0.0", f"{start}, 0.0, 0.0").replace("duration = 0.8", "duration = 3.0")
    done = tune(written(tmp_path, text), tmp_path / "out")
    quadstep("fly", tmp_path / "out" / "tuned.toml", "--out", tmp_path / "flown")
    grade, said = metrics(tmp_path / "flown")["grade"], "The flight shown is not as commanded with the tuned gains: "
    assert (said in done.out) == (grade != "as commanded") == (start > 0.0), (done.out, grade)


def test_gains_that_keep_no_constraint_are_not_praised_first(tmp_path):
    done = tune(
        written(tmp_path, QUICK.replace("constraints = {}", "constraints = { position_rmse = 1e-9 }")), tmp_path / "out"
    )
    said = "The best gains found do not keep every constraint: position RMSE misses its limit by "
    assert done.out.startswith(said) and " of it." in done.out
    assert f'<p class="answer">{said}' in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")


@pytest.mark.parametrize("change", [("constraints = {}", "constraints = { phase_margin = 30.0 }"),
                                    ("[tune]", "[margins]\nphase = 30.0\n[tune]")])  # fmt: skip
def test_a_phase_margin_in_degrees_is_refused(tmp_path, change):
    done = tune(written(tmp_path, QUICK.replace(*change)), tmp_path / "out")
    assert done.refused
    assert "phase" in done.err and "3.14" in done.err


def test_the_table_changes_no_flight(tmp_path):
    plans = [read_mission(written(tmp_path, text)).plan() for text in (QUICK, PAPER)]
    assert fingerprint(plans[:1]) == fingerprint(plans[1:])


def test_gains_that_are_no_better_are_called_so(tmp_path, monkeypatch):
    original = CandidateFlyer.fly

    def unlucky(self, candidates, first, count, progress=None):
        flown = original(self, candidates, first, count, progress)
        if first == UNSEEN:
            flown[1].metrics[:] *= 50.0
        return flown

    monkeypatch.setattr(CandidateFlyer, "fly", unlucky)
    done = tune(written(tmp_path, WINDY + SOFT), tmp_path / "out", 200)
    assert done.code == 0
    assert "WORSE on flights they were not tuned on: do not use them" in done.out


def test_a_search_that_finds_nothing_keeps_the_file(tmp_path, monkeypatch):
    text = QUICK.replace("high = 30.0", "high = 1.0")  # the present value is the best there is
    done = tune(written(tmp_path, text), tmp_path / "out", 19)
    assert done.code == 0
    assert "No better gains were found" in done.out
    assert re.search(r"^Lambda1 \[1/s\] .* unchanged$", done.out, re.MULTILINE)
    assert not list((tmp_path / "out").glob("before_after*")), "nothing would be seen on it"
    assert (tmp_path / "out" / "tuned.toml").read_text(encoding="utf-8") == text


def test_files_that_the_mission_names_come_along(tmp_path):
    written(tmp_path / "in" / "deep", "t,x,y,z\n" + "".join(f"{i / 10},{i / 100},0,0\n" for i in range(12)), "path.csv")
    text = QUICK.replace('"minimum-jerk"\nend = [0.4, 0.1, 0.2]\nduration = 0.8', '"recorded"\nfile = "deep/path.csv"')
    done = tune(written(tmp_path / "in", text), tmp_path / "out")
    assert done.code == 0, done
    saved = tmp_path / "out" / "tuned.toml"
    assert plan_mission(read_mission(saved), saved).ticks.last > 200
    text = text.replace('"deep/path.csv"', '"../in/deep/path.csv"')
    done = tune(written(tmp_path / "in", text), tmp_path / "other")
    assert done.code == 0, done
    assert "tuned.toml names ../in/deep/path.csv" in done.out


def test_what_a_vehicle_leaves_out_can_be_tuned(tmp_path):
    text = re.sub(r"k_[xv] = .*\n", "", WINDY).replace('[controller]\ntype = "geometric"\n', "")
    text += SOFT.replace("controller.k_v", "controller.k_R.2").replace("high = 20.0", "high = 90.0")
    done = tune(written(tmp_path, text), tmp_path / "out", 200)
    assert done.code == 0, done
    before = read_mission(tmp_path / "mission.toml")
    after = tuned(tmp_path / "out")["controller"]
    usual = before.controller.gains(before.vehicle.model())
    assert metrics(tmp_path / "out")["present"] == {
        **{f"controller.k_x.{i}": usual.stiffness[i] for i in range(3)},
        "controller.k_R.2": usual.turn_stiffness[2],
    }
    assert after["type"] == "geometric"
    if "k_R" in after:
        assert after["k_R"][:2] == list(usual.turn_stiffness)[:2]


def test_numbers_of_one_gain_keep_their_proportion(tmp_path):
    text = QUICK.replace("K_r1 = [3.0, 3.0, 3.0]", "K_r1 = [5.0, 5.0, 5.0]\nLambda1 = [1.0, 2.0, 0.5]")
    tune(written(tmp_path, text), tmp_path / "out")
    for row in history(tmp_path / "out"):
        x, y, z = (float(row[f"controller.Lambda1.{i}"]) for i in range(3))
        assert (y / x, z / x) == pytest.approx((2.0, 0.5), rel=1e-5)
        assert 0.3 <= x <= 30.0


@pytest.mark.parametrize("where", ["search", "comparison", "picture"])
def test_an_interrupt_leaves_nothing(tmp_path, monkeypatch, where):
    original = CandidateFlyer.fly
    calls = []

    def interrupted(self, candidates, first, count, progress=None):
        calls.append(first)
        if (where == "search" and len(calls) == 3) or (where == "comparison" and first):
            raise KeyboardInterrupt
        return original(self, candidates, first, count, progress)

    def draw(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(CandidateFlyer, "fly", interrupted)
    if where == "picture":
        monkeypatch.setattr(run, "draw_search", draw)
    done = tune(written(tmp_path, QUICK), tmp_path / "deep" / "out", 100)
    assert (done.code, done.err) == (130, "quadstep: interrupted; nothing was written\n")
    assert not (tmp_path / "deep").exists()


def test_results_of_something_else_are_not_replaced(tmp_path):
    path, out = written(tmp_path, QUICK), tmp_path / "out"
    assert tune(path, out).code == 0
    again = (out / "history.csv").read_bytes()
    assert tune(path, out).code == 0
    assert (out / "history.csv").read_bytes() == again
    other = tune(path, out, 100)
    assert other.refused
    assert "--overwrite" in other.err
    assert (out / "history.csv").read_bytes() == again
    assert tune(path, out, 100, "--overwrite").code == 0
    assert (out / "history.csv").read_bytes() != again


def gains(line):
    return PAPER + f"[tune]\n[tune.gains]\n{line}\n"


BAD = {
    "no table": (PAPER, ["[tune] is missing", "controller.K_r1"]),
    "no gains": (PAPER + "[tune]\n", ["tune.gains", "is required: keys of the controller and their ranges"]),
    "empty gains": (PAPER + "[tune]\ngains = {}\n", ["tune.gains", "at least 1"]),
    "unknown gain": (
        gains("controller.K_r9 = { low = 1.0, high = 2.0 }"),
        ["controller.K_r9", "unknown key", "controller.K_r1"],
    ),
    "unknown entry": (gains("controller.K_r1.3 = { low = 1.0, high = 2.0 }"), ["controller.K_r1.3", "unknown key"]),
    "not of the controller": (
        gains("vehicle.mass = { low = 1.0, high = 2.0 }"),
        ["vehicle.mass", "only numbers of the controller"],
    ),
    "the whole controller": (
        gains("controller = { low = 1.0, high = 2.0 }"),
        ["controller", "only numbers of the controller"],
    ),
    "empty part": (gains('"controller..K_r1" = { low = 1.0, high = 2.0 }'), ["controller..K_r1", "is not a key"]),
    "low not below high": (
        gains("controller.K_r1 = { low = 4.0, high = 2.0 }"),
        ["controller.K_r1", "low = 4 must be below high = 2"],
    ),
    "low equals high": (gains("controller.K_r1 = { low = 3.0, high = 3.0 }"), ["must be below"]),
    "logarithm of zero": (
        gains("controller.K_i1 = { low = 0.0, high = 2.0 }"),
        ["controller.K_i1", "low = 0", 'scale = "linear"'],
    ),
    "no scale like that": (
        gains('controller.K_r1 = { low = 1.0, high = 4.0, scale = "cubic" }'),
        ["controller.K_r1", "scale", "log"],
    ),
    "no high": (gains("controller.K_r1 = { low = 1.0 }"), ["controller.K_r1", "high", "is required"]),
    "no number": (gains('controller.K_r1 = { low = "a", high = 4.0 }'), ["controller.K_r1", "low"]),
    "not a table": (gains("controller.K_r1 = 3.0"), ["tune.gains", "controller.K_r1"]),
    "one key too many": (gains("controller.K_r1 = { low = 1.0, high = 4.0, step = 1.0 }"), ["step", "unknown key"]),
    "current value outside": (
        gains("controller.K_r1 = { low = 4.0, high = 9.0 }"),
        ["controller.K_r1", "current value 3 is outside"],
    ),
    "structure": (gains("controller.nets.neurons = { low = 2, high = 20 }"), ["controller.nets.neurons", "structure"]),
    "a switch": (gains("controller.nets.enabled = { low = 0.1, high = 1 }"), ["controller.nets.enabled", "structure"]),
    "a name": (gains("controller.type = { low = 0.1, high = 1 }"), ["controller.type", "structure"]),
    "a table of gains": (gains("controller.nets = { low = 0.1, high = 1 }"), ["controller.nets", "structure"]),
    "twice": (
        gains("controller.K_r1 = { low = 1.0, high = 9.0 }\n'controller.K_r1.1' = { low = 1.0, high = 9.0 }"),
        ["controller.K_r1.1", "named twice"],
    ),
    "tuned and varying": (
        QUICK + '[tune.vary]\ncontroller.Lambda1.1 = { type = "uniform", low = 1.0, high = 2.0 }\n',
        ["controller.Lambda1 cannot be tuned while controller.Lambda1.1 varies"],
    ),
    "tuned and varying as a whole": (
        QUICK + '[tune.vary]\ncontroller = { type = "choice", values = [{ type = "backstepping" }] }\n',
        ["controller.Lambda1 cannot be tuned while controller varies"],
    ),
    "first entry zero": (
        PAPER.replace("# keep", "\nK_i1 = [0.0, 1.0, 1.0]")
        + "[tune]\n[tune.gains]\ncontroller.K_i1 = { low = -1.0, high = 2.0, scale = 'linear' }\n",
        ["controller.K_i1", "first entry is 0"],
    ),
    "a range that the mission refuses": (
        gains("controller.K_r1 = { low = -1.0, high = 9.0, scale = 'linear' }"),
        ["controller.K_r1 cannot be -1", "greater than 0"],
    ),
    "unknown metric": (
        QUICK.replace("[tune]", "[tune]\nobjective.rmse = 1.0"),
        ["tune", "objective.rmse", "unknown metric", "position_rmse"],
    ),
    "unknown constraint": (
        QUICK.replace("constraints = {}", "constraints.error = 1.0"),
        ["tune", "constraints.error", "unknown metric"],
    ),
    "share above one": (
        QUICK.replace("constraints = {}", "constraints.largest_error = { most = 1.0, share = 1.5 }"),
        ["tune.constraints", "largest_error: share", "1.5"],
    ),
    "negative weight": (QUICK.replace("[tune]", "[tune]\nobjective.position_rmse = -1.0"), ["tune.objective.position_rmse"]),
    "no seeds": (QUICK.replace("[tune]", "[tune]\nseeds = 0"), ["tune.seeds"]),
    "unknown aggregate": (QUICK.replace("[tune]", '[tune]\naggregate = "median"'), ["tune.aggregate", "mean"]),
    "unknown key": (QUICK.replace("[tune]", "[tune]\nflights = 3"), ["tune.flights", "unknown key"]),
    "unknown key varies": (
        QUICK + '[tune.vary]\nvehicle.weight = { type = "uniform", low = 1.0, high = 2.0 }\n',
        ["vehicle.weight"],
    ),
    "a name varies": (QUICK + '[tune.vary]\nname = { type = "choice", values = ["a"] }\n', ["name"]),
    "nothing to draw from": (
        QUICK + '[tune.vary]\nvehicle.mass = { type = "uniform", low = 2.0, high = 1.0 }\n',
        ["vehicle.mass", "low = 2"],
    ),
    "a campaign": ('mission = "m.toml"\n', ["looks like a campaign"]),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_one_line(tmp_path, case):
    text, parts = BAD[case]
    done = tune(written(tmp_path, text), tmp_path / "out", 1000)
    assert done.refused, done
    assert all(part in done.err for part in ["mission.toml", *parts]), done.err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("budget", [-5, 0, 1, 18])
def test_a_budget_that_is_too_small(tmp_path, budget):
    done = tune(written(tmp_path, QUICK), tmp_path / "out", budget)
    assert done.refused
    assert f"--budget: at least 19 flights are needed, not {budget}: 1 with the current gains" in done.err
    assert "16 for one generation of 16 candidates, and for the comparison 2 x 1\n" in done.err, "nothing is random"
    assert tune(written(tmp_path, QUICK), tmp_path / "out", 19).code == 0


def test_a_budget_that_is_too_large(tmp_path):
    done = tune(written(tmp_path, QUICK), tmp_path / "out", 10**30)
    assert done.refused
    assert f"--budget: should be from 19 to 1000000000 flights, not {10**30}" in done.err


def test_other_bad_arguments(tmp_path):
    assert tune(tmp_path / "none.toml", tmp_path / "out").refused
    assert "--seed" in tune(written(tmp_path, QUICK), tmp_path / "out", 60, "--seed", -1).err
    assert quadstep("tune", written(tmp_path, QUICK)).code == 2


def test_an_extra_that_is_missing_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "cma", None)
    done = tune(written(tmp_path, QUICK), tmp_path / "out")
    assert done.refused
    assert "-m pip install 'cma" in done.err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("name", ["tune_paper", "tune_wind"])
def test_the_examples_can_be_tuned(tmp_path, name):
    path = EXAMPLES / f"{name}.toml"
    text = path.read_text(encoding="utf-8").replace("seeds = 16", "seeds = 4\nunseen = 20")
    text = re.sub("(gain|delay)_margin.*\n", "", text)
    text = re.sub("phase_margin.*", "phase_margin = 0.0", text)  # none is kept: those of every candidate take most of the time
    done = tune(written(tmp_path, text), tmp_path / "out", 110)
    assert done.code == 0
    assert "better on flights they were not tuned on: " in done.out
