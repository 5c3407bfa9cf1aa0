"""Who moves around the robot: tracks of scan clusters, and the discs where they will be."""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field

from pilotage.core.config import Config
from pilotage.core.types import BoolArray, FloatArray, IntArray
from pilotage.kernels.control import movers as kernels
from pilotage.kernels.control.scan_clusters import UNUSED, scan_clusters
from pilotage.sensors.sensor import NonNegative, Positive


class MoversConfig(Config):
    """Clusters, tracks, and when one counts as a moving body."""

    enabled: bool = False
    """Off where nothing moves: posts that hide each other look like a body that jumps."""
    gap_m: Positive = 0.22
    widest_m: Positive = 0.8
    least_points: int = Field(default=3, ge=2, le=100)
    place_std_m: Positive = 0.08
    acceleration_std_m_s2: Positive = 0.8
    turning_std_rad_s: NonNegative = 0.4
    """Times its speed is the acceleration of a body that is faster than walkers are."""
    acceleration_lasts_s: NonNegative = 0.0
    """For how long a body keeps accelerating as it does: at least from reading to reading. The longer, the
    sooner a track follows who turns, and the less it smooths."""
    gate_std: Positive = 4.0
    likeliest: bool = False
    """Readings go to the track that makes them likeliest, not to the nearest in its standard deviations."""
    most_missed: int = Field(default=8, ge=0, le=1000)
    readings: int = Field(default=4, ge=2, le=1000)
    stands_readings: int = Field(default=200, ge=2, le=1000)
    """So often read in one place it is a thing that stands, by which the odometry may be corrected."""
    stands_m: Positive = 0.15
    radius_m: Positive = 0.25
    plan_deviations: NonNegative = 0.3
    """The disc grows by so many standard deviations of the foretold place where plans are priced: by all that
    a body may do no plan would get past it."""
    unsure_std_m_s: Positive = 0.4
    """Whose velocity is told no better than this may yet go anywhere."""
    lost_std_m: Positive = 1.0
    """Behind the robot, where its laser does not look, a track goes on unseen until its place is so vague."""


