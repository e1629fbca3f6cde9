"""From L_dot to the bounds: Eqs 58-65, and whether the set they describe is compact. All at random moments of flight."""

import numpy as np
import sympy

from quadstep.proofs.verify.equation_row import Check, Checks, EquationVerdict, holds, near, row, same, short, symbol
from quadstep.proofs.verify.lyapunov import Batch, LyapunovBatch, WeightNorms, batch, moments
from quadstep.proofs.verify.stability import LAW, SLOPES, TUNING, gap, printed_l_dot

SLACK = 1e-9


def below(what: str, small: Batch, large: Batch) -> Check:
    """Check: an inequality at every moment; reports the least margin."""
    margin = (large - small) / (1.0 + np.abs(large) + np.abs(small))
    return holds(what, np.all(margin >= -SLACK), f"least margin {short(margin.min())} of {len(margin)}", "never negative")


def damping(m: LyapunovBatch) -> Batch:
    """The kappa of both nets (the same in these moments)."""
    return batch(m.gains.force_net.damping)


def quadratic(m: LyapunovBatch) -> Batch:
    """r^T K_v r with the corrected K_v: K_r1 - m Lambda_1 and K_r2 - J_M max(Lambda_2) I; J_M: J's largest eigenvalue."""
    k = m.gains
    j = np.array([[batch(e) for e in line] for line in m.j]).transpose(2, 0, 1)
    bound = np.linalg.eigvalsh(j)[:, -1] * np.max(np.array(k.slope_2.entries), axis=0)
    return batch(m.r1 @ ((k.gain_1 - k.mass * k.slope_1) * m.r1) + m.r2 @ (k.gain_2 * m.r2) - bound * (m.r2 @ m.r2))


def noise(m: LyapunovBatch) -> Batch:
    """r^T eps_v."""
    return batch(m.r1 @ m.eps_1 + m.r2 @ m.eps_2)


def skew(m: LyapunovBatch) -> Batch:
    """r2^T (J_dot - 2C) r2 / 2 with the shipped C."""
    return batch(0.5 * (m.r2 @ (m.j_dot @ m.r2)) - m.r2 @ (m.c @ m.r2))


def fed(m: LyapunovBatch) -> Batch:
    """Kappa |r| tr{W_tilde^T W_hat}."""
    return damping(m) * m.r * m.trace


def bound_61(m: LyapunovBatch, w: WeightNorms) -> Batch:
    """Right side of Eq. 61, first line, smallest eigenvalue of K_v for its norm."""
    return -m.k_v * m.r**2 + damping(m) * m.r * (w.error * w.ideal - w.error**2) + m.eps * m.r


def bound_62(m: LyapunovBatch, w: WeightNorms) -> Batch:
    """Right side of Eq. 62."""
    kappa = damping(m)
    return -m.r * (kappa * (w.error - w.ideal / 2) ** 2 - kappa * w.ideal**2 / 4 + m.k_v * m.r - m.eps)


def cross_terms() -> tuple[float, float]:
    """(r^T J Lambda_2 r, J_M r^T Lambda_2 r) for a unit r, Sigma = 5 I, theta = 0.8, where the first is the larger."""
    s = np.sin(0.8)
    j = 5.0 * np.array([[1.0, 0.0, -s], [0.0, 1.0, 0.0], [-s, 0.0, 1.0]])
    product = j @ np.diag(SLOPES)
    r = np.linalg.eigh(10.0 * np.diag(SLOPES) - 0.5 * (product + product.T))[1][:, 0]
    return float(r @ product @ r), float(10.0 * r @ (np.array(SLOPES) * r))


