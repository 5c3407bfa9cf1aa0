"""NEES and NIS: whether a filter is as good as it says; their means over a run under their JSON keys."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pilotage.core.angles import wrap_array_to_pi
from pilotage.core.chi_square import chi_square_quantile
from pilotage.core.types import BoolArray, FloatArray

RESAMPLES = 1000
SINGULAR = 1e-12
"""Least eigenvalue of the correlations, which are 1 on their diagonal; below, it is what rounding left."""
SURE = 0.999
"""Share of the true positions that a consistent filter's ellipse of ``longest_outside_s`` holds."""
LEVEL = 0.95
"""Of a run's bands."""
BOOTSTRAP_SEED = 20240607
"""Fixed: the band of a run must not change from one evaluation to the next."""


@dataclass(frozen=True, slots=True)
class Band:
    """A mean and the ends of its confidence band."""

    mean: float
    low: float
    high: float


def nees(truth: FloatArray, estimate: FloatArray, cov: FloatArray) -> FloatArray:
    """Normalized estimation error squared, e' P^-1 e (Bar-Shalom et al. 2001, eq. 5.4.2-1).

    Parameters
    ----------
    truth, estimate
        (N, 3) x, y, theta; the heading's error is wrapped.
    cov
        (N, 3, 3).

    Returns
    -------
    (N,) values with mean 3 for a consistent filter; nan where the covariance is singular to rounding, as in
    the first steps after a start that is known exactly: it says nothing of errors across what it spans.
    """
    error = truth - estimate
    error[:, 2] = wrap_array_to_pi(error[:, 2])
    out = np.full(truth.shape[0], np.nan)
    std = np.sqrt(np.maximum(np.einsum("nii->ni", cov), 0.0))
    spread = np.isfinite(cov).all(axis=(1, 2)) & (std > 0.0).all(axis=1)
    # Units would decide what is small: correlations have none.
    correlation = cov[spread] / (std[spread, :, None] * std[spread, None, :])
    regular = spread.copy()
    regular[spread] = np.linalg.eigvalsh(correlation)[:, 0] > SINGULAR
    if regular.any():
        solved = np.linalg.solve(cov[regular], error[regular][:, :, None])[:, :, 0]
        out[regular] = np.einsum("ni,ni->n", error[regular], solved)
    return out


def longest_outside_s(
    t_s: FloatArray, truth: FloatArray, estimate: FloatArray, cov: FloatArray, claimed: BoolArray
) -> float:
    """The longest time in which a filter that claims to know its position is surely wrong about it.

    Parameters
    ----------
    t_s
        (N,) rising times.
    truth, estimate, cov
        (N, 3), (N, 3) and (N, 3, 3); of the position's ellipse that holds ``SURE`` of the true positions.
    claimed
        (N,) where it claims so.
    """
    error = (truth - estimate)[:, :2, None]
    spread = cov[:, :2, :2]
    regular = np.linalg.det(spread) > 0.0
    distance = np.where(np.hypot(error[:, 0, 0], error[:, 1, 0]) > 0.0, np.inf, 0.0)
    solved = np.linalg.solve(spread[regular], error[regular])
    distance[regular] = np.einsum("nij,nij->n", error[regular], solved)
    wrong = np.concatenate([[False], claimed & (distance > chi_square_quantile(SURE, 2)), [False]])
    turns = np.flatnonzero(wrong[1:] != wrong[:-1])
    if not turns.size:
        return 0.0
    begins, ends = turns[::2], turns[1::2] - 1
    before = np.concatenate([[0.0], t_s])[begins]
    return float((t_s[ends] - before).max())


def nees_metrics(values: FloatArray) -> dict[str, object]:
    """Mean and band of a run's NEES (N,), nan left out; 3 is ideal for a pose."""
    return _banded("nees", correlated_mean(values))


def nis_metrics(nis: FloatArray, expected: FloatArray | float) -> dict[str, object]:
    """Mean and band of NIS per degree of freedom, corrected for what the gate cuts off; 1 is ideal.

    Parameters
    ----------
    nis
        (N,) of each step's accepted readings together, or of each reading; nan where there is none.
    expected
        What a consistent filter gives behind its gate: (N,) by step, or one number for readings that all
        have it. Steps of which nothing is expected are left out. Where none is left there are no metrics.
    """
    if isinstance(expected, float):
        ratios = nis[np.isfinite(nis)] / expected
        return _banded("nis", correlated_mean(ratios)) if ratios.size else {}
    measured = np.isfinite(nis) & (expected > 0.0)
    if not measured.any():
        return {}
    nis, expected = nis[measured], expected[measured]
    # A ratio of sums r = sum(nis) / sum(expected); its band is that of the linearized terms, in which a
    # changing number of readings cancels.
    ratio = nis.sum() / expected.sum()
    return _banded("nis", correlated_mean(ratio + (nis - ratio * expected) / expected.mean()))


def _banded(name: str, band: Band) -> dict[str, object]:
    return {f"{name}_mean": band.mean, f"{name}_low": band.low, f"{name}_high": band.high}


def correlated_mean(values: FloatArray) -> Band:
    """Mean of a correlated series with a 95 % band from the moving-block bootstrap.

    Neighbouring steps are not independent, so a band from the number of steps would be far too narrow.
    The block is as long as twice the series' integrated autocorrelation time, at least the cube root of
    its length (Kuensch 1989), at most a quarter of it.

    Parameters
    ----------
    values
        (N,); nan are left out.
    """
    series = values[np.isfinite(values)]
    n = series.shape[0]
    if n == 0:
        return Band(float("nan"), float("nan"), float("nan"))
    mean = float(series.mean())
    if n < 8:
        return Band(mean, float("nan"), float("nan"))
    block = int(np.clip(np.ceil(2.0 * correlation_steps(series)), np.ceil(n ** (1 / 3)), max(n // 4, 1)))
    sums = np.concatenate([[0.0], np.cumsum(series)])
    block_means = (sums[block:] - sums[:-block]) / block
    rng = np.random.default_rng(BOOTSTRAP_SEED)
    blocks = -(-n // block)
    picks = rng.integers(0, block_means.shape[0], size=(RESAMPLES, blocks))
    means = block_means[picks].mean(axis=1)
    low, high = np.quantile(means, [(1 - LEVEL) / 2, (1 + LEVEL) / 2])
    return Band(mean, float(low), float(high))


def correlation_steps(series: FloatArray) -> float:
    """Integrated autocorrelation time in steps, 1 + 2 sum rho_k up to the first rho_k below 0.05."""
    centred = series - series.mean()
    variance = float(centred @ centred)
    if variance == 0.0:
        return 1.0
    n = series.shape[0]
    size = 1 << (2 * n - 1).bit_length()
    spectrum = np.fft.rfft(centred, size)
    rho = np.fft.irfft(spectrum * np.conj(spectrum), size)[:n] / variance
    below = np.flatnonzero(rho < 0.05)
    stop = int(below[0]) if below.size else n
    return float(1.0 + 2.0 * rho[1:stop].sum())
