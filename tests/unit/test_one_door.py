"""No reader opens a file by itself: all go through ``pilotage.core.files``."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

import pilotage

SOURCE = Path(pilotage.__file__).parent
ROOMS = (
    "logs",
    "maps",
    "missions",
    "tracking",
    "calibration",
    "sensors",
    "models",
    "evaluation",
    "experiments",
    "records",
    "report",
    "bridges",
    "face",
    "stack",
    "sim",
    "replicas",
    "cli",
)
METHODS = frozenset({"open", "read_text", "read_bytes"})
"""Of paths and modules alike."""
LIBRARIES = {
    "yaml": {
        "load",
        "safe_load",
        "full_load",
        "unsafe_load",
        "load_all",
        "safe_load_all",
        "parse",
        "compose",
    },
    "json": {"load", "loads"},
    "np": {"load", "loadtxt", "genfromtxt", "fromfile", "memmap", "fromregex"},
    "gzip": {"open", "decompress", "GzipFile"},
    "bz2": {"open", "decompress"},
    "lzma": {"open", "decompress"},
    "zlib": {"decompress"},
    "zipfile": {"ZipFile"},
    "tarfile": {"open"},
    "pickle": {"load", "loads"},
    "pq": {"read_table", "ParquetFile", "read_pandas"},
    "csv": set(),
    "Image": {"open"},
    "cv2": {"VideoCapture", "imread"},
    "sqlite3": {"connect"},
}
NAMES = frozenset({"open", "loadmat"})

ALLOWED = {
    ("maps/elevation_file.py", "rasterio.open"): "GDAL reads GeoTIFF by itself, after require_file",
    ("tracking/film.py", "cv2.VideoCapture"): "FFmpeg reads films by itself, after require_file",
    ("logs/mat.py", "loadmat"): "of bytes that came through the door",
    ("experiments/calibrate_commands.py", "json.loads"): "of what json.dumps just wrote",
    (
        "logs/salvage/sqlite.py",
        "sqlite3.connect",
    ): "in memory, of bytes that came through the door; and what tables one has that rosbags opens next",
    ("logs/bounded_rosbags.py", "*.open"): "the library's own method, behind a look at the database's tables",
    ("cli/main.py", "*.open"): "the null device, where a stream was closed",
    ("cli/study_page.py", "*.read_text"): "the page that was just written",
    ("report/markup.py", "*.read_text"): "the page's own style sheet",
    ("report/replay/section.py", "*.read_text"): "the player's own script and style sheet",
    ("report/slam/viewer.py", "*.read_text"): "the viewer's own script",
    ("face/examples.py", "*.read_text"): "the templates that come with pilotage",
    (
        "experiments/studies/engine.py",
        "*.read_text",
    ): "what stands where the same text is to be written",
    ("experiments/studies/study.py", "json.loads"): "of what json.dumps wrote, or of one override",
    ("experiments/studies/dask_workers.py", "json.loads"): "of the text that the study's own process sent",
    (
        "experiments/studies/database.py",
        "sqlite3.connect",
    ): "a database is read and written in place",
    ("experiments/result_rows.py", "sqlite3.connect"): "a new database is written, none is read",
    ("experiments/studies/rows.py", "sqlite3.connect"): "a database is read in place, by SQLite",
}


def _is_shipped(owner: ast.expr) -> bool:
    """Whether it is ``SHIPPED / name`` or ``resources.files(...) / name``: what comes with pilotage."""
    if not (isinstance(owner, ast.BinOp) and isinstance(owner.op, ast.Div)):
        return False
    return ast.unparse(owner.left).startswith(("SHIPPED", "resources.files("))


def _is_for_writing(call: ast.Call) -> bool:
    if not (isinstance(call.func, ast.Attribute) and call.func.attr == "open" and call.args):
        return False
    mode = call.args[0]
    return isinstance(mode, ast.Constant) and isinstance(mode.value, str) and mode.value[:1] in "wxa"


def openings(tree: ast.AST) -> list[tuple[str, int]]:
    """Calls that open or decode a file, as ``library.name``, with their line."""
    found = []
    for node in ast.walk(tree):
        if not isinstance(node, ast.Call):
            continue
        call = node.func
        if isinstance(call, ast.Name) and call.id in NAMES:
            found.append((call.id, node.lineno))
        elif isinstance(call, ast.Attribute):
            owner = call.value.id if isinstance(call.value, ast.Name) else "*"
            if owner == "files" or _is_shipped(call.value) or _is_for_writing(node):
                continue
            if owner == "rasterio" or call.attr in LIBRARIES.get(owner, ()):
                found.append((f"{owner}.{call.attr}", node.lineno))
            elif call.attr in METHODS:
                found.append((f"*.{call.attr}", node.lineno))
    return found


def modules(room: str) -> list[Path]:
    return sorted((SOURCE / room).rglob("*.py"))


@pytest.mark.parametrize("room", ROOMS)
def test_no_reader_opens_a_file_by_itself(room: str) -> None:
    by_themselves = []
    for path in modules(room):
        name = path.relative_to(SOURCE).as_posix()
        for call, line in openings(ast.parse(path.read_text(encoding="utf-8"))):
            if (name, call) not in ALLOWED:
                by_themselves.append(f"{name}:{line}: {call}")
    assert not by_themselves, "read it through pilotage.core.files: " + ", ".join(by_themselves)


def test_only_one_place_decides_what_a_whole_number_is() -> None:
    """``"²".isdigit()`` is true, and ``int`` refuses it and more than 4,300 digits with a traceback."""
    asked = re.compile(r"\.is(?:digit|decimal|numeric)\(")
    found = [path for path in SOURCE.rglob("*.py") if asked.search(path.read_text(encoding="utf-8"))]
    told = {path.relative_to(SOURCE).as_posix() for path in found}
    assert told == {
        "core/whole_number.py",
        "maps/memory.py",  # what the system says of its memory
        "records/world.py",  # of identities that were numbers
    }


def test_the_exceptions_are_still_there() -> None:
    for name, call in ALLOWED:
        path = SOURCE / name
        assert path.is_file(), name
        calls = {found for found, _ in openings(ast.parse(path.read_text(encoding="utf-8")))}
        assert call in calls, (name, call)


def test_the_test_sees_what_it_forbids() -> None:
    for text in ("open('x')", "Path('x').read_text()", "np.load('x')", "yaml.safe_load(t)", "p.open('rb')"):
        assert openings(ast.parse(text)), text
    assert not openings(ast.parse("p.open('wb'); read_text(path); files.read_text(path); np.savez(path)"))
