"""A filter's doubt of itself: readings that it refuses or that fit worse than they should."""

from __future__ import annotations

import math
from collections import deque

import numpy as np

from pilotage.core.chi_square import chi_square_quantile, gated_mean
from pilotage.core.types import FloatArray

WINDOW = 30
"""Updates that are looked back at."""
LEAST_SEEN = 10
"""Readings, fewer of which say nothing."""
REFUSED_SHARE, NOISE_SHARE = 0.5, 0.85
"""Who refuses more than this of what its gate should let through is wrong as likely as its readings are; of
what its noise would let through, had it more of that than it believes, at least so much must pass."""
NIS_EXCESS, NIS_SIGMAS = 0.5, 6.0
"""NIS of the accepted over what is usual, less 1: a model is never exact, and chance has its share."""
WINDOWS, MOST_WINDOWS = 5, 20
"""Windows that must be alike to be its own, and until when it looks for such."""
MOST_DISPERSION = 3.0
"""Variance of the windows' shares over that of independent readings; lines of one scan are not quite."""
MOST_NOISE = 15.0
"""By how much more than it believes the variances may be."""
HOLD_S, MOST_HOLD_S = 3.0, 60.0
"""How long all has to be well before it is believed again; doubled each time that it was not for long."""
SOON_S, REFUSED_AFTER = 30.0, 0.5
"""For so long after a doubt another one counts as the same, and of the share that may be refused only so much
may be: where all readings are off, a filter that gives way to them fits for a while, and refuses fewer."""
RECENT, USUAL, FORGOTTEN, DEVIATES = 0.1, 0.02, 0.002, 0.1
"""What a new scan counts in the two means, and in the long one while the robot does not trust its place; and
of that in how far the first usually is from the second: rooms differ in time, a wrong filter at once."""
KEPT, DEVIATIONS, LEAST_KEPT = 0.9, 3.0, 0.7
"""Of the usual share, what a place must explain that the robot has just found: less where the share is seen
to vary, by so many of its mean deviations, but never less than the last."""


class SelfCheck:
    """Watches a filter's own readings and says when it is not to be believed.

    The NIS stays in its band as long as model, readings and belief agree (Bar-Shalom et al. 2001, section
    5.4.2). Where it lies is learned in the first updates: a filter that is only wrong about its noise knows
    its place nevertheless. It cannot see what no reading contradicts: an error that all landmarks in sight
    share is taken for motion until others come into sight. Who had to begin anew is therefore believed later
    each time.
    """

    def __init__(
        self, gate: float = 1.0, refused_share: float = REFUSED_SHARE, *, noise_share: float | None = None
    ) -> None:
        self._gate, self._noise_share = gate, noise_share
        self._used_share = (1.0 - refused_share) * gate
        self._used_share_after = (1.0 - REFUSED_AFTER * refused_share) * gate
        self._updates: deque[tuple[float, ...]] = deque()
        self._sums = [0.0, 0.0, 0.0, 0.0]
        self._windows: list[tuple[float, ...]] | None = None if noise_share is None else []
        self._count, self._own_share, self._own_nis = 0, 1.0, 1.0
        self._hold_s, self._until_s, self._amiss = HOLD_S, -math.inf, False

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
        share, ratio = used / all_seen, total / mean if mean > 0.0 else 1.0
        # Chi-square values add up to one of as many degrees of freedom as their mean, of twice the variance.
        excess = max(NIS_EXCESS, NIS_SIGMAS * math.sqrt(2.0 / max(mean, 1.0)))
        used_share = self._used_share_after if t_s < self._until_s + SOON_S else self._used_share
        if share < used_share * self._own_share or ratio > (1.0 + excess) * self._own_nis:
            self._amiss = True
            self.alarm(t_s)
        self._count += 1
        if self._windows is not None and self._count % WINDOW == 0:
            self._windows.append((all_seen, used, total, mean))
            self._learn(np.array(self._windows[-WINDOWS:]))

    def _learn(self, windows: FloatArray) -> None:
        """Take the last windows for the filter's own if they are alike; give up after some time."""
        if len(windows) == WINDOWS and windows[:, 1].any():
            seen, used = windows[:, 0], windows[:, 1]
            share, nis = float(used.sum() / seen.sum()), float(windows[:, 2].sum() / windows[:, 3].sum())
            chance = share * max(1.0 - share, 1.0 / float(seen.sum()))
            dispersion = float((seen * (used / seen - share) ** 2).sum() / (chance * (WINDOWS - 1)))
            explained = _share_by_noise(nis, self._gate)
            assert self._noise_share is not None
            if dispersion <= MOST_DISPERSION and share >= self._noise_share * explained:
                self._windows = None
                if nis > 1.0 + NIS_EXCESS:
                    self._own_share, self._own_nis = share, nis
        if self._count >= MOST_WINDOWS * WINDOW:
            self._windows = None

    def alarm(self, t_s: float) -> None:
        """The filter is wrong, or has had to give up its pose or its certainty."""
        if t_s >= self._until_s:
            soon = t_s < self._until_s + SOON_S
            self._hold_s = min(2.0 * self._hold_s, MOST_HOLD_S) if soon else HOLD_S
        self._until_s = t_s + self._hold_s

    def try_anew(self, elsewhere: bool) -> None:
        """A place is tried; what spoke against the last one says nothing of one elsewhere."""
        self._amiss = False
        if elsewhere:
            self._updates.clear()
            self._sums = [0.0, 0.0, 0.0, 0.0]

    def begin_anew(self, t_s: float) -> bool:
        """The scans fit at the place on trial; returns whether its updates agree with each other too.

        Where they do not, as of readings out of order, the filter is told another motion than the robot's:
        that the scans fit does not mend that, and it waits for longer. So does who had to withdraw its word
        soon after it gave it.
        """
        if self._amiss:
            self._hold_s = min(2.0 * self._hold_s, MOST_HOLD_S)
            self._until_s = max(self._until_s, t_s + self._hold_s)
        elif self._hold_s <= HOLD_S:
            self._until_s = min(self._until_s, t_s)
        return not self._amiss

    def lost(self, t_s: float) -> bool:
        """Whether the filter is not to be believed now."""
        return t_s < self._until_s


