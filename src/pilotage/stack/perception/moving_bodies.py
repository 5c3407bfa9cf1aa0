"""Who moves about where a robot knows the walls: what its map does not explain, and does not stand."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from pydantic import Field

from pilotage.core.angles import is_in_view
from pilotage.core.config import Config
from pilotage.core.types import BoolArray, FloatArray, IntArray, Pose2
from pilotage.kernels.control import movers as kernels
from pilotage.kernels.control.scan_clusters import UNUSED, cut_off
from pilotage.maps.world_map import WorldMap
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.readings import LidarScan, Readings
from pilotage.sensors.sensor import NonNegative, Positive
from pilotage.stack.interface import Belief, BeliefStatus
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.perception.movers import Movers, MoversConfig
from pilotage.stack.perception.unexplained import UnexplainedReturns

VAGUE_M = 0.3
"""Standard deviation of a track's place: what is found in the gate of a vaguer one may be another thing."""
LOOKED_RAD, LOOKED_M = 0.8, 1.0
"""Having turned or driven so far, it has seen what was behind it, or left it there."""
NEAR_M = 2.0
"""What stands so near for a while is on the map of whoever maps."""


class MovingBodiesConfig(Config):
    """What is tracked, and what counts as standing."""

    reach_m: Positive = 6.0
    tolerance_m: Positive = 0.15
    sigmas: NonNegative = 3.0
    """The tolerance grows with the pose's uncertainty by this many standard deviations."""
    walks_m_s: Positive = 0.25
    """Slower than this, and told well enough, it stands: a thing for the map."""
    stands_readings: int = Field(default=15, ge=1, le=1000)
    """So many readings somebody who walked has to be so slow."""
    parks_readings: int = Field(default=100, ge=1, le=100_000)
    """After so many it is no person any more."""
    about_s: NonNegative = 10.0
    """For so long it reckons with people after it saw one who walks, or walked a moment ago."""
    backs_after_s: NonNegative = 30.0
    """For so long it does not drive where its laser does not look, and not before it has looked around."""
    anyone_m_s: NonNegative = 1.0
    """So fast may come who is not tracked."""
    beside_m: NonNegative = 1.0
    beside_scans: int = Field(default=10, ge=1, le=1000)
    """Where people walk about, what is so near, and was not seen to stand all the time, is shown to a mapper
    in one of so many scans: what is no person is mapped all the same, later."""
    deviations: NonNegative = 2.0
    """The disc of one who walks grows by so many standard deviations of the foretold place."""
    tracks: MoversConfig = MoversConfig()


