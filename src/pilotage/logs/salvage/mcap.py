"""MCAP files (mcap.dev/spec), walked record by record."""

from __future__ import annotations

from collections.abc import Iterator

from pilotage.core.files import opened
from pilotage.logs.salvage.found import MAGIC_OF, BagFormat, Raw, Salvage, damage_of
from pilotage.logs.salvage.pieces import CutError, FileBytes, string, uint
from pilotage.logs.salvage.unpacking import Unpacker

_SCHEMA, _CHANNEL, _MESSAGE, _CHUNK, _DATA_END = 3, 4, 5, 6, 15


def walk_mcap(found: Salvage) -> Iterator[Raw]:
    """Yield the messages of an MCAP file; ``found`` learns on the way."""
    with opened(found.path, "a bag") as file:
        data = FileBytes(file)
        unpacker = Unpacker(found.path)
        schemas: dict[int, tuple[str, str]] = {}
        channels: dict[int, str] = {}
        place, damaged, closed = len(MAGIC_OF[BagFormat.MCAP]), 0, False
        while place + 9 <= len(data) and not closed:
            head = data[place : place + 9]
            if len(head) < 9:  # the file has shrunk meanwhile
                break
            op, end = head[0], place + 9 + uint(head, 1, 8)
            body = data[place + 9 : min(end, len(data))]
            closed = op == _DATA_END  # what follows repeats what was there
            try:
                if op == _CHUNK:
                    unpacked, whole = _mcap_chunk(body, unpacker)
                    damaged += not whole and end <= len(data)
                    yield from _mcap_records(unpacked, schemas, channels, found)
                elif end <= len(data):
                    yield from _mcap_record(op, body, schemas, channels, found)
            except CutError:
                damaged += end <= len(data)
            place = end
        found.damage = damage_of(
            found.path, damaged, "" if closed else "the file is cut short or was not closed"
        )


def _mcap_chunk(body: bytes, unpacker: Unpacker) -> tuple[bytes, bool]:
    size = uint(body, 28, 4)
    compression = body[32 : 32 + size].decode("ascii", "replace")
    start = 40 + size
    return unpacker.unpack(body[start : start + uint(body, start - 8, 8)], compression or "none")


def _mcap_records(
    data: bytes, schemas: dict[int, tuple[str, str]], channels: dict[int, str], found: Salvage
) -> Iterator[Raw]:
    place = 0
    while place + 9 <= len(data):
        end = place + 9 + uint(data, place + 1, 8)
        if end > len(data):
            return
        yield from _mcap_record(data[place], data[place + 9 : end], schemas, channels, found)
        place = end


def _mcap_record(
    op: int, body: bytes, schemas: dict[int, tuple[str, str]], channels: dict[int, str], found: Salvage
) -> Iterator[Raw]:
    if op == _SCHEMA:
        name, place = string(body, 2)
        encoding, place = string(body, place)
        text, _ = string(body, place)
        schemas[uint(body, 0, 2)] = name, text if encoding in {"ros1msg", "ros2msg"} else ""
    elif op == _CHANNEL:
        topic, place = string(body, 4)
        encoding, _ = string(body, place)
        name, text = schemas.get(uint(body, 2, 2), ("unknown/msg/Unknown", ""))
        channels[uint(body, 0, 2)] = topic
        found.learn(topic, name, encoding, text)
    elif op == _MESSAGE and (topic := channels.get(uint(body, 0, 2), "")):
        yield topic, uint(body, 6, 8), body[22:]
