"""Bodies that stand for long and say nothing, a mate that failed say: the robot plans around them."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from pilotage.core.types import BoolArray, FloatArray

SHUTS_S = 15.0
"""Who was seen to stand for so long, besides the seconds until it counts as standing, is planned around."""
SAME_M = 0.35
"""What stands so near to where something stood is that."""
ABSENT_S = 1.0
"""Who is not where it would be seen for so long has gone."""
KEPT_S = 60.0
"""Who was not seen for so long may have gone: the robot goes and looks. A mate that fell silent has not."""
DENIED_S = 5.0
"""So long nothing is believed of a body that has gone, or is none: mates come to know that a little later."""


class Told(NamedTuple):
    """That a mate, by its number, plans around a body at (2,)."""

    mate: int
    xy_m: FloatArray


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


class Obstructions:
    """Keeps where such bodies were seen; each robot has its own."""

    def __init__(self) -> None:
        self._bodies: list[_Body] = []
        self._denied: list[tuple[float, FloatArray]] = []
        self._shutting = self.shutting_xy_m
        self._t_s = 0.0

    @property
    def known_xy_m(self) -> FloatArray:
        """(K, 2) all places."""
        return np.array([body.xy_m for body in self._bodies]).reshape(-1, 2)

    @property
    def shutting_xy_m(self) -> FloatArray:
        """(S, 2) those that are planned around."""
        return np.array([body.xy_m for body in self._bodies if body.shuts]).reshape(-1, 2)

    def told(self) -> tuple[tuple[float, float], ...]:
        """What mates are told: those of them that this robot itself saw lately."""
        fresh = [b.xy_m for b in self._bodies if b.shuts and b.seen and self._t_s - b.last_s < KEPT_S]
        return tuple((float(x), float(y)) for x, y in fresh)

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
        absent: BoolArray,
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
            (K,) of which of ``known_xy_m`` nothing is seen though it would be.
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
        for body, gone in zip(self._bodies, absent.tolist(), strict=True):
            body.absent_s = body.absent_s + since_s if gone else 0.0
        for place in standing_xy_m:
            body = self._near(place) or self._add(_Body(place.copy(), t_s, t_s))
            body.last_s, body.absent_s, body.seen = t_s, 0.0, True
            body.shuts |= t_s - body.first_s >= SHUTS_S or _is_in(place, silent)
        self._forget(silent, told, heard)
        denied = np.array([place for _, place in self._denied]).reshape(-1, 2)
        for mate, place in told:
            if _is_near(place, denied, SAME_M):
                continue
            body = self._near(place) or self._add(_Body(place.copy(), t_s, t_s, seen=False))
            body.shuts, body.last_s = True, body.last_s if body.seen else t_s
            body.failed |= _is_in(place, silent)
            body.tellers.add(mate)
        before, self._shutting = self._shutting, self.shutting_xy_m
        return not np.array_equal(self._shutting, before)

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
            still = any(_is_near(place, body.xy_m[None], SAME_M) for _, place in told)
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
