"""The pose graph's solver against dense algebra, known graphs and what must not be accepted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import least_squares

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.kernels.slam.block_cholesky import factorize, pattern_places, solve_lower, solve_upper
from pilotage.kernels.slam.edges import (
    CAUCHY,
    DCS,
    GEMAN_MCCLURE,
    HUBER,
    SQUARE,
    edge_error,
    edge_jacobian,
    robust,
)
from pilotage.kernels.slam.frames import composed
from pilotage.kernels.slam.ordering import adjacency, minimum_degree
from pilotage.models.pose_graph import PoseGraph
from pilotage.models.pose_graph_covariance import covariances, relative_jacobians
from pilotage.models.pose_graph_solver import Loss, SolverStatus, Start, optimize


def seen_from(first: FloatArray, second: FloatArray) -> FloatArray:
    """``second`` (K, 3) as seen from ``first``."""
    c, s = np.cos(first[:, 2]), np.sin(first[:, 2])
    d = second - first
    return np.column_stack([c * d[:, 0] + s * d[:, 1], -s * d[:, 0] + c * d[:, 1], d[:, 2]])


def moved(poses: FloatArray, v: FloatArray) -> FloatArray:
    """``poses`` (K, 3) followed by the exponential of ``v`` (K, 3)."""
    phi = v[:, 2]
    a, b = np.sinc(phi / np.pi), 0.5 * phi * np.sinc(0.5 * phi / np.pi) ** 2  # sin(x)/x, (1 - cos(x))/x
    x, y = a * v[:, 0] - b * v[:, 1], b * v[:, 0] + a * v[:, 1]
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    return poses + np.column_stack([c * x - s * y, s * x + c * y, phi])


def drive(
    seed: int, poses: int = 60, closures: int = 40, noise: float = 0.05
) -> tuple[PoseGraph, FloatArray]:
    """A random walk with loop closures between any two poses; returns the graph and the truth."""
    rng = np.random.default_rng(seed)
    truth = np.zeros((poses, 3))
    for k in range(1, poses):
        theta = truth[k - 1, 2]
        truth[k] = truth[k - 1] + [np.cos(theta), np.sin(theta), rng.normal(0.0, 0.6)]
    i = np.concatenate([np.arange(poses - 1), rng.integers(0, poses, closures)])
    j = np.concatenate([np.arange(1, poses), rng.integers(0, poses, closures)])
    kept = i != j
    i, j = i[kept], j[kept]
    factors = rng.normal(size=(i.size, 3, 3))
    information = factors @ factors.transpose(0, 2, 1) + 0.5 * np.eye(3)
    errors = noise * np.linalg.solve(
        np.linalg.cholesky(information).transpose(0, 2, 1), rng.normal(size=(i.size, 3, 1))
    )
    z = moved(seen_from(truth[i], truth[j]), -errors[:, :, 0])
    start = truth + rng.normal(0.0, 0.1, truth.shape)
    start[0] = truth[0]
    return PoseGraph(start, i, j, z, information / noise**2), truth


def dense_residuals(graph: PoseGraph, poses: FloatArray) -> FloatArray:
    """Whitened errors (3 M,), by the kernel's error but without its normal equations."""
    roots = np.linalg.cholesky(graph.information)
    out = np.empty((graph.i.size, 3))
    for k in range(graph.i.size):
        edge_error(poses[graph.i[k]], poses[graph.j[k]], graph.measurements[k], out[k])
    return np.asarray(np.einsum("kba,kb->ka", roots, out).ravel())


