"""What a robot does before whom it waits: looks for a path around, or backs out of the way it came."""

from __future__ import annotations

import math
from enum import Enum

import numpy as np
from pydantic import Field

from pilotage.core.config import Config
from pilotage.core.types import FloatArray
from pilotage.sensors.sensor import Positive

CREPT_M = 0.05
"""Who stands before somebody still creeps by less: each time by half of what is left."""
SLOWER = 4.0
"""What was tried so often in vain is tried after twice the time."""
SPACING_M = 0.025
"""Of what is kept of the path that was driven."""


class YieldingConfig(Config):
    """How long it waits, and how far it backs."""

    patience_s: Positive = 2.0
    """It waits as long at least, and up to twice as long: of two that meet one is the first to yield."""
    back_m: Positive = 2.0
    progress_m: Positive = 3.0
    """Having come so much farther along its plan it has got past."""
    most_tries: int = Field(default=10, ge=1)
    """So often it tries where nobody else drives or walks before it gives up, if it gets no farther."""


class Act(Enum):
    """What to do now."""

    NOTHING = "nothing"
    AROUND = "around"
    BACK = "back"


class Yielding:
    """Counts how long a robot is held up, and says when to do what about it.

    First it looks for a path around, then it backs out: who only ever looked for a path around would stand
    for ever before whoever waits for it in a passage for one. Who has backed out once does so again, after
    half the time, until it has got past: of two in a passage one backs all the way.

    Attributes
    ----------
    tries
        What was tried since it last got past.
    """

    def __init__(self, config: YieldingConfig, dt_s: float, rng: np.random.Generator) -> None:
        self._config, self._dt_s, self._rng = config, dt_s, rng
        self._held_s, self._crept_m, self._moved_m, self.tries = 0.0, 0.0, 0.0, 0
        self._yields = False
        self._patience_s = self._drawn_s()
        self._driven: list[FloatArray] = []

    @property
    def is_held(self) -> bool:
        """Whether it is held up."""
        return self._held_s > 0.0

    def step(self, rate: float, moved_m: float, *, backs: bool) -> Act:
        """Take in how fast the path's clock ran, and how far that led; what to do after it."""
        if not backs:
            self._moved_m += moved_m
        if self._moved_m > self._config.progress_m:
            self._moved_m, self.tries, self._yields = 0.0, 0, False
        # Who drives on, however slowly yet, is not held up any longer: somebody else yields.
        self._crept_m += moved_m
        self._held_s += self._dt_s * (1.0 - rate)
        if self._crept_m > CREPT_M:
            self._crept_m, self._held_s = 0.0, 0.0
        if self._held_s < self._patience_s:
            return Act.NOTHING
        around = backs or (not self._yields and self.tries % 2 == 0)
        self._yields = not around
        self._held_s, self._crept_m, self._moved_m = 0.0, 0.0, 0.0
        self._patience_s = self._drawn_s()
        self.tries += 1
        return Act.AROUND if around else Act.BACK

    def drove(self, pose: FloatArray, *, backs: bool) -> None:
        """Keep a pose (3,) of the path as it was driven, to back out along; or drop what was backed along."""
        driven = self._driven
        if not backs:
            if not driven or _apart_m(pose, driven[-1]) >= SPACING_M:
                driven.append(pose)
            return
        while len(driven) > 1 and _apart_m(pose, driven[-2]) <= _apart_m(pose, driven[-1]):
            driven.pop()

    def forget(self) -> None:
        """It left the path: what was driven does not end where it is."""
        self._driven.clear()

    def way_back(self, back_m: float = math.inf) -> FloatArray:
        """(N, 3) the last of what was driven, backwards; none where it cannot back farther."""
        count = max(2, round(min(back_m, self._config.back_m) / SPACING_M) + 1)
        back = np.array(self._driven[-1 : -count - 1 : -1]).reshape(-1, 3)
        if len(back) < 2:
            self._yields = False
            return back[:0]
        return back

    def _drawn_s(self) -> float:
        drawn_s = self._config.patience_s * (1.0 + float(self._rng.random())) * (1.0 + self.tries / SLOWER)
        return 0.5 * drawn_s if self._yields else drawn_s


def _apart_m(a: FloatArray, b: FloatArray) -> float:
    return float(np.hypot(a[0] - b[0], a[1] - b[1]))
