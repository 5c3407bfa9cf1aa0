"""The report's baseline: random wandering with one front sensor and the line sensors."""

from __future__ import annotations

from typing import ClassVar

from pilotage.core.types import STANDSTILL, BoolArray, WheelSpeeds
from pilotage.maps.cell_map import CellMap
from pilotage.maps.world_map import WorldMap
from pilotage.missions.explorer import ExplorerConfig
from pilotage.replicas.cell_marks import CellMarks
from pilotage.replicas.wheel_pose import WheelPose
from pilotage.sensors.infrared import InfraredConfig
from pilotage.sensors.line_sensor import LineSensorConfig
from pilotage.sensors.readings import InfraredReading, Readings
from pilotage.sensors.sensor import Positive
from pilotage.stack.exploration.explorer import ExplorerParts, LeftCell, offer
from pilotage.stack.interface import NAVIGATORS, Belief, StackStatus
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge, SheetKnowledge, TaskKnowledge


class RandomWalkConfig(ExplorerConfig):
    """How near something in front must be, and how the robot turns."""

    trigger_m: Positive = 0.10
    turn_every_s: Positive = 0.5
    turn_std_rad_s: Positive = 3.0
    """Every half second the wheels' speeds are moved apart by a normal draw: mostly it drives forward,
    now and then it makes a big turn."""


@NAVIGATORS.add("random-walk", RandomWalkConfig)
class RandomWalk:
    """Drives on with turns by chance, only turns before what its one front sensor sees; maps as it goes.

    It knows no sheet and no edge: what ends it is a box that the sensor's narrow beam passes by, or the
    edge. One front sensor and both line sensors are used, as in the report.
    """

    CHOOSES_PLACES: ClassVar[bool] = True
    TAKES: ClassVar = frozenset({"pose", "plan", "heading"})

    def __init__(
        self,
        config: RandomWalkConfig,
        robot: RobotKnowledge,
        chart: WorldMap,
        task: TaskKnowledge,
        parts: ExplorerParts,
        journal: Journal,
    ) -> None:
        knowledge = SheetKnowledge.of(robot, chart, task, config, "random-walk")
        offer(journal, self)
        self._channel = journal.channel({"turn_rad_s": "rad/s"})
        self._config = config
        self._drive = knowledge.drive
        infrared = knowledge.sensors_of(InfraredConfig)
        self._front = min(infrared, key=lambda name: abs(infrared[name].mount.theta_rad), default=None)
        used = {self._front, *knowledge.sensors_of(LineSensorConfig)}
        self._used = frozenset(name for name in used if name is not None)
        self._rng = knowledge.streams.stream("explorer")
        self._pose = WheelPose(knowledge, parts.heading)
        self._marks = CellMarks(knowledge)
        self._turn_every = max(1, round(config.turn_every_s / knowledge.dt_s))
        self._steps = 0
        self._turn = 0.0
        self._blocked = False

    @property
    def belief(self) -> Belief:
        """From the encoders."""
        return self._pose.belief

    @property
    def status(self) -> tuple[StackStatus, str]:
        """It never ends by itself."""
        return StackStatus.RUNNING, ""

    @property
    def cells(self) -> CellMap:
        """What it mapped on its way."""
        return self._marks.cells

    @property
    def visited(self) -> BoolArray:
        """Where it believes to have been."""
        return self._marks.visited

    @property
    def left(self) -> tuple[LeftCell, ...]:
        """It gives nothing up, because it plans nothing."""
        return ()

    def step(self, readings: Readings) -> WheelSpeeds:
        """Drive on, or turn."""
        pose = self._pose.step(readings)
        seen = Readings(
            readings.t_s, {name: r for name, r in readings.by_sensor.items() if name in self._used}
        )
        if seen.by_sensor:
            self._marks.step(seen, pose)
        if not self._pose.aligned:
            return STANDSTILL
        if self._steps % self._turn_every == 0:
            self._turn = float(self._rng.normal(0.0, self._config.turn_std_rad_s))
        self._channel.tell(self._turn)
        self._steps += 1
        self._look(seen)
        most = self._drive.max_wheel_speed_rad_s
        forward = 0.0 if self._blocked else most
        return WheelSpeeds(
            min(max(forward - self._turn, -most), most), min(max(forward + self._turn, -most), most)
        )

    def _look(self, readings: Readings) -> None:
        """Something near in front? Lines are mapped and driven over."""
        reading = None if self._front is None else readings.by_sensor.get(self._front)
        if isinstance(reading, InfraredReading):
            self._blocked = not reading.saturated and reading.range_m < self._config.trigger_m
