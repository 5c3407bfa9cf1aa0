"""The most probable poses of a pose graph, and how sure they are."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from pilotage.core.angles import wrap_array_to_pi
from pilotage.core.errors import InputError
from pilotage.core.types import BoolArray, FloatArray
from pilotage.kernels.slam import edges as kinds
from pilotage.kernels.slam import levenberg_marquardt as lm
from pilotage.kernels.slam.block_cholesky import pattern_places
from pilotage.kernels.slam.edges import objective, squared_errors
from pilotage.kernels.slam.initial_poses import chordal_poses
from pilotage.kernels.slam.ordering import adjacency, minimum_degree
from pilotage.models.pose_graph import PoseGraph, first_of_components


class Loss(StrEnum):
    """How an edge's squared error counts (``kernels.slam.edges.robust``)."""

    SQUARE = "square"
    HUBER = "huber"
    CAUCHY = "cauchy"
    GEMAN_MCCLURE = "geman-mcclure"
    DCS = "dcs"


class Start(StrEnum):
    """Where the search begins: at the poses given, at the chordal ones, or at the better of both."""

    GIVEN = "given"
    CHORDAL = "chordal"
    BETTER = "better"


class SolverStatus(StrEnum):
    """How the search ended."""

    CONVERGED = "converged"
    OUT_OF_ITERATIONS = "out of iterations"
    STALLED = "no step lowers the objective"
    NOT_FINITE = "the objective is not finite"


KERNEL_LOSS = {
    Loss.SQUARE: kinds.SQUARE,
    Loss.HUBER: kinds.HUBER,
    Loss.CAUCHY: kinds.CAUCHY,
    Loss.GEMAN_MCCLURE: kinds.GEMAN_MCCLURE,
    Loss.DCS: kinds.DCS,
}
STATUS = {
    lm.CONVERGED: SolverStatus.CONVERGED,
    lm.OUT_OF_ITERATIONS: SolverStatus.OUT_OF_ITERATIONS,
    lm.STALLED: SolverStatus.STALLED,
    lm.NOT_FINITE: SolverStatus.NOT_FINITE,
}


@dataclass(frozen=True, slots=True)
class PoseGraphSolution:
    """The result of a search.

    Attributes
    ----------
    graph
        The graph with the poses found, headings in [-pi, pi).
    status
        How the search ended.
    objective
        Half the sum of the losses of the squared errors.
    iterations
        Factorizations of the normal equations.
    squared_errors
        (M,) of the edges.
    weights
        (M,) what the loss lets each edge count, 1 where it is not doubted.
    """

    graph: PoseGraph
    status: SolverStatus
    objective: float
    iterations: int
    squared_errors: FloatArray
    weights: FloatArray


def eliminate(graph: PoseGraph, fixed: BoolArray) -> kinds.Pattern:
    """Find an order of elimination with little fill, and the factor's pattern."""
    free = np.flatnonzero(~fixed)
    variable = np.full(len(graph), -1, dtype=np.int64)
    variable[free] = np.arange(free.size)
    i, j = variable[graph.i], variable[graph.j]
    order, column_start, rows = minimum_degree(*adjacency(free.size, i, j))
    places, turned = pattern_places(order, column_start, rows, i, j)
    column = np.full(len(graph), -1, dtype=np.int64)
    column[free[order]] = np.arange(free.size)
    return kinds.Pattern(column, column_start, rows, places, turned)


def optimize(
    graph: PoseGraph,
    *,
    loss: Loss = Loss.SQUARE,
    scale: float = 1.0,
    doubted: BoolArray | None = None,
    fixed: BoolArray | None = None,
    start: Start = Start.BETTER,
    tolerance: float = 1e-9,
    most_iterations: int = 200,
) -> PoseGraphSolution:
    """Find the poses of least objective.

    Parameters
    ----------
    loss, scale
        Robust loss of the doubted edges, and where it begins to doubt, in standard deviations.
    doubted
        (M,) edges that may be wrong, such as loop closures; by default all.
    fixed
        (N,) poses that stay; by default the first of each connected component.
    start
        Chordal start values know nothing of the loss: with many wrong edges give good poses.
    tolerance
        Share of the objective that the last step may still have promised.

    Raises
    ------
    InputError
        Where arrays do not fit the graph, or a component has no fixed pose.
    """
    fixed = check_fixed(graph, fixed)
    doubted = (
        np.ones(graph.i.size, dtype=np.bool_) if doubted is None else np.asarray(doubted, dtype=np.bool_)
    )
    if doubted.shape != graph.i.shape:
        raise InputError(f"optimize: expected doubted of shape {graph.i.shape}, found {doubted.shape}")
    if not (scale > 0.0 and tolerance > 0.0 and most_iterations > 0):
        raise InputError("optimize: expected scale, tolerance and most_iterations above 0")
    if loss is Loss.SQUARE:
        doubted = np.zeros_like(doubted)
    pattern, edges = eliminate(graph, fixed), graph.edges
    doubts = kinds.Doubts(KERNEL_LOSS[loss], float(scale), doubted)
    poses = graph.poses
    if start is not Start.GIVEN:
        chordal, solved = chordal_poses(poses, edges, pattern)
        if solved and (
            start is Start.CHORDAL
            or objective(squared_errors(chordal, edges), doubts)
            < objective(squared_errors(poses, edges), doubts)
        ):
            poses = chordal
    poses, value, iterations, status = lm.levenberg_marquardt(
        poses, edges, doubts, pattern, float(tolerance), int(most_iterations)
    )
    poses[:, 2] = wrap_array_to_pi(poses[:, 2])
    squares = squared_errors(poses, edges)
    return PoseGraphSolution(
        replace(graph, poses=poses),
        STATUS[status],
        float(value),
        int(iterations),
        squares,
        kinds.weights(squares, doubts),
    )


def check_fixed(graph: PoseGraph, fixed: BoolArray | None) -> BoolArray:
    """Return which poses are fixed; InputError where a component has none."""
    if len(graph) == 0:
        raise InputError("pose graph: expected at least one pose, found none")
    if fixed is None:
        return first_of_components(graph)
    fixed = np.asarray(fixed, dtype=np.bool_)
    if fixed.shape != (len(graph),):
        raise InputError(f"pose graph: expected fixed of shape {(len(graph),)}, found {fixed.shape}")
    component = graph.components()
    loose = ~np.isin(component, component[fixed])
    if loose.any():
        raise InputError(
            f"pose graph: expected a fixed pose in every connected part, found none in that of pose "
            f"{int(np.flatnonzero(loose)[0])}"
        )
    return fixed
