"""What robots on patrol tell each other, and what one of them knows from its own visits and from that."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.stack.patrol.shut_paths import NONE_SHUT, ShutPaths

NOTHING: FloatArray = np.zeros(0)
NOTHING.flags.writeable = False
MOST_UNREAD = 256
"""Messages of mates to a robot that asks itself for nothing."""


@dataclass(frozen=True, slots=True, eq=False)
class PatrolState:
    """What one robot says of itself.

    Attributes
    ----------
    robot
        Its number in the team, from 0.
    t_s
        When it said so; clocks are taken to agree.
    at, target
        The vertex that it came to last, and the one that it drives to (the same while it waits there).
    arrives_s
        When it expects to be at the target.
    speed_m_s
        Speed made good along edges, stops on the path included.
    on_duty
        False while it charges or looks for its place: others take its share.
    words
        (K,) what its strategy adds for its like on other robots: bids, say.
    shut
        What bodies that stand keep it from.
    """

    robot: int
    t_s: float
    at: int
    target: int
    arrives_s: float
    speed_m_s: float
    on_duty: bool = True
    words: FloatArray = field(default_factory=lambda: NOTHING)
    shut: ShutPaths = NONE_SHUT


@dataclass(frozen=True, slots=True, eq=False)
class PatrolMessage:
    """One broadcast: what the sender saw and was told, so that news travel from robot to robot.

    Attributes
    ----------
    states
        The newest word of each robot that the sender knows of; its own among them.
    visited_s
        (V,) when each vertex was last visited by anybody, as far as the sender knows.
    told_s
        (K,) when the words were said.
    """

    sender: int
    sent_s: float
    states: tuple[PatrolState, ...]
    visited_s: FloatArray
    told_s: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class PatrolKnowledge:
    """What a strategy decides on.

    Attributes
    ----------
    now_s
        The robot's clock.
    robot
        Its number.
    at
        The vertex where it is: it came there, passes it, or waits.
    target
        Where it was bound for; ``at`` where it has arrived or never was sent.
    own_visited_s
        (V,) when this robot itself was last at each vertex; the patrol's beginning where it never was.
    visited_s
        (V,) the same of anybody, as far as it knows.
    speed_m_s
        Its speed made good along edges.
    states
        (N,) the newest word of each robot by its number, its own included; None of one never heard.
    silences_log
        (N,) logarithm of the probability that a robot's own words were not heard for so long by chance; 0
        where nothing tells.
    """

    now_s: float
    robot: int
    at: int
    target: int
    own_visited_s: FloatArray
    visited_s: FloatArray
    speed_m_s: float
    states: tuple[PatrolState | None, ...]
    silences_log: FloatArray

    @property
    def own_idleness_s(self) -> FloatArray:
        """(V,) time since this robot's own last visits."""
        return self.now_s - self.own_visited_s

    @property
    def idleness_s(self) -> FloatArray:
        """(V,) time since the last visits that it knows of."""
        return self.now_s - self.visited_s

    def others(self, silent_s: float = np.inf) -> list[PatrolState]:
        """Team mates on duty that were heard of within ``silent_s``, by their number."""
        return [
            state
            for state in self.states
            if state is not None
            and state.robot != self.robot
            and state.on_duty
            and self.now_s - state.t_s <= silent_s
        ]


