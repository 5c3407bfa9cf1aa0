"""``patrol.npz``: the places of a patrol, who was at them when, and how old the view of the floor was."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from pilotage.core.config import FARTHEST_M
from pilotage.core.types import FloatArray, IntArray
from pilotage.records.arrays import Arrays, read_record, write_arrays

PATROL_FILE = "patrol.npz"


def _none(*shape: int) -> FloatArray:
    return np.empty(shape)


@dataclass(frozen=True, slots=True)
class PatrolRecord:
    """A patrol as seen from outside.

    Attributes
    ----------
    vertices_xy_m, edges, tour
        (V, 2) places, (E, 2) vertices that an edge joins, (K,) stops of the best closed tour.
    visits
        (N, 3) robot, vertex and time of every arrival, in order.
    idleness_s
        (V,) mean idleness of each place.
    series
        (S, 6) time, mean and worst idleness, share of the floor seen lately, mean and worst age of its cells.
    cells_xy_m, cell_m, age_s, last_seen_s
        (C, 2) middles of the floor's cells, their side; (C,) mean age of their view, when it was last.
    """

    vertices_xy_m: FloatArray = field(default_factory=lambda: _none(0, 2))
    edges: IntArray = field(default_factory=lambda: np.empty((0, 2), dtype=np.int64))
    tour: IntArray = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    visits: FloatArray = field(default_factory=lambda: _none(0, 3))
    idleness_s: FloatArray = field(default_factory=lambda: _none(0))
    series: FloatArray = field(default_factory=lambda: _none(0, 6))
    cells_xy_m: FloatArray = field(default_factory=lambda: _none(0, 2))
    cell_m: float = 0.5
    age_s: FloatArray = field(default_factory=lambda: _none(0))
    last_seen_s: FloatArray = field(default_factory=lambda: _none(0))


def write_patrol(folder: Path, patrol: PatrolRecord) -> None:
    """Write the patrol."""
    arrays = {name: getattr(patrol, name) for name in PatrolRecord.__slots__}
    write_arrays(folder / PATROL_FILE, {**arrays, "cell_m": np.array(patrol.cell_m)})


def read_patrol(folder: Path) -> PatrolRecord | None:
    """Read the patrol; None where there is no such file; InputError as ``read_record``."""
    return read_record(folder / PATROL_FILE, _record, None)


def _record(arrays: Arrays) -> PatrolRecord:
    vertices = arrays.floats("vertices_xy_m", -1, 2)
    count = len(vertices)
    cells = arrays.floats("cells_xy_m", -1, 2)
    record = PatrolRecord(
        vertices,
        arrays.ints("edges", -1, 2),
        arrays.ints("tour", -1),
        arrays.floats("visits", -1, 3),
        arrays.floats("idleness_s", count),
        arrays.floats("series", -1, 6),
        cells,
        arrays.scalar("cell_m"),
        arrays.floats("age_s", len(cells)),
        arrays.floats("last_seen_s", len(cells)),
    )
    if count == 0 or not (np.abs(np.concatenate([vertices, cells])) <= FARTHEST_M).all():
        raise ValueError("vertices_xy_m, cells_xy_m: expected places on a map")
    for name in ("edges", "tour"):
        named = getattr(record, name)
        if named.size and not (named.min() >= 0 and named.max() < count):
            raise ValueError(f"{name}: expected vertices from 0 to {count - 1}")
    visited = record.visits[:, 1]
    if not ((visited >= 0) & (visited < count)).all() or not np.isfinite(record.visits).all():
        raise ValueError(f"visits: expected vertices from 0 to {count - 1}")
    if not 0.0 < record.cell_m <= FARTHEST_M:
        raise ValueError("cell_m: expected a side above 0 m")
    return record
