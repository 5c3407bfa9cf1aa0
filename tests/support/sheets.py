"""A small sheet with one box and one tape, and a robot on it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

import numpy as np

from pilotage.core.random import RandomStreams
from pilotage.core.types import Pose2
from pilotage.experiments.build.charts import load_chart
from pilotage.maps.true_cells import SheetFile
from pilotage.maps.world_map import WorldMap
from pilotage.missions.explorer import FirmwareConfig
from pilotage.missions.world import MarkingsConfig
from pilotage.models.footprint import Footprint
from pilotage.models.motion.wheel_drive import WheelDriveConfig, WheelErrorsConfig
from pilotage.sensors.gyroscope import GyroscopeConfig
from pilotage.sensors.infrared import InfraredConfig
from pilotage.sensors.line_sensor import LineSensorConfig
from pilotage.sensors.sensor import Mount, SensorConfig
from pilotage.sensors.wheel_encoders import WheelEncodersConfig
from pilotage.sim.source import RobotSpec, Simulator
from pilotage.sim.worlds.world import World
from pilotage.stack.interface import Belief
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge, SheetKnowledge, TaskKnowledge
from support.worlds import Alone

T = TypeVar("T")

SHEET = SheetFile(
    size_m=(1.0, 0.8),
    cells=(10, 8),
    obstacles=((0.62, 0.45, 0.8, 0.6),),
    lines=(((0.2, 0.6), (0.45, 0.6)),),
)
START = Pose2(0.3, 0.3, 0.0)
TAPE_M, RADIUS_M, DT_S = 0.015, 0.0815, 0.01


def sheet_sensors() -> dict[str, SensorConfig]:
    """Encoders, gyroscope, four infrared sensors and two line sensors, as on the Romi."""
    sensors: dict[str, SensorConfig] = {"encoders": WheelEncodersConfig(), "gyroscope": GyroscopeConfig()}
    for name, angle, reach in (
        ("ir_left", 0.785, 0.15),
        ("ir_front", 0.209, 0.3),
        ("ir_front2", -0.209, 0.3),
        ("ir_right", -0.785, 0.15),
    ):
        mount = Mount(x_m=0.08 * math.cos(angle), y_m=0.08 * math.sin(angle), theta_rad=angle)
        sensors[name] = InfraredConfig(mount=mount, reliable_range_m=reach)
    for name, y in (("line_left", 0.02), ("line_right", -0.02)):
        sensors[name] = LineSensorConfig(mount=Mount(x_m=0.07, y_m=y))
    return sensors


def sheet_chart(sheet: SheetFile = SHEET) -> WorldMap:
    """The sheet as layers; beyond its edge the floor is dark."""
    return load_chart(sheet, MarkingsConfig(tape_width_m=TAPE_M, edge_is_dark=True))


@dataclass(frozen=True)
class OnSheet(Alone):
    """The one robot on its sheet, in the one simulator."""

    @property
    def on_sheet(self) -> bool:
        """Whether its centre is on the sheet."""
        markings = self.simulator.world.chart.markings
        assert markings is not None
        return markings.holds(self.truth.x_m, self.truth.y_m)


def sheet_simulator(
    sensors: Mapping[str, SensorConfig],
    streams: RandomStreams,
    sheet: SheetFile = SHEET,
    start: Pose2 = START,
    errors: WheelErrorsConfig | None = None,
) -> OnSheet:
    """The robot on the sheet, at 100 Hz."""
    motion = WheelDriveConfig(errors=WheelErrorsConfig() if errors is None else errors)
    spec = RobotSpec("robot", Footprint.disc(RADIUS_M), motion, sensors, start, streams)
    return OnSheet(Simulator(World.of(sheet_chart(sheet)), [spec], DT_S))


def sheet_knowledge(**changes: Any) -> SheetKnowledge:
    """What that robot knows."""
    knowledge = SheetKnowledge(
        size_m=SHEET.size_m,
        cells=SHEET.cells,
        edge_is_dark=True,
        tape_width_m=TAPE_M,
        initial=Belief(START, np.zeros((3, 3))),
        body_radius_m=RADIUS_M,
        drive=WheelDriveConfig(),
        sensors=sheet_sensors(),
        dt_s=DT_S,
        time_limit_s=600.0,
        fusion=True,
        avoidance=True,
        firmware=FirmwareConfig(),
        streams=RandomStreams(0),
    )
    return replace(knowledge, **changes)


@dataclass(frozen=True)
class NoParts:
    """A mission's parts that name nothing an explorer takes."""

    heading: None = None


@dataclass(frozen=True)
class ToldOfSheet:
    """What an explorer is told before it starts: the sheet's extent and where it stands; and its journal."""

    sheet: SheetFile = SHEET
    start: Pose2 = START
    sensors: Mapping[str, SensorConfig] = field(default_factory=sheet_sensors)
    streams: RandomStreams = field(default_factory=lambda: RandomStreams(0))
    journal: Journal = field(default_factory=Journal)

    def explorer(self, factory: Callable[..., T], config: Any) -> T:
        """An explorer with this knowledge."""
        robot = RobotKnowledge(Footprint.disc(RADIUS_M), WheelDriveConfig(), self.sensors, DT_S, self.streams)
        task = TaskKnowledge(Belief(self.start, np.zeros((3, 3))), time_limit_s=600.0)
        chart = sheet_chart(self.sheet).extent_only()
        return factory(config, robot, chart, task, NoParts(), self.journal)
