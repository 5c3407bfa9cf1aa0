"""Buildings made to look alike: a ring of equal corridors with niches at a regular spacing."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from pilotage.core.types import FloatArray
from pilotage.kernels.slam.frames import between
from pilotage.kernels.slam.match_grid import scores_of
from pilotage.stack.mapping.slam.closures import Verdict, judged_alone
from pilotage.stack.mapping.slam.clouds import Clouds, cloud_of_beams
from pilotage.stack.mapping.slam.config import SlamConfig
from pilotage.stack.mapping.slam.mapper import map_log
from pilotage.stack.mapping.slam.matching import laid, match
from pilotage.stack.mapping.slam.submaps import LEVELS, Submaps, drawn
from support.laser_rooms import along, ranges, recording

WIDTH_M = 2.0


def niches(
    start: FloatArray, end: FloatArray, outward: FloatArray, spacing_m: float, depth_m: float
) -> list[list[float]]:
    """A wall from start to end with niches at a regular spacing."""
    length = float(np.hypot(*(end - start)))
    course = (end - start) / length
    corners = [start]
    for k in range(int(length / spacing_m)):
        first, last = (start + course * spacing_m * (k + share) for share in (0.35, 0.6))
        corners += [first, first + depth_m * outward, last + depth_m * outward, last]
    corners.append(end)
    return [[*a, *b] for a, b in pairwise(corners)]


def ring(side_m: float, spacing_m: float) -> FloatArray:
    """Walls (W, 4) of a square ring of corridors, every side and every few metres like the next."""
    walls: list[list[float]] = []
    for margin, depth, sign in ((0.0, 0.8, 1.0), (WIDTH_M, 0.3, -1.0)):
        low, high = margin, side_m - margin
        corners = np.array([(low, low), (high, low), (high, high), (low, high)])
        for k in range(4):
            start, end = corners[k], corners[(k + 1) % 4]
            course = (end - start) / np.hypot(*(end - start))
            walls += niches(start, end, sign * np.array([course[1], -course[0]]), spacing_m, depth)
    return np.array(walls)


@pytest.mark.parametrize(("seed", "side_m", "spacing_m"), [(0, 12.0, 2.0), (1, 16.0, 2.0), (2, 12.0, 4.0)])
def test_nothing_is_closed_between_places_that_only_look_alike(
    seed: int, side_m: float, spacing_m: float
) -> None:
    middle, far = 0.5 * WIDTH_M, side_m - 0.5 * WIDTH_M
    loop = [(middle + 1.0, middle), (far, middle), (far, far), (middle, far), (middle, middle), (far, middle)]
    path = along([*loop, (far, 0.5 * side_m)])
    log = recording(ring(side_m, spacing_m), path, np.random.default_rng(seed), 0.015, 0.03)
    if seed == 2:
        log = replace(log, odometry=None, odometry_t_s=None)
    result = map_log(log, SlamConfig(calibrate_beam_spacing=False))
    accepted = [closure for closure in result.closures if closure.verdict is Verdict.ACCEPTED]
    assert accepted
    for closure in accepted:
        ends = (result.extents[k].reference for k in (closure.candidate.earlier, closure.candidate.later))
        a, b = (int(result.keyframes[k]) for k in ends)
        off = between(between(path[a], path[b]), closure.match.relative)
        assert np.hypot(off[0], off[1]) < 0.5
    true = np.array([between(path[0], pose) for pose in path])
    assert np.hypot(*(result.poses - true)[:, :2].T).max() < 0.15


def test_a_bare_corridor_is_matched_across_its_course_alone() -> None:
    walls = [(-30.0, -1.0, 30.0, -1.0), (-30.0, 1.0, 30.0, 1.0)]
    end = [(4.0, -1.0, 4.0, 1.0)]
    angles = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 361)
    poses = np.array([[0.5 * k, 0.0, 0.0] for k in range(3)])
    matches = []
    for seen in (walls, walls + end):
        clouds = [
            cloud_of_beams(ranges(np.array(seen), p, angles), angles, float(angles[1] - angles[0]), 8.0)
            for p in poses
        ]
        submaps = Submaps(SlamConfig())
        submaps.grow(Clouds.of([*clouds, *clouds]), np.concatenate([poses, poses]), np.array([3]))
        matches.append(match(submaps, 0, 1, np.array([0.3, 0.1, 0.02]), 1.0, 0.1))
    bare, held = matches
    np.testing.assert_allclose(np.abs(bare.course), [1.0, 0.0], atol=0.01)
    # Along the corridor the prediction stays and nothing is told; across it the walls do.
    np.testing.assert_allclose(bare.relative, [0.3, 0.0, 0.0], atol=0.01)
    assert abs(bare.hessian[0, 0]) < 1e-3 < bare.hessian[1, 1]
    assert judged_alone(bare, SlamConfig()) is Verdict.ACROSS
    assert not held.course.any()
    np.testing.assert_allclose(held.relative, [0.0, 0.0, 0.0], atol=0.01)


def test_an_alignment_that_slides_along_a_corridor_is_no_match() -> None:
    """The window does not hold the right place, and the alignment would go there all the same."""
    walls = np.array([(-9.0, -1.0, 4.0, -1.0), (-9.0, 1.0, 4.0, 1.0), (4.0, -1.0, 4.0, 1.0)])
    angles = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 361)
    cloud = cloud_of_beams(ranges(walls, np.zeros(3), angles), angles, float(angles[1] - angles[0]), 20.0)
    submap = drawn(Clouds.of([cloud]), np.zeros((1, 3)), np.array([0]), np.zeros(3), 0.1)
    scores = scores_of(submap.grid, LEVELS, submap.corner_xy_m, 0.1)
    right, _ = laid(submap, scores, submap, np.zeros(3), 0.1, 0.02)
    assert right.aligned
    slid, _ = laid(submap, scores, submap, np.array([0.4, 0.0, 0.0]), 0.1, 0.02)
    assert slid.score > 0.3
    assert not slid.aligned
