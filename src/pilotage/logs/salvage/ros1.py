"""ROS 1 bags, format V2.0 (wiki.ros.org/Bags/Format/2.0), walked chunk by chunk."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from typing import Any

from pilotage.core.files import opened
from pilotage.logs.salvage.found import MAGIC_OF, BagFormat, Raw, Salvage, damage_of
from pilotage.logs.salvage.pieces import CutError, FileBytes, uint
from pilotage.logs.salvage.unpacking import Unpacker


def walk_ros1(found: Salvage) -> Iterator[Raw]:
    """Yield the messages of a ROS 1 bag; ``found`` learns on the way."""
    with opened(found.path, "a bag") as file:
        data = FileBytes(file)
        unpacker = Unpacker(found.path)
        names: dict[int, str] = {}
        place, damaged = len(MAGIC_OF[BagFormat.ROS1]), 0
        closed = False
        while place < len(data):
            try:
                header, body, place = _ros1_record(data, place)
            except CutError:
                header, body = _ros1_cut_chunk(data, place)
                place = len(data)
                closed = False
            op = header.get(b"op")
            if op == b"\x03":  # the bag's header: without an index it was never closed
                closed = header.get(b"index_pos", b"") != bytes(8)
            elif op == b"\x05":
                packing = header.get(b"compression", b"none").decode("ascii", "replace")
                unpacked, whole = unpacker.unpack(body, packing)
                damaged += not whole and place < len(data)
                yield from _ros1_chunk(unpacked, names, found)
        found.damage = damage_of(
            found.path, damaged, "" if closed else "the bag is cut short or was not closed"
        )


def _ros1_record(data: Any, place: int) -> tuple[dict[bytes, bytes], bytes, int]:
    size = uint(data, place, 4)
    header_end = place + 4 + size
    body_size = uint(data, header_end, 4)
    end = header_end + 4 + body_size
    if end > len(data):
        raise CutError
    return _ros1_header(data[place + 4 : header_end]), data[header_end + 4 : end], end


def _ros1_cut_chunk(data: Any, place: int) -> tuple[dict[bytes, bytes], bytes]:
    """Header and remaining body of a record that is cut."""
    try:
        header_end = place + 4 + uint(data, place, 4)
        if header_end + 4 > len(data):
            return {}, b""
        return _ros1_header(data[place + 4 : header_end]), data[header_end + 4 :]
    except CutError:
        return {}, b""


def _ros1_header(raw: bytes) -> dict[bytes, bytes]:
    fields: dict[bytes, bytes] = {}
    place = 0
    while place + 4 <= len(raw):
        size = uint(raw, place, 4)
        name, _, value = raw[place + 4 : place + 4 + size].partition(b"=")
        fields[name] = value
        place += 4 + size
    return fields


def _ros1_chunk(data: bytes, names: dict[int, str], found: Salvage) -> Iterator[Raw]:
    place = 0
    while place < len(data):
        try:
            header, body, place = _ros1_record(data, place)
        except CutError:
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
