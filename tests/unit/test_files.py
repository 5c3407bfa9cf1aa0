"""The door for files from outside: what is no file, too much, too deep or damaged is one line."""

from __future__ import annotations

import gzip
import io
import json
import os
import struct
import tempfile
import zipfile
import zlib
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image
from scipy.io import savemat

from pilotage.core import limits
from pilotage.core.errors import InputError
from pilotage.core.files import read_bytes, read_json, read_json_lines, read_text, read_yaml, require_file
from pilotage.core.files.arrays import map_npy, read_npy, read_npz, require_numbers
from pilotage.core.files.images import opened_image
from pilotage.core.files.parquet import arrow_table, read_parquet
from pilotage.core.json_text import load_json
from pilotage.core.shown import LONGEST_TEXT, shown, visible
from pilotage.core.yaml_text import load_yaml
from pilotage.logs.mat import load_mat

READERS = (read_bytes, read_text, read_yaml, read_json, require_file, map_npy, read_npz, read_parquet)


def chunk(kind: bytes, body: bytes) -> bytes:
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))


def png(columns: int, rows: int, packed: bytes) -> bytes:
    head = struct.pack(">IIBBBBB", columns, rows, 8, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", packed) + chunk(b"IEND", b"")


def npy(shape: str) -> bytes:
    head = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}\n".encode()
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(head)) + head


def bomb(levels: int = 9) -> str:
    """A list of ten in a list of ten and so on, by aliases: small as text, endless written out."""
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]" for i in range(1, levels)]
    return "\n".join(lines)


