"""Rows of a broken database by its pages: what SQLite cannot reach any more, since the way to it is lost.

The layout is that of https://www.sqlite.org/fileformat2.html: a leaf of a table (section 1.6) holds records
(section 2.1), those that are long continued on pages of their own.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from typing import Any

LEAF = 0x0D
HEADER = 8
WIDTHS = (0, 1, 2, 3, 4, 6, 8)
"""Bytes of a whole number by its serial type."""
REAL, ZERO, ONE = 7, 8, 9


def records(content: bytes, page_size: int, columns: int) -> Iterator[tuple[int, list[Any]]]:
    """Row number and values of every record of so many columns on any leaf; broken ones are left out.

    Old copies of rows may be among them, and any value may be wrong: check them.
    """
    for begin in range(0, len(content) - page_size + 1, page_size):
        page = content[begin : begin + page_size]
        if page[0] != LEAF:
            continue
        for place in range(HEADER, HEADER + 2 * int.from_bytes(page[3:5], "big"), 2):
            try:
                row, values = _record(
                    content, page, int.from_bytes(page[place : place + 2], "big"), page_size
                )
            except (IndexError, ValueError):  # also what is no text
                continue
            if len(values) == columns:
                yield row, values


def _record(content: bytes, page: bytes, at: int, page_size: int) -> tuple[int, list[Any]]:
    length, at = _varint(page, at)
    row, at = _varint(page, at)
    payload = _payload(content, page, at, length, page_size)
    end, at = _varint(payload, 0)
    types = []
    while at < end:
        kind, at = _varint(payload, at)
        types.append(kind)
    values = []
    for kind in types:
        value, at = _value(payload, at, kind)
        values.append(value)
    return row, values


def _payload(content: bytes, page: bytes, at: int, length: int, page_size: int) -> bytes:
    """A record's bytes, those on other pages too (section 1.6, table leaf cells)."""
    if length > len(content):
        raise ValueError("longer than the file")
    most = page_size - 35
    if length <= most:
        return page[at : at + length]
    least = (page_size - 12) * 32 // 255 - 23
    here = least + (length - least) % (page_size - 4)
    here = here if here <= most else least
    found = page[at : at + here]
    following = int.from_bytes(page[at + here : at + here + 4], "big")
    while len(found) < length:
        begin = (following - 1) * page_size
        if following < 1 or begin + page_size > len(content):
            raise ValueError("continued on no page")
        found += content[begin + 4 : begin + page_size]
        following = int.from_bytes(content[begin : begin + 4], "big")
    return found[:length]


def _value(payload: bytes, at: int, kind: int) -> tuple[Any, int]:
    if kind in (ZERO, ONE):
        return kind - ZERO, at
    if kind < REAL:
        end = at + WIDTHS[kind]
        value: Any = int.from_bytes(payload[at:end], "big", signed=True) if kind else None
    elif kind == REAL:
        end = at + 8
        (value,) = struct.unpack(">d", payload[at:end].rjust(8, b"\0"))
    elif kind >= 13 and kind % 2:
        end = at + (kind - 13) // 2
        value = payload[at:end].decode("utf-8")
    else:
        raise ValueError("a kind of value that a study does not write")
    if end > len(payload):
        raise ValueError("cut off")
    return value, end


def _varint(data: bytes, at: int) -> tuple[int, int]:
    value = 0
    for count in range(8):
        byte = data[at + count]
        value = (value << 7) | (byte & 0x7F)
        if byte < 0x80:
            return value, at + count + 1
    return (value << 8) | data[at + 8], at + 9
