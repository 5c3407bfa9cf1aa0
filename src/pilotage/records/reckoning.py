"""Where a run's odometry alone would have the robot."""

from __future__ import annotations

import numpy as np

from pilotage.core.types import FloatArray, Pose2
from pilotage.logs.odometry_steps import arc_ends
from pilotage.records.trace import Trace

PARTS = ("odom_distance_m", "odom_angle_rad", "odom_lateral_m")


def odometry_increments(trace: Trace) -> FloatArray | None:
    """(N, 3) forward, turn and to the left since the row before; rows without a reading NaN.

    None where the trace has no odometry.
    """
    if not trace.has(*PARTS[:2]):
        return None
    steps = np.column_stack([trace[part] for part in PARTS])
    unread = ~np.isfinite(steps[:, :2]).all(axis=1)
    steps = np.nan_to_num(steps)
    steps[unread] = np.nan
    return steps


def reckoned(increments: FloatArray) -> FloatArray:
    """(N, 3) poses at the ends of increments, from the origin on: arcs, sideways where an axle moves so."""
    steps = np.nan_to_num(increments)
    moves = arc_ends(np.zeros((len(steps), 3)), steps[:, 0], steps[:, 1], steps[:, 2])
    here, poses = Pose2(0.0, 0.0, 0.0), np.empty((len(steps), 3))
    for k, move in enumerate(moves):
        here = here.compose(Pose2.from_array(move))
        poses[k] = here.as_array()
    return poses
