"""Bodies that stand for long and say nothing, a mate that failed say: the robot plans around them."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from pilotage.core.types import FloatArray

SHUTS_S = 15.0
"""Who was seen to stand for so long, besides the seconds until it counts as standing, is planned around."""
SAME_M = 0.35
"""What stands so near to where something stood is that."""
ABSENT_S = 1.0
"""Who is not where it would be seen for so long has gone."""
KEPT_S = 60.0
"""Who was not seen for so long may have gone: the robot goes and looks. A mate that fell silent has not."""
MEAN_OF, MOVED_M = 20, 0.04
"""Where a body stands is the mean of so many scans; plans are made anew when it proves to be so far off."""
WIDER_M, MOST_WIDER_M = 0.1, 0.4
"""More is kept from a body each time that a path past it proves not to be one, and in all."""
DENIED_S = 5.0
"""So long nothing is believed of a body that has gone, or is none: mates come to know that a little later."""


class Told(NamedTuple):
    """That a mate, by its number, plans around a body at (2,), so much wider than around others."""

    mate: int
    xy_m: FloatArray
    wider_m: float = 0.0


@dataclass(slots=True, eq=False)
class _Body:
    xy_m: FloatArray
    first_s: float
    last_s: float
    absent_s: float = 0.0
    shuts: bool = False
    seen: bool = True
    failed: bool = False
    tellers: set[int] = field(default_factory=set)
    scans: int = 0
    wider_m: float = 0.0

    def see(self, place: FloatArray) -> None:
        """Where it is by one more scan; it is seen better from near by, and while it stands."""
        self.scans = min(self.scans + 1, MEAN_OF)
        self.xy_m += (place - self.xy_m) / self.scans


class Obstructions:
    """Keeps where such bodies were seen; each robot has its own."""

    def __init__(self) -> None:
        self._bodies: list[_Body] = []
        self._denied: list[tuple[float, FloatArray]] = []
        self._planned = self.shutting
        self._t_s = 0.0

    @property
    def are_none(self) -> bool:
        """Whether nothing is known, denied or planned around: a scan without bodies says nothing then."""
        return not (self._bodies or self._denied or len(self._planned))

    def pass_time(self, t_s: float) -> None:
        """Take in a scan that says nothing."""
        self._t_s = t_s

    @property
    def known_xy_m(self) -> FloatArray:
        """(K, 2) all places."""
        return np.array([body.xy_m for body in self._bodies]).reshape(-1, 2)

    @property
    def shutting_xy_m(self) -> FloatArray:
        """(S, 2) those that are planned around."""
        return np.array([body.xy_m for body in self._bodies if body.shuts]).reshape(-1, 2)

    @property
    def shutting(self) -> FloatArray:
        """(S, 3) the same, and how much more than from others is kept from each."""
        bodies = [(*body.xy_m, body.wider_m) for body in self._bodies if body.shuts]
        return np.array(bodies) if bodies else np.zeros((0, 3))

    def told(self) -> tuple[tuple[float, float, float], ...]:
        """What mates are told: those of them that this robot itself saw lately."""
        fresh = [b for b in self._bodies if b.shuts and b.seen and self._t_s - b.last_s < KEPT_S]
        return tuple((float(b.xy_m[0]), float(b.xy_m[1]), b.wider_m) for b in fresh)

    def widen(self, place: FloatArray) -> bool:
        """No command leads past the body there; False where more is kept from it already than may help."""
        body = self._near(place)
        if body is None or not body.shuts or body.wider_m >= MOST_WIDER_M:
            return False
        body.wider_m += WIDER_M
        return True

    def deny(self, place: FloatArray) -> None:
        """Nobody who says nothing stands there, whatever mates tell."""
        self._denied.append((self._t_s, place))

    def is_of_mate(self, place: FloatArray, radius_m: float) -> None:
        """A mate that talks is there: what stood there was that mate, or has gone."""
        there = [body for body in self._bodies if _is_near(place, body.xy_m[None], radius_m)]
        for body in there:
            self.deny(body.xy_m)
            self._bodies.remove(body)

    def step(
        self,
        t_s: float,
        standing_xy_m: FloatArray,
        absent: Sequence[bool],
        silent: FloatArray,
        told: Sequence[Told],
        heard: Collection[int],
    ) -> bool:
        """Take in a scan.

        Parameters
        ----------
        standing_xy_m
            (M, 2) bodies that are seen to stand and say nothing.
        absent
            Of each of ``known_xy_m`` whether nothing is seen though it would be.
        silent
            (L, 3) discs where mates that are silent may be: who stands there has failed.
        told
            What mates say that they plan around.
        heard
            Numbers of the mates that talk.

        Returns
        -------
        bool
            Whether others are planned around than before.
        """
        since_s, self._t_s = t_s - self._t_s, t_s
        for body, gone in zip(self._bodies, absent, strict=True):
            body.absent_s = body.absent_s + since_s if gone else 0.0
        for place in standing_xy_m:
            body = self._near(place) or self._add(_Body(place.copy(), t_s, t_s))
            body.see(place)
            body.last_s, body.absent_s, body.seen = t_s, 0.0, True
            body.shuts |= t_s - body.first_s >= SHUTS_S or _is_in(place, silent)
        self._forget(silent, told, heard)
        for mate, place, wider_m in told:
            if any(math.dist(place, denied) < SAME_M for _, denied in self._denied):
                continue
            body = self._near(place) or self._add(_Body(place.copy(), t_s, t_s, seen=False))
            body.shuts, body.last_s = True, body.last_s if body.seen else t_s
            body.failed |= _is_in(place, silent)
            body.tellers.add(mate)
            body.wider_m = max(body.wider_m, wider_m)
            if not body.scans:
                body.xy_m = place.copy()
        return self._is_news()

    def _is_news(self) -> bool:
        """Whether bodies are planned around otherwise than by the last news."""
        now, before = self.shutting, self._planned
        if not len(now) and not len(before):
            return False
        if len(now) == len(before) and (np.abs(now - before) < [MOVED_M, MOVED_M, 0.5 * WIDER_M]).all():
            return False
        self._planned = now
        return True

    def _near(self, place: FloatArray) -> _Body | None:
        """The body that is known at a place."""
        return next((body for body in self._bodies if _is_near(place, body.xy_m[None], SAME_M)), None)

    def _add(self, body: _Body) -> _Body:
        self._bodies.append(body)
        return body

    def _forget(self, silent: FloatArray, told: Sequence[Told], heard: Collection[int]) -> None:
        """Who is seen to have gone, talks again, or may have gone; what mates told and tell no more."""
        kept = []
        self._denied = [(t_s, place) for t_s, place in self._denied if self._t_s - t_s < DENIED_S]
        for body in self._bodies:
            had_failed, body.failed = body.failed, _is_in(body.xy_m, silent)
            gone = body.absent_s >= ABSENT_S or (had_failed and not body.failed)
            still = any(_is_near(place, body.xy_m[None], SAME_M) for _, place, _ in told)
            held = body.seen or still or body.tellers.isdisjoint(heard)
            if not gone and (body.failed or (held and self._t_s - body.last_s < KEPT_S)):
                kept.append(body)
            elif gone:
                self.deny(body.xy_m)
        self._bodies = kept


def _is_in(place: FloatArray, discs: FloatArray) -> bool:
    return bool((np.hypot(*(discs[:, :2] - place).T) < discs[:, 2]).any())


def _is_near(place: FloatArray, others: FloatArray, reach_m: float) -> bool:
    return bool((np.hypot(*(others - place).T) < reach_m).any())
