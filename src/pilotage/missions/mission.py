"""A mission file: world, robot or robots, task, stack, run."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field, field_validator, model_validator

from pilotage.core.config import Config
from pilotage.core.shown import visible
from pilotage.missions.choice import ComponentChoice, by_default, laid_over
from pilotage.missions.places import GoalConfig, Point, PoseConfig
from pilotage.missions.robot import RobotConfig
from pilotage.missions.stack import StackConfig
from pilotage.missions.team import TeamConfig, with_team
from pilotage.missions.world import WorldConfig
from pilotage.sensors.sensor import NonNegative, Positive

TOP_KEYS = ("mission", "description", "plugins", "world", "robot", "robots", "team", "task", "stack", "run")
LARGEST_SEED = 2**63 - 1
"""As a database holds whole numbers."""
LONGEST_NAME = 100
"""Characters of a mission's name, which becomes a part of its folders' names."""


class RunConfig(Config):
    """Time step, time limit and seed."""

    dt_s: float = Field(default=0.1, ge=1e-4, le=1000.0)
    time_limit_s: Positive = 600.0
    seed: int = Field(default=0, ge=0, le=LARGEST_SEED)
    settle_s: NonNegative = 1.0
    """Errors count after this long: the start error is drawn, not earned."""
    record_every_s: NonNegative = 0.0
    """A row of the trace so often; 0: at every step."""
    ellipse_probability: float = Field(default=0.95, gt=0.0, lt=1.0)
    """Of the ellipses drawn and counted."""
    oracles: tuple[str, ...] = ()
    """Modules that know the truth in this run, to find out what the real ones cost."""

    @field_validator("oracles")
    @classmethod
    def _every_oracle_once(cls, names: tuple[str, ...]) -> tuple[str, ...]:
        for i, name in enumerate(names):
            if name in names[:i]:
                raise ValueError(f"expected every oracle once, found '{name}' twice")
        return names


class Mission(Config):
    """A mission, whatever its world, its robots and its task.

    ``robots`` makes it one of several: each entry is laid over ``robot``. So does ``team.size``.
    """

    mission: str = Field(min_length=1, max_length=LONGEST_NAME)
    description: str = ""
    plugins: tuple[str, ...] = ()
    """Python files that register components of their own; trusted as any code is."""
    world: WorldConfig
    robot: RobotConfig = RobotConfig()
    robots: tuple[RobotConfig, ...] = ()
    team: TeamConfig = TeamConfig()
    task: Annotated[ComponentChoice, by_default("reach")] = ComponentChoice(name="reach")
    stack: StackConfig
    run: RunConfig = RunConfig()

    @model_validator(mode="before")
    @classmethod
    def _each_over_the_common_one(cls, values: Any) -> Any:
        """Lay each entry of ``robots`` over ``robot``; without names they are numbered."""
        values = with_team(values) if isinstance(values, dict) else values
        if not isinstance(values, dict) or not isinstance(values.get("robots"), list | tuple):
            return values
        robot = values.get("robot")
        common = robot if isinstance(robot, dict) else {}
        entries = []
        for number, entry in enumerate(values["robots"]):
            if isinstance(entry, dict):
                entry = {"name": f"robot-{number}", **laid_over(common, entry)}
                if isinstance(entry.get("stack"), dict) and isinstance(values.get("stack"), dict):
                    entry["stack"] = laid_over(values["stack"], entry["stack"])
            entries.append(entry)
        return {**values, "robots": entries}

    @field_validator("mission")
    @classmethod
    def _can_be_shown(cls, name: str) -> str:
        if visible(name) != name:
            raise ValueError(f"expected a name without control characters, found '{visible(name)}'")
        return name

    @model_validator(mode="after")
    def _consistent(self) -> Mission:
        if self.run.time_limit_s < self.run.dt_s:
            raise ValueError(
                f"run.time_limit_s: expected at least one step of run.dt_s = {self.run.dt_s:g} s, "
                f"found {self.run.time_limit_s:g}"
            )
        names = [robot.name for robot in self.robots]
        if len(set(names)) < len(names):
            twice = next(name for name in names if names.count(name) > 1)
            raise ValueError(f"robots: expected every name once, found '{twice}' twice")
        if self.team.size not in (None, len(self.robots)):
            raise ValueError(
                f"team.size: expected {len(self.robots)}, as many as robots lists, or no robots, "
                f"found {self.team.size}"
            )
        if 0 < len(self.team.stations) < len(self.members):
            raise ValueError(
                f"team.stations: expected one for each of {len(self.members)} robots, or none, "
                f"found {len(self.team.stations)}"
            )
        for failure in self.team.failures:
            if failure.robot >= len(self.members):
                raise ValueError(f"team.failures: there is no robot {failure.robot} of {len(self.members)}")
        for kidnap in self.world.kidnaps:
            if kidnap.robot >= len(self.members):
                raise ValueError(f"world.kidnaps: there is no robot {kidnap.robot} of {len(self.members)}")
        return self

    @property
    def members(self) -> tuple[RobotConfig, ...]:
        """All robots: the one, or the several."""
        return self.robots or (self.robot,)

    def stack_of(self, robot: RobotConfig) -> StackConfig:
        """What runs on a robot: its own stack, else the common one."""
        return robot.stack or self.stack

    def station_of(self, index: int) -> Point | None:
        """Where a robot charges; None where it needs not to, or its start is still to be drawn."""
        if self.team.battery is None or self.team.stations:
            return self.team.stations[index] if self.team.stations else None
        start = self.start_of(self.members[index])
        return None if start is None else (start.x_m, start.y_m)

    def start_of(self, robot: RobotConfig) -> PoseConfig | None:
        """Where a robot begins: its own start, else the world's."""
        return robot.start or self.world.start

    def goal_of(self, robot: RobotConfig) -> GoalConfig | None:
        """Where a robot is to go: its own goal, else the world's."""
        return robot.goal or self.world.goal
