"""Theorem B in numbers: exact rationals, the region of the defaults, flights from its edge, the figures of docs/theory.md."""

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from quadstep.control.completed_backstepping import coupling_columns
from quadstep.control.filters import Filtered, command_filter
from quadstep.control.vectoring import invert_force
from quadstep.engines.fly import fly
from quadstep.io.errors import UserError
from quadstep.numbers import vector
from quadstep.proofs.theory import edge
from quadstep.proofs.theory.edge import (
    Pushes,
    default_region,
    fly_edge,
    least_frequency,
    level_at_start,
    mission,
    region_rows,
    setting_of,
    stretched,
)
from quadstep.proofs.theory.flow import Flow, draw, shares_of_lines
from quadstep.proofs.theory.region import (
    BENDING,
    RATE,
    SHAPE,
    SIZE,
    Region,
    bounds_of,
    certify_region,
    decay,
    positive_definite,
    root_above,
    support,
    upper_form,
)
from quadstep.studies.paper.cases import line
from tests.commands import quadstep
from tests.theorem_again import LEVEL, OTHER, differing

PAGE = (Path(__file__).parents[1] / "docs" / "theory.md").read_text(encoding="utf-8")


def rationals(matrix):
    return [[Fraction(x) for x in row] for row in matrix]


def test_elimination_tells_a_definite_form_from_others():
    draw = np.random.default_rng(1)
    for _ in range(30):
        half = draw.normal(size=(4, 4)).round(3)
        form = half @ half.T + draw.uniform(-1.0, 1.0) * np.eye(4)
        least = np.linalg.eigvalsh(form)[0]
        if abs(least) > 1e-9:
            assert positive_definite(rationals(form)) == (least > 0.0)
            if least > 0.0:
                direction = draw.normal(size=4).round(3)
                found = support(rationals(form), [Fraction(x) for x in direction])
                assert float(found) == pytest.approx(direction @ np.linalg.solve(form, direction))
    for x in (Fraction(0), Fraction(2), Fraction(1, 10**9)):
        assert root_above(x) ** 2 >= x


def test_the_defaults_have_a_region_and_its_figures_stand_in_the_docs():
    region = default_region()
    rows = dict(region_rows(region, least_frequency(region)))
    said = {"|r1|": "0.32 m/s, in the end 0.034", "|r2|": "0.166 rad/s, in the end 0.018",
            "|e1|: position": "0.439 m, in the end 0.046", "|e2|: attitude": "0.0707 rad, in the end 0.0075",
            "least thrust upwards": "8.64 N (at least)", "filter frequency": "83 rad/s (at least)"}  # fmt: skip
    assert {key: rows[key] for key in said} == said
    for figure in ("0.32 m/s | 0.178 m/s | 0.034 m/s", "0.439 m | 0.244 m | 0.046 m", "0.0707 rad | 0.0393 rad | 0.0075 rad",
                   "0.166 rad/s | 0.093 rad/s | 0.018 rad/s", "after 202 s", "at 40 s is 0.039 m",
                   "above 8.64 N", "is 83 rad/s"):  # fmt: skip
        assert figure in PAGE
    end = (0.046 / 0.439) ** 2  # L_end / l
    for seconds, begun, share in ((40.0, 1.0, 0.244 / 0.439), (202.0, 1.0, 1.1 * 0.046 / 0.439), (40.0, 0.0, 0.039 / 0.439)):
        assert np.sqrt(end + (begun - end) * np.exp(-0.03 * seconds)) == pytest.approx(share, rel=0.02)
    pushed = default_region(force=0.005, torque=0.005)
    assert dict(region_rows(pushed, Fraction(83)))["|e1|: position"].endswith("in the end 0.14")
    assert default_region(force=0.0053, bias=0.0982)
    assert pytest.approx(0.0241, abs=5e-5) == 0.5 * 0.0982**2 / 0.2
    assert default_region(force=0.05) is None


def test_flights_from_the_edge_are_pushed_by_what_is_unknown_and_the_filter_is_that_which_it_needs():
    unknown = Pushes(force=0.0053, bias=0.0982)
    region = default_region(*unknown)
    assert float(least_frequency(region, unknown)) > float(least_frequency(region))
    (pushed,) = fly_edge(region, ("position, x",), unknown)
    (alone,) = fly_edge(region, ("position, x",))
    assert pushed.returned != alone.returned
    assert max(pushed.returned) < 1.0
    plan = mission({}, nets=False).plan()
    assert level_at_start(plan, region, 0.0982) == pytest.approx(0.0241, abs=5e-5)


def test_the_region_of_a_force_that_no_start_lies_in_is_said_to_be_that():
    """Its integral's rest point alone is beyond the level."""
    run = quadstep("study", "region", "--bias", "0.3")
    assert run.code == 1
    assert "with its integrals at zero is outside: there L is 0.225 J, and the region ends at 0.05 J." in " ".join(
        run.out.split()
    )
    assert "Flights from the edge" not in run.out


