"""Ways in which a file of a known form is damaged while its checksums stay right: by writing it anew."""

from __future__ import annotations

import io
import json
import sqlite3
import struct
import tempfile
import warnings
import zipfile
import zlib
from collections.abc import Callable
from contextlib import closing, suppress
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

from support.damage_text import TEXT

Change = Callable[[bytes, Random], bytes]
EXTREMES = (0, 1, 2, 7, 0x7F, 0x80, 0xFF, 0x7FFF, 0x8000, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF)
EXTREMES_64 = (2**31, 2**32, 2**40, 2**62, 2**63 - 1, 2**63, 2**64 - 1)
DTYPES: tuple[str, ...] = (
    *("?", "i1", "u1", "<i2", ">u2", "<f2", ">f4", "<f4", ">f8", "<c16", "<i8", "<u8", "U3", "S2", "O"),
    *("<M8[s]", "<m8[ns]", "V4"),
)


def fields(data: bytes, rng: Random) -> bytes:
    """Lengths, counts and offsets at their extremes, whole blocks gone, zero or elsewhere."""
    changed = bytearray(data)
    for _ in range(rng.choice((1, 1, 2, 8))):
        if len(changed) < 9:
            return bytes(changed)
        at = rng.randrange(min(len(changed) - 8, rng.choice((64, 512, len(changed)))))
        how = rng.randrange(6)
        if how < 3:
            changed[at : at + 4] = struct.pack(rng.choice("<>") + "I", rng.choice(EXTREMES))
        elif how == 3:
            changed[at : at + 8] = struct.pack(rng.choice("<>") + "Q", rng.choice(EXTREMES_64))
        elif how == 4:
            length = rng.choice((8, 64, 4096))
            changed[at : at + length] = bytes(len(changed[at : at + length]))
        else:
            length, to = rng.choice((4, 64, 4096)), rng.randrange(len(changed))
            changed[to:to] = changed[at : at + length]
            del changed[at : at + length]
    return bytes(changed)


def array(values: np.ndarray[Any, Any], rng: Random) -> np.ndarray[Any, Any]:
    """Another kind of number, another shape, or numbers that nobody measures."""
    how = rng.randrange(8)
    with warnings.catch_warnings(), np.errstate(all="ignore"), suppress(ValueError, TypeError):
        warnings.simplefilter("ignore")
        if how < 2:
            return values.astype(rng.choice(DTYPES))
        if how == 2:
            return np.asfortranarray(values) if rng.random() < 0.3 else values.T
        if how == 3:
            shape = rng.choice(((0,), (), (1, *values.shape), (*values.shape, 1), (0, 3), (2,) * 8, (-1,)))
            return np.resize(values, shape) if -1 not in shape else values.reshape(-1)
        if how == 4:
            return values[rng.choice((slice(0), slice(1), slice(None, None, -1), slice(None, None, 2)))]
        if how == 5:
            return np.concatenate([values, values])
        odd = rng.choice((np.nan, np.inf, -np.inf, 1e308, -1e308, 5e-324, -1.0, 2.0**63, 0.0, 1e9))
        flat = values.astype(float) if values.dtype.kind in "biuf" else values
        return np.where(
            np.array([rng.random() < 0.1 for _ in range(flat.size)]).reshape(flat.shape), odd, flat
        )
    return values


def npy(data: bytes, rng: Random) -> bytes:
    """Another array in a whole file, or another header on the same numbers."""
    if rng.random() < 0.5:
        values = np.load(io.BytesIO(data), allow_pickle=True)
        # Of numbers without bytes a damaged header may promise any number, and to write them takes for ever.
        if values.size <= len(data):
            return _saved(array(values, rng))
    header = rng.choice(
        (
            "{'descr': '<f8', 'fortran_order': True, 'shape': (0, 5)}",
            "{'descr': '<f8', 'fortran_order': False, 'shape': (-1, 5)}",
            "{'descr': '|b1', 'fortran_order': False, 'shape': (4294967296, 4294967296)}",
            "{'descr': '<f8', 'fortran_order': False, 'shape': (True, 2)}",
            "{'descr': [('a', '<f8'), ('b', '|O')], 'fortran_order': False, 'shape': (2,)}",
            "{'descr': '<f8', 'fortran_order': 3, 'shape': 12}",
            "{'descr': '<U99999', 'fortran_order': False, 'shape': (0,)}",
            "{'descr': '|V0', 'fortran_order': False, 'shape': (9223372036854775807,)}",
            "{'descr': '<f8'}",
            "[" * 300,
            "{'descr': '<f8', 'fortran_order': False, 'shape': " + "(" * 90 + ")" * 90 + "}",
            "{'descr': '<f8', 'fortran_order': False, 'shape': (" + "1," * 40 + ")}",
            "{'descr': '<f8', 'fortran_order': False, 'shape': (1e3,)}",
            "{'descr': '<f8', 'fortran_order': False, 'shape': (9" + "9" * 4400 + ",)}",
        )
    ).encode()
    version = rng.choice((1, 2, 3, 4, 255))
    length = struct.pack("<H" if version == 1 else "<I", len(header))
    return b"\x93NUMPY" + bytes((version, 0)) + length + header + data[80:]


