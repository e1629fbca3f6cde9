"""The parts of a certificate: history, L and its rate, ideal weights, conditions, bounds, verdict, and what is refused."""

import re
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest

from quadstep.control.backstepping import Backstepping
from quadstep.engines.engine import Engine
from quadstep.engines.fly import fly
from quadstep.engines.loop import Loop
from quadstep.interfaces.closed_loop import Outcome
from quadstep.interfaces.plant import Reference
from quadstep.io.errors import UserError
from quadstep.metrics.quantities import position_errors
from quadstep.metrics.reductions import rmse
from quadstep.numbers import Vector, vector, where
from quadstep.proofs.certify.certificate import certify_plan, check_path, check_plan, error_radius, weight_radius
from quadstep.proofs.certify.history import fit_all, recall, residual_bound, targets, weight_bound
from quadstep.proofs.certify.lyapunov import conditions, matrices
from quadstep.proofs.certify.output import record
from quadstep.proofs.certify.standing import answer, contradicting, culprit, facts, kind, of_ball, standing
from quadstep.proofs.plain import dot, lengths
from quadstep.vehicle.paper import acceleration, derivative, disturb
from quadstep.world.paths import MinimumJerk
from tests.certificates import LINE, plan, still

UNEQUAL = {"mass": 1.3, "inertia": [4.0, 5.0, 6.0]}
OFF = {"position": [0.2, -0.1, 0.0], "attitude": [0.1, 0.05, -0.1]}


def test_a_law_derived_from_the_papers_is_not_taken_for_it():
    class Derived(Backstepping):
        """May command anything."""

    law = plan()
    check_plan(law)
    with pytest.raises(UserError, match=r"Derived is not the law of Theorem 5\.1"):
        check_plan(law._replace(loop=replace(law.loop, controller=Derived())))


def every_sample(plan):
    return plan._replace(ticks=plan.ticks._replace(log=plan.ticks.every[0]))


@cache
def rich():
    """A flight with everything in it: unequal inertias, a wrong mass, an initial error, turning yaw, disturbances, nets."""
    return certify_plan(rich_plan())


def rich_plan(**simulation):
    return plan(
        vehicle=UNEQUAL,
        start=OFF,
        controller={"mass": 1.2, "nets": {"start": 1.0, "kappa2": 0.02}},
        disturbance={"scale": 1.0, "force": [0.3, 0.0, -0.2], "torque": [0.0, 0.5, 0.0]},
        simulation={"duration": 4.0, **simulation},
    )


