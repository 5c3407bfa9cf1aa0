"""What the robot is told before it starts, apart by subject: its own data sheet, its map, its task.

The map is a ``maps.world_map.WorldMap``; there is no truth in any of the three.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TypeVar

from pilotage.core.errors import InputError
from pilotage.core.random import RandomStreams
from pilotage.core.types import FloatArray, Goal, Pose2
from pilotage.maps.cell_map import CellMap
from pilotage.maps.true_cells import true_map
from pilotage.maps.world_map import WorldMap
from pilotage.missions.explorer import ExplorerConfig, FirmwareConfig
from pilotage.models.footprint import Footprint
from pilotage.models.motion.motion import MotionConfig
from pilotage.models.motion.wheel_drive import WheelDriveConfig
from pilotage.sensors.joint_lidar import JointLidarConfig
from pilotage.sensors.sensor import SENSORS, SensorConfig
from pilotage.sensors.wheel_encoders import WheelEncodersConfig
from pilotage.stack.interface import Belief

S = TypeVar("S", bound=SensorConfig)


@dataclass(frozen=True, slots=True)
class RobotKnowledge:
    """The robot's own data sheet.

    Attributes
    ----------
    name
        As the mission calls it.
    footprint, motion, sensors
        Its outline, how it moves, and what it carries, by name; with several lasers their joint one besides.
    dt_s
        The period of a step.
    streams
        Random streams of this robot alone.
    """

    footprint: Footprint
    motion: MotionConfig
    sensors: Mapping[str, SensorConfig]
    dt_s: float
    streams: RandomStreams
    name: str = "robot"

    @property
    def radius_m(self) -> float:
        """Of the disc around the axle that holds the whole robot."""
        return self.footprint.radius_m

    def sensors_of(self, kind: type[S]) -> dict[str, S]:
        """All sensors of one kind by name; of lasers that are joined to one, that one alone."""
        joined = {
            of for config in self.sensors.values() if isinstance(config, JointLidarConfig) for of in config.of
        }
        return {
            name: config
            for name, config in self.sensors.items()
            if isinstance(config, kind) and name not in joined
        }

    def one_sensor(self, kind: type[S], needed_by: str) -> tuple[str, S]:
        """Return the only sensor of one kind.

        Raises
        ------
        InputError
            If the robot has none of them or more than one.
        """
        found = list(self.sensors_of(kind).items())
        if len(found) != 1:
            names = [entry.name for entry in SENSORS if issubclass(entry.config, kind)]
            raise InputError(
                f"{needed_by}: expected one {' or '.join(names)} among robot.sensors, "
                f"found {len(found)}; the robot has: {self._sensors_in_words() or 'none'}"
            )
        return found[0]

    def _sensors_in_words(self) -> str:
        """Each one's name, and its kind where the name does not say it: beacons may be called 'lidar'."""
        kinds = {entry.config: entry.name for entry in SENSORS}
        told = []
        for name, config in self.sensors.items():
            kind = kinds.get(type(config), name)
            told.append(name if kind == name else f"{name} ({kind})")
        return ", ".join(told)


@dataclass(frozen=True, slots=True)
class TaskKnowledge:
    """What the robot is to do, and where it believes to begin.

    Attributes
    ----------
    initial
        Belief at the start; its status is LOST where the robot is told nothing.
    goals
        Places to go to, in order; none where the task has none.
    goal_tolerance_m
        A goal is reached this near to it: the least of the goals' tolerances.
    goal_tolerance_rad
        Of the last goal's heading, where it has one; pi where any will do.
    time_limit_s
        When the run ends at the latest.
    mates
        How many other robots drive on the same floor.
    pose_given
        Tells the true pose, as a motion capture system would, to a robot that is given it; None as a rule.
    """

    initial: Belief
    goals: tuple[Goal, ...] = ()
    goal_tolerance_m: float = math.inf
    goal_tolerance_rad: float = math.pi
    time_limit_s: float = math.inf
    mates: int = 0
    pose_given: Callable[[], Pose2] | None = None

    @property
    def goal(self) -> Goal | None:
        """The first goal."""
        return self.goals[0] if self.goals else None


