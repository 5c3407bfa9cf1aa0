"""Intervals of least squares whose errors hang together within clusters."""

from __future__ import annotations

import numpy as np
import pytest

from pilotage.calibration.clustered import clustered_least_squares, jackknife_std
from pilotage.core.errors import InputError


def test_intervals_hold_where_errors_are_common_to_a_cluster() -> None:
    """Coverage of a 95 % interval in 300 draws: 90 to 99 % unless it is wrong (false alarm below 1e-3)."""
    rng = np.random.default_rng(4)
    clusters = np.repeat(np.arange(30), 20)
    held = naive = 0
    for _ in range(300):
        # A regressor that is nearly constant within a cluster: the case where rows pretend to know most.
        x = rng.normal(size=30)[clusters] + rng.normal(0.0, 0.3, 600)
        y = 2.0 * x + rng.normal(size=30)[clusters] + rng.normal(size=600)
        design = np.column_stack([np.ones(600), x])
        held += clustered_least_squares(design, y, clusters).estimate(1).holds(2.0)
        naive += clustered_least_squares(design, y, np.arange(600)).estimate(1).holds(2.0)
    assert 270 <= held <= 297
    assert naive < 200


def test_with_every_row_its_own_cluster_it_is_whites_estimator() -> None:
    rng = np.random.default_rng(5)
    design = rng.normal(size=(50, 2))
    y = design @ [1.0, -2.0] + rng.normal(size=50)
    found = clustered_least_squares(design, y, np.arange(50))
    residual = y - design @ found.values
    bread = np.linalg.inv(design.T @ design)
    white = bread @ (design * residual[:, None] ** 2).T @ design @ bread * 50 / 49 * 49 / 48
    np.testing.assert_allclose(found.stds, np.sqrt(np.diag(white)), rtol=1e-12)
    assert found.dof == 49.0


def test_one_cluster_tells_nothing() -> None:
    with pytest.raises(InputError, match="two minutes or more"):
        clustered_least_squares(np.ones((9, 1)), np.ones(9), np.zeros(9, dtype=np.int64))


def test_the_jackknife_of_a_mean_is_its_standard_error() -> None:
    values = np.random.default_rng(6).normal(size=40)
    sums = np.column_stack([values, np.ones(40)])
    std = jackknife_std(sums, lambda total: float(total[0] / total[1]))
    assert std == pytest.approx(values.std(ddof=1) / np.sqrt(40), rel=1e-12)
