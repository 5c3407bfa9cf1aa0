"""The one simulator beside those that it replaces: the same commands, the same robots."""

from __future__ import annotations

import math
from dataclasses import fields

import numpy as np
import pytest

from pilotage.core.random import RandomStreams
from pilotage.core.types import Pose2, Twist, WheelSpeeds
from pilotage.maps.segment_map import SegmentMap
from pilotage.maps.world_map import WorldMap
from pilotage.missions.floor import BodyConfig, MotionConfig
from pilotage.models.footprint import Footprint
from pilotage.models.motion.wheel_drive import WheelDriveConfig
from pilotage.sensors.magnetometer import MagnetometerConfig
from pilotage.sensors.readings import Readings
from pilotage.sim.simulator import Simulator as FloorSimulator
from pilotage.sim.source import Simulator
from pilotage.sim.world import World as FloorWorld
from pilotage.sim.worlds.world import World
from support.robots import BEACONS, ROOM, sensors
from support.sheets import SHEET, TAPE_M, sheet_sensors, sheet_simulator
from support.sheets import START as SHEET_START
from support.worlds import robot, sheet_map

OBSTACLE = np.array([[3.0, 5.0, 3.4, 5.4]])
COLUMN = np.array([[7.0, 4.0, 0.4]])


def said(readings: Readings) -> dict[str, list[np.ndarray]]:
    return {
        name: [np.asarray(getattr(reading, field.name)) for field in fields(reading)]
        for name, reading in readings.by_sensor.items()
    }


def test_a_floor_robot_reads_and_drives_bit_for_bit_as_before() -> None:
    start = Pose2(2.0, 2.0, 0.3)
    chart = WorldMap("room", ROOM.bounds_m, geometry=ROOM, landmarks=BEACONS)
    both = SegmentMap(np.vstack([ROOM.segments_m, OBSTACLE]), COLUMN, ROOM.bounds_m)
    old = FloorSimulator(
        FloorWorld(ROOM, both, BEACONS), BodyConfig(), MotionConfig(), sensors(), start, 0.1, RandomStreams(3)
    )
    new = Simulator(World.of(chart, OBSTACLE, COLUMN), [robot(sensors(), start=start, seed=3)], 0.1)
    rng = np.random.default_rng(0)
    for k in range(1500):
        if k % 15 == 0:
            command = Twist(float(rng.uniform(-0.4, 1.2)), float(rng.uniform(-2.0, 2.0)))
        if k == 700:
            old.body.carry_to(start)
            new.bodies[0].carry_to(start)
        before, after = said(old.step(command)), said(new.step([command])[0])
        assert old.truth == new.bodies[0].pose
        assert old.body.clearance_m == new.bodies[0].clearance_m
        assert old.body.collisions == new.bodies[0].collisions
        assert before.keys() == after.keys()
        for name, values in before.items():
            assert all((a == b).all() for a, b in zip(values, after[name], strict=True)), (k, name)
    assert old.body.collisions > 3


@pytest.mark.parametrize("seed", [0, 1])
def test_a_sheet_robot_reads_and_drives_as_before(seed: int) -> None:
    carried = {**sheet_sensors(), "magnetometer": MagnetometerConfig()}
    old = sheet_simulator(carried, RandomStreams(seed))
    spec = robot(carried, WheelDriveConfig(), Footprint.disc(0.0815), SHEET_START, seed)
    new = Simulator(World.of(sheet_map(SHEET, TAPE_M)), [spec], 0.01)
    body = new.bodies[0]
    for k in range(3000):
        # Along the sheet, and at last into the box.
        turn = 0.3 * math.sin(0.004 * k)
        command = WheelSpeeds(2.5 - turn, 2.5 + turn) if k < 2400 else WheelSpeeds(-2.0, -2.2)
        before, after = said(old.step(command)), said(new.step([command])[0])
        assert old.contacts == body.collisions
        assert old.touching is body.touching
        assert [old.truth.x_m, old.truth.y_m] == pytest.approx([body.pose.x_m, body.pose.y_m], abs=1e-9)
        # The old one adds up chords, not arcs.
        assert old.way_m == pytest.approx(body.driven_m, abs=1e-6)
        assert old.clearance_m == pytest.approx(body.clearance_m, abs=1e-9)
        assert before.keys() == after.keys()
        for name, values in before.items():
            for a, b in zip(values, after[name], strict=True):
                assert a.astype(float) == pytest.approx(b.astype(float), abs=1e-7), (k, name)
    assert body.collisions > 0