@dataclass(frozen=True, slots=True)
class FloorPlan:
    """What stands on a sheet, drawn by somebody else.

    Attributes
    ----------
    features
        Obstacles and lines by cells, unknown where there is nothing.
    walls_m
        (S, 4) x0, y0, x1, y1 of the obstacles' faces.
    """

    features: CellMap
    walls_m: FloatArray


@dataclass(frozen=True, slots=True)
class Given:
    """What an exploring robot is given instead of finding it out by its own modules; nothing as a rule.

    An explorer says in ``TAKES`` which of these it takes.

    Attributes
    ----------
    pose
        Where it is now, as a motion capture system over the sheet would tell.
    plan
        What stands on the sheet.
    """

    pose: Callable[[], Pose2] | None = None
    plan: FloorPlan | None = None


@dataclass(frozen=True, slots=True)
class SheetKnowledge:
    """What an exploring robot knows of itself and of the sheet: everything but what is on it.

    Attributes
    ----------
    size_m, cells
        Width and height of the sheet, and how many columns and rows its cell map has.
    edge_is_dark
        Whether its line sensors read dark beyond the edge.
    initial
        Where it was told that it begins.
    drive
        The data sheet of its drive, not the truth.
    fusion, avoidance, firmware, magnetometer
        The mission's switches.
    given
        What it need not find out by itself.
    """

    size_m: tuple[float, float]
    cells: tuple[int, int]
    edge_is_dark: bool
    tape_width_m: float
    initial: Belief
    body_radius_m: float
    drive: WheelDriveConfig
    sensors: Mapping[str, SensorConfig]
    dt_s: float
    time_limit_s: float
    fusion: bool
    avoidance: bool
    firmware: FirmwareConfig
    streams: RandomStreams
    magnetometer: bool = False
    given: Given = Given()

    def sensors_of(self, kind: type[S]) -> dict[str, S]:
        """All sensors of one kind by name."""
        return {name: config for name, config in self.sensors.items() if isinstance(config, kind)}

    @staticmethod
    def of(
        robot: RobotKnowledge, chart: WorldMap, task: TaskKnowledge, switches: ExplorerConfig, needed_by: str
    ) -> SheetKnowledge:
        """What an explorer is told, from what every robot is told.

        A chart on which walls or tapes are drawn is taken as a floor plan by somebody else.

        Raises
        ------
        InputError
            Where the world is no sheet, or the robot does not drive by its wheels' speeds or count them.
        """
        markings, motion = chart.markings, robot.motion
        if markings is None:
            raise InputError(f"{needed_by}: expected a sheet with cells as world.map, found '{chart.name}'")
        if not isinstance(motion, WheelDriveConfig):
            raise InputError(f"{needed_by}: expected robot.motion.name: wheel-drive, found another motion")
        robot.one_sensor(WheelEncodersConfig, needed_by)
        plan = None
        if markings.source is not None:
            plan = FloorPlan(true_map(markings.source).cells, chart.walls.segments_m)
        return SheetKnowledge(
            size_m=markings.size_m,
            cells=markings.cells,
            edge_is_dark=markings.edge_is_dark,
            tape_width_m=markings.tape_width_m,
            initial=task.initial,
            body_radius_m=robot.radius_m,
            drive=motion,
            sensors=robot.sensors,
            dt_s=robot.dt_s,
            time_limit_s=task.time_limit_s,
            fusion=switches.fusion,
            avoidance=switches.avoidance,
            firmware=switches.firmware,
            streams=robot.streams,
            magnetometer=switches.magnetometer,
            given=Given(task.pose_given, plan),
        )

    @property
    def cell_m(self) -> tuple[float, float]:
        """Width and height of a cell."""
        return self.size_m[0] / self.cells[0], self.size_m[1] / self.cells[1]
