"""The benchmark's pose graphs: the known optimum from their own vertices; GTSAM as a referee."""

from __future__ import annotations

import numpy as np
import pytest

from pilotage.logs.g2o import read_g2o
from pilotage.models.pose_graph_covariance import covariances
from pilotage.models.pose_graph_solver import SolverStatus, Start, optimize
from support.recordings import recording

OPTIMA = {
    "manhattan": 1774.5205350308,
    "intel": 22.5021165439,
    "city10000": 255.9937252994,
    "CSAIL": 20.2754416720,
}
"""Half the sum of squares with GTSAM 4.3's Between factors, its relative tolerance at 1e-12."""


@pytest.mark.parametrize("start", list(Start))
@pytest.mark.parametrize("name", list(OPTIMA))
def test_the_known_optimum(name: str, start: Start) -> None:
    graph = read_g2o(recording(f"pose_graphs/{name}.g2o")).graph
    found = optimize(graph, start=start)
    assert found.status is SolverStatus.CONVERGED
    assert found.objective == pytest.approx(OPTIMA[name], rel=1e-9)
    assert found.iterations <= 10


@pytest.mark.parametrize("name", ["CSAIL", "intel"])
def test_gtsam_agrees_on_errors_and_covariances(name: str) -> None:
    gtsam = pytest.importorskip("gtsam")
    path = recording(f"pose_graphs/{name}.g2o")
    graph = optimize(read_g2o(path).graph).graph
    factors, _ = gtsam.readG2o(str(path), False)
    values = gtsam.Values()
    for k, pose in enumerate(graph.poses):
        values.insert(k, gtsam.Pose2(*pose))
    assert factors.error(values) == pytest.approx(0.5 * graph.squared_errors().sum(), rel=1e-9)
    prior = gtsam.noiseModel.Diagonal.Sigmas(np.full(3, 1e-7))
    factors.add(gtsam.PriorFactorPose2(0, values.atPose2(0), prior))
    referee = gtsam.Marginals(factors, values)
    picked = np.array([3, 200, len(graph) - 1])
    ours = covariances(graph).marginals(picked)
    for k, found in zip(picked, ours, strict=True):
        c, s = np.cos(graph.poses[k, 2]), np.sin(graph.poses[k, 2])
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])  # theirs stands in the pose's axes
        expected = turn @ referee.marginalCovariance(int(k)) @ turn.T
        np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-6 * np.abs(expected).max())
