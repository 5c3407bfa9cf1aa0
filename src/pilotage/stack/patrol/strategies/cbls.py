"""Concurrent Bayesian learning (Portugal and Rocha 2016)."""

from __future__ import annotations

import numpy as np

from pilotage.core.config import Config
from pilotage.core.types import FloatArray, IntArray
from pilotage.stack.patrol.messages import PatrolKnowledge
from pilotage.stack.patrol.strategy import STRATEGIES, PatrolSetting, Wordless

AHEAD = 0.25
"""Share of a neighbour's own neighbours in its prior."""
LEAST, MOST = 0.5, 2.0
"""Bounds of what is learnt of an edge."""


class CblsConfig(Config):
    """It has no parameters."""


@STRATEGIES.add("cbls", CblsConfig)
class CblsStrategy(Wordless):
    """CBLS: mean idleness, looking one edge ahead, times what was learnt of the edge; not where others go.

    After each decision between several neighbours the edge to the one visited least (over its degree) is
    rewarded and that to the one visited most punished, the more so the clearer the decision was (by its
    entropy).
    """

    def __init__(self, config: CblsConfig, setting: PatrolSetting) -> None:
        del config
        graph = setting.graph
        self._graph = graph
        self._learnt = np.ones((len(graph), len(graph)))
        self._degree = np.array([max(1, len(graph.neighbours(v))) for v in range(len(graph))])
        self._visits = np.zeros(len(graph))
        self._mean_s = np.zeros(len(graph))
        self._visited_s = np.full(len(graph), setting.begin_s)
        self._decided: tuple[int, IntArray, float] | None = None

    def next_vertex(self, knowledge: PatrolKnowledge) -> int:
        """The neighbour of the largest posterior; the nearer one of equals."""
        self._count(knowledge)
        if self._decided is not None and knowledge.at != self._decided[0]:
            self._learn(knowledge)
        here = knowledge.at
        beside = self._graph.neighbours(here)
        if len(beside) == 0:
            return here
        taken = np.array([state.target for state in knowledge.others()], dtype=np.int64)
        free = beside[~np.isin(beside, taken)]
        all_taken = len(free) == 0
        options = beside if all_taken else free
        if len(options) == 1:
            self._decided = None
            return int(options[0])
        mean_s = (self._mean_s * self._visits + knowledge.idleness_s) / (self._visits + 1.0)
        prior = np.array([self._prior(vertex, mean_s, taken, all_taken) for vertex in options.tolist()])
        prior = prior / prior.sum() if prior.sum() > 1e-3 else np.full(len(options), 1.0 / len(options))
        posterior = prior * self._learnt[here, options]
        share = posterior / posterior.sum()
        entropy = -float(np.sum(share * np.log(np.maximum(share, 1e-300)))) / np.log(len(options))
        self._decided = here, options, min(1.0, entropy)
        best = options[posterior >= posterior.max() - 1e-12]
        return int(best[np.argmin(self._graph.edges_m[here, best])])

    def _prior(self, vertex: int, mean_s: FloatArray, taken: IntArray, all_taken: bool) -> float:
        """Mean idleness of a vertex and, less, of the idlest of its neighbours that nobody is bound for."""
        own = float(mean_s[vertex])
        second = self._graph.neighbours(vertex)
        if len(second) == 1 or all_taken:
            return own
        second = second[~np.isin(second, taken)]
        ahead = float(mean_s[second].max()) if len(second) else 0.0
        return own if ahead <= 1e-3 else (1.0 - AHEAD) * own + AHEAD * ahead

    def _count(self, knowledge: PatrolKnowledge) -> None:
        """Visits by anybody since it was last asked, and the mean idleness that they ended."""
        new = knowledge.visited_s > self._visited_s
        ended_s = knowledge.visited_s[new] - self._visited_s[new]
        self._mean_s[new] = (self._mean_s[new] * self._visits[new] + ended_s) / (self._visits[new] + 1.0)
        self._visits[new] += 1.0
        self._visited_s = knowledge.visited_s

    def _learn(self, knowledge: PatrolKnowledge) -> None:
        """Reward and punish the edges of the last decision."""
        assert self._decided is not None
        here, options, entropy = self._decided
        self._decided = None
        visits, idle_s = self._visits[options] / self._degree[options], knowledge.idleness_s[options]
        few = options[np.lexsort((-idle_s, visits))[0]]
        many = options[np.lexsort((idle_s, -visits))[0]]
        self._learnt[here, few] += 1.0 - entropy
        self._learnt[here, many] -= 1.0 - entropy
        np.clip(self._learnt[here], LEAST, MOST, out=self._learnt[here])
