"""How often a robot was stopped or held up since it last got on."""

from __future__ import annotations

import math

MOST_STOPS = 12
"""How often it plans anew where its lasers show no room for its plan."""
GOT_ON_M = 2.0
"""With so much less to go than when it was stopped first it has got on: a sweep meets many a nook."""


class Stops:
    """Counts them.

    Attributes
    ----------
    count
        Since it last got on.
    """

    def __init__(self, most: int = MOST_STOPS) -> None:
        self.count, self._to_go_m, self._most = 0, math.inf, most

    def again(self, to_go_m: float) -> None:
        """Stopped once more, with so much to go; infinite where it was not on its way."""
        if to_go_m < self._to_go_m - GOT_ON_M:
            self.count, self._to_go_m = 0, to_go_m
        self.count += 1

    @property
    def too_many(self) -> bool:
        """Whether it gets no farther along its plans."""
        return self.count > self._most
