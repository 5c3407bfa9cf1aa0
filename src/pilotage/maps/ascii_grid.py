"""ESRI ASCII grids: a few lines of header, then numbers row by row from the north."""

from __future__ import annotations

import math
import re
import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.files import read_text
from pilotage.core.types import FloatArray
from pilotage.core.whole_number import whole_number
from pilotage.maps.memory import require_memory

UNMARKED = -9999.0
"""What stands for unknown where the header does not say."""
CORNERS = {"x": ("xllcorner", "xllcenter"), "y": ("yllcorner", "yllcenter")}
KEYS = frozenset({"ncols", "nrows", "cellsize", "dx", "dy", "nodata_value", *CORNERS["x"], *CORNERS["y"]})
_LINE = re.compile(r"[^\S\n]*([A-Za-z_]\w*)[^\S\n]+(\S+)[^\S\n]*(?:\n|$)|[^\S\n]*\n")
_WORD = re.compile(r"\S+")
_PER_VALUE = 24
"""Bytes: the number as it is read, and as it is kept."""


@dataclass(frozen=True, slots=True, eq=False)
class AsciiGrid:
    """What such a file says.

    Attributes
    ----------
    values
        (rows, columns), NaN where unknown.
    column_m, row_m
        Sides of a cell, in the file's unit.
    corner_m
        Outer corner x, y of the lower-left cell.
    """

    values: FloatArray
    column_m: float
    row_m: float
    corner_m: tuple[float, float]


def read_ascii_grid(path: Path) -> AsciiGrid:
    """Read a grid, gzipped or not; numbers may stand on any lines, as GDAL takes them.

    Raises
    ------
    InputError
        Where the file is missing or cut short, a key is missing, unknown or wrong, a value is no number, or
        a ``.prj`` beside it has degrees.
    """
    text = read_text(path, "an ESRI ASCII grid")
    header, begin = _header(text, path)
    columns, rows = _count(header, "ncols", path), _count(header, "nrows", path)
    column_m, row_m = _sides(header, path)
    corner = tuple(_corner(header, axis, side, path) for axis, side in (("x", column_m), ("y", row_m)))
    unknown = _number(header, "nodata_value", path) if "nodata_value" in header else UNMARKED
    _refuse_degrees(path)
    require_memory(_PER_VALUE * rows * columns, f"{path}: a grid of {columns} x {rows} cells")
    values = _values(text[begin:], rows, columns, path)
    values[values == unknown] = np.nan
    return AsciiGrid(values.reshape(rows, columns), column_m, row_m, (corner[0], corner[1]))


def _header(text: str, path: Path) -> tuple[dict[str, str], int]:
    """The keys in small letters with their words, and where the values begin."""
    found: dict[str, str] = {}
    at = 0
    while (line := _LINE.match(text, at)) is not None and at < len(text):
        key = (line[1] or "").lower()
        if key in ("nan", "inf", "infinity"):  # the first value
            break
        if key and key not in KEYS:
            raise InputError(f"{path}: expected a header of {', '.join(sorted(KEYS))}, found '{line[1]}'")
        if key in found:
            raise InputError(f"{path}: {key}: expected once, found twice")
        if key:
            found[key] = line[2]
        at = line.end()
    return found, at


def _number(header: dict[str, str], key: str, path: Path) -> float:
    if key not in header:
        raise InputError(f"{path}: {key}: missing; an ESRI ASCII grid says it in its header")
    try:
        return float(header[key])
    except ValueError:
        raise InputError(f"{path}: {key}: expected a number, found '{header[key]}'") from None


def _count(header: dict[str, str], key: str, path: Path) -> int:
    text = header.get(key, "")
    count = whole_number(text)
    if count is None or count < 2:
        found = f"found '{text}'" if text else "found none"
        raise InputError(f"{path}: {key}: expected a whole number above 1, {found}")
    return count


def _sides(header: dict[str, str], path: Path) -> tuple[float, float]:
    keys = ("dx", "dy") if "dx" in header or "dy" in header else ("cellsize", "cellsize")
    sides = _number(header, keys[0], path), _number(header, keys[1], path)
    for key, side in zip(keys, sides, strict=True):
        if not (side > 0.0 and math.isfinite(side)):
            raise InputError(f"{path}: {key}: expected a side of cells above 0 m, found {side:g}")
    return sides


def _corner(header: dict[str, str], axis: str, side_m: float, path: Path) -> float:
    corner, centre = CORNERS[axis]
    key = centre if centre in header else corner
    at = _number(header, key, path) - (0.5 * side_m if key == centre else 0.0)
    if not math.isfinite(at):
        raise InputError(f"{path}: {key}: expected a place in m, found {at}")
    return at


def _refuse_degrees(path: Path) -> None:
    """The projection stands beside the grid, in WKT, if anywhere."""
    beside = path.with_suffix(".prj")
    if beside.is_file() and read_text(beside).lstrip().upper().startswith(("GEOGCS", "GEOGCRS")):
        raise InputError(f"{path}: expected metres, found degrees in {beside.name}; project it (gdalwarp)")


def _values(body: str, rows: int, columns: int, path: Path) -> FloatArray:
    """As many numbers as the header says."""
    if not body.strip():
        raise _cut(rows, columns, 0, path)
    with warnings.catch_warnings():
        warnings.simplefilter("error", DeprecationWarning)  # how an older NumPy tells what is no number
        try:
            values = np.fromstring(body, np.float64, sep=" ")
        except (ValueError, DeprecationWarning):
            raise _no_number(body, columns, path) from None
    if values.size != rows * columns:
        raise _cut(rows, columns, values.size, path)
    return values


def _cut(rows: int, columns: int, found: int, path: Path) -> InputError:
    return InputError(
        f"{path}: expected {rows * columns} values for {columns} x {rows} cells, found {found}; "
        "the file seems to be cut short or of another size"
    )


def _no_number(body: str, columns: int, path: Path) -> InputError:
    for index, word in enumerate(_WORD.finditer(body)):
        try:
            float(word[0])
        except ValueError:
            row, column = index // columns + 1, index % columns + 1
            return InputError(
                f"{path}: row {row}, column {column}: expected a number, found '{word[0][:40]}'"
            )
    return InputError(f"{path}: expected numbers below the header, found something else")