def cross_check() -> tuple[Check, str]:
    """That J <= J_M does not give J Lambda_2 <= J_M Lambda_2."""
    real, bound = cross_terms()
    return (holds("r2^T J Lambda_2 r2 <= J_M r2^T Lambda_2 r2 fails for unequal Lambda_2", real > bound, short(real - bound),
                  "above 0"),
            f"Sigma = 5 I, J_M = 10, Lambda_2 = diag{tuple(int(s) for s in SLOPES)}, theta = 0.8, a unit r2: r2^T J "
            "Lambda_2 r2 = "
            f"{short(real)}, J_M r2^T Lambda_2 r2 = {short(bound)}")  # fmt: skip


# Eq. 58
@row("58", "L_dot with the tuning law", "L_dot <= -r^T K_v r + r^T eps_v + r^T (J_dot - 2C) r / 2 + kappa |r| "
     "tr{W_tilde^T W_hat}", TUNING, EquationVerdict.CORRECTED,
     "r2 instead of r in the third term; the step needs J_M max(Lambda_2) in K_v; from Eq. 56, not 55; -r1^T delta as in "
     "56")  # fmt: skip
def equation_58() -> Checks:
    m, _ = moments(58)
    check, numbers = cross_check()
    learnt = gap(m.growth, fed(m))
    return Checks([
        holds("tr{W_tilde^T (F^-1 W_tilde_dot + mu_r)} = kappa |r| tr{W_tilde^T W_hat} by the law", learnt < 1e-8,
              f"off by {learnt:.0e}", "equal"),
        below("L_dot at the desired attitude", m.l_dot, -quadratic(m) + noise(m) + skew(m) + fed(m)),
        check,
    ], numbers)  # fmt: skip


@row("59", "K_v and eps_v", "K_v = diag(K_r1 - m Lambda_1, K_r2 - J_M Lambda_2), eps_v = (eps_1, eps_2)", LAW,
     EquationVerdict.CORRECTED, "K_r2 - J_M max(Lambda_2) I unless Lambda_2 is scalar")  # fmt: skip
def equation_59() -> Checks:
    m, _ = moments(59)
    k, check_and_numbers = m.gains, cross_check()
    real = m.r1 @ ((k.gain_1 - k.mass * k.slope_1) * m.r1) + m.r2 @ (k.gain_2 * m.r2 - m.j @ (k.slope_2 * m.r2))
    return Checks([below("r^T K_v r <= r^T diag(K_r1 - m Lambda_1, K_r2 - J Lambda_2) r", quadratic(m), batch(real)),
                     check_and_numbers[0]], check_and_numbers[1])  # fmt: skip


# Eq. 60
@row("60", "L_dot with W_hat = W - W_tilde", "L_dot <= -r^T K_v r + r^T eps_v + r^T (J - 2C) r / 2 + kappa |r| "
     "tr{W_tilde^T (W - W_tilde)}, third term 0", LAW, EquationVerdict.CORRECTED,
     "slips: J_dot instead of J, r2 instead of r; the third term is 0 for Christoffel's C")  # fmt: skip
def equation_60() -> Checks:
    m, w = moments(60)
    undotted = batch(m.r2 @ (m.j @ m.r2) - 2.0 * (m.r2 @ (m.c @ m.r2)))
    vanishing = float(np.max(np.abs(skew(m)) / (1.0 + np.abs(batch(m.r2 @ (m.c @ m.r2))))))
    return Checks([
        holds("r2^T (J_dot - 2C) r2 = 0 for the shipped C", vanishing < 1e-10, f"{vanishing:.0e}", "0"),
        holds("r2^T (J - 2C) r2 = 0, as printed", np.max(np.abs(undotted)) > 1.0, short(np.max(np.abs(undotted))), "not 0"),
        below("L_dot at the desired attitude", m.l_dot, -quadratic(m) + noise(m) + fed(m)),
        below("tr{W_tilde^T (W - W_tilde)} <= |W_tilde| |W| - |W_tilde|^2", m.trace, w.error * w.ideal - w.error**2),
    ], f"4000 random moments: |r2^T (J - 2C) r2| up to {short(np.max(np.abs(undotted)))}, 0 with J_dot for J")  # fmt: skip


