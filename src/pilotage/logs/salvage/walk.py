"""Walks through files of bags, whatever their kind.

A chunk that is cut is unpacked as far as it goes; one that is damaged is passed over.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from pathlib import Path

from pilotage.logs.salvage.found import BagFormat, Raw, Salvage
from pilotage.logs.salvage.mcap import walk_mcap
from pilotage.logs.salvage.ros1 import walk_ros1
from pilotage.logs.salvage.sqlite import walk_sqlite

WALKS: dict[BagFormat, Callable[[Salvage], Iterator[Raw]]] = {
    BagFormat.ROS1: walk_ros1,
    BagFormat.MCAP: walk_mcap,
    BagFormat.SQLITE: walk_sqlite,
}


def salvage_file(path: Path, form: BagFormat) -> Salvage:
    """Walk through a file once, to learn its topics and where it ends."""
    found = Salvage(path, form)
    for topic, _, _ in WALKS[form](found):
        found.counts[topic] = found.counts.get(topic, 0) + 1
    return found


def salvaged_messages(found: Salvage, topics: Collection[str]) -> Iterator[Raw]:
    """Walk again and yield the messages of these topics, as far as they can be read."""
    for raw in WALKS[found.form](found):
        if raw[0] in topics:
            yield raw
