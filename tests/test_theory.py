"""The repaired theorem through the functions that fly, and the completed controller compared with the paper's."""

import json
from functools import cache

import numpy as np
import pytest

from quadstep.control import completed_backstepping
from quadstep.control.backstepping import BacksteppingMemory
from quadstep.control.completed_backstepping import CompletedBackstepping, coupling_columns, half_sine_ratio
from quadstep.control.filters import Filtered
from quadstep.control.vectoring import project
from quadstep.engines.engine import Engine
from quadstep.engines.fly import fly
from quadstep.interfaces.closed_loop import Outcome
from quadstep.mission.schema import Mission
from quadstep.numbers import Vector, vector
from quadstep.proofs.theory import completion, lyapunov, trials
from quadstep.proofs.theory.completion import FACTOR, StatementRecord, check_statements, search
from quadstep.proofs.theory.inequalities import STATEMENTS, Sides, Statement
from quadstep.proofs.theory.lyapunov import closed_loop, lyapunov_rate
from quadstep.proofs.theory.trials import LoopBatch, draw_sample, sample_at
from quadstep.studies.paper.cases import stress
from quadstep.vehicle.paper import State, thrust_direction
from tests.theorem_again import other_kappa_terms, other_learning_terms

SAMPLES = 5_000
BY_NUMBER = {statement.number: statement for statement in STATEMENTS}


@cache
def sought(number: str) -> tuple[completion.StatementMargin, completion.Cube]:
    """What a statement shows on random closed loops and where a search brings it; and where that ended."""
    statement, seen = BY_NUMBER[number], StatementRecord()
    seen.look(statement.sides(draw_sample(7, SAMPLES)))
    ended = search(statement, seen)
    return completion.StatementMargin(number, statement.says, seen.worst, SAMPLES, seen.reached), ended


def broken(monkeypatch) -> set[str]:
    """On random closed loops alone."""
    monkeypatch.setattr(completion, "STEPS", 0)
    return {margin.number for margin in check_statements(2_000) if not margin.holds}


@pytest.mark.parametrize("number", BY_NUMBER)
def test_every_statement_holds_and_breaks_with_nine_tenths_of_any_term_of_its_bound(number):
    margin, _ = sought(number)
    assert margin.holds
    assert {term: share for term, share in margin.reached.items() if share <= FACTOR} == {}
    assert margin.bites


@pytest.mark.parametrize(("number", "shares"), [
    ("T9", {"c_raw - c": 0.99}),
    ("T10", {"eps": 0.0}),
    ("T10", {"c_raw - c": 0.0}),
    ("T10", {"kappa |W~| |W|": 0.0}),
    ("T10", {"eps": 0.0, "c_raw - c": 0.0, "kappa |W~| |W|": 0.0}),
    ("T11", {"delta_f": 0.99}),
    ("T12", {"eps": 0.0}),
    ("T12", {"kappa |W~| |W|": 0.0}),
    ("T12", {"u |r1| |e2|": 0.5}),
])  # fmt: skip
def test_a_statement_that_lacks_a_term_is_found_broken(number, shares):
    _, ended = sought(number)
    (side,) = BY_NUMBER[number].sides(sample_at(ended))
    assert set(shares) <= set(side.terms)
    seen = StatementRecord()
    seen.look([side._replace(terms={name: shares.get(name, 1.0) * term for name, term in side.terms.items()})])
    assert seen.worst < -1e-6


def test_a_bound_that_nothing_comes_near_to_does_not_bite(monkeypatch):
    monkeypatch.setattr(completion, "STEPS", 20)

    def sides(sample):
        x = sample.state.position[0]
        return [Sides(np.sin(x), {"2": 2.0 + 0.0 * x}, 1.0)]

    seen = StatementRecord()
    search(Statement("T0", "sin x <= 2", sides), seen)
    margin = completion.StatementMargin("T0", "", seen.worst, 1, seen.reached)
    assert margin.holds
    assert not margin.bites
    assert seen.reached["2"] == pytest.approx(0.5, abs=1e-3)


def test_a_statement_that_is_no_number_somewhere_does_not_hold():
    seen = StatementRecord()
    with np.errstate(invalid="ignore"):
        seen.look([Sides(np.array([0.0, 0.0]), {"root": np.sqrt(np.array([1.0, -1.0]))}, 1.0)])
    seen.look([Sides(np.array([0.0, 0.0]), {"root": np.array([1.0, 1.0])}, 1.0)])
    assert not completion.StatementMargin("T0", "", seen.worst, 2, seen.reached).holds


def test_the_terms_of_learning_are_made_of_the_errors_of_the_weights_and_of_what_the_law_returns():
    assert other_kappa_terms() == []
    assert other_learning_terms() == []


