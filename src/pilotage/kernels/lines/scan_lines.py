"""The lines of one laser scan: its points, their clusters, and the lines of each."""

from __future__ import annotations

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.jit import kernel
from pilotage.kernels.lines.clustering import scan_clusters, scan_points
from pilotage.kernels.lines.extraction import LineRules, extract_lines


@kernel
def lines_of_scan(
    ranges: FloatArray,
    directions: FloatArray,
    step: float,
    max_range: float,
    cutoff: float,
    least_cluster: int,
    rules: LineRules,
    uniforms: FloatArray,
    most_lines: int,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, IntArray, IntArray]:
    """Lines of a scan (N,) with beams along directions (N, 2), ``step`` apart; ``most_lines`` at most.

    The rules may be handed over ``unnamed``.

    Returns
    -------
    lines, covs, ends, points, clusters, members
        As ``extraction.extract_lines`` fills them, (L, 2), (L, 2, 2), (L, 4) and (N,); in between the points
        (N, 2) and their clusters (N,) as of ``clustering``.
    """
    points = scan_points(ranges, directions)
    clusters = scan_clusters(ranges, points, step, max_range, cutoff, least_cluster)
    lines, covs = np.empty((most_lines, 2)), np.empty((most_lines, 2, 2))
    ends, members = np.empty((most_lines, 4)), np.empty(ranges.shape[0], np.int64)
    rule = LineRules(*rules)
    count = extract_lines(points, directions, clusters, rule, uniforms, lines, covs, ends, members)
    return lines[:count], covs[:count], ends[:count], points, clusters, members
