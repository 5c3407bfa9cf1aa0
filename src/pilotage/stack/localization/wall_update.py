"""An update by walls, kept so that it can be explained: what was seen, matched, accepted, and why not."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pilotage.core.angles import wrap_to_pi
from pilotage.core.types import FloatArray
from pilotage.kernels.lines import joint_association
from pilotage.stack.interface import LineVerdict, ScanUpdate
from pilotage.stack.localization.wall_matching import AMBIGUOUS, Matches, WallMatcher
from pilotage.stack.perception.lines import DetectedLines


@dataclass(frozen=True, slots=True)
class WallUpdate:
    """The belief before, the pose after, and what came between."""

    pose: FloatArray
    cov: FloatArray
    pose_after: FloatArray
    lines: DetectedLines
    matches: Matches
    matcher: WallMatcher

    @property
    def left_out(self) -> int:
        """Lines that were not accepted."""
        return len(self.lines) - self.matches.count

    @property
    def largest_accepted(self) -> float:
        """Largest squared Mahalanobis distance of an accepted line; 0 without one."""
        return self.matches.farthest

    def explained(self) -> ScanUpdate:
        """Put the explanation together."""
        lines, walls, known = self.lines, self.matches.walls, self.matcher.walls
        distances = self.matches.distances.copy()
        joint_association.pair_distances(
            self.pose,
            self.cov,
            self.matcher.mount,
            lines.rho_alpha,
            lines.covs,
            known.normals,
            walls,
            distances,
        )
        walls_m = np.full((len(lines), 4), np.nan)
        matched = walls >= 0
        walls_m[matched] = known.segments_m[walls[matched]]
        verdicts = tuple(
            self._verdict(int(wall), float(distance))
            for wall, distance in zip(walls, self.matches.distances, strict=True)
        )
        return ScanUpdate(
            self._sensor(self.pose),
            self._sensor(self.pose_after),
            lines.points_m,
            lines.clusters,
            lines.members,
            lines.ends_m,
            walls_m,
            distances,
            self.matcher.gate,
            verdicts,
        )

    def _verdict(self, wall: int, distance: float) -> LineVerdict:
        if wall >= 0:
            return LineVerdict.ACCEPTED
        if wall == AMBIGUOUS:
            return LineVerdict.AMBIGUOUS
        if math.isinf(distance):
            return LineVerdict.NO_WALL
        return LineVerdict.GATED if distance > self.matcher.gate else LineVerdict.AT_ODDS

    def _sensor(self, pose: FloatArray) -> FloatArray:
        c, s = math.cos(pose[2]), math.sin(pose[2])
        x, y, theta = (float(value) for value in self.matcher.mount)
        return np.array(
            [
                pose[0] + c * x - s * y,
                pose[1] + s * x + c * y,
                wrap_to_pi(float(pose[2]) + theta),
            ]
        )
