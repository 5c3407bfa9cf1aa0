"""Maps that were met before in this process: what was worked out of an equal one is not worked out again."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable
from threading import Lock
from typing import Generic, TypeVar
from weakref import WeakKeyDictionary

from pilotage.core.content import content_of
from pilotage.maps.world_map import WorldMap

KEPT = 2
"""Maps that are remembered: a study that draws a world for each trial holds no more of them."""
MOST_ANSWERS = 16
"""Of one kind that are remembered of a map: what they depend on besides may differ from trial to trial."""

T = TypeVar("T")

_MET: OrderedDict[bytes, WorldMap] = OrderedDict()
_CONTENTS: WeakKeyDictionary[WorldMap, bytes] = WeakKeyDictionary()
_MEETING = Lock()
"""Trials of a cluster and environments for learning run in threads of one process."""


def known_map(chart: WorldMap) -> WorldMap:
    """The map itself, or one of the last few that is equal to it in all its layers.

    A mission's warm-up and its run, and all trials of a study, read the same map anew; nobody changes one.
    """
    key = _CONTENTS.get(chart)
    if key is None:
        key = _CONTENTS[chart] = content_of(chart)
    with _MEETING:
        met = _MET.setdefault(key, chart)
        _MET.move_to_end(key)
        if len(_MET) > KEPT:
            _MET.popitem(last=False)
    return met


class OncePerMap(Generic[T]):
    """Answers that depend on a map and on a few numbers, kept as long as the map is."""

    def __init__(self) -> None:
        self._known: WeakKeyDictionary[WorldMap, OrderedDict[Hashable, T]] = WeakKeyDictionary()
        self._lock = Lock()

    def get(self, chart: WorldMap, numbers: Hashable, work_out: Callable[[], T]) -> T:
        """The answer for a map and numbers; of many the last few are kept."""
        with self._lock:
            known = self._known.setdefault(chart, OrderedDict())
            if numbers in known:
                known.move_to_end(numbers)
                return known[numbers]
        answer = work_out()  # without the lock: others ask of other maps meanwhile
        with self._lock:
            answer = known.setdefault(numbers, answer)
            known.move_to_end(numbers)
            if len(known) > MOST_ANSWERS:
                known.popitem(last=False)
        return answer
