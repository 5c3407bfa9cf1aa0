"""The smoother's factors: Jacobians against central differences, odometry against its own gradient."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from pilotage.kernels.filters.arrow_solve import no_arrow
from pilotage.kernels.sheet import graph as sheet_graph

POSES = st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(-3.0, 3.0))


def _checked(residual: Callable[..., float], pose: Any, seen: np.ndarray, line: np.ndarray) -> None:
    jacobian, scratch = np.empty(5), np.empty(5)
    residual(*pose, seen, line, jacobian)

    def at(values: np.ndarray) -> float:
        moved = line.copy()
        moved[:2] = values[3:]
        return residual(values[0], values[1], values[2], seen, moved, scratch)

    centre = np.array([*pose, line[0], line[1]])
    for k in range(5):
        step = np.zeros(5)
        step[k] = 1e-6
        expected = (at(centre + step) - at(centre - step)) / 2e-6
        assert math.isclose(jacobian[k], expected, rel_tol=1e-4, abs_tol=1e-6)


@given(POSES, st.floats(-0.9, 0.9), st.floats(0.3, 2.0))
def test_the_beams_jacobian(pose: tuple[float, float, float], aside: float, away: float) -> None:
    beam = np.array([0.05, -0.03, math.cos(0.4), math.sin(0.4), 0.2])
    # A wall that the beam meets under less than 60 degrees.
    towards = pose[2] + 0.4 + aside
    angle = towards + math.pi
    line = np.array([angle, 0.01, pose[0] + away * math.cos(towards), pose[1] + away * math.sin(towards)])
    _checked(sheet_graph.beam_residual, pose, beam, line)


@given(POSES, st.floats(-3.0, 3.0))
def test_the_crossings_jacobian(pose: tuple[float, float, float], angle: float) -> None:
    _checked(sheet_graph.crossing_residual, pose, np.array([0.07, 0.02]), np.array([angle, 0.02, 0.3, -0.2]))


def test_a_beam_along_a_wall_says_nothing() -> None:
    jacobian = np.ones(5)
    beam, line = np.array([0.0, 0.0, 1.0, 0.0, 0.2]), np.array([0.5 * math.pi, 0.0, 0.0, 0.5])
    assert sheet_graph.beam_residual(0.0, 0.0, 0.0, beam, line, jacobian) == 0.0
    assert not jacobian.any()


def test_odometrys_right_hand_side_is_minus_its_gradient() -> None:
    rng = np.random.default_rng(3)
    n, shared = 4, 4
    poses, systematic = 0.3 * rng.normal(size=(n, 4)), 0.1 * rng.normal(size=4)
    steps, spreads = 0.3 * rng.normal(size=(n, 6)), rng.uniform(0.5, 1.5, size=(n, 5))
    steps[:, 5] = 0.3

    def built(poses: np.ndarray, systematic: np.ndarray) -> tuple[np.ndarray, ...]:
        arrow = no_arrow(n, 4, shared)
        sheet_graph.add_odometry(poses, systematic, steps, spreads, n, arrow)
        return arrow

    def cost(values: np.ndarray) -> float:
        p, s = values[: 4 * n].reshape(n, 4), values[4 * n :]
        total = 0.0
        for i in range(n - 1):
            c, sn = math.cos(p[i, 2]), math.sin(p[i, 2])
            d, turn = p[i + 1] - p[i], p[i + 1, 2] - p[i, 2]
            residuals = (
                c * d[0] + sn * d[1] - (1 + s[3]) * steps[i, 0],
                c * d[1] - sn * d[0] - (1 + s[3]) * steps[i, 1],
                turn - (1 + s[1]) * steps[i, 2] - s[2] * steps[i, 3],
                turn - (1 + s[0]) * (steps[i, 4] - p[i, 3] * steps[i, 5]),
                d[3],
            )
            total += sum(0.5 * (r / w) ** 2 for r, w in zip(residuals, spreads[i], strict=True))
        return total

    right = np.concatenate([built(poses, systematic)[4].ravel(), built(poses, systematic)[5]])
    centre = np.concatenate([poses.ravel(), systematic])
    for k in range(centre.size):
        step = np.zeros(centre.size)
        step[k] = 1e-6
        gradient = (cost(centre + step) - cost(centre - step)) / 2e-6
        assert math.isclose(-right[k], gradient, rel_tol=1e-4, abs_tol=1e-6)
