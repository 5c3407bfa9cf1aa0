"""Motions between the scans of a recording by its odometry, and the readings they are counted from."""

from __future__ import annotations

import numpy as np

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.jit import kernel
from pilotage.kernels.slam.frames import between, between_all
from pilotage.kernels.slam.placing import distance
from pilotage.kernels.slam.track import Recording
from pilotage.kernels.slam.wheels import Wheels, righted

OTHER_READING_M = 0.08
"""Readings of the odometry nearer together (a radian as half a metre) are one guess."""


@kernel
def motion_of(recording: Recording, scan: int, wheels: Wheels) -> tuple[FloatArray, FloatArray]:
    """Motion (3,) by the odometry since the last scan, righted, and what else (M, 3) it may be."""
    if recording.at_scans.shape[0] == 0:
        return np.zeros(3), np.zeros((0, 3))
    first, end = recording.starts[scan], recording.starts[scan + 1]
    step = righted(wheels, between(recording.anchor, recording.at_scans[scan]))
    others = between_all(recording.anchor, recording.others[first:end])
    for k in range(others.shape[0]):
        others[k] = righted(wheels, others[k])
    return step, others


@kernel
def move_anchor(
    recording: Recording, scan: int, step: FloatArray, others: FloatArray, motion: FloatArray
) -> None:
    """Count the next motion from the reading of ``motion_of`` that the one of a scan (3,) was nearest to.

    Loggers stamp what they receive, in bursts, and late: that need not be the reading at the stamp.
    """
    if recording.at_scans.shape[0] == 0:
        return
    usual = distance(step, motion)
    best, least = -1, 0.5 * usual
    for k in range(others.shape[0]):
        apart = distance(others[k], motion)
        if usual > OTHER_READING_M and apart < least:
            best, least = k, apart
    recording.anchor[:] = (
        recording.at_scans[scan] if best < 0 else recording.others[recording.starts[scan] + best]
    )
