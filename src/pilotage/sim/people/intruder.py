"""Somebody who has no business here: comes in at some time, walks about or keeps out of the way."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np

from pilotage.core.config import Config
from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.kernels.people import social_force as kernels
from pilotage.missions.places import Point
from pilotage.sensors.sensor import NonNegative, Positive
from pilotage.sim.people.people import PEOPLE, Around, PeopleSetting
from pilotage.sim.people.walking_ground import WalkingGround

DOORS = 12
"""Places drawn where the mission names none."""
SUBSTEP_S, ARRIVED_M = 0.05, 0.6
FAR_M = 4.0
"""It does not come in nearer to a robot than this while there is another door."""
KEEPS_M = 0.15
"""Nobody walks into a robot that he sees: so near he comes no nearer to it."""
FORCES = kernels.Forces(0.5, 2.1, 0.3, 5.0, 0.1)


class IntruderConfig(Config):
    """When and where it comes in, how fast it is, and whether it looks out for robots."""

    plan: Literal["random", "evasive"] = "random"
    doors_m: tuple[Point, ...] = ()
    """Where it may come in, and walks to; none: some are drawn all over the floor."""
    enters_from_s: NonNegative = 30.0
    enters_until_s: NonNegative = 90.0
    speed_m_s: Positive = 1.0
    radius_m: Positive = 0.25
    looks_m: Positive = 8.0
    """An evasive one turns away from a robot that comes this near."""


@PEOPLE.add("intruder", IntruderConfig)
class Intruder:
    """One person; not there before it comes in.

    By a random plan it goes from place to place by chance. By an evasive one it goes where the way keeps
    farthest from all robots, and chooses anew when one comes near; it sees them through walls.
    """

    def __init__(self, config: IntruderConfig, setting: PeopleSetting) -> None:
        if config.enters_until_s < config.enters_from_s:
            raise InputError(
                f"{setting.where}.enters_until_s: expected {config.enters_from_s:g} s or more, "
                f"found {config.enters_until_s:g}"
            )
        self._config, self._rng = config, setting.rng
        self.radius_m: FloatArray = np.array([config.radius_m])
        ground = WalkingGround.of(setting.world, config.radius_m)
        self._doors = self._places(ground, setting)
        self._ground = ground.towards(self._doors, f"{setting.where}.doors_m")
        self._enters_s = float(setting.rng.uniform(config.enters_from_s, config.enters_until_s))
        self._walker: FloatArray | None = None
        self._goal: np.ndarray[tuple[int], np.dtype[np.int64]] = np.zeros(1, dtype=np.int64)
        self._left: FloatArray = np.full(1, math.inf)
        self._t_s = self._chosen_s = 0.0

    def _places(self, ground: WalkingGround, setting: PeopleSetting) -> FloatArray:
        if self._config.doors_m:
            return np.array(self._config.doors_m, dtype=np.float64)
        x, y = setting.robots_m[0, :2].tolist()
        if not ground.has_room(x, y):
            raise InputError(f"{setting.where}.doors_m: expected places, found none; name some")
        places = ground.places_beside(x, y, DOORS, self._rng, setting.where)
        if not places:
            raise InputError(f"{setting.where}.doors_m: expected room to walk, found none; name places")
        return np.array(places)

    def step(self, t_s: float, around: Around) -> FloatArray:
        """Walk on; NaN before it comes in."""
        span, self._t_s = t_s - self._t_s, t_s
        robots = around.robots_m
        if self._walker is None:
            if t_s < self._enters_s:
                return np.full((1, 2), np.nan)
            self._walker = self._comes_in(robots)
            return self._walker[:, :2].copy()
        config = self._config
        here = self._walker[0, :2]
        if config.plan == "evasive":
            near = float(np.hypot(*(robots[:, :2] - here).T).min(initial=math.inf))
            if self._left[0] < ARRIVED_M or (near < config.looks_m and t_s - self._chosen_s > 1.0):
                self._goal[0], self._chosen_s = self._farthest(robots, here), t_s
        elif self._left[0] < ARRIVED_M:
            self._goal[0] = self._rng.integers(len(self._doors))
        others = np.concatenate([np.delete(around.people_m, around.first, axis=0), robots[:, [0, 1, 3]]])
        steps = math.ceil(span / SUBSTEP_S - 1e-9)
        for _ in range(steps):
            before = self._walker[0, :2].copy()
            kernels.walk(self._walker, self._goal, others, self._ground, FORCES, span / steps, self._left)
            self._stop_before(robots, before)
        return self._walker[:, :2].copy()

    def _stop_before(self, robots: FloatArray, before: FloatArray) -> None:
        """Take back what of the last step led nearer to a robot that he almost touches."""
        assert self._walker is not None, "it is there"
        for x, y, _, radius in robots.tolist():
            to_robot = np.array([x, y]) - before
            away = float(np.hypot(*to_robot))
            if not 0.0 < away < radius + self._config.radius_m + KEEPS_M:
                continue
            to_robot /= away
            walker = self._walker[0]
            walker[:2] -= max(0.0, float((walker[:2] - before) @ to_robot)) * to_robot
            walker[2:4] -= max(0.0, float(walker[2:4] @ to_robot)) * to_robot

    def _comes_in(self, robots: FloatArray) -> FloatArray:
        """At a door by chance, of those that no robot stands at."""
        away = np.hypot(*(self._doors[:, None, :] - robots[None, :, :2]).transpose(2, 0, 1)).min(axis=1)
        open_doors = np.flatnonzero(away >= FAR_M)
        door = int(self._rng.choice(open_doors)) if open_doors.size else int(np.argmax(away))
        self._goal[0] = self._rng.integers(len(self._doors))
        x, y = self._doors[door].tolist()
        return np.array([[x, y, 0.0, 0.0, self._config.speed_m_s, self._config.radius_m]])

    def _farthest(self, robots: FloatArray, here: FloatArray) -> int:
        """The place whose straight way keeps farthest from all robots."""
        worth = []
        for door in self._doors:
            way = here + np.linspace(0.15, 1.0, 8)[:, None] * (door - here)
            away = np.hypot(*(way[:, None, :] - robots[None, :, :2]).transpose(2, 0, 1))
            worth.append(float(away.min() + 0.5 * away[-1].min()))
        return int(np.argmax(worth))