def _saved(values: np.ndarray[Any, Any]) -> bytes:
    out = io.BytesIO()
    np.save(out, values, allow_pickle=True)
    return out.getvalue()


def npz(data: bytes, rng: Random) -> bytes:
    """Members missing, twice, under other names, packed otherwise, or with another array inside."""
    out = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    names, how = list(members), rng.randrange(8)
    chosen, other = rng.choice(names), rng.choice(names)
    packing = rng.choice((zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA))
    with warnings.catch_warnings(), zipfile.ZipFile(out, "w", packing) as made:
        warnings.simplefilter("ignore")
        for name in names:
            content, into = members[name], name
            if name == chosen:
                if how == 0:
                    continue
                if how == 1:
                    into = rng.choice(
                        (other, "../../x.npy", "x/y.npy", "", "\x1b[31m.npy", name[:-4], "a" * 999)
                    )
                elif how == 2:
                    content = members[other]
                elif how == 3:
                    content = rng.choice((b"", b"x", data, bytes(10_000_000)))
                else:
                    content = npy(content, rng)
            made.writestr(into, content)
        if how == 7:
            made.comment = b"PK\5\6" * 500
    return rng.choice((b"", b"", b"", b"#!/bin/sh\n")) + out.getvalue()


def image(data: bytes, rng: Random) -> bytes:
    """The picture in another mode, form or size, or with chunks that say something else."""
    from PIL import Image

    with Image.open(io.BytesIO(data)) as opened:
        picture = opened.convert("L")
    out = io.BytesIO()
    how = rng.randrange(10)
    columns, rows = picture.size
    if how == 0:
        mode = rng.choice(("1", "P", "LA", "PA", "RGB", "RGBA", "CMYK", "YCbCr", "I", "F", "I;16", "LAB"))
        with suppress(OSError, ValueError, KeyError):
            picture.convert(mode).save(out, rng.choice(("PNG", "TIFF", "TIFF", "JPEG", "PPM", "BMP")))
    elif how == 1:
        grey = np.asarray(picture).astype(np.float32)
        odd = np.where(
            np.indices(grey.shape).sum(0) % 3 == 0, np.float32(rng.choice((np.nan, np.inf, 1e30, -1))), grey
        )
        Image.fromarray(odd).save(out, "TIFF")
    elif how == 2:
        picture.save(out, rng.choice(("GIF", "WEBP", "ICO", "PDF", "EPS", "TGA")))
    elif how == 3:
        packing = rng.choice(("tiff_lzw", "tiff_adobe_deflate", "jpeg", "group4", "packbits"))
        picture.convert("1" if packing == "group4" else "L").save(out, "TIFF", compression=packing)
    elif how == 4:
        more = [picture.rotate(90 * k, expand=True) for k in range(1, 4)]
        picture.save(out, rng.choice(("PNG", "TIFF", "GIF")), save_all=True, append_images=more)
    elif how == 5:
        return plain_image(np.asarray(picture), rng)
    elif how == 6:
        size = rng.choice(((1, 1), (1, rows), (columns, 1), (7000, 7000), (1, 60_000), (3, 3)))
        picture.resize(size).save(out, "PNG")
    else:
        return png_of(np.asarray(picture), rng)
    return out.getvalue() or data


def plain_image(pixels: np.ndarray[Any, Any], rng: Random) -> bytes:
    """Of the PNM family, with an odd header."""
    rows, columns = pixels.shape
    kind = rng.choice((b"P1", b"P2", b"P3", b"P4", b"P5", b"P6", b"P7", b"Pf", b"P5\n# " + b"x" * 100_000))
    most = rng.choice((b"0", b"1", b"255", b"256", b"65535", b"65536", b"-1", b"1e3", b"", b"4294967296"))
    size = rng.choice(
        (b"%d %d" % (columns, rows), b"0 0", b"-1 5", b"%d" % columns, b"99999 99999", b"1 2 3 4")
    )
    body = pixels.tobytes() if rng.random() < 0.5 else b" ".join(b"%d" % v for v in pixels.ravel())
    return kind + rng.choice((b"\n", b" ", b"\r", b"\t#c\n")) + size + b"\n" + most + b"\n" + body


