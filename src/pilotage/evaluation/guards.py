"""How few who stand still would see the whole floor: the art gallery problem on places and points."""

from __future__ import annotations

import math

import numpy as np
import scipy

from pilotage.core.content import content_of
from pilotage.core.types import BoolArray
from pilotage.kernels.patrol.cover import greedy_cover, holding_no_other
from pilotage.maps.floor import Floor
from pilotage.maps.known_maps import OncePerMap
from pilotage.maps.world_map import WorldMap
from pilotage.stack.patrol.derive import views

STAND_EVERY_M, SEE_EVERY_M = 1.0, 0.5
WORD_BITS = 64

_GUARDS: OncePerMap[tuple[int, int]] = OncePerMap()


def guards_of(chart: WorldMap, floor: Floor, reach_m: float) -> tuple[int, int]:
    """``fewest_guards`` of a floor: places a metre apart, points half a metre, all around within reach."""
    return _GUARDS.get(
        chart,
        content_of(floor, reach_m),
        lambda: fewest_guards(views(chart, floor, reach_m, STAND_EVERY_M, SEE_EVERY_M)[2]),
    )


def fewest_guards(sees: BoolArray) -> tuple[int, int]:
    """How few of the places see every point that any of them sees: a lower bound, and a number that suffices.

    The bound is that of the set cover's linear relaxation (HiGHS), after what others imply is left out; the
    other number is found by greed, and at most ln M + 1 times the fewest.

    Parameters
    ----------
    sees
        (P, M) as from ``stack.patrol.derive.views``; the answer is for these places and points, not for the
        plane.
    """
    some = np.ascontiguousarray(sees[:, sees.any(axis=0)])
    if some.shape[1] == 0:
        return 0, 0
    enough = len(greedy_cover(some, np.zeros(len(some)), np.zeros(some.shape[1], np.bool_)))
    # Whoever sees a point that few can see sees those that at least the same can see; and a place from which
    # no more is seen than from another is not needed.
    hard = some[:, _least(some.T)]
    kept = hard[_least(~hard)]
    relaxed = scipy.optimize.milp(
        np.ones(len(kept)),
        constraints=scipy.optimize.LinearConstraint(
            scipy.sparse.csr_array(kept.T.astype(np.float64)), lb=1.0
        ),
    )
    return 1 if relaxed.fun is None else max(1, math.ceil(float(relaxed.fun) - 1e-6)), enough


def _least(sets: BoolArray) -> BoolArray:
    """(K,) which of the sets, rows of (K, N), hold no other one; of equal ones the first."""
    whole_words = np.pad(sets, ((0, 0), (0, -sets.shape[1] % WORD_BITS)))
    words = np.ascontiguousarray(np.packbits(whole_words, axis=1)).view(np.uint64)  # of .T, too
    return np.asarray(holding_no_other(words, sets.sum(axis=1)))
