"""Manners of a robot among people: how fast it may be near them, and when it had better not start."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from pilotage.kernels.control.closing_in import movers_clearance
from pilotage.stack.control.local.blind_side import blind_rad
from pilotage.stack.control.local.gap_horizon_config import GapHorizonConfig
from pilotage.stack.control.local.role import LocalView
from pilotage.stack.control.local.rolling import Scene

MOST_BLIND_RAD = math.pi / 3.0
"""To either side of straight behind: with a wider blind sector no arc is safe, and this one is taken."""
ROUND = 0.9
"""With an inner radius of this share of the outer one or more nothing swings when it turns."""


class AmongPeople:
    """What one robot remembers of people: when it saw some, where it came to since, when it last drove."""

    def __init__(self, config: GapHorizonConfig) -> None:
        self._config = config
        self._saw_people_s = -math.inf
        self._followed = False
        self._came: tuple[float, float, float] | None = None
        self._drove_s = 0.0

    def careful(self, view: LocalView, scene: Scene) -> Scene:
        """The scene with the limits that people about leave the robot."""
        config, drive = self._config, scene.drive
        if self.are_near(scene):
            drive = drive._replace(turn_rate=min(drive.turn_rate, config.calm_rad_s))
        ahead_m = scene.movers.nearest_ahead_m(scene.pose, config.walk_m_s, config.heed_s)
        if ahead_m < config.calm_m or scene.movers.new_within(scene.pose, config.new_m):
            drive = drive._replace(speed=min(drive.speed, config.calm_m_s))
        self._followed = self._may_be_followed(view, scene)
        if self._followed:
            drive = drive._replace(reverse=0.0, least_radius=self._swings_m(view, scene))
        return scene if drive is scene.drive else replace(scene, drive=drive)

    def _may_be_followed(self, view: LocalView, scene: Scene) -> bool:
        """Whether somebody whom nobody sees may be behind: where people walk, and the laser does not look."""
        x, y = float(scene.pose[0]), float(scene.pose[1])
        if math.isfinite(scene.movers.nearest_m(x, y)):
            self._saw_people_s = view.t_s
        if self._came is None or math.hypot(x - self._came[1], y - self._came[2]) > self._config.stuck_m:
            self._came = (view.t_s, x, y)
        if blind_rad(view) <= 0.0:
            return False
        return view.t_s - min(self._saw_people_s, self._came[0]) < self._config.backs_after_s

    def _swings_m(self, view: LocalView, scene: Scene) -> float:
        """Least radius of an arc on which no corner comes nearer to anybody in the sector behind."""
        body = scene.body
        if body.inner_m > ROUND * body.outer_m:
            return 0.0
        return body.outer_m / math.cos(min(0.5 * blind_rad(view), MOST_BLIND_RAD))

    def are_near(self, scene: Scene) -> bool:
        """Whether somebody is near enough for calm turns."""
        return scene.movers.nearest_m(float(scene.pose[0]), float(scene.pose[1])) < self._config.calm_m

    def must_stand(self, view: LocalView, scene: Scene) -> bool:
        """Whether a robot that does not drive has somebody so near that it had better not start.

        Somebody behind it, where its laser does not look, keeps it from nothing: it moves as if there were
        one in any case, and the place of whom it does not see grows as fast as he leaves.
        """
        config, body = self._config, scene.body
        if abs(scene.start[3]) > 0.05:
            self._drove_s = view.t_s
            return False
        now = scene.movers.foretold(0.0, scene.dt_s, 1, config.people_std)[0]
        if not now.shape[0]:
            return False
        x, y, theta = scene.pose
        dx, dy = now[:, 0] - x, now[:, 1] - y
        seen = np.ones(len(now), np.bool_)
        if self._followed:
            back = dx * math.cos(theta) + dy * math.sin(theta)
            seen = back > -math.cos(0.5 * blind_rad(view)) * np.hypot(dx, dy)
        if view.t_s - self._drove_s < config.unsure_s:
            unsure = np.hypot(dx, dy) - now[:, 2] - body.outer_m < config.unsure_m
            if (unsure & scene.movers.unsure() & seen).any():
                return True
        keep = config.stand_m
        now = now[~scene.movers.rests(config.rests_readings) & seen]
        near: float = movers_clearance(x, y, theta, body.polygon, body.outer_m, now, keep)
        return near < keep
