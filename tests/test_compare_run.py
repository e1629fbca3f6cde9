"""`quadstep compare` from file to folder: its files, what all controllers share, resumed runs, and what it refuses."""

import html
import json
import math
import os
import re
import shutil
import signal
import subprocess
import sys

import numpy as np
import pyarrow.parquet as pq
import pytest

from quadstep.control import raptor
from quadstep.engines.fly import fly
from quadstep.io import parts
from quadstep.io.errors import MissingExtraError, UserError
from quadstep.io.parts import parts_in
from quadstep.io.results_folder import RUNNING
from quadstep.metrics.verdict import graded
from quadstep.studies.campaign.single_flight import replay
from quadstep.studies.comparison import jobs, run
from quadstep.studies.comparison.cells import FIRST, Situation, read_study
from quadstep.studies.comparison.entrants import Comparison
from quadstep.studies.comparison.run import ComparisonRun, How
from tests.campaigns import soon
from tests.commands import LINE, files, heeding_interrupts, metrics, quadstep, write
from tests.patience import PATIENCE
from tests.studies import BODY, HEAD, OPTIONAL, SMALL, SMALLEST, TUNING, rows, studies_in_this_process, study, written

pytestmark = pytest.mark.usefixtures("studies_here")

MARGIN = """
[margins.wind]
keys = ["wind.mean.0"]
path = "up"
scenario = "calm"
high = 40.0
flights = 20
error = 0.6
unit = "m/s"
"""
FAST = """
[vehicle]
preset = "x500"
[path]
type = "circle"
centre = [0.0, 0.0, 4.0]
radius = 3.0
period = 1.5
ramp = 1.0
[simulation]
duration = 2.0
[sensors]
position_noise = 0.005
"""
LAW = """
def controller(t, measured, reference):
    if t > 0.1:
        raise RuntimeError("no idea")
    return 26.0, (0.0, 0.0, 0.0)
"""
MISSION = """
[vehicle]
preset = "research-2.6kg"
[path]
type = "step"
end = [0.2, 0.0, 0.3]
time = 0.1
duration = 0.6
[sensors]
position_noise = 0.005
[simulation]
guidance_period = 0.002
"""


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """The command run once, with tuning and a margin."""
    folder = tmp_path_factory.mktemp("compare")
    file = written(folder, SMALL + TUNING.replace("repeats = 1", "repeats = 2").replace("4500", "2500") + MARGIN)
    with pytest.MonkeyPatch.context() as patch:
        studies_in_this_process(patch)
        return quadstep("compare", file, "--out", folder / "out"), folder / "out", file


def test_it_writes_tables_flights_gains_report_and_page(done):
    result, out, _ = done
    assert (result.code, result.err) == (0, "")
    names = {path.relative_to(out).as_posix() for path in out.rglob("*") if path.is_file()}
    wanted = {
        "cells.csv",
        "cells.parquet",
        "pairs.csv",
        "pairs.parquet",
        "table.tex",
        "metrics.json",
        "gains.json",
        "results.md",
    }
    wanted |= {"report.html", "page.html", "figures/research-2-6kg.png", "figures/research-2-6kg.svg"}
    assert wanted <= names
    assert sum(name.startswith("flights/") for name in names) == 8  # of two frozen controllers, and one tuned twice
    for kind in ("margins/", "linear/", "costs/"):
        assert sum(name.startswith(kind) for name in names) == 3
    assert sum(name.startswith("grades/") for name in names) == 6
    assert not [name for name in names if RUNNING in name]
    assert set(metrics(out)["files"]) == names


def test_the_upper_value_of_few_flights_is_called_the_largest(done):
    result, out, _ = done  # 12 flights a cell
    texts = [result.out, *((out / name).read_text(encoding="utf-8") for name in ("results.md", "table.tex", "report.html"))]
    for text in texts:
        assert "median (largest)" in text
        assert "95 % quantile" not in text.replace(chr(92), "")
    of = Comparison("", "", 19, 1, {})
    assert [of.high, of._replace(seeds=20).high] == ["largest", "95 % quantile"]


