"""Scans carried between frames: points with their lines, poses one after the other."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.jit import kernel


@kernel
def carried(points: FloatArray, pose: FloatArray) -> FloatArray:
    """Points (K, 6) of ``scan_lines`` seen from the frame in which their own has the pose (3,)."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    out = np.empty(points.shape)
    for k in range(points.shape[0]):
        for a in range(0, 6, 2):
            x, y = points[k, a], points[k, a + 1]
            out[k, a] = c * x - s * y
            out[k, a + 1] = s * x + c * y
        out[k, 0] += pose[0]
        out[k, 1] += pose[1]
        out[k, 4] += pose[0]
        out[k, 5] += pose[1]
    return out


@kernel
def between(a: FloatArray, b: FloatArray) -> FloatArray:
    """Pose (3,) of b in the frame of a; the heading wraps to [-pi, pi)."""
    c, s = math.cos(a[2]), math.sin(a[2])
    dx, dy = b[0] - a[0], b[1] - a[1]
    turn = b[2] - a[2]
    turn -= 2.0 * math.pi * math.floor(turn / (2.0 * math.pi) + 0.5)
    return np.array([c * dx + s * dy, -s * dx + c * dy, turn])


@kernel
def composed(a: FloatArray, b: FloatArray) -> FloatArray:
    """Pose (3,) that has b in the frame of a; the heading wraps to [-pi, pi)."""
    c, s = math.cos(a[2]), math.sin(a[2])
    theta = a[2] + b[2]
    theta -= 2.0 * math.pi * math.floor(theta / (2.0 * math.pi) + 0.5)
    return np.array([a[0] + c * b[0] - s * b[1], a[1] + s * b[0] + c * b[1], theta])


@kernel
def between_all(a: FloatArray, poses: FloatArray) -> FloatArray:
    """(N, 3) poses in the frame of a (3,)."""
    out = np.empty(poses.shape)
    for k in range(poses.shape[0]):
        out[k] = between(a, poses[k])
    return out


@kernel
def composed_all(poses: FloatArray, b: FloatArray) -> FloatArray:
    """(N, 3) poses that have b (3,) in the frames of ``poses`` (N, 3)."""
    out = np.empty(poses.shape)
    for k in range(poses.shape[0]):
        out[k] = composed(poses[k], b)
    return out


@kernel
def placed_all(a: FloatArray, poses: FloatArray) -> FloatArray:
    """(N, 3) poses that are ``poses`` (N, 3) in the frame of a (3,): the inverse of ``between_all``."""
    out = np.empty(poses.shape)
    for k in range(poses.shape[0]):
        out[k] = composed(a, poses[k])
    return out


@kernel
def gathered(
    points: FloatArray, starts: IntArray, chosen: IntArray, poses: FloatArray, frame: FloatArray
) -> FloatArray:
    """Points of several scans in one frame.

    Parameters
    ----------
    points, starts
        (K, 6) of all scans one after the other, and (S + 1,) where each begins.
    chosen
        (C,) indices of the scans.
    poses
        (S, 3) of all scans.
    frame
        (3,) pose of the frame that is asked for.
    """
    total = 0
    for i in chosen:
        total += starts[i + 1] - starts[i]
    out = np.empty((total, 6))
    at = 0
    for i in chosen:
        n = starts[i + 1] - starts[i]
        out[at : at + n] = carried(points[starts[i] : starts[i + 1]], between(frame, poses[i]))
        at += n
    return out
