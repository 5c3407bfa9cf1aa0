"""Pure pursuit down the time to go, its speed regulated by curvature and nearness."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.config import Config
from pilotage.core.types import Twist
from pilotage.kernels.control.band import path_distances
from pilotage.kernels.geometry.motion import wrap
from pilotage.sensors.sensor import NonNegative, Positive
from pilotage.stack.control.local.command_check import first_safe, slower
from pilotage.stack.control.local.role import LOCAL_CONTROLLERS, LocalView
from pilotage.stack.control.local.rolling import Scene
from pilotage.stack.control.local.rolling_config import RollingConfig
from pilotage.stack.control.local.rolling_step import RollingController

NEARER = (1.0, 0.5, 0.25)
"""Shares of the look-ahead distance that are tried, the farthest first."""
ALONG_RAD = 0.1
"""Nearer to the path's direction no turn on the spot leads on."""


class PursuitConfig(Config):
    """Look-ahead and the rules that slow it down."""

    ground: RollingConfig = RollingConfig(edge_m=0.08)
    """Its ways keep the margin below, and half a cell of the time to go."""
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

    Slows in curves and near obstacles, halves its speed until it can still stop on the arc it drives, looks
    nearer ahead where no such arc is free, and backs where none is. It does not leave the path for an
    obstacle, so a path that its footprint cannot follow ends in front of one.
    """

    def __init__(self, config: PursuitConfig, generator: np.random.Generator) -> None:
        del generator  # nothing here is drawn
        super().__init__(config.ground)
        self._config = config

    def _decide(self, view: LocalView, scene: Scene) -> Twist:
        """The first command after which it can still stop before what it sees.

        A chord to a point far ahead cuts the path's corners: where it is not free, the point comes nearer.
        """
        del view
        config = self._config
        look = min(max(config.look_s * abs(scene.start[3]), config.least_look_m), config.most_look_m)
        commands = [command for share in NEARER for command in self._toward(scene, share * look)]
        begins = self._bearing(scene, NEARER[-1] * look)[0]
        if abs(begins) > ALONG_RAD:
            commands.append(self._turned(begins, scene))
        return first_safe(scene, commands, config.margin_m)

    def _toward(self, scene: Scene, look_m: float) -> list[Twist]:
        """Along the arc through the point of the path so far away, ever slower, or turning towards it."""
        config, drive = self._config, scene.drive
        x, y = scene.start[:2]
        bearing, distance = self._bearing(scene, look_m)
        if abs(bearing) > config.turn_in_place_rad:
            return [self._turned(bearing, scene)]
        curvature = 2.0 * math.sin(bearing) / distance
        speed = drive.speed
        if abs(curvature) * config.radius_m > 1.0:
            speed /= abs(curvature) * config.radius_m
        near = float(path_distances(np.array([[x, y]]), scene.ground)[0]) - scene.body.inner_m
        speed *= min(1.0, max(near, 0.0) / (config.near_m - min(scene.body.inner_m, 0.9 * config.near_m)))
        speed = min(max(speed, config.least_speed_m_s), drive.speed)
        turn_rate = min(max(curvature * speed, -drive.turn_rate), drive.turn_rate)
        return slower(Twist(speed, turn_rate))

    def _bearing(self, scene: Scene, look_m: float) -> tuple[float, float]:
        """Direction, in the robot's frame, and distance of the point of the path so far away."""
        x, y, theta, _, _ = scene.start
        away = np.hypot(scene.path[:, 0] - x, scene.path[:, 1] - y)
        beyond = np.flatnonzero(away >= look_m)
        ahead = scene.path[int(beyond[0]) if beyond.size else -1]
        bearing = wrap(math.atan2(ahead[1] - y, ahead[0] - x) - theta)
        return bearing, max(math.hypot(ahead[0] - x, ahead[1] - y), 0.05)

    def _turned(self, bearing: float, scene: Scene) -> Twist:
        return Twist(0.0, math.copysign(min(scene.drive.turn_rate, 3.0 * abs(bearing)), bearing))