def test_nothing_that_is_read_says_nan_or_infinity(done):
    result, out, _ = done
    for text in (result.out, *((out / name).read_text(encoding="utf-8") for name in ("report.html", "cells.csv"))):
        said = re.sub(r"(?s)<script.*?</script>|base64,[\w+/=]+", "", text)
        assert "nan" not in said.lower().replace("nanosecond", "")
        assert " inf" not in said

    def refuse(constant):
        raise AssertionError(constant)

    json.loads((out / "metrics.json").read_text(encoding="utf-8"), parse_constant=refuse)


def test_a_cell_holds_the_flights_that_its_missions_give(done):
    _, out, file = done
    table = pq.read_table(out / "flights").to_pylist()
    mine = [row for row in table if (row["scenario"], row["controller"]) == ("windy", "firm")]
    assert [row["flight"] for row in mine] == list(range(FIRST, FIRST + 12))
    whole, there = read_study(file), Situation("research-2.6kg", "up", "windy")
    cell = whole.cell(there, "firm", whole.knowing("research-2.6kg", {"type": "geometric"}))
    for row in mine[:3]:
        drawn = json.loads(row["drawn"])
        plan = jobs.Flyer(cell.campaign).planner.plan(drawn, row["flight"])
        log = fly(plan)
        distance = np.linalg.norm(log.table("x", "y", "z") - log.table("x_d", "y_d", "z_d"), axis=1)
        assert row["position_rmse[m]"] == pytest.approx(math.sqrt(np.mean(distance**2)), rel=0.02)
        assert 2.4 <= drawn["vehicle.mass"] <= 2.9


def test_every_controller_flew_the_same_draws(done):
    table = pq.read_table(done[1] / "flights").to_pylist()
    windy = [row for row in table if row["scenario"] == "windy" and row["tuning"] == 1]
    assert {row["controller"] for row in table if row["tuning"] == 2} == {"PID"}
    drawn = {name: [row["drawn"] for row in windy if row["controller"] == name] for name in ("soft", "firm", "PID")}
    assert drawn["soft"] == drawn["firm"] == drawn["PID"]
    assert len(set(drawn["soft"])) == 12


def test_the_soft_controller_is_found_worse_and_that_is_decided(done):
    result, out, _ = done
    cells = {(row["scenario"], row["controller"]): row for row in rows(out, "cells.csv")}
    for scenario in ("calm", "windy"):
        soft, firm = (float(cells[scenario, name]["position_rmse_median[m]"]) for name in ("soft", "firm"))
        assert firm < soft
    names = ("scenario", "first", "second")
    (pair,) = (row for row in rows(out, "pairs.csv") if [row[name] for name in names] == ["calm", "soft", "firm"])
    assert pair["better"] == "firm"
    assert float(pair["difference_low[m]"]) > 0.0
    assert float(pair["p_holm"]) < 0.05
    assert re.search(r"calm +(firm|PID), (firm|PID) +[-−\d.]+", result.out), "as the soft one is neither best nor next"


def test_margins_and_costs_are_there(done):
    _, out, _ = done
    found = metrics(out)
    assert [one["controller"] for one in found["margins"]] == ["soft", "firm", "PID"]
    assert "m/s" in found["margins"][0]["half"]
    report = (out / "report.html").read_text(encoding="utf-8")
    for text in (
        "flights per gain",
        "rotor activity [N/s]",
        "Margins",
        "page.html#flight=",
        "far too soft",
    ):
        assert text in report
    tuned = next(one for one in found["controllers"] if one["controller"] == "PID")["tuned"]
    assert tuned["flights"] <= 2500
    assert tuned["tuned"] == 2


def test_the_table_for_latex_has_a_row_for_each_situation(done):
    text = (done[1] / "table.tex").read_text(encoding="utf-8")
    assert r"\begin{tabular}{lrrr}" in text
    assert " & soft & firm & PID" in text
    for rule in (r"\toprule", r"\midrule", r"\bottomrule"):
        assert rule in text
    assert text.count(r"\\") == 1 + 2 + 3  # a header, two situations, and the margins of the loops
    assert text.count(r"\textbf{") == 2
    assert r"phase margin [\textdegree{}] & " in text


def test_the_page_has_the_rivals_with_their_own_gains(done):
    text = (done[1] / "page.html").read_text(encoding="utf-8")
    for name in ("soft", "firm", "PID"):
        assert f'"label":"{name}"' in text


