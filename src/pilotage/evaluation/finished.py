"""A finished run in memory: what metrics are made from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from pilotage.core.types import Event, FloatArray, Pose2
from pilotage.maps.world_map import WorldMap
from pilotage.missions.mission import Mission
from pilotage.missions.places import GoalConfig
from pilotage.missions.stack import StackConfig
from pilotage.models.footprint import Footprint
from pilotage.models.motion.motion import MotionConfig
from pilotage.sim.people.crowd import Encounters
from pilotage.stack.interface import PlannedPath, StackStatus
from pilotage.stack.planning.rounds import Rounds


@dataclass(frozen=True, slots=True)
class RobotRun:
    """One robot's share of a run.

    Attributes
    ----------
    start, goal, stack
        The true start, where it was to go, and what ran on it.
    goals, rounds
        All its goals in the order in which it was to visit them; of an order that it chose, how good it is.
    trace
        Columns by name, one value a recorded step.
    plans, counts, results
        From its journal.
    status, reason
        What the robot itself says of its task.
    collisions, driven_m
        Contacts counted, and the length of the path that the body drove.
    encounters
        How it got on with people; None where there were none.
    """

    name: str
    footprint: Footprint
    motion: MotionConfig
    start: Pose2
    goal: GoalConfig | None
    goals: tuple[GoalConfig, ...]
    rounds: Rounds | None
    stack: StackConfig
    trace: dict[str, FloatArray]
    plans: Sequence[PlannedPath]
    counts: Mapping[str, int]
    results: Mapping[str, object]
    status: StackStatus
    reason: str
    collisions: int
    driven_m: float
    encounters: Encounters | None = None

    @property
    def arrived(self) -> bool:
        """Whether the robot says that it is done."""
        return self.status is StackStatus.ARRIVED


@dataclass(frozen=True, slots=True)
class FinishedRun:
    """A run with all its robots.

    Attributes
    ----------
    mission
        With its random places drawn: run again, it gives the same run.
    chart
        The world's map as it was drawn.
    obstacle_segments_m, obstacle_circles_m, obstacle_polygons_m
        What stood there beside it.
    trap_pockets_m
        The inside of each trap among it, (4, 2).
    events
        In order, of all robots.
    steps, duration_s, loop_s
        Control steps taken, simulated time, wall time of the loop without planning.
    ending
        Why the run ended, as seen from outside; empty where the robots themselves ended it.
    """

    mission: Mission
    chart: WorldMap
    obstacle_segments_m: FloatArray
    obstacle_circles_m: FloatArray
    obstacle_polygons_m: Sequence[FloatArray]
    trap_pockets_m: Sequence[FloatArray]
    robots: tuple[RobotRun, ...]
    events: list[Event]
    steps: int
    duration_s: float
    loop_s: float
    ending: str = ""


@dataclass(frozen=True, slots=True)
class Verdict:
    """What judging a run gives.

    Attributes
    ----------
    metrics
        By their JSON keys.
    columns
        One mapping a robot: what was worked out for every row of its trace, such as the NEES.
    extras
        Arrays that a report shows, by name, such as the shortest path.
    lacking
        Metrics that ask for a column that no robot's trace has, with that column.
    """

    metrics: dict[str, object]
    columns: tuple[Mapping[str, FloatArray], ...]
    extras: Mapping[str, FloatArray]
    lacking: Mapping[str, str] = field(default_factory=dict)
