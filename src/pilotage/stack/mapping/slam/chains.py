"""Poses of a graph that only hand on what others know of each other, eliminated all at once."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pilotage.core.types import BoolArray, FloatArray, IntArray

MOST_ROUNDS = 60


@dataclass(frozen=True, slots=True)
class BlockSystem:
    """A symmetric positive definite system of 3 x 3 blocks.

    Attributes
    ----------
    diagonal
        (N, 3, 3).
    i, j, blocks
        (M,), (M,), (M, 3, 3) of the blocks in row ``i`` and column ``j``, ``i < j`` and each pair once.
    """

    diagonal: FloatArray
    i: IntArray
    j: IntArray
    blocks: FloatArray

    @staticmethod
    def merged(diagonal: FloatArray, i: IntArray, j: IntArray, blocks: FloatArray) -> BlockSystem:
        """Add up blocks of the same pair, in either order."""
        turned = i > j
        blocks = np.where(turned[:, None, None], blocks.transpose(0, 2, 1), blocks)
        i, j = np.where(turned, j, i), np.where(turned, i, j)
        pairs, at = np.unique(i * diagonal.shape[0] + j, return_inverse=True)
        out = np.zeros((pairs.size, 3, 3))
        np.add.at(out, at, blocks)
        return BlockSystem(diagonal, pairs // diagonal.shape[0], pairs % diagonal.shape[0], out)


def without_chains(system: BlockSystem, kept: BoolArray) -> tuple[BlockSystem, IntArray]:
    """Eliminate poses with at most two neighbours that are not to be kept (N,), exactly (Schur complement).

    Every other pose of a chain leaves in a round, all of them together, so that a chain of n is gone after
    about log n rounds.

    Returns
    -------
    The system of the poses that stay, and which these are (K,).
    """
    count = system.diagonal.shape[0]
    alive = np.ones(count, np.bool_)
    # Who leaves first of two neighbours: any order will do that is not that of the path.
    rank = (np.arange(count) * 2654435761) % 2**32
    for _ in range(MOST_ROUNDS):
        degree = np.bincount(system.i, minlength=count) + np.bincount(system.j, minlength=count)
        leaving = alive & ~kept & (degree <= 2)
        both = leaving[system.i] & leaving[system.j]
        i, j = system.i[both], system.j[both]
        leaving[np.where(rank[i] > rank[j], i, j)] = False
        if not leaving.any():
            break
        system = _without(system, leaving)
        alive &= ~leaving
    stays = np.flatnonzero(alive)
    at = np.searchsorted(stays, np.arange(count))
    return replace(system, diagonal=system.diagonal[stays], i=at[system.i], j=at[system.j]), stays


def _without(system: BlockSystem, leaving: BoolArray) -> BlockSystem:
    """Eliminate poses (N,) of which no two are neighbours, each with one neighbour or two."""
    by_second = leaving[system.j]
    touched = leaving[system.i] | by_second
    own = np.where(by_second, system.j, system.i)[touched]
    other = np.where(by_second, system.i, system.j)[touched]
    blocks = np.where(by_second[:, None, None], system.blocks.transpose(0, 2, 1), system.blocks)[touched]
    order = np.argsort(own, kind="stable")
    own, other, blocks = own[order], other[order], blocks[order]
    left = np.linalg.solve(system.diagonal[own], blocks)
    diagonal = system.diagonal.copy()
    np.subtract.at(diagonal, other, blocks.transpose(0, 2, 1) @ left)
    k = np.flatnonzero(own[1:] == own[:-1])
    across = -blocks[k].transpose(0, 2, 1) @ left[k + 1]
    return BlockSystem.merged(
        diagonal,
        np.concatenate([system.i[~touched], other[k]]),
        np.concatenate([system.j[~touched], other[k + 1]]),
        np.concatenate([system.blocks[~touched], across]),
    )
