"""Pure pursuit down the time to go, its speed regulated by curvature and nearness."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.config import Config
from pilotage.core.types import Twist
from pilotage.kernels.control.band import path_distances
from pilotage.kernels.control.motion_limits import braking_is_free
from pilotage.kernels.geometry.motion import wrap
from pilotage.sensors.sensor import NonNegative, Positive
from pilotage.stack.control.local.role import LOCAL_CONTROLLERS, LocalView
from pilotage.stack.control.local.rolling import Scene
from pilotage.stack.control.local.rolling_config import RollingConfig
from pilotage.stack.control.local.rolling_step import RollingController


class PursuitConfig(Config):
    """Look-ahead and the rules that slow it down."""

    ground: RollingConfig = RollingConfig()
    look_s: Positive = 0.4
    least_look_m: Positive = 0.3
    most_look_m: Positive = 0.9
    turn_in_place_rad: Positive = 0.8
    radius_m: Positive = 0.9
    """Curves tighter than this are driven slower in proportion to their radius."""
    near_m: Positive = 0.5
    """Nearer to an obstacle than this it slows in proportion to the distance."""
    least_speed_m_s: Positive = 0.2
    margin_m: NonNegative = 0.03


@LOCAL_CONTROLLERS.add("pure-pursuit", PursuitConfig)
class RegulatedPursuit(RollingController):
    """Regulated pure pursuit (Macenski et al. 2023) on the way that the time to go leads.

    Slows in curves and near obstacles, and halves its speed until it can brake on the arc it drives; it does
    not leave the path for an obstacle, so a path that its footprint cannot follow ends in front of one.
    """

    def __init__(self, config: PursuitConfig, generator: np.random.Generator) -> None:
        del generator  # nothing here is drawn
        super().__init__(config.ground)
        self._config = config

    def _decide(self, view: LocalView, scene: Scene) -> Twist:
        del view
        config = self._config
        drive = scene.drive
        x, y, theta, v, _ = scene.start
        look = min(max(config.look_s * abs(v), config.least_look_m), config.most_look_m)
        away = np.hypot(scene.path[:, 0] - x, scene.path[:, 1] - y)
        beyond = np.flatnonzero(away >= look)
        ahead = scene.path[int(beyond[0]) if beyond.size else -1]
        distance = max(math.hypot(ahead[0] - x, ahead[1] - y), 0.05)
        bearing = wrap(math.atan2(ahead[1] - y, ahead[0] - x) - theta)
        if abs(bearing) > config.turn_in_place_rad:
            return Twist(0.0, math.copysign(min(drive.turn_rate, 3.0 * abs(bearing)), bearing))
        curvature = 2.0 * math.sin(bearing) / distance
        speed = drive.speed
        if abs(curvature) * config.radius_m > 1.0:
            speed /= abs(curvature) * config.radius_m
        near = float(path_distances(np.array([[x, y]]), scene.ground)[0]) - scene.body.inner_m
        speed *= min(1.0, max(near, 0.0) / (config.near_m - min(scene.body.inner_m, 0.9 * config.near_m)))
        speed = max(speed, config.least_speed_m_s)
        for _ in range(4):
            if braking_is_free(
                x,
                y,
                math.cos(theta),
                math.sin(theta),
                speed + drive.deceleration * scene.dt_s,
                (speed + drive.deceleration * scene.dt_s) * curvature,
                drive.deceleration,
                scene.body,
                scene.ground,
                config.margin_m,
            ):
                break
            speed *= 0.5
        return Twist(speed, min(max(curvature * speed, -drive.turn_rate), drive.turn_rate))
