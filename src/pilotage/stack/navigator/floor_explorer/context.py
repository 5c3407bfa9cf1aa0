"""What all states of the explorer share: its map, its choice of targets, and how it has fared."""

from __future__ import annotations

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.stack.exploration.floor_frontiers import SeenFloor
from pilotage.stack.interface import Belief, BeliefStatus
from pilotage.stack.journal import Journal
from pilotage.stack.localization.localizer import Abilities, Localizer
from pilotage.stack.navigator.floor_explorer.config import FloorExplorerConfig
from pilotage.stack.navigator.floor_explorer.getting_on import STALL_M, GettingOn
from pilotage.stack.navigator.floor_explorer.own_floor import OwnFloor
from pilotage.stack.navigator.floor_explorer.targets import Targets
from pilotage.stack.navigator.progress import patience_s
from pilotage.stack.navigator.state import Standing

AHEAD_M = 2.5
"""The local controller is led by a point so far ahead on the path."""
SHY_SHARE = 1.0 / 3.0
"""Where it got no farther for this share of its patience it is led along the path itself: by a point that a
line with room leads to, not by one around a corner, straight to which a gap may be too narrow for it."""


class Context(Standing):
    """The parts that the states decide by, and what is remembered from one decision to the next.

    Attributes
    ----------
    seen
        The floor as it was at the last decision.
    frontiers
        How many were worth a visit then.
    squeezes
        Whether it is on its way to where only its body fits through.
    searched, checked
        Places that it went back to as it was lost; checks that it stands where it began.
    sure_m
        What it is unsure by at a place that it knows best: that cannot be helped.
    """

    def __init__(
        self,
        config: FloorExplorerConfig,
        own: OwnFloor,
        targets: Targets,
        localizer: Localizer,
        top_speed_m_s: float,
        journal: Journal,
    ) -> None:
        super().__init__(journal)
        self.config, self.own, self.targets = config, own, targets
        self.localizer, self.able = localizer, Abilities.of(localizer)
        # A frontier no longer than the robot is wide is one that a small robot fits through.
        self.least_m = min(config.least_frontier_m, 2.0 * own.clearance_m)
        self.getting_on = GettingOn(own.start_m, top_speed_m_s)
        self.patience_s = patience_s(config.stall_s, STALL_M, top_speed_m_s)
        self._stalled_at: FloatArray | None = None
        self.seen: SeenFloor | None = None
        self.frontiers, self.squeezes = 0, False
        self.searched, self.checked, self.sure_m = 0, 0, 0.0

    def is_unsure(self, belief: Belief) -> bool:
        """Whether to close a loop first."""
        return belief.std_m > self.config.unsure_m + self.sure_m

    def is_sure(self, belief: Belief) -> bool:
        """Whether a loop was closed."""
        sure = belief.std_m < 0.5 * (self.config.unsure_m + self.sure_m)
        return sure and belief.status is not BeliefStatus.LOST

    def stalled_s(
        self, t_s: float, here: FloatArray, target_xy_m: FloatArray | None, path: FloatArray
    ) -> float:
        """For how long it has got no nearer; once that is long it is shy until it has moved on."""
        if self._stalled_at is not None and float(np.hypot(*(here - self._stalled_at))) > AHEAD_M:
            self._stalled_at = None
        stalled_s = self.getting_on.stalled_s(t_s, here, target_xy_m, path)
        if stalled_s > SHY_SHARE * self.patience_s:
            self._stalled_at = here
        return stalled_s

    def led_to(self, path: FloatArray, here: FloatArray) -> tuple[float, float]:
        """A point on the path some metres ahead; where it is shy, one that a line with room leads to."""
        return led_to(path, here, None if self._stalled_at is None else self.seen)


def led_to(path: FloatArray, here: FloatArray, room: SeenFloor | None) -> tuple[float, float]:
    """A point on the path (N, 2) ahead of what is nearest; with ``room`` one that a line there leads to."""
    nearest = int(np.hypot(*(path - here).T).argmin())
    steps = np.hypot(*np.diff(path[nearest:], axis=0).T)
    k = nearest + int(np.searchsorted(np.cumsum(steps), AHEAD_M))
    k = min(k, len(path) - 1)
    while room is not None and k > nearest + 1 and not room.has_room(here, path[k]):
        k -= 1
    point = path[k]
    return float(point[0]), float(point[1])


def apart_m(one: FloatArray, other: FloatArray) -> float:
    """Between two places (2,)."""
    return float(np.hypot(*(one - other)))
