"""The BARN courses (Perille et al. 2020) as three text files: cylinders, reference paths, optimal times."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray, IntArray
from pilotage.logs.text import Table, check_size, read_table

CYLINDERS = "cylinders.csv"
PATHS = "paths.csv"
WORLDS = "worlds.csv"
PUBLISHED = ("world", "succeeded", "collided", "timed_out", "time_s")
RADIUS_M = 0.075
START = (-2.25, 3.0, np.pi / 2.0)
"""Pose x, y, theta at which a run begins, in the organizers' files of 2024."""
GOAL_AHEAD_M = 10.0
GOAL_TOLERANCE_M = 1.0
TIME_LIMIT_S = 100.0
FARTHEST_M = 50.0
"""Of a post; the courses are 30 m long at most, and their floor is searched in fine cells."""


@dataclass(frozen=True, slots=True)
class BarnWorld:
    """One course.

    Attributes
    ----------
    number
        Of the world, from 0 to 299.
    circles_m
        (N, 3) x, y, radius of the cylinders.
    path_xy_m
        (K, 2) the organizers' reference path, start and goal included.
    path_length_m, optimal_time_s
        Of that path, and at 2 m/s.
    """

    number: int
    circles_m: FloatArray
    path_xy_m: FloatArray
    path_length_m: float
    optimal_time_s: float


def read_barn(folder: Path) -> tuple[BarnWorld, ...]:
    """Read all courses of a folder, in the order of their numbers.

    Raises
    ------
    InputError
        One line: the file that is missing, the line that is wrong, the world that is not in all three.
    """
    if not folder.is_dir():
        raise InputError(f"{folder}: expected a folder with {CYLINDERS}, {PATHS} and {WORLDS}, found none")
    missing = [name for name in (CYLINDERS, PATHS, WORLDS) if not (folder / name).is_file()]
    if missing:
        raise InputError(
            f"{folder}: expected {CYLINDERS}, {PATHS} and {WORLDS}; missing: {', '.join(missing)}"
        )
    cylinders = _read(folder / CYLINDERS, ("world", "x_m", "y_m"), FARTHEST_M)
    paths = _read(folder / PATHS, ("world", "k", "x_m", "y_m"))
    check_size(paths, ("world", "k", "x_m", "y_m"), 2, FARTHEST_M)
    worlds = _read(folder / WORLDS, ("world", "cylinders", "path_length_m", "optimal_time_s"))
    numbers = _numbers(worlds)
    if np.unique(numbers).size != numbers.size:
        raise InputError(f"{worlds.path}: expected every world once, found one twice")
    of_cylinder, of_path = _numbers(cylinders), _numbers(paths)
    for table, present in ((cylinders, of_cylinder), (paths, of_path)):
        strange = np.flatnonzero(~np.isin(present, numbers))
        if strange.size:
            row = int(strange[0])
            raise InputError(
                f"{table.place(row)}: world {int(present[row])} is not in {worlds.path.name}; add it there"
            )
    return tuple(
        _world(worlds, row, cylinders.values[of_cylinder == numbers[row]], paths, of_path, int(numbers[row]))
        for row in np.argsort(numbers)
    )


def path_clearance_m(world: BarnWorld) -> float:
    """Least distance between the organizers' reference path and a post's surface."""
    begin, step = world.path_xy_m[:-1], np.diff(world.path_xy_m, axis=0)
    square = np.maximum((step**2).sum(axis=1), 1e-12)
    least = np.inf
    for x, y, radius in world.circles_m:
        along = np.clip(((np.array([x, y]) - begin) * step).sum(axis=1) / square, 0.0, 1.0)
        away = np.hypot(*(begin + along[:, None] * step - [x, y]).T).min()
        least = min(least, float(away) - radius)
    return least


def read_published(folder: Path) -> dict[str, Table]:
    """Results that others published, by the name in ``published_NAME.csv``; none where there is no such file.

    Columns: world, succeeded, collided, timed_out (0 or 1), time_s.

    Raises
    ------
    InputError
        File and line of what is wrong.
    """
    return {
        path.stem.removeprefix("published_"): _read(path, PUBLISHED)
        for path in sorted(folder.glob("published_*.csv"))
    }


def _read(path: Path, columns: tuple[str, ...], most: float = 1e4) -> Table:
    table = read_table(path, columns, separator=",", header=True)
    check_size(table, columns, most=most)
    return table


def _numbers(table: Table) -> IntArray:
    values = table.values[:, 0]
    wrong = np.flatnonzero((values != np.floor(values)) | (values < 0) | (values > 1e6))
    if wrong.size:
        row = int(wrong[0])
        raise InputError(
            f"{table.place(row)}: world: expected a whole number, 0 or more, found {values[row]:g}"
        )
    return values.astype(np.int64)


def _world(
    worlds: Table, row: int, cylinders: FloatArray, paths: Table, of_path: IntArray, number: int
) -> BarnWorld:
    _, count, length, optimal = worlds.values[row]
    if cylinders.shape[0] != count:
        raise InputError(
            f"{worlds.place(row)}: expected {int(count)} cylinders of world {number}, "
            f"found {cylinders.shape[0]}"
        )
    if not (length > 0.0 and optimal > 0.0):
        raise InputError(
            f"{worlds.place(row)}: expected a length and a time above 0, found {length:g} m, {optimal:g} s"
        )
    mine = paths.values[of_path == number]
    mine = mine[np.argsort(mine[:, 1], kind="stable")]
    if mine.shape[0] < 2:
        raise InputError(f"{paths.path}: expected a path of two points or more in world {number}, found none")
    circles = np.column_stack([cylinders[:, 1:3], np.full(cylinders.shape[0], RADIUS_M)])
    return BarnWorld(number, circles, np.ascontiguousarray(mine[:, 2:4]), float(length), float(optimal))
