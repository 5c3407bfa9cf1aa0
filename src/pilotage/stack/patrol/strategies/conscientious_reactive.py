"""The neighbour that this robot has left alone for longest (Machado et al. 2002)."""

from __future__ import annotations

from pilotage.core.config import Config
from pilotage.stack.patrol.messages import PatrolKnowledge
from pilotage.stack.patrol.strategy import STRATEGIES, PatrolSetting, Wordless, best_of


class ConscientiousReactiveConfig(Config):
    """It has no parameters."""


@STRATEGIES.add("conscientious-reactive", ConscientiousReactiveConfig)
class ConscientiousReactiveStrategy(Wordless):
    """Knows its own visits only and looks no farther than one edge; ties are broken by lot."""

    def __init__(self, config: ConscientiousReactiveConfig, setting: PatrolSetting) -> None:
        del config
        self._graph, self._rng = setting.graph, setting.rng

    def next_vertex(self, knowledge: PatrolKnowledge) -> int:
        """The neighbour of the largest idleness."""
        beside = self._graph.neighbours(knowledge.at)
        return best_of(beside, knowledge.own_idleness_s[beside], self._rng) if len(beside) else knowledge.at
