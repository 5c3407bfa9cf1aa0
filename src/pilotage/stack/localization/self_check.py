"""A filter's doubt of itself: readings that it refuses or that fit worse than they should."""

from __future__ import annotations

import math
from collections import deque

WINDOW = 30
"""Updates that are looked back at."""
LEAST_SEEN = 10
"""Readings, fewer of which say nothing."""
REFUSED_SHARE = 0.5
"""Who refuses more than this of what its gate should let through is wrong as likely as its readings are."""
NIS_EXCESS, NIS_SIGMAS = 0.5, 6.0
"""NIS of the accepted over what is expected, less 1: a model is never exact, and chance has its share."""
HOLD_S, MOST_HOLD_S = 3.0, 60.0
"""How long all has to be well before it is believed again; doubled each time that it was not for long."""
SOON_S = 30.0
RECENT, USUAL, FORGOTTEN = 0.1, 0.02, 0.002
"""What a new scan counts in the two means, and in the long one while the robot does not trust its place."""
KEPT = 0.9
"""Of the usual share, what a place must explain that the robot has just found."""


class SelfCheck:
    """Watches a filter's own readings and says when it is not to be believed.

    The NIS stays in its band as long as model, readings and belief agree (Bar-Shalom et al. 2001, section
    5.4.2). It cannot see what no reading contradicts: an error that all landmarks in sight share is taken
    for motion until others come into sight. Who had to begin anew is therefore believed later each time.
    """

    def __init__(self, gate: float = 1.0, refused_share: float = REFUSED_SHARE) -> None:
        self._used_share = (1.0 - refused_share) * gate
        self._updates: deque[tuple[float, ...]] = deque()
        self._sums = [0.0, 0.0, 0.0, 0.0]
        self._hold_s, self._until_s = HOLD_S, -math.inf

    def tell(self, t_s: float, seen: int, accepted: int, nis: float, expected: float) -> None:
        """One update: readings of known things, those accepted, their NIS summed, and its mean."""
        if seen == 0:
            return
        update = (float(seen), float(accepted), nis, expected)
        self._updates.append(update)
        gone = self._updates.popleft() if len(self._updates) > WINDOW else (0.0, 0.0, 0.0, 0.0)
        for k in range(4):
            self._sums[k] += update[k] - gone[k]
        all_seen, used, total, mean = self._sums
        if all_seen < LEAST_SEEN:
            return
        # Chi-square values add up to one of as many degrees of freedom as their mean, of twice the variance.
        excess = max(NIS_EXCESS, NIS_SIGMAS * math.sqrt(2.0 / max(mean, 1.0)))
        if used < self._used_share * all_seen or total > (1.0 + excess) * mean:
            self.alarm(t_s)

    def alarm(self, t_s: float) -> None:
        """The filter is wrong, or has had to give up its pose or its certainty."""
        if t_s >= self._until_s:
            soon = t_s < self._until_s + SOON_S
            self._hold_s = min(2.0 * self._hold_s, MOST_HOLD_S) if soon else HOLD_S
        self._until_s = t_s + self._hold_s

    def lost(self, t_s: float) -> bool:
        """Whether the filter is not to be believed now."""
        return t_s < self._until_s


class ExplainedShare:
    """Compares the share of a scan that the map explains with what is usual where the robot is.

    A short and a long mean, as augmented Monte-Carlo localization keeps them of the likelihood (Thrun et al.
    2005, table 8.3). A place that only looks like the true one explains less of the scans, if seldom little.
    Where the surroundings have truly changed, the long mean follows within some minutes.
    """

    def __init__(self) -> None:
        self._recent, self._usual = math.nan, math.nan

    @property
    def usual(self) -> float:
        """Share that is usual; nan before the first scan."""
        return self._usual

    def begin_anew(self) -> None:
        """Forget the last scans: they were seen from a place that was the wrong one."""
        self._recent = self._usual

    def tell(self, share: float, trusted: bool) -> bool:
        """One scan; returns whether the last ones fit as well as usual."""
        if math.isnan(self._usual):
            self._recent = self._usual = share
        self._recent += RECENT * (share - self._recent)
        self._usual += (USUAL if trusted else FORGOTTEN) * (self._recent - self._usual)
        return self._recent >= KEPT * self._usual