class PatrolMemory:
    """Keeps what one robot knows: its visits, and what it was told. The navigator and the simulator write it.

    Parameters
    ----------
    vertices, team_size
        Numbers of vertices and robots.
    speed_m_s
        Speed to begin with, before any edge was driven.
    begin_s
        Time of the patrol's beginning; all vertices count as visited then.
    """

    def __init__(
        self, vertices: int, robot: int, team_size: int, at: int, speed_m_s: float, begin_s: float = 0.0
    ) -> None:
        self._own_s = np.full(vertices, begin_s)
        self._visited_s = np.full(vertices, begin_s)
        self._states: list[PatrolState | None] = [None] * team_size
        self._told_s = np.full(team_size, -np.inf)
        self._unread: list[PatrolMessage] = []
        self._own = PatrolState(robot, begin_s, at, at, begin_s, speed_m_s)
        self._states[robot], self._told_s[robot] = self._own, begin_s

    @property
    def own(self) -> PatrolState:
        """What it would say of itself."""
        return self._own

    def visited_s(self, vertex: int) -> float:
        """When anybody was last there, as far as it knows."""
        self._read()
        return float(self._visited_s[vertex])

    def waits(self, robot: int) -> bool:
        """Whether a robot said that it waits where it is."""
        self._read()
        state = self._states[robot]
        return state is not None and state.at == state.target

    def leave(self, vertex: int, t_s: float) -> None:
        """It goes on as if it had been there: others visit it."""
        self._tell(t_s, at=vertex)

    def visit(self, vertex: int, t_s: float) -> None:
        """It is at a vertex, to stay or on its way."""
        self._own_s[vertex] = max(self._own_s[vertex], t_s)
        self._visited_s[vertex] = max(self._visited_s[vertex], t_s)
        self.leave(vertex, t_s)

    def bound(self, target: int, t_s: float, arrives_s: float) -> None:
        """It drives to a target, or waits there."""
        self._tell(t_s, target=target, arrives_s=arrives_s)

    def update(
        self,
        t_s: float,
        *,
        speed_m_s: float | None = None,
        on_duty: bool | None = None,
        words: FloatArray | None = None,
        shut: ShutPaths | None = None,
    ) -> None:
        """Something else about itself changed.

        Every robot that hears of it is handed the same words: they are copied, for nobody to write into.
        """
        if words is not None:
            words = words.copy()
            words.flags.writeable = False
        self._tell(t_s, speed_m_s=speed_m_s, on_duty=on_duty, words=words, shut=shut)

    def receive(self, message: PatrolMessage) -> None:
        """Take in what somebody else sent: the newer word of each robot, the later visit of each vertex."""
        self._unread.append(message)
        if len(self._unread) >= MOST_UNREAD:
            self._read()

    def _read(self) -> None:
        """What came since it was asked last: a large team says more than it asks itself for."""
        if not self._unread:
            return
        unread, self._unread = self._unread, []
        for message in unread:
            np.maximum(self._visited_s, message.visited_s, out=self._visited_s)
        whole = [message for message in unread if len(message.states) == len(self._states)]
        if whole:  # in the order of the robots' numbers, and nearly all has been heard before
            told_s = np.array([message.told_s for message in whole])
            newest = told_s.argmax(axis=0)
            newer = np.flatnonzero(told_s.max(axis=0) > self._told_s)
            self._take(
                whole[m].states[k] for k, m in zip(newer.tolist(), newest[newer].tolist(), strict=True)
            )
        for message in unread:
            if len(message.states) != len(self._states):
                self._take(message.states)

    def _take(self, states: Iterable[PatrolState]) -> None:
        """Those words that are newer than what it knows."""
        for state in states:
            if state.robot != self._own.robot and state.t_s > self._told_s[state.robot]:
                self._states[state.robot], self._told_s[state.robot] = state, state.t_s

    def message(self, t_s: float) -> PatrolMessage:
        """What it sends now."""
        self._tell(t_s)
        self._read()
        states = tuple(state for state in self._states if state is not None)
        told_s = self._told_s if len(states) == len(self._told_s) else self._told_s[np.isfinite(self._told_s)]
        return PatrolMessage(self._own.robot, t_s, states, self._visited_s.copy(), told_s.copy())

    def knowledge(self, t_s: float, silences_log: FloatArray | None = None) -> PatrolKnowledge:
        """What its strategy is told."""
        self._read()
        own = self._own
        chances = np.zeros(len(self._states)) if silences_log is None else silences_log
        return PatrolKnowledge(
            t_s,
            own.robot,
            own.at,
            own.target,
            self._own_s.copy(),
            self._visited_s.copy(),
            own.speed_m_s,
            tuple(self._states),
            chances,
        )

    def _tell(
        self,
        t_s: float,
        *,
        at: int | None = None,
        target: int | None = None,
        arrives_s: float | None = None,
        speed_m_s: float | None = None,
        on_duty: bool | None = None,
        words: FloatArray | None = None,
        shut: ShutPaths | None = None,
    ) -> None:
        """It says something new of itself; the rest stays."""
        old = self._own
        self._told_s[old.robot] = t_s
        self._own = self._states[old.robot] = PatrolState(
            old.robot,
            t_s,
            old.at if at is None else at,
            old.target if target is None else target,
            old.arrives_s if arrives_s is None else arrives_s,
            old.speed_m_s if speed_m_s is None else speed_m_s,
            old.on_duty if on_duty is None else on_duty,
            old.words if words is None else words,
            old.shut if shut is None else shut,
        )