def test_the_same_command_again_flies_nothing_and_gives_the_same_tables(done, monkeypatch):
    _, out, file = done
    names = ("cells.csv", "pairs.csv", "gains.json", "results.md")
    before = {name: (out / name).read_bytes() for name in names}
    monkeypatch.setattr(jobs, "do_job", lambda job: pytest.fail(f"{job.label} is known"))
    assert quadstep("compare", file, "--out", out).code == 0
    assert before == {name: (out / name).read_bytes() for name in before}


def test_gains_found_once_can_be_brought_along(done, tmp_path, monkeypatch):
    _, out, _ = done
    (tmp_path / "known.json").write_bytes((out / "gains.json").read_bytes())
    file = written(tmp_path, SMALL + TUNING.replace("[tuning]", '[tuning]\ngains = "known.json"'))
    monkeypatch.setattr(jobs.training, "train", lambda *_: pytest.fail("it is known"))
    assert quadstep("compare", file, "--out", tmp_path / "out").code == 0
    assert (tmp_path / "out" / "gains.json").read_bytes() == (out / "gains.json").read_bytes()
    with pytest.raises(pytest.fail.Exception):
        quadstep("compare", file, "--out", tmp_path / "again", "--retune")


def test_a_study_that_is_interrupted_goes_on(done, tmp_path, monkeypatch):
    _, out, file = done
    real, left = jobs.do_job, [4]

    def stopped(job):
        left[0] -= 1
        if left[0] < 0:
            raise KeyboardInterrupt
        return real(job)

    monkeypatch.setattr(jobs, "do_job", stopped)
    left[0] = 0
    early = quadstep("compare", file, "--out", tmp_path / "out")
    assert (early.code, (tmp_path / "out").exists()) == (130, False)
    assert early.err.splitlines()[-1] == "quadstep: interrupted; nothing was written"
    left[0] = 4
    result = quadstep("compare", file, "--out", tmp_path / "out")
    assert result.code == 130
    assert f"finished flights are kept in {tmp_path / 'out'}; run the same command to continue" in result.err
    assert not (tmp_path / "out" / "metrics.json").exists()
    left[0] = 30
    with monkeypatch.context() as patch:
        patch.setattr("quadstep.studies.comparison.run.write_results", interrupted)
        assert quadstep("compare", file, "--out", tmp_path / "out").code == 130
    assert quadstep("compare", file, "--out", tmp_path / "out").code == 0
    assert 20 - left[0] < 2 + 8 + 3 + 2 * 3
    whole, resumed = (
        {name: content for name, content in files(folder).items() if name != "times.csv" and "costs/" not in name}
        for folder in (out, tmp_path / "out")
    )
    assert len(whole) > 10
    assert resumed == whole
    assert rows(tmp_path / "out", "times.csv")[0].keys() == {"vehicle", "controller", "nanoseconds_per_sample"}


def test_an_interrupted_study_that_other_code_continues_says_so_in_one_line(tmp_path, monkeypatch, caplog):
    file, out = written(tmp_path, SMALLEST), tmp_path / "out"
    with monkeypatch.context() as patch:
        patch.setattr("quadstep.studies.comparison.run.write_results", interrupted)
        assert quadstep("compare", file, "--out", out).code == 130
    left = len(files(out))
    shutil.copytree(out, tmp_path / "same")
    caplog.clear()
    assert quadstep("compare", file, "--out", tmp_path / "same").code == 0
    assert not caplog.messages
    monkeypatch.setattr(parts, "code_digest", lambda: "another")
    assert quadstep("compare", file, "--out", out).code == 0
    (line,) = caplog.messages
    assert f"{out}: of what an interrupted run left there, {left} of {left} files are of other code of quadstep" in line
    assert not (out / RUNNING).exists()


