"""`quadstep certify`: its files, its output, its exit codes, and what it refuses."""

import html
import re
from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest

from quadstep.engines.fly import fly
from quadstep.io import errors
from quadstep.mission.read import plan_mission, read_mission
from quadstep.proofs.certify.certificate import certify_plan
from quadstep.proofs.certify.output import record, tables
from quadstep.proofs.certify.run import facts, figures_of
from quadstep.proofs.certify.standing import TERMS, TESTING, answer, kind, seen, stacked, work
from quadstep.report.drawing import FigureJob
from quadstep.report.panel import UNJUDGED
from tests.commands import LINE, quadstep, strict_json, write

EXAMPLES = Path(__file__).parent.parent / "examples"
BACKSTEPPING = LINE + '[controller]\ntype = "backstepping"\n'


class Now:
    """A pool that draws nothing."""

    def submit(self, *_):
        return self

    def result(self):
        return None


@pytest.fixture
def undrawn(monkeypatch):
    monkeypatch.setattr("quadstep.proofs.certify.run.drawing_pool", lambda: nullcontext(Now()))


def test_it_writes_the_documented_files_and_prints_table_and_verdict(tmp_path):
    run = quadstep("certify", write(tmp_path, LINE), "--out", tmp_path / "out")
    assert (run.code, run.err) == (0, "")
    written = {path.name for path in (tmp_path / "out").iterdir()}
    assert written == {
        "certificate.json", "certificate.png", "certificate.svg", "changes.png", "changes.svg", "metrics.json", "report.html",
    }  # fmt: skip
    found, about = (strict_json(tmp_path / "out" / name) for name in ("certificate.json", "metrics.json"))
    assert run.out.startswith("This flight meets the conditions of Theorem 5.1 but does not test it: the error never left the")
    assert f"The flight of {TESTING} tests it in yaw, without nets." in run.out
    assert found["verdict"].removeprefix("untested: ") in run.out
    assert about["verdict"] == found["verdict"]
    assert found["kind"] == about["kind"] == "untested"
    rest = about["margins_at_rest"]
    assert f"the loop is {rest['grade']}: {rest['why']}" in run.out, "of a flight that meets all conditions, too"
    assert set(found["lyapunov"]["work[J]"]) == set(TERMS)
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert f"<dd>not tested<small>|r| is at most {found['flight']['largest_r']:.4g}, b<sub>r</sub> = " in page
    assert f"b<sub>r</sub> = {found['bounds']['b_r']:.4g}</small>" in page
    assert found["samples"] == 501
    for needed in ("J_M max(Lambda2)", "largest error |r|", "thrust that the proof covers"):
        assert needed in run.out


def test_a_hover_that_never_moves_gets_a_certificate(tmp_path):
    still = '[path]\ntype = "step"\nstart = [0, 0, 1.0]\nend = [0, 0, 1.0]\n[controller]\ntype = "backstepping"\n'
    file = write(tmp_path, f"{still}[controller.nets]\nenabled = false\n[simulation]\nduration = 0.1\n")
    run = quadstep("certify", file, "--out", tmp_path / "out")
    assert (run.code, run.err) == (0, "")
    assert "does not test it" in run.out
    assert (tmp_path / "out" / "changes.png").is_file()


def test_a_diverging_flight_ends_with_3_and_keeps_its_certificate(tmp_path, undrawn):
    run = quadstep("certify", EXAMPLES / "theorem_fails.toml", "--out", tmp_path / "out")
    assert (run.code, run.err) == (errors.DIVERGED, "")
    found = strict_json(tmp_path / "out" / "certificate.json")
    conditions = found["conditions"]
    assert found["kind"] == "lost"
    assert conditions["printed_hold"]
    assert conditions["corrected_hold"]
    assert not conditions["coupling_holds"]
    assert min(conditions["printed: K_r2 - J_M Lambda2 [N m s]"]["anywhere"]) == pytest.approx(1.0)
    assert found["looked_at_until[s]"] < found["ended[s]"] < 10.0
    said = (
        "although the printed conditions of Theorem 5.1 hold. With the coupling of the loops, which they leave out, the proof"
    )
    assert run.out.startswith(
        f"Lost at {found['ended[s]']:.4g} s, {said} covers thrusts up to {conditions['u_max_allowed[N]']['visited']:.4g} N"
    )
    weighs = read_mission(EXAMPLES / "theorem_fails.toml").vehicle.mass * 9.81
    assert conditions["u_max_allowed[N]"]["visited"] < weighs
    assert f" N; hovering alone takes {weighs:.4g} N." in run.out
    assert "Hovering at the start of its path, the loop is unstable: a deviation doubles every 0.399 s" in run.out
    assert "`quadstep tune` searches for gains with margins." in run.out
    assert strict_json(tmp_path / "out" / "metrics.json")["margins_at_rest"]["grade"] == "unstable"
    assert [round(found["lyapunov"]["work[J]"][one], 1) for one in ("residual", "coupling")] == [165.5, 24.8]
    assert "repair" not in run.out  # larger gains meet every condition, and the flight is lost all the same
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert page.count('class="holds"') == 4
    (failed,) = re.findall(r"<tr><td>([^<]*)</td>(?:(?!</tr>).)*class=\"fails\"", page)
    assert failed == "thrust that the proof covers"
    (row,) = re.findall(rf"{failed}</td><td>(.*?)</td><td>(.*?)</td>", page)
    allowed = conditions["u_max_allowed[N]"]
    assert [html.unescape(cell).replace("\u00a0", " ") for cell in row] == [
        f"{allowed['visited']:.4g} N",
        f"> {conditions['u_max[N]']:.4g} N",
    ]


