"""The tuning law and the Lyapunov function: Eqs 53-57, the gain conditions, F's shape."""

import numpy as np
import sympy
from numpy.typing import ArrayLike, NDArray

from quadstep.control.backstepping import Backstepping
from quadstep.engines.loop import Cycle, Loop
from quadstep.interfaces.learning import weight_rate
from quadstep.interfaces.plant import Kinematics
from quadstep.numbers import Matrix, Vector, vector
from quadstep.proofs.verify import closed_loop as loop
from quadstep.proofs.verify.closed_loop import E1, E1_DOT, GAINS, LAMBDA_1, MEMORY, R1, R2, STATE
from quadstep.proofs.verify.equation_row import Checks, EquationVerdict, array, branch, holds, near, row, same, short, symbols
from quadstep.proofs.verify.lyapunov import Batch, LyapunovBatch, batch, moments
from quadstep.proofs.verify.plant import MASS, body, inertia_matrix
from quadstep.vehicle.in_space import COLUMNS
from quadstep.vehicle.lagrange import AttainedCommand, Lagrange, Limits, Parameters
from quadstep.vehicle.paper import effective_inertia
from quadstep.world.paths import MinimumJerk, MinimumJerkParameters

LAW, TUNING = "control.backstepping:Backstepping.law", "interfaces.learning:weight_rate"
NORM = sympy.sqrt((R1.T * R1)[0] + (R2.T * R2)[0])
SLOPES = (1.0, 5.0, 25.0)


def largest(sizes: ArrayLike) -> float:
    return float(np.max(np.abs(sizes)))


# Eq. 53
@row("53", "e1 and e2 are bounded by r1 and r2", "|e_i| <= |s + Lambda_i|^-1 |r_i| <= |r_i| / sigma_min(Lambda_i)", LAW,
     EquationVerdict.CORRECTED, "the norm of the inverse is meant, |(s + Lambda)^-1| <= 1 / sigma_min; the inverse of the "
     "norm is smaller unless Lambda is scalar; it bounds suprema over time for e(0) = 0, not values at an instant; the text's "
     "'e_1 and e_1' means e_1 and e_2")  # fmt: skip
def equation_53() -> Checks:
    slopes = np.array([1.0, 4.0, 4.0])
    r1 = array(loop.sample().command.r1)
    values = {**dict.fromkeys((*STATE.position, *STATE.velocity), 0.0),
              **dict(zip([*loop.REFERENCE.position, *loop.REFERENCE.velocity], (1.0, 0, 0, 0, 0, 0), strict=True)),
              **dict(zip(GAINS.slope_1, slopes, strict=True))}  # fmt: skip
    of_law = float(sympy.sqrt((r1.T * r1)[0]).subs(values))
    gains = [np.linalg.norm(np.linalg.inv(1j * w * np.eye(3) + np.diag(slopes)), 2) for w in np.logspace(-3, 3, 200)]
    printed = 1.0 / np.linalg.norm(np.diag(slopes), 2)
    return Checks([
        same("r1 of the law", r1, E1_DOT + LAMBDA_1 * E1),
        same("r2 of the law", loop.sample().command.r2, R2),
        near("|r1| of the law at rest, e1 = (1, 0, 0), Lambda_1 = diag(1, 4, 4)", of_law, 1.0),
        holds("|e1| = 1 is above |Lambda_1|^-1 |r1| there", printed * of_law < 1.0, short(printed * of_law), "below 1"),
        holds("|(jw + Lambda)^-1| <= 1 / sigma_min at all frequencies", max(gains) <= 1.0, short(max(gains)), "at most 1"),
    ], f"Lambda_1 = diag(1, 4, 4), e1 = (1, 0, 0) at rest, s = 0: |e1| = 1, |s + Lambda_1|^-1 |r1| = "
       f"{short(printed * of_law)}")  # fmt: skip


@row("54", "tuning laws", "W_hat_i_dot = F_i mu_i r_i^T - kappa |r| F_i W_hat_i", TUNING, EquationVerdict.AS_PRINTED,
     "one kappa here, two in Section 6: each net has its own; |r| is that of r1 and r2 together; F_i = F I")  # fmt: skip
def equation_54() -> Checks:
    following, silent = loop.sample().following, loop.sample(learning=False).following
    checks = []
    for i, net, hat, chi, r, after, before in (
        (1, loop.NET_1, loop.W_HAT_1, loop.CHI_1, R1, following.weights_1, silent.weights_1),
        (2, loop.NET_2, loop.W_HAT_2, loop.CHI_2, R2, following.weights_2, silent.weights_2),
    ):
        f, kappa, mu = net.learning_rate, net.damping, loop.mu(net, chi)
        printed = f * mu * r.T - kappa * NORM * f * array(hat)
        alone = weight_rate(net, hat, Vector(mu), Vector(r), NORM)
        checks += [
            same(f"rate of W_hat_{i}", alone, printed),
            same(f"W_hat_{i} after a sample of the law", array(after) - array(hat), loop.PERIOD * printed),
            same(f"W_hat_{i} rests before learning starts", before, hat),
        ]
    return Checks(checks)


