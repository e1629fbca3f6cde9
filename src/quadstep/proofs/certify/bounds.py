"""The radii of Theorem 5.1: outside either, L falls (as far as its proof goes)."""

import math


def error_radius(weight_bound: float, residual_bound: float, kappa: float, k_min: float) -> float | None:
    """b_r = (kappa W_B^2 / 4 + eps_N) / K_min (Eq. 63, which prints it without kappa); None if K_min is not positive."""
    return (kappa * weight_bound**2 / 4.0 + residual_bound) / k_min if k_min > 0.0 else None


def printed_error_radius(weight_bound: float, residual_bound: float, k_min: float) -> float | None:
    """Eq. 63 as printed."""
    return error_radius(weight_bound, residual_bound, 1.0, k_min)


def weight_radius(weight_bound: float, residual_bound: float, kappas: tuple[float, float]) -> float | None:
    """b_w = W_B/2 + sqrt(W_B^2/4 + eps_N/kappa) (Eq. 65); None without damping.

    Where the nets have different kappas it is the larger root of kappa_min w^2 - kappa_max W_B w = eps_N.
    """
    least, most = min(kappas), max(kappas)
    if least <= 0.0:
        return None
    half = 0.5 * weight_bound * most / least
    return half + math.sqrt(half**2 + residual_bound / least)