def png_of(pixels: np.ndarray[Any, Any], rng: Random) -> bytes:
    """A PNG whose chunks have right checksums and odd contents."""
    rows, columns = pixels.shape
    depth, colour = rng.choice(
        ((8, 0), (8, 0), (16, 0), (1, 0), (4, 3), (8, 3), (8, 6), (3, 0), (8, 5), (16, 6))
    )
    size = rng.choice(((columns, rows),) * 4 + ((0, rows), (30_000, 30_000), (2**31 - 1, 1), (1, 2**31 - 1)))
    lace, packing, sieve = rng.choice((0, 0, 1, 9)), rng.choice((0, 0, 0, 1)), rng.choice((0, 0, 0, 4, 9))
    row_bytes = bytes((sieve,)) + b"\x55" * (columns * 8)
    body = zlib.compress(row_bytes * rng.choice((rows, rows, 1, 0, 3000)))
    bomb = zlib.compress(bytes(60_000_000), 9)
    extra = {
        b"iCCP": b"x\0\0" + bomb,
        b"zTXt": b"x\0\0" + bomb,
        b"iTXt": b"x\0\1\0\0\0" + bomb,
        b"tEXt": b"\x1b[31m\0" + b"x" * 100_000,
        b"PLTE": bytes(rng.choice((0, 3, 7, 768, 3000))),
        b"tRNS": bytes(rng.choice((0, 1, 2, 6, 300))),
        b"gAMA": b"\0" * rng.choice((0, 4)),
        b"acTL": struct.pack(">II", 2**31 - 1, 0),
        b"eXIf": b"II*\0" + b"\xff" * 100,
        b"IHDR": bytes(13),
        b"\xff\xfe\0x": b"",
    }
    chunks = [(b"IHDR", struct.pack(">IIBBBBB", *size, depth, colour, packing, 0, lace))]
    chunks += [(name, extra[name]) for name in rng.sample(sorted(extra), rng.choice((0, 1, 1, 3)))]
    chunks += [(b"IDAT", body)] * rng.choice((1, 1, 1, 0, 2)) + [(b"IEND", b"")] * rng.choice((1, 1, 0))
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(text)) + name + text + struct.pack(">I", zlib.crc32(name + text))
        for name, text in chunks
    )


