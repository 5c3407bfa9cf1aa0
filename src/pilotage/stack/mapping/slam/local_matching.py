"""The front end: every scan aligned with the keyframes just before it.

Drift is all that is left to the graph. A guess of the motion starts the alignment; where none leads to a fit
as good as usual, the neighbourhood is searched by branch and bound.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from pilotage.core.types import FloatArray, IntArray
from pilotage.kernels.slam.align import TOO_FEW, align
from pilotage.kernels.slam.branch_bound import search_window
from pilotage.kernels.slam.buckets import sort_into_buckets
from pilotage.kernels.slam.frames import between, carried, composed
from pilotage.kernels.slam.match_grid import ScoreArray, max_pyramid, score_grid
from pilotage.logs.laser_log import LaserLog
from pilotage.stack.mapping.slam.clouds import Clouds, cloud_of
from pilotage.stack.mapping.slam.config import SlamConfig
from pilotage.stack.mapping.slam.odometry import MotionGuess, distance, scanner_odometry, smoothed_times

BUCKET_M = 0.25
START_REACH_M, REACH_M, SCALE_M = 0.4, 0.2, 0.05
PRIOR = np.diag([2.0, 2.0, 20.0])
"""Holds the pose at the guess where the scan leaves it open, in squared residuals. More would pull every
scan a little towards an odometry whose errors all have one sign."""
GOOD, POOR = 0.92, 0.75
"""Fit over its running mean from which no further guess is tried, and below which there is a search."""
SEARCH_RANGE_M, SEARCH_CELL_M, SEARCH_STD_M, SEARCH_STEP_RAD = 12.0, 0.05, 0.07, 0.02
SEARCH_BUDGET = 200_000
SEARCH_KEYFRAMES, SEARCH_LEVELS = 8, 4
BETTER_POOR, BETTER_GOOD = 1.1, 1.03
"""By how much a place that was searched must fit better than the guesses."""
OFF_M, OFF_ERRORS = 0.05, 10.0
"""A match this far from all guesses, and so many of their usual errors more, counts half."""
SLIP_SHARE, SLIP_M = 0.15, 0.4
"""A match as far as SLIP_M from its guess may be off by as much; a nearer one by that share and less."""

OnScan = Callable[[int], None]


@dataclass(frozen=True, slots=True)
class LocalTrack:
    """What the front end leaves.

    Attributes
    ----------
    poses
        (N, 3) of the scanner at each scan, in the frame of the first; drifting.
    keyframes
        (K,) scans that became keyframes, and ``owner`` (N,) the last keyframe of each scan.
    clouds
        Of the keyframes.
    hessians
        (K, 3, 3) of each keyframe's alignment with those before it, in ``poses``' frame.
    slips
        (K, 2) variances of position and heading since the keyframe before, by how far guesses and
        matches were apart.
    fits
        (N,) sum of weights of the aligned points over all points.
    searched, lost
        How many scans needed a search, and how many could not be aligned (their pose is the guess).
    """

    poses: FloatArray
    keyframes: IntArray
    owner: IntArray
    clouds: Clouds
    hessians: FloatArray
    slips: FloatArray
    fits: FloatArray
    searched: int
    lost: int


@dataclass(frozen=True, slots=True)
class _Fit:
    value: float
    pose: FloatArray
    hessian: FloatArray
    start: FloatArray
    off: float = 0.0


class LocalMatcher:
    """Aligns scans with the last keyframes, one after the other."""

    def __init__(self, config: SlamConfig) -> None:
        self._config = config
        self._guess = MotionGuess()
        self._local: list[FloatArray] = []
        self._usual = 0.6
        self._reference: tuple[FloatArray, IntArray, FloatArray] | None = None
        self._around: tuple[ScoreArray, int, FloatArray] | None = None
        self.searched = 0
        self.lost = 0

    def add_keyframe(self, cloud: FloatArray, pose: FloatArray) -> None:
        """Let a scan lend its points to those that follow."""
        self._local = [*self._local, carried(cloud, pose)][-self._config.local_keyframes :]
        box, starts, _, points = sort_into_buckets(np.concatenate(self._local), BUCKET_M)
        self._reference = box, starts, points
        self._around = None

    def match(
        self, cloud: FloatArray, last: FloatArray, step: FloatArray | None, dt_s: float, gap_s: float
    ) -> _Fit | None:
        """Align a scan; None where it cannot be.

        Parameters
        ----------
        last
            (3,) pose of the scan before.
        step
            (3,) motion since by the odometry, if there is any.
        dt_s, gap_s
            Smoothed and stamped time since.
        """
        best: _Fit | None = None
        credible = self._guess.credible(step, dt_s)
        for motion in self._guess.guesses(step, dt_s):
            fit = self._plausible(self._align(cloud, composed(last, motion), START_REACH_M), last, credible)
            if fit is not None and (best is None or fit.value > 1.03 * best.value + 0.005):
                best = fit
            if best is not None and best.value > GOOD * self._usual:
                break
        poor = best is None or best.value < POOR * self._usual
        if poor or step is None:
            # Without odometry a scan may slide along a corridor and still fit: look around every time.
            self.searched += 1
            around = self._search(cloud, last, min(max(dt_s, gap_s, 0.2), 2.0))
            found = self._plausible(around, last, credible)
            better = BETTER_POOR if poor else BETTER_GOOD
            if found is not None and (best is None or found.value > better * best.value + 0.01):
                best = found
        if best is None:
            self.lost += 1
            return None
        self._usual += 0.02 * (best.value - self._usual)
        self._guess.learn(step, between(last, best.pose), dt_s)
        return best

    def fallback(self, last: FloatArray, step: FloatArray | None, dt_s: float) -> FloatArray:
        """Pose by the most trusted guess alone."""
        return np.asarray(composed(last, self._guess.guesses(step, dt_s)[0]))

    def _plausible(self, fit: _Fit | None, last: FloatArray, guesses: list[FloatArray]) -> _Fit | None:
        """Lower a fit's value by how far it is from all credible guesses, in units of their usual error."""
        if fit is None:
            return None
        motion = between(last, fit.pose)
        off = min(distance(motion, guess) for guess in guesses)
        scale = OFF_M + OFF_ERRORS * self._guess.least_error
        return replace(fit, value=fit.value / (1.0 + (off / scale) ** 2), off=off)

    def _align(self, cloud: FloatArray, start: FloatArray, reach_m: float) -> _Fit | None:
        if self._reference is None or cloud.shape[0] == 0:
            return None
        pose, hessian, fit, status = align(
            cloud, start, PRIOR, reach_m, REACH_M, SCALE_M, 25, *self._reference
        )
        if status == TOO_FEW:
            return None
        pose[2] = (pose[2] + np.pi) % (2.0 * np.pi) - np.pi
        return _Fit(float(fit[1]) / cloud.shape[0], pose, hessian, start)

    def _search(self, cloud: FloatArray, last: FloatArray, gap_s: float) -> _Fit | None:
        """Search the neighbourhood of the last pose, the wider the longer ago it was."""
        near = cloud[np.hypot(cloud[:, 0], cloud[:, 1]) < SEARCH_RANGE_M]
        if self._around is None:
            self._around = self._surroundings(last)
        if self._around is None or near.shape[0] < 10:
            return None
        pyramid, margin, low = self._around
        turns = round((0.3 + 0.8 * gap_s) / SEARCH_STEP_RAD)
        best, _ = search_window(
            pyramid,
            margin,
            low[0],
            low[1],
            SEARCH_CELL_M,
            np.ascontiguousarray(near[::2, :2]),
            last,
            0.3 + 0.6 * gap_s,
            SEARCH_STEP_RAD * np.arange(-turns, turns + 1, dtype=np.float64),
            0.2,
            np.array([0.0, 0.0, 0.0, -1.0, 0.0]),
            SEARCH_BUDGET,
        )
        return self._align(cloud, best[:3].copy(), 0.3) if np.isfinite(best[3]) else None

    def _surroundings(self, last: FloatArray) -> tuple[ScoreArray, int, FloatArray] | None:
        """Maxima of the score grid of the last keyframes' points around a pose, margin and corner."""
        xy = np.concatenate(self._local[-SEARCH_KEYFRAMES:])[:, :2] if self._local else np.zeros((0, 2))
        xy = np.ascontiguousarray(xy[np.hypot(*(xy - last[:2]).T) < SEARCH_RANGE_M])
        if xy.shape[0] < 20:
            return None
        low, high = xy.min(axis=0) - 0.3, xy.max(axis=0) + 0.3
        grid = score_grid(
            xy,
            np.zeros((1, 2)),
            np.array([xy.shape[0]]),
            np.concatenate([low, high]),
            SEARCH_CELL_M,
            SEARCH_STD_M,
            0.0,
        )
        return (*max_pyramid(grid, SEARCH_LEVELS), low)


