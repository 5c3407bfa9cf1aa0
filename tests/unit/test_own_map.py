"""The robot's own map: what it was told of and what it adds."""

from __future__ import annotations

import numpy as np

from pilotage.stack.navigator.own_map import OwnMap
from support.worlds import ROOM_MAP


def test_what_nobody_adds_to_is_joined_once() -> None:
    """Without a mapper it was joined anew at every step, a twentieth of what a step took."""
    own = OwnMap(ROOM_MAP, None)
    alone = own.circles_m
    assert own.circles_m is alone
    own.show(np.array([[1.0, 1.0], [1.01, 1.0]]))
    shown = own.circles_m
    assert len(shown) == len(alone) + 1
    assert own.circles_m is shown
    assert own.forgets()
    assert not own.forgets()
    np.testing.assert_array_equal(own.circles_m, alone)
    assert own.circles_m is own.circles_m