@given(st.integers(1, 40), st.integers(0, 120), st.integers(0, 2**32 - 1))
@settings(max_examples=60, deadline=None)
def test_the_pattern_holds_every_fill_and_the_factor_solves(n: int, m: int, seed: int) -> None:
    """Against dense algebra on random graphs, unconnected and with edges to fixed poses too."""
    rng = np.random.default_rng(seed)
    i, j = rng.integers(-1, n, m), rng.integers(-1, n, m)
    order, column_start, rows = minimum_degree(*adjacency(n, i, j))
    assert sorted(order.tolist()) == list(range(n))
    full = 0.1 * np.eye(3 * n)
    for a, b in zip(i, j, strict=True):
        left = np.zeros((3, 3 * n))
        if a >= 0:
            left[:, 3 * a : 3 * a + 3] = rng.normal(size=(3, 3))
        if b >= 0:
            left[:, 3 * b : 3 * b + 3] += rng.normal(size=(3, 3))
        full += left.T @ left
    blocks = full.reshape(n, 3, n, 3).transpose(0, 2, 1, 3)[np.ix_(order, order)]
    diagonal = np.array([blocks[k, k].ravel() for k in range(n)])
    below = np.zeros((rows.size, 9))
    for column in range(n):
        own = rows[column_start[column] : column_start[column + 1]]
        assert (np.diff(own) > 0).all()
        assert (own > column).all()
        below[column_start[column] : column_start[column + 1]] = blocks[own, column].reshape(-1, 9)
        others = np.setdiff1d(np.arange(column + 1, n), own)
        assert not blocks[others, column].any()
    right = rng.normal(size=(n, 3))
    x = right.copy()
    assert factorize(column_start, rows, diagonal, below) == n
    solve_lower(column_start, rows, diagonal, below, x)
    solve_upper(column_start, rows, diagonal, below, x)
    permuted = blocks.transpose(0, 2, 1, 3).reshape(3 * n, 3 * n)
    np.testing.assert_allclose(permuted @ x.ravel(), right.ravel(), rtol=1e-7, atol=1e-7)
    places, turned = pattern_places(order, column_start, rows, i, j)
    rank = np.argsort(order)
    for k in np.flatnonzero(places >= 0):
        row, column = (i[k], j[k]) if turned[k] else (j[k], i[k])
        assert rows[places[k]] == rank[row] > rank[column]
        assert column_start[rank[column]] <= places[k] < column_start[rank[column] + 1]


def test_a_ring_is_ordered_without_more_fill_than_it_needs() -> None:
    n = 50
    i = np.arange(n)
    _, _, rows = minimum_degree(*adjacency(n, i, (i + 1) % n))
    assert rows.size == 2 * n - 3


@pytest.mark.parametrize("loops", [[], [(0, 1000), (100, 1100)]])
def test_a_path_is_eliminated_all_along_its_length(loops: list[tuple[int, int]]) -> None:
    """From its end on a column would be as far from the root of the tree as the path is long."""
    n = 3000
    i, j = np.ascontiguousarray(np.array([(k, k + 1) for k in range(n - 1)] + loops).T)
    _, column_start, rows = minimum_degree(*adjacency(n, i, j))
    depth = np.zeros(n, np.int64)
    for c in range(n - 2, -1, -1):
        depth[c] = depth[rows[column_start[c]]] + 1
    assert depth.max() < 2.0 * np.log2(n)
    assert rows.size < 2 * n


def test_a_matrix_that_is_not_positive_is_told() -> None:
    none = np.empty(0, np.int64)
    diagonal = np.array([np.eye(3).ravel(), -np.eye(3).ravel()])
    assert factorize(np.zeros(3, np.int64), none, diagonal, np.empty((0, 9))) == -2


pose = st.tuples(*[st.floats(-3.0, 3.0)] * 3).map(np.array)


@given(pose, pose, pose)
@settings(max_examples=200, deadline=None)
def test_jacobians_of_an_edge(a: FloatArray, b: FloatArray, z: FloatArray) -> None:
    error = np.empty(3)
    edge_error(a, b, z, error)
    if abs(abs(error[2]) - np.pi) < 1e-3:
        return  # there it jumps
    first, second = np.empty((3, 3)), np.empty((3, 3))
    edge_jacobian(a, b, z, first, second)
    step = 1e-6
    for k, shift in enumerate(step * np.eye(3)):
        for one, found in ((a, first), (b, second)):
            ahead, behind = np.empty(3), np.empty(3)
            on_a, on_b = (shift, 0.0 * shift) if one is a else (0.0 * shift, shift)
            edge_error(a + on_a, b + on_b, z, ahead)
            edge_error(a - on_a, b - on_b, z, behind)
            np.testing.assert_allclose(found[:, k], (ahead - behind) / (2 * step), atol=2e-4, rtol=1e-5)


