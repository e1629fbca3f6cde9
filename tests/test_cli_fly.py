"""`quadstep fly`: its files, its output, and its exit codes."""

import math
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from quadstep import __version__
from quadstep.mission import lagrange
from tests.commands import ISSUE_COLUMNS, LINE, columns, files, quadstep, quadstep_process, strict_json, without_figures, write

pytestmark = pytest.mark.usefixtures("ungraded")

NAME = "[red]x[/red] $\\alpha$ <script>alert(1)</script> & {curly} %s :rocket:"
PICTURES = {"path", "position", "attitude", "inputs", "learning"}


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """A flight of one second, figures and all, with a name that is markup in four languages."""
    folder = tmp_path_factory.mktemp("flown")
    mission = write(folder, f"name = '{NAME}'\n{LINE}")
    run = quadstep("fly", mission, "--out", folder / "out", "--figures", "png,svg")
    return run, folder / "out"


def test_it_writes_exactly_the_documented_files(flown):
    run, folder = flown
    assert run.code == 0
    pictures = {f"figures/{name}.{kind}" for name in PICTURES for kind in ("png", "svg")}
    assert set(files(folder)) == {"flight.csv", "metrics.json", "page.html", "report.html", "weights.json"} | pictures
    assert all(files(folder).values())


def test_nothing_is_said_on_the_error_stream(flown):
    assert flown[0].err == ""


def test_the_log_has_the_issues_columns_with_units_and_a_row_every_10_ms(flown):
    log = columns(flown[1])
    for name in ISSUE_COLUMNS:
        assert name.replace("#", " ") in log
    assert sum(name.endswith("[m/s]") and name[0] in "xyz" for name in log) == 3
    assert sum(name.endswith("_dot[rad/s]") for name in log) == 3
    assert all("[" in name and name.endswith("]") for name in log)
    assert {name.partition("[")[0] for name in log} >= {"norm_W1", "norm_W2", "lyapunov", "norm_r1", "norm_r2"}
    assert log["t[s]"] == pytest.approx(np.arange(101) / 100)
    assert np.isfinite(list(log.values())).all()


def test_the_log_follows_the_path(flown):
    log = columns(flown[1])
    assert [log[f"{axis}_d[m]"][-1] for axis in "xyz"] == pytest.approx([1.0, 0.5, 0.5])
    assert [log[f"{axis}[m]"][-1] for axis in "xyz"] == pytest.approx([1.0, 0.5, 0.5], abs=0.2)


def test_the_metrics_are_strict_json_and_say_what_was_flown(flown):
    metrics = strict_json(flown[1] / "metrics.json")
    assert (metrics["name"], metrics["version"], metrics["engine"]) == (NAME, __version__, "lanes")
    assert (metrics["outcome"], metrics["ended[s]"]) == ("completed", 1.0)
    assert set(metrics["files"]) == set(files(flown[1]))
    assert metrics["mission"]["path"]["end"] == [1.0, 0.5, 0.5]
    assert metrics["mission"]["controller"]["nets"]["seed"] == 1
    assert metrics["warnings"] == []


def test_the_metrics_are_those_of_the_log(flown):
    metrics, log = strict_json(flown[1] / "metrics.json"), columns(flown[1])
    for axis in "xyz":
        errors = log[f"{axis}_d[m]"] - log[f"{axis}[m]"]
        assert metrics["position"][axis]["rmse[m]"] == pytest.approx(math.sqrt(np.mean(errors**2)))
        assert metrics["position"][axis]["largest[m]"] == pytest.approx(np.abs(errors).max())
        assert metrics["position"][axis]["final[m]"] == pytest.approx(abs(errors[-1]))
    assert metrics["u"]["largest[N]"] == pytest.approx(log["u[N]"].max())
    assert metrics["u"]["total_variation[N]"] == pytest.approx(np.abs(np.diff(log["u[N]"])).sum())
    assert metrics["largest_weight_norm"]["norm_W1"] == pytest.approx(log["norm_W1[-]"].max())


def test_the_weights_are_those_of_the_end(flown):
    weights, log = strict_json(flown[1] / "weights.json"), columns(flown[1])
    assert (weights["neurons"], weights["seed"]) == (10, 1)
    for name in ("W1", "W2"):
        assert np.shape(weights[name]) == (10, 3)
        assert np.linalg.norm(weights[name]) == pytest.approx(log[f"norm_{name}[-]"][-1], rel=0.05)


@pytest.mark.parametrize("name", sorted(PICTURES))
def test_pictures_hold_no_script(flown, name):
    svg = ET.fromstring((flown[1] / "figures" / f"{name}.svg").read_text(encoding="utf-8"))
    assert not [element for element in svg.iter() if element.tag.endswith("script")]
    assert (flown[1] / "figures" / f"{name}.png").read_bytes().startswith(b"\x89PNG")


