"""Where the robot may be, without a prior: hypotheses from crossing lines, followed until one is left."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from pydantic import Field

from pilotage.core.angles import wrap_to_pi
from pilotage.core.config import Config
from pilotage.core.types import FloatArray
from pilotage.kernels.lines import pose_hypotheses
from pilotage.maps.segment_map import SegmentMap
from pilotage.sensors.readings import OdometryIncrement
from pilotage.sensors.sensor import NonNegative, Positive
from pilotage.stack.localization.mates import NO_MATES, MatesMet
from pilotage.stack.localization.odometry_prediction import OdometryPrediction
from pilotage.stack.localization.scan_fit import Fit, ScanFit
from pilotage.stack.localization.wall_correction import correct
from pilotage.stack.localization.wall_matching import WallMatcher
from pilotage.stack.perception.lines import DetectedLines

MAX_POSES = 20_000
"""Room for the poses that one pair of lines allows."""


class GlobalSearchConfig(Config):
    """When a hypothesis is made, dropped, and believed. Shares are of a scan's beams."""

    pairs: int = Field(default=10, ge=1, le=100)
    """Pairs of crossing lines tried, the longest first."""
    line_length_m: Positive = 0.5
    crossing_rad: Positive = 0.4
    """Lines at a smaller angle fix no position."""
    angle_tolerance_rad: Positive = 0.02
    stride: int = Field(default=7, ge=1)
    """Every how many-th beam sifts the poses at first."""
    explained_share: float = Field(default=0.5, ge=0.0, le=1.0)
    """A hypothesis that explains less is dropped."""
    contradicted_share: float = Field(default=0.02, ge=0.0, le=1.0)
    """So is one that more beams contradict, in ``patience`` scans one after the other."""
    patience: int = Field(default=2, ge=1)
    missing_scans: int = Field(default=5, ge=1)
    """A mate that would be seen where it says that it is, and is not in so many scans, speaks against one."""
    rival_share: float = Field(default=0.04, gt=0.0, lt=1.0)
    """So is one that explains this much less than the best."""
    believed_share: float = Field(default=0.75, ge=0.0, le=1.0)
    """The only hypothesis left is believed once it explains this much."""
    confirm_m: NonNegative = 0.5
    """And once it has been followed over this distance,"""
    turn_counts_m_per_rad: NonNegative = 0.25
    """a turn counting like this much of a path, because it shows what was behind,"""
    confirm_scans: int = Field(default=8, ge=1)
    """and over so many scans."""
    std_m: Positive = 0.05
    std_rad: Positive = 0.01
    """Spread given to a new hypothesis before its lines correct it."""
    apart_m: Positive = 0.3
    apart_rad: Positive = 0.1
    """Hypotheses nearer to each other than both are one."""
    most: int = Field(default=150, ge=1)


@dataclass(slots=True)
class Hypothesis:
    """A pose that the robot may have, followed as a filter of its own."""

    name: int
    pose: FloatArray
    cov: FloatArray
    explained: float
    strikes: int = 0
    driven_m: float = 0.0
    scans: int = 0
    mates: MatesMet = field(default_factory=MatesMet)


