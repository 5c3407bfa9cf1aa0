"""Bodies that stand for long and say nothing, a mate that failed say: the robot plans around them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pilotage.core.types import BoolArray, FloatArray

SHUTS_S = 15.0
"""Who was seen to stand for so long, besides the seconds until it counts as standing, is planned around."""
SAME_M, FAILED_M = 0.35, 0.6
"""What stands so near to where something stood is that; so near to where a mate fell silent, that mate."""
ABSENT_S = 1.0
"""Who is not where it would be seen for so long has gone."""
KEPT_S = 60.0
"""Who was not seen for so long may have gone: the robot goes and looks. A mate that fell silent has not."""


@dataclass(slots=True)
class _Body:
    xy_m: FloatArray
    first_s: float
    last_s: float
    absent_s: float = 0.0
    shuts: bool = False
    seen: bool = True


class Obstructions:
    """Keeps where such bodies were seen; each robot has its own."""

    def __init__(self) -> None:
        self._bodies: list[_Body] = []
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

    def step(
        self,
        t_s: float,
        standing_xy_m: FloatArray,
        absent: BoolArray,
        silent_xy_m: FloatArray,
        told_xy_m: FloatArray,
    ) -> bool:
        """Take in a scan.

        Parameters
        ----------
        standing_xy_m
            (M, 2) bodies that are seen to stand and say nothing.
        absent
            (K,) of which of ``known_xy_m`` nothing is seen though it would be.
        silent_xy_m
            (L, 2) where mates that are silent said last that they are: who stands there has failed.
        told_xy_m
            (T, 2) what mates say that they plan around.

        Returns
        -------
        bool
            Whether others are planned around than before.
        """
        since_s, self._t_s = t_s - self._t_s, t_s
        before = [id(body) for body in self._bodies if body.shuts]
        for body, gone in zip(self._bodies, absent.tolist(), strict=True):
            body.absent_s = body.absent_s + since_s if gone else 0.0
        self._bodies = [
            body
            for body in self._bodies
            if body.absent_s < ABSENT_S
            and (t_s - body.last_s < KEPT_S or _is_near(body.xy_m, silent_xy_m, FAILED_M))
        ]
        for place in standing_xy_m:
            near = [body for body in self._bodies if _is_near(place, body.xy_m[None], SAME_M)]
            body = near[0] if near else _Body(place.copy(), t_s, t_s)
            if not near:
                self._bodies.append(body)
            body.last_s, body.absent_s, body.seen = t_s, 0.0, True
            body.shuts |= t_s - body.first_s >= SHUTS_S or _is_near(place, silent_xy_m, FAILED_M)
        for place in told_xy_m:
            near = [body for body in self._bodies if _is_near(place, body.xy_m[None], SAME_M)]
            if not near:
                self._bodies.append(_Body(place.copy(), t_s, t_s, shuts=True, seen=False))
            for body in near:
                body.shuts, body.last_s = True, body.last_s if body.seen else t_s
        return [id(body) for body in self._bodies if body.shuts] != before


def _is_near(place: FloatArray, others: FloatArray, reach_m: float) -> bool:
    return bool((np.hypot(*(others - place).T) < reach_m).any())