def test_the_diverging_example_has_no_disturbance_and_no_warning(tmp_path):
    path = EXAMPLES / "theorem_fails.toml"
    plan = plan_mission(read_mission(path), path)
    assert plan.parameters.disturbance.scale == 0.0
    assert not any(plan.parameters.disturbance.force)
    assert plan.warnings == ()


def test_broken_conditions_are_a_certificate_too(tmp_path, undrawn):
    run = quadstep("certify", write(tmp_path, BACKSTEPPING + "K_r2 = 70.0\n"), "--out", tmp_path / "out")
    assert run.code == 0
    assert "is not covered by the proof of Theorem 5.1: K_r2 - J_M max(Lambda2) = -" in run.out
    assert strict_json(tmp_path / "out" / "certificate.json")["bounds"]["b_r"] is None


def test_it_stays_out_of_the_way_of_a_flight(tmp_path, undrawn):
    mission = write(tmp_path, LINE)
    assert quadstep("certify", mission, "--out", tmp_path / "out").code == 0
    assert quadstep("certify", mission, "--out", tmp_path / "out").code == 0
    other = write(tmp_path, LINE.replace("1.0, 0.5", "0.9, 0.5"), "other.toml")
    assert quadstep("certify", other, "--out", tmp_path / "out").refused
    assert quadstep("certify", other, "--out", tmp_path / "out", "--overwrite").code == 0
    assert quadstep("fly", mission, "--out", tmp_path / "out").code == errors.BAD_INPUT