@row("F_1, F_2", "shape of the tuning gains", "F_1 = F_2 = diag(5 [1; 1; 1]), 3 x 3", TUNING, EquationVerdict.CORRECTED,
     "F_i multiplies mu_i, so it is N x N; 5 I acts as the scalar 5 does")  # fmt: skip
def shape() -> Checks:
    neurons, draw = 10, np.random.default_rng(54)
    mu, r, weights = draw.normal(size=neurons), draw.normal(size=3), draw.normal(size=(neurons, 3))
    net = loop.NET_1._replace(learning_rate=5.0, damping=0.01)
    columns = Matrix(Vector(line) for line in weights.tolist())
    rate = np.array([list(line) for line in weight_rate(net, columns, Vector(mu.tolist()), Vector(r.tolist()), 2.0)])
    full = 5.0 * np.eye(neurons) @ (np.outer(mu, r) - 0.01 * 2.0 * weights)
    fits = np.diag([5.0] * 3).shape[1] == np.outer(mu, r).shape[0]
    return Checks([
        holds("rate of W_hat with F = 5 I, N x N, N = 10", largest(rate - full) < 1e-12, f"off by {largest(rate - full):.0e}",
              "equal"),
        holds("a 3 x 3 matrix times mu r^T, N x 3, is undefined", not fits, f"3 columns, {neurons} rows", "no product"),
    ], f"(3 x 3) times ({neurons} x 3) is not a product")  # fmt: skip


@row("gain conditions", "hypothesis of Theorem 5.1", "K_r1 - m Lambda_1 > 0, K_r2 - J_M Lambda_2 > 0, u and tau by "
     "'48 and 48'", "vehicle.paper:effective_inertia", EquationVerdict.CORRECTED,
     "K_r2 > J_M max(Lambda_2) I unless Lambda_2 is scalar: J Lambda_2 is not symmetric; u and tau are given by 48 and "
     "35")  # fmt: skip
def gain_conditions() -> Checks:
    def smallest(gain: NDArray[np.float64], inertia: NDArray[np.float64]) -> float:
        product = inertia @ np.diag(SLOPES)
        return float(np.linalg.eigvalsh(np.diag(gain) - 0.5 * (product + product.T)).min())

    def inertia_at(theta: float) -> NDArray[np.float64]:
        j = effective_inertia(vector(0.0, theta, 0.0), vector(5.0, 5.0, 5.0), Kinematics.STANDARD)
        return np.array([list(line) for line in j])

    tilted, slopes, bound = inertia_at(0.8), np.array(SLOPES), 5.0 * (1.0 + np.sin(0.8))
    top = [float(np.linalg.eigvalsh(inertia_at(theta)).max() - 5.0 * (1.0 + abs(np.sin(theta)))) for theta in (-1.2, 0.3, 1.5)]
    by_print, loose = smallest(bound * slopes, tilted), smallest(10.0 * slopes, tilted)
    right = smallest(np.full(3, bound * slopes.max()), tilted)
    m = moments(5)[0]
    j_largest = np.linalg.eigvalsh(np.array([[batch(e) for e in line] for line in m.j]).transpose(2, 0, 1)).max()
    return Checks([
        holds("J_M = 10 bounds J for Sigma = 5 I: largest eigenvalue 5 (1 + |sin theta|)", largest(top) < 1e-12,
              f"off by {largest(top):.0e}", "equal"),
        holds("J <= 2 max(Sigma) at random moments, Sigma up to 9", j_largest <= 18.0, short(j_largest), "at most 18"),
        holds("K_r2 = J_M Lambda_2 is enough", by_print < 0.0, f"{short(by_print)} smallest eigenvalue", "below 0 (it "
            "is not)"),
        holds("K_r2 = J_M max(Lambda_2) I is enough", right > 0.0, f"{short(right)} smallest eigenvalue", "above 0"),
        near("smallest eigenvalue of J_M Lambda_2 - J Lambda_2", by_print, -16.83),
    ], f"Sigma = 5 I, Lambda_2 = diag{tuple(int(s) for s in SLOPES)}, theta = 0.8: smallest eigenvalue of J_M Lambda_2 - "
       f"sym(J Lambda_2) is {short(by_print)} for the least J_M = {short(bound)}, {short(loose)} for J_M = 10; with "
       f"max(Lambda_2) I for Lambda_2 it is {short(right)}")  # fmt: skip


@row("55", "Lyapunov function", "L = r1^T m r1 / 2 + r2^T J r2 / 2 + int r1^T K_i1 int r1 / 2 + int r2^T K_i2 int r2 / 2 + "
     "tr{W_tilde^T F^-1 W_tilde} / 2", "vehicle.in_space:log_row", EquationVerdict.DEFINITION, "logged without its last term, "
     "which contains the unknown weights; not positive definite at theta = 90 degrees, where det J = Sx Sy Sz c_th^2 is "
     "0")  # fmt: skip
