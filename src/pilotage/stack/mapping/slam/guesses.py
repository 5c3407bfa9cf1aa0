"""What is unsure about scans that fit nowhere, and hang by a guess."""

from __future__ import annotations

import numpy as np

from pilotage.core.types import FloatArray

BREAK_SLIP = np.diag([0.2, 0.2, 0.3]) ** 2
BLIND_BREAK_SLIP = np.diag([0.5, 0.5, 0.8]) ** 2
HEALED_SLIP = np.diag([0.05, 0.05, 0.02]) ** 2
GUESS_SLIP = np.diag([0.05, 0.05, 0.05]) ** 2
"""Covariances where the track broke, with odometry and without, where it was joined again, and what each
scan adds that hangs by the odometry alone."""
GUESSED_SCANS = 3
"""So many scans in a row may hang by the odometry alone before the track breaks,"""
FAR_M, FAR_RAD = 0.5, 0.4
"""and none that is so far from the one before: the next would see still less of the last keyframe's walls."""


def is_far(motion: FloatArray) -> bool:
    """Whether scans are so far apart that one alone leads out of what the last keyframe saw."""
    return bool(np.hypot(motion[0], motion[1]) > FAR_M) or abs(float(motion[2])) > FAR_RAD
