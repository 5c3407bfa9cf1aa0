"""Levenberg-Marquardt on a planar pose graph: damped normal equations, steps judged by their gain.

Damping is a multiple of the matrix's diagonal; it follows the gain ratio as in Madsen, Nielsen and Tingleff,
"Methods for non-linear least squares problems", 2004. It starts small enough for Gauss-Newton's steps.
"""

from __future__ import annotations

import numpy as np

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.jit import kernel
from pilotage.kernels.slam.block_cholesky import factorize, solve_lower, solve_upper
from pilotage.kernels.slam.edges import Doubts, Edges, Pattern, normal_equations, objective, squared_errors

CONVERGED, OUT_OF_ITERATIONS, STALLED, NOT_FINITE = 0, 1, 2, 3
FIRST_DAMPING = 1e-9
LEAST_DAMPING = 1e-15
MOST_DAMPING = 1e8
GROWTH = 10.0
LEAST_DIAGONAL = 1e-6
"""Share of the largest diagonal entry that damping lifts lesser ones to: a pose without information stays."""
NEGLIGIBLE = 1e-12
"""An objective is a sum of squares of standard deviations: this much of it is nothing."""


@kernel
def levenberg_marquardt(
    poses: FloatArray,
    edges: Edges,
    doubts: Doubts,
    pattern: Pattern,
    tolerance: float,
    most_iterations: int,
) -> tuple[FloatArray, float, int, int]:
    """Minimize the objective from ``poses`` (N, 3).

    ``tolerance`` is the share of the objective that a step may still promise when the search ends.

    Returns
    -------
    Poses, objective, iterations (factorizations), and a status.
    """
    column, column_start, rows = pattern.column, pattern.column_start, pattern.rows
    n = column_start.size - 1
    diagonal, below = np.empty((n, 9)), np.empty((rows.size, 9))
    factor_diagonal, factor_below = np.empty((n, 9)), np.empty((rows.size, 9))
    right, step, trial = np.empty((n, 3)), np.empty((n, 3)), poses.copy()
    poses = poses.copy()
    value = objective(squared_errors(poses, edges), doubts)
    if not np.isfinite(value):
        return poses, value, 0, NOT_FINITE
    if n == 0 or value <= NEGLIGIBLE:
        return poses, value, 0, CONVERGED
    damping, growth, fresh = FIRST_DAMPING, GROWTH, True
    for iteration in range(1, most_iterations + 1):
        if fresh:
            normal_equations(poses, edges, doubts, pattern, diagonal, below, right)
        factor_diagonal[:], factor_below[:] = diagonal, below
        least = LEAST_DIAGONAL * diagonal.max()
        for k in range(n):
            for r in (0, 4, 8):
                factor_diagonal[k, r] += damping * max(diagonal[k, r], least)
        gained = False
        if factorize(column_start, rows, factor_diagonal, factor_below) == n:
            step[:] = right
            solve_lower(column_start, rows, factor_diagonal, factor_below, step)
            solve_upper(column_start, rows, factor_diagonal, factor_below, step)
            promised = 0.0
            for k in range(n):
                for r in range(3):
                    promised += (
                        0.5
                        * step[k, r]
                        * (right[k, r] + damping * max(diagonal[k, 4 * r], least) * step[k, r])
                    )
            for p in range(poses.shape[0]):
                if column[p] >= 0:
                    for r in range(3):
                        trial[p, r] = poses[p, r] + step[column[p], r]
            new = objective(squared_errors(trial, edges), doubts)
            gained = new < value
            ended = promised <= tolerance * value + NEGLIGIBLE
            gain = (value - new) / max(promised, 1e-300)
            if gained:
                poses[:] = trial
                value = new
            if ended:
                return poses, value, iteration, CONVERGED
        fresh = gained
        if gained:
            damping = max(damping * max(1.0 / GROWTH, 1.0 - (2.0 * gain - 1.0) ** 3), LEAST_DAMPING)
            growth = GROWTH
        else:
            damping *= growth
            growth *= 2.0
            if damping > MOST_DAMPING:
                return poses, value, iteration, STALLED
    return poses, value, most_iterations, OUT_OF_ITERATIONS