def test_a_law_of_the_users_that_changed_between_two_runs_is_said_to_be_flown_again(tmp_path, monkeypatch, caplog):
    own, out = tmp_path / "law.py", tmp_path / "out"
    own.write_text("def controller(t, measured, reference):\n    return 26.0, (0.0, 0.0, 0.0)\n", encoding="utf-8")
    file = written(tmp_path, SMALLEST + '[controllers.own]\ncontroller = "law.py:controller"\nfrozen = "mine"\n')

    def said():
        caplog.clear()
        result = quadstep("compare", file, "--out", out)
        return result.code, [one for one in caplog.messages if "has changed" in one]

    assert said() == (0, [])
    assert said() == (0, [])
    own.write_text(own.read_text(encoding="utf-8").replace("26.0", "25.9"), encoding="utf-8")
    line = f"{out}: law.py has changed since these results; what depends on it is computed again"
    with monkeypatch.context() as patch:
        patch.setattr("quadstep.studies.comparison.run.write_results", interrupted)
        assert said() == (130, [f"quadstep: note: {line}"])
    assert said() == (0, [])
    assert said() == (0, [])
    assert not (out / RUNNING).exists()


def interrupted(*_):
    """Ctrl-C."""
    raise KeyboardInterrupt


def test_results_of_another_study_are_not_replaced_unasked(done, tmp_path):
    _, out, _ = done
    file = written(tmp_path, SMALL)
    assert "--overwrite" in quadstep("compare", file, "--out", out).err


def test_results_of_other_code_are_said_to_be_that(done, monkeypatch):
    _, out, file = done
    monkeypatch.setattr(run, "code_digest", lambda: "another")
    result = quadstep("compare", file, "--out", out)
    assert result.refused
    assert f"{out}: holds this result, but it was flown by other code of quadstep; choose another --out" in result.err


def test_a_file_of_flights_that_was_changed_is_named(done, tmp_path):
    _, whole, file = done
    out = shutil.copytree(whole, tmp_path / "out")
    damaged = next((out / "flights").iterdir())
    damaged.write_bytes(damaged.read_bytes()[:-30])
    result = quadstep("compare", file, "--out", out)
    assert result.refused
    assert f"{damaged}: was changed" in result.err


def test_processes_of_their_own_give_the_same_bytes(done, tmp_path, monkeypatch):
    monkeypatch.undo()
    file = written(tmp_path, SMALLEST)
    assert quadstep("compare", file, "--out", tmp_path / "out").code == 0
    ours = {path.name: path.read_bytes() for path in (tmp_path / "out" / "flights").iterdir()}
    theirs = {path.name: path.read_bytes() for path in (done[1] / "flights").iterdir()}
    assert len(ours) == 2
    assert all(theirs[name] == content for name, content in ours.items())


# Missions side by side


def test_missions_that_differ_in_anything_fly_the_same_noise(tmp_path):
    one = write(tmp_path, MISSION + '[controller]\ntype = "pid"\n', "pid.toml")
    other = write(tmp_path, MISSION + '[controller]\ntype = "geometric"\n', "geometric.toml")
    heavy = write(tmp_path, MISSION.replace("[path]", "mass = 2.9\n[path]") + '[controller]\ntype = "pid"\n', "heavy.toml")
    result = quadstep("compare", one, other, heavy, "--seeds", 10, "--out", tmp_path / "out")
    assert (result.code, result.err) == (0, "")
    assert [row["controller"] for row in rows(tmp_path / "out", "cells.csv")] == ["pid", "geometric", "heavy"]
    table = pq.read_table(tmp_path / "out" / "flights").to_pylist()
    assert len(table) == 30
    assert "median position RMSE " in result.out and "the missions: " not in result.out
    said = " and controller type (pid against geometric against pid)."
    assert re.search(rf"They differ in .*mass .*{re.escape(said)}", result.out)
    assert result.out.splitlines()[-1] == f"Report: {tmp_path / 'out' / 'report.html'}"
    assert "Gusts and noise differ" not in result.out


def test_missions_of_unlike_steps_are_said_to_fly_other_noise(tmp_path):
    one = write(tmp_path, MISSION, "slow.toml")
    other = write(tmp_path, MISSION + "step = 0.001\n", "fast.toml")
    said = quadstep("compare", one, other, "--seeds", 4, "--out", tmp_path / "out").out
    assert "Gusts and noise differ between controllers, as their simulation.step does: 2 ms (slow) and 1 ms (fast)." in said


def test_the_papers_plant_can_be_compared_with_a_real_vehicle(tmp_path):
    paper = write(tmp_path, LINE, "paper.toml")
    real = write(tmp_path, '[vehicle]\npreset = "research-2.6kg"\n' + LINE, "real.toml")
    result = quadstep("compare", paper, real, "--seeds", 4, "--out", tmp_path / "out")
    assert result.code == 0
    assert {row["energy[J]"] == "" for row in rows(tmp_path / "out", "cells.csv")} == {True, False}


