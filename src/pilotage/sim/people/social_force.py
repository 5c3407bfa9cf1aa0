"""People who walk between doors, keep apart from each other, from walls and, if they look, from robots."""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field

from pilotage.core.config import Config
from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.kernels.people import social_force as kernels
from pilotage.missions.places import Point
from pilotage.sensors.sensor import NonNegative, Positive
from pilotage.sim.people.people import PEOPLE, Around, PeopleSetting
from pilotage.sim.people.walking_ground import WalkingGround

DOORS = 6
"""Places drawn where the mission names none."""
SUBSTEP_S = 0.05
ARRIVED_M = 0.6
FROM_ROBOTS_M = 1.5
"""Nobody begins nearer to a robot than this."""


class SocialForceConfig(Config):
    """How many, between where, how fast, and how they keep apart."""

    count: int = Field(default=8, ge=1, le=1000)
    doors_m: tuple[Point, ...] = ()
    """Places that they walk between, two or more; none: some are drawn."""
    speed_mean_m_s: Positive = 1.34
    speed_std_m_s: NonNegative = 0.26
    radius_m: Positive = 0.25
    heeds_robots: bool = True
    """Whether they give way to robots as to each other."""
    relaxation_s: Positive = 0.5
    people_m_s2: NonNegative = 2.1
    people_range_m: Positive = 0.3
    walls_m_s2: NonNegative = 5.0
    walls_range_m: Positive = 0.1


@PEOPLE.add("social-force", SocialForceConfig)
class SocialForcePeople:
    """Each goes from door to door for ever, the next one by chance (Helbing and Molnar 1995)."""

    def __init__(self, config: SocialForceConfig, setting: PeopleSetting) -> None:
        self._rng, self._heeds, self._t_s = setting.rng, config.heeds_robots, 0.0
        ground = WalkingGround.of(setting.world, config.radius_m)
        doors = self._doors(config, ground, setting)
        self._ground = ground.towards(doors, f"{setting.where}.doors_m")
        self._forces = kernels.Forces(
            config.relaxation_s,
            config.people_m_s2,
            config.people_range_m,
            config.walls_m_s2,
            config.walls_range_m,
        )
        taken = [(x, y, FROM_ROBOTS_M + radius) for x, y, _, radius in setting.robots_m.tolist()]
        rows: list[tuple[float, ...]] = []
        for _ in range(config.count):
            place = ground.random_place(self._rng, self._ground.cost[0], np.array(taken).reshape(-1, 3))
            if place is None:
                raise InputError(
                    f"{setting.where}.count: expected room for {config.count} people, "
                    f"found it for {len(rows)}"
                )
            wished = config.speed_mean_m_s + config.speed_std_m_s * self._rng.standard_normal()
            wished = min(max(wished, 0.3 * config.speed_mean_m_s), 2.0 * config.speed_mean_m_s)
            rows.append((*place.tolist(), 0.0, 0.0, wished, config.radius_m))
            taken.append((*place.tolist(), config.radius_m))
        self._walkers: FloatArray = np.array(rows)
        self._goals = self._rng.integers(len(doors), size=config.count)
        self._left: FloatArray = np.full(config.count, math.inf)
        self.radius_m: FloatArray = np.full(config.count, config.radius_m)

    def _doors(self, config: SocialForceConfig, ground: WalkingGround, setting: PeopleSetting) -> FloatArray:
        if config.doors_m:
            if len(config.doors_m) < 2:
                raise InputError(f"{setting.where}.doors_m: expected two places or more, found one")
            return np.array(config.doors_m, dtype=np.float64)
        # All of them from where the first robot can walk to, so that none is shut away.
        x, y, _, _ = setting.robots_m[0].tolist()
        if not ground.has_room(x, y):
            raise InputError(
                f"{setting.where}.doors_m: expected two places or more where the first robot stands too "
                f"narrow for a person, found none"
            )
        places = ground.places_beside(x, y, DOORS, self._rng, setting.where)
        if len(places) < 2:
            raise InputError(f"{setting.where}.doors_m: expected room to walk, found none; name places")
        return np.array(places)

    def step(self, t_s: float, around: Around) -> FloatArray:
        """Walk on."""
        span = t_s - self._t_s
        self._t_s = t_s
        own = slice(around.first, around.first + len(self.radius_m))
        others = [np.delete(around.people_m, own, axis=0)]
        if self._heeds:
            others.append(around.robots_m[:, [0, 1, 3]])
        # In one order of its numbers, whoever is there: kernels are compiled apart for the other.
        solid = np.ascontiguousarray(np.concatenate(others))
        steps = math.ceil(span / SUBSTEP_S - 1e-9)
        for _ in range(steps):
            kernels.walk(
                self._walkers,
                self._goals,
                solid,
                self._ground,
                self._forces,
                span / steps,
                self._left,
            )
        for row in np.flatnonzero(self._left < ARRIVED_M):
            self._goals[row] = self._rng.integers(len(self._ground.cost))
        return self._walkers[:, :2].copy()
