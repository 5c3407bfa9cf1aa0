"""The front end: scans become a track of keyframes, and drift is all it leaves to the graph."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from pilotage.core.types import FloatArray, IntArray
from pilotage.kernels.slam.frames import between, composed
from pilotage.logs.laser_log import LaserLog
from pilotage.stack.mapping.slam.clouds import Clouds, cloud_of
from pilotage.stack.mapping.slam.config import SlamConfig
from pilotage.stack.mapping.slam.local_matching import Aside, LocalMatcher
from pilotage.stack.mapping.slam.movers import Movers
from pilotage.stack.mapping.slam.odometry import NO_OTHERS, ScanMotions, smoothed_times
from pilotage.stack.mapping.slam.slips import (
    BLIND_BREAK_SLIP,
    BREAK_SLIP,
    GUESS_SLIP,
    HEALED_SLIP,
    Slips,
)

SURE_GUESS = 0.035
"""Usual error of the guesses (a radian as half a metre) up to which people are told from walls by odometry:
wrong stamps, and constant velocity alone, make movers of walls."""
GUESSED_SCANS = 3
"""So many scans in a row may hang by the odometry alone before the track breaks,"""
FAR_M, FAR_RAD = 0.5, 0.4
"""and none that is so far from the one before: the next would see still less of the last keyframe's walls."""
RIGID = 1e4 * np.eye(3)
"""Hessian of a break: its slip alone counts."""
HEAL_SCANS, HEAL_KEYFRAMES = 10, 24
"""A scan after a break is looked for in what was before: each of the first ones, then keyframes."""
HEAL_M, HEAL_M_PER_KEYFRAME, HEAL_MOST_M = 0.8, 0.1, 2.5
AGREE_M, AGREE_RAD = 0.2, 0.1
"""Two scans must be found, the second one from another place, and agree."""
SHORT = 5
"""A piece of fewer keyframes that breaks off again is no piece: its keyframes are dropped."""

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
        (K, 3, 3) covariances, in the scanner's frame, of what may have slipped since the keyframe before.
    breaks
        (B,) which keyframes begin a new piece: their scans fitted nowhere near the one before, and where
        they lie beside it is a guess.
    searched, lost
        How many scans needed a search, and how many could not be aligned (their pose is the guess).
    crowded
        Scans of which so much seemed to move that people may fill the view.
    """

    poses: FloatArray
    keyframes: IntArray
    owner: IntArray
    clouds: Clouds
    hessians: FloatArray
    slips: FloatArray
    breaks: IntArray
    searched: int
    lost: int
    crowded: int = 0


@dataclass(frozen=True, slots=True)
class _Torn:
    """A break that may still be joined: what was before, the keyframe and the scan at which the piece began.

    ``candidate`` is where a scan was, and by which motion (3,) the piece would have to be moved by it.
    """

    aside: Aside
    keyframe: int
    scan: int
    candidate: tuple[FloatArray, FloatArray] | None = None


class Tracker:
    """Places scans one after the other; the track so far is at hand at any time.

    Where a scan fits nowhere the track breaks: what follows is a piece of its own, whose scans are looked for
    in what was before until two of them agree where it lies.

    Attributes
    ----------
    healed
        How many breaks were joined so.
    """

    def __init__(self, config: SlamConfig) -> None:
        self._config = config
        self._matcher = LocalMatcher(config)
        self._movers = Movers()
        self._poses: list[FloatArray] = []
        self._owner: list[int] = []
        self._keyframes: list[int] = []
        self._clouds: list[FloatArray] = []
        self._hessians: list[FloatArray] = []
        self._slips: list[FloatArray] = []
        self._breaks: list[int] = []
        self._slip = Slips()
        self._torn: _Torn | None = None
        self._lost_run = 0
        self.healed = 0

    def add(
        self,
        cloud: FloatArray,
        step: FloatArray | None,
        dt_s: float,
        gap_s: float,
        others: FloatArray = NO_OTHERS,
    ) -> bool:
        """Place the next scan (K, 6); True where it became a keyframe. As ``LocalMatcher.match``."""
        hessian, broken, led = np.zeros((3, 3)), False, None
        light = self._matcher.thinned(cloud)
        if not self._poses:
            pose = np.zeros(3)
        else:
            last = self._poses[-1]
            guesses = self._matcher.guesses(step, dt_s)
            expected = composed(last, guesses[0][0])
            if step is not None and self._matcher.guess_error < SURE_GUESS:
                led = expected
                light = self._movers.without(light, led)
            fit = self._matcher.match(light, last, step, guesses, dt_s, gap_s, others)
            self._lost_run = 0 if fit is not None else self._lost_run + 1
            if fit is None:
                pose, hessian = expected, RIGID
                broken = step is None or self._lost_run > GUESSED_SCANS or _is_far(step)
                self._slip.add(BLIND_BREAK_SLIP if step is None else BREAK_SLIP if broken else GUESS_SLIP)
                if broken:
                    self._tear()
            else:
                pose, hessian = fit.pose, fit.hessian
                self._slip.matched(fit)
        new = not self._poses or _is_new(between(self._poses[self._keyframes[-1]], pose), self._config)
        self._poses.append(pose)
        new = new and not (self._lost_run and not broken)
        if new or broken:
            self._keyframes.append(len(self._poses) - 1)
            self._clouds.append(cloud if led is None else self._movers.without(cloud, led))
            self._hessians.append(hessian)
            self._slips.append(self._slip.taken())
            self._matcher.add_keyframe(light, pose)
            self._movers.add(cloud, pose)
        self._owner.append(len(self._keyframes) - 1)
        if self._torn is not None and not broken:
            self._heal(self._torn, light, new)
        return new or broken

    def _tear(self) -> None:
        """Begin a new piece; one that has hardly begun is dropped."""
        torn, count = self._torn, len(self._keyframes)
        aside = self._matcher.set_aside()
        self._movers.forget()
        if torn is not None and count - torn.keyframe < SHORT:
            self._slip.add(np.sum(self._slips[torn.keyframe :], axis=0))
            for kept in (self._keyframes, self._clouds, self._hessians, self._slips):
                del kept[torn.keyframe :]
            self._owner = [min(owner, torn.keyframe - 1) for owner in self._owner]
            self._torn = replace(torn, scan=len(self._poses), candidate=None)
        else:
            self._breaks.append(count)
            self._torn = None if aside is None else _Torn(aside, count, len(self._poses))

    def _heal(self, torn: _Torn, cloud: FloatArray, new: bool) -> None:
        """Look for a scan in what was before the break; where two agree, move the piece to where they are."""
        keyframes = len(self._keyframes) - torn.keyframe
        if keyframes > HEAL_KEYFRAMES:
            self._torn = None
            return
        if not new and len(self._poses) - torn.scan > HEAL_SCANS:
            return
        pose = self._poses[-1]
        half_m = min(HEAL_M + HEAL_M_PER_KEYFRAME * keyframes, HEAL_MOST_M)
        fit = None
        if torn.candidate is not None and _is_new(between(torn.candidate[0], pose), self._config):
            expected = np.asarray(composed(torn.candidate[1], pose))
            fit = self._matcher.find(torn.aside, cloud, expected, HEAL_M)
        fit = fit or self._matcher.find(torn.aside, cloud, pose, half_m)
        if fit is None:
            return
        moved = composed(fit.pose, between(pose, np.zeros(3)))
        if torn.candidate is None or not _is_new(between(torn.candidate[0], pose), self._config):
            if torn.candidate is None:
                self._torn = replace(torn, candidate=(pose, moved))
            return
        off = between(composed(torn.candidate[1], pose), fit.pose)
        if np.hypot(off[0], off[1]) > AGREE_M or abs(off[2]) > AGREE_RAD:
            self._torn = replace(torn, candidate=(pose, moved))
            return
        for k in range(torn.scan, len(self._poses)):
            self._poses[k] = np.asarray(composed(moved, self._poses[k]))
        self._matcher.carry(moved)
        self._movers.carry(moved)
        self._hessians[torn.keyframe], self._slips[torn.keyframe] = fit.hessian, HEALED_SLIP.copy()
        self._breaks.remove(torn.keyframe)
        self._torn = None
        self.healed += 1

    @property
    def pose(self) -> FloatArray:
        """(3,) of the last scan, in the frame of the first."""
        return self._poses[-1]

    @property
    def keyframe_pose(self) -> FloatArray:
        """(3,) of the last keyframe."""
        return self._poses[self._keyframes[-1]]

    @property
    def rms_m(self) -> float:
        """Running mean of the residuals of the alignments."""
        return self._matcher.rms_m

    @property
    def keyframes(self) -> int:
        """How many there are; a break may drop some of the last ones."""
        return len(self._keyframes)

    @property
    def lost(self) -> int:
        """How many scans could not be aligned."""
        return self._matcher.lost

    def last_step(self) -> LocalTrack:
        """Return the last two keyframes alone, without their points."""
        pair = self._keyframes[-2:]
        return LocalTrack(
            np.array([self._poses[k] for k in pair]),
            np.arange(2),
            np.arange(2),
            Clouds.of([]),
            np.array(self._hessians[-2:]),
            np.array(self._slips[-2:]),
            np.zeros(0, np.int64),
            0,
            0,
        )

    def track(self) -> LocalTrack:
        """Everything so far."""
        return LocalTrack(
            np.array(self._poses).reshape(-1, 3),
            np.array(self._keyframes, np.int64),
            np.array(self._owner, np.int64),
            Clouds.of(self._clouds),
            np.array(self._hessians).reshape(-1, 3, 3),
            np.array(self._slips).reshape(-1, 3, 3),
            np.array(self._breaks, np.int64),
            self._matcher.searched,
            self._matcher.lost,
            self._movers.crowded,
        )


def track(log: LaserLog, config: SlamConfig, on_scan: OnScan | None = None) -> LocalTrack:
    """Run the front end over a log."""
    motions = ScanMotions(log, config.use_odometry)
    times = smoothed_times(log.t_s)
    tracker = Tracker(config)
    gaps_s = np.diff(log.t_s, prepend=log.t_s[0]).tolist()
    for i, dt_s in enumerate(np.maximum(1e-3, np.diff(times, prepend=times[0])).tolist()):
        step, others = motions.of(i)
        last = tracker.pose if i else np.zeros(3)
        tracker.add(cloud_of(log, i, config.max_range_m), step, dt_s, gaps_s[i], others)
        motions.learn(i, between(last, tracker.pose), step, others)
        if on_scan is not None:
            on_scan(i)
    return tracker.track()


def _is_new(motion: FloatArray, config: SlamConfig) -> bool:
    """Whether a scan is far enough from the last keyframe to become one."""
    far = math.hypot(motion[0], motion[1]) > config.keyframe_distance_m
    return far or abs(float(motion[2])) > config.keyframe_turn_rad


def _is_far(motion: FloatArray) -> bool:
    """Whether scans are so far apart that one alone leads out of what the last keyframe saw."""
    return math.hypot(motion[0], motion[1]) > FAR_M or abs(float(motion[2])) > FAR_RAD