def test_what_is_no_regular_file_is_told_without_reading(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    for path, kind in (
        (tmp_path / "pipe", "a named pipe"),
        (tmp_path, "a folder"),
        (Path("/dev/zero"), "a device"),
    ):
        for read in (
            read_bytes,
            read_text,
            read_yaml,
            read_json,
            require_file,
            map_npy,
            read_npz,
            read_parquet,
        ):
            with pytest.raises(InputError, match=f"expected .*, found {kind}"):
                read(path)
    for name in ("none", "a\0b", "\ud800", "x" * 5000):
        with pytest.raises(InputError, match="expected a map, found") as caught:
            read_bytes(tmp_path / name, "a map")
        assert len(str(caught.value)) < 400


def test_size_is_looked_at_before_reading_and_a_setting_raises_the_limit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "long"
    with path.open("wb") as file:
        file.truncate(3_000_000_000)
    with pytest.raises(InputError, match=r"at most 512 MB, found 3,000 MB.*PILOTAGE_LIMITS"):
        read_bytes(path)
    path.write_bytes(b"abcdef")
    with pytest.raises(InputError, match="PILOTAGE_LIMITS"):
        read_text(path, most=4)
    monkeypatch.setenv(limits.VARIABLE, "2")
    assert read_text(path, most=4) == "abcdef"
    for wrong in ("0", "x", "nan", "1e9"):
        monkeypatch.setenv(limits.VARIABLE, wrong)
        with pytest.raises(InputError, match="PILOTAGE_LIMITS: expected a number from 1 to 1000"):
            read_text(path, most=4)


def test_gzip_is_unpacked_up_to_the_limit(tmp_path: Path) -> None:
    path = tmp_path / "log.gz"
    path.write_bytes(gzip.compress(b"a\n") + gzip.compress(b"b\n") + bytes(100))
    assert read_text(path) == "a\nb\n"
    path.write_bytes(gzip.compress(bytes(5_000_000)))
    with pytest.raises(InputError, match=r"unpacked\): expected at most 1 MB, found more"):
        read_text(path, most=1_000_000)
    path.write_bytes(gzip.compress(b"a\nb\n" * 1000)[:-9])
    with pytest.raises(InputError, match=r"line \d+: the compressed file is cut short"):
        read_text(path)
    path.write_bytes(gzip.compress(b"") * 20_000)
    with pytest.raises(InputError, match="damaged"):
        read_text(path)


def test_text_is_utf8_without_zeros(tmp_path: Path) -> None:
    path = tmp_path / "text"
    for content, message in ((b"a\n\xff", "line 2: .* not UTF-8"), (b"a\nb\n\0", "line 3: .* zero bytes")):
        path.write_bytes(content)
        with pytest.raises(InputError, match=message):
            read_text(path)
    path.write_bytes(b"\xef\xbb\xbfa")
    assert read_text(path) == "a"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (bomb(), "at most 1,000,000 values"),
        ("[" * 100_000, "at most 64 deep"),
        ("{a: " * 1000, "at most 64 deep"),
        ("- " * 1000, "at most 64 deep"),
        ("a: &a [" + "[" * 40 + "]" * 41 + "\nb: " + "[" * 40 + "*a" + "]" * 40, "line 2: .*at most 64 deep"),
        ("a: &a [*a]", "'a' inside itself"),
        ("a: *b", "the alias 'b' of nothing"),
        ("a: 1\na: 2", "line 2: .*the key 'a' twice"),
        ("a: 0x" + "F" * 5000, "a number of 5002 characters"),
        ("a: 1" + "0" * 5000, "a number of 5001 characters"),
        ("a: 2001-99-99", "month must be"),
        ("a: 0001-01-01T00:00:00+23:59\n---\nb", "a second document"),
        ("!!int ''", "a tag that its value does not fit"),
        ("!!set {a, b}", "the tag '!!set', which has no meaning here"),
        ("!!python/object:os.system x", "the tag '!!python/object:os.system', which"),
        ("a: \x1b[31m", "control characters are not allowed"),
        ("{[1, 2]: 3}", "unhashable key"),
        ("a: 1\n\tb: 2\n", "line 2: expected YAML, found: a tab where YAML takes spaces"),
    ],
)
def test_yaml_that_hangs_or_swells_is_refused(text: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        load_yaml(text, "file")


def test_yaml_counts_in_tens() -> None:
    """In YAML 1.1 these were 5400 and 11420.5."""
    assert load_yaml("[1:30:00, 3:10:20.5, 12]", "") == ["1:30:00", "3:10:20.5", 12]


def test_yaml_takes_on_and_no_for_words() -> None:
    """A parameter ``on`` was refused as an unknown key 'true', a text ``off`` as no text."""
    text = "{on: no, null: y, ~: ~, 2026-11-28: off, true: TRUE, 7: !!bool yes}"
    values: dict[object, object] = {"on": "no", "null": "y", "~": None, "2026-11-28": "off", "true": True}
    assert load_yaml(text, "") == {**values, 7: True}
    with pytest.raises(InputError, match="the key 'on' twice"):
        load_yaml("{on: 1, 'on': 2}", "file")


def test_yaml_says_what_it_said() -> None:
    text = "a: &a {x: 1, y: [1.5, ~, true]}\nb: {<<: *a, x: 2}\nc: *a\n? d\n: |\n  long\n  text\n"
    y = [1.5, None, True]
    assert load_yaml(text, "file") == {
        "a": {"x": 1, "y": y},
        "b": {"x": 2, "y": y},
        "c": {"x": 1, "y": y},
        "d": "long\ntext\n",
    }
    assert load_yaml("", "file") is None


WORDS = st.text(st.characters(exclude_categories=("C", "Z")))


@given(st.recursive(st.none() | st.booleans() | st.integers() | WORDS, st.lists, max_leaves=20))
def test_yaml_and_json_read_what_is_written(value: object) -> None:
    text = json.dumps(value, ensure_ascii=False)
    assert load_json(text, "file") == value
    assert load_yaml(text, "file") == value


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[" * 100_000, "at most 64 deep"),
        ("[" * 70 + "]" * 70, "at most 64 deep"),
        ('{"a": 1e999}', "beyond all doubles"),
        ("[NaN]", "NaN, which is no finite number"),
        ("1" * 5000, "a number of 5000 digits"),
        ('{"a":\n [1,2}', "line 2: expected JSON"),
        ("", "expected JSON"),
    ],
)
def test_json_that_breaks_its_readers_is_refused(text: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "file").write_text(text)
    with pytest.raises(InputError, match=message):
        read_json(tmp_path / "file")