def test_recordings_of_one_name_in_two_folders_are_two_paths(tmp_path):
    path = '[path]\ntype = "recorded"\nfile = "a.csv"\n'
    missions = []
    for name, height in (("one", 1.0), ("two", 2.0)):
        (tmp_path / name).mkdir()
        rows_of = "".join(f"{0.1 * i},0,0,{height * 0.01 * i}\n" for i in range(30))
        write(tmp_path / name, "t,x,y,z\n" + rows_of, "a.csv")
        missions.append(write(tmp_path / name, '[vehicle]\npreset = "research-2.6kg"\n' + path, f"{name}.toml"))
    result = quadstep("compare", *missions, "--seeds", 4, "--out", tmp_path / "out")
    assert result.refused
    assert "fly different paths" in result.err


def test_missions_on_different_paths_are_not_compared(tmp_path):
    one = write(tmp_path, MISSION, "near.toml")
    other = write(tmp_path, MISSION.replace("[0.2, 0.0, 0.3]", "[0.2, 0.0, 0.4]"), "far.toml")
    result = quadstep("compare", one, other, "--seeds", 4, "--out", tmp_path / "out")
    assert result.refused
    assert f"{one} and {other} fly different paths" in result.err
    for part in ("score_from = 0.5\n", "duration = 0.3\n"):
        other = write(tmp_path, part + MISSION if "score" in part else MISSION + part, "part.toml")
        result = quadstep("compare", one, other, "--seeds", 4, "--out", tmp_path / "out")
        assert result.refused
        assert f"{one} and {other} count their errors over different times" in result.err
    assert not (tmp_path / "out").exists()


def test_equal_missions_share_what_is_kept_and_compare_as_equal(tmp_path):
    files = [write(tmp_path, MISSION + '[controller]\ntype = "pid"\n', name) for name in ("one.toml", "same.toml")]
    out = tmp_path / "out"
    result = quadstep("compare", *files, "--seeds", 4, "--out", out)
    assert (result.code, result.err) == (0, "")
    (pair,) = rows(out, "pairs.csv")
    assert (float(pair["difference[m]"]), float(pair["first_better_share"]), pair["better"]) == (0.0, 0.5, "")
    assert "one and same differ in no setting, so their flights are the same." in result.out
    assert "they are the same" in result.out and "tell them apart" not in result.out and "Next:" not in result.out
    assert [len(list((out / kind).iterdir())) for kind in ("flights", "linear", "costs")] == [2, 1, 1]
    assert not (out / RUNNING).exists()


def test_equal_controllers_that_fail_are_each_a_problem(monkeypatch, tmp_path):
    cell = study(SMALLEST).cell(Situation("research-2.6kg", "up", "calm"), "firm", {"type": "geometric"})
    equal = [jobs.linearising(cell._replace(controller=name)) for name in ("firm", "again")]
    monkeypatch.setattr(jobs, "do_job", lambda _: jobs.JobResult(b"", "no idea"))
    with parts_in(tmp_path) as kept:
        run = ComparisonRun(kept, How(keep_going=True))
        run.work("linearising", equal)
    assert [one.controller[1] for one in run.problems] == ["firm", "again"]


def test_keys_that_are_set_up_flight_by_flight_are_named_once_for_each_controller(tmp_path, caplog):
    vary = 'vary = { "path.duration" = { type = "uniform", low = 0.5, high = 0.6 } }\n'
    text = SMALLEST.replace("[scenarios.calm]\n", "[scenarios.calm]\n" + vary)
    cell = study(text).cell(Situation("research-2.6kg", "up", "calm"), "firm", {"type": "geometric"})
    with parts_in(tmp_path) as kept:
        ComparisonRun(kept, How()).work("flying", [jobs.flying(cell, flights) for flights in (2, 3)])
    (line,) = caplog.messages
    assert re.match(
        r"quadstep: note: firm: research-2\.6kg, up, calm: each flight is set up by itself, [0-9.e+]+ ms each, because "
        r"path\.duration cannot be set for many flights at once",
        line,
    )


