"""Ways in which a file can be damaged: bytes, text, values, and what is no file at all."""

from __future__ import annotations

import copy
import gzip
import io
import json
import os
import random
import re
import socket
import sqlite3
import struct
import zlib
from collections.abc import Callable
from contextlib import closing, suppress
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from pilotage.core.yaml_text import load_yaml
from support.damage_forms import formed

Content = bytes
Change = Callable[[Content, random.Random], Content]

_NUMBERS = """
nan inf -inf .inf .nan 1e308 -1e308 1e999 1e-320 1e30 1e12 -1e6 0 -0.0 -1 3.5 9223372036854775808 4294967296
2147483648 0x7f 0b11 0o17 00012 1_000 1:30:00 2001-01-01 ² ½ ١٢ １２ 1,5 1e 1e+ + - . true null ~ [] {}
"""
NUMBERS = (*_NUMBERS.split(), "", "9" * 400, "9" * 5000, "0x" + "F" * 5000, "-" * 50)
"""In the place of a number."""

WORDS = (
    "\x1b[31mred\x1b[0m",
    "\x1b]0;title\x07",
    "[/red]",
    "<script>alert(1)</script>",
    "../../etc/passwd",
    "/dev/zero",
    "a" * 5000,
    "\u202egnp.exe",
    "é" * 300,
    "\ud800".encode("utf-8", "surrogatepass").decode("latin-1"),
    "{}[]:,&*#?|<>=!%@`",
    "\r",
    "\u2028",
    "null",
    "yes",
    "*a",
    "!!python/object:os.system ls",
    "%s%s%n",
    "'",
    '"',
    "\\ud800",
    "a\nb",
    "--",
    "--help",
    "/",
    "/dev/full",
    "/proc/self/mem",
    "a\udcffb",
    "mission.yaml/x",
    "0:1:1e-9",
    "[nan]",
    "&a [*a]",
    "é" * 130,
)
"""In the place of a word."""

MARKS = ("\x1b[31m", "\u202e\x07", "a\nb\r", "\udcff", "地図", "$\\frac{$")
"""What a file's name may hold: bytes that are no text, what a terminal or YAML would obey or a font lacks."""

VALUES: tuple[Any, ...] = (
    None,
    True,
    False,
    0,
    -1,
    1,
    2,
    1000.0,
    1e9,
    1e308,
    -1e308,
    1e-320,
    2**63,
    10**30,
    10**400,
    float("nan"),
    float("inf"),
    "",
    "x",
    "²",
    "a" * 5000,
    "\x1b[31m",
    "[/red]",
    "../..",
    "/dev/zero",
    "a\0b",
    [],
    {},
    [[]],
    [None],
    {"name": None},
    {"": ""},
    {"name": []},
    [0] * 3000,
    "1e3",
    "nan",
    [1, 2],
    [1, 2, 3],
    [[0, 0, 1, 0]],
)
"""In the place of a value in a mapping or list."""


def cut(data: Content, rng: random.Random) -> Content:
    """End early."""
    return data[: rng.randrange(len(data) + 1)]


def flip(data: Content, rng: random.Random) -> Content:
    """Some bytes are others."""
    changed = bytearray(data)
    for _ in range(rng.choice((1, 1, 3, 20))):
        if changed:
            changed[rng.randrange(len(changed))] = rng.randrange(256)
    return bytes(changed)


def insert(data: Content, rng: random.Random) -> Content:
    """Some bytes are in between."""
    at = rng.randrange(len(data) + 1)
    return data[:at] + rng.randbytes(rng.choice((1, 4, 100))) + data[at:]


def remove(data: Content, rng: random.Random) -> Content:
    """Some bytes are missing."""
    at = rng.randrange(len(data) + 1)
    return data[:at] + data[at + rng.choice((1, 4, 100)) :]


def repeat(data: Content, rng: random.Random) -> Content:
    """A part is there twice."""
    begin, end = sorted(rng.randrange(len(data) + 1) for _ in range(2))
    return data[:end] + data[begin:end] + data[end:]


def lines(data: Content, rng: random.Random) -> Content:
    """Lines are missing, twice, in another order, joined, or longer."""
    rows = data.split(b"\n")
    for _ in range(rng.choice((1, 2, 10))):
        i, j = rng.randrange(len(rows)), rng.randrange(len(rows))
        how = rng.randrange(5)
        if how == 0:
            rows[i], rows[j] = rows[j], rows[i]
        elif how == 1:
            rows.insert(j, rows[i])
        elif how == 2 and len(rows) > 1:
            del rows[i]
        elif how == 3:
            rows[i] = rows[i] + b" " + rows[j]
        else:
            words = rows[i].split()
            rng.shuffle(words)
            rows[i] = b" ".join(words)
    return b"\n".join(rows)


