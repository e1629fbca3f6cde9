"""Numbers of docs/theory.md worked out a second time, by another way: matrices of the loop and its Lyapunov function.

Where the package adds up a line for each term of the proof in exact rationals, the outer and the inner loop are here linear
systems x_dot = A x + b v with L = 1/2 x^T G x: L_dot is x^T G (A x + b v), and F_dot the gradient of F along the flow.
"""

from fractions import Fraction
from itertools import product

import numpy as np
from numpy.typing import NDArray

from quadstep.control.backstepping import Backstepping
from quadstep.proofs.theory import region
from quadstep.proofs.theory.inequalities import learning_bound
from quadstep.proofs.theory.lyapunov import lyapunov_rate
from quadstep.proofs.theory.region import AC, BC, E1, E2, I1, I2, R1, R2, SHAPE, SIZE, A, B, LevelBounds, Setting, Shape
from quadstep.proofs.theory.trials import NEURONS, PERIOD, draw_sample

Array = NDArray[np.float64]

OTHER = Setting(*map(Fraction, (
    "1.7", "9.7", "0.8", "4.1", "0.23", "3.2", "11", "190", "7", "17", "90", "0.07", "0.03", "0.3", "0.004", "0.006", "0.05",
)))  # fmt: skip
"""No two numbers the same and none of them 1 or 0: each has its place."""

LEVEL = Fraction("0.03")


def outer_loop(s: Setting, shape: Shape) -> tuple[Array, Array, Array]:
    """(G, A, F's gradient) of x = (r1, I1, e1), one axis; v is the force on r1."""
    m, k = float(s.mass), float(s.gain_1 - s.mass * s.slope_1)
    beta, integral, slope = float(shape.cross_1), float(s.integral_1), float(s.slope_1)
    g = np.array([[m, beta * m, 0.0], [beta * m, integral, 0.0], [0.0, 0.0, float(shape.position)]])
    a = np.array([[-k / m, -integral / m, 0.0], [1.0, 0.0, 0.0], [1.0, 0.0, -slope]])
    return g, a, np.array([float(s.gain_1), integral, -m * slope * slope])


def inner_loop(s: Setting, shape: Shape, j: float) -> tuple[Array, Array]:
    """(G, A) of x = (e2, r2, I2) for an inertia j that does not change."""
    beta, p, slope = float(shape.cross_2), float(s.coupling), float(s.slope_2)
    g = np.array([[p, 0.0, 0.0], [0.0, j, beta * j], [0.0, beta * j, float(s.integral_2)]])
    damping = float(s.gain_2) / j - slope
    return g, np.array([[-slope, 1.0, 0.0], [-p / j, -damping, -float(s.integral_2) / j], [0.0, 1.0, 0.0]])


def farthest(g: Array, direction: Array, level: float) -> float:
    """Largest direction . x where 1/2 x^T G x <= level, for any signs of the entries, as vectors may point anywhere."""
    ways = [direction * np.array(signs) for signs in product((1.0, -1.0), repeat=len(direction))]
    return max(float(np.sqrt(2.0 * level * way @ np.linalg.inv(g) @ way)) for way in ways)


def bounds_again(s: Setting, shape: Shape, level: float) -> dict[str, Array]:
    """The numbers of `region.bounds_of`, by their names there."""
    weight, one = float(s.mass * s.gravity), np.eye(3)
    g, _, gradient = outer_loop(s, shape)
    r1, i1, e1 = (farthest(g, axis, level) for axis in one)
    a, b, a_c, b_c = np.sqrt(2.0 * level / np.array(shape[3:], dtype=float))
    force = float(s.bias) + float(s.mass) * float(s.acceleration) + farthest(g, gradient, level)
    e2 = farthest(inner_loop(s, shape, 1.0)[0], one[0], level)
    sine = force / weight + a + b + e2
    low, high = float(s.inertia) * (1.0 - sine), float(s.inertia) * (1.0 + sine)
    inner = inner_loop(s, shape, high)[0]
    inner[1, 1] = low
    r2, i2 = farthest(inner, one[1], level), farthest(inner, one[2], level)
    columns, thrust = np.sqrt(1.0 + sine * e2 / 2.0), weight + force
    counter = columns * thrust * r1 / float(s.coupling) + a_c + b_c
    turning = float(s.yaw_rate) + float(s.filter_frequency) * b + r2 + float(s.slope_2) * e2 + counter  # eta_f_dot - e2_dot
    found = {
        "force": force, "thrust": thrust, "vertical": weight - force, "largest": [r1, i1, e1, e2, r2, i2, a, b, a_c, b_c],
        "inertia": [low, high], "columns": columns, "rates": turning,
    }  # fmt: skip
    return {name: np.array(value, dtype=float) for name, value in found.items()}