def parquet(data: bytes, rng: Random) -> bytes:
    """Columns of other types, missing, twice, with gaps, in other packing; rows in another order."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    table = pq.read_table(pa.BufferReader(data))
    at, how = rng.randrange(table.num_columns), rng.randrange(9)
    name, column = table.column_names[at], table.column(at)
    if how < 3:
        kinds: list[Any] = [
            *(pa.decimal128(38, 10), pa.decimal256(70, 3), pa.timestamp("ns"), pa.date32(), pa.time64("us")),
            *(pa.duration("s"), pa.binary(), pa.large_string(), pa.bool_(), pa.float16(), pa.uint64()),
            *(pa.dictionary(pa.int32(), pa.float64()), pa.dictionary(pa.int8(), pa.string()), pa.null()),
        ]
        with suppress(pa.ArrowException):
            table = table.set_column(at, name, column.cast(rng.choice(kinds), safe=False))
    elif how == 3:
        nested = rng.choice(
            (
                pa.array([[1.0]] * len(column)),
                pa.array([{"a": 1}] * len(column)),
                pa.array([[("k", 1)]] * len(column), pa.map_(pa.string(), pa.int8())),
                pa.array([[[]]] * len(column)),
                pa.array([b"\xff"] * len(column)),
            )
        )
        table = table.set_column(at, name, nested)
    elif how == 4:
        odd = rng.choice((None, float("nan"), float("inf"), 1e308, -1.0, 2**63, "x", "\x1b[31m"))
        with suppress(pa.ArrowException, OverflowError):
            values = [odd if rng.random() < 0.2 else value for value in column.to_pylist()]
            table = table.set_column(at, name, pa.array(values))
    elif how == 5:
        table = table.slice(0, rng.choice((0, 1, 2)))
    elif how == 6:
        table = table.take(pa.array(rng.sample(range(table.num_rows), table.num_rows)))
    elif how == 7:
        table = table.rename_columns(
            [
                *table.column_names[:at],
                rng.choice(("", "\x1b[31m", "t_s", "a.b", "é")),
                *table.column_names[at + 1 :],
            ]
        )
    else:
        table = table.remove_column(at)
    out = io.BytesIO()
    packing = rng.choice(("none", "snappy", "gzip", "brotli", "zstd", "lz4"))
    pq.write_table(
        table,
        out,
        compression=packing,
        row_group_size=rng.choice((1, 1000)),
        version=rng.choice(("1.0", "2.6")),
    )
    return out.getvalue()


STATEMENTS = (
    "drop table TABLE",
    "create view other as select * from TABLE",
    "alter table TABLE rename to hidden; create view TABLE as select * from hidden",
    "alter table TABLE rename to hidden; create view TABLE as with recursive c(x) as "
    "(select 1 union all select x + 1 from c) select * from c",
    "create trigger eager after insert on TABLE begin delete from TABLE; end",
    "create trigger eager before update on TABLE begin select raise(abort, '\x1b[31m'); end",
    "alter table TABLE add column made as (1 / 0)",
    "alter table TABLE add column other text default '\x1b[31m'",
    "create virtual table other using fts5(a)",
    "create virtual table other using rtree(a, b, c)",
    "create index other on TABLE (COLUMN)",
    "create unique index other on TABLE (COLUMN) where 0",
    "update TABLE set COLUMN = 'x'",
    "update TABLE set COLUMN = null",
    "update TABLE set COLUMN = 9e999",
    "update TABLE set COLUMN = -9223372036854775808",
    "update TABLE set COLUMN = x'00ff1b5b'",
    "update TABLE set COLUMN = cast(x'ff00fe' as text)",
    "update TABLE set COLUMN = zeroblob(50000000) where rowid = 1",
    "update TABLE set COLUMN = replace(hex(zeroblob(5000000)), '0', 'x')",
    "update TABLE set COLUMN = COLUMN || COLUMN",
    "update TABLE set COLUMN = '[' || COLUMN",
    "update TABLE set COLUMN = -COLUMN",
    "update TABLE set rowid = rowid + 9000000000000000000",
    "delete from TABLE",
    "delete from TABLE where rowid % 2",
    "insert into TABLE select * from TABLE",
    "pragma journal_mode = wal",
    "pragma user_version = -1",
    "pragma application_id = 1",
    "pragma writable_schema = 1; update sqlite_master set sql = 'create table x (x)' where name = 'TABLE'",
    "pragma writable_schema = 1; update sqlite_master set sql = 'nonsense' where name = 'TABLE'",
    "pragma writable_schema = 1; update sqlite_master set rootpage = 1",
    "pragma writable_schema = 1; update sqlite_master set rootpage = 99999 where name = 'TABLE'",
    "pragma encoding = 'UTF-16'; vacuum",
    "pragma page_size = 65536; pragma journal_mode = delete; vacuum",
    "pragma auto_vacuum = 1; vacuum",
)


def database(data: bytes, rng: Random) -> bytes:
    """Statements that a stranger ran on it: views, triggers, other types, another layout."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a"
        path.write_bytes(data)
        with suppress(sqlite3.Error), closing(sqlite3.connect(path)) as opened:
            tables = [
                name for (name,) in opened.execute("select name from sqlite_master where type = 'table'")
            ]
            for _ in range(rng.choice((1, 1, 3))):
                table = rng.choice(tables)
                names = [row[1] for row in opened.execute(f"pragma table_info('{table}')")]
                script = rng.choice(STATEMENTS).replace("TABLE", table).replace("COLUMN", rng.choice(names))
                with suppress(sqlite3.Error):
                    opened.executescript(script)
        return path.read_bytes()