@pytest.mark.parametrize("kind", [SQUARE, HUBER, CAUCHY, GEMAN_MCCLURE, DCS])
@given(square=st.floats(0.0, 1e4), scale=st.floats(0.3, 5.0))
@settings(max_examples=50, deadline=None)
def test_slopes_of_the_losses(kind: int, square: float, scale: float) -> None:
    step = 1e-5 * (1.0 + square)
    ahead, slope = robust(kind, scale, square + step)[0], robust(kind, scale, square)[1]
    behind = robust(kind, scale, max(square - step, 0.0))[0]
    width = square + step - max(square - step, 0.0)
    assert 0.0 <= slope <= 1.0
    assert (ahead - behind) / width == pytest.approx(slope, abs=1e-3 + 10 * step / scale**2)
    assert robust(kind, scale, square)[0] <= square + 1e-9


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("start", list(Start))
def test_the_optimum_of_random_graphs(seed: int, start: Start) -> None:
    """Against scipy's dense solver, which begins at the truth; the gradient vanishes."""
    graph, truth = drive(seed, poses=16, closures=12)
    found = optimize(graph, start=start)
    assert found.status is SolverStatus.CONVERGED

    def residuals(free: FloatArray) -> FloatArray:
        return dense_residuals(graph, np.vstack([truth[:1], free.reshape(-1, 3)]))

    reference = least_squares(residuals, truth[1:].ravel(), xtol=1e-14, ftol=1e-14, gtol=1e-12)
    assert found.objective == pytest.approx(reference.cost, rel=1e-7)
    assert found.objective == pytest.approx(0.5 * found.graph.squared_errors().sum(), rel=1e-12)
    shift = found.graph.poses[1:] - reference.x.reshape(-1, 3)
    shift[:, 2] = np.angle(np.exp(1j * shift[:, 2]))
    assert np.abs(shift).max() < 1e-4


def test_covariances_are_those_of_the_dense_inverse() -> None:
    graph = optimize(drive(3)[0]).graph
    n = len(graph)
    jacobian = np.zeros((3 * graph.i.size, 3 * n))
    roots = np.linalg.cholesky(graph.information)
    first, second = np.empty((3, 3)), np.empty((3, 3))
    for k in range(graph.i.size):
        a, b = graph.i[k], graph.j[k]
        edge_jacobian(graph.poses[a], graph.poses[b], graph.measurements[k], first, second)
        jacobian[3 * k : 3 * k + 3, 3 * a : 3 * a + 3] = roots[k].T @ first
        jacobian[3 * k : 3 * k + 3, 3 * b : 3 * b + 3] = roots[k].T @ second
    full = np.zeros((3 * n, 3 * n))
    full[3:, 3:] = np.linalg.inv(jacobian[:, 3:].T @ jacobian[:, 3:])
    found = covariances(graph)
    expected = np.array([full[3 * k : 3 * k + 3, 3 * k : 3 * k + 3] for k in range(n)])
    np.testing.assert_allclose(found.marginals(), expected, rtol=1e-6, atol=1e-12)
    chosen = np.array([40, 0, 7, 59, 7])
    places = (3 * chosen[:, None] + np.arange(3)).ravel()
    joint = found.joint(chosen)
    among = joint.among(np.arange(chosen.size))
    np.testing.assert_allclose(among, full[np.ix_(places, places)], rtol=1e-6, atol=1e-12)
    i, j = np.array([0, 5, 5, 17, 30, 9]), np.array([4, 0, 40, 17, 12, 59])
    by_i, by_j = relative_jacobians(graph.poses[i], graph.poses[j])
    for k in range(i.size):
        whole = np.zeros((3, 3 * n))
        whole[:, 3 * i[k] : 3 * i[k] + 3] += by_i[k]
        whole[:, 3 * j[k] : 3 * j[k] + 3] += by_j[k]
        np.testing.assert_allclose(found.relative(i, j)[k], whole @ full @ whole.T, rtol=1e-6, atol=1e-12)
    a, b = np.array([0, 1, 3, 2]), np.array([2, 3, 0, 4])
    expected = found.relative(chosen[a], chosen[b])
    np.testing.assert_allclose(joint.relative(a, b), expected, rtol=1e-9, atol=1e-15)


