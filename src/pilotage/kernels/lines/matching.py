"""The lines of a scan matched to walls: candidates of each, then all of them jointly."""

from __future__ import annotations

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.jit import kernel
from pilotage.kernels.lines.joint_association import associate, tally
from pilotage.kernels.lines.wall_candidates import candidates


@kernel
def match_lines(
    pose: FloatArray,
    cov: FloatArray,
    mount: FloatArray,
    lines: FloatArray,
    covs: FloatArray,
    ends: FloatArray,
    walls: FloatArray,
    line_of: IntArray,
    segments: FloatArray,
    circles: FloatArray,
    gate: float,
    joint_gates: FloatArray,
    margin: float,
    slack: float,
    sigmas: float,
    least_overlap: float,
    most_options: int,
    max_nodes: int,
) -> tuple[IntArray, FloatArray, int, int, float]:
    """The wall of each line (L,), what ``candidates`` says of its distance (L,), and their ``tally``."""
    count = lines.shape[0]
    options, distances = np.empty((count, most_options), np.int64), np.empty(count)
    counts = candidates(
        pose,
        cov,
        mount,
        lines,
        covs,
        ends,
        walls,
        line_of,
        segments,
        gate,
        slack,
        sigmas,
        least_overlap,
        options,
        distances,
    )
    pairs = np.empty(count, np.int64)
    associate(
        pose,
        cov,
        mount,
        lines,
        covs,
        ends,
        walls,
        segments,
        circles,
        options,
        counts,
        joint_gates,
        margin,
        slack,
        sigmas,
        least_overlap,
        max_nodes,
        pairs,
    )
    paired, placed, largest = tally(pairs, distances)
    return pairs, distances, paired, placed, largest
