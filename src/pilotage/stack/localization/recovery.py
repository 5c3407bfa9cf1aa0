"""Noticing that the robot is not where it believes to be, and finding out where it is."""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field

from pilotage.core.config import Config
from pilotage.core.types import FloatArray
from pilotage.kernels.scans.median import median_of_known
from pilotage.maps.world_map import WorldMap
from pilotage.sensors.joint_lidar import places_of_lasers_m
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.readings import OdometryIncrement
from pilotage.sensors.sensor import Positive
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.localization.global_search import GlobalSearch, GlobalSearchConfig, Hypothesis
from pilotage.stack.localization.mates import MatesMet
from pilotage.stack.localization.odometry_prediction import OdometryPrediction
from pilotage.stack.localization.scan_fit import ScanFit
from pilotage.stack.localization.viewpoint import Viewpoint, ViewpointConfig
from pilotage.stack.localization.wall_matching import UNMATCHED, Matches, WallMatcher
from pilotage.stack.perception.lines import DetectedLines

LINES_AT_LEAST = 2
"""One line that is no wall of the map may be an obstacle; two say more."""


class RecoveryConfig(Config):
    """When a belief is given up, and how a new one is found. Shares are of a scan's beams."""

    search: GlobalSearchConfig = GlobalSearchConfig()
    viewpoint: ViewpointConfig = ViewpointConfig()
    near_m: Positive = 0.1
    """A range this near the expected one is explained."""
    beyond_m: Positive = 0.3
    """A range longer than expected by more than this passes through a wall of the map."""
    contradicted_share: float = Field(default=0.15, gt=0.0, le=1.0)
    """A belief that this much of a scan contradicts is given up,"""
    contradicted_scans: int = Field(default=2, ge=1)
    """in so many scans one after the other."""
    explained_share: float = Field(default=0.15, ge=0.0, lt=1.0)
    """So is one that explains less than this,"""
    explained_scans: int = Field(default=10, ge=1)
    """in so many: a crowd around the robot may hide the walls for a while."""
    blatant_share: float = Field(default=0.35, ge=0.0, lt=1.0)
    """A scan that explains less than this and shows walls of which none is where it should be: at once."""
    sure_m: Positive = 0.3
    """A belief less certain than this expects no scan; it is judged by the lines that it can place,"""
    unplaced_scans: int = Field(default=5, ge=1)
    """and given up where it can place fewer than half of them, in so many scans that show two or more."""


class Recovery:
    """Watches a belief and, once it is given up, searches for the pose."""

    def __init__(
        self,
        config: RecoveryConfig,
        robot: RobotKnowledge,
        chart: WorldMap,
        lidar: LidarConfig,
        max_range_m: float,
        matcher: WallMatcher,
        mount: FloatArray,
        prediction: OdometryPrediction,
    ) -> None:
        self._config = config
        self._fit = ScanFit(
            chart.reflectors,
            lidar,
            max_range_m,
            config.near_m,
            config.beyond_m,
            places_of_lasers_m(lidar, robot.sensors),
        )
        self._search = GlobalSearch(
            config.search,
            chart.reflectors,
            self._fit,
            matcher,
            mount,
            prediction,
            robot.radius_m,
        )
        self._viewpoint = Viewpoint(config.viewpoint, chart.reflectors, lidar, robot.radius_m)
        self._contradicted = self._unexplained = self._unplaced = 0
        self._met = MatesMet()

    @property
    def hypotheses(self) -> int:
        """How many poses are being followed."""
        return len(self._search.hypotheses)

    def gives_up(self, pose: FloatArray, cov: FloatArray, ranges_m: FloatArray, matches: Matches) -> bool:
        """Whether a scan, whose lines were matched as far as they could be, shows a belief to be wrong."""
        # What a heading that is not known moves, it moves at the distance of the walls.
        far_m = median_of_known(ranges_m)
        spread_m = 3.0 * math.sqrt(cov[0, 0] + cov[1, 1] + far_m**2 * cov[2, 2])
        if spread_m > self._config.sure_m:
            wrong = self._places_too_few(matches)
        else:
            self._unplaced = 0
            wrong = self._contradicts(pose, ranges_m, spread_m, matches)
        wrong |= self._is_outvoted(pose, ranges_m)
        if wrong:
            self._contradicted = self._unexplained = self._unplaced = 0
            self._met = MatesMet()
            self._search.reset()
        return wrong

    def _is_outvoted(self, pose: FloatArray, ranges_m: FloatArray) -> bool:
        """The question to a belief in a map that repeats itself, which walls never contradict."""
        mates = self._search.mates
        if not len(mates):
            return False
        self._met.take_in(mates, self._fit.mates_in_sight(pose, ranges_m, mates))
        return self._met.speak_against

    def _places_too_few(self, matches: Matches) -> bool:
        """The question to an unsure belief: where it is right, most walls in sight fit it together, were it
        in more ways than one; where it is wrong, too few do, and it may stay unsure for ever."""
        seen = matches.walls.shape[0]
        if seen >= LINES_AT_LEAST:
            placed = int((matches.walls != UNMATCHED).sum())
            self._unplaced = self._unplaced + 1 if 2 * placed < seen else 0
        return self._unplaced >= self._config.unplaced_scans

    def _contradicts(self, pose: FloatArray, ranges_m: FloatArray, spread_m: float, matches: Matches) -> bool:
        """The question to a belief that is sure of what it should see."""
        config = self._config
        fit = self._fit.of(pose, ranges_m, spread_m)
        contradicted = fit.contradicted > config.contradicted_share
        self._contradicted = self._contradicted + 1 if contradicted else 0
        unexplained = fit.explained < config.explained_share
        self._unexplained = self._unexplained + 1 if unexplained else 0
        none = matches.walls.shape[0] >= LINES_AT_LEAST and matches.count == 0
        return (
            self._contradicted >= config.contradicted_scans
            or self._unexplained >= config.explained_scans
            or (none and fit.explained < config.blatant_share)
        )

    @property
    def look_bearing_rad(self) -> float | None:
        """Direction, in the robot's frame, of what would tell the hypotheses apart; None where unknown."""
        hypotheses = self._search.rivals()
        names = tuple(hypothesis.name for hypothesis in hypotheses)
        poses = np.array([hypothesis.pose for hypothesis in hypotheses]).reshape(-1, 3)
        return self._viewpoint.bearing_rad(names, poses)

    def tell_mates(self, mates: FloatArray) -> None:
        """Where mates (K, 4) are on the map, as of ``ScanFit.mates_in_sight``."""
        self._search.mates = mates

    def move(self, odometry: OdometryIncrement) -> None:
        """Carry the hypotheses along."""
        self._search.move(odometry)

    def find(self, lines: DetectedLines, ranges_m: FloatArray) -> Hypothesis | None:
        """Weigh the hypotheses by a scan; returns the one to be believed, if there is."""
        found = self._search.look(lines, ranges_m)
        if found is not None:
            self._search.reset()
        return found