class GlobalSearch:
    """Finds the pose from lines and scans alone.

    Two detected lines that cross can each be any wall: each choice fixes a pose, of which those are kept
    from which the map explains the scan. A beam that passes through a wall of the map speaks against a
    pose; a beam cut short may be something unexpected. The poses left are followed by odometry and walls
    until one alone remains. Where all have fallen, the search starts anew from the scan at hand.

    Mates who say where they are tell poses apart between which walls do not: from a wrong one the robot looks
    through where they are. Only those poses are rivals that the fewest mates speak against. None is dropped
    for it: a mate may be wrong about its own place, until it notices that.

    Fails where no two crossing walls are in sight (it waits), and in a map that repeats itself exactly
    (it waits until the robot has seen where it does not, or mates): mates of whom most are wrong mislead it.

    Attributes
    ----------
    mates
        (K, 4) where each is on the map, as of ``ScanFit.mates_in_sight``.
    """

    def __init__(
        self,
        config: GlobalSearchConfig,
        world: SegmentMap,
        fit: ScanFit,
        matcher: WallMatcher,
        mount: FloatArray,
        prediction: OdometryPrediction,
        body_radius_m: float,
    ) -> None:
        self._config = config
        self._world = world
        self._fit = fit
        self._matcher = matcher
        self._mount = mount
        self._prediction = prediction
        self._radius = body_radius_m
        self.hypotheses: list[Hypothesis] = []
        self.mates = NO_MATES
        self._made = 0

    def reset(self) -> None:
        """Forget all hypotheses."""
        self.hypotheses = []

    def rivals(self) -> list[Hypothesis]:
        """The hypotheses that the fewest mates speak against, the best first."""
        against = [h.mates.missing(self._config.missing_scans) for h in self.hypotheses]
        return [h for h, count in zip(self.hypotheses, against, strict=True) if count == min(against)]

    def move(self, odometry: OdometryIncrement) -> None:
        """Carry all hypotheses along."""
        turn_m = self._config.turn_counts_m_per_rad * abs(odometry.angle_rad)
        for hypothesis in self.hypotheses:
            self._prediction.move(hypothesis.pose, hypothesis.cov, odometry)
            hypothesis.driven_m += math.hypot(odometry.distance_m, odometry.lateral_m) + turn_m

    def look(self, lines: DetectedLines, ranges_m: FloatArray) -> Hypothesis | None:
        """Weigh the hypotheses by a scan; returns the one to be believed, if there is."""
        if self.hypotheses:
            self.hypotheses = [h for h in self.hypotheses if self._survives(h, lines, ranges_m)]
        if not self.hypotheses:
            self.hypotheses = self._start(lines, ranges_m)
        self._prune()
        rivals, config = self.rivals(), self._config
        if len(rivals) != 1:
            return None
        only = rivals[0]
        confirmed = only.driven_m >= config.confirm_m and only.scans >= config.confirm_scans
        return only if confirmed and only.explained >= config.believed_share else None

    def _survives(self, hypothesis: Hypothesis, lines: DetectedLines, ranges_m: FloatArray) -> bool:
        correct(hypothesis.pose, hypothesis.cov, self._mount, lines, self._matcher)
        fit = self._fit.of(hypothesis.pose, ranges_m)
        hypothesis.scans += 1
        hypothesis.mates.take_in(self.mates, self._fit.mates_in_sight(hypothesis.pose, ranges_m, self.mates))
        return self._holds(hypothesis, fit)

    def _holds(self, hypothesis: Hypothesis, fit: Fit) -> bool:
        """Take in a fit; the share explained is smoothed, because an edge may hide much for a moment."""
        config = self._config
        hypothesis.explained += 0.3 * (fit.explained - hypothesis.explained)
        struck = fit.contradicted > config.contradicted_share
        hypothesis.strikes = hypothesis.strikes + 1 if struck else 0
        return hypothesis.strikes < config.patience and hypothesis.explained >= config.explained_share

    def _start(self, lines: DetectedLines, ranges_m: FloatArray) -> list[Hypothesis]:
        """All poses that explain this scan, from its longest crossing lines."""
        config = self._config
        poses = [self._poses_of(lines, i, j, ranges_m) for i, j in self._crossing_pairs(lines)]
        if not poses:
            return []
        started: list[Hypothesis] = []
        for pose in np.concatenate(poses):
            if any(self._same(pose, other.pose) for other in started):
                continue
            cov = np.diag([config.std_m**2, config.std_m**2, config.std_rad**2])
            self._made += 1
            hypothesis = Hypothesis(self._made, pose.copy(), cov, 0.0)
            correct(hypothesis.pose, hypothesis.cov, self._mount, lines, self._matcher)
            fit = self._fit.of(hypothesis.pose, ranges_m)
            hypothesis.explained = fit.explained
            if fit.contradicted <= config.contradicted_share and fit.explained >= config.explained_share:
                started.append(hypothesis)
        started.sort(key=lambda h: -h.explained)
        return started[: config.most]

    def _crossing_pairs(self, lines: DetectedLines) -> list[tuple[int, int]]:
        ends = lines.ends_m
        lengths = np.hypot(ends[:, 2] - ends[:, 0], ends[:, 3] - ends[:, 1])
        long = [
            int(k) for k in np.argsort(-lengths, kind="stable") if lengths[k] >= self._config.line_length_m
        ]
        pairs = []
        for place, j in enumerate(long):
            for i in long[:place]:
                between = lines.rho_alpha[j, 1] - lines.rho_alpha[i, 1]
                if abs(math.sin(between)) >= math.sin(self._config.crossing_rad):
                    pairs.append((i, j))
        return pairs[: self._config.pairs]

    def _poses_of(self, lines: DetectedLines, i: int, j: int, ranges_m: FloatArray) -> FloatArray:
        """Robot poses (K, 3), best first, from which lines i and j may be walls and the scan fits."""
        config = self._config
        out = np.empty((MAX_POSES, 3))
        pair = np.array([i, j])
        count = pose_hypotheses.pair_poses(
            lines.rho_alpha[pair],
            lines.ends_m[pair],
            self._matcher.walls.normals,
            self._matcher.walls.segments_m,
            self._world.circles_m,
            np.array(self._world.bounds_m),
            config.angle_tolerance_rad,
            config.apart_m,
            0.8,
            0.9 * self._radius,
            out,
        )
        fitting = self._fit.best(
            out[:count],
            ranges_m,
            config.stride,
            config.std_m,
            config.explained_share - 0.1,
            2.0 * config.contradicted_share,
        )
        return self._fit.robot_poses(fitting[: config.most])

    def _prune(self) -> None:
        """Drop those that explain clearly less than the best, and doubles."""
        if not self.hypotheses:
            return
        best = max(h.explained for h in self.hypotheses)
        kept: list[Hypothesis] = []
        for hypothesis in sorted(self.hypotheses, key=lambda h: -h.explained):
            if hypothesis.explained < best - self._config.rival_share:
                break
            if not any(self._same(hypothesis.pose, other.pose) for other in kept):
                kept.append(hypothesis)
        self.hypotheses = kept

    def _same(self, a: FloatArray, b: FloatArray) -> bool:
        config = self._config
        near = math.hypot(a[0] - b[0], a[1] - b[1]) < config.apart_m
        return near and abs(wrap_to_pi(float(a[2] - b[2]))) < config.apart_rad
