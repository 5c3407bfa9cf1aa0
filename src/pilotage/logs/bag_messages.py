"""Messages of ROS 1 bags, ROS 2 bags (SQLite or MCAP storage) and MCAP files, through one door.

Whole bags are read by ``rosbags``. One that it refuses (cut short, never closed, a damaged part) is walked
record by record (``logs.salvage``), and what can be read is read.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias, TypeVar

from pilotage.core.errors import InputError
from pilotage.core.files import opened, read_yaml
from pilotage.logs.bounded_rosbags import bound_library, current_unpacker
from pilotage.logs.message_types import sharing, shipped_types, told_types
from pilotage.logs.rosbags_extra import rosbags
from pilotage.logs.salvage.found import MAGIC_OF, BagFormat, Salvage
from pilotage.logs.salvage.unpacking import Unpacker
from pilotage.logs.salvage.walk import salvage_file, salvaged_messages

ZSTD = b"\x28\xb5\x2f\xfd"
T = TypeVar("T")
Message: TypeAlias = tuple[str, int, Any]
"""Topic, time of receipt in nanoseconds, and the message as ``rosbags`` deserializes it."""


@dataclass(frozen=True, slots=True)
class Topic:
    """A topic of a bag: its name, message type (``package/msg/Name``), and how many messages it has."""

    name: str
    msgtype: str
    count: int

    def __str__(self) -> str:
        return f"{self.name} ({self.msgtype}, {self.count})"


@dataclass(frozen=True, slots=True)
class OpenBag:
    """A bag whose messages can be walked through.

    Attributes
    ----------
    topics
        All of the bag, by name.
    messages
        Yields those of the named topics in the order of their receipt; those that cannot be deserialized
        are yielded as None.
    warnings
        What is damaged.
    """

    topics: tuple[Topic, ...]
    messages: Callable[[Collection[str]], Iterator[Message]]
    warnings: tuple[str, ...]


MOST_DESCRIBED = 10_000
"""Values in the description of a bag: more than any has that describes its topics."""


def bag_format(path: Path) -> BagFormat | None:
    """Tell the kind of a file by its first bytes; None if it is none of a bag's."""
    with opened(path, "a recording") as file:
        head = file.read(16)
    return next((form for form, magic in MAGIC_OF.items() if head.startswith(magic)), None)


def is_bag(path: Path) -> bool:
    """Whether the path is a bag: a file of one of the kinds, or a folder that holds some."""
    if not path.is_dir():
        return bag_format(path) is not None
    return (path / "metadata.yaml").is_file() or bool(_storage_files(path))


def _storage_files(folder: Path) -> list[Path]:
    """Return the files of a ROS 2 bag, in the order in which they were written."""
    files = [path for path in folder.iterdir() if path.suffix in {".db3", ".mcap"} and path.is_file()]
    # rosbag2 numbers its files without leading zeros: name_2 comes before name_10.
    return sorted(files, key=lambda path: (len(path.name), path.name))


def _sound(folder: Path) -> bool:
    """Whether a folder's description reads within limits and names plain files: ``rosbags`` opens them.

    It reads the description again, far slower: one with too much in it is no bag's.
    """
    try:
        described = read_yaml(folder / "metadata.yaml", "a bag's description")
        names = described["rosbag2_bagfile_information"]["relative_file_paths"]
        return _values(described) <= MOST_DESCRIBED and all((folder / name).is_file() for name in names)
    except (InputError, OSError, KeyError, TypeError, ValueError):
        return False


def _values(tree: object) -> int:
    """How many values a description holds."""
    if isinstance(tree, dict):
        return sum(map(_values, tree.values()))
    return sum(map(_values, tree)) if isinstance(tree, list) else 1


def read_through(path: Path, read: Callable[[OpenBag], T]) -> T:
    """Read a bag by ``rosbags``; one that is cut or damaged as far as it goes.

    Raises
    ------
    InputError
        Where ``rosbags`` is missing, the path is no bag, or ``read`` cannot use what the bag holds.
    """
    with ExitStack() as stack:
        bag = open_whole(path, stack)
        if bag is not None:
            try:
                return read(bag)
            except InputError:
                raise
            except Exception:  # the library fails in many ways on a damaged part
                bag = None
    return read(open_damaged(path))