class MovingBodies:
    """Tracks narrow clusters of returns that no known wall explains (``Movers``).

    One that stands is left to the mapper; one that walks is nothing to be mapped but somebody to give way to,
    and so is, where people are about, one that is too new to tell.
    Where a robot has mates one of them may be wherever its laser does not look, seen before or not.
    Idle where told to mind nobody, without exactly one lidar, without known walls (on open ground, whose
    hazards return no beam, none are needed), or while the robot is lost.
    Groups wider than ``tracks.widest_m`` without a notch between two are left to the mapper.

    Attributes
    ----------
    shown_scans, shown_m
        In how many scans in a row something that stands near the robot was left to the mapper, not counting
        those in which it was kept from it; how far it was from the robot.
    """

    def __init__(
        self,
        config: MovingBodiesConfig,
        robot: RobotKnowledge,
        chart: WorldMap,
        *,
        minds: bool = True,
        mates: int = 0,
        unexplained: UnexplainedReturns | None = None,
    ) -> None:
        self._config = config
        self._movers = Movers(config.tracks)
        lidars = list(robot.sensors_of(LidarConfig).items())
        walls = chart.reflectors
        known = chart.open_ground or len(walls.segments_m) + len(walls.circles_m) > 0
        self._works = minds and len(lidars) == 1 and known
        self._mates = mates
        self._walks: BoolArray = np.zeros(0, np.bool_)
        self._t_s = self.seen_s = -math.inf
        self._seen_from, self._looked = Pose2(0.0, 0.0, 0.0), True
        self._field = 0.0, 0.0
        self._scans = 0
        self.shown_scans, self.shown_m = 0, math.inf
        self._loose: FloatArray = np.zeros((0, 2))
        if not self._works:
            return
        self._lidar, lidar = lidars[0]
        self._step = lidar.beam_step_rad
        angles = lidar.beam_angles_rad()
        self._field = lidar.mount.theta_rad + float(angles[0]), lidar.mount.theta_rad + float(angles[-1])
        self._reach_m = min(config.reach_m, lidar.max_range_m)
        same = unexplained is not None and (unexplained.tolerance_m, unexplained.sigmas)
        if unexplained is None or same != (config.tolerance_m, config.sigmas):
            unexplained = UnexplainedReturns(lidar, chart, config.tolerance_m, config.sigmas)
        self._unexplained = unexplained
        unexplained.look_to(config.reach_m)

    def step(self, readings: Readings, belief: Belief) -> Readings:
        """Track; returns the readings without returns of what does not stand, for a mapper."""
        scan = readings.by_sensor.get(self._lidar) if self._works else None
        if not isinstance(scan, LidarScan):
            return readings
        if belief.status is BeliefStatus.LOST:
            self._movers.forget()
            self._walks, self._loose = self._walks[:0], self._loose[:0]
            return readings
        pose, config = belief.pose, self._config
        seen = self._unexplained.of(scan, belief)
        x, y, first, points, beams = seen.x_m, seen.y_m, seen.first_rad, seen.points_m, seen.beams
        if self._unexplained.reach_m > self._reach_m:
            near = scan.ranges_m[beams] < self._reach_m
            points, beams = points[near], beams[near]
        dt_s = min(max(readings.t_s - self._t_s, 1e-3), 1.0)
        self._t_s = readings.t_s
        off = self._seen_from.inverse().compose(pose)
        self._looked |= abs(off.theta_rad) > LOOKED_RAD or math.hypot(off.x_m, off.y_m) > LOOKED_M
        if not len(points) and not len(self._movers.tracks):
            self._loose, self.shown_scans = points, 0
            return readings
        of_track = np.full(len(points), UNUSED)
        if not self.about:
            self._movers.forget(self._movers.tracks[:, kernels.PP] > VAGUE_M**2)
        # Before the first one is known nothing is taken for somebody of which only a moving part is seen.
        whole = np.ones(len(points), np.bool_) if self.about else ~self._cut_off(points, beams, scan.ranges_m)
        whole &= beside_each_other(points, beams, len(scan.ranges_m), config.tracks.gap_m)
        of_track[whole] = self._movers.track(x, y, pose.theta_rad, points[whole], dt_s, self._field)
        self._walks = self._told(pose, x, y, first, scan.ranges_m)
        walks = np.append(self._walks, False)[of_track]
        self._loose = points[walks | (of_track < 0)]
        self._scans += 1
        if self.about and self._scans % config.beside_scans:
            # Who stands and pushes next to the robot is nothing for a map, whatever his track says.
            beside = np.hypot(points[:, 0] - pose.x_m, points[:, 1] - pose.y_m) < config.beside_m
            walked = np.append(np.isnan(self._movers.tracks[:, kernels.X0]), True)
            walks |= beside & walked[of_track]
        self._count_shown(pose, of_track, walks)
        dropped = beams[walks]
        if not len(dropped):
            return readings
        ranges_m = scan.ranges_m.copy()
        ranges_m[dropped] = math.nan
        return replace(readings, by_sensor={**readings.by_sensor, self._lidar: LidarScan(ranges_m)})

    def _count_shown(self, pose: Pose2, of_track: IntArray, walks: BoolArray) -> None:
        """Count scans in which returns of something that stands near the robot are left to the mapper."""
        tracks = self._movers.tracks
        away = np.hypot(tracks[:, kernels.X] - pose.x_m, tracks[:, kernels.Y] - pose.y_m)
        stands = ~self._walks & (tracks[:, kernels.READINGS] >= self._config.stands_readings)
        near = stands & (away < NEAR_M)
        if not near.any():
            self.shown_scans = 0
        elif (np.append(near, False)[of_track] & ~walks).any():
            self.shown_scans += 1
            self.shown_m = float(away[near].min())

    def _cut_off(self, points: FloatArray, beams: IntArray, ranges_m: FloatArray) -> BoolArray:
        """Which points belong to a thing that goes on beyond the field of view, or the reach."""
        looks_around = self._field[1] - self._field[0] > 2.0 * math.pi - 1.5 * self._step
        cut: BoolArray = cut_off(
            points, beams, ranges_m, self._reach_m, self._config.tracks.gap_m, looks_around
        )
        return cut

    def _told(self, pose: Pose2, x_m: float, y_m: float, first_rad: float, ranges_m: FloatArray) -> BoolArray:
        """Which tracks do not stand; notes when somebody is there who walks beyond doubt, or did.

        What a moving robot sees of a long thing around a corner, or through a gap, moves as well: somebody
        has walked where the laser sees through the place at which he was first seen, or comes straight on,
        which hides that place. Also while he only stands and presses he has not gone.
        """
        config = self._config
        walks, people = kernels.tell_walkers(
            self._movers.tracks,
            x_m,
            y_m,
            first_rad,
            self._step,
            ranges_m,
            self.about,
            config.walks_m_s,
            config.tracks.unsure_std_m_s**2,
            config.tracks.readings,
            config.stands_readings,
            config.parks_readings,
        )
        if people:
            self.seen_s, self._seen_from, self._looked = self._t_s, pose, False
        told: BoolArray = walks
        return told

    def foretold(
        self, step_s: float, steps: int, pose: Pose2, mapped_m: FloatArray, reach_m: float
    ) -> FloatArray:
        """Discs (steps, M, 3) of those who do not stand, or walked before, after ``step_s`` and every
        ``step_s`` more.

        Where people walk about, returns within ``reach_m`` of the robot that neither the map nor its discs
        ``mapped_m`` (N, 3) explain may be somebody as well, who goes anywhere: in a group nobody is told
        apart.
        """
        if not len(self._movers.tracks) and not self.about:
            return np.empty((steps, 0, 3))
        people = self._walks | np.isnan(self._movers.tracks[:, kernels.X0])
        discs = self._movers.foretold(step_s, step_s, steps, self._config.deviations)[:, people]
        if not self.about:
            return np.ascontiguousarray(discs)
        near = kernels.off_discs(self._loose, mapped_m, pose.x_m, pose.y_m, reach_m, self._config.tolerance_m)
        grown = np.empty((steps, len(near), 3))
        grown[:, :, :2] = near
        grown[:, :, 2] = self._config.anyone_m_s * step_s * np.arange(1, steps + 1)[:, None]
        return np.concatenate([discs, grown], axis=1)

    @property
    def about(self) -> bool:
        """Whether somebody walked about a moment ago: what blocks the path may be gone soon."""
        return self._t_s - self.seen_s < self._config.about_s

    def is_new(self, x_m: float, y_m: float, reach_m: float) -> bool:
        """Whether something came into sight so near to a place that cannot be told yet from somebody."""
        tracks, config = self._movers.tracks, self._config
        new = tracks[:, kernels.READINGS] < config.stands_readings
        return bool((np.hypot(tracks[new, kernels.X] - x_m, tracks[new, kernels.Y] - y_m) < reach_m).any())

    def may_be_at(self, bearing_rad: float) -> bool:
        """Whether somebody may be in a direction of the base's frame in which the laser does not look."""
        stands = self._works and not self._sees(bearing_rad) and (self._mates > 0 or not self._looked)
        return stands or self.may_have_come_to(bearing_rad)

    def may_have_come_to(self, bearing_rad: float) -> bool:
        """The same, of those alone who walked about not long ago."""
        recent = self._works and self._t_s - self.seen_s < self._config.backs_after_s
        return recent and not self._sees(bearing_rad)

    def _sees(self, bearing_rad: float) -> bool:
        return is_in_view(bearing_rad, *self._field, self._step)

    def discs_m(self) -> FloatArray:
        """(M, 3) where they are now, of their own size."""
        tracks = self._movers.tracks[self._walks]
        radius = np.full(len(tracks), self._config.tracks.radius_m)
        return np.column_stack([tracks[:, kernels.X], tracks[:, kernels.Y], radius])

    def nearest_m(self, x_m: float, y_m: float) -> float:
        """Distance to the edge of the nearest of them; inf without any."""
        if not self._walks.any():
            return math.inf
        discs = self.discs_m()
        return float((np.hypot(discs[:, 0] - x_m, discs[:, 1] - y_m) - discs[:, 2]).min())


def beside_each_other(points: FloatArray, beams: IntArray, of: int, gap_m: float) -> BoolArray:
    """Which points (K, 2) lie within ``gap_m`` of one of a neighbouring beam; ``beams`` (K,) ``of`` so many.

    What three beams see is hit by all that lie between them. A laser that is wrong now and then has returns
    near each other whose neighbours look past them: seen through the next moment, they would have walked.
    """
    after = np.roll(np.arange(len(beams)), -1)
    joined = (beams[after] - beams) % of == 1
    joined &= np.hypot(*(points[after] - points).T) < gap_m
    paired: BoolArray = joined | np.roll(joined, 1)
    return paired
