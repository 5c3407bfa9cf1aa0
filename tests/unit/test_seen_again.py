"""Which keyframes are aligned with one another: near, turned alike, from as many passes as possible."""

from __future__ import annotations

import numpy as np
import pytest

from pilotage.kernels.slam.seen_again import passes_near

BEHIND, RADIUS_M, TURN_RAD, TURN_M, APART, MOST = 12, 2.5, 1.6, 0.6, 6, 8


def _cost(poses: np.ndarray, k: int, i: int) -> float:
    """How near two keyframes are, infinite where they are not to be paired."""
    distance = float(np.hypot(*(poses[k, :2] - poses[i, :2])))
    turn = float(abs((poses[k, 2] - poses[i, 2] + np.pi) % (2.0 * np.pi) - np.pi))
    return distance + TURN_M * turn if distance <= RADIUS_M and turn < TURN_RAD else np.inf


@pytest.mark.parametrize("since", [0, 90])
def test_the_nearest_of_each_pass_are_paired(since: int) -> None:
    generator = np.random.default_rng(20 + since)
    poses = generator.uniform([0.0, 0.0, -9.0], [6.0, 6.0, 9.0], (160, 3))
    pairs = passes_near(poses, since)
    assert len(pairs) > 300
    for i in range(len(poses)):
        chosen = pairs[pairs[:, 1] == i, 0].tolist()
        earlier = range(since if i >= since else 0) if since else range(max(0, i - BEHIND))
        costs = {k: _cost(poses, k, i) for k in earlier}
        expected: list[int] = []
        for k in sorted((k for k in earlier if costs[k] < np.inf), key=lambda k: (costs[k], k)):
            if len(expected) < MOST and all(abs(k - other) > APART for other in expected):
                expected.append(k)
        assert chosen == expected


def test_a_few_keyframes_have_no_pass_behind_them() -> None:
    for count in range(BEHIND + 1):
        assert passes_near(np.zeros((count, 3)), 0).shape == (0, 2)
