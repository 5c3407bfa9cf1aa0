"""A small sheet with one box and one tape, and a robot on it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from pilotage.core.random import RandomStreams
from pilotage.core.types import Pose2
from pilotage.maps.true_cells import SheetFile
from pilotage.missions.sheet import DriveErrorsConfig, FirmwareConfig, SheetBodyConfig, WheelDriveConfig
from pilotage.sensors.gyroscope import GyroscopeConfig
from pilotage.sensors.infrared import InfraredConfig
from pilotage.sensors.line_sensor import LineSensorConfig
from pilotage.sensors.sensor import Mount, SensorConfig
from pilotage.sensors.wheel_encoders import WheelEncodersConfig
from pilotage.sim.sheet_simulator import SheetSimulator
from pilotage.sim.sheet_world import SheetWorld
from pilotage.stack.knowledge import SheetKnowledge

SHEET = SheetFile(
    size_m=(1.0, 0.8),
    cells=(10, 8),
    obstacles=((0.62, 0.45, 0.8, 0.6),),
    lines=(((0.2, 0.6), (0.45, 0.6)),),
)
START = Pose2(0.3, 0.3, 0.0)
TAPE_M = 0.015


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


def sheet_simulator(
    sensors: Mapping[str, SensorConfig],
    streams: RandomStreams,
    sheet: SheetFile = SHEET,
    start: Pose2 = START,
    errors: DriveErrorsConfig | None = None,
) -> SheetSimulator:
    """The robot on the sheet, at 100 Hz."""
    return SheetSimulator(
        SheetWorld.of(sheet, TAPE_M, floor_is_dark=True),
        SheetBodyConfig(),
        WheelDriveConfig(),
        DriveErrorsConfig() if errors is None else errors,
        sensors,
        start,
        0.01,
        streams,
    )


def sheet_knowledge(**changes: Any) -> SheetKnowledge:
    """What that robot knows."""
    knowledge = SheetKnowledge(
        size_m=SHEET.size_m,
        cells=SHEET.cells,
        edge_is_dark=True,
        tape_width_m=TAPE_M,
        start=START,
        body_radius_m=SheetBodyConfig().radius_m,
        drive=WheelDriveConfig(),
        sensors=sheet_sensors(),
        dt_s=0.01,
        time_limit_s=600.0,
        fusion=True,
        avoidance=True,
        firmware=FirmwareConfig(),
        streams=RandomStreams(0),
    )
    return replace(knowledge, **changes)