def equation_55() -> Checks:
    path = MinimumJerkParameters(vector(0.0, 0.0, 0.0), vector(20.0, 5.0, 10.0), 0.0, 0.0, 40.0)
    parameters = Parameters(body(), loop.DISTURBANCE, path, GAINS, Limits(100.0, 100.0, 1.5))
    command = loop.sample().command
    cycle = Cycle(STATE, (), (), MEMORY, command, AttainedCommand(command.thrust, command.torque))
    flown = Loop(Lagrange(), MinimumJerk(), Backstepping())
    logged = dict(zip(COLUMNS, flown.row(cycle, parameters, 3.0), strict=True))
    i1, i2 = array(MEMORY.integral_1), array(MEMORY.integral_2)
    k1, k2 = sympy.diag(*GAINS.integral_1), sympy.diag(*GAINS.integral_2)
    printed = (MASS * R1.T * R1 + R2.T * inertia_matrix() * R2 + i1.T * k1 * i1 + i2.T * k2 * i2)[0] / 2
    norms = [sympy.sqrt(sum(entry**2 for entry in array(hat))) for hat in (loop.W_HAT_1, loop.W_HAT_2)]
    return Checks([
        same("logged L", branch(logged["lyapunov"], {}), printed),
        same("logged norms of r1 and r2", [logged["norm_r1"], logged["norm_r2"]],
             [sympy.sqrt((R1.T * R1)[0]), sympy.sqrt((R2.T * R2)[0])]),
        same("logged norms of the weights", [logged["norm_W1"], logged["norm_W2"]], norms),
    ])  # fmt: skip


def printed_l_dot(m: LyapunovBatch) -> Batch:
    """Right side of Eq. 56."""
    k = m.gains
    damped = m.r1 @ (k.gain_1 * m.r1 - k.mass * (k.slope_1 * m.r1)) + m.r2 @ (k.gain_2 * m.r2 - m.j @ (k.slope_2 * m.r2))
    turned = 0.5 * (m.r2 @ (m.j_dot @ m.r2)) - m.r2 @ (m.c @ m.r2)
    return batch(-damped + m.r1 @ m.eps_1 + m.r2 @ m.eps_2 + turned + m.growth)


def gap(found: Batch, expected: Batch) -> float:
    """Largest difference relative to the size of the numbers."""
    return largest((found - expected) / (1.0 + np.abs(found) + np.abs(expected)))


@row("56", "L_dot", "-r^T diag(K_r1 - m Lambda_1, K_r2 - J Lambda_2) r + r^T eps_v + r2^T J_dot r2 / 2 - r2^T C r2 + "
     "tr{W_tilde^T (F^-1 W_tilde_dot + "
     "mu_r)}", LAW, EquationVerdict.CORRECTED, "-r1^T delta is missing, see delta")  # fmt: skip
def equation_56() -> Checks:
    calm, real = moments(56)[0], moments(56, at_desired_attitude=False)[0]
    lost = batch(real.r1 @ real.delta)
    at_rest, missed, repaired = gap(calm.l_dot, printed_l_dot(calm)), gap(real.l_dot, printed_l_dot(real)), gap(
        real.l_dot, printed_l_dot(real) - lost
    )  # fmt: skip
    wrong = int(np.sum((printed_l_dot(real) < 0) & (real.l_dot > 0)))
    return Checks([
        holds("L_dot by the chain rule, delta = 0, 4000 random moments", at_rest < 1e-10, f"off by {at_rest:.0e}", "equal"),
        holds("with -r1^T delta at any attitude", repaired < 1e-10, f"off by {repaired:.0e}", "equal"),
        holds("as printed at any attitude", missed > 0.1, f"off by {short(missed)}", "different"),
        holds("moments where L grows and the printed L_dot is negative", wrong > 0, str(wrong), "some"),
    ], f"in {wrong} of 4000 random moments L grows where the printed L_dot is negative")  # fmt: skip


# Eq. 57
@row("57", "rate of the weights' error", "W_tilde_dot = -F mu_r + kappa |r| F W_hat", TUNING, EquationVerdict.AS_PRINTED,
     "with constant ideal weights; Eq. 54 stacked")  # fmt: skip
def equation_57() -> Checks:
    r1, r2 = symbols("r1"), symbols("r2")
    mus, size = (symbols("mu_1", 2), symbols("mu_2", 2)), sympy.Symbol("r", positive=True)
    rates = [weight_rate(net, hat, mu, r, size) for net, hat, mu, r in
             ((loop.NET_1, loop.W_HAT_1, mus[0], r1), (loop.NET_2, loop.W_HAT_2, mus[1], r2))]  # fmt: skip
    f = sympy.diag(*[loop.NET_1.learning_rate] * 2, *[loop.NET_2.learning_rate] * 2)
    kappa = sympy.diag(*[loop.NET_1.damping] * 2, *[loop.NET_2.damping] * 2)
    mu_r = sympy.Matrix.vstack(array(mus[0]) * array(r1).T, array(mus[1]) * array(r2).T)
    hats = sympy.Matrix.vstack(array(loop.W_HAT_1), array(loop.W_HAT_2))
    shipped = -sympy.Matrix.vstack(*(array(rate) for rate in rates))
    return Checks([same("-W_hat_dot, both nets stacked", shipped, -f * mu_r + kappa * size * f * hats)])
