"""Predictive control against other solvers (Riccati equations, the method of multipliers, TinyMPC); the law, term by term."""

import math

import numpy as np
import pytest
from scipy.linalg import block_diag, expm, solve_discrete_are

from quadstep import fly
from quadstep.control.admm import StageBounds, discretised, idle, iterate, regulator
from quadstep.control.filters import observed
from quadstep.control.mpc import FREE, STAGE, STAGES, chain
from quadstep.interfaces.controller import Measured
from quadstep.interfaces.plant import Reference
from quadstep.mission.multirotor import MultirotorMission
from quadstep.numbers import Matrix, Vector, vector
from quadstep.numbers.rotations import IDENTITY, from_rotation_vector, from_yaw_pitch_roll
from tests.flights import array
from tests.needs import TINYMPC, needs

G, LAG = 9.81, 0.04
LEVEL = np.array(
    [[0, 1, 0, 0, 0, 0], [0, 0, G, 0, 0, 0], [0, 0, 0, 1, 0, 0], [0, 0, 0, 0, 1, 0], [0, 0, 0, 0, -1 / LAG, 1 / LAG]]
)
TWICE = np.array([[0, 1, 0, 0], [0, 0, 1, 0], [0, 0, -1 / LAG, 1 / LAG]])


def rows(values):
    return Matrix(Vector(map(float, row)) for row in values)


def generator(rate):
    return np.vstack([rate, np.zeros(len(rate) + 1)])


@pytest.mark.parametrize("rate", [LEVEL, TWICE])
def test_a_chain_is_sampled_as_the_exponential_says(rate):
    a, b = discretised(rows(rate), 0.03)
    exact = expm(0.03 * generator(rate))[:-1]
    np.testing.assert_allclose(np.column_stack([array(a), array(b)]), exact, atol=1e-14)


