"""Ways in which text is damaged by those who mean it well: other encodings, locales, columns, notations."""

from __future__ import annotations

import re
from collections.abc import Callable
from random import Random

ENCODINGS = ("utf-16", "utf-16-be", "utf-32", "utf-8-sig", "cp037", "cp1252", "utf-7")
LINE_ENDS = (b"\r\n", b"\r", b"\x0b", b"\x0c", b"\xc2\x85", b"\xe2\x80\xa8", b"\n\n", b"\n \t\n", b"\0\n")
SEPARATORS = (b";", b"\t", b"  ", b", ", b"|", b",,", b"\xc2\xa0", b"\x1f", b"")
_ODD_NUMBERS = """
1e400 -1e400 1e-400 1E+308 1.7976931348623157e308 4.9e-324 -0 -0.0 +1 .5 5. 0x1.8p3 1d5 1.#IND nan(0x1) -nan
Infinity #N/A #VALUE! NULL NA None 1'000 1_000.5 1,5 −1 １ 190:20:30 1e5e5 1..2 --1 1e99999999999 0e0 1e0x 1j
9007199254740993 18446744073709551616 1e18 1e-18 2024-01-01T00:00:00Z 12:30 50% $1 1/3 ½ (1) =1+1 true 1e15
"""
ODD_NUMBERS = _ODD_NUMBERS.split()
OPENING = (
    "%YAML 3.0\n---\n",
    "%YAML 1.1\n%TAG ! tag:x,2000:\n---\n",
    "--- !!set\n",
    "---\n---\n",
    "...\n",
    "# -*- coding: rot13 -*-\n",
    "sep=;\n",
    "<<: [{a: 1}, {a: 2}]\n",
    "? [1, 2]\n: 3\n",
    "~: 1\n",
    "1: 2\n",
    "true: x\n",
    "=: 1\n",
    "'': 1\n",
    "\t",
    "﻿﻿",
    '"',
    "'",
    "{",
    "/* a comment */",
    "#!/bin/sh\n",
    "<?xml version='1.0'?>\n",
)
TAGGED = (
    "!!binary aGk=",
    "!!timestamp 2001-01-01",
    "!!float x",
    "!!int 1.5",
    "!!null x",
    "!!set {a, b}",
    "!!omap [a: 1]",
    "!!pairs [a: 1]",
    "!!seq x",
    "!!map []",
    "!!str {a: 1}",
    "!!bool 3",
    "!!merge x",
    "!!python/name:os.system",
    "!<tag:yaml.org,2002:python/object/apply:os.system> [ls]",
    "!a {b: 1}",
    "&x [*x]",
    "&x {<<: *x}",
    "{<<: 1}",
    "{<<: [1, [2]]}",
    "{? {a: 1} : 2}",
    "{[1, 2]: 3}",
    "{null: 1, 1: 2, 1.5: 3, true: 4}",
    "{2001-01-01: 1}",
    "190:20:30",
    "1:99:99.5",
    "2001-13-45",
    "2001-12-14t21:59:43.10-05:00",
    "0b1012",
    "0o17",
    "017",
    "0x_f",
    "-.INF",
    ".NaN",
    "1e3",
    "1.e+3",
    "+.inf",
    "yes",
    "off",
    "=",
    "|\n  a\n   b",
    ">-\n  a",
    "NaN",
    "-Infinity",
    '"\\u0000"',
    '"\\ud83d"',
    '"\\x1b[2J"',
    "01",
    "-",
    "[1,]",
    "{,}",
    "'a' 'b'",
    "1 2",
    '{"a": 1, "a": 2}',
    "[" + "1, " * 20_000 + "1]",
    "{" + ", ".join(f"k{i}: {i}" for i in range(5000)) + "}",
)
"""YAML, some of it JSON, in the place of a value."""

NUMBER = re.compile(rb"(?<![\w.])[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?(?![\w.])")
VALUE = re.compile(rb"(?<=: )[^\n,{}\[\]]+")