def test_json_holds_whole_characters_and_lines_hold_objects(tmp_path: Path) -> None:
    assert load_json('{"\\ud800": ["\\ud83d\\ude00"]}', "file") == {"�": ["😀"]}
    path = tmp_path / "lines"
    path.write_text('{"a": 1}\n\n{"a": 2}\n')
    assert read_json_lines(path) == [{"a": 1}, {"a": 2}]
    path.write_text('{"a": 1}\n[1]\n')
    with pytest.raises(InputError, match="line 2: expected a JSON object, found list"):
        read_json_lines(path)


def test_arrays_take_no_more_than_their_files_hold(tmp_path: Path) -> None:
    path = tmp_path / "a.npy"
    np.save(path, np.arange(6.0).reshape(2, 3, order="F"))
    np.testing.assert_array_equal(map_npy(path), np.arange(6.0).reshape(2, 3, order="F"))
    for shape in ("(10000000000000,)", "(-1,)", "(1,) * 9", "(2.5,)", "(3", "[3]", "(" * 3000):
        path.write_bytes(npy(shape))
        with pytest.raises(InputError):
            map_npy(path)
    np.save(path, np.array([{}]), allow_pickle=True)
    with pytest.raises(InputError, match="expected an array of numbers or text, found objects"):
        map_npy(path)
    archive = tmp_path / "a.npz"
    np.savez_compressed(archive, a=np.eye(3, order="F"), t=np.array(["x"]))
    found = read_npz(archive)
    np.testing.assert_array_equal(found["a"], np.eye(3))
    assert found["t"].tolist() == ["x"]
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("a.npy", npy("(10000000000000,)"))
    with pytest.raises(InputError, match="a: expected float64 of shape"):
        read_npz(archive)
    packed = zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED, compresslevel=1)
    with packed as file, file.open("a.npy", "w") as member:
        for _ in range(600):
            member.write(bytes(1_000_000))
    with pytest.raises(InputError, match=r"unpacked\): expected at most 512 MB, found 600 MB"):
        read_npz(archive)
    for values, message in ((np.array([1.0, np.nan]), "found nan"), (np.array([1, -9]), "found -9")):
        with pytest.raises(InputError, match=message):
            require_numbers(values, 5.0, "x")


def test_an_archive_is_packed_as_numpy_packs(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_LZMA) as archive:
        archive.writestr("a.npy", bytes(100))
    with pytest.raises(InputError, match=r"a\.npy: expected it packed as NumPy does"):
        read_npz(path)


def test_lines_beyond_a_limit_are_not_read(tmp_path: Path) -> None:
    path = tmp_path / "a.jsonl"
    path.write_text('{"a": 1}\n' * 3)
    assert len(read_json_lines(path, most=3)) == 3
    with pytest.raises(InputError, match="at most 2 lines, found more"):
        read_json_lines(path, most=2)


def test_an_array_outlives_its_file(tmp_path: Path) -> None:
    """A map into a file that is cut short meanwhile would end the process."""
    np.save(tmp_path / "a.npy", np.arange(20_000.0))
    values = read_npy(tmp_path / "a.npy")
    os.truncate(tmp_path / "a.npy", 200)
    assert values.sum() == 20_000 * 19_999 / 2
    with pytest.raises(InputError, match="cut short"):
        read_npy(tmp_path / "a.npy")


def test_a_nan_that_signals_is_one_as_all(tmp_path: Path) -> None:
    """Bytes of something else may be one, and working with it warns, which is an error here."""
    odd = np.arange(6, dtype=np.float32)
    odd.view(np.uint32)[2] = 0x7FA00000
    np.save(tmp_path / "a.npy", odd)
    np.savez(tmp_path / "a.npz", odd=odd)
    pq.write_table(pa.table({"odd": odd}), tmp_path / "a.parquet")
    found = [read_npy(tmp_path / "a.npy"), read_npz(tmp_path / "a.npz")["odd"]]
    found.append(read_parquet(tmp_path / "a.parquet")["odd"])
    for level in ("4", "5"):
        savemat(tmp_path / "a.mat", {"odd": odd}, format=level)
        found.append(load_mat(tmp_path / "a.mat", ["odd"])["odd"].ravel())
    for values in found:
        assert np.isnan(np.diff(values.astype(np.float64))).tolist() == [False, True, True, False, False]