def test_the_folder_is_named_after_the_mission(tmp_path, undrawn, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert quadstep("certify", write(tmp_path, LINE)).code == 0
    assert (tmp_path / "out" / "mission-certificate" / "certificate.json").is_file()


REFUSED = {
    "nested": LINE + '[controller]\ntype = "nested-saturation"\n',
    "completed": LINE + '[controller]\ntype = "completed-backstepping"\n',
    "limits": LINE + "[vehicle]\nrotors.limits = [0.0, 3.0]\n",
    "full speed from rest": '[path]\ntype = "circle"\nradius = 1.0\nperiod = 9.0\nramp = 0.0\n'
    "[start]\nvelocity = [0.0, 0.0, 0.0]\n",
    "free fall": '[path]\ntype = "minimum-jerk"\nend = [0.0, 0.0, -60.0]\nduration = 5.0\n',
    "far above": LINE + "[start]\nposition = [0.0, 0.0, 50.0]\n",
    "not a mission": "[path\n",
    "diverges at once": LINE + "[limits]\ndistance = 1e-300\n",
}


@pytest.mark.parametrize("case", REFUSED)
def test_refusals_are_one_line_and_leave_nothing(tmp_path, undrawn, case):
    run = quadstep("certify", write(tmp_path, REFUSED[case]), "--out", tmp_path / "out")
    assert run.refused
    assert "mission.toml" in run.err
    assert not (tmp_path / "out").exists()


def test_the_figure_takes_a_flight_of_any_length(tmp_path):
    from tests.certificates import plan

    for job in figures_of(certify_plan(plan(simulation={"duration": 0.1})), "short"):
        assert isinstance(job, FigureJob)
        job.draw(tmp_path)
        assert (tmp_path / f"{job.name}.svg").stat().st_size > 1000


@pytest.mark.parametrize("name", ["case1", "theorem_fails"])
def test_the_caption_says_what_this_flight_shows_and_only_a_lost_ones_time_is_linear(name):
    path = EXAMPLES / f"{name}.toml"
    found = certify_plan(plan_mission(read_mission(path), path))
    lost, caption = name == "theorem_fails", seen(found)
    assert f"|r| never left b_r: {found.r.max():.4g} <= {found.b_r:.4g}." in caption
    assert caption.startswith(f"Up to {found.until:.3g} s, |r| never left") == lost
    assert (
        "What follows is grey and not judged: the law then commands a thrust that swings past straight down, where" in caption
    ) == lost
    assert caption.endswith(f"The proof covers thrusts up to {found.conditions.thrust_bound:.4g} N.")
    (begins,) = re.findall(r"as areas from (\S+) s on, where", stacked(found)) or ["0"]
    assert (4.0 <= float(begins) < found.until) == lost
    assert stacked(found).endswith(f"Too small to be drawn: {'weights' if lost else 'weights and coupling'}.")
    assert [one.log_time != lost for one in figures_of(found, name)] == [True, True]
    done = record(found)["lyapunov"]["work[J]"]
    value = found.lyapunov.value
    assert sum(done[key] for key in TERMS if key != "filtering") == pytest.approx(value[-1] - value[0], rel=1e-9)
    assert ("With the coupling of the loops" in answer(found)) == lost
    *parts, total = tables(found).changes
    assert (len(parts), total[0]) == (len(TERMS), "sum (the filter's lag is already in the coupling)")
    assert tables(found).levels[0][0] == "at the start"
    assert len({text.split()[-1] for _, text in (*tables(found).changes, *tables(found).levels)}) == 1  # one unit
    assert tables(found).conditions[-1][0] == "J_M (10 at any attitude)"
    assert [row[-1] for row in tables(found).ways] == [("holds", "holds"), ("not judged", "open")]
    assert [one[:2] for one in facts(found)[: 1 + lost]] == (
        [("printed conditions", "hold"), ("repaired conditions", "violated")]
        if lost
        else [("conditions of the proof", "hold")]
    )
    assert [one.value for one in facts(found)[1 + lost :]] == ["not tested", "lost" if lost else "completed"]


def test_what_follows_the_judged_part_is_the_flights_own_error_and_is_drawn():
    path = EXAMPLES / "theorem_fails.toml"
    flown = plan_mission(read_mission(path), path)
    found, log = certify_plan(flown), fly(flown._replace(ticks=flown.ticks._replace(log=flown.ticks.every[0])))
    whole = np.hypot(log.column("norm_r1"), log.column("norm_r2"))
    np.testing.assert_allclose(np.append(found.r, found.later), whole, rtol=1e-9)
    assert whole[len(found.r) :].max() > found.b_r  # so that "the error never left the ball" is said of the judged part only
    assert facts(found)[2].more.startswith(f"|r| is at most {found.r.max():.4g} up to {found.until:.3g} s, b_r = ")
    (job, *_) = figures_of(found, "lost")
    lines = job.panels[0].lines
    assert next(i for i, one in enumerate(lines) if one.startswith("b_r = ")) == 1  # the same line as where nothing follows
    assert (len(lines["|r|"]), len(lines[UNJUDGED]), len(job.t)) == (len(found.r), len(whole), len(whole))
    np.testing.assert_allclose(job.t, log.column("t"), rtol=1e-9, atol=1e-12)
    assert tables(found).ball[3] == ["largest error |r| later [m/s, rad/s]", f"{whole.max():.4g}", "", ("not judged", "open")]


def test_one_example_tests_the_theorem_as_the_others_say():
    path = EXAMPLES.parent / TESTING
    found = certify_plan(plan_mission(read_mission(path), path))
    assert (kind(found), found.outside.sum()) == ("sign consistent", 32)
    assert "L fell wherever the error was outside the ball b_r, at 32 of 2,001 samples." in answer(found)
    assert np.abs(found.lyapunov.coupling).max() == 0.0
    said = (
        "Only the error in yaw is tested: x, y, z, pitch and roll stay at zero, and so do the weights of the nets and the "
        "omitted coupling."
    )
    assert answer(found).endswith(f"samples. {said}")
    assert "Zero throughout: weights and coupling." in stacked(found)
    assert not any("–" in cell for row in tables(found).ball for cell in row[:3])


def test_the_terms_and_what_sampling_adds_are_the_change_of_l_and_sampling_adds_less_at_a_shorter_period():
    from tests.certificates import plan

    left = []
    for step in (0.002, 0.0005):
        found = certify_plan(plan(simulation={"duration": 2.0, "step": step, "control_period": step}))
        done, value = work(found), found.lyapunov.value
        whole = sum(values for name, values in done.items() if name != "filtering")
        np.testing.assert_allclose(whole, value - value[0], rtol=1e-9, atol=1e-12 * value.max())
        assert all(values[0] == 0.0 for values in done.values())
        assert done["residual"][-1] == pytest.approx(np.trapezoid(found.lyapunov.residual, found.history.t), rel=1e-9)
        left.append(abs(done["sampling"]).max() / np.abs(np.diff(value)).sum())
    assert left[0] < 0.1
    assert 0.2 < left[1] / left[0] < 0.3  # first order in the period, as L_dot itself
