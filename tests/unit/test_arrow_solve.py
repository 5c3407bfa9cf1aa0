"""The arrow-shaped solver against dense algebra."""

from __future__ import annotations

import numpy as np
import pytest

from pilotage.kernels.filters import arrow_solve


def _arrow(blocks: int, shared: int, seed: int) -> tuple[np.ndarray, ...]:
    """Parts and whole of a random positive definite arrow."""
    rng = np.random.default_rng(seed)
    m = 4
    size = m * blocks + shared
    whole = np.zeros((size, size))
    for i in range(blocks):
        # Rows that touch a block, the next and the shared unknowns, as factors of a graph do.
        columns = np.concatenate(
            [np.arange(m * i, min(m * (i + 2), m * blocks)), np.arange(m * blocks, size)]
        )
        rows = rng.normal(size=(8, columns.size))
        whole[np.ix_(columns, columns)] += rows.T @ rows
    whole += 0.1 * np.eye(size)
    right = rng.normal(size=size)
    diagonal = np.stack([whole[m * i : m * i + m, m * i : m * i + m] for i in range(blocks)])
    coupling = np.zeros((blocks, m, m))
    for i in range(blocks - 1):
        coupling[i] = whole[m * i : m * i + m, m * i + m : m * i + 2 * m]
    border = np.stack([whole[m * i : m * i + m, m * blocks :] for i in range(blocks)])
    corner = whole[m * blocks :, m * blocks :].copy()
    return (
        whole,
        right,
        diagonal,
        coupling,
        border,
        corner,
        right[: m * blocks].reshape(blocks, m).copy(),
        right[m * blocks :].copy(),
    )


@pytest.mark.parametrize(("blocks", "shared"), [(1, 1), (2, 3), (17, 6), (40, 20)])
def test_solution_and_last_covariance_are_those_of_dense_algebra(blocks: int, shared: int) -> None:
    whole, right, diagonal, coupling, border, corner, own, rest = _arrow(blocks, shared, blocks)
    arrow = arrow_solve.Arrow(diagonal, coupling, border, corner, own, rest)
    status = arrow_solve.solve_arrow(arrow)
    assert status == arrow_solve.SOLVED
    expected = np.linalg.solve(whole, right)
    np.testing.assert_allclose(np.concatenate([own.ravel(), rest]), expected, rtol=1e-8, atol=1e-10)
    cov = arrow_solve.last_block_cov(arrow)
    last = slice(4 * blocks - 4, 4 * blocks)
    np.testing.assert_allclose(cov, np.linalg.inv(whole)[last, last], rtol=1e-8, atol=1e-10)


def test_a_singular_matrix_is_told() -> None:
    arrow = arrow_solve.Arrow(*_arrow(3, 2, 0)[2:])
    arrow.diagonal[1] = 0.0
    assert arrow_solve.solve_arrow(arrow) == arrow_solve.NOT_POSITIVE
