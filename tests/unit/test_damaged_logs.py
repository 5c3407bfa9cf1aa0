"""Logs cut at any byte, damaged, or in odd forms: read rightly, or one line that names file and line."""

from __future__ import annotations

import gzip
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import loadmat, savemat

from pilotage.cli.main import main
from pilotage.core.errors import InputError
from pilotage.logs.aer1513 import read_aer1513
from pilotage.logs.carmen import read_carmen
from pilotage.logs.heading_csv import read_heading_log
from pilotage.logs.laser_recordings import read_laser_log
from pilotage.logs.mat import load_mat
from pilotage.logs.mrclam import read_mrclam
from pilotage.logs.odometry_csv import COLUMNS, read_odometry_csv
from pilotage.logs.reckoning_mat import read_reckoning_mat
from pilotage.logs.steady_csv import read_steady_csv
from pilotage.logs.trajectories import read_kitti, read_tum
from support import damage
from support.laser_drives import laser_drive
from support.mrclam_drives import Events, Robot, write_mrclam

Capture = pytest.CaptureFixture[str]
Reader = Callable[[Path], object]
RNG = np.random.default_rng(7)


def rows(*columns: Callable[[int], float], separator: str = " ", count: int = 12) -> str:
    """Fixed-point numbers, as loggers write them."""
    return "".join(separator.join(f"{c(i):.6f}" for c in columns) + "\n" for i in range(count))


TEXTS: dict[str, tuple[Reader, str]] = {
    "odometry.csv": (
        read_odometry_csv,
        ",".join(COLUMNS)
        + "\n"
        + rows(*[lambda i: 0.1 * i] * 2, *[lambda i: 0.0 * i] * 2, *[lambda i: 0.1 * i] * 3, separator=","),
    ),
    "gyro.csv": (read_heading_log, "t,x,y,z\n" + rows(*[lambda i: 0.01 * i] * 4, separator=",")),
    "steady.csv": (read_steady_csv, "t_s,range_m\n" + rows(*[lambda i: 1.0 + 0.01 * i] * 2, separator=",")),
    "tum.txt": (read_tum, "# t x y z q\n" + rows(*[lambda i: 0.1 * i] * 7, lambda i: 1.0 + 0 * i, count=6)),
    "kitti.txt": (read_kitti, "".join(f"1 0 0 {i}.5 0 1 0 2.5 0 0 1 3.25\n" for i in range(6))),
    "carmen.log": (
        read_carmen,
        "".join(f"FLASER 3 1.0 2.0 3.0 0.1 0.2 0.3 1.1 1.2 1.3 {i}.5 host {i}.5\n" for i in range(4)),
    ),
}


def judged(reader: Reader, path: Path) -> object | None:
    """What was read, or None where it was refused as it should be."""
    try:
        return reader(path)
    except InputError as error:
        said = str(error)
        assert "\n" not in said
        assert str(path.parent) in said
        assert " line " in said or path.suffix == ".mat"
        return None


@pytest.mark.parametrize("name", TEXTS)
def test_a_text_cut_at_any_byte(tmp_path: Path, name: str) -> None:
    """What is read of a cut file are whole lines of the whole file: never a number that lost its digits."""
    reader, text = TEXTS[name]
    path = tmp_path / name
    path.write_text(text)
    assert judged(reader, path) is not None
    ends = {i for i, letter in enumerate(text) if letter == "\n"}
    for cut in range(len(text)):
        damage.put(path, text[:cut].encode())
        if judged(reader, path) is not None and name != "carmen.log":
            whole = cut in ends or cut - 1 in ends
            assert whole or text[:cut].count("\n") < 5, f"half a number was read, cut at byte {cut}"


@pytest.mark.parametrize("name", [name for name in TEXTS if name != "gyro.csv"])
def test_a_compressed_text_cut_at_any_byte(tmp_path: Path, name: str) -> None:
    reader, text = TEXTS[name]
    path = tmp_path / name
    packed = gzip.compress(text.encode(), mtime=0)
    for cut in range(0, len(packed), 3):
        damage.put(path, packed[:cut])
        # A recording of scans is of use without its end: see below.
        assert judged(reader, path) is None or name == "carmen.log"
    path.write_bytes(packed)
    assert judged(reader, path) is not None


