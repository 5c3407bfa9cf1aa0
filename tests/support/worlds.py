"""Robots of any kind in the one simulator, for tests."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from pilotage.core.random import RandomStreams
from pilotage.core.types import Command, FloatArray, Pose2
from pilotage.maps.markings import FloorMarkings
from pilotage.maps.segment_map import SegmentMap, box_segments
from pilotage.maps.true_cells import SheetFile
from pilotage.maps.world_map import WorldMap
from pilotage.models.footprint import Footprint
from pilotage.models.motion.differential_drive import DifferentialDriveConfig
from pilotage.models.motion.motion import MotionConfig
from pilotage.sensors.readings import Readings
from pilotage.sensors.sensor import SensorConfig
from pilotage.sim.bodies.body import Body
from pilotage.sim.source import RobotSpec, Simulator
from pilotage.sim.worlds.world import World
from support.robots import BEACONS, ROOM

MARKINGS = FloorMarkings((10.0, 8.0), (20, 16), np.array([[1.0, 2.0, 4.0, 2.0]]), 0.05, True)
ROOM_MAP = WorldMap("room", ROOM.bounds_m, geometry=ROOM, landmarks=BEACONS, markings=MARKINGS)
DISC = Footprint.disc(0.3)
CAR = Footprint.polygon(np.array([[0.7, 0.25], [-0.2, 0.25], [-0.2, -0.25], [0.7, -0.25]]))
START = Pose2(2.0, 2.0, 0.0)


def robot(
    sensors: Mapping[str, SensorConfig] | None = None,
    motion: MotionConfig | None = None,
    footprint: Footprint = DISC,
    start: Pose2 = START,
    seed: int = 0,
    name: str = "robot",
) -> RobotSpec:
    """A robot; without more said the small disc with a differential drive."""
    drive = DifferentialDriveConfig() if motion is None else motion
    return RobotSpec(name, footprint, drive, {} if sensors is None else sensors, start, RandomStreams(seed))


def simulator(spec: RobotSpec | None = None, chart: WorldMap = ROOM_MAP, dt_s: float = 0.1) -> Simulator:
    """One robot alone."""
    return Simulator(World.of(chart), [robot() if spec is None else spec], dt_s)


@dataclass(frozen=True)
class Alone:
    """A simulator with one robot, stepped without lists."""

    simulator: Simulator

    @property
    def body(self) -> Body:
        """The robot's body."""
        return self.simulator.bodies[0]

    @property
    def truth(self) -> Pose2:
        """Its true pose."""
        return self.body.pose

    @property
    def t_s(self) -> float:
        """Simulated time."""
        return self.simulator.t_s

    def step(self, command: Command) -> Readings:
        """Drive one step."""
        return self.simulator.step([command])[0]


def alone(spec: RobotSpec | None = None, chart: WorldMap = ROOM_MAP, dt_s: float = 0.1) -> Alone:
    """One robot alone, stepped without lists."""
    return Alone(simulator(spec, chart, dt_s))


def sheet_map(sheet: SheetFile, tape_m: float, edge_is_dark: bool = True) -> WorldMap:
    """A sheet as layers: boxes as walls, tapes as markings."""
    boxes = [
        box_segments((a + c) / 2, (b + d) / 2, abs(c - a), abs(d - b), 0.0) for a, b, c, d in sheet.obstacles
    ]
    tapes: list[Any] = [(*start, *end) for line in sheet.lines for start, end in pairwise(line)]
    pieces: FloatArray = np.array(tapes, dtype=np.float64).reshape(-1, 4)
    bounds = (0.0, 0.0, *sheet.size_m)
    walls = SegmentMap(np.concatenate([*boxes, np.zeros((0, 4))]), np.zeros((0, 3)), bounds)
    markings = FloorMarkings(sheet.size_m, sheet.cells, pieces, tape_m, edge_is_dark)
    return WorldMap("sheet", bounds, geometry=walls, markings=markings)


def walled(world: SegmentMap) -> WorldMap:
    """Walls alone as a chart, with the room's beacons."""
    return WorldMap("walls", world.bounds_m, geometry=world, landmarks=BEACONS)