def number(data: Content, rng: random.Random) -> Content:
    """A number is another, or none."""
    return _instead(data, rb"[-+]?\d[\d.]*(?:[eE][-+]?\d+)?", rng.choice(NUMBERS), rng)


def word(data: Content, rng: random.Random) -> Content:
    """A word is another."""
    return _instead(data, rb"[A-Za-z_][\w.-]*", rng.choice(WORDS), rng)


def _instead(data: Content, pattern: bytes, text: str, rng: random.Random) -> Content:
    found = list(re.finditer(pattern, data))
    if not found:
        return data + text.encode("utf-8", "surrogatepass")
    place = rng.choice(found)
    return data[: place.start()] + text.encode("utf-8", "surrogatepass") + data[place.end() :]


def values(data: Content, rng: random.Random) -> Content:
    """A value of a YAML or JSON file is another, missing, twice inside itself or deep inside lists."""
    try:
        tree = load_yaml(data.decode(), "")
    except Exception:
        return number(data, rng)
    places = list(_places(tree))
    if not places:
        return b"[]"
    tree = copy.deepcopy(tree)
    for _ in range(rng.choice((1, 1, 2))):
        path = rng.choice(places)
        holder: Any = tree
        try:
            for key in path[:-1]:
                holder = holder[key]
            how = rng.randrange(6)
            if how == 0 and isinstance(holder, dict):
                del holder[path[-1]]
            elif how == 1 and isinstance(holder, dict):
                holder[f"{path[-1]}{rng.choice(('', 's', '_m', chr(27)))}x"] = holder[path[-1]]
            elif how == 2:
                value: Any = holder[path[-1]]
                for _ in range(rng.choice((1, 3, 60, 80))):
                    value = [value]
                holder[path[-1]] = value
            else:
                holder[path[-1]] = rng.choice(VALUES)
        except (KeyError, IndexError, TypeError):
            continue
    if data.lstrip()[:1] == b"{":
        with suppress(TypeError):  # a key that an earlier damage made a list
            return json.dumps(tree, default=str).encode()
    return yaml.safe_dump(tree, sort_keys=False, allow_unicode=rng.random() < 0.5).encode("utf-8", "replace")


def _places(tree: Any) -> list[tuple[Any, ...]]:
    inner = tree.items() if isinstance(tree, dict) else enumerate(tree) if isinstance(tree, list) else ()
    found: list[tuple[Any, ...]] = []
    for key, value in inner:
        found += [(key,), *((key, *rest) for rest in _places(value))]
    return found


def bomb(levels: int = 9) -> Content:
    """Small as text, endless with its aliases written out."""
    rows = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    rows += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]" for i in range(1, levels)]
    return "\n".join(rows).encode()


def zeros_packed(megabytes: int) -> Content:
    """Gzipped zeros: small, and large where they are unpacked.

    After a full flush nothing refers to what came before, so one packed block stands for all of them.
    """
    block = bytes(1_000_000)
    packer = zlib.compressobj(9, zlib.DEFLATED, -zlib.MAX_WBITS)
    packed, check = packer.compress(block) + packer.flush(zlib.Z_FULL_FLUSH), 0
    for _ in range(megabytes):
        check = zlib.crc32(block, check)
    size = megabytes * len(block)
    head = gzip.compress(b"", mtime=0)[:10]
    return head + packed * megabytes + packer.flush() + struct.pack("<LL", check, size % 2**32)


def endless_rows() -> Content:
    """A bag's and a study's database whose rows come from views that never end."""
    counting = "with recursive n(i) as (select 1 union all select i + 1 from n) select"
    with closing(sqlite3.connect(":memory:")) as base:
        base.executescript(
            f"""create table topics (id, name, type, serialization_format);
            insert into topics values (1, '/scan', 'sensor_msgs/msg/LaserScan', 'cdr');
            create view messages as {counting} 2 as topic_id, i as timestamp, '' as data from n;
            create view trials as {counting} i as row, 'done' as status from n;
            create view meta as {counting} i as key, '' as value from n;"""
        )
        return base.serialize()


def signalling() -> Content:
    """A NumPy file of numbers of which one is a NaN that processors signal: working with it warns."""
    values, file = np.zeros((6, 6), np.float32), io.BytesIO()
    values.view(np.uint32)[2, 3] = 0x7FA00000
    np.save(file, values)
    return file.getvalue()


