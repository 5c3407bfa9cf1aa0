"""Columns of Parquet files, of plain values only, bounded before they are unpacked."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.files.arrays import Array, quiet
from pilotage.core.files.plain import read_bytes
from pilotage.core.limits import DATA_BYTES, MB, limit, too_large

_BYTES_A_VALUE = 8
_HEADER_BYTES = 16 * MB
_MOST_COLUMNS = 10_000


def read_parquet(
    path: Path,
    names: Sequence[str] | None = None,
    what: str = "a Parquet file",
    most: int = DATA_BYTES,
    perhaps: Sequence[str] = (),
) -> dict[str, Array]:
    """Read columns as arrays of equal length.

    Numbers and truth values come as they are stored (missing numbers as NaN), text as arrays of objects.

    Parameters
    ----------
    names
        The columns that are wanted; None for all.
    perhaps
        Columns that are wanted besides where they are there.
    most
        Limit in bytes, packed and unpacked, before the user's setting.

    Raises
    ------
    InputError
        Where it is no such file, a column is missing or of another kind, or they unpack to more than the
        limit.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    with _opened(path, what, most) as (file, data):
        wanted = _wanted(file, names, perhaps, str(path))
        _require_room(file.metadata, len(wanted), str(path), limit(most))
        # Text stays a dictionary until its letters are counted: one long word may stand in every row.
        text = [name for name in wanted if _is_text(file.schema_arrow.field(name).type)]
        file = pq.ParquetFile(pa.BufferReader(data), read_dictionary=text) if text else file
        table = file.read(columns=wanted, use_threads=False)
    return {name: _column(table.column(name), f"{path}: {name}") for name in wanted}


@contextmanager
def _opened(path: Path, what: str, most: int) -> Iterator[tuple[Any, bytes]]:
    """The file, and its bytes; what Arrow finds wrong with it is an InputError of one line."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    data = read_bytes(path, what, most)
    try:
        with pq.ParquetFile(
            pa.BufferReader(data),
            thrift_string_size_limit=_HEADER_BYTES,
            thrift_container_size_limit=_HEADER_BYTES,
        ) as file:
            yield file, data
    except (pa.ArrowException, OSError, ValueError, MemoryError, KeyError, OverflowError) as error:
        said = str(error).splitlines()[0] if str(error) else "damaged data"
        raise InputError(f"{path}: expected {what}, found: {said}") from None


def arrow_table(columns: Mapping[str, Array], metadata: Mapping[str, str] | None = None) -> Any:
    """Return columns as a ``pyarrow.Table``.

    Arrow imports pandas, where it is installed, to ask whether an array is one of its series: half a second
    of a process that has no other use for it. Numbers are handed over as the memory that they lie in instead.
    """
    import pyarrow as pa

    def column(values: Array) -> Any:
        if values.ndim != 1 or values.dtype.kind not in "fiu":
            return pa.array(values)
        kind = values.dtype.newbyteorder("=")
        held = pa.py_buffer(np.ascontiguousarray(values, kind))
        return pa.Array.from_buffers(pa.from_numpy_dtype(kind), len(values), [None, held])

    return pa.table({name: column(values) for name, values in columns.items()}, metadata=metadata)


def parquet_metadata(path: Path) -> dict[str, str]:
    """Read the texts that stand beside the columns, by their keys; none where there are none.

    Raises
    ------
    InputError
        Where it is no such file.
    """
    with _opened(path, "a Parquet file", DATA_BYTES) as (file, _):
        found: dict[bytes, bytes] = file.schema_arrow.metadata or {}
        return {k.decode(errors="replace"): v.decode(errors="replace") for k, v in found.items()}


def _wanted(file: Any, names: Sequence[str] | None, perhaps: Sequence[str], where: str) -> list[str]:
    there = list(file.schema_arrow.names)
    if len(there) > _MOST_COLUMNS:
        raise too_large(where, _MOST_COLUMNS, len(there), "columns")
    wanted = there if names is None else list(dict.fromkeys([*names, *(n for n in perhaps if n in there)]))
    missing = [name for name in wanted if name not in there]
    if missing:
        raise InputError(f"{where}: expected the columns {', '.join(wanted)}; missing: {', '.join(missing)}")
    for name in wanted:
        if there.count(name) > 1:
            raise InputError(f"{where}: expected every column once, found '{name}' twice")
        kind = file.schema_arrow.field(name).type
        if not (_is_text(kind) or _is_number(kind)):
            raise InputError(f"{where}: {name}: expected numbers or text, found {kind}")
    return wanted


def _is_text(kind: Any) -> bool:
    import pyarrow as pa

    value = kind.value_type if pa.types.is_dictionary(kind) else kind
    return bool(pa.types.is_string(value) or pa.types.is_large_string(value))


def _is_number(kind: Any) -> bool:
    import pyarrow as pa

    return bool(pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_boolean(kind))


def _require_room(metadata: Any, columns: int, where: str, most: int) -> None:
    """Rows that one repeated value fills take nothing in the file: count them, and what pages unpack to."""
    groups = [metadata.row_group(i) for i in range(metadata.num_row_groups)]
    rows = max(metadata.num_rows, sum(group.num_rows for group in groups))
    size = max(rows * max(columns, 1) * _BYTES_A_VALUE, sum(group.total_byte_size for group in groups))
    if size > most:
        raise too_large(f"{where} ({rows} rows, unpacked)", most, size)
    if rows < 0:
        raise InputError(f"{where}: expected rows, found {rows}")


def _column(column: Any, where: str) -> Array:
    if not _is_text(column.type):
        return _numbers(column)
    most = limit(DATA_BYTES)
    held = sum(chunk.dictionary.nbytes for chunk in column.chunks)
    if held > most:
        raise too_large(f"{where} (text)", most, held)
    values = np.full(len(column), None, dtype=object)
    at = 0
    for chunk in column.chunks:
        # Rows with the same text share it: written out, a long one in many rows would fill the memory.
        words = [*chunk.dictionary.to_pylist(), None]
        places = chunk.indices.fill_null(len(words) - 1).to_numpy(zero_copy_only=False)
        for place in places:
            values[at] = words[place]
            at += 1
    return values


def _numbers(column: Any) -> Array:
    """What a column of numbers holds, taken from its memory: Arrow's own way imports pandas."""
    import pyarrow as pa

    if column.null_count or pa.types.is_boolean(column.type):  # which fill no whole memory
        return np.asarray(column.to_numpy(zero_copy_only=False))
    dtype = np.dtype(column.type.to_pandas_dtype())
    parts = [
        np.frombuffer(chunk.buffers()[1], dtype, len(chunk), chunk.offset * dtype.itemsize)
        for chunk in column.chunks
        if len(chunk)
    ]
    return quiet(np.concatenate(parts)) if parts else np.empty(0, dtype)