def _share_by_noise(nis: float, gate: float) -> float:
    """What a gate of that probability lets through of readings whose noise, times a factor, brings this NIS.

    NIS is over what is expected of the accepted; readings have two numbers each. With f the factor and
    c = g / f, g the gate's chi-square, it is f E[x | x < c] / E[x | x < g]; 1 - exp(-c / 2) is let through.
    """
    most = chi_square_quantile(gate, 2)
    low, high = 1.0, MOST_NOISE
    for _ in range(40):
        factor = 0.5 * (low + high)
        found = factor * gated_mean(most / factor, 2) / gated_mean(most, 2)
        low, high = (factor, high) if found < nis else (low, factor)
    return 1.0 - math.exp(-0.5 * most / low)


class ExplainedShare:
    """Compares the share of a scan that the map explains with what is usual where the robot is.

    A short and a long mean, as augmented Monte-Carlo localization keeps them of the likelihood (Thrun et al.
    2005, table 8.3), and how far the one usually is from the other: chairs were moved in one room, not in
    the next. A place that only looks like the true one explains less of the scans, if seldom little.
    Where the surroundings have truly changed, the long mean follows within some minutes.
    """

    def __init__(self) -> None:
        self._recent, self._usual, self._deviation = math.nan, math.nan, 0.0

    @property
    def usual(self) -> float:
        """Share that is usual; nan before the first scan."""
        return self._usual

    def begin_anew(self) -> None:
        """Forget the last scans: they were seen from a place that was the wrong one."""
        self._recent = self._usual

    def tell(self, share: float, trusted: bool, weight: float = 1.0) -> bool:
        """One scan; returns whether the last ones fit as well as usual.

        Parameters
        ----------
        weight
            What it counts: its readings over those of a full scan. On open ground one of two readings is
            half of them, and says next to nothing.
        """
        if math.isnan(self._usual):
            self._recent = self._usual = share
        self._recent += weight * RECENT * (share - self._recent)
        rate, off = weight * (USUAL if trusted else FORGOTTEN), self._recent - self._usual
        kept = self._usual - max((1.0 - KEPT) * self._usual, DEVIATIONS * self._deviation)
        as_usual = self._recent >= max(kept, LEAST_KEPT * self._usual)
        self._usual += rate * off
        self._deviation += DEVIATES * rate * (abs(off) - self._deviation)
        return as_usual