@row("61", "L_dot in norms", "L_dot <= -|K_v|_min |r|^2 + kappa |r| {|W_tilde| |W| - |W_tilde|^2} + |eps_v|_max |r|", LAW,
     EquationVerdict.CORRECTED,
     "|K_v|_min has to be the smallest eigenvalue of K_v, not its 'minimum possible norm'")  # fmt: skip
def equation_61() -> Checks:
    m, w = moments(61)
    case_1 = np.diag([3.0 - 1.0 * 1.0] * 3 + [250.0 - 10.0 * 15.0] * 3)
    r, norm = np.eye(6)[0], float(np.linalg.norm(case_1, 2))
    factored = -m.r * (m.k_v * m.r + damping(m) * (w.error**2 - w.error * w.ideal) - m.eps)
    return Checks([
        below("L_dot at the desired attitude, smallest eigenvalue", m.l_dot, bound_61(m, w)),
        holds("second line equals the first", gap(factored, bound_61(m, w)) < 1e-12, "equal"),
        holds("-r^T K_v r <= -|K_v| |r|^2 fails for the norm", r @ case_1 @ r < norm, short(r @ case_1 @ r), f"below "
            f"{short(norm)}"),
    ], f"gains of Case 1, K_v = diag(2, 2, 2, 100, 100, 100), r = (1, 0, ...): r^T K_v r = {short(r @ case_1 @ r)}, "
       f"|K_v| |r|^2 = {short(norm)}")  # fmt: skip


@row("62", "L_dot, square completed", "L_dot <= -|r| {kappa [|W_tilde| - |W| / 2]^2 - kappa |W|^2 / 4 + |K_v|_min |r| - "
     "|eps_v|_max}", LAW, EquationVerdict.PROOF_STEP)  # fmt: skip
def equation_62() -> Checks:
    m, w = moments(62)
    v, ideal, kappa = symbol("v"), symbol("W"), symbol("kappa")
    return Checks([
        same("kappa (v^2 - v W), square "
            "completed", kappa * (v - ideal / 2) ** 2 - kappa * ideal**2 / 4, kappa * (v**2 - v * ideal)),
        holds("equals Eq. 61", gap(bound_62(m, w), bound_61(m, w)) < 1e-12, "equal"),
        below("L_dot at the desired attitude", m.l_dot, bound_62(m, w)),
    ])  # fmt: skip


@row("63", "bound of r", "L_dot <= 0 if and only if |r| > (W_B^2 / 4 + |eps_v|_max) / |K_v|_min = b_r", LAW,
     EquationVerdict.CORRECTED, "(kappa W_B^2 / 4 + |eps_v|_max) / |K_v|_min: the printed bound is too small for kappa > 1, "
     "needlessly large for kappa < 1; and 'if', not 'only if'")  # fmt: skip
def equation_63() -> Checks:
    m, w = moments(63)
    b_r = (damping(m) * w.ideal**2 / 4 + m.eps) / m.k_v
    outside, inside = m.r > b_r, m.r < b_r
    falling = int(np.sum(m.l_dot[inside] < 0))
    kappa, w_b, k_min = 4.0, 2.0, 1.0
    printed, right = w_b**2 / 4 / k_min, kappa * w_b**2 / 4 / k_min
    r = 2.0
    bound = -r * (kappa * (w_b / 2 - w_b / 2) ** 2 - kappa * w_b**2 / 4 + k_min * r)
    growing = attained()
    return Checks([
        holds(f"L_dot < 0 at {int(outside.sum())} moments outside the corrected b_r", np.all(m.l_dot[outside] < 0)),
        holds("L_dot < 0 at moments inside too", falling > 0, f"{falling} of {int(inside.sum())}", "some"),
        holds("the bound on L_dot is positive between the printed and the right b_r", printed < r < right and bound > 0,
              short(bound), "above 0"),
        holds("and reached: L_dot > 0 with |r| above the printed b_r, W_hat = W / 2", growing > 0, f"{growing} "
            "moments", "some"),
    ], f"kappa = 4, W_B = 2, eps = 0, K_min = 1, |W_tilde| = 1, |r| = 2: above the printed b_r = {short(printed)}, "
       "but the bound on "
       f"L_dot is {short(bound)}; right is b_r = {short(right)}. L_dot < 0 at {falling} of {int(inside.sum())} random moments "
       f"inside b_r; L_dot > 0 at {growing} of 4000 outside the printed one where W_hat = W / 2")  # fmt: skip


