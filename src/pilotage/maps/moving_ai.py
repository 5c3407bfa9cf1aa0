"""Maps and scenarios of the MovingAI benchmarks (Sturtevant 2012, https://movingai.com/benchmarks)."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pilotage.core.errors import InputError
from pilotage.core.files import opened, read_text
from pilotage.core.limits import DATA_BYTES
from pilotage.core.types import BoolArray, FloatArray, IntArray, Pose2
from pilotage.maps.memory import require_memory
from pilotage.maps.occupancy_grid import CORNER, OccupancyGrid

GROUND = b".GS"
"""Passable terrain: plain ground and swamp, which is entered from ground freely."""

WATER = b"W"
"""Passable among itself, but not from ground."""

KNOWN = b".GSW@OT"

FARTHEST = 2**31
"""No place on any map is beyond."""


@dataclass(frozen=True, slots=True, eq=False)
class MovingAiMap:
    """A map's terrain letters, (rows, columns) of bytes, row 0 on top."""

    terrain: NDArray[np.uint8]

    def blocked(self, passable: bytes = GROUND) -> BoolArray:
        """Whether each cell's terrain is none of the ``passable`` letters."""
        table = np.ones(256, dtype=np.bool_)
        table[list(passable)] = False
        return table[self.terrain]

    def grid(self, resolution_m: float = 1.0, origin: Pose2 = CORNER) -> OccupancyGrid:
        """The map as a grid: ground and swamp are free, all else is occupied."""
        return OccupancyGrid.of(self.blocked(), resolution_m, origin)

    def scaled(self, rows: int, columns: int) -> MovingAiMap:
        """The map stretched to another size, each cell taken from where it comes from."""
        if (rows, columns) == self.terrain.shape:
            return self
        require_memory(2 * rows * columns, f"a map of {columns} x {rows} cells")
        from_row = np.arange(rows) * self.terrain.shape[0] // rows
        from_column = np.arange(columns) * self.terrain.shape[1] // columns
        return MovingAiMap(self.terrain[from_row[:, None], from_column])


@dataclass(frozen=True, slots=True, eq=False)
class Scenario:
    """The problems of a scenario file, in its order.

    Attributes
    ----------
    starts, goals
        (N, 2) row, column.
    sizes
        (N, 2) rows and columns that the problem's map has; 0 where the file does not say.
    lengths
        (N,) optimal lengths as printed.
    tolerances
        (N,) how far a printed length may be off by its rounding to six digits, at least 0.01.
    """

    starts: IntArray
    goals: IntArray
    sizes: IntArray
    lengths: FloatArray
    tolerances: FloatArray

    def __len__(self) -> int:
        return int(self.lengths.shape[0])

    @property
    def without_path(self) -> BoolArray:
        """(N,) where the file says so: by a length below 0, infinite, or of 0 between two places."""
        apart = (self.starts != self.goals).any(axis=1)
        none: BoolArray = ~np.isfinite(self.lengths) | (self.lengths < 0.0) | ((self.lengths == 0.0) & apart)
        return none


def read_moving_ai_map(path: Path) -> MovingAiMap:
    """Read a ``.map`` file; either line ending.

    Raises
    ------
    InputError
        Where the file is missing, its header is wrong, it is cut short, a row has another length than the
        header says, a letter is unknown, or the map does not fit into memory.
    """
    with opened(path, "a MovingAI map file", DATA_BYTES) as file:
        head = file.read(4096)
        header = re.match(rb"\s*((?:[^\n]*\n){1,20}?)map[ \t]*\r?\n", head)
        if header is None:
            raise InputError(f"{path}: expected a MovingAI header (type, height, width, map), found none")
        rows, columns = (_size_in(header[1], name, path) for name in ("height", "width"))
        require_memory(3 * rows * (columns + 2), f"{path}: a map of {columns} x {rows} cells")
        file.seek(header.end())
        body = np.frombuffer(file.read(rows * (columns + 2) + 4096), dtype=np.uint8)
    body = body[body != ord("\r")]
    if body.size == rows * (columns + 1) - 1:
        # The last line may lack its end.
        body = np.append(body, np.uint8(ord("\n")))
    lines = body[: rows * (columns + 1)]
    if lines.size < rows * (columns + 1) or (lines.reshape(rows, -1)[:, -1] != ord("\n")).any():
        raise InputError(_wrong_rows(body, rows, columns, path))
    more = body[rows * (columns + 1) :]
    if not np.isin(
        more, list(b" \t\n\x1a")
    ).all():  # a header that says too little would leave the rest of the map out
        raise InputError(f"{path}: expected {rows} rows, as its header says, found more below them")
    terrain = np.ascontiguousarray(lines.reshape(rows, columns + 1)[:, :-1])
    strange = np.setdiff1d(np.flatnonzero(np.bincount(terrain.ravel(), minlength=256)), list(KNOWN))
    if strange.size:
        if ord("\n") in strange:
            raise InputError(_wrong_rows(body, rows, columns, path))
        raise InputError(f"{path}: expected terrain of {KNOWN.decode()}, found {chr(strange[0])!r}")
    terrain.flags.writeable = False
    return MovingAiMap(terrain)