def matlab(data: bytes, rng: Random) -> bytes:
    """A variable of another class or shape, missing or under another name, at another level."""
    from scipy.io import loadmat, savemat
    from scipy.sparse import csc_matrix

    source: Any = io.BytesIO(data)
    found = {name: value for name, value in loadmat(source).items() if not name.startswith("__")}
    name, how = rng.choice(sorted(found)), rng.randrange(7)
    value = found[name]
    if how == 0:
        del found[name]
    elif how == 1:
        cells = np.empty((1, 2), dtype=object)
        cells[0, :] = value, "x"
        found[name] = rng.choice((cells, {"a": value}, "text", ["a", "b"], True, {"a": {"b": {"c": value}}}))
    elif how == 2 and value.ndim == 2 and value.dtype.kind == "f":
        found[name] = csc_matrix(value)
    elif how == 3:
        found["x" * 31] = found.pop(name)
    else:
        odd = array(value, rng)
        found[name] = odd if odd.dtype.kind in "biufcUS" else value
    out: Any = io.BytesIO()
    with suppress(ValueError, TypeError, OverflowError):
        savemat(out, found or {"a": 1}, format=rng.choice(("4", "5", "5")), do_compression=rng.random() < 0.5)
    written = out.getvalue() or data
    if rng.random() < 0.1:
        written = written[:124] + rng.choice((b"\0\2IM", b"\1\0MI", b"\0\1XX")) + written[128:]
    return written


BAG_WORDS = (
    (b"bz2", b"lz4"),
    (b"bz2", b"xyz"),
    (b"none", b"lz4\0"),
    (b"zstd", b"lz4x"),
    (b"zstd", b"\x1b[1m"),
    (b"float32[] ranges", b"float32[9] ranges"),
    (b"float32[] ranges", b"LaserScan[] range"),
    (b"float32[] ranges", b"string[]  ranges "),
    (b"float32", b"float64"),
    (b"float64", b"float65"),
    (b"sensor_msgs", b"sensor-msgs"),
    (b"LaserScan", b"laserscan"),
    (b"nav_msgs/Odometry", b"nav_msgs/OdometrY"),
    (b"nav_msgs", b"\x1b[31mx\xff"),
    (b"ros2msg", b"ros2idl"),
    (b"cdr", b"cbr"),
    (b"cdr", b"pl\xff"),
    (b"std_msgs/Header", b"nav_msgs/Odometr"),
    (b"MSG: ", b"MSG:\n"),
    (b"topic=", b"tapic="),
    (b"/scan", b"/\x1b[1m"),
    (b"/scan", b"/odom"),
    (b"size=", b"syze="),
    (b"zstd", b"none"),
    (b"MESSAGE", b"STORAGE"),
    (b"md5sum=", b"md5sum\0"),
)


def bag(data: bytes, rng: Random) -> bytes:
    """Words that its reader looks for are others of the same length."""
    there = [(old, new) for old, new in BAG_WORDS if old in data]
    if not there:
        return fields(data, rng)
    old, new = rng.choice(there)
    return data.replace(old, new, rng.choice((-1, 1)))


def json_tree(data: bytes, rng: Random) -> bytes:
    """The same values as other writers put them: all numbers texts, keys twice, lists far longer or empty."""
    tree = json.loads(data)
    how = rng.randrange(7)

    def change(value: Any) -> Any:
        if isinstance(value, dict):
            return {name + ("\n" if how == 0 else ""): change(inner) for name, inner in value.items()}
        if isinstance(value, list):
            inner = [change(item) for item in value]
            return {1: [], 2: inner * 40, 3: inner[::-1], 4: dict(enumerate(inner))}.get(how, inner)
        if how == 5 and isinstance(value, int | float):
            return str(value)
        return None if how == 6 and rng.random() < 0.3 else value

    return json.dumps(change(tree)).encode()


_FORMS: tuple[tuple[bytes, tuple[Change, ...]], ...] = (
    (b"\x93NUMPY", (npy, npy, fields)),
    (b"PK\3\4", (npz, npz, npz, fields)),
    (b"\x89PNG", (image, image, image, fields)),
    (b"P5", (image, image, fields)),
    (b"PAR1", (parquet, parquet, parquet, fields)),
    (b"SQLite format 3", (database, database, database, fields, bag)),
    (b"MATLAB 5.0", (matlab, matlab, fields)),
    (b"\x89MCAP0", (bag, bag, fields)),
    (b"#ROSBAG", (bag, bag, fields)),
    (b"RIFF", (fields,)),
    (b"{", (json_tree, *TEXT)),
)


def formed(data: bytes, rng: Random) -> bytes:
    """Damage what knows the form can do; what is damaged beyond its form already is damaged as bytes."""
    changes = next((changes for magic, changes in _FORMS if data.startswith(magic)), None)
    if changes is None:
        changes = TEXT if b"\0" not in data[:1000] else (fields,)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return rng.choice(changes)(data, rng)
    except Exception:  # an earlier damage took its form
        return fields(data, rng)
