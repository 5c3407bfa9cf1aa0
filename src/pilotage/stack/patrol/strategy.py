"""What a patrol strategy is given and asked; the registry of strategies."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from pilotage.core.checked import Gives
from pilotage.core.misfit import told, unfit_array
from pilotage.core.registry import Registry
from pilotage.core.types import FloatArray, IntArray
from pilotage.stack.patrol.graph import PatrolGraph
from pilotage.stack.patrol.messages import NOTHING, PatrolKnowledge
from pilotage.stack.patrol.passages import OPEN, Passages


@dataclass(frozen=True, slots=True, eq=False)
class PatrolSetting:
    """What every robot is told before the patrol begins.

    Attributes
    ----------
    robot
        This robot's number.
    starts
        (N,) the vertex nearest to each robot's starting place.
    speed_m_s
        Speed at which the robots drive along edges, by their data sheets.
    begin_s
        When the patrol begins.
    rng
        This robot's own stream; what the whole team must agree on is not drawn from it.
    passages
        Where on their way there is room for one of them.
    starts_m
        (N, V) length of the path from each robot's starting place to each vertex; None: it is at its vertex.
    turn_m
        What turning back at a vertex costs, as a distance.
    visit_m
        Who is so near to a vertex visits it.
    talks
        Whether any two robots of the team could hear each other, by their data sheets.
    speeds_m_s
        (N,) of all robots as ``speed_m_s`` is this one's; None: they are as fast as this one.
    """

    graph: PatrolGraph
    robot: int
    starts: IntArray
    speed_m_s: float
    rng: np.random.Generator
    begin_s: float = 0.0
    passages: Passages = OPEN
    starts_m: FloatArray | None = None
    turn_m: float = 0.0
    visit_m: float = 0.0
    talks: bool = True
    speeds_m_s: FloatArray | None = None

    @property
    def paces(self) -> FloatArray:
        """(N,) speeds of all robots as a share of the fastest one's."""
        if self.speeds_m_s is None:
            return np.ones(self.team_size)
        return np.asarray(self.speeds_m_s / self.speeds_m_s.max())

    @property
    def team_size(self) -> int:
        """Number of robots."""
        return len(self.starts)


class Strategy(Protocol):
    """Decides for one robot, on what this robot knows. Built as ``cls(config, setting)``.

    It is asked at every vertex that the robot comes to or passes, and about once a second while it waits. One
    that knows where it goes on to may say so as well: ``Foresighted``.
    """

    def next_vertex(self, knowledge: PatrolKnowledge) -> int:
        """Where to drive now: any vertex, by the shortest path; ``knowledge.at`` is to wait there."""
        ...

    def words(self, knowledge: PatrolKnowledge) -> FloatArray:
        """(K,) what is added to this robot's messages for its like on other robots; may be empty.

        Asked after every ``next_vertex``, with its answer as the target.
        """
        ...


class Wordless:
    """Of strategies that add nothing to what every robot tells: its visits, and where it is bound for."""

    def words(self, knowledge: PatrolKnowledge) -> FloatArray:
        """Nothing."""
        del knowledge
        return NOTHING


@runtime_checkable
class Foresighted(Strategy, Protocol):
    """A strategy that knows where it will go on to: who is told so need not stop at each vertex."""

    def following(self) -> int:
        """The vertex after the one that it named last; -1 where it has not decided yet."""
        ...


@runtime_checkable
class Attentive(Strategy, Protocol):
    """A strategy that may want to be asked on the way, as what it was sent out for has proved needless."""

    @property
    def is_away(self) -> bool:
        """Whether it was sent out for such a thing; if not it is not asked."""
        ...

    def calls_back(self, knowledge: PatrolKnowledge) -> bool:
        """Whether it is to be asked now where to go."""
        ...


def following(strategy: Strategy) -> int:
    """The vertex after the one that a strategy named last, of one that knows; else -1."""
    return strategy.following() if isinstance(strategy, Foresighted) else -1


def _unfit(given: object, _: Strategy, knowledge: PatrolKnowledge) -> str:
    if isinstance(given, bool) or not isinstance(given, int | np.integer):
        return told(given)
    return "" if 0 <= given < len(knowledge.own_idleness_s) else f"{given}"


STRATEGIES: Registry[Strategy] = Registry(
    "strategy",
    "pilotage.stack.patrol.strategies",
    gives=(
        Gives("next_vertex", "a vertex's number", _unfit),
        Gives("words", "an array (K,) of finite numbers", lambda given, *_: unfit_array(given, None)),
    ),
)


def best_of(vertices: IntArray, values: FloatArray, rng: np.random.Generator) -> int:
    """The vertex (K,) of the largest value (K,); one by lot where several have it."""
    ties = vertices[values >= values.max() - 1e-12]
    return int(ties[0] if len(ties) == 1 else rng.choice(ties))