class Movers:
    """Tracks every narrow cluster of a scan: one that stands is foretold to stand, with its uncertainty."""

    def __init__(self, config: MoversConfig) -> None:
        self._config = config
        self.tracks: FloatArray = np.zeros((0, kernels.COLUMNS))
        self._things: BoolArray = np.zeros(0, np.bool_)

    def forget(self, which: BoolArray | None = None) -> None:
        """Drop ``which`` tracks (M,), or all."""
        if not len(self.tracks):
            return
        kept = np.zeros(len(self.tracks), np.bool_) if which is None else ~which
        self.tracks, self._things = self.tracks[kept], self._things[kept]

    def update(
        self,
        sensor_xy_m: tuple[float, float],
        in_base: FloatArray,
        pose: FloatArray,
        dt_s: float,
        field_rad: tuple[float, float],
    ) -> tuple[BoolArray, BoolArray]:
        """Take the scan's points (N, 2), base frame, in the order of the beams; tell which are on tracks.

        ``field_rad``: directions of the first and the last beam in the base frame.

        What has stood for long is a thing until it moves: the end of a wall, or a post, is no body.

        Returns (N,) points of bodies that count, which the obstacle grid shall not keep, and (N,) those that
        the odometry may be corrected by: of wide things, and of narrow ones that have stood for long.
        """
        config = self._config
        c, s = math.cos(pose[2]), math.sin(pose[2])
        turn = np.array([[c, s], [-s, c]])
        x, y = pose[:2] + np.array(sensor_xy_m) @ turn
        of_point = self.track(float(x), float(y), float(pose[2]), pose[:2] + in_base @ turn, dt_s, field_rad)
        tracks = self.tracks
        moved = np.hypot(
            tracks[:, kernels.X] - tracks[:, kernels.X0], tracks[:, kernels.Y] - tracks[:, kernels.Y0]
        )
        went = moved >= config.stands_m
        tracks[went, kernels.X0 : kernels.Y0 + 1] = tracks[went, kernels.X : kernels.Y + 1]
        tracks[went, kernels.READINGS] = np.minimum(tracks[went, kernels.READINGS], config.readings)
        self._things = stands = tracks[:, kernels.READINGS] >= config.stands_readings
        # One more place, for the points of no cluster.
        on_track: BoolArray = np.append(self._count() & ~stands, False)[of_point]
        still: BoolArray = np.append(stands, True)[of_point]
        return on_track, still

    def track(
        self, x_m: float, y_m: float, theta_rad: float, points: FloatArray, dt_s: float,
        field_rad: tuple[float, float],
    ) -> IntArray:  # fmt: skip
        """One step of the tracks by points (N, 2) in their frame, as a sensor at x, y saw them in turn.

        ``theta_rad``: of the base, in which ``field_rad`` are the directions of the first and the last beam.
        Returns the row of ``tracks`` of each point (N,), -1 of those of no cluster.
        """
        config = self._config
        centres, of_point = scan_clusters(
            x_m, y_m, points, config.gap_m, config.widest_m, config.least_points
        )
        kernels.keep_unseen(
            self.tracks,
            x_m,
            y_m,
            theta_rad,
            *field_rad,
            config.lost_std_m**2,
            config.readings,
            config.most_missed,
        )
        self.tracks, of_centre = kernels.track_step(
            self.tracks,
            centres,
            dt_s,
            config.place_std_m,
            config.acceleration_std_m_s2,
            config.turning_std_rad_s,
            config.acceleration_lasts_s,
            config.gate_std,
            config.likeliest,
            config.most_missed,
        )
        self._things = np.zeros(len(self.tracks), np.bool_)
        of_track: IntArray = np.append(of_centre, UNUSED)[of_point]
        return of_track

    def _count(self) -> BoolArray:
        """Which tracks have been read often enough since they moved last."""
        enough: BoolArray = self.tracks[:, kernels.READINGS] >= self._config.readings
        return enough

    def foretold(
        self, first_s: float, step_s: float, steps: int, deviations: float | None = None
    ) -> FloatArray:
        """Discs (steps, M, 3) at ``first_s`` from now and every ``step_s`` after.

        ``deviations``: for the check of a command, of whatever may yet prove to move, wider by so many
        standard deviations of the foretold place; None: as for the price of a plan.
        """
        config = self._config
        if not self.tracks.shape[0]:
            return np.zeros((steps, 0, 3))
        tracks = self.tracks[~self._things if deviations is not None else self._count() & ~self._things]
        discs: FloatArray = kernels.foretold(
            np.ascontiguousarray(tracks),
            first_s,
            step_s,
            steps,
            config.radius_m,
            config.plan_deviations if deviations is None else deviations,
            config.acceleration_std_m_s2,
            config.turning_std_rad_s,
        )
        return discs

    def new_within(self, pose: FloatArray, reach_m: float) -> bool:
        """Whether somebody of whom it cannot be told yet where he goes is so near ahead of a robot (3,)."""
        if not self.tracks.shape[0]:
            return False
        new = self.tracks[~self._things & (self.tracks[:, kernels.VV] > self._config.unsure_std_m_s**2)]
        dx, dy = new[:, kernels.X] - pose[0], new[:, kernels.Y] - pose[1]
        ahead = dx * math.cos(pose[2]) + dy * math.sin(pose[2]) > 0.0
        return bool((ahead & (np.hypot(dx, dy) < reach_m)).any())

    def unsure(self) -> BoolArray:
        """Of which of those foretold it cannot be told yet where they go."""
        unsure: BoolArray = self.tracks[~self._things, kernels.VV] > self._config.unsure_std_m_s**2
        return unsure

    def rests(self, readings: int) -> BoolArray:
        """Which of those foretold have not moved for so many readings."""
        rests: BoolArray = self.tracks[~self._things, kernels.READINGS] >= readings
        return rests

    def nearest_ahead_m(self, pose: FloatArray, walk_m_s: float, heed_s: float) -> float:
        """Distance from a robot's centre to the edge of the nearest body ahead of it; inf without any.

        ``pose``: (3,). Ahead is all before the line across the robot. Who comes faster than ``walk_m_s``
        counts as nearer by what he gains on that in ``heed_s``.
        """
        if not self.tracks.shape[0]:
            return math.inf
        bodies = self.tracks[self._count() & ~self._things]
        dx, dy = bodies[:, kernels.X] - pose[0], bodies[:, kernels.Y] - pose[1]
        away = np.hypot(dx, dy)
        comes = -(bodies[:, kernels.VX] * dx + bodies[:, kernels.VY] * dy) / np.maximum(away, 1e-6)
        away = away - heed_s * np.maximum(comes - walk_m_s, 0.0)
        ahead = dx * math.cos(pose[2]) + dy * math.sin(pose[2]) > 0.0
        return float(away[ahead].min(initial=math.inf)) - self._config.radius_m

    def nearest_m(self, x_m: float, y_m: float) -> float:
        """Distance from a point to the nearest body's edge; inf without any."""
        if not self.tracks.shape[0]:
            return math.inf
        bodies = self.tracks[self._count() & ~self._things]
        if not bodies.shape[0]:
            return math.inf
        away = np.hypot(bodies[:, kernels.X] - x_m, bodies[:, kernels.Y] - y_m)
        return float(away.min()) - self._config.radius_m
