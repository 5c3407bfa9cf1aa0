"""The front end: scans become a track of keyframes, and drift is all it leaves to the graph."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from pilotage.core.types import FloatArray, IntArray
from pilotage.kernels.slam.following import DOUBT, FULL, follow, holds_along, is_new, leaves
from pilotage.kernels.slam.frames import between, composed
from pilotage.kernels.slam.recorded_motions import motion_of, move_anchor
from pilotage.kernels.slam.track import Recording
from pilotage.kernels.slam.wheels import righted
from pilotage.logs.laser_log import LaserLog
from pilotage.stack.mapping.slam.clouds import LEAST_RANGE_M, Clouds, cloud_of
from pilotage.stack.mapping.slam.config import SlamConfig
from pilotage.stack.mapping.slam.fit import Fit
from pilotage.stack.mapping.slam.guesses import (
    BLIND_BREAK_SLIP,
    BREAK_SLIP,
    GUESS_SLIP,
    GUESSED_SCANS,
    HEALED_SLIP,
    is_far,
)
from pilotage.stack.mapping.slam.local_matching import Aside, LocalMatcher
from pilotage.stack.mapping.slam.odometry import NO_OTHERS, recording_of
from pilotage.stack.mapping.slam.odometry_record import OdometryRecord, ToldByOdometry
from pilotage.stack.mapping.slam.unknown_ground import FEW_POINTS, View

RIGID = 1e4 * np.eye(3)
"""Hessian of a break: its slip alone counts."""
HEAL_SCANS, HEAL_KEYFRAMES = 10, 24
"""A scan after a break is looked for in what was before: each of the first ones, then keyframes."""
HEAL_M, HEAL_M_PER_KEYFRAME, HEAL_MOST_M = 0.8, 0.1, 2.5
TORN_RAD = 3.0 * float(np.sqrt(BREAK_SLIP[2, 2]))
"""Three standard deviations of what the odometry may have turned wrongly over a break: a door looks alike
from both its sides."""
AGREE_M, AGREE_RAD = 0.2, 0.1
"""Two scans must be found, the second one from another place, and agree."""
SHORT = 5
"""A piece of fewer keyframes that breaks off again is no piece: its keyframes are dropped."""

AT_ONCE = 500
"""So many scans are placed before progress is told."""

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
    residual_m
        Mean over all scans of the root mean square of an alignment's residuals.
    odometry
        What an odometry tells between keyframes, where it is the robot's own and no stamp lies.
    """

    poses: FloatArray
    keyframes: IntArray
    owner: IntArray
    clouds: Clouds
    hessians: FloatArray
    slips: FloatArray
    breaks: IntArray
    searched: int = 0
    lost: int = 0
    crowded: int = 0
    residual_m: float = 0.0
    odometry: ToldByOdometry | None = None


@dataclass(frozen=True, slots=True)
class _Torn:
    """A break that may still be joined: what was before, the keyframe and the scan at which the piece began.

    ``turn_rad`` is how far the piece may have to be turned, ``candidate`` where a scan was, and by which
    motion (3,) the piece would have to be moved by it.
    """

    aside: Aside
    keyframe: int
    scan: int
    turn_rad: float
    candidate: tuple[FloatArray, FloatArray] | None = None


