"""All robots on one tour, the same distance apart (Chevaleyre 2004)."""

from __future__ import annotations

from pilotage.core.config import Config
from pilotage.stack.patrol.messages import PatrolKnowledge
from pilotage.stack.patrol.strategy import STRATEGIES, PatrolSetting, Wordless
from pilotage.stack.patrol.tours import Round, spread


class CyclicConfig(Config):
    """It has no parameters."""


@STRATEGIES.add("cyclic", CyclicConfig)
class CyclicStrategy(Wordless):
    """Drives to its slot of the best closed tour, waits there until all can be at theirs, then goes round.

    Nothing is told and nothing mended: where speeds differ, gaps drift; the share of a robot that fails is
    left to those behind it.
    """

    def __init__(self, config: CyclicConfig, setting: PatrolSetting) -> None:
        del config
        self._stops = (walk := Round.best(setting.graph)).stops
        slots = spread(walk, setting.graph, setting.starts, setting.speed_m_s, setting.begin_s)
        self._place, self._leaves_s = slots[setting.robot].place, slots[setting.robot].leaves_s
        self._under_way = False

    def next_vertex(self, knowledge: PatrolKnowledge) -> int:
        """The slot's vertex at first, then the tour's next."""
        if not self._under_way:
            slot = int(self._stops[self._place])
            if knowledge.at != slot or knowledge.now_s < self._leaves_s:
                return slot
            self._under_way = True
        if knowledge.at == self._stops[self._place]:
            self._place = (self._place + 1) % len(self._stops)
        return int(self._stops[self._place])

    def following(self) -> int:
        """The stop after the one that it is sent to."""
        return int(self._stops[(self._place + 1) % len(self._stops)]) if self._under_way else -1
