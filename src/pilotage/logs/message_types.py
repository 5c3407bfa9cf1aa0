"""Types of messages as ``rosbags`` keeps them in a store, one store for all bags that tell the same.

The library writes and compiles a dozen functions for each type of a store before the first message of it:
half of what it takes to read a bag of some seconds. It makes a store anew for each bag.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from threading import Lock
from typing import Any

from pilotage.logs.rosbags_extra import rosbags

KEPT = 32
"""Stores at most: the recordings of one robot tell the same types, those of a collection a few."""

_kept: dict[str, Any] = {}
_keeping = Lock()


def shared(store: Any) -> Any:
    """The store of an earlier bag whose types have the same names, constants and fields; else this one."""
    told = repr(sorted(store.fielddefs.items()))
    with _keeping:
        while told not in _kept and len(_kept) >= KEPT:
            _kept.pop(next(iter(_kept)))
        return _kept.setdefault(told, store)


@lru_cache(maxsize=KEPT)
def told_types(definition: str, msgtype: str) -> Any:
    """The store of a message's definition and of all that it names."""
    typesys = rosbags("typesys")
    store = typesys.get_typestore(typesys.Stores.EMPTY)
    store.register(typesys.get_types_from_msg(definition, msgtype))
    return shared(store)


def shipped_types(name: str, own: Mapping[str, str] | None = None) -> Any:
    """The library's collection of that name, with types of one's own: definitions by ``package/msg/Name``."""
    typesys = rosbags("typesys")
    store = typesys.get_typestore(getattr(typesys.Stores, name))
    for msgtype, definition in (own or {}).items():
        store.register(typesys.get_types_from_msg(definition, msgtype))
    return shared(store)
