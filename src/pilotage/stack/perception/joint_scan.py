"""The lasers of a robot that has several, joined to one scan for all that runs on it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from pilotage.core.types import Command, FloatArray
from pilotage.kernels.scans.joint import join_scan
from pilotage.sensors.joint_lidar import JointLidarConfig, joint_lidar
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.readings import LidarScan, Readings
from pilotage.sensors.sensor import SensorConfig
from pilotage.stack.interface import Stack, WrappedStack
from pilotage.stack.knowledge import RobotKnowledge

LEAST_STD_M = 0.0025
"""Lasers without noise see the same within a centimetre all the same: between beams a surface is a line."""


class JointScan:
    """What a robot's lasers saw in one step, as one scan from the middle between them.

    As exact as the lasers on walls; corners are cut by less than a beam's width, and what only one of them
    sees past another thing is left out where the middle does not see it. Beams that look where no laser does,
    or past the reach of the one that does, read NaN. A laser that says nothing in a step leaves its part NaN.

    Attributes
    ----------
    name, sheet
        Of the scan, as if one laser had taken it.
    """

    def __init__(self, sheet: JointLidarConfig, sensors: Mapping[str, SensorConfig]) -> None:
        self.name, self.sheet = "+".join(sheet.of), sheet
        middle = sheet.mount.pose.inverse()
        self._lasers: list[tuple[str, LidarConfig, FloatArray]] = []
        for name in sheet.of:
            laser = sensors[name]
            assert isinstance(laser, LidarConfig), "the joint sheet names lasers"
            self._lasers.append((name, laser, middle.compose(laser.mount.pose).as_array()))
        self._first_rad = float(sheet.beam_angles_rad()[0])

    @staticmethod
    def of(sensors: Mapping[str, SensorConfig]) -> JointScan | None:
        """Of all lasers among a robot's sensors; None where it has not several.

        Raises
        ------
        InputError
            Where they do not scan at the same time.
        """
        sheet = joint_lidar(sensors)
        return None if sheet is None else JointScan(sheet, sensors)

    def add(self, readings: Readings) -> Readings:
        """The readings with the joint scan, where any laser has one."""
        joint = self.sheet
        ranges_m, counts, any_scan = np.full(joint.beams, math.nan), np.zeros(joint.beams), False
        for name, sheet, mount in self._lasers:
            scan = readings.by_sensor.get(name)
            if not isinstance(scan, LidarScan):
                continue
            any_scan = True
            join_scan(
                scan.ranges_m,
                sheet.max_range_m,
                -0.5 * sheet.field_of_view_rad if sheet.beams > 1 else 0.0,
                sheet.beam_step_rad,
                mount,
                max(math.sqrt(joint.range_var_m2), LEAST_STD_M),
                sheet.max_range_m >= joint.max_range_m,
                self._first_rad,
                joint.beam_step_rad,
                joint.max_range_m,
                ranges_m,
                counts,
            )
        if not any_scan:
            return readings
        return replace(
            readings,
            by_sensor={**readings.by_sensor, self.name: LidarScan(np.minimum(ranges_m, joint.max_range_m))},
        )


class JoiningStack(WrappedStack):
    """A stack that is handed the joint scan besides."""

    def __init__(self, stack: Stack, join: JointScan) -> None:
        super().__init__(stack)
        self._join = join

    def step(self, readings: Readings) -> Command:
        """One control step."""
        return self._stack.step(self._join.add(readings))


def with_joint_lidar(robot: RobotKnowledge) -> tuple[RobotKnowledge, JointScan | None]:
    """The robot as its stack knows it, with several lasers their joint one besides; and that one."""
    join = JointScan.of(robot.sensors)
    if join is None:
        return robot, None
    return replace(robot, sensors={**robot.sensors, join.name: join.sheet}), join
