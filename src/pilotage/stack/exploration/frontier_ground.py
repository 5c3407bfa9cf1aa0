"""What the map, as it is now, leaves room for: on the way ahead, right before the body, and behind it."""

from __future__ import annotations

import math
from collections.abc import Sequence

from pilotage.core.types import BoolArray, FloatArray
from pilotage.stack.exploration.frontier_senses import Senses
from pilotage.stack.planning.sheet_room import Point, SheetRoom

OVERHANG_M = 0.004
"""The body may reach over the sheet's edge by this much."""
KEEP_OFF_M = 0.004
GUARD_AHEAD_M, GUARD_ROOM_M = 0.05, 0.011
"""It stops for what would come this near within so much path: braking takes a few millimetres."""
CAUTION_ROOM_M = 0.022
"""With less room ahead it drives more slowly."""
NEARER_M = 0.0015
"""What is no nearer ahead than here by this much does not stop it: it is leaving that behind."""
SLACK_ON_WAY_M, SLACK_HERE_M = 0.003, 0.002
"""How much less room than planned is let pass before a path counts as closed: the map trembles a little."""


class Ground:
    """The room between what stands on the map, brought up to date only when it is asked for."""

    def __init__(self, senses: Senses, room: SheetRoom) -> None:
        self._senses, self.room = senses, room
        self._is_old = True
        self.stands: FloatArray | None = None
        """(rows, columns, 4) where to stand in each cell, once that has been asked for."""

    def age(self) -> None:
        """The map has changed."""
        self._is_old = True

    def refresh(self) -> None:
        """Bring the room up to date where the map has changed."""
        if self._is_old:
            self.room.update(*self._senses.obstacles())
            self.stands = None
            self._is_old = False

    def find_stands(self, wanted: BoolArray) -> FloatArray:
        """Where to stand in the cells wanted, found once for each state of the map."""
        if self.stands is None:
            self.stands = self.room.stands(wanted, OVERHANG_M, KEEP_OFF_M)
        return self.stands

    def way_is_free(self, here: Point, waypoints: Sequence[Point]) -> bool:
        """Whether the next pieces of the path keep their room, less where the body stands in less."""
        room = self.room
        least = min(room.room_m - SLACK_ON_WAY_M, room.at(*here) - SLACK_HERE_M)
        for waypoint in waypoints[:2]:
            if room.clear(here, waypoint) < least:
                return False
            here = waypoint
        return True

    def look_ahead(self, here: Point, waypoint: Point) -> tuple[bool, bool]:
        """Whether what beams hit lately stands close before the body, and whether it calls for care."""
        (x, y), (to_x, to_y) = here, waypoint
        share = min(1.0, GUARD_AHEAD_M / max(math.hypot(to_x - x, to_y - y), 1e-6))
        ahead = x + share * (to_x - x), y + share * (to_y - y)
        near, body_m = self._senses.recent, self.room.body_m
        room_m = near.room_along(here, ahead, body_m)
        in_the_way = room_m < GUARD_ROOM_M and room_m < near.room_along(here, here, body_m) - NEARER_M
        return in_the_way, room_m < CAUTION_ROOM_M