def test_pictures_have_axis_labels_with_units_and_legends(flown):
    shown = {}
    for name in PICTURES:
        svg = ET.fromstring((flown[1] / "figures" / f"{name}.svg").read_text(encoding="utf-8"))
        shown[name] = "".join("".join(svg.itertext()).split())  # a symbol is in several pieces
        assert "time[s]" in shown[name]
    for text in ("flown", "desired", "x[m]", "z−z["):
        assert text in shown["position"]
    for text in ("φ−φ[", "θ−θ[", "ψ−ψ["):
        assert text in shown["attitude"]
    for text in ("u[N]", "τ[Nm]ψ", "τ[Nm]θ", "τ[Nm]φ"):
        assert text in shown["inputs"]
    for text in ("W1", "W2", "|r|1", "|r|2", "f4"):  # the bars of |r1| come before what is below the line
        assert text in shown["learning"]


def test_the_summary_shows_name_errors_and_folder_as_plain_text(flown):
    run, folder = flown
    assert "".join(NAME.split()) in "".join(run.out.split())
    for axis in ("x [mm]", "y [mm]", "z [mm]", "psi [°]", "theta [°]", "phi [°]"):
        assert axis in run.out
    assert "Completed 1 s" in run.out
    assert f"Results: {folder}" in run.out


@pytest.mark.parametrize("name", ["a\\u0001b", "two\\nlines", "\\u001b[31mred", "飛行 ✈"])
def test_control_and_foreign_characters_in_a_name_are_refused_or_shown_without_noise(tmp_path, name):
    mission = write(tmp_path, f'name = "{name}"\n{LINE}')
    run = quadstep_process("fly", mission, "--out", tmp_path / "out", "--figures", "svg")
    if run.returncode == 2:
        assert run.stderr.count("\n") == 1
        assert "name" in run.stderr
        return
    assert run.returncode == 0
    assert run.stderr == ""
    assert "\x1b" not in run.stdout
    for picture in PICTURES:
        ET.parse(tmp_path / "out" / "figures" / f"{picture}.svg")


def test_the_folder_is_named_after_the_mission_if_none_is_given(tmp_path, monkeypatch, no_figures):
    monkeypatch.chdir(tmp_path)
    write(tmp_path, LINE, "around.toml")
    assert quadstep("fly", "around.toml").code == 0
    assert (tmp_path / "out" / "around" / "flight.csv").is_file()


def test_metrics_are_computed_once(tmp_path, monkeypatch, no_figures):
    computed, compute = [], lagrange.flight_metrics
    monkeypatch.setattr(lagrange, "flight_metrics", lambda log, **more: computed.append(log) or compute(log, **more))
    assert quadstep("fly", write(tmp_path, LINE), "--out", tmp_path / "out").code == 0
    assert len(computed) == 1
    assert (tmp_path / "out" / "page.html").exists()


def test_a_flight_without_nets_writes_no_weights(tmp_path, no_figures):
    mission = write(tmp_path, LINE + '[controller]\ntype = "nested-saturation"\n')
    assert quadstep("fly", mission, "--out", tmp_path / "out").code == 0
    assert set(files(tmp_path / "out")) == {"flight.csv", "metrics.json", "page.html", "report.html"}


DIVERGING = '[path]\ntype = "minimum-jerk"\nend = [20.0, 5.0, 10.0]\nduration = 3.0\n[disturbance]\nscale = 5.0\n'


@pytest.fixture(scope="module")
def diverged(tmp_path_factory):
    folder = tmp_path_factory.mktemp("diverged")
    return quadstep("fly", write(folder, DIVERGING), "--out", folder / "out"), folder / "out"


def test_a_diverging_flight_ends_with_code_3_and_says_when_and_why(diverged):
    run, folder = diverged
    metrics = strict_json(folder / "metrics.json")
    assert (run.code, run.err) == (3, "")
    assert 0.0 < metrics["ended[s]"] < 3.0
    assert metrics["outcome"] in {"not_finite", "off_path", "singular", "spinning"}
    assert f"Lost at {metrics['ended[s]']:g} s" in run.out


def test_a_diverging_flight_keeps_its_finite_log_and_figures_up_to_then(diverged):
    _, folder = diverged
    log = columns(folder)
    assert np.isfinite(list(log.values())).all()
    assert len(log["t[s]"]) > 10
    assert log["t[s]"][-1] < strict_json(folder / "metrics.json")["ended[s]"]
    assert {f"figures/{name}.svg" for name in PICTURES} <= set(files(folder))