def test_what_the_theorem_needs_it_needs():
    setting = setting_of(mission({}, nets=False).plan())
    assert certify_region(setting)
    for broken in (
        setting._replace(filter_frequency=Fraction(40)),
        setting._replace(gain_1=Fraction(1)),
        setting._replace(gain_2=Fraction(60)),
        setting._replace(integral_1=Fraction(0)),
        setting._replace(yaw_rate=Fraction(1000)),
        setting._replace(jerk=Fraction(2)),
        setting._replace(bias=Fraction(9)),
    ):
        assert certify_region(broken) is None
    assert certify_region(setting, level=Fraction(1)) is None
    assert certify_region(setting, rate=Fraction(1, 10)) is None


def test_every_norm_matters_to_the_certificate():
    """Without the damping of any one norm the form is not definite."""
    setting = setting_of(mission({}, nets=False).plan())
    region = certify_region(setting)
    q, _ = decay(setting, SHAPE, region.bounds)
    form = upper_form(setting, SHAPE, region.bounds)
    left = [[q[i][k] - RATE * form[i][k] for k in range(SIZE)] for i in range(SIZE)]
    assert positive_definite(left)
    for i in range(SIZE):
        without = [list(row) for row in left]
        without[i][i] -= q[i][i]
        assert not positive_definite(without)


def other_plan():
    """Gains and vehicle of `OTHER`."""
    plan, s = mission({}, nets=False).plan(), OTHER
    mass, inertia = float(s.mass), vector(*[float(s.inertia)] * 3)

    def same(name: str):
        return vector(*[float(getattr(s, name))] * 3)

    gains, kept = plan.parameters.gains, ("slope_1", "gain_1", "integral_1", "slope_2", "gain_2", "integral_2")
    paper = gains.paper._replace(
        mass=mass, gravity=float(s.gravity), filter_frequency=float(s.filter_frequency), **{name: same(name) for name in kept}
    )
    gains = gains._replace(paper=paper, coupling=same("coupling"), inertia=inertia)
    vehicle = plan.parameters.vehicle._replace(mass=mass, gravity=float(s.gravity), inertia=inertia)
    return plan._replace(parameters=plan.parameters._replace(gains=gains, vehicle=vehicle))


def test_bounds_lines_and_forms_are_those_of_the_matrices_of_the_loop():
    assert differing() == []
    defaults = setting_of(mission({}, nets=False).plan(), Pushes(0.001, 0.001))
    assert differing(defaults, Fraction("0.05")) == []
    assert differing(OTHER._replace(bias=Fraction(1)), Fraction("0.01")) == []


def test_l_dot_keeps_to_the_lines_with_other_gains_on_another_vehicle():
    """Whether or not a region is certified there: the lines hold wherever L <= level."""
    force, torque = float(OTHER.force), float(OTHER.torque)
    region = Region(LEVEL, RATE, Fraction(0), bounds_of(OTHER, SHAPE, LEVEL), SHAPE)
    flow = Flow(region, force, torque, other_plan())
    path = flow.setting._replace(acceleration=OTHER.acceleration, jerk=OTHER.jerk, yaw_rate=OTHER.yaw_rate, bias=OTHER.bias)
    assert [float(x) for x in path] == [float(x) for x in OTHER]
    flow.setting, flow.forms = OTHER, decay(OTHER, SHAPE, region.bounds)
    slope = draw(flow, 1, 4000)
    assert 0.0 < slope.level.max() < LEVEL
    assert slope.worst < 0.0
    assert 0.3 < slope.used < 1.0
    shares = shares_of_lines(flow, 1, 4000)
    assert max(shares.values()) < 1.0 + 1e-6
    assert len(shares) == 21
    assert sum(share > 0.9 for share in shares.values()) >= 6


def test_flights_from_the_edge_stay_inside_nets_off_and_on():
    region = default_region()
    flights = {flight.name: flight for flight in fly_edge(region, ("position, x", "velocity, z", "yaw", "everything"))}
    for flight in flights.values():
        assert level_at_start(mission(flight.off, nets=False).plan(), region) == pytest.approx(0.05, rel=1e-6)
        assert max(flight.returned) <= 1.0
        assert max(flight.learning) <= 1.0
    assert f"{flights['position, x'].off['position'][0]:.3g} m off in x" in PAGE
    assert f"reaches at most {flights['velocity, z'].returned[0]:.2f} of its bound" in PAGE
    assert f"{flights['yaw'].off['attitude'][0]:.3g} rad of yaw" in PAGE


def test_a_region_needs_equal_axes():
    from quadstep.studies.paper.cases import case_1

    plan = case_1(controller={"type": "completed-backstepping", "K_r1": [3.0, 3.0, 4.0]}).plan()
    with pytest.raises(UserError, match="K_r1: differs between axes"):
        setting_of(plan)
    assert stretched(edge.DIRECTIONS["yaw"], default_region())["attitude"][1] == 0.0