def test_how_poses_follow_what_is_measured() -> None:
    """As solved anew, to first order."""
    graph, _ = drive(3, poses=20, closures=6, noise=1e-3)
    found = optimize(graph, start=Start.GIVEN, tolerance=1e-14).graph
    changed = 1e-5 * np.random.default_rng(4).standard_normal((graph.i.size, 3))
    moved = np.array([composed(m, c) for m, c in zip(graph.measurements, changed, strict=True)])
    again = optimize(replace(found, measurements=moved), start=Start.GIVEN, tolerance=1e-14).graph
    expected = covariances(found).moved_by(changed, graph.information)
    np.testing.assert_allclose(again.poses - found.poses, expected, atol=2e-7)
    assert np.abs(expected).max() > 1e-5


def test_relative_jacobians() -> None:
    rng = np.random.default_rng(1)
    a, b = rng.normal(size=(2, 20, 3))
    by_a, by_b = relative_jacobians(a, b)
    for k, shift in enumerate(1e-6 * np.eye(3)):
        np.testing.assert_allclose(
            by_a[:, :, k], (seen_from(a + shift, b) - seen_from(a - shift, b)) / 2e-6, atol=1e-8
        )
        np.testing.assert_allclose(
            by_b[:, :, k], (seen_from(a, b + shift) - seen_from(a, b - shift)) / 2e-6, atol=1e-8
        )


def test_covariances_say_how_far_the_truth_is() -> None:
    """NEES over 300 graphs: 3 degrees of freedom each; a mean off by chance in 1 of 10^6 tests."""
    squares = []
    for seed in range(300):
        graph, truth = drive(seed, poses=12, closures=8, noise=0.02)
        found = optimize(graph, start=Start.GIVEN).graph
        error = found.poses[-1] - truth[-1]
        error[2] = np.angle(np.exp(1j * error[2]))
        covariance = covariances(found).marginals(np.array([len(found) - 1]))[0]
        squares.append(error @ np.linalg.solve(covariance, error))
    assert np.mean(squares) == pytest.approx(3.0, abs=4.9 * np.sqrt(6.0 / 300))


@pytest.mark.parametrize("loss", [Loss.CAUCHY, Loss.GEMAN_MCCLURE, Loss.DCS])
def test_robust_losses_pass_over_wrong_closures(loss: Loss) -> None:
    graph, truth = drive(7, poses=80, closures=40)
    rng = np.random.default_rng(0)
    closures = np.arange(graph.i.size) >= 79
    wrong = np.flatnonzero(closures)[::10]
    z = graph.measurements.copy()
    z[wrong] += rng.normal(0.0, 4.0, (wrong.size, 3))
    spoilt = PoseGraph(graph.poses, graph.i, graph.j, z, graph.information)
    found = optimize(spoilt, loss=loss, scale=2.0, doubted=closures, start=Start.GIVEN)
    plain = optimize(spoilt, start=Start.GIVEN)
    right = np.setdiff1d(np.arange(graph.i.size), wrong)
    best = optimize(
        PoseGraph(truth, graph.i[right], graph.j[right], z[right], graph.information[right]),
        start=Start.GIVEN,
    )
    robust_error = np.abs(found.graph.poses - best.graph.poses)[:, :2].max()
    assert 5.0 * robust_error < np.abs(plain.graph.poses - best.graph.poses)[:, :2].max()
    assert found.weights[wrong].max() < 0.1
    assert (found.weights[~closures] == 1.0).all()


