"""Dynamic task assignment: greedy, and by auction (Farinelli, Iocchi and Nardi 2017)."""

from __future__ import annotations

import numpy as np

from pilotage.core.config import Config
from pilotage.core.types import FloatArray
from pilotage.sensors.sensor import NonNegative
from pilotage.stack.patrol.messages import PatrolKnowledge
from pilotage.stack.patrol.strategy import STRATEGIES, PatrolSetting, Wordless


class DtagConfig(Config):
    """Seconds of idleness that a second of driving outweighs: on the path, and as the crow flies from home.

    The authors' -0.75 a pixel and -5 a metre of the start, at 0.075 m a pixel and 0.5 m/s. Lower ones bring
    the worst idleness down on some floors and the mean up on most.
    """

    path_ratio: NonNegative = 5.0
    home_ratio: NonNegative = 2.5


@STRATEGIES.add("dtag", DtagConfig)
class DtagStrategy(Wordless):
    """DTA-Greedy: the vertex of most utility anywhere; one that another robot is bound for counts as visited.

    Asked on its way it keeps its target, unless a robot that is nearer to it (or has the lower number) took
    it too.
    """

    def __init__(self, config: DtagConfig, setting: PatrolSetting) -> None:
        self._config, self._graph, self._speed_m_s = config, setting.graph, setting.speed_m_s
        places = setting.graph.vertices_xy_m
        self._home_m = np.hypot(*(places - places[setting.starts[setting.robot]]).T)

    def next_vertex(self, knowledge: PatrolKnowledge) -> int:
        """The vertex of the largest utility."""
        here, target = knowledge.at, knowledge.target
        if target != here and not self._is_lost(knowledge):
            return target
        idle_s = knowledge.idleness_s
        for state in knowledge.others():
            idle_s[state.target] = 0.0
        costs_s = (
            self._config.path_ratio * self._graph.shortest_m[here] + self._config.home_ratio * self._home_m
        )
        utility = idle_s - costs_s / self._speed_m_s
        utility[here] = -np.inf
        return int(np.argmax(utility)) if len(utility) > 1 else here

    def _is_lost(self, knowledge: PatrolKnowledge) -> bool:
        """Whether somebody else will be at its target before it."""
        target = knowledge.target
        mine = (
            knowledge.now_s + self._graph.shortest_m[knowledge.at, target] / self._speed_m_s,
            knowledge.robot,
        )
        return any(
            state.target == target and (state.arrives_s, state.robot) < mine for state in knowledge.others()
        )


class DtapConfig(Config):
    """Seconds of idleness that an edge on the path outweighs, for each vertex of the graph (as published)."""

    hop_s: NonNegative = 2.0


@STRATEGIES.add("dtap", DtapConfig)
class DtapStrategy:
    """DTAP: vertices go to the lowest bid, the path from a robot's centre times how many vertices it has.

    Bids for all vertices ride on every message in place of requests and answers: the same auction, held anew
    with each message. Its target is the vertex of the largest utility among its own; a neighbour whose
    idleness is two standard deviations above the mean is taken whoever owns it, if nobody is bound for it.
    """

    def __init__(self, config: DtapConfig, setting: PatrolSetting) -> None:
        graph = setting.graph
        self._config, self._graph, self._robot = config, graph, setting.robot
        count = len(graph)
        self._hops = np.zeros((count, count))
        for a in range(count):
            for b in range(count):
                self._hops[a, b] = len(graph.path(a, b)) - 1
        self._centre = int(setting.starts[setting.robot])
        self._own = np.zeros(count, np.bool_)
        self._bids = graph.shortest_m[self._centre].copy()

    def next_vertex(self, knowledge: PatrolKnowledge) -> int:
        """The vertex of the largest utility among its own."""
        here, target = knowledge.at, knowledge.target
        self._hold_auction(knowledge)
        if target != here:
            return target
        if len(self._own) == 1:
            return here
        idle_s = knowledge.idleness_s
        utility = idle_s - self._config.hop_s * len(idle_s) * self._hops[here]
        taken = [state.target for state in knowledge.others()]
        urgent = np.isfinite(self._graph.edges_m[here]) & (idle_s > idle_s.mean() + 2.0 * idle_s.std())
        urgent[taken] = False
        allowed = self._own | urgent
        allowed[here] = False
        if not allowed.any():
            allowed[:] = True
            allowed[here] = False
        return int(np.argmax(np.where(allowed, utility, -np.inf)))

    def words(self, knowledge: PatrolKnowledge) -> FloatArray:
        """(V,) its bids."""
        bids = self._bids.copy()
        bids[knowledge.target] = 0.0
        return np.asarray(bids)

    def _hold_auction(self, knowledge: PatrolKnowledge) -> None:
        """Own what nobody bids less for (the lower number of equals); then bid anew from the new centre."""
        own = np.ones(len(self._own), np.bool_)
        for state in knowledge.others():
            if len(state.words) == len(own):
                own &= (self._bids < state.words) | (
                    (self._bids == state.words) & (self._robot < state.robot)
                )
        if own.any() and not np.array_equal(own, self._own):
            tasks = np.flatnonzero(own)
            self._centre = int(tasks[np.argmin(self._graph.shortest_m[np.ix_(tasks, tasks)].sum(axis=1))])
        self._own = own
        self._bids = self._graph.shortest_m[self._centre] * (1.0 + np.count_nonzero(own))