def open_whole(path: Path, stack: ExitStack) -> OpenBag | None:
    """Open a bag by ``rosbags``, or return None where that fails; the stack closes it.

    Raises
    ------
    InputError
        Where ``rosbags`` is not installed, or the path cannot be read or is no bag.
    """
    reader_of = sharing(rosbags("highlevel").AnyReader)
    if not path.exists():
        raise InputError(f"{path}: expected a bag, found no such file")
    if not is_bag(path):
        raise InputError(
            f"{path}: expected a ROS 1 bag, a ROS 2 bag (a folder or .db3) or MCAP, found none of them"
        )
    if path.is_dir() and not _sound(path):
        return None
    try:
        bound_library()
        current_unpacker.set(Unpacker(path))
        reader = reader_of([path], default_typestore=shipped_types("LATEST"))
        stack.enter_context(reader)
        topics = _sum_up((c.topic, c.msgtype, c.msgcount) for c in reader.connections)
    except InputError:  # packed beyond all limits
        raise
    except Exception:  # damaged bags make the library fail in any way; the walk then says what it finds
        return None

    def messages(names: Collection[str]) -> Iterator[Message]:
        wanted = [connection for connection in reader.connections if connection.topic in names]
        if not wanted:
            return
        current_unpacker.set(Unpacker(path))
        for connection, time_ns, raw in reader.messages(wanted):
            yield connection.topic, time_ns, _deserialized(reader.deserialize, raw, connection.msgtype)

    return OpenBag(topics, messages, ())


def open_damaged(path: Path) -> OpenBag:
    """Open a bag by walking its records; ``open_whole`` or its messages failed before.

    Raises
    ------
    InputError
        Where not a single message is found.
    """
    files = _storage_files(path) if path.is_dir() else [path]
    parts = [salvage_file(file, form) for file in files if (form := bag_format(file)) is not None]
    counts = [(topic, part.types[topic], count) for part in parts for topic, count in part.counts.items()]
    if not counts:
        reasons = "; ".join(part.damage for part in parts if part.damage) or "it is empty"
        raise InputError(f"{path}: expected a bag with messages, found none that can be read: {reasons}")
    warnings = tuple(part.damage for part in parts if part.damage)

    def messages(names: Collection[str]) -> Iterator[Message]:
        for part in parts:
            deserialize = _Deserializer(part)
            # In the order of receipt, as rosbags has them: within a file they stand in that of writing.
            for topic, time_ns, raw in sorted(salvaged_messages(part, names), key=lambda row: row[1]):
                yield topic, time_ns, _deserialized(deserialize, raw, topic)

    return OpenBag(_sum_up(counts), messages, warnings)


class _Deserializer:
    """Deserializes by the definitions in a file, or by those of the latest ROS 2 where it has none."""

    def __init__(self, part: Salvage) -> None:
        self._part, self._unpacker = part, Unpacker(part.path)
        self._stores: dict[str, Any] = {}

    def __call__(self, raw: bytes, topic: str) -> Any:
        store = self._stores.get(topic)
        if store is None:
            store = self._stores[topic] = self._store(topic)
        msgtype = self._part.types[topic]
        if self._part.encodings[topic] == "ros1":
            return store.deserialize_ros1(raw, msgtype)
        if raw[:4] == ZSTD:  # rosbag2 may pack each message; its first bytes then are no CDR header
            raw, _ = self._unpacker.unpack(raw, "zstd")
        return store.deserialize_cdr(raw, msgtype)

    def _store(self, topic: str) -> Any:
        definition = self._part.definitions.get(topic, "")
        return told_types(definition, self._part.types[topic]) if definition else shipped_types("LATEST")


def _deserialized(deserialize: Callable[[bytes, str], Any], raw: bytes, key: str) -> Any:
    try:
        return deserialize(raw, key)
    except InputError:  # packed beyond all limits
        raise
    except Exception:  # whatever damaged bytes provoke
        return None


def _sum_up(counts: Iterator[tuple[str, str, int]] | list[tuple[str, str, int]]) -> tuple[Topic, ...]:
    """One entry a topic and type: a topic may have several publishers, and a bag several files."""
    total: dict[tuple[str, str], int] = {}
    for name, msgtype, count in counts:
        total[name, msgtype] = total.get((name, msgtype), 0) + count
    return tuple(Topic(name, msgtype, count) for (name, msgtype), count in sorted(total.items()))
