"""Ground where nothing known is in sight: the odometry carries the track, as sure as it was before."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.kernels.slam.frames import between
from pilotage.logs.laser_log import LaserLog
from pilotage.stack.mapping.slam.clouds import cloud_of
from pilotage.stack.mapping.slam.config import SlamConfig
from pilotage.stack.mapping.slam.mapper import map_log
from pilotage.stack.mapping.slam.odometry import scanner_odometry
from pilotage.stack.mapping.slam.online import OnlineSlam
from pilotage.stack.mapping.slam.tracker import track
from support.laser_rooms import along, furnished, recording, room

REACH_M = 3.5
OUT = [(2.0, 1.0), (2.0, 4.0), (4.0, 2.0), (2.0, 2.0), (5.0, 2.5), (16.0, 2.5), (18.0, 4.0), (17.0, 2.0)]


def two_houses() -> FloatArray:
    """Corners of two houses with 10 m of nothing between them."""
    west, east = room(0.0, 0.0, 4.6, 5.0), room(15.0, 0.0, 20.0, 5.0)
    return np.array([*west[2:], west[0], *east[:3], (1.0, 2.6, 1.8, 2.6), (18.0, 0.5, 18.6, 1.4)])


def short_sighted(walls: FloatArray, path: FloatArray, seed: int) -> LaserLog:
    """A recording by a laser of 3.5 m."""
    log = recording(walls, path, np.random.default_rng(seed))
    return replace(log, ranges_m=np.where(log.ranges_m < REACH_M, log.ranges_m, np.inf), range_max_m=REACH_M)


def test_a_track_over_ground_without_walls_hangs_by_the_odometry_and_does_not_break() -> None:
    """A laser of 3.5 m had the track break after three scans that saw nothing; what came then was a guess."""
    path = along([*OUT, *OUT[-2:3:-1], (2.0, 2.0), (2.0, 4.0), (3.5, 4.0)])
    log = short_sighted(two_houses(), path, 3)
    seen = np.isfinite(log.ranges_m).sum(axis=1)
    assert (seen == 0).sum() > 60
    result = map_log(log, SlamConfig())
    assert not any("the track breaks" in text for text in result.warnings)
    true = np.array([between(path[0], pose) for pose in path])
    assert np.hypot(*(result.poses - true)[:, :2].T).max() < 0.35


def test_who_sees_nothing_is_not_lost_and_says_how_unsure_it_is() -> None:
    path = along(OUT)
    log = short_sighted(two_houses(), path, 5)
    odometry = scanner_odometry(log, True)
    assert odometry is not None
    slam, stds, errors = OnlineSlam(SlamConfig()), [], []
    for i in range(len(log)):
        slam.add(cloud_of(log, i, 25.0), between(odometry[max(0, i - 1)], odometry[i]), 0.2)
        assert not slam.lost
        stds.append(np.sqrt(np.linalg.eigvalsh(slam.pose_covariance[:2, :2])[-1]))
        errors.append(np.hypot(*(slam.pose - between(path[0], path[i]))[:2]))
    blind = np.flatnonzero(np.isfinite(log.ranges_m).sum(axis=1) == 0)
    assert stds[blind[-1]] > stds[blind[0]] + 0.03
    assert max(stds) < 2.0
    assert (np.array(errors) < 4.0 * np.array(stds) + 0.05).all()


def test_a_covered_scanner_beside_known_walls_is_no_unknown_ground() -> None:
    """Walls would be in sight: who may have been carried meanwhile is not taken to have driven."""
    log = recording(furnished(), along([(1.5, 1.2), (5.0, 1.2), (5.0, 4.0)]), np.random.default_rng(7))
    log.ranges_m[40:52] = np.nan
    covered = track(log, SlamConfig())
    before = int(np.searchsorted(covered.keyframes, 40))
    # Whether it is found again at once or not: nobody knows how far it came meanwhile.
    assert np.sqrt(covered.slips[before : before + 6, 0, 0]).max() > 0.04
