"""Types of messages as ``rosbags`` keeps them in a store, one store for all bags that tell the same.

The library writes and compiles a dozen functions for each type of a store before the first message of it:
half of what it takes to read a bag of some seconds. It makes a store anew for each bag, from definitions
that it takes apart anew: most of what it takes to open one. The rest is YAML: how reliably each topic was
sent, in the same words at most of them and at each opening.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import AbstractContextManager
from functools import cache, lru_cache
from threading import Lock
from typing import Any

from pilotage.logs.rosbags_extra import rosbags

KEPT = 32
"""Stores at most: the recordings of one robot tell the same types, those of a collection a few."""

_kept: dict[str, Any] = {}
_opened: dict[str, Any] = {}
"""Stores by what they hold, and by what the connections of a bag tell."""
_keeping = Lock()


def shared(store: Any) -> Any:
    """The store of an earlier bag whose types have the same names, constants and fields; else this one."""
    return _keep(_kept, repr(sorted(store.fielddefs.items())), store)


def _keep(stores: dict[str, Any], told: str, store: Any) -> Any:
    with _keeping:
        while told not in stores and len(stores) >= KEPT:
            stores.pop(next(iter(stores)))
        return stores.setdefault(told, store)


class _Open(AbstractContextManager["_Open"]):
    """A reader of one file that is open already, for whoever would open it."""

    def __init__(self, connections: list[Any]) -> None:
        self.connections = connections

    def __exit__(self, *_: object) -> None:
        """Whoever opened it closes it."""


@cache
def sharing(library: Any) -> Any:
    """The library's reader of bags; one whose connections tell what an earlier one's did takes its types."""
    for storage in ("mcap", "sqlite3"):
        _remember_qualities(rosbags(f"rosbag2.storage_{storage}"))

    class Reader(library):  # type: ignore[misc]
        readers: Any
        typestore: Any

        def _open(self) -> None:
            for one in self.readers:
                self.stack.enter_context(one)
            connections = [connection for one in self.readers for connection in one.connections]
            told = repr([(self.is2, one.msgtype, one.msgdef, one.digest) for one in connections])
            with _keeping:
                store = _opened.get(told)
            if store is None:
                opened, self.readers = self.readers, [_Open(connections)]
                try:
                    super()._open()
                finally:
                    self.readers = opened
                store = _keep(_opened, told, shared(self.typestore))
            self.connections, self.typestore = connections, store

    return Reader


def _remember_qualities(storage: Any) -> None:
    """What a topic's quality of service says in YAML is read once for each wording, not for each topic."""
    read = getattr(storage, "parse_qos", None)
    if read is not None and not hasattr(read, "cache_info"):
        storage.parse_qos = lru_cache(maxsize=KEPT)(read)


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
