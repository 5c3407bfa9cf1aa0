"""VFH+: steer into the cheapest opening of a polar histogram of what is near."""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field

from pilotage.core.config import Config
from pilotage.core.types import FloatArray, Twist
from pilotage.kernels.control.band import path_distances
from pilotage.kernels.control.polar_histogram import best_opening, binary_histogram, polar_histogram
from pilotage.kernels.geometry.motion import wrap
from pilotage.sensors.sensor import NonNegative, Positive
from pilotage.stack.control.local.command_check import first_safe, slower
from pilotage.stack.control.local.role import LOCAL_CONTROLLERS, LocalView
from pilotage.stack.control.local.rolling import Scene
from pilotage.stack.control.local.rolling_config import RollingConfig
from pilotage.stack.control.local.rolling_step import RollingController

SPACING_M, NEAREST = 0.1, 3
"""Of the path's points, and which of them is headed for where none farther is in sight."""


class VfhConfig(Config):
    """The histogram, its thresholds, what a direction costs, and how fast it is driven."""

    ground: RollingConfig = RollingConfig()
    sectors: int = Field(default=72, ge=12, le=720)
    active_m: Positive = 1.6
    margin_m: NonNegative = 0.03
    low: NonNegative = 0.05
    high: Positive = 0.15
    wide_sectors: int = Field(default=16, ge=2, le=360)
    target_cost: NonNegative = 5.0
    heading_cost: NonNegative = 2.0
    before_cost: NonNegative = 2.0
    lead_m: Positive = 1.2
    """The target is the point so far down the time to go; the goal itself would lead into every pocket."""
    turn_gain_per_s: Positive = 3.0
    turn_in_place_rad: Positive = 1.0
    headway_s: Positive = 0.3


@LOCAL_CONTROLLERS.add("vfh", VfhConfig)
class Vfh(RollingController):
    """VFH+ (Ulrich and Borenstein 1998): the robot is a disc, enlarged obstacles block directions.

    Speed: what still stops before the nearest obstacle of the chosen direction, less for a turn, and no more
    than what can be braked along the arc: a robot with weak brakes is not yet as slow as it is told to be
    when it turns. It takes the robot for its outer disc, so openings narrower than that are closed to it.
    """

    def __init__(self, config: VfhConfig, generator: np.random.Generator) -> None:
        del generator  # nothing here is drawn
        super().__init__(config.ground)
        self._config = config
        self._blocked = np.zeros(config.sectors, dtype=np.bool_)
        self._before = math.nan

    def _decide(self, view: LocalView, scene: Scene) -> Twist:
        """The histogram's command, or what can be driven of it."""
        del view
        command = self._steered(scene)
        return first_safe(scene, [*slower(command), Twist(0.0, command.w_rad_s)])

    def _steered(self, scene: Scene) -> Twist:
        config = self._config
        x, y, theta = scene.start[0], scene.start[1], scene.start[2]
        ahead = self._in_sight(scene)
        target = math.atan2(ahead[1] - y, ahead[0] - x) if scene.path.shape[0] > 1 else theta
        # What lies behind the target does not shut the way to it.
        active_m = min(config.active_m, math.hypot(ahead[0] - x, ahead[1] - y) + scene.body.outer_m)
        histogram, distance = polar_histogram(
            x, y, scene.ground, active_m, scene.body.outer_m + config.margin_m, config.sectors
        )
        self._blocked = binary_histogram(histogram, self._blocked, config.low, config.high)
        if math.isnan(self._before):
            self._before = theta
        direction, cost = best_opening(
            self._blocked,
            target,
            theta,
            self._before,
            config.wide_sectors,
            config.target_cost,
            config.heading_cost,
            config.before_cost,
        )
        if not math.isfinite(cost):
            # Shut in as a disc: turn towards the way down, which a footprint may still fit.
            return Twist(0.0, self._turn(wrap(target - theta), scene))
        self._before = direction
        off = wrap(direction - theta)
        if abs(off) > config.turn_in_place_rad:
            return Twist(0.0, self._turn(off, scene))
        width = 2.0 * math.pi / config.sectors
        facing = int(theta % (2.0 * math.pi) / width) % config.sectors
        near = min(float(distance[facing]), active_m) - scene.body.outer_m - config.margin_m
        braking = scene.drive.deceleration
        lag = braking * config.headway_s
        stops = math.sqrt(lag * lag + 2.0 * braking * max(near, 0.0)) - lag
        return Twist(min(scene.drive.speed, stops) * max(math.cos(off), 0.0), self._turn(off, scene))

    def _in_sight(self, scene: Scene) -> FloatArray:
        """The point of the path, up to the lead, that is the farthest to which the straight line is free.

        One around a corner would be aimed at through the corner.
        """
        path, config = scene.path, self._config
        keep_m = scene.body.inner_m + config.margin_m
        seen = min(NEAREST, path.shape[0] - 1)
        for last in range(min(round(config.lead_m / SPACING_M), path.shape[0] - 1), seen, -1):
            line = np.linspace(path[0], path[last], 2 * last + 1)
            if path_distances(line, scene.ground).min() >= keep_m:
                seen = last
                break
        ahead: FloatArray = path[seen]
        return ahead

    def _turn(self, off: float, scene: Scene) -> float:
        limit = scene.drive.turn_rate
        return min(max(self._config.turn_gain_per_s * off, -limit), limit)
