"""Recordings of which a scan a metre is left, as benchmarks hand them on, with wheels that are off."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from pilotage.core.types import FloatArray
from pilotage.kernels.slam.frames import between, composed
from pilotage.logs.laser_log import LaserLog
from pilotage.stack.mapping.slam.config import SlamConfig
from pilotage.stack.mapping.slam.mapper import map_log
from support.laser_rooms import along, recording, room

STEP_M, TURN_RAD, SCAN_S = 1.0, 0.5, 3.6
DRIVE = [
    (1.0, 1.0),
    (29.0, 1.0),
    (29.0, 19.0),
    (1.0, 19.0),
    (1.0, 1.0),
    (10.5, 1.0),
    (10.5, 6.0),
    (10.5, 1.0),
]
DRIVE += [(20.5, 1.0), (20.5, 6.0), (20.5, 1.0), (29.0, 1.0), (29.0, 9.5), (22.0, 10.0)]


def office() -> FloatArray:
    """A ring of corridors around rooms, with pilasters at odd distances."""
    walls = [*room(0.0, 0.0, 30.0, 20.0), (2, 2, 10, 2), (11, 2, 20, 2), (21, 2, 28, 2), (28, 2, 28, 9)]
    walls += [(28, 10, 28, 18), (28, 18, 16, 18), (15, 18, 2, 18), (2, 18, 2, 11), (2, 10, 2, 2)]
    walls += [(10, 2, 10, 8), (20, 2, 20, 8), (2, 8, 28, 8), (15, 18, 15, 12), (2, 12, 28, 12)]
    walls += [(5, 4, 6, 4), (6, 4, 6, 5.5), (13, 3.5, 13.8, 4.4), (23, 5, 25, 5), (24, 14, 25, 16)]
    walls += [(6, 15, 7.5, 15), (18, 14, 19.5, 14.5)]
    walls += [(x, 0.0, x, 0.25) for x in (4.0, 8.2, 12.6, 17.2, 22.0, 27.0)]
    walls += [(30.0, y, 29.75, y) for y in (3.0, 6.4, 10.2, 14.4, 19.0)]
    walls += [(x, 20.0, x, 19.7) for x in (3.0, 8.0, 13.0, 18.0, 23.0)]
    return np.array(walls, np.float64)


def thinned(path: FloatArray) -> FloatArray:
    """Poses a metre or half a radian apart."""
    kept = [path[0]]
    for pose in path[1:]:
        away = between(kept[-1], pose)
        if np.hypot(away[0], away[1]) >= STEP_M or abs(away[2]) >= TURN_RAD:
            kept.append(pose)
    return np.array(kept)


def drive(seed: int, covered: tuple[int, ...] = ()) -> tuple[LaserLog, FloatArray]:
    """The recording, with some scans that saw nothing, and where it was made."""
    path, rng = thinned(along(DRIVE)), np.random.default_rng(seed)
    log = recording(office(), path, rng, range_std_m=0.02)
    told = [np.zeros(3)]
    for before, pose in pairwise(path):
        step = between(before, pose)
        step = step * (1.03, 1.0, 1.1) + rng.standard_normal(3) * (0.04, 0.02, 0.1)
        told.append(np.asarray(composed(told[-1], step)))
    ranges_m = log.ranges_m.copy()
    ranges_m[list(covered)] = np.nan
    t_s: FloatArray = SCAN_S * np.arange(len(path), dtype=np.float64)
    return replace(log, ranges_m=ranges_m, t_s=t_s, odometry_t_s=t_s, odometry=np.array(told)), path


@pytest.mark.parametrize(("seed", "covered"), [(0, ()), (1, ()), (2, (40, 90))])
def test_a_scan_a_metre_is_enough(seed: int, covered: tuple[int, ...]) -> None:
    log, path = drive(seed, covered)
    result = map_log(log, SlamConfig(calibrate_beam_spacing=False))
    true = np.array([between(path[0], pose) for pose in path])
    off = np.hypot(*(result.poses - true)[:, :2].T)
    assert np.sqrt(np.mean(off**2)) < 0.4
    assert off.max() < 1.0
