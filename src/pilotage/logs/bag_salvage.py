"""What can still be read of a damaged bag: its records are walked from the beginning until they end.

Formats: ROS 1 bag V2.0 (wiki.ros.org/Bags/Format/2.0), MCAP (mcap.dev/spec), and the SQLite storage of
rosbag2. A chunk that is cut is unpacked as far as it goes; one that is damaged is passed over.
"""

from __future__ import annotations

import bz2
import importlib
import mmap
import sqlite3
import struct
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import Any, TypeAlias


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

    def messages(self, topics: Collection[str]) -> Iterator[Raw]:
        """Walk again and yield the messages of these topics, as far as they can be read."""
        for raw in _WALKS[self.form](self):
            if raw[0] in topics:
                yield raw

    def learn(self, topic: str, msgtype: str, encoding: str, definition: str) -> None:
        """Note what a connection or channel says of its topic."""
        package, _, name = msgtype.partition("/")
        self.types[topic] = msgtype if name.startswith("msg/") else f"{package}/msg/{name}"
        self.encodings[topic] = encoding
        self.definitions[topic] = definition


class _CutError(Exception):
    """The bytes end before the record does."""


def salvage_file(path: Path, form: BagFormat) -> Salvage:
    """Walk through a file once, to learn its topics and where it ends."""
    found = Salvage(path, form)
    for topic, _, _ in _WALKS[form](found):
        found.counts[topic] = found.counts.get(topic, 0) + 1
    return found


# ---- ROS 1 ----------------------------------------------------------------------------------------------


def _walk_ros1(found: Salvage) -> Iterator[Raw]:
    with found.path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
        names: dict[int, str] = {}
        place, damaged = len(MAGIC_OF[BagFormat.ROS1]), 0
        closed = False
        while place < len(data):
            try:
                header, body, place = _ros1_record(data, place)
            except _CutError:
                header, body = _ros1_cut_chunk(data, place)
                place = len(data)
                closed = False
            op = header.get(b"op")
            if op == b"\x03":  # the bag's header: without an index it was never closed
                closed = header.get(b"index_pos", b"") != bytes(8)
            elif op == b"\x05":
                unpacked, whole = unpack(body, header.get(b"compression", b"none").decode("ascii", "replace"))
                damaged += not whole and place < len(data)
                yield from _ros1_chunk(unpacked, names, found)
        found.damage = _damage(
            found.path, damaged, "" if closed else "the bag is cut short or was not closed"
        )


def _ros1_record(data: Any, place: int) -> tuple[dict[bytes, bytes], bytes, int]:
    size = _uint(data, place, 4)
    header_end = place + 4 + size
    body_size = _uint(data, header_end, 4)
    end = header_end + 4 + body_size
    if end > len(data):
        raise _CutError
    return _ros1_header(data[place + 4 : header_end]), data[header_end + 4 : end], end


def _ros1_cut_chunk(data: Any, place: int) -> tuple[dict[bytes, bytes], bytes]:
    """Header and remaining body of a record that is cut."""
    try:
        header_end = place + 4 + _uint(data, place, 4)
        if header_end + 4 > len(data):
            return {}, b""
        return _ros1_header(data[place + 4 : header_end]), data[header_end + 4 :]
    except _CutError:
        return {}, b""


def _ros1_header(raw: bytes) -> dict[bytes, bytes]:
    fields: dict[bytes, bytes] = {}
    place = 0
    while place + 4 <= len(raw):
        size = _uint(raw, place, 4)
        name, _, value = raw[place + 4 : place + 4 + size].partition(b"=")
        fields[name] = value
        place += 4 + size
    return fields