def test_a_gzipped_recording_cut_in_half_is_read_up_to_the_cut(tmp_path: Path) -> None:
    """Every whole line before the cut, as of the plain file, and a word; damage within it is refused."""
    drawn = RNG.uniform(0.5, 9.5, (400, 30))
    lines = [
        f"FLASER 30 {' '.join(f'{r:.4f}' for r in row)} 0 0 0 0 0 0 {i}.5 host {i}.5\n"
        for i, row in enumerate(drawn)
    ]
    packed, path = gzip.compress("".join(lines).encode(), mtime=0), tmp_path / "carmen.log.gz"
    for cut in (len(packed) // 2, len(packed) - 1):
        damage.put(path, packed[:cut])
        log = read_laser_log(path)
        assert len(log) > 0.9 * 400 * cut / len(packed)
        np.testing.assert_allclose(log.ranges_m, drawn[: len(log)], atol=1e-4)
        assert any("cut short" in said for said in log.warnings)
    path.write_bytes(packed[: len(packed) // 2] + b"\xff" * 40 + packed[len(packed) // 2 + 40 :])
    with pytest.raises(InputError, match=r"line \d+: the compressed file is cut short or damaged"):
        read_laser_log(path)
    path.write_bytes(packed[:12])
    with pytest.raises(InputError, match="expected FLASER or ROBOTLASER1 lines, found the end"):
        read_laser_log(path)


@pytest.mark.parametrize("name", TEXTS)
def test_texts_in_odd_forms_are_the_same(tmp_path: Path, name: str) -> None:
    reader, text = TEXTS[name]
    path = tmp_path / name
    header, _, body = text.partition("\n")
    forms = {
        "CRLF": text.replace("\n", "\r\n"),
        "byte order mark": "\ufeff" + text,
        "a comment first": "# a comment\n" + text,
        "empty lines": text.replace("\n", "\n\n"),
        "no last line end": text[:-1],
        "spaces": text.replace(",", " , ") if "," in text else text.replace(" ", "  "),
        "tabs": text if "," in text else text.replace(" ", "\t"),
        "quoted header": '"' + header.replace(",", '","') + '"\n' + body if "," in text else text,
    }
    for form, changed in forms.items():
        path.write_text(changed, newline="")
        assert judged(reader, path) is not None, form


@pytest.mark.parametrize("name", TEXTS)
def test_what_is_no_log_is_refused(tmp_path: Path, name: str) -> None:
    reader, text = TEXTS[name]
    path = tmp_path / name
    lines = text.splitlines(keepends=True)
    middle = lines[-1] if name == "carmen.log" else lines[4]
    separator = "," if "," in text else " "
    words = middle.split(separator)
    words[2 if name == "carmen.log" else 1] = "1e300"
    huge = separator.join(words) if len(words) > 2 else separator.join(words) + "\n"
    wrong = {
        "empty": b"",
        "only comments": b"# nothing\n# more\n",
        "binary": RNG.bytes(400),
        "zeros": bytes(100),
        "UTF-16": text.encode("utf-16"),
        "not a number": text.replace(middle, middle.replace("0", "nan", 1)).encode(),
        "infinite": text.replace(middle, middle.replace(middle.split()[-1].split(",")[-1], "inf")).encode(),
        "huge": text.replace(middle, huge).encode(),
    }
    if name == "carmen.log":
        wrong.pop("infinite")  # the last word of its lines is the logger's own time
    for what, data in wrong.items():
        path.write_bytes(data)
        assert judged(reader, path) is None, what
    path.unlink()
    with pytest.raises(InputError, match="expected a readable file"):
        reader(path)
    path.mkdir()
    with pytest.raises(InputError, match="expected a readable file"):
        reader(path)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A MRCLAM recording of ten seconds."""
    place = tmp_path_factory.mktemp("mrclam") / "set"
    return write_mrclam(place, [(1, 3, Robot(), Events(duration_s=10.0))])


FILES = ("Barcodes", "Landmark_Groundtruth", "Robot1_Odometry", "Robot1_Measurement", "Robot1_Groundtruth")


@pytest.mark.parametrize("name", FILES)
def test_a_mrclam_file_cut_at_any_byte(tmp_path: Path, folder: Path, name: str) -> None:
    shutil.copytree(folder, tmp_path / "cut")
    path = tmp_path / "cut" / f"{name}.dat"
    data = path.read_bytes()
    head = data.index(b"\n") + 1
    # All of the first lines, and of the rest a byte in 19: every column of some line.
    for cut in [*range(head + 120), *range(head + 120, len(data), 19)]:
        damage.put(path, data[:cut])
        read = judged(lambda _: read_mrclam(tmp_path / "cut", 1), path)
        if read is not None:
            assert cut > head
            assert name == "Barcodes" or data[cut - 1 : cut + 1].count(b"\n") or data[:cut].count(b"\n") < 5


def put(row: int, column: int, word: str) -> Callable[[list[str]], list[str]]:
    """Put a word into a line, counted from 1."""

    def change(lines: list[str]) -> list[str]:
        words = lines[row - 1].split("\t")
        words[column] = word
        return [*lines[: row - 1], "\t".join(words), *lines[row:]]

    return change


MRCLAM_WRONG: dict[str, tuple[str, Callable[[list[str]], list[str]], str]] = {
    "a subject without a place": ("Landmark_Groundtruth", lambda lines: lines[:3], "Measurement.dat line"),
    "an unknown barcode": (
        "Robot1_Measurement",
        put(3, 1, "98"),
        "line 3: expected a barcode of Barcodes.dat",
    ),
    "half a barcode": ("Robot1_Measurement", put(3, 1, "2.5"), "line 3: barcode: expected a whole number"),
    "a negative range": ("Robot1_Measurement", put(3, 2, "-1"), "line 3: range_m: expected a range >= 0"),
    "one row": ("Robot1_Odometry", lambda lines: lines[:2], "line 2: expected 2 or more rows"),
    "an absurd speed": (
        "Robot1_Odometry",
        put(6, 1, "1e300"),
        "line 6: v_m_s: expected a number within 1e+06",
    ),
    "not a number": ("Robot1_Groundtruth", put(6, 3, "nan"), "line 6: theta_rad: expected a finite number"),
    "a word": ("Robot1_Groundtruth", put(6, 3, "1_0"), "line 6: theta_rad: expected a number, found '1_0'"),
    "a time twice": (
        "Robot1_Groundtruth",
        lambda lines: [*lines[:5], lines[4], *lines[5:]],
        "line 6: expected a time after",
    ),
    "times backward": (
        "Robot1_Odometry",
        lambda lines: [lines[0], *lines[:0:-1]],
        "line 3: expected a time after",
    ),
    "a missing column": ("Robot1_Measurement", put(5, 3, ""), "line 5: expected 4 columns"),
}


@pytest.mark.parametrize("what", MRCLAM_WRONG)
def test_localize_and_calibrate_name_what_is_wrong(
    tmp_path: Path, folder: Path, capsys: Capture, what: str
) -> None:
    name, spoil, said = MRCLAM_WRONG[what]
    place = tmp_path / "spoilt"
    shutil.copytree(folder, place)
    lines = (place / f"{name}.dat").read_text().splitlines()
    (place / f"{name}.dat").write_text("\n".join(spoil(lines)) + "\n")
    for command in (["localize"], ["calibrate", "commands"]):
        words = [*command, str(place), "--format", "mrclam", "--robot", "1", "--out", str(tmp_path / "runs")]
        assert main(words) == 2
        captured = capsys.readouterr()
        assert captured.out == ""
        assert captured.err.count("\n") == 1
        assert said in captured.err
    assert not (tmp_path / "runs").exists()


MAT: dict[str, tuple[Reader, Callable[[], dict[str, Any]]]] = {
    "aer1513": (read_aer1513, lambda: laser_drive(0, 12)),
    "reckoning": (
        read_reckoning_mat,
        lambda: {
            "GT": np.column_stack([np.arange(12.0), np.zeros((12, 3))]),
            "DR": np.column_stack([np.arange(12.0) + 0.5, np.zeros((12, 2))]),
        },
    ),
}


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize("name", MAT)
def test_a_matlab_file_cut_or_damaged_anywhere(tmp_path: Path, name: str, packed: bool) -> None:
    """A damaged byte may lie in a number and stay unseen; it never ends in more than one line."""
    reader, arrays = MAT[name]
    path = tmp_path / "log.mat"
    savemat(path, arrays(), do_compression=packed)
    data = path.read_bytes()
    assert judged(reader, path) is not None
    for cut in range(0, len(data), 7):
        damage.put(path, data[:cut])
        assert judged(reader, path) is None
    rng = np.random.default_rng(1)
    for _ in range(200):
        damaged = bytearray(data)
        for at in rng.integers(0, len(data), 3):
            damaged[at] = rng.integers(256)
        damage.put(path, bytes(damaged))
        judged(reader, path)


def test_matlab_arrays_are_those_that_scipy_reads(tmp_path: Path) -> None:
    arrays = {
        "short": np.arange(5, dtype=np.int16),
        "table": np.arange(6, dtype=np.uint8).reshape(2, 3),
        "complex": np.array([1.0 + 2.0j, 3.0]),
        "empty": np.zeros((0, 3)),
        "deep": np.arange(24.0).reshape(2, 3, 4),
        "single": np.float32(3.5),
        "flags": np.array([True, False]),
        "a_name_that_fills_more_than_one_tag": 1.0,
    }
    for packed in (False, True):
        savemat(tmp_path / "a.mat", arrays, do_compression=packed)
        ours, theirs = load_mat(tmp_path / "a.mat", list(arrays)), loadmat(tmp_path / "a.mat")
        assert ours.keys() == arrays.keys()
        for name in arrays:
            np.testing.assert_array_equal(ours[name], theirs[name])
    savemat(tmp_path / "4.mat", {"t": np.arange(5.0)}, format="4")
    np.testing.assert_array_equal(load_mat(tmp_path / "4.mat", ["t"])["t"].ravel(), np.arange(5.0))


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"l": None}, "missing: l"),
        ({"t": "text"}, "t: expected numbers"),
        ({"r": np.array([1, "a"], dtype=object)}, "r: expected numbers"),
        ({"v": {"a": 1.0}}, "v: expected numbers"),
        ({"v": np.ones(12) * 1j}, "v: expected numbers"),
        ({"r": np.zeros((17, 12))}, "r: expected shape"),
        ({"l": np.zeros((0, 2))}, "l: expected (L, 2) landmarks"),
        ({"t": np.zeros((3, 2, 2))}, "t: expected a column"),
        ({"d": np.nan}, "d row 1: expected a finite number"),
        ({"x_true": np.full(12, 1e300)}, "x_true row 1: expected a finite number within"),
    ],
)
def test_arrays_that_are_no_recording(
    tmp_path: Path, capsys: Capture, changes: dict[str, Any], said: str
) -> None:
    arrays = {k: v for k, v in (laser_drive(0, 12) | changes).items() if v is not None}
    savemat(tmp_path / "a.mat", arrays)
    assert main(["localize", str(tmp_path / "a.mat"), "--format", "aer1513", "--out", str(tmp_path)]) == 2
    captured = capsys.readouterr()
    assert captured.err.count("\n") == 1
    assert str(tmp_path / "a.mat") in captured.err
    assert said in captured.err


def test_a_file_of_matlab_7_3_says_how_to_save_it(tmp_path: Path) -> None:
    path = tmp_path / "a.mat"
    path.write_bytes(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM" + bytes(384) + b"\x89HDF\r\n\x1a\n")
    with pytest.raises(InputError, match="save it with -v7"):
        read_aer1513(path)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("stack: 3\n", "expected parameters of stack.localizer"),
        ("stack:\n  localizer:\n", "stack.localizer: expected a mapping"),
        ("robot:\n  sensors: {}\n", "expected parameters of stack.localizer"),
        ("stack:\n  localizer:\n    name: ekf-landmarks\n", "use --localizer"),
        ("stack:\n  localizer:\n    commands: {delay: 1}\n", "stack.localizer.commands.delay: unknown key"),
    ],
)
def test_a_parameter_file_of_something_else_is_refused(
    tmp_path: Path, folder: Path, capsys: Capture, text: str, said: str
) -> None:
    (tmp_path / "p.yaml").write_text(text)
    words = ["localize", str(folder), "--format", "mrclam", "--robot", "1", "--out", str(tmp_path)]
    assert main([*words, "--set", f"@{tmp_path / 'p.yaml'}"]) == 2
    captured = capsys.readouterr()
    assert captured.err.count("\n") == 1
    assert said in captured.err


def test_evaluate_names_the_file_that_is_wrong(tmp_path: Path, capsys: Capture) -> None:
    kitti = TEXTS["kitti.txt"][1]
    whole, cut, tum = (tmp_path / name for name in ("whole.txt", "cut.txt", "tum.txt"))
    whole.write_text(kitti)
    tum.write_text(TEXTS["tum.txt"][1])
    for text, said in (
        ("".join(kitti.splitlines(keepends=True)[:3]), f"{cut}: without times expected as many poses"),
        (
            kitti[:9],
            f"{cut} line 1: expected 8 columns (TUM: t x y z qx qy qz qw) or 12 (KITTI), blanks "
            "between them and no names above, found 4",
        ),
        ("", f"{cut} line 1: expected poses, found the end of the file"),
    ):
        cut.write_text(text)
        assert main(["evaluate", str(cut), str(whole)]) == 2
        captured = capsys.readouterr()
        assert captured.err.count("\n") == 1
        assert said in captured.err
    assert main(["evaluate", str(tum), str(whole)]) == 2
    assert f"{tum} as tum and {whole} as kitti" in capsys.readouterr().err