def encoding(data: bytes, rng: Random) -> bytes:
    """The whole text, or its second half, in another encoding."""
    text = data.decode("utf-8", "replace")
    half = rng.choice((0, 0, len(text) // 2))
    return text[:half].encode() + text[half:].encode(rng.choice(ENCODINGS), "replace")


def line_ends(data: bytes, rng: Random) -> bytes:
    """Those of other systems, all or some; none after the last line."""
    end = rng.choice(LINE_ENDS)
    if rng.random() < 0.5:
        return data.replace(b"\n", end)
    return b"".join(row + (end if rng.random() < 0.2 else b"\n") for row in data.split(b"\n"))


def notation(data: bytes, rng: Random) -> bytes:
    """All numbers, or every so many, as another program or country writes them."""
    how = rng.randrange(8)
    if how == 0:
        return re.sub(rb"(\d)\.(\d)", rb"\1,\2", data)
    share = rng.choice((1.0, 0.3, 0.02))
    other = rng.choice(ODD_NUMBERS).encode()
    factor = rng.choice((0.0, -1.0, 1e-300, 1e300, 1e9, 1e-9, 1e6, 1.5, 57.29577951308232))

    def change(found: re.Match[bytes]) -> bytes:
        text = found.group()
        if rng.random() >= share:
            return text
        if how in (1, 2, 3):
            return other
        if how == 4:
            return b'"' + text + b'"'
        if how == 5:
            return b"%d" % min(max(float(text), -9e18), 9e18) if b"e" not in text.lower() else text
        return repr(float(text) * factor).encode()

    return NUMBER.sub(change, data)


def columns(data: bytes, rng: Random) -> bytes:
    """Columns swapped, missing, twice, all the same, in another order each row, or under other names."""
    rows = data.split(b"\n")
    between = next((mark for mark in (b",", b"\t", b" ") if mark in data), b" ")
    cells = [row.split(between) for row in rows]
    width = max(map(len, cells))
    a, b, how = rng.randrange(width), rng.randrange(width), rng.randrange(9)
    numbers = rng.choice(("0", "1", "-1", "1e300", "nan", "", "x", "1e-300", "1e9")).encode()
    seen = cells[-1]
    for at, row in enumerate(cells):
        if a >= len(row) or b >= len(row) or not any(row):
            continue
        if how == 0:
            row[a], row[b] = row[b], row[a]
        elif how == 1:
            del row[a]
        elif how == 2:
            row.insert(b, row[a])
        elif how in (3, 4) and at and (how == 3 or rng.random() < 0.3):
            row[a] = numbers
        elif how == 5 and at == 0:
            row[a] = rng.choice(
                (b"", row[b], row[a].upper(), b"\x1b[31m" + row[a], b" " + row[a], b"x" * 999)
            )
        elif how == 6:
            row[a] = b'"' + row[a] + rng.choice((b'"', b'""', b'\n"', b"'", b""))
        elif how == 7 and len(seen) > a:
            row[a], seen = seen[a], list(row)
        elif how == 8:
            row[:] = row[a:] + row[:a]
    if rng.random() < 0.2:
        between = rng.choice(SEPARATORS)
    return b"\n".join(between.join(row) for row in cells)


def order(data: bytes, rng: Random) -> bytes:
    """Rows backwards, shuffled, one of them only, the first ones only, all twice, or one ever again."""
    head, *rows = data.split(b"\n")
    how = rng.randrange(7)
    if how == 0:
        rows.reverse()
    elif how == 1:
        rng.shuffle(rows)
    elif how == 2:
        rows = [rng.choice(rows)] if rows else []
    elif how == 3:
        rows = rows[: rng.choice((0, 1, 2, 3))]
    elif how == 4:
        rows = [row for row in rows for _ in range(2)]
    elif how == 5:
        rows = [rng.choice(rows)] * rng.choice((10, 20_000)) if rows else []
    else:
        rows = [head, *rows]
    return b"\n".join([head, *rows])


def notes(data: bytes, rng: Random) -> bytes:
    """What other programs put before, between or after: directives, comments, a lone quote."""
    mark = rng.choice(OPENING).encode()
    rows = data.split(b"\n")
    at = rng.choice((0, 0, len(rows), rng.randrange(len(rows) + 1)))
    return b"\n".join(rows[:at]) + (b"\n" if at else b"") + mark + b"\n".join(rows[at:])


def tagged(data: bytes, rng: Random) -> bytes:
    """A value with a tag, an anchor, or of a kind that only YAML 1.1 has."""
    found = list(VALUE.finditer(data)) or list(NUMBER.finditer(data))
    if not found:
        return data
    place = rng.choice(found)
    return data[: place.start()] + rng.choice(TAGGED).encode() + data[place.end() :]


def exchanged(data: bytes, rng: Random) -> bytes:
    """Two values in each other's place, a key under another's name, or a value in many places."""
    pattern = rng.choice(
        (VALUE, NUMBER, re.compile(rb"(?<![\w-])[A-Za-z_][\w-]*(?=\"?: )"), re.compile(rb"[A-Za-z_-]+"))
    )
    found = list(pattern.finditer(data))
    if len(found) < 2:
        return data
    first, second = sorted(rng.sample(found, 2), key=lambda place: place.start())
    if rng.random() < 0.3:
        return pattern.sub(lambda place: first.group() if rng.random() < 0.3 else place.group(), data)
    middle = data[first.end() : second.start()]
    return data[: first.start()] + second.group() + middle + first.group() + data[second.end() :]


TEXT: tuple[Callable[[bytes, Random], bytes], ...] = (
    *(encoding, line_ends, notation, notation, columns, columns, order, notes, tagged, tagged, exchanged),
)
