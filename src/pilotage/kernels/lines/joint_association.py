"""Joint compatibility branch and bound: all lines of a scan against all walls at once."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.filters.ekf import joseph_update2
from pilotage.kernels.filters.wall_line import innovation_distance, wall_innovation
from pilotage.kernels.jit import kernel
from pilotage.kernels.lines.wall_candidates import MatchRules, SeenLines, Walls, in_sight, overlap_share

UNMATCHED = -1
AMBIGUOUS = -2
MAX_TIES = 64
"""Hypotheses kept beside the best one; a scan with more of them is hopelessly ambiguous."""


@kernel
def associate(
    pose: FloatArray,
    cov: FloatArray,
    seen: SeenLines,
    known: Walls,
    rules: MatchRules,
    options: IntArray,
    counts: IntArray,
    pairs: IntArray,
) -> float:
    """Fill ``pairs`` (L,) with a wall's index, ``UNMATCHED`` or ``AMBIGUOUS``; returns the joint distance.

    Neira & Tardos 2001: among the hypotheses whose joint squared Mahalanobis distance passes the gate
    for their size, that with most pairs, then with the least distance. The
    joint distance grows by the innovation of each next pair given those before it, that is by one Kalman
    update of a trial state a node. At a leaf each pair must overlap its wall and be in sight from the
    trial pose, which is far better known than the prior; pairs that do not are struck out. A line that
    another hypothesis as large and within the margin of the best distance explains otherwise is ambiguous.
    Where the nodes or the room for ties were not enough, nothing is proven unique: all pairs are
    ambiguous then, and nan is returned.
    """
    mount, lines, covs, walls = seen.mount, seen.lines, seen.covs, known.normals
    joint_gates, margin, max_nodes = rules.joint_gates, rules.margin, rules.nodes
    n = lines.shape[0]
    pairs[:] = UNMATCHED
    order = np.empty(n, dtype=np.int64)
    depth_count = 0
    # The fewest options first: they prune most.
    for wanted in range(1, options.shape[1] + 1):
        for i in range(n):
            if counts[i] == wanted:
                order[depth_count] = i
                depth_count += 1
    if depth_count == 0:
        return 0.0
    poses = np.empty((depth_count + 1, 3))
    trials = np.empty((depth_count + 1, 3, 3))
    distances = np.zeros(depth_count + 1)
    made = np.zeros(depth_count + 1, dtype=np.int64)
    choice = np.zeros(depth_count + 1, dtype=np.int64)
    current = np.full(n, UNMATCHED)
    held = np.full(n, UNMATCHED)
    ties = np.empty((MAX_TIES, n), dtype=np.int64)
    tie_distance = np.empty(MAX_TIES)
    tie_count = 0
    best_size, best_distance = 0, math.inf
    poses[0], trials[0] = pose, cov
    z, H, v = np.empty(2), np.empty((2, 3)), np.empty(2)
    depth, nodes = 0, 0
    while depth >= 0:
        if depth == depth_count:
            held[:] = current
            size = _verify(poses[depth], trials[depth], seen, known, rules, held)
            distance = distances[depth]
            if size > best_size:
                tie_count = 0
            if size > best_size or (size == best_size and distance < best_distance):
                best_size, best_distance = size, distance
                pairs[:] = held
            if size == best_size and distance <= best_distance + margin and tie_count < MAX_TIES:
                ties[tie_count] = held
                tie_distance[tie_count] = distance
                tie_count += 1
            depth -= 1
            continue
        i = order[depth]
        option = choice[depth]
        left = depth_count - depth - 1
        if option > counts[i] or nodes >= max_nodes:
            choice[depth] = 0
            current[i] = UNMATCHED
            depth -= 1
            continue
        choice[depth] += 1
        nodes += 1
        if option == counts[i]:  # leave this line out
            if made[depth] + left < best_size:
                continue
            current[i] = UNMATCHED
            poses[depth + 1], trials[depth + 1] = poses[depth], trials[depth]
            distances[depth + 1], made[depth + 1] = distances[depth], made[depth]
            depth += 1
            continue
        if made[depth] + 1 + left < best_size:
            continue
        wall = options[i, option]
        poses[depth + 1], trials[depth + 1] = poses[depth], trials[depth]
        wall_innovation(poses[depth], mount, walls[wall], lines[i], z, H, v)
        added = joseph_update2(poses[depth + 1], trials[depth + 1], H, v, covs[i], math.inf)
        joint = distances[depth] + added
        if not joint <= joint_gates[made[depth] + 1]:
            continue
        current[i] = wall
        distances[depth + 1], made[depth + 1] = joint, made[depth] + 1
        depth += 1
    for k in range(tie_count):
        if tie_distance[k] <= best_distance + margin:
            for i in range(n):
                if pairs[i] >= 0 and ties[k, i] != pairs[i]:
                    pairs[i] = AMBIGUOUS
    if nodes >= max_nodes or tie_count == MAX_TIES:
        for i in range(n):
            if pairs[i] >= 0:
                pairs[i] = AMBIGUOUS
        return math.nan
    return best_distance


@kernel
def _verify(
    pose: FloatArray, cov: FloatArray, seen: SeenLines, known: Walls, rules: MatchRules, held: IntArray
) -> int:
    """Strike out the pairs that do not hold from the pose that a hypothesis implies; returns how many do."""
    mount, ends, segments = seen.mount, seen.ends, known.segments
    size = 0
    for i in range(ends.shape[0]):
        w = held[i]
        if w < 0:
            continue
        alpha = known.normals[w, 1]
        share = overlap_share(pose, cov, mount, ends[i], alpha, segments[w], rules.slack, rules.sigmas)
        if share >= rules.least_overlap and in_sight(pose, mount, ends[i], w, known):
            size += 1
        else:
            held[i] = UNMATCHED
    return size


@kernel
def update_walls(
    pose: FloatArray,
    cov: FloatArray,
    mount: FloatArray,
    lines: FloatArray,
    covs: FloatArray,
    walls: FloatArray,
    pairs: IntArray,
    nis: FloatArray,
) -> float:
    """Update in place by every paired line, in Joseph form; returns the joint distance of the update.

    Lines of one scan share no beam, so their errors are independent and one after the other is jointly.
    ``nis`` (L,) is filled with what each line added, nan where it was not paired.
    """
    z, H, v = np.empty(2), np.empty((2, 3)), np.empty(2)
    total = 0.0
    for i in range(lines.shape[0]):
        nis[i] = math.nan
        if pairs[i] < 0:
            continue
        wall_innovation(pose, mount, walls[pairs[i]], lines[i], z, H, v)
        nis[i] = joseph_update2(pose, cov, H, v, covs[i], math.inf)
        total += nis[i]
    return total


@kernel
def tally(pairs: IntArray, distances: FloatArray) -> tuple[int, int, float]:
    """Of lines (L,): how many are paired, how many lie beside a wall that is not ambiguous, and the largest
    distance of a paired one, 0 without any."""
    paired = placed = 0
    largest = 0.0
    for i in range(pairs.shape[0]):
        if pairs[i] >= 0:
            paired += 1
            largest = max(largest, distances[i])
        if math.isfinite(distances[i]) and pairs[i] != AMBIGUOUS:
            placed += 1
    return paired, placed, largest


@kernel
def pair_distances(
    pose: FloatArray,
    cov: FloatArray,
    mount: FloatArray,
    lines: FloatArray,
    covs: FloatArray,
    walls: FloatArray,
    pairs: IntArray,
    out: FloatArray,
) -> None:
    """Fill ``out`` (L,) with the squared Mahalanobis distance of each paired line to its own wall, taken
    alone; what is not paired keeps what it had."""
    z, H, v = np.empty(2), np.empty((2, 3)), np.empty(2)
    for i in range(lines.shape[0]):
        if pairs[i] >= 0:
            wall_innovation(pose, mount, walls[pairs[i]], lines[i], z, H, v)
            out[i] = innovation_distance(cov, H, v, covs[i])