def test_a_diverging_flight_leaves_no_weights_to_start_another_from(diverged):
    assert not (diverged[1] / "weights.json").exists()


@pytest.mark.parametrize("engine", ["lanes", "python"])
def test_a_flight_that_is_lost_at_once_is_reported_too(tmp_path, engine):
    mission = write(tmp_path, LINE + "[start]\nposition = [500.0, 0.0, 0.0]\n")
    run = quadstep("fly", mission, "--out", tmp_path / "out", "--engine", engine)
    assert run.code == 3
    assert "Lost at 0 s: more than 100 m from its path" in run.out
    assert columns_of_empty(tmp_path / "out") == []
    assert strict_json(tmp_path / "out" / "metrics.json")["outcome"] == "off_path"


def columns_of_empty(folder):
    header, *rows = (folder / "flight.csv").read_text(encoding="utf-8").split("\n")
    assert header.startswith("t[s],")
    return [row for row in rows if row]


@pytest.mark.parametrize("engine", ["lanes", "python"])
def test_a_flight_that_breaks_between_two_control_samples_is_a_divergence_too(tmp_path, no_figures, engine):
    slow = "[simulation]\nduration = 5.0\ncontrol_period = 20.0\n[disturbance]\ntorque = [1e6, 1e7, 1e8]\n"
    run = quadstep("fly", write(tmp_path, LINE + slow), "--out", tmp_path / "out", "--engine", engine)
    assert run.code == 3
    assert np.isfinite(list(columns(tmp_path / "out").values())).all()
    strict_json(tmp_path / "out" / "metrics.json")


def test_gains_against_the_theorem_are_warned_of_in_one_line_each(tmp_path, no_figures):
    mission = write(tmp_path, LINE + '[controller]\ntype = "backstepping"\nK_r1 = [3.0, 0.9, 3.0]\n')
    run = quadstep("fly", mission, "--out", tmp_path / "out")
    assert run.code == 0
    (line,) = run.err.splitlines()
    assert line.startswith("quadstep: warning: ")
    assert all(part in line for part in (str(mission), "controller.K_r1 (y)", "Theorem 5.1"))
    assert len(strict_json(tmp_path / "out" / "metrics.json")["warnings"]) == 1


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    """A flight and, warm-started from its weights, another."""
    folder = tmp_path_factory.mktemp("trained")
    with pytest.MonkeyPatch.context() as patch:
        without_figures(patch)
        first = write(folder, LINE)
        assert quadstep("fly", first, "--out", folder / "first").code == 0
        second = write(folder, LINE + '[controller]\ntype = "backstepping"\nnets.weights = "first/weights.json"\n', "2.toml")
        assert quadstep("fly", second, "--out", folder / "second").code == 0
    return folder


@pytest.mark.parametrize("name", ["W1", "W2"])
def test_a_warm_start_begins_with_the_saved_weights(trained, name):
    saved = strict_json(trained / "first" / "weights.json")[name]
    assert columns(trained / "first")[f"norm_{name}[-]"][0] == 0.0
    assert columns(trained / "second")[f"norm_{name}[-]"][0] == pytest.approx(np.linalg.norm(saved), rel=1e-12)


def test_nets_that_start_late_learn_nothing_before(tmp_path, no_figures):
    mission = write(tmp_path, LINE + '[controller]\ntype = "backstepping"\nnets.start = 0.5\n')
    assert quadstep("fly", mission, "--out", tmp_path / "out").code == 0
    log = columns(tmp_path / "out")
    late = log["t[s]"] > 0.505
    for name in ("norm_W1[-]", "norm_W2[-]"):
        assert (log[name][~late] == 0.0).all()
        assert (log[name][late] > 0.0).all()


def test_rotor_limits_hold_in_the_log(tmp_path, no_figures):
    mission = write(tmp_path, LINE + "[vehicle]\ninertia = 0.02\nrotors.limits = [0.5, 4.0]\n[simulation]\nduration = 1.0\n")
    quadstep("fly", mission, "--out", tmp_path / "out")
    log = columns(tmp_path / "out")
    forces = np.array([log[f"f{i}[N]"] for i in range(1, 5)])
    assert forces.min() >= 0.5 - 1e-9
    assert forces.max() <= 4.0 + 1e-9


def test_a_flown_log_is_itself_a_path(tmp_path, flown, no_figures):
    mission = write(tmp_path, f"[path]\ntype = \"recorded\"\nfile = '{flown[1] / 'flight.csv'}'\n")
    assert quadstep("fly", mission, "--out", tmp_path / "out").code == 0
    again, before = columns(tmp_path / "out"), columns(flown[1])
    assert again["x_d[m]"] == pytest.approx(before["x[m]"], abs=0.1)
