"""Detected lines matched to the walls of the map: gated, overlapping, in sight, and jointly compatible."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydantic import Field

from pilotage.core.chi_square import chi_square_quantile
from pilotage.core.config import Config
from pilotage.core.types import FloatArray, IntArray
from pilotage.kernels.arrays import unnamed
from pilotage.kernels.lines import joint_association
from pilotage.kernels.lines.matching import match_lines
from pilotage.kernels.lines.wall_candidates import MatchRules, SeenLines, Walls
from pilotage.maps.segment_map import SegmentMap
from pilotage.maps.wall_lines import WallLines
from pilotage.sensors.sensor import NonNegative
from pilotage.stack.perception.lines import MAX_LINES, DetectedLines

LINE_DOF = 2
"""Distance and angle."""

UNMATCHED = joint_association.UNMATCHED
AMBIGUOUS = joint_association.AMBIGUOUS


class WallMatchingConfig(Config):
    """When a line may be a wall. Gate and ambiguity are probabilities of chi-square variables."""

    ambiguity: float = Field(default=0.99, gt=0.0, lt=1.0)
    """Another explanation less likely than the best by no more than this quantile makes a line ambiguous."""
    overlap: float = Field(default=0.8, gt=0.0, le=1.0)
    """Share of a line that must lie beside its wall."""
    slack_m: NonNegative = 0.05
    sigmas: NonNegative = 3.0
    """The wall's ends give way by the slack and by this many standard deviations of the pose."""
    options: int = Field(default=8, ge=1, le=64)
    """Walls considered for one line."""
    max_nodes: int = Field(default=5000, ge=1)
    """Trial updates after which the search is cut short."""


@dataclass(frozen=True, slots=True)
class Matches:
    """Which wall each line of a scan was matched to.

    Attributes
    ----------
    walls
        (L,) index into the map's ``WallLines``, ``UNMATCHED`` or ``AMBIGUOUS``.
    distances
        (L,) least squared Mahalanobis distance, before the update, to a wall that the line may be, or that it
        lies beside; inf where there is none.
    count
        Number of matched lines.
    placed
        Number of lines beside some wall that may not be several.
    farthest
        Largest distance of a matched line; 0 without one.
    """

    walls: IntArray
    distances: FloatArray
    count: int
    placed: int
    farthest: float


class WallMatcher:
    """Matches all lines of a scan to the walls of a map at once (Neira & Tardos 2001).

    Parameters
    ----------
    gate
        Probability of the chi-square gates: of each line alone, two degrees of freedom, and of all
        matched lines of a scan together, two a line.
    mount
        (3,) pose of the scanner in the base frame.
    gap_m
        Over so much that is not on it a line of a scan goes on; so do walls.
    """

    def __init__(
        self,
        config: WallMatchingConfig,
        gate: float,
        world: SegmentMap,
        mount: FloatArray,
        gap_m: float = 0.0,
    ) -> None:
        self.mount = mount
        self.walls = WallLines.of(world, gap_m)
        self.gate = chi_square_quantile(gate, LINE_DOF)
        self.joint_gates = np.array(
            [0.0, *(chi_square_quantile(gate, LINE_DOF * k) for k in range(1, MAX_LINES + 1))]
        )
        walls = self.walls
        known = Walls(
            walls.normals, walls.line_of, walls.segments_m, walls.pieces_m, walls.wall_of, world.circles_m
        )
        self._known = unnamed(known)
        rules = MatchRules(
            self.gate,
            self.joint_gates,
            chi_square_quantile(config.ambiguity, LINE_DOF),
            config.slack_m,
            config.sigmas,
            config.overlap,
            config.options,
            config.max_nodes,
        )
        self._rules = unnamed(rules)

    def match(self, pose: FloatArray, cov: FloatArray, lines: DetectedLines) -> Matches:
        """Match lines seen from about ``pose`` (3,) with covariance ``cov`` (3, 3); changes neither."""
        seen = unnamed(SeenLines(self.mount, lines.rho_alpha, lines.covs, lines.ends_m))
        return Matches(*match_lines(pose, cov, seen, self._known, self._rules))