def test_the_history_is_what_the_controller_itself_remembered():
    flown = every_sample(rich_plan(duration=1.5))
    log = fly(flown, Engine.PYTHON)
    history = recall(flown, log)
    before = history.weights_1[-1] / history.on[-1]
    after = before + history.period * history.weight_rates_1[-1]
    memory = log.final.memory
    np.testing.assert_allclose(after, [list(row) for row in memory.weights_1], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(history.integral_1[-1] + history.period * history.r1[-1], list(memory.integral_1), rtol=1e-9)
    np.testing.assert_allclose(history.integral_2[-1] + history.period * history.r2[-1], list(memory.integral_2), rtol=1e-9)
    second = history.desired_rates[-1, 1:] + history.period * history.desired_accelerations[-1, 1:]
    np.testing.assert_allclose(second, list(memory.filtered.rate), rtol=1e-9)
    assert history.mismatch < 1e-10
    assert history.excess.max() < 1e-8


def test_l_dot_of_eq_56_with_the_coupling_term_is_the_plants_own():
    found = rich().lyapunov
    scale = np.abs(found.rate).max()
    assert np.abs(found.terms - found.rate).max() < 1e-11 * scale
    assert np.abs(found.skew).max() < 1e-11 * scale
    for left_out in ("dissipation", "residual", "learning", "coupling"):
        assert np.abs(getattr(found, left_out)).max() > 1e-5 * scale


def test_l_is_eq_55():
    c = rich()
    h, k = c.history, 300
    j = matrices(rich_plan(), h).inertia[k]
    w1, w2 = (c.ideal.fits[0].weights - h.weights_1[k], c.ideal.fits[1].weights - h.weights_2[k])
    wanted = 0.5 * (
        1.3 * h.r1[k] @ h.r1[k] + h.r2[k] @ j @ h.r2[k]
        + 0.2 * h.integral_1[k] @ h.integral_1[k] + 10.0 * h.integral_2[k] @ h.integral_2[k]
        + (np.sum(w1**2) + np.sum(w2**2)) / 5.0
    )  # fmt: skip
    assert c.lyapunov.value[k] == pytest.approx(wanted, rel=1e-12)


def test_l_dot_agrees_with_differences_of_l_and_better_at_a_shorter_period():
    gaps = []
    for step in (0.002, 0.0005):
        found = record(certify_plan(plan(simulation={"duration": 2.0, "step": step, "control_period": step})))["lyapunov"]
        gaps.append(found["formula_less_differenced_rms"])
        assert found["same_sign_as_differenced"] > 0.99
    assert gaps[0] < 0.15
    assert 0.2 < gaps[1] / gaps[0] < 0.3  # first order in the period


def test_the_targets_are_what_the_plant_lacks():
    """Eqs 18 and 32 the other way round: what remains of m r1_dot and J r2_dot when all known terms are taken away."""
    c, flown = rich(), rich_plan()
    h, about = c.history, matrices(flown, c.history)
    first, second = targets(flown, h, about.inertia, about.coriolis)
    middle = slice(600, 1990)
    m, g = 1.3, np.array([0.0, 0.0, 9.81])
    force, moment = (np.stack(np.broadcast_arrays(*part), axis=1) for part in disturb(flown.parameters.disturbance, h.state))
    wanted = -force + (m - 1.2) * (np.stack(list(h.reference.acceleration), axis=1) - h.e1 + g)
    np.testing.assert_allclose(first, wanted, atol=1e-12)
    estimate = np.einsum("nij,ni->nj", h.weights_2, h.mu_2)
    r2_dot = np.gradient(h.r2, h.period, axis=0)
    left = np.einsum("nij,nj->ni", about.inertia, r2_dot - 15.0 * h.r2) + np.einsum("nij,nj->ni", about.coriolis, h.r2)
    known = estimate + 250.0 * h.r2 + 10.0 * h.integral_2
    assert lengths(left + known - second)[middle].max() < 0.05 * lengths(second)[middle].max()
    assert lengths(moment).max() > 0.4
    largest = [lengths(one).max() for one in (first, second)]
    assert record(c)["nets"]["largest_target"] == pytest.approx(largest, rel=1e-9)


def test_the_missing_force_is_bounded_by_thrust_times_attitude_error_and_filter():
    h = rich().history
    assert (lengths(h.delta) <= h.thrust * lengths(h.e2[:, 1:]) + lengths(h.lag) + 1e-12).all()
    said = record(rich())["coupling"]
    assert said["share_within_u_e2_and_filter"] == 1.0
    work, r = np.mean(lengths(h.r1) * lengths(h.delta)), np.concatenate([h.r1, h.r2], axis=1)
    assert said["ratio_in_the_mean"] == pytest.approx(work / (rich().conditions.k_min * np.mean(lengths(r) ** 2)))


def test_least_squares_leaves_a_residual_orthogonal_to_the_basis():
    rng = np.random.default_rng(5)
    mu, aim = rng.uniform(size=(400, 6)), rng.normal(size=(400, 3))
    fits = fit_all(mu, aim)
    np.testing.assert_allclose(fits[0].weights, np.linalg.lstsq(mu, aim, rcond=None)[0], rtol=1e-10)
    assert np.abs(mu.T @ fits[0].residual).max() < 1e-10
    for fit in fits:
        np.testing.assert_allclose(mu @ fit.weights + fit.residual, aim, atol=1e-10)
    norms = [np.linalg.norm(fit.weights) for fit in fits]
    assert norms == sorted(norms, reverse=True)
    assert norms[-1] == 0.0


def test_the_weights_taken_make_the_smallest_b_r():
    c = rich()
    assert c.b_r <= c.b_r_plain
    assert c.weight_bound == pytest.approx(np.sqrt(sum(np.sum(fit.weights**2) for fit in c.ideal.fits)))
    assert c.residual_bound == pytest.approx(np.sqrt(sum(dot(one.residual, one.residual) for one in c.ideal.fits)).max())
    assert weight_bound(c.ideal.plain) >= c.weight_bound
    assert residual_bound(c.ideal.plain) > 0.0


def test_bounds_by_hand():
    assert error_radius(2.0, 3.0, 0.01, 4.0) == pytest.approx((0.01 + 3.0) / 4.0)
    assert error_radius(2.0, 3.0, 1.0, 4.0) == pytest.approx(1.0)
    assert error_radius(2.0, 3.0, 0.01, 0.0) is None
    assert weight_radius(2.0, 3.0, (1.0, 1.0)) == pytest.approx(1.0 + 2.0)
    assert weight_radius(2.0, 3.0, (0.0, 1.0)) is None
    w = weight_radius(2.0, 3.0, (0.5, 1.5))
    assert 0.5 * w**2 - 1.5 * 2.0 * w == pytest.approx(3.0)


def level(count=3, **controller):
    return conditions(plan(controller=controller), np.broadcast_to(5.0 * np.eye(3), (count, 3, 3)), np.full(count, 9.81))


def test_conditions_by_hand():
    k = level(K_r2=[120.0, 130.0, 140.0], Lambda2=[4.0, 5.0, 6.0])
    assert (k.j_visited, k.j_anywhere) == (5.0, 10.0)
    assert k.printed_visited == (100.0, 105.0, 110.0)
    assert k.corrected_visited == (90.0, 100.0, 110.0)
    assert k.corrected_anywhere == (60.0, 70.0, 80.0)
    assert (k.k_1, k.k_2, k.l_2, k.k_min) == (2.0, 90.0, 4.0, 2.0)
    assert k.thrust_bound == pytest.approx(2.0 * 4.0 * np.sqrt(180.0))
    assert k.thrust_bound_anywhere == pytest.approx(2.0 * 4.0 * np.sqrt(120.0))
    assert k.coupling_holds
    assert k.broken() == []


def test_printed_and_corrected_conditions_differ_for_unequal_lambda2():
    k = level(K_r2=[15.0, 60.0, 260.0], Lambda2=[1.0, 5.0, 25.0])
    assert k.printed_hold
    assert not k.hold
    assert k.thrust_bound is None
    assert not k.coupling_holds
    assert [line.split(" in ")[1][:3] for line in k.broken()] == ["psi", "the"]


def test_a_gain_at_its_bound_breaks_the_condition():
    assert level(K_r1=1.0).broken() == [f"K_r1 - m Lambda1 = 0 N s/m in {axis}, not above 0" for axis in "xyz"]
    assert len(level(K_r2=75.0).broken()) == 3
    assert level(K_r2=75.001).hold


def test_the_coupling_bound_is_where_the_form_stops_being_positive_definite():
    k = level(K_r2=6.0, Lambda2=0.5)
    p = 2.0 * k.l_2 * k.k_2
    for share, sign in ((0.999, 1), (1.001, -1)):
        u = share * k.thrust_bound
        form = [[k.k_1, -u / 2, 0.0], [-u / 2, p * k.l_2, -p / 2], [0.0, -p / 2, k.k_2]]
        assert np.sign(np.linalg.eigvalsh(form)[0]) == sign
    assert "2 l_2 sqrt(k_1 k_2)" in k.broken()[0]


def test_a_flight_that_starts_outside_b_r_and_falls_there_is_sign_consistent():
    c = certify_plan(still(start={"attitude": [0.5, 0.0, 0.0]}))
    assert kind(c) == "sign consistent"
    assert c.outside.sum() > 0
    assert c.entered > 0
    assert answer(c).startswith("This flight agrees with Theorem 5.1: its conditions hold, and L fell wherever the error was")
    assert facts(c)[1][1:3] == ("fell", f"at each of {c.outside.sum()} samples")


def test_a_flight_that_enters_the_ball_and_leaves_it_again_is_told_so():
    path = {"type": "minimum-jerk", "end": [20.0, 5.0, 10.0], "duration": 40.0}
    c = certify_plan(plan(path=path, start={"position": [0.0, 0.0, -2.0]}, simulation={"duration": 3.0}))
    assert kind(c) == "sign consistent"
    first, *again = np.flatnonzero(np.diff(c.outside.astype(int)))  # in, and out
    assert c.history.t[first + 1] < c.history.t[again[0] + 1]
    for needed in (
        f"entered b_r = {c.b_r:.4g} at {c.history.t[first + 1]:.4g} s, left it again at {c.history.t[again[0] + 1]:.4g} s",
        "was last outside at",
    ):
        assert needed in of_ball(c)


def test_an_error_that_leaps_over_the_ball_within_a_control_period_is_no_agreement():
    slow = {"duration": 3.0, "step": 0.002, "control_period": 0.1}  # K_r2 period / J is 2: r2 changes its sign each time
    c = certify_plan(still({"K_r2": 100.0}, start={"attitude": [0.5, 0.0, 0.0]}, simulation=slow))
    assert (c.lyapunov.rate[c.outside] < 0.0).all()
    assert kind(c) == "rising between samples"
    assert "leaves Theorem 5.1 undecided" in answer(c)
    assert re.search(r"L rose in \d+ of the 30 periods", answer(c))


def test_rising_outside_b_r_is_said_with_its_share():
    c = certify_plan(still(start={"attitude": [0.5, 0.0, 0.0]}))
    rate = np.where(np.cumsum(c.outside) % 2 == 0, c.lyapunov.rate, 1.0)
    c = c._replace(lyapunov=c.lyapunov._replace(rate=rate))
    assert kind(c) == "contradicted"
    unknown = c._replace(lyapunov=c.lyapunov._replace(rate=rate * np.nan))
    assert kind(unknown) == "contradicted"  # a rate that is no number agrees with nothing
    count = c.outside.sum()
    assert f"At {count - count // 2} of the {count} samples outside the ball b_r, dL/dt was not negative" in answer(c)


def test_the_other_verdicts_have_their_numbers():
    c = rich()
    assert kind(c) == "untested"
    assert f"{c.r.max():.4g} <= {c.b_r:.4g}" in of_ball(c)
    assert facts(c)[1][1:3] == ("not tested", f"|r| is at most {c.r.max():.4g}, b_r = {c.b_r:.4g}")
    broken = c._replace(conditions=level(K_r2=75.0))
    assert kind(broken) == "conditions broken"
    unmet = "is not covered by the proof of Theorem 5.1: K_r2 - J_M max(Lambda2) = 0 N m s in psi with J_M = 5, not above 0;"
    assert unmet in answer(broken)
    assert facts(broken)[0][1:3] == ("violated", "")
    lost = answer(c._replace(outcome=Outcome.SPINNING, ended=3.5))
    assert lost.startswith("Lost at 3.5 s. Up to 4 s, this flight meets the conditions of Theorem 5.1 but does not test")
    assert "tests it in yaw" not in lost  # which flies as it should not, whatever it is told


def test_a_flight_whose_coupling_raises_l_outside_the_ball_contradicts_the_theorem_as_printed():
    """Found by a random search: the printed conditions hold, and the condition that the theorem omits does not."""
    law = {"K_r1": 333.0, "Lambda1": 0.74, "K_r2": 7.0, "Lambda2": 0.544}
    c = certify_plan(still(law, start={"attitude": [0.04, 0.075, -0.256], "position": [0.002, 0.03, -0.024]}))
    assert c.conditions.printed_hold
    assert not c.conditions.coupling_holds
    assert (kind(c), standing(c)) == ("lost", "contradicted")
    at = contradicting(c)
    assert np.all(c.r[at] > c.b_r_printed)
    assert np.all((c.lyapunov.rate - c.lyapunov.coupling)[at] < 0.0)
    assert culprit(c) == "coupling"
    assert [one[:3] for one in facts(c)[:2]] == [
        ("printed conditions", "hold", ""),
        ("repaired conditions", "violated", "all but that of the coupling hold"),
    ]
    assert f"At {at.sum()} of the {c.outside.sum()} samples outside the ball b_r, dL/dt" in answer(c)
    assert "mostly because of the omitted coupling" in answer(c)
    assert "contradicts Theorem 5.1: its printed conditions hold" in answer(c)
    within = c._replace(b_r_printed=float(c.r.max()))
    assert standing(within) == "conditions broken"  # as printed, nothing is promised there
    unmet = c._replace(conditions=c.conditions._replace(printed_anywhere=(-1.0, 1.0, 1.0)))
    assert standing(unmet) == "conditions broken"
    assert "although" not in answer(unmet)


def test_without_nets_the_weights_are_zero_and_eps_is_the_target():
    c = certify_plan(plan(controller={"nets": {"enabled": False}}, simulation={"duration": 1.0}))
    assert c.weight_bound == 0.0
    assert c.missing.max() == 0.0
    assert c.b_w is None
    assert c.b_r == pytest.approx(c.residual_bound / 2.0)


# the mission for which the printed theorem fails


@dataclass(frozen=True)
class ForceAsWanted(Loop):
    """A plant without the coupling: the force made is the wanted one, whatever the attitude."""

    def advance(self, cycle, parameters, clock):
        step = clock.period
        vehicle, command = parameters.vehicle, cycle.command

        def rate(state):
            force, _ = disturb(parameters.disturbance, state)
            moved = derivative(vehicle, parameters.disturbance, self.plant.kinematics, state, command.thrust, command.torque)
            return moved._replace(velocity=acceleration(vehicle, command.desired_attitude, command.thrust, force))

        state = cycle.state
        half = type(state)(*(part + 0.5 * step * slope for part, slope in zip(state, rate(state), strict=True)))
        moved = type(state)(*(part + step * slope for part, slope in zip(state, rate(half), strict=True)))
        return cycle._replace(state=moved)


def slow():
    path = {"type": "minimum-jerk", "end": [20.0, 5.0, 10.0], "duration": 40.0}
    return plan(path=path, controller={"Lambda2": 0.5, "K_r2": 6.0}, disturbance={"scale": 0.0})


def test_the_printed_conditions_hold_and_the_flight_diverges():
    c = certify_plan(slow())
    assert c.outcome is not Outcome.COMPLETED
    assert c.conditions.printed_hold
    assert c.conditions.hold
    assert not c.conditions.coupling_holds
    assert c.until <= c.ended
    assert kind(c) == "lost"


def test_and_what_makes_it_diverge_is_the_coupling():
    diverging = slow()
    loop = ForceAsWanted(diverging.loop.plant, diverging.loop.path, diverging.loop.controller)
    log = fly(diverging._replace(loop=loop))
    assert log.outcome is Outcome.COMPLETED
    assert rmse(lengths(position_errors(log))) < 1e-6


# refusals


@dataclass(frozen=True)
class Broken(MinimumJerk):
    """Minimum jerk with a jump of one of its parts at a time, or with a velocity of the wrong size."""

    part: str
    at: float = 2.0005
    size: float = 0.01
    factor: float = 1.0

    def reference(self, t, parameters) -> Reference:
        good = MinimumJerk().reference(t, parameters)
        jump = where(t > self.at, self.size, 0.0)
        value = getattr(good, self.part)
        value = value + vector(jump, 0.0, 0.0) if isinstance(value, Vector) else value + jump
        return good._replace(**{self.part: self.factor * value})


@pytest.mark.parametrize("part", ["position", "velocity", "acceleration", "yaw", "yaw_rate"])
def test_a_path_that_jumps_is_refused(part):
    smooth = plan()
    with pytest.raises(UserError, match=rf"path: its {part.replace('_', ' ')} jumps by 0\.01 .* at t = 2\.0005 s"):
        certify_plan(smooth._replace(loop=replace(smooth.loop, path=Broken(part))))


def test_a_velocity_that_is_not_the_rate_of_the_position_is_refused():
    smooth = plan()
    with pytest.raises(UserError, match="velocity is not the rate of its position"):
        certify_plan(smooth._replace(loop=replace(smooth.loop, path=Broken("velocity", size=0.0, factor=1.01))))


PATHS = {
    "circle": {"type": "circle", "radius": 2.0, "period": 9.0},
    "eight": {"type": "figure-eight", "length": 4.0, "width": 2.0, "period": 12.0, "yaw_rate": 0.5},
    "circle at once": {"type": "circle", "radius": 2.0, "period": 9.0, "ramp": 0.0},
    "waypoints": {"type": "waypoints", "waypoints": [{"t": float(t), "position": [t, -t, t * t / 4]} for t in (0, 2, 5, 6)]},
    "line": LINE,
}


@pytest.mark.parametrize("name", PATHS)
def test_the_shipped_paths_are_smooth_enough(name):
    smooth = plan(path=PATHS[name])
    check_path(smooth, 0.002 * np.arange(2000))


def test_a_circle_at_full_speed_started_at_rest_is_a_jump_of_velocity():
    path = PATHS["circle at once"]
    with pytest.raises(UserError, match=r"at t = 0 it moves at 1\.396 m/s but the vehicle starts at rest"):
        certify_plan(plan(path=path, start={"velocity": [0.0, 0.0, 0.0]}))


def test_a_ramp_too_short_to_be_one_is_a_jump():
    with pytest.raises(UserError, match="path: "):
        certify_plan(plan(path={**PATHS["circle"], "ramp": 1e-8}))


REFUSED = {
    "nested saturations": ({"controller": {"type": "nested-saturation"}}, "NestedSaturation", "missing"),
    "free fall": ({"path": {"type": "minimum-jerk", "end": [0.0, 0.0, -49.05], "duration": 5.37}}, "thrust", "differentiable"),
    "rotor limits": ({"vehicle": {"rotors": {"limits": [0.0, 5.0]}}}, "limits", "active in", "saturation"),
    "no learning rate": ({"controller": {"nets": {"F1": 0.0}}}, "F1 = 0", "inverse"),
    "too short": ({"simulation": {"duration": 0.01}}, "control samples", "10"),
    "too long": ({"simulation": {"duration": 1200.0}}, "control samples", "500000"),
    "far above the path": ({"start": {"position": [0.0, 0.0, 8.0]}, "path": {**LINE, "end": [0.0, 0.0, 0.0]},
                            "controller": {"nets": {"enabled": False}},
                            "simulation": {"duration": 4.0}}, "differentiable", "the controller commands"),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_what_the_theorem_says_nothing_of_is_refused_in_one_line(case):
    sections, *needed = REFUSED[case]
    with pytest.raises(UserError) as caught:
        certify_plan(plan(**sections))
    assert "\n" not in str(caught.value)
    for part in needed:
        assert part in str(caught.value)


def test_wide_rotor_limits_are_no_obstacle():
    c = certify_plan(plan(vehicle={"rotors": {"limits": [0.0, 500.0]}}, path={**LINE, "end": [0.0, 0.0, 1.0], "yaw_end": 0.0},
                          simulation={"duration": 1.0}))  # fmt: skip
    assert c.outcome is Outcome.COMPLETED
