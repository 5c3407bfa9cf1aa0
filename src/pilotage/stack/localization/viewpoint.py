"""Where a lost robot should look next: towards the nearest place that tells its hypotheses apart."""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field

from pilotage.core.angles import wrap_to_pi
from pilotage.core.config import Config
from pilotage.core.types import FloatArray
from pilotage.kernels.lines import viewpoints
from pilotage.maps.distance_field import DistanceField
from pilotage.maps.segment_map import SegmentMap
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.sensor import NonNegative, Positive


class ViewpointConfig(Config):
    """How a telling place is searched for."""

    grid_m: Positive = 0.25
    margin_m: NonNegative = 0.12
    """Left free beside the body on the way there."""
    beams: int = Field(default=28, ge=2)
    differs_m: Positive = 0.5
    share: float = Field(default=0.08, gt=0.0, le=1.0)
    """A place is telling where this share of the beams would differ by more than ``differs_m``."""
    poses: int = Field(default=6, ge=2)
    """Hypotheses that take part, the best first."""
    most_cells: int = Field(default=6000, ge=1)
    ahead_m: Positive = 0.8
    """The robot heads for the point of the way that is this far ahead."""


class Viewpoint:
    """Plans to a telling place on the map of the best hypothesis; anew whenever the hypotheses change.

    Near the robot the hypotheses agree, or they would not all be left, so the way there is drivable for
    whichever is true; beyond that a scanner has to keep it safe.
    """

    def __init__(
        self, config: ViewpointConfig, world: SegmentMap, lidar: LidarConfig, body_radius_m: float
    ) -> None:
        self._config = config
        self._world = world
        self._half_view = 0.5 * lidar.field_of_view_rad
        self._reach = lidar.max_range_m
        field = DistanceField.from_map(world, config.grid_m)
        self._origin = field.origin_xy_m
        self._free = field.distance_m >= body_radius_m + config.margin_m
        self._path: FloatArray = np.empty((0, 2))
        self._planned_for: tuple[int, ...] = ()

    def bearing_rad(self, names: tuple[int, ...], poses: FloatArray) -> float | None:
        """Direction to drive in, in the robot's frame, for hypotheses at ``poses`` (H, 3), the best first.

        ``names`` tell the hypotheses apart from one call to the next. None with fewer than two of them,
        or where no telling place is near.
        """
        if len(names) < 2:
            return None
        names, poses = names[: self._config.poses], poses[: self._config.poses]
        if names != self._planned_for or self._arrived(poses[0]):
            self._planned_for = names
            self._path = self._plan(poses)
        if self._path.shape[0] == 0:
            return None
        away = np.hypot(*(self._path - poses[0, :2]).T)
        nearest = int(np.argmin(away))
        farther = np.flatnonzero(away[nearest:] >= self._config.ahead_m)
        target = self._path[nearest + int(farther[0])] if farther.size else self._path[-1]
        direction = math.atan2(target[1] - poses[0, 1], target[0] - poses[0, 0])
        return wrap_to_pi(direction - float(poses[0, 2]))

    def _arrived(self, pose: FloatArray) -> bool:
        end = self._path[-1:]
        return bool(end.size and math.hypot(end[0, 0] - pose[0], end[0, 1] - pose[1]) < self._config.grid_m)

    def _plan(self, poses: FloatArray) -> FloatArray:
        config = self._config
        return viewpoints.telling_path(
            self._free,
            *self._origin,
            config.grid_m,
            np.ascontiguousarray(poses),
            self._half_view,
            config.beams,
            self._reach,
            config.differs_m,
            config.share,
            config.most_cells,
            self._world.segments_m,
            self._world.circles_m,
        )