def _ros1_chunk(data: bytes, names: dict[int, str], found: Salvage) -> Iterator[Raw]:
    place = 0
    while place < len(data):
        try:
            header, body, place = _ros1_record(data, place)
        except _CutError:
            return
        number = int.from_bytes(header.get(b"conn", b""), "little")
        if header.get(b"op") == b"\x07":
            fields = _ros1_header(body)
            topic, msgtype, text = (
                value.decode("utf-8", "replace")
                for value in (
                    header.get(b"topic", b""),
                    fields.get(b"type", b""),
                    fields.get(b"message_definition", b""),
                )
            )
            names[number] = "/" + topic.lstrip("/")
            found.learn(names[number], msgtype, "ros1", text)
        elif header.get(b"op") == b"\x02" and number in names:
            stamp = header.get(b"time", b"").ljust(8, b"\0")
            seconds, nanoseconds = struct.unpack("<II", stamp[:8])
            yield names[number], seconds * 10**9 + nanoseconds, body


# ---- MCAP -----------------------------------------------------------------------------------------------

_SCHEMA, _CHANNEL, _MESSAGE, _CHUNK, _DATA_END = 3, 4, 5, 6, 15


def _walk_mcap(found: Salvage) -> Iterator[Raw]:
    with found.path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
        schemas: dict[int, tuple[str, str]] = {}
        channels: dict[int, str] = {}
        place, damaged, closed = len(MAGIC_OF[BagFormat.MCAP]), 0, False
        while place + 9 <= len(data) and not closed:
            op, size = data[place], _uint(data, place + 1, 8)
            end = place + 9 + size
            body = data[place + 9 : min(end, len(data))]
            closed = op == _DATA_END  # what follows repeats what was there
            try:
                if op == _CHUNK:
                    unpacked, whole = _mcap_chunk(body)
                    damaged += not whole and end <= len(data)
                    yield from _mcap_records(unpacked, schemas, channels, found)
                elif end <= len(data):
                    yield from _mcap_record(op, body, schemas, channels, found)
            except _CutError:
                damaged += end <= len(data)
            place = end
        found.damage = _damage(
            found.path, damaged, "" if closed else "the file is cut short or was not closed"
        )


def _mcap_chunk(body: bytes) -> tuple[bytes, bool]:
    size = _uint(body, 28, 4)
    compression = body[32 : 32 + size].decode("ascii", "replace")
    start = 40 + size
    return unpack(body[start : start + _uint(body, start - 8, 8)], compression or "none")


def _mcap_records(
    data: bytes, schemas: dict[int, tuple[str, str]], channels: dict[int, str], found: Salvage
) -> Iterator[Raw]:
    place = 0
    while place + 9 <= len(data):
        end = place + 9 + _uint(data, place + 1, 8)
        if end > len(data):
            return
        yield from _mcap_record(data[place], data[place + 9 : end], schemas, channels, found)
        place = end


def _mcap_record(
    op: int, body: bytes, schemas: dict[int, tuple[str, str]], channels: dict[int, str], found: Salvage
) -> Iterator[Raw]:
    if op == _SCHEMA:
        name, place = _string(body, 2)
        encoding, place = _string(body, place)
        text, _ = _string(body, place)
        schemas[_uint(body, 0, 2)] = name, text if encoding in {"ros1msg", "ros2msg"} else ""
    elif op == _CHANNEL:
        topic, place = _string(body, 4)
        encoding, _ = _string(body, place)
        name, text = schemas.get(_uint(body, 2, 2), ("unknown/msg/Unknown", ""))
        channels[_uint(body, 0, 2)] = topic
        found.learn(topic, name, encoding, text)
    elif op == _MESSAGE and (topic := channels.get(_uint(body, 0, 2), "")):
        yield topic, _uint(body, 6, 8), body[22:]


# ---- SQLite ---------------------------------------------------------------------------------------------


