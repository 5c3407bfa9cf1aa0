"""Multilevel subgraph patrolling: each robot its own share of the graph (Portugal and Rocha 2010)."""

from __future__ import annotations

import numpy as np
import scipy

from pilotage.core.config import Config
from pilotage.stack.patrol.messages import PatrolKnowledge
from pilotage.stack.patrol.partition import even_sizes, partition
from pilotage.stack.patrol.strategy import STRATEGIES, PatrolSetting, Wordless


class MspPartitionConfig(Config):
    """It has no parameters."""


@STRATEGIES.add("msp-partition", MspPartitionConfig)
class MspPartitionStrategy(Wordless):
    """Goes round the best tour of its share; shares are balanced by the lengths of their tours.

    Robots take the shares that are near to their starts. More robots than vertices share the vertices in
    turn. Nothing is told: the share of a robot that fails is left.
    """

    def __init__(self, config: MspPartitionConfig, setting: PatrolSetting) -> None:
        del config
        graph, team = setting.graph, setting.team_size
        groups = min(team, len(graph))
        rounds = partition(graph, even_sizes(groups, groups)).rounds
        away = np.array([[graph.shortest_m[s, walk.stops].min() for walk in rounds] for s in setting.starts])
        seats = np.tile(np.arange(groups), -(-team // groups))[:team]
        robots, seat = scipy.optimize.linear_sum_assignment(away[:, seats])
        walk = rounds[seats[seat[robots == setting.robot][0]]]
        self._stops = walk.stops
        self._place = int(np.argmin(graph.shortest_m[setting.starts[setting.robot], walk.stops]))

    def next_vertex(self, knowledge: PatrolKnowledge) -> int:
        """The next stop of its own tour."""
        if knowledge.at == self._stops[self._place] and len(self._stops) > 1:
            self._place = (self._place + 1) % len(self._stops)
        return int(self._stops[self._place])

    def following(self) -> int:
        """The stop after the one that it is sent to."""
        return int(self._stops[(self._place + 1) % len(self._stops)])
