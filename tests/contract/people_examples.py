"""What plans of people must do: walk at a human speed where there is room, the same way for the same seed."""

from __future__ import annotations

from typing import Any

import numpy as np

from pilotage.models.footprint import Footprint
from pilotage.sim.people.people import Around, PeopleSetting
from pilotage.sim.worlds.world import World
from support.worlds import ROOM_MAP

DT_S = 0.1


def people_walk(factory: Any, config: Any) -> None:
    """They keep out of walls, nobody jumps, somebody gets somewhere; all chance is the generator's."""
    world, robots = World.of(ROOM_MAP), np.array([[2.0, 2.0, 0.0, 0.3]])
    courses = []
    for _ in range(2):
        setting = PeopleSetting(
            world, robots, np.array([[0.0, 1.0]]), DT_S, np.random.default_rng(5), "world.people.0"
        )
        people = factory(config, setting)
        count = len(people.radius_m)
        now = np.full((count, 3), np.nan)
        course = []
        for k in range(60):
            places = people.step(k * DT_S, Around(robots, now, 0))
            assert places.shape == (count, 2)
            now = np.column_stack([places, people.radius_m])
            course.append(places)
        courses.append(np.array(course))
    assert np.array_equal(courses[0], courses[1], equal_nan=True)
    steps = np.hypot(*np.moveaxis(np.diff(courses[0], axis=0), -1, 0))
    assert np.nanmax(steps) < 3.0 * DT_S
    assert np.nansum(steps) > 1.0
    there = courses[0][np.isfinite(courses[0]).all(axis=-1)]
    poses = np.column_stack([there, np.zeros(len(there))])
    assert world.clearance_m(Footprint.disc(0.2), poses).min() > 0.0
