"""The lines of a scan matched to walls: candidates of each, then all of them jointly."""

from __future__ import annotations

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.jit import kernel
from pilotage.kernels.lines.joint_association import associate, tally
from pilotage.kernels.lines.wall_candidates import MatchRules, SeenLines, Walls, candidates


@kernel
def match_lines(
    pose: FloatArray, cov: FloatArray, seen: SeenLines, known: Walls, rules: MatchRules
) -> tuple[IntArray, FloatArray, int, int, float]:
    """The wall of each line (L,), what ``candidates`` says of its distance (L,), and their ``tally``.

    The last three may be handed over ``unnamed``.
    """
    lines, walls, rule = SeenLines(*seen), Walls(*known), MatchRules(*rules)
    count = lines.lines.shape[0]
    options, distances = np.empty((count, rule.options), np.int64), np.empty(count)
    counts = candidates(pose, cov, lines, walls, rule, options, distances)
    pairs = np.empty(count, np.int64)
    associate(pose, cov, lines, walls, rule, options, counts, pairs)
    paired, placed, largest = tally(pairs, distances)
    return pairs, distances, paired, placed, largest