def test_a_library_in_c_says_nothing_of_a_damaged_picture(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """libtiff tells by itself of tags that it does not like."""
    path = tmp_path / "a.tif"
    Image.fromarray(np.zeros((9, 9), np.uint8)).save(path, compression="tiff_lzw")
    whole = path.read_bytes()
    said = set()
    for at in range(8, len(whole)):
        path.write_bytes(whole[:at] + b"\xff" + whole[at + 1 :])
        try:
            with opened_image(path) as image:
                image.load()
        except InputError as error:
            said.add(str(error))
    assert len(said) > 1
    assert capfd.readouterr().err == ""


def test_images_are_measured_by_their_header(tmp_path: Path) -> None:
    path = tmp_path / "a.png"
    for content, message in (
        (png(2**31 - 1, 1, b""), "expected at most 512 MB, found 2,147 MB"),
        (png(2**28, 1, zlib.compress(b"\0")), "cannot be read"),
        (png(4, 4, zlib.compress(b"\0")), "cannot be read"),
        (b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 10 10\n", "another format"),
    ):
        path.write_bytes(content)
        with pytest.raises(InputError, match=message), opened_image(path) as image:
            image.load()


def test_parquet_counts_what_its_pages_unpack_to(tmp_path: Path) -> None:
    path = tmp_path / "a.parquet"
    pq.write_table(pa.table({"x": [1.0, None], "word": ["a", None], "yes": [True, False]}), path)
    found = read_parquet(path)
    assert np.isnan(found["x"][1])
    assert found["word"].tolist() == ["a", None]
    assert list(read_parquet(path, ["yes"])) == ["yes"]
    with pytest.raises(InputError, match="missing: z"):
        read_parquet(path, ["x", "z"])
    word = pa.DictionaryArray.from_arrays(np.zeros(100_000, np.int32), ["x" * 100_000])
    pq.write_table(pa.table({"word": word}), path)
    assert len({id(text) for text in read_parquet(path)["word"]}) == 1
    pq.write_table(pa.table({"x": np.zeros(70_000_000, np.int64)}), path)
    with pytest.raises(InputError, match=r"70000000 rows, unpacked\): expected at most 512 MB"):
        read_parquet(path)
    pq.write_table(pa.table({"x": [[1]]}), path)
    with pytest.raises(InputError, match="expected numbers or text, found list"):
        read_parquet(path)
    path.write_bytes(b"PAR1 and more")
    with pytest.raises(InputError, match="expected a Parquet file"):
        read_parquet(path)


@given(
    st.sampled_from(["f8", "f4", "f2", "i8", "i4", "u2", ">f8", "?"]), st.integers(0, 7), st.integers(1, 3)
)
def test_a_column_is_read_as_it_was_written(kind: str, rows: int, group: int) -> None:
    """Of whatever type, in whatever pieces; what lies otherwise in memory than Arrow has it as well."""
    values = (np.arange(2 * rows) % 5).astype(kind)[::2]
    file = io.BytesIO()
    table = arrow_table({"a": values, "b": values[::-1]}, {"told": "so"})
    assert table.schema.metadata == {b"told": b"so"}
    assert table.column("a").to_pylist() == values.tolist()
    pq.write_table(table, file, row_group_size=group)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.parquet"
        path.write_bytes(file.getvalue())
        found = read_parquet(path)
    for name, wanted in (("a", values), ("b", values[::-1])):
        assert found[name].dtype == values.dtype.newbyteorder("=")
        assert found[name].tolist() == wanted.tolist()
        assert found[name].flags.writeable or kind == "?"


@given(st.text(max_size=300), st.integers(10, 50))
def test_what_is_shown_is_one_bounded_line_without_controls(text: str, most: int) -> None:
    line = shown(text, most)
    assert line.isprintable()
    assert len(line) <= most
    assert visible("a\nb\x1b", keep="\n") == "a\nb\\x1b"


def test_the_end_of_a_long_line_is_kept() -> None:
    """It says what is wrong, behind what was typed."""
    for typed in ("0, " * 900, "0, " * 40_000):
        line = shown(f"--set 'a=[{typed}]': expected a number, found a list")
        assert line.startswith("--set 'a=[0, 0,")
        assert line.endswith("expected a number, found a list")
        assert len(line) <= LONGEST_TEXT