def test_parts_are_anchored_each_on_its_own() -> None:
    graph, _ = drive(2, poses=20, closures=5)
    twice = PoseGraph(
        np.vstack([graph.poses, graph.poses, [[9.0, 9.0, 1.0]]]),
        np.concatenate([graph.i, graph.i + 20]),
        np.concatenate([graph.j, graph.j + 20]),
        np.vstack([graph.measurements] * 2),
        np.concatenate([graph.information] * 2),
    )
    found = optimize(twice)
    one = optimize(graph)
    assert found.objective == pytest.approx(2.0 * one.objective, rel=1e-9)
    np.testing.assert_allclose(found.graph.poses[20:40], found.graph.poses[:20], atol=1e-6)
    assert found.graph.poses[40].tolist() == [9.0, 9.0, 1.0]
    assert not covariances(found.graph).marginals(np.array([0, 20, 40])).any()


def test_the_same_graph_gives_the_same_bits() -> None:
    graph, _ = drive(11)
    poses = graph.poses.copy()
    assert optimize(graph).graph.poses.tobytes() == optimize(graph).graph.poses.tobytes()
    assert graph.poses.tobytes() == poses.tobytes()


def test_a_graph_without_errors_or_edges() -> None:
    none = np.empty(0, np.int64)
    alone = PoseGraph(np.zeros((1, 3)), none, none, np.empty((0, 3)), np.empty((0, 3, 3)))
    assert optimize(alone).status is SolverStatus.CONVERGED
    pair = PoseGraph(
        np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.5]]),
        np.array([0]),
        np.array([1]),
        np.array([[1.0, 0.0, 0.5]]),
        np.eye(3)[None],
    )
    assert optimize(pair).objective < 1e-20


def test_what_is_no_graph_is_refused() -> None:
    good = drive(0, poses=5, closures=0)[0]
    p, i, j, z, w = good.poses, good.i, good.j, good.measurements, good.information
    nan = z.copy()
    nan[0, 0] = np.nan
    cases = [
        ((p, i, j, nan, w), "finite measurements"),
        ((p, i, j, z[:2], w), "shape"),
        ((p, i, i, z, w), "two poses"),
        ((p, i, j + 9, z, w), "expected poses 0 to 4"),
        ((p, i, j, z, -w), "semi-definite"),
        ((p * 1e12, i, j, z, w), "within"),
    ]
    for arrays, words in cases:
        with pytest.raises(InputError, match=words):
            PoseGraph(*arrays)
    with pytest.raises(InputError, match="fixed pose in every connected part"):
        optimize(good, fixed=np.zeros(5, dtype=np.bool_))
    with pytest.raises(InputError, match="shape"):
        optimize(good, doubted=np.ones(2, dtype=np.bool_))
    with pytest.raises(InputError, match="loose"):
        covariances(good, weights=np.zeros(i.size))
    with pytest.raises(InputError, match="expected poses 0 to 4"):
        covariances(good).marginals(np.array([5]))


def test_a_pose_of_which_no_edge_tells_stays_and_the_others_are_found() -> None:
    graph, _ = drive(4, poses=10, closures=5)
    information = graph.information.copy()
    last = (graph.i == 9) | (graph.j == 9)
    information[last] = 0.0
    loose = PoseGraph(graph.poses, graph.i, graph.j, graph.measurements, information)
    found = optimize(loose, start=Start.GIVEN)
    assert found.status is SolverStatus.CONVERGED
    assert found.graph.poses[9].tolist() == graph.poses[9].tolist()
    without = PoseGraph(
        graph.poses[:9], graph.i[~last], graph.j[~last], graph.measurements[~last], information[~last]
    )
    assert found.objective == pytest.approx(optimize(without).objective, rel=1e-9)
