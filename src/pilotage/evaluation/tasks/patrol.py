"""The task of patrolling: a team visits the places of a graph, again and again, for a given time."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import ClassVar

import numpy as np

from pilotage.core.config import Config
from pilotage.core.content import content_of
from pilotage.core.errors import InputError
from pilotage.core.types import Event, FloatArray
from pilotage.evaluation.driving import driving_metrics, header
from pilotage.evaluation.finished import FinishedRun, RobotRun, Verdict
from pilotage.evaluation.floor_ages import Eye, FloorAges
from pilotage.evaluation.guard_log import GuardLog
from pilotage.evaluation.guards import guards_of
from pilotage.evaluation.narrow_passages import cut_off
from pilotage.evaluation.patrol_visits import VisitLog
from pilotage.evaluation.stuck_watch import StuckWatch
from pilotage.evaluation.tasks.contacts import contact_words
from pilotage.evaluation.tasks.task import TASKS, Attempt, TaskSetting
from pilotage.evaluation.tasks.team import verdict
from pilotage.maps.floor import Floor
from pilotage.maps.known_maps import OncePerMap
from pilotage.missions.places import GoalConfig
from pilotage.models.motion.motion import MOTIONS, MotionConfig
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.sensor import SENSORS, NonNegative, Positive
from pilotage.stack.interface import BeliefStatus
from pilotage.stack.patrol.derive import DerivationConfig, derive_drivable
from pilotage.stack.patrol.graph import PatrolGraph
from pilotage.stack.patrol.graph_file import on_floor, read_patrol_graph
from pilotage.stack.patrol.passages import Passages
from pilotage.stack.patrol.task import PatrolSite
from pilotage.stack.patrol.tours import Round, idleness_bound_s

VISITS_EVERY_S, SEE_EVERY_S, LOOK_EVERY_S = 0.2, 0.4, 1.0
"""Lasers see between two looks at everybody: a place that is passed is in view for less than a second."""
CELL_M = 0.5

_PASSAGES: OncePerMap[Passages] = OncePerMap()


class PatrolConfig(Config):
    """How long, over which places, and what counts as a visit."""

    duration_s: Positive = 3600.0
    graph: str | None = None
    """A ``.graph`` file; without one a graph is derived from the map."""
    derive: DerivationConfig = DerivationConfig()
    visit_m: Positive = 1.0
    """A place is visited by a robot whose centre is this near."""
    stuck_s: Positive = 60.0
    """A robot on duty that stays within a metre for longer is deadlocked: if nothing told it to wait, and it
    does not visit places in turn that are so near to each other that it need not leave that metre."""
    warm_s: NonNegative = 300.0
    """Idleness and coverage count from then on, or from a quarter of the duration if that is earlier."""
    window_s: Positive = 60.0
    """Of the floor the share that was seen within so long is ``coverage_fraction``."""


@TASKS.add("patrol", PatrolConfig)
class PatrolTask:
    """Done when its time is over; a success if nobody touched anything, nobody was deadlocked, and not
    everybody stood dead in the end.

    All places count as visited, and the floor as seen, when it begins.
    """

    columns: Mapping[str, str]
    goals: tuple[GoalConfig, ...]
    drives: ClassVar[bool] = True
    gives_places: ClassVar[bool] = True

    def __init__(self, config: PatrolConfig, setting: TaskSetting) -> None:
        mission = setting.mission
        if mission.team.strategy is None:
            raise InputError(
                "task 'patrol': expected team.strategy, found none; take one of 'components strategy'"
            )
        self._config, self._names = config, [robot.name for robot in mission.members]
        self._chart = setting.chart
        # From the vertices of a derived graph the floor is to be seen; at a given place somebody is to be.
        near_m = (0.5 if config.graph is None else 1.0) * config.visit_m
        lidars = [_lidars(setting, index) for index in range(len(self._names))]
        reaches_m = [max(lidar.max_range_m for lidar in own) for own in lidars if own]
        self._reach_m = max(reaches_m, default=0.0)
        least_m = min(reaches_m, default=math.inf)
        self._site, graph = _site(config, setting, max(least_m - near_m, 0.5 * least_m))
        radius_m = max(footprint.radius_m for footprint in setting.footprints)
        passages = _PASSAGES.get(
            setting.chart,
            content_of(self._site, graph, radius_m),
            lambda: Passages.of(self._site, graph, radius_m),
        )
        starts_m = _starts_m(graph, self._site, setting)
        turn_m = max(_turn_m(setting, index, near_m) for index in range(len(self._names)))
        self.patrol = PatrolSite(graph, config.visit_m, near_m, starts_m, passages, turn_m)
        self.columns, self.goals = {}, ()
        self.events: list[Event] = cut_off(self._site)
        self._visits = VisitLog(graph.vertices_xy_m, config.visit_m, len(self._names))
        self._eyes = [[Eye.of(lidar) for lidar in own] for own in lidars]
        self._floor = FloorAges(setting.chart, graph.vertices_xy_m[0], CELL_M)
        self._warm_s = min(config.warm_s, 0.25 * min(config.duration_s, mission.run.time_limit_s))
        self._failed: frozenset[str] = frozenset()
        self._dead: frozenset[int] = frozenset()
        dt_s = mission.run.dt_s
        self._visits_every, self._see_every, self._look_every = (
            max(1, round(every_s / dt_s)) for every_s in (VISITS_EVERY_S, SEE_EVERY_S, LOOK_EVERY_S)
        )
        self._guards = GuardLog(len(self._names))
        self._step = 0
        self._contacts = [0] * len(self._names)
        self._touched: list[dict[str, None]] = [{} for _ in self._names]
        self._stuck = StuckWatch(graph.vertices_xy_m, len(self._names), config.stuck_s, config.visit_m)
        self._series: list[tuple[float, float, float]] = []

    @staticmethod
    def about(config: PatrolConfig) -> tuple[float, float] | None:
        """The first vertex of a graph that is given."""
        if config.graph is None:
            return None
        x, y = read_patrol_graph(Path(config.graph)).vertices_xy_m[0].tolist()
        return x, y

    def step(self, t_s: float, attempts: Sequence[Attempt]) -> str | None:
        """Look at everybody; over when the time is."""
        self._step += 1
        if self._step % self._visits_every == 0:
            works = np.array([not attempt.body.stopped for attempt in attempts])
            self._visits.add(t_s, np.array([attempt.body.state[:2] for attempt in attempts]), works)
        if self._step % self._see_every == 0:
            for attempt, eyes in zip(attempts, self._eyes, strict=True):
                for eye in () if attempt.body.stopped else eyes:
                    self._floor.look(t_s, attempt.body, eye)
        if self._step % self._look_every == 0:
            self._look(t_s, attempts)
        self._guards.step(t_s, attempts)
        for index, attempt in enumerate(attempts):
            if attempt.body.collisions > self._contacts[index]:
                self._contacts[index] = attempt.body.collisions
                self._touched[index] |= dict.fromkeys(attempt.body.touched)
                words = f"{self._names[index]}: {contact_words(attempt.body.touched)}"
                self.events.append(Event(t_s, "collision", words))
        return "the patrol's time is over" if t_s >= self._config.duration_s - 1e-6 else None

    def _look(self, t_s: float, attempts: Sequence[Attempt]) -> None:
        """How long ago the floor was seen, how idle the places are, and who does not get on."""
        for index, attempt in enumerate(attempts):
            self._watch(index, t_s, attempt)
        self._dead = frozenset(k for k, attempt in enumerate(attempts) if attempt.body.stopped)
        self._failed = frozenset(
            attempt.body.name
            for attempt in attempts
            if attempt.body.stopped or attempt.stack.belief.status is BeliefStatus.LOST
        )
        self._floor.sample(t_s, self._config.window_s)
        idle = t_s - self._visits.last_s
        self._series.append((t_s, float(idle.mean()), float(idle.max())))

    def _watch(self, index: int, t_s: float, attempt: Attempt) -> None:
        """Note who stays where he is although nothing tells him to wait."""
        x, y = attempt.body.state[:2].tolist()
        waits = attempt.body.stopped or bool(attempt.stack.status[1])
        place, bound = self._visits.nearest(x, y), _bound(attempt)
        if self._stuck.look(index, t_s, (x, y), place, waits=waits, bound=bound):
            self.events.append(
                Event(
                    t_s,
                    "deadlock",
                    f"{self._names[index]}: has not left ({x:.1f}, {y:.1f}) "
                    f"for {t_s - self._stuck.since_s[index]:.0f} s",
                )
            )

    def row(self, index: int) -> tuple[float, ...]:  # noqa: ARG002
        """Nothing beyond what every trace has."""
        return ()

    def progress(self, attempts: Sequence[Attempt]) -> tuple[tuple[str, str], ...]:  # noqa: ARG002
        """Idleness now."""
        if not self._series:
            return ()
        _, mean_s, worst_s = self._series[-1]
        return ("idleness", f"{mean_s:.0f} s"), ("worst", f"{worst_s:.0f} s")

    def judge(self, run: FinishedRun) -> Verdict:
        """Idleness, coverage and safety of the team, driving and consistency of each."""
        judged = verdict([self._judged(run, robot, k) for k, robot in enumerate(run.robots)], run)
        speed_m_s = float(np.mean([robot.motion.top_speed_m_s for robot in run.robots]))
        strategy = run.mission.team.strategy
        graph = self.patrol.graph
        metrics = judged.metrics
        metrics |= self._in_the_end(run)
        metrics |= {
            "team_size": len(run.robots),
            "strategy": "" if strategy is None else strategy.name,
            "vertices": len(graph),
            "deadlocks": len(self._stuck.since_s),
        }
        idle, visits_min = self._visits.idleness(run.duration_s, self._warm_s)
        metrics |= {
            "idleness_mean_s": idle.mean_s,
            "idleness_worst_s": idle.worst_s,
            "idleness_std_s": idle.std_s,
            "visits_min": visits_min,
            "robots_failed": len(self._failed),
        }
        metrics["idleness_bound_s"] = idleness_bound_s(graph, len(run.robots), speed_m_s)
        metrics |= self._guards.metrics(somebody=bool(run.mission.world.people))
        metrics["floor_apart_fraction"] = self._site.apart_fraction
        metrics |= self._floor.metrics(math.ceil(self._warm_s / LOOK_EVERY_S))
        if self._reach_m > 0.0:
            least, enough = guards_of(self._chart, self._site, self._reach_m)
            metrics |= {"static_guards_bound": least, "static_guards_enough": enough}
        return Verdict(metrics, judged.columns, {**judged.extras, **self._arrays(run)})

    def _in_the_end(self, run: FinishedRun) -> dict[str, object]:
        """What the dead make of it: a team goes on without some of its robots, and not without all."""
        count, dead = len(run.robots), len(self._dead)
        harmed = any(robot.collisions for robot in run.robots) or bool(self._stuck.since_s)
        if not dead or harmed or count == 1:
            return {}
        if dead == count:
            return {"success": False, "reason": f"all {count} robots stood dead in the end"}
        return {"success": True, "reason": f"{run.ending}; {dead} of {count} robots stood dead by then"}

    def _judged(self, run: FinishedRun, robot: RobotRun, index: int) -> Verdict:
        metrics = header(run, robot)
        driven, nees = driving_metrics(run, robot)
        metrics |= driven
        if robot.collisions:
            what = f": {' and '.join(self._touched[index])}" if self._touched[index] else ""
            metrics["reason"] = f"touched something, {robot.collisions} times in all{what}"
        elif index in self._stuck.since_s:
            metrics["reason"] = f"deadlocked from {self._stuck.since_s[index]:.0f} s on"
        elif index in self._dead:
            metrics["reason"] = "it stood dead in the end"
        unharmed = robot.collisions == 0 and index not in self._stuck.since_s
        metrics["success"] = unharmed and index not in self._dead
        return Verdict(metrics, ({"nees": nees},), {})

    def _arrays(self, run: FinishedRun) -> dict[str, FloatArray]:
        """What the page draws."""
        graph, visits = self.patrol.graph, self._visits
        rows, columns = np.nonzero(np.triu(np.isfinite(graph.edges_m), 1))
        series = np.column_stack([np.array(self._series).reshape(-1, 3), self._floor.series()])
        return {
            "patrol/vertices_xy_m": graph.vertices_xy_m,
            "patrol/edges": np.column_stack([rows, columns]).astype(np.float64),
            "patrol/tour": Round.best(graph).stops.astype(np.float64),
            "patrol/visits": visits.arrivals(),
            "patrol/idleness_s": visits.idleness(run.duration_s, self._warm_s)[0].vertex_mean_s,
            "patrol/series": series,
            "patrol/cells_xy_m": self._floor.cells_xy_m,
            "patrol/cell_m": np.array(self._floor.cell_m),
            "patrol/age_s": self._floor.mean_s(),
            "patrol/last_seen_s": self._floor.seen_s,
        }


def _bound(attempt: Attempt) -> int:
    """The place that a robot says in its telemetry that it was sent to; -1 where it tells of none."""
    units = list(attempt.journal.units)
    said = attempt.journal.row[units.index("target")] if "target" in units else math.nan
    return int(said) if math.isfinite(said) else -1


def _site(config: PatrolConfig, setting: TaskSetting, reach_m: float) -> tuple[Floor, PatrolGraph]:
    """Where the largest of the robots can be, and the graph: of a file, its edges measured on the map, or one
    that is derived from the map, for who sees so far from beside its vertices."""
    radius_m = max(footprint.radius_m for footprint in setting.footprints)
    start = setting.mission.start_of(setting.mission.members[0])
    inside = None if start is None else (start.x_m, start.y_m)
    if config.graph is None:
        floor, derived = derive_drivable(setting.chart, radius_m, inside, config.derive.seeing(reach_m))
        return floor, derived.graph
    floor = Floor.of(setting.chart, radius_m, inside_xy_m=inside)
    return floor, on_floor(read_patrol_graph(Path(config.graph)), floor, config.graph)


def _starts_m(graph: PatrolGraph, floor: Floor, setting: TaskSetting) -> FloatArray:
    """(N, V) how far each robot's starting place is from each vertex, around walls."""
    starts = []
    for robot in setting.mission.members:
        start = setting.mission.start_of(robot)
        assert start is not None, "settled when the mission was built"
        starts.append((start.x_m, start.y_m))
    return floor.away_m(graph.vertices_xy_m, np.array(starts), "start of robot")


def _turn_m(setting: TaskSetting, index: int, near_m: float) -> float:
    """What a robot that turns back at a place loses by that, as a distance at full speed.

    By its data sheet, turning while it brakes and gets up speed; the way to the place and back it drives but
    to within ``near_m`` of it.
    """
    choice = setting.mission.members[index].motion
    sheet = MOTIONS.configure(choice.name, choice.parameters, f"robot {index}")
    assert isinstance(sheet, MotionConfig), "looked at when the robot was built"
    speed_m_s, rate_rad_s = sheet.top_speed_m_s, sheet.top_turn_rate_rad_s
    turn_s = math.pi / rate_rad_s + rate_rad_s / sheet.turn_acceleration_rad_s2
    return max(0.0, speed_m_s * max(speed_m_s / sheet.braking_m_s2, turn_s) - 2.0 * near_m)


def _lidars(setting: TaskSetting, index: int) -> list[LidarConfig]:
    """A robot's scanners."""
    sensors = setting.mission.members[index].sensors.items()
    sheets = [SENSORS.configure(choice.name, choice.parameters, name) for name, choice in sensors]
    return [sheet for sheet in sheets if isinstance(sheet, LidarConfig)]
