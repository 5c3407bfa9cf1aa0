"""Chi-square quantiles: every gate and every band is named by its probability."""

from __future__ import annotations

import scipy


def chi_square_quantile(probability: float, dof: float) -> float:
    """Value that a chi-square variable with ``dof`` degrees of freedom stays below with ``probability``."""
    return float(scipy.special.chdtri(dof, 1.0 - probability))


def chi_square_cdf(value: float, dof: float) -> float:
    """Probability that a chi-square variable with ``dof`` degrees of freedom stays below ``value``."""
    return float(scipy.special.chdtr(dof, value))


def gated_mean(gate: float, dof: float) -> float:
    """Mean of a chi-square variable given that it passed ``gate``: n F_{n+2}(g) / F_n(g).

    Of a gate so small that nothing passes it, the limit of that: g n / (n + 2).
    """
    passes = chi_square_cdf(gate, dof)
    return dof * chi_square_cdf(gate, dof + 2) / passes if passes > 0.0 else gate * dof / (dof + 2.0)