def test_few_flights_lose_nothing_and_decide_nothing(tmp_path):
    files = [write(tmp_path, f'{MISSION}[controller]\ntype = "{name}"\n', f"{name}.toml") for name in ("pid", "geometric")]
    out = tmp_path / "out"
    result = quadstep("compare", *files, "--seeds", 4, "--out", out)
    assert (result.code, result.err) == (0, "")
    said = " ".join(result.out.split())
    assert "Next: fly at least 6 flights each (--seeds), as with fewer no difference can be significant." in said
    assert re.search(r"(pid|geometric) are tied for best by position RMSE: 4 flights do not tell them apart", said)
    assert "loop" not in said, "as those of both are sound"
    assert "[-, -]" in (out / "report.html").read_text(encoding="utf-8")
    for text in (result.out, (out / "results.md").read_text(encoding="utf-8")):
        assert "lost]" not in text


def test_the_best_of_laws_that_do_not_follow_their_path_is_not_praised(tmp_path):
    files = [write(tmp_path, f'{FAST}[controller]\ntype = "{name}"\n', f"{name}.toml") for name in ("pid", "geometric")]
    out = tmp_path / "out"
    result = quadstep("compare", *files, "--seeds", 6, "--out", out)
    assert result.code == 0
    report = (out / "report.html").read_text(encoding="utf-8")
    answer = html.unescape(re.search(r'<p class="answer">(.*?)</p>', report)[1])
    assert answer.startswith("No mission flies as commanded: ")
    assert re.search(
        r"<p>Not as commanded: (pid|geometric) \(large error[\w, ]*\)\. Next: better gains", html.unescape(report)
    )
    assert answer[1:-1].replace("\N{NO-BREAK SPACE}", " ") in result.out
    assert "large error" in (out / "table.tex").read_text(encoding="utf-8")


def test_a_cell_has_the_grade_that_fly_gives_its_median_flight(done):
    _, out, file = done
    graded_ones = [json.loads(path.read_text(encoding="utf-8")) for path in (out / "grades").iterdir()]
    whole, there = read_study(file), Situation("research-2.6kg", "up", "windy")
    cell = whole.cell(there, "firm", whole.knowing("research-2.6kg", {"type": "geometric"}))
    mine = [
        row for row in pq.read_table(out / "flights").to_pylist() if row["scenario"] == "windy" and row["controller"] == "firm"
    ]
    number = sorted(mine, key=lambda row: row["position_rmse[m]"])[5]["flight"]
    again = replay(cell.campaign, number)
    found = graded(again.mission.flight_metrics(fly(again.plan))[0])
    (row,) = (one for one in metrics(out)["cells"] if (one["scenario"], one["controller"]) == ("windy", "firm"))
    assert (row["grade"], row["grade_reasons"]) == (found.grade, "; ".join(found.reasons))
    assert number in [one["flight"] for one in graded_ones]
    assert len(graded_ones) == 6


def test_flights_that_do_not_differ_are_said_to_decide_nothing(tmp_path):
    still = MISSION.partition("[sensors]")[0]
    laws = {"pid": "", "geometric": "k_x = 9.0\n"}
    files = [write(tmp_path, f'{still}[controller]\ntype = "{law}"\n{more}', f"{law}.toml") for law, more in laws.items()]
    out = tmp_path / "out"
    result = quadstep("compare", *files, "--seeds", 6, "--out", out)
    assert (result.code, result.err) == (0, "")
    assert (
        "2 missions, 1 flight each, since nothing is random and more would be identical.\nThey differ in controller"
        in result.out
    )
    assert "(pid against geometric) and k_x (unset against 9)." in " ".join(result.out.split())
    assert len(set(re.findall(r"[0-9.]+ mm", result.out))) == len(re.findall(r"[0-9.]+ mm", result.out)) == 2
    assert "decided" not in result.out and "median" not in result.out
    assert [row["flights"] for row in rows(out, "cells.csv")] == ["1", "1"]
    (pair,) = rows(out, "pairs.csv")
    assert pair["better"] == ""
    report = (out / "report.html").read_text(encoding="utf-8")
    assert re.search(
        r'<p class="answer">(pid|geometric) is best \(position RMSE [^<]*\smm\), next (pid|geometric) \([^<]*\smm\)\.</p>',
        report,
    )
    assert "All missions fly the same path.<" in report
    assert "Wilcoxon" not in report and "mean rank" not in report
    assert "everything else is the same" not in report  # missions differ in whatever they like
    assert "pairs decided" not in report