def _walk_sqlite(found: Salvage) -> Iterator[Raw]:
    # What is missing at the end of a file is zeros to SQLite, also within a message that is cut. Filled up
    # with two different bytes, a message that is not the same in both is cut.
    data = found.path.read_bytes()
    missing = _missing(data)
    walks = [_sqlite_rows(data + missing * fill, found) for fill in ((b"\0", b"\xff") if missing else (b"",))]
    cut = "the file is cut short" if missing else ""
    try:
        for rows in zip(*walks, strict=False):
            if all(row == rows[0] for row in rows):
                yield rows[0]
    except (sqlite3.Error, ValueError, TypeError, OverflowError) as error:
        cut = cut or f"the file is damaged ({error})"
    found.damage = _damage(found.path, 0, cut)


def _missing(data: bytes) -> int:
    """Bytes that a SQLite file lacks by its own header, as far as there can be use in filling them up."""
    if len(data) < 100:
        return 0
    page = int.from_bytes(data[16:18], "big")
    whole = (65536 if page == 1 else page) * int.from_bytes(data[28:32], "big")
    return max(0, whole - len(data)) if whole < 20 * len(data) else 0


def _sqlite_rows(data: bytes, found: Salvage) -> Iterator[Raw]:
    base = sqlite3.connect(":memory:")
    try:
        base.deserialize(data)
        # Without this, a file shorter than its header says is refused as a whole.
        base.execute("PRAGMA writable_schema=ON")
        names: dict[int, str] = {}
        for number, topic, msgtype, form in base.execute(
            "SELECT id, name, type, serialization_format FROM topics"
        ):
            if isinstance(topic, str) and isinstance(msgtype, str):
                names[number] = topic
                found.learn(topic, msgtype, str(form), "")
        for number, stamp, raw in base.execute("SELECT topic_id, timestamp, data FROM messages NOT INDEXED"):
            if number in names and isinstance(raw, bytes):
                yield names[number], int(stamp), raw
    finally:
        base.close()


_WALKS: dict[BagFormat, Callable[[Salvage], Iterator[Raw]]] = {
    BagFormat.ROS1: _walk_ros1,
    BagFormat.MCAP: _walk_mcap,
    BagFormat.SQLITE: _walk_sqlite,
}

# ---- shared ---------------------------------------------------------------------------------------------


def unpack(data: bytes, compression: str) -> tuple[bytes, bool]:
    """Unpack a chunk as far as it goes.

    Returns
    -------
    The bytes, and whether the chunk is whole as far as its packing tells.
    """
    if compression == "none":
        return data, True
    unpacker: Any
    if compression == "bz2":
        unpacker = bz2.BZ2Decompressor()
    elif compression == "lz4":
        unpacker = importlib.import_module("lz4.frame").LZ4FrameDecompressor()
    elif compression == "zstd":
        unpacker = _zstd().ZstdDecompressor()
    else:
        return b"", False
    parts: list[bytes] = []
    try:
        # Piece by piece, so that what stands before a damaged byte is kept.
        for start in range(0, len(data), 4096):
            if unpacker.eof:
                break
            parts.append(unpacker.decompress(data[start : start + 4096]))
    except Exception:  # each library has its own errors
        return b"".join(parts), False
    return b"".join(parts), bool(unpacker.eof)


def _zstd() -> Any:
    """Return zstd, which rosbags brings along below Python 3.14."""
    try:
        return importlib.import_module("compression.zstd")
    except ImportError:
        return importlib.import_module("backports.zstd")


def _damage(path: Path, chunks: int, cut: str) -> str:
    said = [cut] if cut else []
    if chunks:
        said.append(f"{chunks} damaged chunks were passed over")
    return f"{path.name}: {' and '.join(said)}; what is there was read" if said else ""


def _uint(data: Any, place: int, size: int) -> int:
    raw = data[place : place + size]
    if len(raw) < size:
        raise _CutError
    return int.from_bytes(raw, "little")


def _string(data: bytes, place: int) -> tuple[str, int]:
    end = place + 4 + _uint(data, place, 4)
    if end > len(data):
        raise _CutError
    return data[place + 4 : end].decode("utf-8", "replace"), end