def _size_in(header: bytes, name: str, path: Path) -> int:
    found = re.search(rb"^\s*" + name.encode() + rb"\s+(\d{1,12})\s*$", header, re.MULTILINE)
    if found is None or int(found[1]) == 0:
        raise InputError(f"{path}: {name}: expected a line '{name} N' with N above 0 in the header")
    return int(found[1])


def _wrong_rows(body: NDArray[np.uint8], rows: int, columns: int, path: Path) -> str:
    """Say which row is the first that is not as long as the header says."""
    ends = np.flatnonzero(body == ord("\n"))
    lengths = np.diff(np.concatenate([[-1], ends, [body.size]])) - 1
    wrong = np.flatnonzero(lengths[:rows] != columns)
    if wrong.size and wrong[0] < len(ends):
        row = int(wrong[0])
        return f"{path}: row {row + 1}: expected {columns} cells, found {int(lengths[row])}"
    complete = int(np.count_nonzero(lengths[:rows] == columns))
    return (
        f"{path}: expected {rows} rows of {columns} cells, found {complete}; the file seems to be cut short"
    )


def read_scenario(path: Path) -> Scenario:
    """Read a ``.scen`` file: version 1 (with the map's size) or one without version, tabs or blanks.

    Raises
    ------
    InputError
        Where the file is missing, empty, or a line is not a problem.
    """
    lines = read_text(path, "a MovingAI scenario file").splitlines()
    first = lines[0].split() if lines else []
    has_version = len(first) == 2 and first[0] == "version"
    # bucket, map, [columns, rows,] start x, y, goal x, y, length; before them a map's name may hold blanks.
    numbers = 7 if has_version and first[1] not in ("0", "0.0") else 5
    problems, digits = [], []
    for count, line in enumerate(lines[has_version:], start=1 + has_version):
        fields = line.split()
        if not fields:
            continue
        try:
            if len(fields) < numbers + 2:
                raise ValueError
            problem = [*map(int, fields[-numbers:-1]), float(fields[-1])]
            if max(map(abs, problem[:-1])) > FARTHEST or math.isnan(problem[-1]):
                raise ValueError
            problems.append(problem)
        except ValueError:
            raise InputError(
                f"{path}: line {count}: expected a problem of {numbers + 2} fields, found {line[:80]!r}"
            ) from None
        digits.append(len(fields[-1].partition(".")[2]))
    if not problems:
        raise InputError(f"{path}: expected problems, found none")
    table = np.array(problems, dtype=np.float64)
    places = table[:, -5:-1].astype(np.int64)
    sizes = table[:, 1::-1].astype(np.int64) if numbers == 7 else np.zeros((len(table), 2), np.int64)
    return Scenario(
        places[:, 1::-1], places[:, :1:-1], sizes, table[:, -1], _tolerances(table[:, -1], np.array(digits))
    )


def _tolerances(lengths: FloatArray, decimals: IntArray) -> FloatArray:
    """Half of the sixth digit where a length was printed with no more, but not below 0.01."""
    whole = np.floor(np.log10(np.maximum(np.abs(lengths), 1.0))) + 1.0
    sixth = 0.5 * 10.0 ** (whole - 6.0)
    return np.where(decimals + whole <= 6, np.maximum(0.01, sixth * (1.0 + 1e-9)), 0.01)
