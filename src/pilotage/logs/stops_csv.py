"""A rover's stops in a CSV file, as the Curiosity rover's are published: odometer, yaw and place of each.

Columns ``sol, easting_m, northing_m, yaw_rad, mobtrav_id`` among others, in any order: yaw counts from north,
clockwise; ``mobtrav_id`` is what the odometer counted on the way from the stop before. (``total_dist`` of the
same files is empty over the first third, and whole metres then.)
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from pilotage.core.angles import wrap_array_to_pi
from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.logs.text import check_size, read_table

COLUMNS = ("sol", "easting_m", "northing_m", "yaw_rad", "mobtrav_id")
LEAST_STOPS = 100
SOL_S = 88775.244
"""A Martian day."""


@dataclass(frozen=True, slots=True, eq=False)
class Stops:
    """N stops in a row.

    Attributes
    ----------
    t_s
        (N,) by the sol, from the first stop on; stops of one sol follow each other by a second.
    position_m
        (N, 2) localized places, x east, y north, from the first stop on.
    heading_rad
        (N,) measured at the stop, from x counter-clockwise.
    odometer_m
        (N,) driven since the stop before; 0 at the first.
    """

    name: str
    t_s: FloatArray
    position_m: FloatArray
    heading_rad: FloatArray
    odometer_m: FloatArray


def read_stops(path: Path) -> Stops:
    """Read the stops of a rover.

    Raises
    ------
    InputError
        File and line of what is missing, no number, out of the order of time or too large; fewer than
        ``LEAST_STOPS`` stops, from which nothing can be calibrated.
    """
    table = read_table(path, COLUMNS, separator=",", header=True)
    # Places count from the first stop: eastings of a planet are in the millions.
    first = np.array([0.0, *table.values[0, 1:3], 0.0, 0.0])
    table = replace(table, values=table.values - first)
    sol, east, north, yaw, odometer = table.values.T
    if sol.shape[0] < LEAST_STOPS:
        raise InputError(
            f"{path} line {int(table.lines[-1])}: expected at least {LEAST_STOPS} stops to calibrate from, "
            f"found {sol.shape[0]}"
        )
    check_size(table, COLUMNS)
    for row in np.flatnonzero(np.diff(sol) < 0.0)[:1] + 1:
        raise InputError(
            f"{table.place(row)}: expected sols in order, found {sol[row]:g} after {sol[row - 1]:g}"
        )
    for row in np.flatnonzero(odometer < 0.0)[:1]:
        raise InputError(f"{table.place(row)}: expected mobtrav_id of 0 or more, found {odometer[row]:g}")
    same = np.arange(sol.shape[0]) - np.searchsorted(sol, sol, side="left")
    driven = odometer.copy()
    driven[0] = 0.0
    return Stops(
        path.stem,
        SOL_S * (sol - sol[0]) + same,
        np.column_stack([east, north]),
        wrap_array_to_pi(0.5 * np.pi - yaw),
        driven,
    )
