"""A patrol on the graph alone: robots move along edges, talk by radio and fail; no walls, bodies or sensors.

It leaves out what a strategy does not decide on (localization, doors in which robots meet), so that they
can be compared over many seeds before they drive whole stacks.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from pilotage.core.random import RandomStreams
from pilotage.core.types import FloatArray, IntArray
from pilotage.stack.patrol.graph import PatrolGraph
from pilotage.stack.patrol.messages import PatrolMemory, PatrolMessage
from pilotage.stack.patrol.strategy import Attentive, PatrolSetting, Strategy

WAIT_S = 1.0
"""A robot that waits is asked again so often."""
SPEED_SHARE = 0.2
"""Of the last edge in the speed made good: a mean over some five edges."""


@dataclass(frozen=True, slots=True)
class Radio:
    """What becomes of a broadcast: it reaches those within range, each by lot, after a delay."""

    range_m: float = math.inf
    loss: float = 0.0
    delay_s: float = 0.0
    period_s: float = 5.0

    @property
    def works(self) -> bool:
        """Whether any broadcast ever reaches anybody."""
        return self.range_m > 0.0 and self.loss < 1.0


IDEAL_RADIO = Radio()


@dataclass(frozen=True, slots=True, eq=False)
class GraphPatrol:
    """One trial.

    Attributes
    ----------
    starts
        (N,) vertex of each robot.
    speed_m_s
        Along edges; an edge takes its length over it times a log-normal factor of median 1.
    edge_std, robot_std
        Standard deviations of the factor's logarithm, drawn for each edge driven and once for each robot.
    stop_s
        Lost at each vertex: turning.
    failures
        Robots that stop for good, and when.
    """

    graph: PatrolGraph
    starts: IntArray
    duration_s: float
    speed_m_s: float = 0.5
    edge_std: float = 0.1
    robot_std: float = 0.03
    stop_s: float = 0.0
    radio: Radio = IDEAL_RADIO
    failures: tuple[tuple[int, float], ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Visits:
    """Who was where when, in the order of time: robots (K,), vertices (K,), times (K,)."""

    robots: IntArray
    vertices: IntArray
    times_s: FloatArray


@dataclass(slots=True)
class _Robot:
    """One robot on its way from ``leaves_s`` at one vertex to ``arrives_s`` at the next."""

    strategy: Strategy
    memory: PatrolMemory
    rng: np.random.Generator
    pace: float
    here: int
    there: int
    leaves_s: float = 0.0
    arrives_s: float = 0.0
    alive: bool = True
    turned: bool = False
    goal: int = field(default=-1)


def patrol(trial: GraphPatrol, build: Callable[[PatrolSetting], Strategy], seed: int) -> Visits:
    """Run a trial with one strategy for each robot.

    Parameters
    ----------
    build
        Makes the strategy of a robot from what it is told at the beginning.
    seed
        The same seed gives a robot the same pace and the same luck on its k-th edge, whatever the strategy.
    """
    return _Run(trial, build, seed).run()


class _Run:
    """Events in the order of time: arrivals, ends of waits, broadcasts, deliveries, failures."""

    def __init__(self, trial: GraphPatrol, build: Callable[[PatrolSetting], Strategy], seed: int) -> None:
        self._trial, graph = trial, trial.graph
        streams = RandomStreams(seed)
        self._luck = streams.stream("radio")
        self._robots: list[_Robot] = []
        for index, start in enumerate(trial.starts.tolist()):
            own = streams.within(f"robot-{index}")
            rng = own.stream("strategy")
            setting = PatrolSetting(graph, index, trial.starts, trial.speed_m_s, rng, talks=trial.radio.works)
            memory = PatrolMemory(len(graph), index, len(trial.starts), start, trial.speed_m_s)
            rng = own.stream("edges")
            pace = math.exp(trial.robot_std * rng.standard_normal())
            self._robots.append(_Robot(build(setting), memory, rng, pace, start, start))
        self._queue: list[tuple[float, int, str, int, PatrolMessage | None]] = []
        self._count = 0
        self._visits: list[tuple[int, int, float]] = []

    def run(self) -> Visits:
        """Until the time is over."""
        trial = self._trial
        for index in range(len(self._robots)):
            self._push(0.0, "arrive", index)
            self._push(trial.radio.period_s * (1.0 + index / len(self._robots)), "beat", index)
        for index, t_s in trial.failures:
            self._push(t_s, "fail", index)
        while self._queue:
            t_s, _, kind, index, message = heapq.heappop(self._queue)
            if t_s > trial.duration_s:
                break
            robot = self._robots[index]
            if not robot.alive:
                continue
            if kind == "arrive":
                if t_s != robot.arrives_s:
                    continue  # it turned back on its way
                robot.here = robot.there
                robot.memory.visit(robot.here, t_s)
                self._visits.append((index, robot.here, t_s))
                self._decide(index, robot, t_s)
            elif kind == "wait":
                # Where it stands nothing is left alone.
                robot.memory.visit(robot.here, t_s)
                self._visits.append((index, robot.here, t_s))
                self._decide(index, robot, t_s)
            elif kind == "beat":
                self._broadcast(index, robot, t_s)
                self._push(t_s + trial.radio.period_s, "beat", index)
            elif kind == "fail":
                robot.alive = False
            elif message is not None:
                self._hear(index, message, t_s)
        robots, vertices, times = zip(*self._visits, strict=True)
        return Visits(np.array(robots), np.array(vertices), np.array(times))

    def _push(self, t_s: float, kind: str, index: int, message: PatrolMessage | None = None) -> None:
        self._count += 1
        heapq.heappush(self._queue, (t_s, self._count, kind, index, message))

    def _decide(self, index: int, robot: _Robot, t_s: float) -> None:
        """Ask the strategy, tell the others, drive the first edge towards its answer."""
        trial, memory = self._trial, robot.memory
        here, robot.turned = robot.here, False
        goal = robot.strategy.next_vertex(memory.knowledge(t_s))
        speed_m_s = memory.own.speed_m_s
        changed = goal != memory.own.target
        memory.bound(goal, t_s, t_s + float(trial.graph.shortest_m[here, goal]) / speed_m_s)
        memory.update(t_s, words=robot.strategy.words(memory.knowledge(t_s)))
        if changed:
            self._broadcast(index, robot, t_s)
        if goal == here:
            robot.leaves_s = robot.arrives_s = t_s
            self._push(t_s + WAIT_S, "wait", index)
            return
        robot.there = int(trial.graph.next_hop[here, goal])
        length_m = float(trial.graph.edges_m[here, robot.there])
        luck = math.exp(trial.edge_std * robot.rng.standard_normal())
        robot.leaves_s = t_s
        robot.arrives_s = t_s + trial.stop_s + length_m / trial.speed_m_s * robot.pace * luck
        made_m_s = length_m / (robot.arrives_s - t_s)
        memory.update(t_s, speed_m_s=speed_m_s + SPEED_SHARE * (made_m_s - speed_m_s))
        self._push(robot.arrives_s, "arrive", index)

    def _broadcast(self, sender: int, robot: _Robot, t_s: float) -> None:
        message, radio = robot.memory.message(t_s), self._trial.radio
        place = self._place(robot, t_s)
        for index, other in enumerate(self._robots):
            if index == sender or not other.alive:
                continue
            # Drawn for everybody, in reach or not: what is lost does not hang on where others are.
            lost = radio.loss > 0.0 and self._luck.random() < radio.loss
            near = math.isinf(radio.range_m) or math.dist(place, self._place(other, t_s)) <= radio.range_m
            if lost or not near:
                continue
            if radio.delay_s > 0.0:
                self._push(t_s + radio.delay_s, "hear", index, message)
            else:
                self._hear(index, message, t_s)

    def _hear(self, index: int, message: PatrolMessage, t_s: float) -> None:
        """News; who was sent out for what has proved needless turns back."""
        robot = self._robots[index]
        robot.memory.receive(message)
        strategy = robot.strategy
        on_its_way = robot.leaves_s < t_s < robot.arrives_s and not robot.turned
        if not (on_its_way and isinstance(strategy, Attentive) and strategy.is_away):
            return
        if strategy.calls_back(robot.memory.knowledge(t_s)):
            robot.turned, left_s = True, robot.arrives_s - t_s
            robot.here, robot.there = robot.there, robot.here
            robot.arrives_s, robot.leaves_s = t_s + t_s - robot.leaves_s, t_s - left_s
            self._push(robot.arrives_s, "arrive", index)

    def _place(self, robot: _Robot, t_s: float) -> tuple[float, float]:
        """On the straight line between its vertices."""
        places = self._trial.graph.vertices_xy_m
        takes_s = robot.arrives_s - robot.leaves_s
        share = min(1.0, max(0.0, (t_s - robot.leaves_s) / takes_s)) if takes_s > 0.0 else 0.0
        x, y = places[robot.here] + share * (places[robot.there] - places[robot.here])
        return float(x), float(y)


def spread_starts(graph: PatrolGraph, robots: int, rng: np.random.Generator) -> IntArray:
    """(N,) starting vertices by lot, each at most once while there are enough."""
    order: Sequence[int] = rng.permutation(len(graph)).tolist()
    return np.array([order[k % len(order)] for k in range(robots)], dtype=np.int64)