WHOLE: dict[str, Content] = {
    "empty": b"",
    "a line end": b"\n",
    "zeros": bytes(1000),
    "no text": b"\xff" * 100,
    "half a pair": b"\xed\xa0\x80",
    "UTF-16": "a: 1\n".encode("utf-16"),
    "a byte order mark": b"\xef\xbb\xbf",
    "an alias bomb": bomb(),
    "lists inside lists": b"[" * 1000,
    "lists inside lists, closed": b"[" * 1000 + b"]" * 1000,
    "mappings inside mappings": b"{a: " * 1000,
    "objects inside objects": b'{"a":' * 5000,
    "keys of keys": b"? " * 1000,
    "an alias of itself": b"a: &a [*a]",
    "a merge of itself": b"a: &a {<<: *a}",
    "a long line": b"1 " * 200_000,
    "a long word": b"x" * 1_000_000,
    "many lines": b"1\n" * 200_000,
    "colours": b"\x1b[31mred\x1b[0m\n" * 30,
    "gzip of nothing": gzip.compress(b"", mtime=0),
    "gzip of much": zeros_packed(300),
    "gzip cut": gzip.compress(b"1 2 3\n" * 1000, mtime=0)[:-10],
    "gzip in gzip": gzip.compress(gzip.compress(b"1 2 3\n", mtime=0), mtime=0),
    "a huge number": b"1" * 100_000,
    "a document after another": b"a: 1\n---\nb: 2\n",
    "NaN": b'{"a": NaN}',
    "a picture's header without numbers": b"P5\nx 20\n255\n",
    "a tag of one's own": b"a: !mine {b: 1}\n",
    "an event without a text": b'{"t_s": 1.0, "kind": 3, "text": null}\n',
    "beyond all doubles": b'{"a": 1e999, "b": 123456789012345678901234567890}',
    "ps": b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 10 10\n",
    "rows without end": endless_rows(),
    "a signalling NaN": signalling(),
    "a thousand columns": (",".join(f"c{i}_m" for i in range(1000)) + "\n").encode()
    + (",".join(["1.5"] * 1000) + "\n").encode() * 12,
}
"""In the place of the whole file."""


def whole(data: Content, rng: random.Random) -> Content:  # noqa: ARG001 - as all damages
    """Something else altogether."""
    return WHOLE[rng.choice(sorted(WHOLE))]


def packed(data: Content, rng: random.Random) -> Content:
    """Gzipped, and then damaged a little."""
    return flip(gzip.compress(data, mtime=0), rng) if rng.random() < 0.5 else gzip.compress(data, mtime=0)


BYTES: tuple[Change, ...] = (cut, flip, insert, remove, repeat, lines, number, number, word, whole, packed)
BYTES += (formed,) * 8
TREES: tuple[Change, ...] = (values, values, values, values, number, word, lines, cut, flip, whole)
TREES += (formed,) * 6


def damaged(data: Content, rng: random.Random, trees: bool = False) -> Content:
    """One to three damages in a row."""
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        data = rng.choice(TREES if trees else BYTES)(data, rng)
    return data


def _sparse(path: Path) -> None:
    with path.open("wb") as file:
        file.truncate(3_000_000_000)


def _socket(path: Path) -> None:
    here = Path.cwd()
    os.chdir(path.parent)  # a socket's whole path may have a hundred characters
    try:
        with socket.socket(socket.AF_UNIX) as made:
            made.bind(path.name)
    finally:
        os.chdir(here)


NO_FILES: dict[str, Callable[[Path], None]] = {
    "a pipe": os.mkfifo,
    "a folder": Path.mkdir,
    "zeros without end": lambda path: path.symlink_to("/dev/zero"),
    "noise without end": lambda path: path.symlink_to("/dev/urandom"),
    "a link to itself": lambda path: path.symlink_to(path),
    "a link to nothing": lambda path: path.symlink_to(path.parent / "nothing"),
    "a link to a folder": lambda path: path.symlink_to(path.parent),
    "memory": lambda path: path.symlink_to("/proc/self/mem"),
    "a file of no size that has one": lambda path: path.symlink_to("/proc/self/maps"),
    "a socket": _socket,
    "three billion zeros": _sparse,
    "nothing": lambda path: None,  # noqa: ARG005 - as all of these
}
"""What is no regular file, or a far too large one."""


def no_file(path: Path, rng: random.Random) -> str:
    """Put what is no regular file in the place of one; says what."""
    kind = rng.choice(sorted(NO_FILES))
    put(path, NO_FILES[kind])
    return kind


def put(path: Path, content: Content | Callable[[Path], None]) -> None:
    """Put other content, or what is no file, in the place of a file.

    Not over it: a file system would wait until the last one is on the disk.
    """
    path.unlink(missing_ok=True)
    if isinstance(content, bytes):
        path.write_bytes(content)
    else:
        content(path)


CORPUS: dict[str, Content | Callable[[Path], None]] = {**WHOLE, **NO_FILES}
"""All that ever broke a reader and fits every one of them."""