@pytest.mark.parametrize(("frequency", "period"), [(100.0, 0.002), (200.0, 0.002), (100.0, 0.01)])
def test_the_mean_lag_behind_a_ramp_is_two_over_w_and_half_a_sample(frequency, period):
    filtered, parts = Filtered(vector(0.0), vector(1.0)), 50
    for k in range(int(40.0 / (frequency * period))):
        filtered = command_filter(filtered, vector(k * period), frequency, period)
    start = (k + 1) * period
    lags = []
    for i in range(parts):
        moved = (i + 0.5) * period / parts
        inside = command_filter(filtered, vector(start), frequency, moved)
        lags.append(start + moved - inside.value[0])
    assert np.mean(lags) == pytest.approx(2.0 / frequency + period / 2.0, rel=1e-4)


def test_the_wanted_tilt_turns_at_most_as_fast_as_the_force_over_its_part_across_x():
    draw, step = np.random.default_rng(2), 1e-6
    worst = 0.0
    for _ in range(300):
        force, rate = draw.normal(size=3) + np.array([0.0, 0.0, 3.0]), draw.normal(size=3)
        before, after = (np.array(invert_force(vector(*(force + s * rate)))[1:]) for s in (-step, step))
        turned = np.linalg.norm(after - before) / (2 * step)
        bound = np.linalg.norm(rate) / np.hypot(force[1], force[2])
        worst = max(worst, turned / bound)
    assert 0.9 < worst <= 1.0 + 1e-6


def test_the_coupling_columns_turn_at_most_as_fast_as_the_angles():
    random, most = np.random.default_rng(7), 0.0
    for scale in (1.0, 1e-5):  # e2 far from zero, and where the ratio of sines is a series
        wanted = random.uniform(-1.6, 1.6, (2, 4000))
        tilt = wanted - scale * random.uniform(-1.6, 1.6, (2, 4000))
        rates = random.normal(size=(4, 4000)) * (random.random((4, 4000)) < 0.5) + 1e-9
        ends = []
        for h in (-1e-5, 1e-5):
            angles = vector(*(tilt + h * rates[2:])), vector(*(wanted + h * rates[:2]))
            ends.append(np.array([[entry + np.zeros(4000) for entry in column] for column in coupling_columns(*angles)]))
        turned = np.linalg.norm(((ends[1] - ends[0]) / 2e-5).transpose(2, 0, 1), 2, axis=(1, 2))
        speeds = np.linalg.norm(rates[:2], axis=0) + np.linalg.norm(rates[2:], axis=0)
        most = max(most, (turned / speeds).max())
    assert 0.75 * float(BENDING) < most < float(BENDING)


def test_yaw_turns_as_the_docs_say():
    def largest(law: str, **path: float) -> float:
        flight = line("turn", [0.0, 0.0, 0.0], [1.0, 0.0, 0.0], controller={"type": law}, simulation={"duration": 8.0})
        content = flight.model_dump(exclude_unset=True)
        content["path"] = {"type": "minimum-jerk", "start": [0, 0, 0], "end": [1, 0, 0], "duration": 3.0, "yaw_end": 3.0}
        log = fly(type(flight).model_validate(content).plan())
        return 1e3 * float(np.abs(log.column("psi_d") - log.column("psi")).max())

    assert f"{largest('backstepping'):.3g}" == "2.62"
    assert f"{largest('completed-backstepping'):.3g}" == "0.0104"
    assert "2.62" in PAGE
    assert "is 0.0104 mrad" in PAGE


@pytest.mark.parametrize("unknown", [0.0, 0.005])
def test_l_dot_along_the_flow_of_the_law_keeps_to_the_lines_of_q_and_d(unknown):
    flow = Flow(default_region(force=unknown, torque=unknown), unknown, unknown)
    slope = draw(flow, 1, 4000)
    assert 0.0 < slope.level.max() < 0.05
    assert slope.worst < 0.0
    assert 0.3 < slope.used < 1.0
    half = slope._replace(linear=0.3 * slope.linear)
    assert half.worst > 0.0


def test_most_coefficients_of_q_are_used_up():
    flow = Flow(default_region())
    shares = shares_of_lines(flow, 1, 4000)
    assert len(shares) == 21
    assert max(shares.values()) < 1.0 + 1e-6
    tight = sorted(f"{a}, {b}" for (a, b), share in shares.items() if share > 0.95)
    assert tight == ["a, b", "a_c, b_c", "e2, I2", "e2, b_c", "r1, I1", "r1, e1"]
    loose = {pair for pair, share in shares.items() if share < 0.4}
    assert loose == {("r2", "a_c"), ("a", "a_c"), ("e1", "a_c"), ("b", "a_c")}


@pytest.mark.parametrize("wrong", ["setting", "gains"])
def test_a_wrong_line_or_law_is_seen_along_the_flow(wrong):
    flow = Flow(default_region())
    if wrong == "setting":  # lines that know of no coupling between filter and force
        q, d = flow.forms
        flow.forms = [[entry if i == k else 0.3 * entry for k, entry in enumerate(row)] for i, row in enumerate(q)], d
    else:
        flow.gains = flow.gains._replace(coupling=0.5 * flow.gains.coupling)
    assert max(shares_of_lines(flow, 1, 2000).values()) > 1.05