@pytest.mark.parametrize("price", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize("rate", [LEVEL, TWICE])
def test_the_regulator_solves_the_discrete_riccati_equation(rate, price):
    weights = [60.0, 6.0, 4.0, 0.2, 0.0][: len(rate)]
    a, b = discretised(rows(rate), 0.03)
    found = regulator(a, b, weights, price)
    a, b = array(a), array(b)[:, None]
    p = solve_discrete_are(a, b, np.diag(weights), [[price]])
    gain = np.linalg.solve(price + b.T @ p @ b, b.T @ p @ a)
    np.testing.assert_allclose([list(found.gain)], gain, rtol=1e-7)
    assert found.inverse == pytest.approx(1.0 / (price + b.T @ p @ b).item(), rel=1e-7)
    np.testing.assert_allclose(array(found.closed), (a - b @ gain).T, atol=1e-9)


LEVEL_WEIGHTS, TWICE_WEIGHTS = (60.0, 6.0, 4.0, 0.2, 0.1, 0.02), (40.0, 4.0, 0.1, 0.3)


def chains(penalty=0.1):
    level = chain(rows(LEVEL), LEVEL_WEIGHTS, [2], penalty)
    twice = chain(rows(TWICE), TWICE_WEIGHTS, [], penalty)
    return level, level, twice, twice


def system(laws):
    """All chains as one system: A, B."""
    return (
        block_diag(*(array(one.regulator.a) for one in laws)),
        block_diag(*(array(one.regulator.b)[:, None] for one in laws)),
    )


def bounded(low, high, low_state, high_state):
    """Bounds from arrays of a row a stage, the states' with the last."""
    return StageBounds(
        rows(low), rows(high), rows(low_state[:-1]), rows(high_state[:-1]), Vector(low_state[-1]), Vector(high_state[-1])
    )


BEGIN = Vector((0.4, 0.5, 0.05, -0.2, 3.0, -0.3, 0.0, 0.0, 0.3, 0.0, -0.4, 0.2, 0.0, 0.5, 0.3, 1.0))


def limits(stages):
    """Low and high bounds that bind, different at every stage."""
    shift = np.linspace(0.0, 0.4, stages)[:, None]
    inputs = np.array([[15.0, 15.0, 2.0, 3.0]]) * (1.0 - 0.5 * shift[:-1])
    states = np.full((stages, 16), FREE)
    states[:, [2, 7]] = 0.04 - 0.05 * shift
    return -0.8 * inputs, inputs, -states, 1.1 * states


@pytest.mark.parametrize("iterations", [1, 2, 6])
def test_an_iteration_is_the_least_of_the_augmented_lagrangian(iterations):
    """Against the method of multipliers on the inputs of all stages at once, with the regulator's cost after the last."""
    laws, stages = chains(), 8
    low, high, low_state, high_state = limits(stages)
    duals, found = iterate(laws, BEGIN, idle(laws, stages), bounded(low, high, low_state, high_state), iterations)
    a, b = system(laws)
    weights = np.diag([*LEVEL_WEIGHTS[:5]] * 2 + [*TWICE_WEIGHTS[:3]] * 2)
    prices = np.diag([LEVEL_WEIGHTS[5]] * 2 + [TWICE_WEIGHTS[3]] * 2)
    rho, rho_u = 0.1 * weights * np.diag([0, 0, 1, 0, 0] * 2 + [0] * 6), 0.1 * prices
    last = solve_discrete_are(a, b, weights + rho, prices + rho_u)
    # x = free + push u, all stages stacked
    free = np.concatenate([np.linalg.matrix_power(a, k) @ list(BEGIN) for k in range(stages)])
    push = np.zeros((16 * stages, 4 * (stages - 1)))
    for k in range(stages):
        for j in range(k):
            push[16 * k : 16 * k + 16, 4 * j : 4 * j + 4] = np.linalg.matrix_power(a, k - 1 - j) @ b
    q = block_diag(*[weights + rho] * (stages - 1), last)
    hessian = push.T @ q @ push + block_diag(*[prices + rho_u] * (stages - 1))
    rho, rho_u = np.kron(np.eye(stages), rho), np.kron(np.eye(stages - 1), rho_u)
    y = z = np.zeros(4 * (stages - 1))
    g = v = np.zeros(16 * stages)
    for _ in range(iterations):
        u = np.linalg.solve(hessian, rho_u @ (z - y) + push.T @ (rho @ (v - g) - q @ free))
        x = free + push @ u
        z, v = np.clip(u + y, low.ravel(), high.ravel()), np.clip(x + g, low_state.ravel(), high_state.ravel())
        y, g = y + u - z, g + x - v
    assert (np.abs(y) > 1e-3).any()  # a bound of an input binds
    assert (np.abs(g[16:]) > 1e-3).any()  # and one of a lean
    np.testing.assert_allclose(array(found).ravel(), z, atol=1e-8)
    np.testing.assert_allclose(array(duals.inputs).ravel(), y, atol=1e-8)
    np.testing.assert_allclose([*array(duals.states).ravel(), *duals.last], g, atol=1e-8)


@needs(TINYMPC)
@pytest.mark.parametrize("iterations", [1, 2, 5, 40])
def test_every_iteration_is_that_of_tinympc(iterations):
    """TinyMPC 0.0.8 penalises all states alike, adds rho to the weights twice, and stops its Riccati recursion at 1e-5."""
    import tinympc

    rho, stages = 0.02, 10
    weights = np.array([*LEVEL_WEIGHTS[:5]] * 2 + [*TWICE_WEIGHTS[:3]] * 2)
    prices = np.array([LEVEL_WEIGHTS[5]] * 2 + [TWICE_WEIGHTS[3]] * 2)
    a, b = system(chains())
    p, gain, change = np.eye(16) * rho, np.zeros((4, 16)), 1.0
    while change >= 1e-5:
        inverse = np.linalg.inv(np.diag(prices + rho) + b.T @ p @ b)
        before, gain = gain, inverse @ b.T @ p @ a
        p, change = np.diag(weights + rho) + a.T @ p @ (a - b @ gain), np.abs(gain - before).max()
    laws, place = [], 0
    for i, one in enumerate(chains()):
        own = slice(place, place := place + len(one.penalty))
        cached = one.regulator._replace(
            gain=Vector(gain[i, own]), inverse=inverse[i, i], closed=rows((a - b @ gain)[own, own].T)
        )
        laws.append(one._replace(regulator=cached, penalty=Vector([rho] * len(one.penalty)), input_penalty=rho))
    low, high, low_state, high_state = limits(stages)
    _, found = iterate(tuple(laws), BEGIN, idle(laws, stages), bounded(low, high, low_state, high_state), iterations)
    theirs = tinympc.TinyMPC()
    never = {"abs_pri_tol": 1e-30, "abs_dua_tol": 1e-30}
    theirs.setup(a, b, np.diag(weights - rho), np.diag(prices - rho), stages, rho=rho, max_iter=iterations, **never)
    theirs.set_bound_constraints(low_state.T, high_state.T, low.T, high.T)
    theirs.set_x0(np.array(list(BEGIN)))
    np.testing.assert_allclose(array(found), theirs.solve()["controls_all"], atol=1e-6)


def test_the_observer_finds_what_is_not_explained():
    """Both of its poles at -bandwidth: the estimate of a constant rises as 1 - (1 + w t) exp(-w t)."""
    value, unexplained, truth, step = vector(0.0), vector(0.0), 0.0, 1e-4
    for _ in range(5000):
        truth += step * 3.0
        value, unexplained = observed(value, unexplained, vector(truth), vector(1.0), 8.0, step)
    assert unexplained[0] == pytest.approx(2.0 * (1.0 - (1.0 + 8.0 * 0.5) * math.exp(-8.0 * 0.5)), rel=1e-3)


# The law

ZERO = vector(0.0, 0.0, 0.0)
HERE = Reference(ZERO, ZERO, ZERO, 0.0, 0.0)
MASS = 2.644
INERTIA = np.array([0.03, 0.03, 0.05])


def hovering(**path):
    step = {"type": "step", "start": [0.0, 0.0, 5.0], "end": [0.0, 0.0, 5.0], "duration": 4.0}
    return MultirotorMission.model_validate(
        {"vehicle": {"preset": "research-2.6kg"}, "path": path or step, "controller": {"type": "mpc"}}
    )


@pytest.fixture(scope="module")
def flown():
    return hovering().plan()


def known(**changes):
    return Measured(ZERO, ZERO, IDENTITY, ZERO, MASS * G, ZERO)._replace(**changes)


def asked(plan, reference=HERE, samples=1, ahead=None, memory=None, solve=False, **changes):
    """The command of the last of some samples, what was measured held, and the memory after it; solved as well, or not."""
    law, gains = plan.loop.controller, plan.parameters.gains
    measured = known(**changes)
    memory = memory or law.start(measured, gains)
    reference = reference._replace(ahead=ahead or (reference,) * (STAGES - 1))
    for k in range(samples):
        if solve and k % 10 == 0:
            memory = law.guide(memory, measured, reference, gains, 0.0, 0.02)
        command, memory = law.law(memory, measured, reference, gains, 0.0, 0.002)
    return command, memory


def rebuilt(plan, measured, reference):
    """Thrust and torque of a fresh vehicle where no bound binds, from formulas: K of the regulators on the deviations."""
    gains = plan.parameters.gains
    w = gains.weights
    lateral, climb, turn = (np.array(list(gains.chains[i].regulator.gain)) for i in (0, 2, 3))
    e_p, e_v = (
        np.array(list(a - b)) for a, b in ((measured.position, reference.position), (measured.velocity, reference.velocity))
    )
    c, s = math.cos(reference.yaw), math.sin(reference.yaw)
    e_p, e_v = (np.array([c * v[0] + s * v[1], c * v[1] - s * v[0], v[2]]) for v in (e_p, e_v))
    from scipy.spatial.transform import Rotation

    attitude = Rotation.from_quat([*list(measured.attitude)[1:], measured.attitude[0]])
    turned = (Rotation.from_euler("z", reference.yaw).inv() * attitude).as_rotvec()
    rates = np.array(list(measured.rates))
    u_x = -lateral @ [e_p[0], e_v[0], turned[1], rates[1], 0.0]
    u_y = -lateral @ [e_p[1], e_v[1], -turned[0], -rates[0], 0.0]
    lift = attitude.as_matrix()[2, 2] * G - G
    u_z = -climb @ [e_p[2], e_v[2], lift]
    u_t = -turn @ [turned[2], rates[2], 0.0]
    j = np.array(list(w.inertia))
    torque = j * [-u_y, u_x, u_t] + np.cross(rates, j * rates)
    return MASS * (G + u_z) * attitude.as_matrix()[2, 2], torque


SMALL = [
    {"position": vector(0.01, 0.0, 0.0)},
    {"position": vector(0.0, 0.02, -0.03)},
    {"velocity": vector(0.02, -0.03, 0.04)},
    {"attitude": from_rotation_vector(vector(0.01, -0.02, 0.03))},
    {"rates": vector(0.05, -0.04, 0.03)},
    {"position": vector(0.01, -0.02, 0.0), "attitude": from_yaw_pitch_roll(vector(0.9, 0.01, 0.02))},
]


@pytest.mark.parametrize("change", SMALL)
def test_before_the_first_solution_it_is_the_regulator(flown, change):
    yaw = 0.9 if len(change) > 1 else 0.0
    measured, reference = known(**change), HERE._replace(yaw=yaw)
    command, _ = asked(flown, reference, **change)
    thrust, torque = rebuilt(flown, measured, reference)
    assert command.thrust == pytest.approx(thrust, rel=1e-9)
    np.testing.assert_allclose(list(command.torque), torque, rtol=1e-6, atol=1e-9)


def test_what_the_path_wants_is_fed_forward(flown):
    """Of a vehicle just as the path wants it: lift and torque of flat motion, and rotors that lag are asked earlier."""
    lag = flown.parameters.gains.weights.lag
    snap, jerk = vector(3.0, -2.0, 0.0), vector(0.0, 0.0, 1.5)
    command, _ = asked(flown, HERE._replace(acceleration=vector(0.0, 0.0, 1.0), jerk=jerk), thrust=MASS * (G + 1.0))
    memory_lift = -(np.array(list(flown.parameters.gains.chains[2].regulator.gain)) @ [0.0, 0.0, -1.0])  # it made hover's
    assert command.thrust == pytest.approx(MASS * (G + 1.0 + 1.5 * lag + memory_lift), rel=1e-9)
    steady, _ = asked(flown, HERE._replace(snap=snap))
    lateral = np.array(list(flown.parameters.gains.chains[0].regulator.gain))
    u = (1.0 + lateral[4]) * np.array([3.0, -2.0]) / G  # the angular acceleration wanted, and that none is made yet
    np.testing.assert_allclose(list(steady.torque)[:2], INERTIA[:2] * [-u[1], u[0]], rtol=1e-6)
    growing, _ = asked(flown, HERE._replace(snap=snap), ahead=(HERE._replace(snap=2.0 * snap),) * (STAGES - 1))
    lead = lag / STAGE * np.array([3.0, -2.0]) / G
    np.testing.assert_allclose(
        np.array(list(growing.torque))[:2] - list(steady.torque)[:2], INERTIA[:2] * [-lead[1], lead[0]], rtol=1e-6
    )


def test_only_the_way_from_the_path_counts(flown):
    """Place and speed of the path; the body rates that a path's jerk and a turning heading want."""
    place, speed = vector(3.0, -2.0, 7.0), vector(0.5, 0.4, -0.3)
    reference = HERE._replace(position=place, velocity=speed)
    away = {"position": place + SMALL[1]["position"], "velocity": speed + SMALL[2]["velocity"]}
    there, _ = asked(flown, reference, **away)
    here, _ = asked(flown, **{name: one - getattr(reference, name) for name, one in away.items()})
    np.testing.assert_allclose([there.thrust, *there.torque], [here.thrust, *here.torque], rtol=1e-9, atol=1e-12)
    lateral, turn = (np.array(list(flown.parameters.gains.chains[i].regulator.gain)) for i in (0, 3))
    jerked, _ = asked(flown, HERE._replace(jerk=vector(2.0, 1.0, 0.0)))
    np.testing.assert_allclose(list(jerked.torque)[:2], INERTIA[:2] * lateral[3] * [-1.0 / G, 2.0 / G], rtol=1e-6)
    turning, _ = asked(flown, HERE._replace(yaw_rate=0.5), rates=vector(0.2, 0.0, 0.0))
    forward = 0.2 * 0.5  # -w x w_d about y, that it is not made yet, and no lean rate of its own
    assert turning.torque[1] == pytest.approx(0.03 * (1.0 + lateral[4]) * forward, rel=1e-6)
    assert turning.torque[2] == pytest.approx(0.05 * turn[1] * 0.5, rel=1e-6)

    made, _ = asked(
        flown, memory=flown.loop.controller.start(known(), flown.parameters.gains)._replace(torque=vector(0.0, 0.0, 0.1))
    )
    assert made.torque[2] == pytest.approx(-turn[2] * 0.1, rel=1e-6)


def test_a_push_is_met_with_lean_and_lift_and_a_twist_with_torque(flown):
    law, gains = flown.loop.controller, flown.parameters.gains
    fresh = law.start(known(), gains)
    command, _ = asked(flown, memory=fresh._replace(push=vector(0.0, 0.0, -0.7)))
    lifting = -(np.array(list(gains.chains[2].regulator.gain)) @ [0.0, 0.0, -0.7])
    assert command.thrust == pytest.approx(MASS * (G + 0.7 + lifting), rel=1e-9)
    command, _ = asked(flown, memory=fresh._replace(twist=vector(0.3, -0.2, 0.1)))
    np.testing.assert_allclose(list(command.torque), INERTIA * [-0.3, 0.2, -0.1], atol=1e-9)
    blown = fresh._replace(push=vector(1.0, 0.0, 0.0))
    into_wind = law.target(blown, known(), HERE, gains.weights)
    assert into_wind.force[0] == pytest.approx(-MASS)
    assert into_wind.deviation[2] == pytest.approx(math.atan(1.0 / G))  # it leans too far forward, by so much


def test_observers_know_gravity_lift_and_the_gyroscopic_torque(flown):
    law, gains = flown.loop.controller, flown.parameters.gains.weights
    rates, lean = vector(1.0, -2.0, 3.0), from_rotation_vector(vector(0.3, 0.0, 0.0))
    memory = law.start(known(rates=rates), flown.parameters.gains)._replace(
        torque=vector(0.3, 0.2, 0.1), push=vector(0.1, 0.2, 0.3)
    )
    after = law.observe(memory, known(rates=rates, attitude=lean, torque=vector(0.5, 0.5, 0.5)), gains, 0.002)
    axis = np.array([0.0, -math.sin(0.3), math.cos(0.3)])
    np.testing.assert_allclose(list(after.velocity), 0.002 * (G * axis - [0.0, 0.0, G] + [0.1, 0.2, 0.3]), atol=1e-12)
    np.testing.assert_allclose(list(after.rates - rates), 0.002 * np.array([0.3, 0.2, 0.1]) / INERTIA, atol=1e-12)
    share = 1.0 - math.exp(-0.002 / gains.lag)
    gyroscopic = np.cross(list(rates), INERTIA * list(rates))
    np.testing.assert_allclose(list(after.torque - memory.torque), share * (0.5 - gyroscopic - [0.3, 0.2, 0.1]), atol=1e-12)
    up = law.observe(memory, known(thrust=30.0), gains, 0.002)
    assert up.lift == pytest.approx(MASS * G + share * (30.0 - MASS * G))


def test_bounds_leave_what_the_path_does_not_take(flown):
    law, gains = flown.loop.controller, flown.parameters.gains.weights
    memory = law.start(known(), flown.parameters.gains)._replace(push=vector(0.5, 0.0, -1.0))
    turn = math.pi / 2.0
    stages = tuple(
        HERE._replace(yaw=turn, acceleration=vector(0.1 * k, -0.2 * k, 0.3 * k), snap=vector(k, 2.0 * k, 0.0))
        for k in range(STAGES)
    )
    bounds = law.bounds(memory, stages[0]._replace(ahead=stages[1:]), gains)
    for k in (0, 3, STAGES - 2):
        low, high = list(bounds.low.rows[k]), list(bounds.high.rows[k])
        # facing along y: forward is y, left is -x
        assert high[:2] == pytest.approx([80.0 - 2.0 * k / G, 80.0 + k / G])
        assert low[:2] == pytest.approx([-80.0 - 2.0 * k / G, -80.0 + k / G])
        most = gains.most_thrust / MASS - G
        assert (low[2], high[2]) == pytest.approx((-0.9 * G - 0.3 * k - 1.0, most - 0.3 * k - 1.0))
        assert (low[3], high[3]) == pytest.approx((-12.0, 12.0))
        low, high = list(bounds.low_state.rows[k]), list(bounds.high_state.rows[k])
        assert (low[2], high[2]) == pytest.approx((-1.0 + 0.2 * k / G, 1.0 + 0.2 * k / G))
        assert (low[7], high[7]) == pytest.approx((-1.0 + (0.1 * k - 0.5) / G, 1.0 + (0.1 * k - 0.5) / G))
        assert high[0] == -low[0] == FREE
    assert bounds.high_last[2] == pytest.approx(1.0 + 0.2 * (STAGES - 1) / G)


def test_a_lean_that_comes_is_seen_before_it_is_there(flown):
    """A path that is about to lean to its bound: the law holds back in advance, as without preview it would not."""
    hard = tuple(HERE._replace(acceleration=vector(9.5 if k > 3 else 0.0, 0.0, 0.0)) for k in range(STAGES - 1))
    behind = {"position": vector(-0.1, 0.0, 0.0)}
    seen, _ = asked(flown, samples=41, solve=True, ahead=hard, **behind)
    blind, _ = asked(flown, samples=41, solve=True, **behind)
    assert seen.torque[1] < blind.torque[1] - 0.002


def test_deviations_beyond_reach_count_as_its_end(flown):
    near, far = (asked(flown, position=vector(x, 0.0, 0.0))[0] for x in (0.5, 50.0))
    assert list(near.torque) == list(far.torque)


@pytest.mark.parametrize("vehicle", ["research-2.6kg", "crazyflie", "x500"])
def test_it_flies_a_vertical_figure_eight_the_same_on_floats_and_lanes(vehicle):
    path = {"type": "figure-eight", "plane": "vertical", "centre": [0, 0, 5], "length": 2.0, "width": 1.0, "period": 5.0}
    mission = {"vehicle": {"preset": vehicle}, "path": path, "controller": {"type": "mpc"}, "simulation": {"duration": 2.0}}
    plan = MultirotorMission.model_validate(mission).plan()
    lanes = fly(plan)
    assert lanes.metrics()["position_rmse[m]"] < 0.02
    if vehicle == "research-2.6kg":
        short = MultirotorMission.model_validate({**mission, "simulation": {"duration": 0.1}}).plan()
        np.testing.assert_array_equal(fly(short).rows, fly(short, engine="python").rows)