class Tracker:
    """Places scans one after the other; the track so far is at hand at any time.

    Where a scan fits nowhere the track breaks: what follows is a piece of its own, whose scans are looked for
    in what was before until two of them agree where it lies. Where nothing known is in sight a scan can fit
    nowhere, and hangs by the odometry as surely as that was right before.

    Attributes
    ----------
    healed
        How many breaks were joined so.
    lost_run
        Scans in a row that fitted nowhere though something known was to be seen.
    """

    def __init__(self, config: SlamConfig) -> None:
        self._config = config
        self._matcher = LocalMatcher(config)
        self._view, self._odometry = View(), OdometryRecord()
        self._poses: list[FloatArray] = []
        self._owner: list[int] = []
        self._keyframes: list[int] = []
        self._clouds: list[FloatArray] = []
        self._hessians: list[FloatArray] = []
        self._slips: list[FloatArray] = []
        self._breaks: list[int] = []
        self._torn: _Torn | None = None
        self.lost_run = 0
        self.healed = 0

    def add(
        self,
        cloud: FloatArray,
        step: FloatArray | None,
        dt_s: float,
        gap_s: float,
        others: FloatArray = NO_OTHERS,
    ) -> bool:
        """Place the next scan (K, 6); True where it became a keyframe. As ``LocalMatcher.search``."""
        self._matcher.make_room(len(cloud), step is not None)
        if self._poses:
            self._odometry.add(step)
        if step is not None:
            wheels = self._matcher.track.wheels
            step, others = (
                righted(wheels, step),
                np.array([righted(wheels, o) for o in others]).reshape(-1, 3),
            )
        kept, light, sure = self._matcher.look(cloud, step, others, dt_s)
        if not self._poses:
            self._poses.append(np.zeros(3))
            self._keep(cloud, kept, np.zeros((3, 3)), step is not None)
            self._owner.append(0)
            return True
        fit = self._matcher.found_fit() if sure else self._matcher.search(light, step, others, dt_s, gap_s)
        if fit is not None:
            self._matcher.settle(fit, step, dt_s)
        return self._take_in(cloud, kept, light, fit, step)

    def follow(self, recording: Recording, gaps_s: FloatArray, on_scan: OnScan | None) -> None:
        """Place all scans of a recording but the first, which was added."""
        matcher, config = self._matcher, self._config
        limits = np.array(
            [LEAST_RANGE_M, config.max_range_m, config.keyframe_distance_m, config.keyframe_turn_rad]
        )
        count, led = len(recording.beams), len(recording.at_scans) > 0
        self._odometry.poses = list(recording.at_scans)
        poses, owners, first = np.empty((count, 3)), np.empty(count, np.int64), 1
        while first < count:
            # A break may be healed by any scan.
            end = min(count, first + (AT_ONCE if self._torn is None else 1))
            at, why, cloud, kept, light = follow(
                recording,
                first,
                end,
                limits,
                config.local_keyframes,
                matcher.tracked,
                matcher.keyframes,
                poses,
                owners,
            )
            self._poses.extend(poses[first:at])
            self._owner.extend((owners[first:at] + len(self._keyframes)).tolist())
            new = self._fetch()
            if at > first:
                self.lost_run = 0
                matcher.found_again()
            if why == FULL:
                matcher.make_room(int(recording.beams[at]), led)
            elif why == DOUBT:
                step, others = motion_of(recording, at, matcher.track.wheels)
                told, last, dt_s = step if led else None, self.pose, float(recording.dt_s[at])
                fit = matcher.search(light, told, others, dt_s, float(gaps_s[at]))
                moved = matcher.found.motions[0] if fit is None else between(last, fit.pose)
                move_anchor(recording, at, step, others, moved)
                if fit is not None:
                    matcher.settle(fit, told, dt_s)
                self._take_in(cloud, kept, light, fit, told)
                at += 1
            elif self._torn is not None:
                self._heal(self._torn, light, new)
            first = at
            if on_scan is not None:
                on_scan(at - 1)

    def _take_in(
        self, cloud: FloatArray, kept: FloatArray, light: FloatArray, fit: Fit | None, step: FloatArray | None
    ) -> bool:
        """Note where a scan lies, or hang it by its guess; True where it becomes a keyframe.

        ``cloud``, ``kept`` and ``light`` are all of it, what is left without people, and what is aligned.
        """
        track, hessian, broken, far = self._matcher.track, RIGID, False, False
        if fit is None and step is not None and self._is_on_unknown_ground(step):
            self.lost_run = 0
            track.pose[:] = composed(track.pose, step)
            track.slip[:] += self._odometry.slip(len(self._poses), step, self._poses)
            few = len(light) < FEW_POINTS
            cloud, kept = (cloud[:0], kept[:0]) if few else (cloud, kept)
            far = not few or self._is_new(between(track.keyframe, track.pose))
        elif fit is None:
            self.lost_run += 1
            self._odometry.lose(len(self._poses))
            track.pose[:] = composed(track.pose, self._matcher.found.motions[0])
            broken = step is None or self.lost_run > GUESSED_SCANS or is_far(step)
            track.slip[:] += BLIND_BREAK_SLIP if step is None else BREAK_SLIP if broken else GUESS_SLIP
            if broken:
                self._tear(math.pi if step is None else TORN_RAD)
        else:
            self.lost_run, hessian = 0, fit.hessian
            if not holds_along(fit.pose, fit.hessian, fit.weight):
                self._odometry.leave_open(len(self._poses))
            moved = between(track.keyframe, track.pose)
            far = self._is_new(moved) or leaves(track, fit.value, step is not None)
        new = broken or far
        self._poses.append(track.pose.copy())
        if new:
            self._keep(cloud, kept, hessian, step is not None)
        self._owner.append(len(self._keyframes) - 1)
        if self._torn is not None and not broken:
            self._heal(self._torn, light, new)
        return new

    def _is_on_unknown_ground(self, step: FloatArray) -> bool:
        """Whether nothing known is to be seen from where the odometry leads: no scan can fit there."""
        if self._torn is not None or is_far(step):
            return False
        pose = np.asarray(composed(self._matcher.track.pose, step))
        return not self._view.shows_any(self._matcher.known(), pose)

    def _keep(self, cloud: FloatArray, kept: FloatArray, hessian: FloatArray, led: bool) -> None:
        """Make the last scan a keyframe."""
        self._matcher.keep(len(self._poses) - 1, cloud, kept, hessian, led)
        self._fetch()

    def _fetch(self) -> bool:
        """Take over what became keyframes, if anything did."""
        new = self._matcher.keyframes
        count = int(new.added[0])
        for k in range(count):
            scan, kept = int(new.scans[k]), new.points[new.starts[k] : new.starts[k + 1]].copy()
            self._keyframes.append(scan)
            self._clouds.append(kept)
            self._hessians.append(new.hessians[k].copy())
            self._slips.append(new.slips[k].copy())
            self._matcher.remember(kept, self._poses[scan])
            self._view.grow(kept)
        new.added[0] = 0
        return count > 0

    def _is_new(self, motion: FloatArray) -> bool:
        """Whether a scan is far enough from the last keyframe to become one."""
        return is_new(motion, self._config.keyframe_distance_m, self._config.keyframe_turn_rad)

    def _tear(self, turn_rad: float) -> None:
        """Begin a new piece, turned by so much at most; one that has hardly begun is dropped."""
        torn, count = self._torn, len(self._keyframes)
        aside = self._matcher.set_aside()
        if torn is not None and count - torn.keyframe < SHORT:
            self._matcher.track.slip[:] += np.sum(self._slips[torn.keyframe :], axis=0)
            for kept in (self._keyframes, self._clouds, self._hessians, self._slips):
                del kept[torn.keyframe :]
            self._owner = [min(owner, torn.keyframe - 1) for owner in self._owner]
            turn_rad = min(torn.turn_rad + turn_rad, math.pi)
            self._torn = replace(torn, scan=len(self._poses), turn_rad=turn_rad, candidate=None)
        else:
            self._breaks.append(count)
            self._torn = None if aside is None else _Torn(aside, count, len(self._poses), turn_rad)

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
        if torn.candidate is not None and self._is_new(between(torn.candidate[0], pose)):
            expected = np.asarray(composed(torn.candidate[1], pose))
            fit = self._matcher.find(torn.aside, cloud, expected, HEAL_M, torn.turn_rad)
        fit = fit or self._matcher.find(torn.aside, cloud, pose, half_m, torn.turn_rad)
        if fit is None:
            return
        moved = composed(fit.pose, between(pose, np.zeros(3)))
        if torn.candidate is None or not self._is_new(between(torn.candidate[0], pose)):
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
        return float(self._matcher.track.usual[1])

    @property
    def keyframes(self) -> int:
        """How many there are; a break may drop some of the last ones."""
        return len(self._keyframes)

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
        )

    def by_odometry(self, count: int) -> ToldByOdometry:
        """What the odometry tells between the last so many keyframes."""
        scans = np.array(self._keyframes[-count:], np.int64)
        return self._odometry.told(scans, self._poses)

    def track(self) -> LocalTrack:
        """Everything so far."""
        residuals_m, count = self._matcher.track.residuals.tolist()
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
            int(self._matcher.track.crowded[0]),
            residuals_m / max(count, 1.0),
        )


def track(log: LaserLog, config: SlamConfig, on_scan: OnScan | None = None) -> LocalTrack:
    """Run the front end over a log."""
    recording, tracker = recording_of(log, config.use_odometry), Tracker(config)
    step = np.zeros(3) if len(recording.at_scans) else None
    tracker.add(cloud_of(log, 0, config.max_range_m), step, 1e-3, 0.0)
    tracker.follow(recording, np.diff(log.t_s, prepend=log.t_s[0]), on_scan)
    return tracker.track()
