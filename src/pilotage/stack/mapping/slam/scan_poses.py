"""Poses of all scans from those of the keyframes."""

from __future__ import annotations

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.kernels.slam.frames import between, composed
from pilotage.stack.mapping.slam.tracker import LocalTrack
from pilotage.stack.mapping.slam.uncertainty import relative_poses


def scan_poses(track: LocalTrack, keyframe_poses: FloatArray) -> FloatArray:
    """(N, 3) poses of all scans: the front end's motions hung between the keyframes around each.

    What the keyframes ahead were moved by is handed out along the way to them, by the share of the path.
    """
    count = track.poses.shape[0]
    out = np.empty((count, 3))
    moved = relative_poses(track.poses[:-1], track.poses[1:])
    path = np.concatenate([[0.0], np.cumsum(np.hypot(moved[:, 0], moved[:, 1]) + 0.3 * np.abs(moved[:, 2]))])
    last = track.keyframes.size - 1
    for i in range(count):
        k = int(track.owner[i])
        here = composed(keyframe_poses[k], between(track.poses[track.keyframes[k]], track.poses[i]))
        if k < last:
            a, b = int(track.keyframes[k]), int(track.keyframes[k + 1])
            share = (path[i] - path[a]) / max(path[b] - path[a], 1e-9)
            there = composed(keyframe_poses[k + 1], between(track.poses[b], track.poses[i]))
            turn = (there[2] - here[2] + np.pi) % (2.0 * np.pi) - np.pi
            here = np.array(
                [
                    here[0] + share * (there[0] - here[0]),
                    here[1] + share * (there[1] - here[1]),
                    (here[2] + share * turn + np.pi) % (2.0 * np.pi) - np.pi,
                ]
            )
        out[i] = here
    return out
