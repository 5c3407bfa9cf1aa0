"""Joint covariances of a few poses of a long graph, against the inverse of all of it."""

from __future__ import annotations

import numpy as np

from pilotage.stack.mapping.slam.chains import BlockSystem, without_chains
from pilotage.stack.mapping.slam.uncertainty import Edges, jacobians, joint_covariance


def graph(rng: np.random.Generator, count: int) -> tuple[Edges, np.ndarray]:
    """A path of poses with three loops, one of its edges twice and one of them backwards."""
    poses = np.cumsum(rng.normal(0.0, 0.5, (count, 3)), axis=0)
    pairs = [(k, k + 1) for k in range(count - 1)] + [(3, 2), (0, count - 4), (5, count // 2), (5, count - 9)]
    i, j = np.array(pairs).T
    roots = rng.normal(0.0, 1.0, (len(pairs), 3, 3))
    information = roots @ roots.transpose(0, 2, 1) + np.eye(3)
    return Edges(i, j, rng.normal(0.0, 1.0, (len(pairs), 3)), information, i > j), poses


def test_joint_covariance_is_the_inverse_of_the_whole_system() -> None:
    rng = np.random.default_rng(0)
    edges, poses = graph(rng, 60)
    weights = rng.uniform(0.2, 1.0, len(edges))
    first, second = jacobians(poses[edges.i], poses[edges.j], edges.relative[:, 2])
    system = np.zeros((180, 180))
    system[:3, :3] += 1e9 * np.eye(3)
    for k, (i, j) in enumerate(zip(edges.i.tolist(), edges.j.tolist(), strict=True)):
        rows = np.zeros((3, 180))
        rows[:, 3 * i : 3 * i + 3], rows[:, 3 * j : 3 * j + 3] = first[k], second[k]
        system += weights[k] * rows.T @ edges.information[k] @ rows
    chosen = np.array([0, 5, 17, 30, 59])
    at = (3 * chosen[:, None] + np.arange(3)).ravel()
    expected = np.linalg.inv(system)[np.ix_(at, at)]
    found = joint_covariance(edges, poses, weights, chosen).among(np.arange(chosen.size))
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-9 * np.abs(expected).max())


def test_only_poses_at_loops_and_chosen_ones_stay() -> None:
    edges, poses = graph(np.random.default_rng(1), 60)
    blocks = np.tile(0.1 * np.eye(3), (len(edges), 1, 1))
    whole = BlockSystem.merged(np.tile(5.0 * np.eye(3), (len(poses), 1, 1)), edges.i, edges.j, blocks)
    kept = np.zeros(60, np.bool_)
    kept[[20, 40]] = True
    left, stays = without_chains(whole, kept)
    assert {20, 40} <= set(stays.tolist()) <= {0, 5, 20, 30, 40, 51, 56}
    assert left.i.max() < stays.size > left.j.max()