def forms_again(s: Setting, shape: Shape, bounds: LevelBounds) -> dict[str, Array]:
    """Q and d of `region.decay` and M of `region.upper_form`."""
    u, column, r1, high = (float(x) for x in (bounds.thrust, bounds.columns, bounds.largest[R1], bounds.inertia[1]))
    w, m, p, slope = float(s.filter_frequency), float(s.mass), float(s.coupling), float(s.slope_2)
    p_a, p_b, p_c, p_d = map(float, shape[3:])
    unit = np.eye(SIZE)
    outer, inner, command, counter = [R1, I1, E1], [E2, R2, I2], [A, B], [AC, BC]
    rate, upper, known = np.zeros((SIZE, SIZE)), np.zeros((SIZE, SIZE)), np.zeros(SIZE)

    g, a, gradient = outer_loop(s, shape)
    rate[np.ix_(outer, outer)], upper[np.ix_(outer, outer)] = g @ a, g
    lag = u * (unit[A] + unit[B])
    pushed = lag + u * unit[E2]
    pulled = g[:, 0] / m  # of the force on r1
    rate[R1] += lag  # u r1 . B e2 cancels
    rate[I1] += pulled[1] * pushed
    known[outer] = pulled * float(s.force)

    g, a = inner_loop(s, shape, high)
    rate[np.ix_(inner, inner)], upper[np.ix_(inner, inner)] = g @ a, g
    turning_up = float(shape.cross_2) * (float(s.gain_2) + float(s.inertia) * 0.7072 * float(bounds.rates))
    rate[R2, I2], rate[I2, R2] = 0.0, -turning_up  # any J in [0, high], and Coriolis'
    rate[E2, AC] = rate[E2, BC] = p  # -e2 . P c, less its counter-term
    known[[R2, I2]] = g[1:, 1] / high * float(s.torque)

    for (first, second), (x, y) in ((command, (p_a, p_b)), (counter, (p_c, p_d))):
        chain = np.diag([x, y]) @ (w * np.array([[-1.0, 0.0], [1.0, -1.0]]))
        rate[np.ix_([first, second], [first, second])], upper[first, first], upper[second, second] = chain, x, y
    flow = np.zeros((3, SIZE))
    flow[:, outer] = outer_loop(s, shape)[1]
    r1_dot = np.abs(flow[0]) + pushed / m
    f_dot = np.abs(gradient @ flow) + gradient[0] / m * pushed
    held = m * float(s.jerk) + gradient[0] / m * float(s.force)
    eta_f_dot = w * unit[B]
    c = column * u * r1 / p  # of which r1 is a state
    eta_dot = eta_f_dot + unit[R2] + slope * unit[E2] + c / r1 * unit[R1] + unit[AC] + unit[BC]
    rate[A] += p_a * f_dot / float(bounds.vertical)
    rate[AC] += p_c * (column * r1 * f_dot + 1.28 * u * r1 * (eta_f_dot + eta_dot) + u * column * r1_dot) / p
    known[A] = p_a * held / float(bounds.vertical)
    known[AC] = p_c * (column * r1 * held + u * column * float(s.force) / m) / p

    q = -(rate + rate.T) / 2.0
    return {"Q": np.where(unit > 0.0, q, -np.abs(q)), "d": known, "M": upper}


def differing(s: Setting = OTHER, level: Fraction = LEVEL, shape: Shape = SHAPE) -> list[str]:
    """What `theory.region` says otherwise."""
    bounds = region.bounds_of(s, shape, level)
    assert bounds is not None
    q, d = region.decay(s, shape, bounds)
    said = {**bounds._asdict(), "Q": q, "d": d, "M": region.upper_form(s, shape, bounds)}
    again = {**bounds_again(s, shape, float(level)), **forms_again(s, shape, bounds)}
    return [name for name in again if not np.allclose(np.array(said[name], dtype=float), again[name], rtol=1e-9, atol=1e-9)]


def other_kappa_terms(seed: int = 5, count: int = 50) -> list[str]:
    """Terms of T10 and T12 with kappa that are not made of |W - W^|, entry by entry."""
    sample = draw_sample(seed, count)
    found = []
    for completed in (True, False):
        bound = lyapunov_rate(sample, completed).bound
        pairs = zip(sample.ideal, (sample.memory.paper.weights_1, sample.memory.paper.weights_2), strict=True)
        both = [(np.array([list(row) for row in w]), np.array([list(row) for row in w_hat])) for w, w_hat in pairs]
        error, ideal = (
            np.sqrt(sum(np.sum(part**2, axis=(0, 1)) for part in parts))
            for parts in ([w - w_hat for w, w_hat in both], [w for w, _ in both])
        )
        least = -bound["kappa |W~|^2"] / error**2  # kappa |r|
        found += [f"{completed}"] if not np.allclose(bound["kappa |W~| |W|"], least * error * ideal, rtol=1e-9) else []
    return found


def other_learning_terms(seed: int = 5, count: int = 50) -> list[str]:
    """Terms of T16 other than two samples of the law say: W+ of W^ less W+ of no weights is (1 - s) W^."""
    sample = draw_sample(seed, count)
    paper, before = sample.gains.paper, sample.memory.paper
    empty = before._replace(weights_1=0.0 * before.weights_1, weights_2=0.0 * before.weights_2)
    after, after_empty = (
        Backstepping().law(memory, sample.state, sample.reference, paper, 0.0, PERIOD)[1] for memory in (before, empty)
    )
    found, nets = [], ((paper.force_net, "weights_1"), (paper.torque_net, "weights_2"))
    for side, (net, name) in zip(learning_bound(sample), nets, strict=True):
        size = getattr(before, name).norm()
        kept = (getattr(after, name) - getattr(after_empty, name)).norm()
        again = {"(1 - s) |W^|": kept, "s sqrt(N) / kappa": (1.0 - kept / size) * np.sqrt(NEURONS) / net.damping}
        found += [f"{name}: {term}" for term, value in again.items() if not np.allclose(side.terms[term], value, rtol=1e-6)]
    return found