def attained() -> int:
    """Moments with |r| above the printed b_r, taken with their own |W| and |eps|, where L grows."""
    m, w = moments(163, half_learnt=True)
    return int(np.sum((m.r > (w.ideal**2 / 4 + m.eps) / m.k_v) & (m.l_dot > 0)))


@row("64", "condition on the weights' error", "kappa |W_tilde| {|W_tilde| - |W|} - |eps_v|_max > 0", TUNING,
     EquationVerdict.PROOF_STEP)  # fmt: skip
def equation_64() -> Checks:
    m, w = moments(64)
    met = damping(m) * w.error * (w.error - w.ideal) - m.eps > 0
    return Checks(
        [holds(f"L_dot < 0 at {int(met.sum())} moments that meet it, r != 0", met.any() and np.all(m.l_dot[met] < 0))]
    )


@row("65", "bound of the weights' error", "|W_tilde| > W_B / 2 + sqrt(W_B^2 / 4 + |eps_v|_max / kappa) = b_w", TUNING,
     EquationVerdict.PROOF_STEP, "for r != 0, see compact set")  # fmt: skip
def equation_65() -> Checks:
    m, w = moments(65)
    w_b, eps, kappa = symbol("W_B"), symbol("eps"), symbol("kappa")
    b_w = w_b / 2 + sympy.sqrt(w_b**2 / 4 + eps / kappa)
    beyond = w.error > w.ideal / 2 + np.sqrt(w.ideal**2 / 4 + m.eps / damping(m))
    return Checks([
        same("b_w is the root of Eq. 64", kappa * b_w * (b_w - w_b), eps),
        holds(f"L_dot < 0 at {int(beyond.sum())} moments beyond b_w, r != 0", beyond.any() and np.all(m.l_dot[beyond] < 0)),
    ])  # fmt: skip


@row("compact set", "conclusion from Eqs 63 and 65", "L_dot is negative outside a compact set; r and W_tilde are UUB", LAW,
     EquationVerdict.CORRECTED, "L_dot = 0 where r = 0, whatever W_tilde and the integrals are: the set is not compact, and "
     "b_r, b_w are not ultimate bounds")  # fmt: skip
def compact_set() -> Checks:
    m, w = moments(66, sliding=True)
    b_w = w.ideal / 2 + np.sqrt(w.ideal**2 / 4 + m.eps / damping(m))
    beyond = w.error > b_w
    slope = float(np.max(np.abs(m.l_dot)))
    worst = float(np.max(w.error / b_w))
    formula = gap(m.l_dot, printed_l_dot(m))
    return Checks([
        holds("r = 0 in these moments", np.max(m.r) < 1e-9, f"|r| up to {np.max(m.r):.0e}"),
        holds("|W_tilde| > b_w in some", beyond.sum() > 100, str(int(beyond.sum())), "above 100"),
        near("largest |L_dot| there", float(np.max(np.abs(m.l_dot[beyond]))), 0.0, 1e-6),
        holds("L_dot is that of Eq. 56", formula < 1e-6, f"off by {formula:.0e}", "equal"),
    ], f"r = 0 and |W_tilde| up to {short(worst)} b_w: |L_dot| = {'0' if slope < 1e-6 else short(slope)}")  # fmt: skip
