"""Joint compatibility of closures, pair by pair, against the dense matrices of the formula."""

from __future__ import annotations

import numpy as np

from pilotage.kernels.slam.compatibility import compatible_pairs, innovation_covariances

POSES, CLOSURES = 7, 40


def test_pairs_agree_as_their_joint_chi_square_says() -> None:
    generator = np.random.default_rng(5)
    half = generator.normal(0.0, 1.0, (3 * POSES, 3 * POSES))
    joint = half @ half.T
    first = generator.integers(0, POSES - 1, CLOSURES)
    second = first + 1 + generator.integers(0, POSES - 1 - first)
    a, b = generator.normal(0.0, 1.0, (2, CLOSURES, 3, 3))
    noise = np.array([m @ m.T + 0.3 * np.eye(3) for m in generator.normal(0.0, 0.5, (CLOSURES, 3, 3))])
    rows = np.zeros((CLOSURES, 3, 3 * POSES))
    for k in range(CLOSURES):
        rows[k, :, 3 * first[k] : 3 * first[k] + 3] += a[k]
        rows[k, :, 3 * second[k] : 3 * second[k] + 3] += b[k]
    by_graph = innovation_covariances(a, b, joint, first, second)
    assert np.allclose(by_graph, rows @ joint @ rows.transpose(0, 2, 1))
    own = by_graph + noise
    innovations = np.array([generator.multivariate_normal(np.zeros(3), 1.5 * c) for c in own])
    gate = 6.0
    agree = compatible_pairs(a, b, joint, first, second, innovations, own, np.linalg.inv(own), gate)

    def squared(errors: np.ndarray, covariance: np.ndarray) -> float:
        return float(errors @ np.linalg.solve(covariance, errors))

    expected = np.zeros((CLOSURES, CLOSURES), np.bool_)
    for k in range(CLOSURES):
        for m in range(CLOSURES):
            cross = rows[k] @ joint @ rows[m].T
            both = np.block([[own[k], cross], [cross.T, own[m]]])
            least = min(squared(innovations[k], own[k]), squared(innovations[m], own[m]))
            together = squared(np.concatenate([innovations[k], innovations[m]]), both)
            expected[k, m] = k != m and together - least <= gate
    assert np.array_equal(agree, expected)
    assert 0.2 < agree.mean() < 0.9
