"""Walls of a recorded map: rows of cells, some missing and some before the others."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pilotage.core.types import FloatArray, Pose2
from pilotage.kernels.filters.wall_line import wall_innovation
from pilotage.maps.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from pilotage.maps.outlines import outlines
from pilotage.maps.segment_map import SegmentMap
from pilotage.maps.wall_lines import WallLines
from pilotage.stack.localization.wall_matching import WallMatcher, WallMatchingConfig
from pilotage.stack.perception.lines import LineExtractionConfig
from support.walls import extractor, scan_of

MOUNT = np.zeros(3)
GAP_M = LineExtractionConfig().gap_m


def ragged_room(seed: int = 0) -> SegmentMap:
    """A room of 6 x 4 m in cells of 0.05 m; before its walls, two cells thick, stand single cells."""
    cells = np.full((80, 120), FREE, np.int8)
    cells[:2], cells[-2:], cells[:, :2], cells[:, -2:] = OCCUPIED, OCCUPIED, OCCUPIED, OCCUPIED
    rng = np.random.default_rng(seed)
    for row in (2, 77):
        cells[row, rng.random(120) < 0.2] = OCCUPIED
    for column in (2, 117):
        cells[rng.random(80) < 0.2, column] = OCCUPIED
    return SegmentMap.of(outlines(OccupancyGrid(cells, 0.05, Pose2(0.0, 0.0, 0.0))))


def test_pieces_on_one_line_with_less_than_a_gap_between_them_are_one_wall() -> None:
    pieces = np.array([[0, 1, 2, 1], [2.3, 1, 4, 1], [5, 1, 6, 1], [0, 0, 0, 1]], dtype=float)
    walls = WallLines.of(SegmentMap.of(pieces), 0.5)
    lengths = np.hypot(*(walls.segments_m[:, 2:] - walls.segments_m[:, :2]).T)
    assert sorted(lengths) == pytest.approx([1.0, 1.0, 4.0])
    assert sorted(np.bincount(walls.wall_of)) == [1, 1, 2]


def test_a_wall_is_seen_through_the_gap_in_another_one() -> None:
    """The farther wall, 2 m long, through a gap of 0.4 m that makes one wall of the nearer two."""
    world = SegmentMap.of(np.array([[-3, 1, -0.2, 1], [0.2, 1, 3, 1], [-1, 1.5, 1, 1.5]], dtype=float))
    seen = extractor().extract(scan_of(world, Pose2(0.0, 0.0, math.pi / 2), np.random.default_rng(0)))
    matcher = WallMatcher(WallMatchingConfig(), 0.999, world, MOUNT, GAP_M)
    pose = np.array([0.0, 0.0, math.pi / 2])
    walls = matcher.match(pose, np.diag([1e-4, 1e-4, 1e-5]), seen).walls
    found = {round(float(matcher.walls.normals[w, 0]), 3) for w in walls if w >= 0}
    assert found == {1.0, 1.5}


@pytest.mark.parametrize("seed", range(4))
def test_the_lines_of_a_ragged_wall_are_matched_from_a_vague_pose(seed: int) -> None:
    """No piece of such a wall is as long as the line that a scan has along it."""
    world, rng = ragged_room(seed), np.random.default_rng(seed)
    true = np.array([2.0 + 0.5 * seed, 1.5, 0.3 + seed])
    lines = extractor(seed).extract(scan_of(world, Pose2(*true), rng))
    matcher = WallMatcher(WallMatchingConfig(), 0.999, world, MOUNT, GAP_M)
    matches = matcher.match(true + np.array([0.08, -0.06, 0.04]), np.diag([0.01, 0.01, 0.01]), lines)
    assert matches.count >= 3


def test_lines_beside_teeth_are_off_by_their_noise_alone() -> None:
    """The foot of what stands before a wall is on one side of it, in every scan from there alike."""
    world = ragged_room()
    matcher = WallMatcher(WallMatchingConfig(), 0.999, world, MOUNT, GAP_M)
    distances: list[float] = []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        true: FloatArray = np.array([rng.uniform(0.5, 5.5), rng.uniform(0.5, 3.5), rng.uniform(-3.0, 3.0)])
        lines = extractor(seed).extract(scan_of(world, Pose2(*true), rng))
        walls = matcher.match(true, np.diag([1e-6, 1e-6, 1e-7]), lines).walls
        for i in np.flatnonzero(walls >= 0):
            z, H, v = np.empty(2), np.empty((2, 3)), np.empty(2)
            wall_innovation(true, MOUNT, matcher.walls.normals[walls[i]], lines.rho_alpha[i], z, H, v)
            distances.append(float(v @ np.linalg.solve(lines.covs[i], v)))
    assert len(distances) > 150
    assert np.mean(distances) < 2.3  # 2 is ideal
    assert np.mean(np.array(distances) > 13.8) < 0.005  # one in a thousand