# What goes wrong


def test_a_controller_that_fails_in_its_own_code_is_one_line(tmp_path):
    (tmp_path / "law.py").write_text(LAW, encoding="utf-8")
    file = written(tmp_path, SMALLEST + '[controllers.own]\ncontroller = "law.py:controller"\nfrozen = "mine"\n')
    result = quadstep("compare", file, "--out", tmp_path / "out")
    assert result.refused
    assert "law.py:4: RuntimeError: no idea" in result.err
    again = quadstep("compare", file, "--out", tmp_path / "out", "--keep-going")
    assert again.code == 2
    assert again.err.count("\n") == 1
    assert {row["controller"] for row in rows(tmp_path / "out", "cells.csv")} == {"soft", "firm"}
    assert "Missing from some or all situations because they failed: own." in " ".join(again.out.split())
    assert "RuntimeError: no idea" in metrics(tmp_path / "out")["problems"][0]


def test_a_controller_that_cannot_fly_the_vehicle_is_one_line_that_names_it(tmp_path):
    flat = '[controllers.flat]\ncontroller = "planar-pd"\nfrozen = "as shipped"\n'  # a part of "flatness"
    file = written(tmp_path, SMALLEST + flat)
    result = quadstep("compare", file, "--out", tmp_path / "out", "--keep-going")
    assert result.code == 2
    assert result.err.count("\n") == 1
    assert f"{file}: flat cannot fly research-2.6kg: controller.type: planar-pd flies only the planar vehicle" in result.err
    assert {row["controller"] for row in rows(tmp_path / "out", "cells.csv")} == {"soft", "firm"}


def test_an_optional_controller_is_left_out_where_its_package_is_absent(tmp_path, monkeypatch):
    monkeypatch.setattr(raptor, "published", no_policy)
    text = SMALLEST.replace("seeds = 12", "seeds = 2")
    result = quadstep("compare", written(tmp_path, text + OPTIONAL), "--out", tmp_path / "out")
    line = "policy is left out: the policy needs h5py; install it"
    assert (result.code, result.err) == (0, "")
    assert line in result.out
    assert "as with fewer no difference can be significant" in " ".join(result.out.split())
    assert {row["controller"] for row in rows(tmp_path / "out", "cells.csv")} == {"soft", "firm"}
    assert metrics(tmp_path / "out")["left_out"] == [line]
    assert "## Limitations\n\n- " + line in (tmp_path / "out" / "results.md").read_text(encoding="utf-8")
    assert line in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(("text", "said"), [
    (SMALL + OPTIONAL.replace("optional = true", ""), "policy cannot fly research-2.6kg: the policy needs h5py"),
    (SMALL + OPTIONAL.replace('"raptor"', '"raptors"'),
        "policy cannot fly research-2.6kg: controller.type: unknown value 'raptors'"),
    (HEAD + BODY + OPTIONAL, "no controller is left to compare: policy is left out: the policy needs h5py"),
])  # fmt: skip
def test_only_an_absent_package_leaves_out_only_what_is_optional(tmp_path, monkeypatch, text, said):
    monkeypatch.setattr(raptor, "published", no_policy)
    result = quadstep("compare", written(tmp_path, text), "--out", tmp_path / "out")
    assert result.refused
    assert said in result.err


def no_policy():
    """As where the package of its weights is not installed."""
    raise MissingExtraError("the policy needs h5py; install it")


