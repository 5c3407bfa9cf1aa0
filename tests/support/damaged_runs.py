"""Run folders damaged in every way that was ever seen to break a report; each a name and what it does."""

from __future__ import annotations

import io
import json
import os
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

Damage = Callable[[Path], None]

VALUES: dict[str, str] = {
    "huge": "1e308",
    "minus huge": "-1e308",
    "beyond doubles": "1e999",
    "long": "9" * 5000,
    "many digits": "9" * 350,
    "nan": "NaN",
    "null": "null",
    "true": "true",
    "words": '"words"',
    "half a pair": '"\\ud800 \\u0000 \\u001b[31m"',
    "script": '"</script><script>alert(1)</script>"',
    "list": "[[1, 2], [3]]",
    "object": '{"a": {"b": 1}}',
    "deep": "[" * 3000 + "]" * 3000,
    "tiny": "5e-324",
}
"""JSON texts that stand in the place of a value."""
TEXTS: dict[str, bytes] = {
    "empty": b"",
    "bytes": bytes(range(256)),
    "half": b'{"a": [1, 2',
    "list": b"[1, 2, 3]",
    "deep": b"[" * 100_000,
    "zero bytes": b"\0" * 1000,
    "number": b"7",
    "bom": b"\xef\xbb\xbf{}",
}
ARRAYS: dict[str, Callable[[Any], Any]] = {
    "of words": lambda a: np.full(a.shape, "x"),
    "complex": lambda a: a.astype(complex) if a.dtype.kind in "biuf" else np.array(1j),
    "of dates": lambda a: np.full(a.shape, np.datetime64("2026-01-01")),
    "nan": lambda a: np.full(a.shape, np.nan),
    "infinite": lambda a: np.full(a.shape, np.inf),
    "huge": lambda a: np.full(a.shape, 1e308),
    "rather huge": lambda a: np.full(a.shape, -9e29),
    "large": lambda a: np.full(a.shape, 9e8),
    "negative": lambda a: np.full(a.shape, -7),
    "one more dimension": lambda a: a[None],
    "cut short": lambda a: a[: len(a) // 2] if a.ndim else np.zeros(0),
    "nothing": lambda a: np.zeros((0,) * a.ndim),
    "one number": lambda _: np.array(3.0),
}
COLUMNS: dict[str, Callable[[Any], Any]] = {
    "huge": lambda a: np.full(len(a), 1e308),
    "rather huge": lambda a: np.full(len(a), -9e29),
    "huge here and there": lambda a: np.where(np.arange(len(a)) % 5 == 2, 1e29, a),
    "nan": lambda a: np.full(len(a), np.nan),
    "infinite": lambda a: np.full(len(a), np.inf),
    "tiny": lambda a: np.full(len(a), 5e-324),
    "zero": lambda a: np.zeros(len(a)),
    "backwards": lambda a: a[::-1],
    "words": lambda a: np.full(len(a), "x"),
    "whole numbers": lambda a: np.full(len(a), -(2**62)),
    "flags": lambda a: np.arange(len(a)) % 2 == 0,
}


def damages(folder: Path, rng: np.random.Generator, each: int = 2) -> Iterator[tuple[str, Damage]]:
    """Name and effect of damages to the files that a run folder has; of each kind ``each``, drawn."""
    for name in sorted(path.name for path in folder.iterdir() if path.is_file()):
        for word, content in TEXTS.items():
            yield f"{name}: {word}", _bytes(name, content)
        yield f"{name}: cut short", _cut(name)
        yield f"{name}: a pipe", _pipe(name)
        yield f"{name}: a folder", _folder(name)
        yield f"{name}: a device", _device(name)
        yield f"{name}: missing", _missing(name)
        if name.endswith(".json"):
            leaves = list(_leaves(json.loads((folder / name).read_text())))
            for word, text in VALUES.items():
                for k in rng.choice(len(leaves), min(each, len(leaves)), replace=False):
                    yield f"{name}: {leaves[k]}: {word}", _value(name, leaves[k], text)
        if name.endswith(".jsonl"):
            for word, text in VALUES.items():
                line = f'{{"t_s": {text}, "kind": {text}, "text": {text}}}\n'
                yield f"{name}: {word}", _bytes(name, line.encode())
                line = f'{{"t_s": {text}, "kind": "plan", "text": "x"}}\n'
                yield f"{name}: time {word}", _bytes(name, line.encode())
        if name.endswith(".npz"):
            names = np.load(folder / name).files
            for word, change in ARRAYS.items():
                for array in rng.choice(names, min(each, len(names)), replace=False):
                    yield f"{name}: {array}: {word}", _array(name, str(array), change)
        if name.endswith(".parquet"):
            names = pq.read_schema(folder / name).names
            for word, change in COLUMNS.items():
                for column in rng.choice(names, min(2 * each, len(names)), replace=False):
                    yield f"{name}: {column}: {word}", _columns(name, [str(column)], change)
                yield f"{name}: every column: {word}", _columns(name, names, change)
    yield "a bomb of zeros in plans.npz", _npz_bomb("plans.npz")
    yield "a header that promises terabytes in plans.npz", _lying_npz("plans.npz")
    yield "an archive of objects in scans.npz", _objects("scans.npz")
    yield "a bomb of one value in trace.parquet", _parquet_bomb
    yield "mission.yaml: a bomb of aliases", _bytes("mission.yaml", _alias_bomb())
    yield "mission.yaml: deep", _bytes("mission.yaml", b"a: " + b"[" * 1000 + b"]" * 1000)
    yield (
        "mission.yaml: numbers",
        _bytes("mission.yaml", b"run: {settle_s: 1e308}\nworld: {kind: [1]}\nstack: 3\n"),
    )
    yield (
        "mission.yaml: words",
        _bytes("mission.yaml", b"mission: [1, 2]\ndescription: {a: 1}\nrun: [3]\nworld: 7\n"),
    )


def _bytes(name: str, content: bytes) -> Damage:
    def damage(folder: Path) -> None:
        (folder / name).write_bytes(content)

    return damage


def _cut(name: str) -> Damage:
    def damage(folder: Path) -> None:
        content = (folder / name).read_bytes()
        (folder / name).write_bytes(content[: len(content) * 2 // 3])

    return damage


def _missing(name: str) -> Damage:
    def damage(folder: Path) -> None:
        (folder / name).unlink()

    return damage


def _pipe(name: str) -> Damage:
    def damage(folder: Path) -> None:
        (folder / name).unlink()
        os.mkfifo(folder / name)

    return damage


def _folder(name: str) -> Damage:
    def damage(folder: Path) -> None:
        (folder / name).unlink()
        (folder / name).mkdir()

    return damage


def _device(name: str) -> Damage:
    def damage(folder: Path) -> None:
        (folder / name).unlink()
        (folder / name).symlink_to("/dev/zero")

    return damage


def _leaves(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Paths to values and to lists and objects of a JSON value, of every list the first entry only."""
    if path:
        yield path
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from _leaves(inner, (*path, key))
    elif isinstance(value, list) and value:
        yield from _leaves(value[0], (*path, 0))


def _value(name: str, path: tuple[Any, ...], text: str) -> Damage:
    def damage(folder: Path) -> None:
        content = json.loads((folder / name).read_text())
        at = content
        for key in path[:-1]:
            at = at[key]
        at[path[-1]] = "<<here>>"
        (folder / name).write_text(json.dumps(content).replace('"<<here>>"', text))

    return damage


def _array(name: str, array: str, change: Callable[[Any], Any]) -> Damage:
    def damage(folder: Path) -> None:
        arrays = dict(np.load(folder / name))
        arrays[array] = change(arrays[array])
        np.savez_compressed(folder / name, **arrays)

    return damage


def _columns(name: str, columns: list[str], change: Callable[[Any], Any]) -> Damage:
    def damage(folder: Path) -> None:
        table = pq.read_table(folder / name)
        values = {key: np.asarray(table[key].to_numpy()) for key in table.column_names}
        for column in columns:
            values[column] = change(values[column])
        pq.write_table(pa.table(values), folder / name)

    return damage


@cache
def _packed_zeros() -> bytes:
    """Packed once for all folders: it takes longer than to draw a page."""
    packed = io.BytesIO()
    np.savez_compressed(packed, path_0=np.zeros(200_000_000, dtype=np.uint8))
    return packed.getvalue()


def _npz_bomb(name: str) -> Damage:
    def damage(folder: Path) -> None:
        (folder / name).write_bytes(_packed_zeros())

    return damage


def _lying_npz(name: str) -> Damage:
    def damage(folder: Path) -> None:
        import zipfile

        header = io.BytesIO()
        shape = {"descr": "<f8", "fortran_order": False, "shape": (10**12, 3)}
        np.lib.format.write_array_header_1_0(header, shape)
        with zipfile.ZipFile(folder / name, "w") as archive:
            archive.writestr("path_0.npy", header.getvalue() + bytes(64))

    return damage


def _objects(name: str) -> Damage:
    def damage(folder: Path) -> None:
        np.savez(folder / name, scan_t_s=np.array([{"a": 1}, None], dtype=object))

    return damage


def _parquet_bomb(folder: Path) -> None:
    pq.write_table(pa.table({"t_s": np.zeros(40_000_000, dtype=np.int8)}), folder / "trace.parquet")


def _alias_bomb() -> bytes:
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 10)}]" for k in range(1, 10)]
    return "\n".join(lines).encode()
