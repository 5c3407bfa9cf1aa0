"""Who or what a body touches is told by its name."""

from __future__ import annotations

import numpy as np
import pytest

from pilotage.core.types import Pose2, Twist, WheelSpeeds
from pilotage.experiments.loop import simulate
from pilotage.experiments.mission import mission_of
from pilotage.maps.occupancy_grid import OccupancyGrid
from pilotage.maps.world_map import WorldMap
from pilotage.models.footprint import Footprint
from pilotage.models.motion.wheel_drive import WheelDriveConfig
from pilotage.sim.source import Simulator
from pilotage.sim.worlds.world import World
from support.missions import drive
from support.people import Walker
from support.worlds import CAR, ROOM_MAP, robot

EMPTY = WorldMap("empty", (-20.0, -20.0, 20.0, 20.0))
POST = np.array([[3.0, 0.0, 0.2]])


def on(world: World, people: list[Walker] | None = None, **more: object) -> Simulator:
    """A robot that drives ahead for five seconds."""
    here = robot(start=Pose2(0.0, 0.0, 0.0), name="here", **more)  # type: ignore[arg-type]
    sim = Simulator(world, [here], 0.1, people or [], ["walker"] * len(people or []))
    for _ in range(50):
        sim.step([Twist(1.0, 0.0)])
    return sim


@pytest.mark.parametrize("shape", [Footprint.disc(0.25), CAR])
def test_what_stands_is_told_by_its_layer(shape: Footprint) -> None:
    cells = np.zeros((40, 80), dtype=np.int8)
    cells[:, 60] = 100
    grid = OccupancyGrid(cells, 0.1, Pose2(-2.0, -2.0, 0.0))
    on_grid = WorldMap("grid", (-2.0, -2.0, 6.0, 2.0), grid=grid)
    assert on(World.of(on_grid), footprint=shape).bodies[0].touched == ("an occupied cell",)
    assert on(World.of(EMPTY, obstacle_circles_m=POST), footprint=shape).bodies[0].touched == ("an obstacle",)
    in_room = Simulator(World.of(ROOM_MAP), [robot(footprint=shape, start=Pose2(2.0, 1.5, 0.0))], 0.1)
    for _ in range(100):
        in_room.step([Twist(1.0, 0.0)])
    assert in_room.bodies[0].touched == ("a wall",)


def test_nothing_is_told_before_anything_is_touched() -> None:
    sim = on(World.of(EMPTY, obstacle_circles_m=POST + 9.0))
    assert (sim.bodies[0].collisions, sim.bodies[0].touched) == (0, ())


def test_people_are_told_by_name_and_who_walked_in_is_not_blamed() -> None:
    """The second one stands in its way; the first has walked into it and is in it still."""
    people = [Walker(lambda t: (t, 0.3)), Walker(lambda _t: (3.0, 0.0))]
    sim = on(World.of(EMPTY, obstacle_circles_m=POST + 9.0), people)
    assert sim.bodies[0].collisions == 1
    assert sim.bodies[0].touched == ("person walker 2",)
    assert sim.crowd is not None
    assert (sim.crowd.encounters(0).collisions, sim.crowd.encounters(0).touches) == (1, 1)
    alone = on(World.of(EMPTY, obstacle_circles_m=POST + 9.0), people[1:])
    assert alone.bodies[0].touched == ("person walker",)


def test_a_run_says_whom_it_touched_in_its_event_and_its_reason() -> None:
    values = drive()
    values["world"]["obstacles"] = [{"kind": "circle", "centre_m": [3.0, 2.0], "radius_m": 0.2}]
    values["world"]["start"] = {"x_m": 2.0, "y_m": 2.0}
    values["stack"]["navigator"] |= {"speed_m_s": 0.5, "turn_rate_rad_s": 0.0, "duration_s": 5.0}
    run = simulate(mission_of(values)).finished
    assert [event.text for event in run.events if event.kind == "collision"] == [
        "the body touched an obstacle"
    ]
    assert ") with an obstacle after " in run.ending


def test_whoever_is_driven_into_by_wheels_that_spin_on_is_hit_and_told() -> None:
    """The centre stays where the step began, a few millimetres short of him: a wall far away was told."""
    motion = WheelDriveConfig(wheel_radius_m=0.05, wheel_separation_m=0.3, max_wheel_speed_rad_s=10.0)
    people = [Walker(lambda _t: (1.013, 0.0))]
    world = World.of(EMPTY, obstacle_circles_m=POST + 9.0)
    here = robot(motion=motion, footprint=Footprint.disc(0.25), start=Pose2(0.0, 0.0, 0.0), name="here")
    sim = Simulator(world, [here], 0.1, people, ["walker"])
    for _ in range(30):
        sim.step([WheelSpeeds(8.0, 8.0)])
    assert sim.bodies[0].collisions == 1
    assert sim.crowd is not None
    assert sim.crowd.encounters(0).collisions == 1
    assert sim.bodies[0].touched == ("person walker",)