def track(log: LaserLog, config: SlamConfig, on_scan: OnScan | None = None) -> LocalTrack:
    """Run the front end over a log."""
    count = len(log)
    odometry = scanner_odometry(log, config.use_odometry)
    times = smoothed_times(log.t_s)
    matcher = LocalMatcher(config)
    poses, fits = np.zeros((count, 3)), np.zeros(count)
    owner = np.zeros(count, np.int64)
    keyframes: list[int] = []
    clouds: list[FloatArray] = []
    hessians: list[FloatArray] = []
    slips: list[FloatArray] = []
    slip = np.zeros(2)
    for i in range(count):
        cloud = cloud_of(log, i, config.max_range_m)
        hessian = np.zeros((3, 3))
        if i > 0:
            step = None if odometry is None else between(odometry[i - 1], odometry[i])
            dt_s = max(1e-3, float(times[i] - times[i - 1]))
            fit = matcher.match(cloud, poses[i - 1], step, dt_s, float(log.t_s[i] - log.t_s[i - 1]))
            if fit is None:
                poses[i] = matcher.fallback(poses[i - 1], step, dt_s)
                slip += [0.05**2, 0.05**2]
            else:
                poses[i], hessian, fits[i] = fit.pose, fit.hessian, fit.value
                slip += _slip(between(fit.start, fit.pose))
        if i == 0 or _is_new(between(poses[keyframes[-1]], poses[i]), config):
            keyframes.append(i)
            clouds.append(cloud)
            hessians.append(hessian)
            slips.append(slip)
            slip = np.zeros(2)
            matcher.add_keyframe(cloud, poses[i])
        owner[i] = len(keyframes) - 1
        if on_scan is not None:
            on_scan(i)
    return LocalTrack(
        poses,
        np.array(keyframes, np.int64),
        owner,
        Clouds.of(clouds),
        np.array(hessians),
        np.array(slips),
        fits,
        matcher.searched,
        matcher.lost,
    )


def _slip(off: FloatArray) -> FloatArray:
    """Variances (2,) of position and heading of a match by how far (3,) it is from its guess."""
    far = np.array([float(np.hypot(off[0], off[1])), abs(float(off[2]))])
    return np.asarray((SLIP_SHARE * far) ** 2 + (far * far / np.array([SLIP_M, 0.5 * SLIP_M])) ** 2)


def _is_new(motion: FloatArray, config: SlamConfig) -> bool:
    """Whether a scan is far enough from the last keyframe to become one."""
    far = float(np.hypot(motion[0], motion[1])) > config.keyframe_distance_m
    return far or abs(float(motion[2])) > config.keyframe_turn_rad