def level(sample: LoopBatch, is_completed: bool):
    """L of Eq. 55, with 1/2 e2^T P e2; P = p I for the paper's law."""
    motion, paper, before = closed_loop(sample, is_completed), sample.gains.paper, sample.memory.paper
    p = sample.gains.coupling if is_completed else Vector([sample.gains.coupling[0]] * 3)
    r1, r2, e2 = motion.outer.r1, motion.r2, motion.e2
    twice = sample.vehicle.mass * (r1 @ r1) + r2 @ (motion.j @ r2) + e2 @ (p * e2)
    for gain, integral in ((paper.integral_1, before.integral_1), (paper.integral_2, before.integral_2)):
        twice = twice + integral @ (gain * integral)
    for net, ideal, weights in zip(
        (paper.force_net, paper.torque_net), sample.ideal, (before.weights_1, before.weights_2), strict=True
    ):
        twice = twice + lyapunov.sum_squares(ideal - weights) / net.learning_rate
    return 0.5 * twice


def later(sample: LoopBatch, is_completed: bool, h: float) -> LoopBatch:
    """The closed loop h seconds on, to first order: the plant by its own rates, the memory by those of the law's sample."""
    motion, state, wanted, memory = closed_loop(sample, is_completed), sample.state, sample.reference, sample.memory
    before, after, share = memory.paper, motion.following, h / sample.period
    counter = CompletedBackstepping().law(memory, state, wanted, sample.gains, 0.0, sample.period)[1].counter
    xi_dd = wanted.acceleration + sample.gains.paper.slope_1 * (wanted.velocity - state.velocity) - motion.r1_dot
    return sample._replace(
        state=State(
            state.position + h * state.velocity, state.velocity + h * xi_dd,
            state.attitude + h * state.rates, state.rates + h * motion.eta_dd,
        ),
        reference=wanted._replace(
            position=wanted.position + h * wanted.velocity, velocity=wanted.velocity + h * wanted.acceleration,
            yaw=wanted.yaw + h * wanted.yaw_rate, yaw_rate=wanted.yaw_rate + h * wanted.yaw_acceleration,
        ),
        memory=memory._replace(
            paper=BacksteppingMemory(
                before.integral_1 + share * (after.integral_1 - before.integral_1),
                before.integral_2 + share * (after.integral_2 - before.integral_2),
                Filtered(before.filtered.value + h * before.filtered.rate,
                         before.filtered.rate + share * (after.filtered.rate - before.filtered.rate)),
                before.weights_1 + share * (after.weights_1 - before.weights_1),
                before.weights_2 + share * (after.weights_2 - before.weights_2),
            ),
            counter=memory.counter._replace(
                value=memory.counter.value + share * (counter.value - memory.counter.value)),
        ),
    )  # fmt: skip


@pytest.mark.parametrize("is_completed", [True, False])
def test_the_terms_of_l_dot_are_those_of_the_chain_rule(is_completed):
    sample, h = draw_sample(3, 200), 1e-6
    ahead, behind = (level(later(sample, is_completed, step), is_completed) for step in (h, -h))
    rate = lyapunov_rate(sample, is_completed)
    assert np.max(np.abs((ahead - behind) / (2.0 * h) - rate.flown) / (rate.scale + np.abs(ahead))) < 1e-6


@pytest.mark.parametrize(("name", "replacement", "row"), [
    ("coupling_columns", lambda tilt, wanted: tuple(-b for b in coupling_columns(tilt, wanted)), "T9"),
    ("coriolis", lambda *a: 0.9 * lyapunov.coriolis(*a), "T9"),
    ("effective_inertia", lambda *a: 1.1 * lyapunov.effective_inertia(*a), "T9"),
])  # fmt: skip
def test_a_wrong_term_in_the_completed_law_breaks_the_identity(monkeypatch, name, replacement, row):
    monkeypatch.setattr(completed_backstepping, name, replacement)
    assert row in broken(monkeypatch)


def test_a_wrong_sign_in_the_papers_law_breaks_both_identities(monkeypatch):
    from quadstep.control import backstepping

    right = backstepping.desired_torque
    monkeypatch.setattr(backstepping, "desired_torque", lambda g, r2, i, e: right(g, -r2, i, e))
    assert "T11" in broken(monkeypatch)


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


def test_a_broken_inequality_is_told_by_the_exit_code(monkeypatch, tmp_path, capsys):
    from quadstep.commands import cli
    from quadstep.proofs.theory import completion

    wrong = Statement("T0", "one is zero", lambda s: [Sides(1.0, {"zero": 0.0 * s.state.position[0]}, 1.0, equal=True)])
    monkeypatch.setattr(completion, "STATEMENTS", (wrong,))
    monkeypatch.setattr(completion, "grid", lambda: [])
    monkeypatch.setattr(completion, "summarise", lambda *cells: trials.ComparisonSummary(0, 0, 0, 0, 0, 0, 1.0, 1.0, 1.0))
    monkeypatch.setattr("quadstep.proofs.theory.completion.draw_map", draw_nothing)
    monkeypatch.setattr("sys.argv", ["quadstep", "study", "completion", "--out", str(tmp_path / "out"), "--samples", "10"])
    with pytest.raises(SystemExit) as stop:
        cli.main()
    assert stop.value.code == 1
    said = " ".join(capsys.readouterr().out.split())
    assert "broken" in said
    assert "the completed law without counter-term 0: 0 gained" in said, "laws in words"
    assert json.loads((tmp_path / "out" / "metrics.json").read_text())["statements"][0]["holds"] is False


def draw_nothing(folder, cells) -> None:
    (folder / "completion.svg").write_text("<svg></svg>")
