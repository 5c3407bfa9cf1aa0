"""Since when a robot has come no nearer to where it is sent."""

from __future__ import annotations

PROGRESS_S = 0.4
"""So much nearer in time to go counts as getting on."""


class Headway:
    """By the least time to go so far: who goes to and fro gets nowhere.

    Attributes
    ----------
    since_s
        When it was at a place to visit, or nearer to the next one than ever before, last.
    """

    def __init__(self) -> None:
        self.since_s = 0.0
        self._hop, self._least_s = -1, 0.0

    def restart(self, t_s: float) -> None:
        """It is where it was sent, or nothing is left for it to do."""
        self.since_s, self._hop = t_s, -1

    def step(self, t_s: float, hop: int, to_go_s: float) -> None:
        """It drives to a hop, and is so far from it."""
        if hop != self._hop:
            self._hop, self._least_s = hop, to_go_s
        elif to_go_s < self._least_s - PROGRESS_S:
            self._least_s, self.since_s = to_go_s, t_s