def test_a_scenario_that_nobody_survives_is_one_line(tmp_path):
    hail = "[scenarios.hail]\nmission = { limits = { distance = 1e-6 } }\n"
    file = written(tmp_path, SMALLEST.replace("[scenarios.calm]", f"{hail}[scenarios.calm]"))
    result = quadstep("compare", file, "--out", tmp_path / "out")
    assert result.refused
    assert "research-2.6kg, up, hail: no controller completes any of 12 flights" in result.err
    again = quadstep("compare", file, "--out", tmp_path / "out", "--keep-going")
    assert again.code == 2
    assert "lost" in again.out
    report = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "every controller loses at least half of its flights" in report


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (SMALL.replace('controller = "geometric"', 'controller = "geometry"'), "'geometry'; did you mean geometric?"),
        (SMALL.replace('controller = "geometric"', 'controller = "planar-pd"'), "planar-pd"),
        (SMALL.replace("k_x = 3.0", "k_x = -3.0"), "k_x: every entry must be greater than 0"),
        (SMALL.replace('"vehicle.mass"', '"vehicle.weight"'), "weight: unknown key"),
        (SMALL.replace("mean = [4.0, 0.0, 0.0]", "mean = [4.0]"), "wind.mean: should be a list of three"),
        (SMALL.replace("seeds = 12", 'seeds = 12\nmetrics = ["speed"]'), "metrics: unknown metric 'speed'; allowed: "),
        (SMALL + TUNING.replace("4500", "300"), "300 flights are too few for the 2 gains of PID"),
        (SMALL + TUNING.replace("position = {}", "hope = {}"), "PID on research-2.6kg cannot be tuned: tune.gains: "),
        (SMALL + TUNING.replace("[tuning]", '[tuning]\ngains = "no.json"'), "tuning.gains: "),
        (re.sub("vehicles = .*", "vehicles = 3", SMALL), "vehicles"),
        ("paths = [", "not valid TOML"),
    ],
)  # fmt: skip
def test_bad_input_is_one_line_before_anything_flies(tmp_path, monkeypatch, text, said):
    monkeypatch.setattr(jobs, "do_job", lambda job: pytest.fail("it must not fly"))
    result = quadstep("compare", written(tmp_path, text), "--out", tmp_path / "out")
    assert result.refused, result
    assert said in result.err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(("arguments", "said"), [
    (["no.toml"], "no.toml: file not found"),
    (["--seeds", "1"], "--seeds: should be from 2 to 100000, not 1"),
    (["--engine", "gpu"], "gpu"),
    (["--figures", "bmp"], "bmp"),
])  # fmt: skip
def test_a_wrong_command_is_one_line(tmp_path, monkeypatch, arguments, said):
    monkeypatch.chdir(tmp_path)
    file = [] if arguments[0].endswith("toml") else [written(tmp_path)]
    result = quadstep("compare", *file, *arguments, "--out", tmp_path / "out")
    assert result.code == 2
    assert said in result.err
    assert not (tmp_path / "out").exists()


def test_a_study_beside_another_file_is_told_from_a_mission(tmp_path):
    study, mission = written(tmp_path), write(tmp_path, MISSION)
    assert "looks like a study" in quadstep("compare", study, mission, "--out", tmp_path / "out").err


def test_ctrl_c_ends_all_processes_and_keeps_what_was_flown(tmp_path):
    file = written(tmp_path, SMALL.replace("seeds = 12", "seeds = 20000"))
    process = subprocess.Popen(
        [sys.executable, "-m", "quadstep", "compare", str(file), "--out", str(tmp_path / "out")],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
        preexec_fn=heeding_interrupts,  # noqa: PLW1509 (set before any thread of the child)
    )  # fmt: skip
    kept = tmp_path / "out" / RUNNING / "flights"
    assert soon(lambda: any(kept.glob("*.parquet")))
    os.killpg(process.pid, signal.SIGINT)
    out, err = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130, (out, err)
    assert "run the same command to continue" in err
    assert list(kept.glob("*.parquet"))


def test_what_is_kept_is_found_while_running_and_when_published(tmp_path):
    with pytest.raises(RuntimeError), parts_in(tmp_path) as kept:
        kept.add("gains", "a", b"0")
        kept.add("gains", "a", b"1")
        assert kept.read("gains", "a") == b"1"
        raise RuntimeError
    (tmp_path / "new").mkdir()
    with parts_in(tmp_path) as kept:
        assert kept.read("gains", "a") == b"1"
        kept.publish(tmp_path / "new", [("gains", "a")])
        with pytest.raises(UserError, match="another run is writing"), parts_in(tmp_path):
            pass
    with parts_in(tmp_path) as kept:
        assert kept.find("gains", "a") is None
    with parts_in(tmp_path / "new") as kept:
        assert kept.read("gains", "a") == b"1"
