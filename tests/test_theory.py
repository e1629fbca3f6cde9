"""The repaired theorem through the functions that fly, and the completed controller beside the paper's."""

import json

import numpy as np
import pytest

from quadstep.control import completed_backstepping
from quadstep.control.completed_backstepping import coupling_columns, half_sine_ratio
from quadstep.control.projection import project
from quadstep.flight.closed_loop import Outcome
from quadstep.flight.engine import Engine
from quadstep.flight.engines import fly
from quadstep.mission.schema import Mission
from quadstep.numbers import vector
from quadstep.study.cases import stress
from quadstep.theory import comparison, inequalities, lyapunov
from quadstep.theory.comparison import COMPLETED, PAPER, grid, summarise
from quadstep.theory.inequalities import check_inequalities
from quadstep.theory.samples import draw_sample
from quadstep.vehicle.kinematics import thrust_direction

SAMPLES = 20_000


def broken() -> set[str]:
    return {margin.number for margin in check_inequalities(SAMPLES) if not margin.holds}


def test_every_inequality_of_the_theorem_holds_on_random_closed_loops():
    assert broken() == set()


def test_the_rate_of_l_is_the_same_by_differences_of_its_terms():
    """d/dt 1/2 e2^T P e2 is e2^T P e2_dot only if e2_dot is what the motion says: check it against a small step."""
    sample = draw_sample(3, 200)
    motion = lyapunov.closed_loop(sample, completed=True)
    wanted = np.array(list(sample.memory.paper.filtered.rate)) - np.array(list(sample.state.rates))[1:]
    assert np.allclose(np.array(list(motion.e2_dot))[1:], wanted, rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    ("name", "replacement", "row"),
    [
        ("coupling_columns", lambda tilt, wanted: tuple(-b for b in coupling_columns(tilt, wanted)), "T9"),
        ("coriolis", lambda *a: 0.9 * lyapunov.coriolis(*a), "T9"),
        ("effective_inertia", lambda *a: 1.1 * lyapunov.effective_inertia(*a), "T9"),
    ],
)
def test_a_wrong_term_in_the_completed_law_breaks_the_identity(monkeypatch, name, replacement, row):
    monkeypatch.setattr(completed_backstepping, name, replacement)
    assert row in broken()


def test_a_wrong_sign_in_the_papers_law_breaks_both_identities(monkeypatch):
    from quadstep.control import backstepping

    right = backstepping.wanted_torque
    monkeypatch.setattr(backstepping, "wanted_torque", lambda g, r2, i, e: right(g, -r2, i, e))
    assert "T11" in broken()


def test_coupling_columns_are_the_derivative_of_the_thrust_direction_for_equal_tilts():
    theta, phi, step = 0.4, -0.7, 1e-6
    columns = coupling_columns(vector(theta, phi), vector(theta, phi))
    for column, move in zip(columns, ((0.0, step, 0.0), (0.0, 0.0, step)), strict=True):
        ahead = thrust_direction(vector(0.0, theta, phi) + vector(*move))
        behind = thrust_direction(vector(0.0, theta, phi) - vector(*move))
        assert np.allclose(list(column), np.array(list(ahead - behind)) / (2 * step), atol=1e-9)


def test_half_sine_ratio_is_smooth_through_zero():
    x = np.array([0.0, 1e-9, 1.9e-4, 2.1e-4, 1.0, np.pi])
    with np.errstate(all="ignore"):
        exact = np.where(x == 0, 1.0, np.sin(x / 2) / np.where(x == 0, 1.0, x / 2))
    assert np.allclose([half_sine_ratio(float(v)) for v in x], exact, rtol=1e-15)


def test_projection_keeps_what_is_inside_and_shortens_what_is_outside():
    assert list(project(vector(1.0, 2.0, 2.0), 3.0)) == [1.0, 2.0, 2.0]
    assert np.allclose(list(project(vector(2.0, 4.0, 4.0), 3.0)), [1.0, 2.0, 2.0])
    assert list(project(vector(0.0, 0.0, 0.0), 3.0)) == [0.0, 0.0, 0.0]


def completed(**controller) -> Mission:
    content = stress(3.0, 1.0).model_dump(exclude_unset=True)
    return Mission.model_validate(
        json.loads(json.dumps(content)) | {"controller": {"type": "completed-backstepping", **controller}}
    )


def test_the_completed_law_flies_the_stress_flight_that_the_papers_does_not():
    assert fly(stress(3.0, 1.0).plan()).outcome is not Outcome.COMPLETED
    assert fly(completed().plan()).outcome is Outcome.COMPLETED


def test_engines_agree_on_the_completed_law():
    plan = completed().plan()
    plan = plan._replace(ticks=plan.ticks._replace(last=500))
    lanes, floats = fly(plan), fly(plan, Engine.PYTHON)
    assert np.abs(lanes.rows - floats.rows).max() < 1e-9 * np.abs(floats.rows).max()


def test_weights_and_integrals_stay_within_their_bounds():
    log = fly(completed(weight_bounds=[0.05, 0.02], integral_bounds=[0.001, 0.002]).plan())
    assert log.column("norm_W1").max() <= 0.05 * (1 + 1e-12)
    assert log.column("norm_W2").max() <= 0.02 * (1 + 1e-12)
    assert log.column("norm_W1").max() > 0.049
    memory = log.final.memory.paper
    assert memory.integral_1.norm() <= 0.001 * (1 + 1e-12)
    assert memory.integral_2.norm() <= 0.002 * (1 + 1e-12)


def test_completed_is_never_worse_by_one_percent_and_loses_no_flight(monkeypatch):
    monkeypatch.setattr(comparison, "INNER_LOOPS", ((250.0, 15.0), (31.0, 3.0), (10.5, 1.0)))
    monkeypatch.setattr(comparison, "TIMES", (8.0, 3.0))
    cells = grid()
    summary = summarise(cells, COMPLETED)
    assert summary.flights == len([cell for cell in cells if cell.law == PAPER]) == 36
    assert (summary.lost, summary.worse) == (0, 0)
    assert summary.gained >= 10


def test_a_broken_inequality_is_told_by_the_exit_code(monkeypatch, tmp_path, capsys):
    from quadstep import cli
    from quadstep.theory import completion

    monkeypatch.setattr(inequalities, "CHECKS", (("T0", "one is at most zero", lambda s: np.array([-1.0])),))
    monkeypatch.setattr(completion, "grid", lambda: [])
    monkeypatch.setattr(completion, "summarise", lambda cells, law: comparison.Summary(0, 0, 0, 0, 0, 0, 1.0, 1.0))
    monkeypatch.setattr("quadstep.theory.completion.draw_map", draw_nothing)
    monkeypatch.setattr("sys.argv", ["quadstep", "study", "completion", "--out", str(tmp_path / "out"), "--samples", "10"])
    with pytest.raises(SystemExit) as stop:
        cli.main()
    assert stop.value.code == 1
    assert "BROKEN" in capsys.readouterr().out
    assert json.loads((tmp_path / "out" / "metrics.json").read_text())["inequalities"][0]["holds"] is False


def draw_nothing(folder, cells) -> None:
    (folder / "completion.svg").write_text("<svg></svg>")
