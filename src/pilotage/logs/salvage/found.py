"""What a walk through a file of a bag found, and the kinds of such files."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import TypeAlias


class BagFormat(Enum):
    """How a file of a bag is written."""

    ROS1 = "ROS 1 bag"
    MCAP = "MCAP"
    SQLITE = "ROS 2 bag (SQLite)"


MAGIC_OF = {
    BagFormat.ROS1: b"#ROSBAG V2.0\n",
    BagFormat.MCAP: b"\x89MCAP0\r\n",
    BagFormat.SQLITE: b"SQLite format 3\0",
}

Raw: TypeAlias = tuple[str, int, bytes]
"""Topic, time of receipt in nanoseconds, the message's bytes."""


@dataclass(slots=True)
class Salvage:
    """What a walk through a file found.

    ``types`` (``package/msg/Name``), ``encodings`` (``ros1`` or ``cdr``), ``definitions`` (message
    definition, may be empty) and ``counts`` go by topic; ``damage`` is a sentence, empty for a whole file.
    """

    path: Path
    form: BagFormat
    types: dict[str, str] = field(default_factory=dict)
    encodings: dict[str, str] = field(default_factory=dict)
    definitions: dict[str, str] = field(default_factory=dict)
    counts: dict[str, int] = field(default_factory=dict)
    damage: str = ""

    def learn(self, topic: str, msgtype: str, encoding: str, definition: str) -> None:
        """Note what a connection or channel says of its topic."""
        package, _, name = msgtype.partition("/")
        self.types[topic] = msgtype if name.startswith("msg/") else f"{package}/msg/{name}"
        self.encodings[topic] = encoding
        self.definitions[topic] = definition


def damage_of(path: Path, chunks: int, cut: str) -> str:
    """Say in a sentence what is damaged; nothing for a whole file."""
    said = [cut] if cut else []
    if chunks:
        said.append(f"{chunks} damaged chunks were passed over")
    return f"{path.name}: {' and '.join(said)}; what is there was read" if said else ""
