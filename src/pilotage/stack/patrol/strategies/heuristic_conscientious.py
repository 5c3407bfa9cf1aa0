"""The neighbour that is near and that this robot has left alone for long (Almeida 2003)."""

from __future__ import annotations

from pilotage.core.config import Config
from pilotage.stack.patrol.messages import PatrolKnowledge
from pilotage.stack.patrol.strategy import STRATEGIES, PatrolSetting, Wordless, best_of


class HeuristicConscientiousConfig(Config):
    """It has no parameters."""


@STRATEGIES.add("heuristic-conscientious", HeuristicConscientiousConfig)
class HeuristicConscientiousStrategy(Wordless):
    """Adds idleness and nearness, each as a share of the largest among neighbours; its own visits only."""

    def __init__(self, config: HeuristicConscientiousConfig, setting: PatrolSetting) -> None:
        del config
        self._graph, self._rng = setting.graph, setting.rng

    def next_vertex(self, knowledge: PatrolKnowledge) -> int:
        """The neighbour of the largest sum."""
        beside = self._graph.neighbours(knowledge.at)
        if len(beside) == 0:
            return knowledge.at
        idle_s, away_m = knowledge.own_idleness_s[beside], self._graph.edges_m[knowledge.at, beside]
        longest_s = max(float(idle_s.max()), 1e-9)
        return best_of(beside, 1.0 - away_m / away_m.max() + idle_s / longest_s, self._rng)
