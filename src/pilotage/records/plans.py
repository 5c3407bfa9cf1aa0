"""``plans.npz``: every plan adopted, the obstacle points mapped, the exact shortest path."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from pilotage.core.config import FARTHEST_M
from pilotage.core.types import FloatArray
from pilotage.records.arrays import Arrays, read_record, write_arrays
from pilotage.records.events import LATEST_S

PLANS_FILE = "plans.npz"


def _no_points() -> FloatArray:
    return np.empty((0, 2))


@dataclass(frozen=True, slots=True)
class Plan:
    """One answer of the planner: the path (N, 3), its waypoints (W, 3) and the search tree (E, 4).

    A planner without headings gives (N, 2). The tree's rows are x0, y0, x1, y1 of its edges. The clearance is
    what it keeps from obstacles; nan where unknown.
    """

    path: FloatArray
    waypoints: FloatArray
    tree: FloatArray
    t_s: float
    length_m: float
    planning_time_s: float
    clearance_m: float = math.nan


@dataclass(frozen=True, slots=True)
class Plans:
    """All plans in their order, the (M, 2) obstacle points that the robot put on its own map, and the
    (K, 2) exact shortest path through the true map; none of either where unknown."""

    plans: tuple[Plan, ...] = ()
    mapped_points_m: FloatArray = field(default_factory=_no_points)
    shortest_path_m: FloatArray = field(default_factory=_no_points)


def write_plans(folder: Path, plans: Plans) -> None:
    """Write the plans."""
    arrays: dict[str, Any] = {"mapped_points": plans.mapped_points_m[:, :2]}
    for i, plan in enumerate(plans.plans):
        arrays[f"path_{i}"] = plan.path
        arrays[f"waypoints_{i}"] = plan.waypoints
        arrays[f"tree_{i}"] = plan.tree
        arrays[f"t_{i}"] = np.array(plan.t_s)
        arrays[f"length_{i}"] = np.array(plan.length_m)
        arrays[f"planning_time_{i}"] = np.array(plan.planning_time_s)
        arrays[f"clearance_{i}"] = np.array(plan.clearance_m)
    arrays["shortest_path"] = plans.shortest_path_m
    write_arrays(folder / PLANS_FILE, arrays)


def read_plans(folder: Path) -> Plans:
    """Read the plans; none where there is no such file; InputError as ``read_record``."""
    return read_record(folder / PLANS_FILE, _plans, Plans())


def _plans(arrays: Arrays) -> Plans:
    plans: list[Plan] = []
    while f"path_{len(plans)}" in arrays:
        plans.append(_plan(arrays, len(plans)))
    mapped, shortest = (places(arrays, name, (2,)) for name in ("mapped_points", "shortest_path"))
    return Plans(tuple(plans), mapped, shortest)


def _plan(arrays: Arrays, i: int) -> Plan:
    t_s = arrays.scalar(f"t_{i}", np.nan)
    if abs(t_s) > LATEST_S:
        raise ValueError(f"t_{i}: expected a time within {LATEST_S} s")
    return Plan(
        path=places(arrays, f"path_{i}", (3, 2)),
        waypoints=places(arrays, f"waypoints_{i}", (3, 2)),
        tree=places(arrays, f"tree_{i}", (4,)),
        t_s=t_s,
        length_m=arrays.scalar(f"length_{i}", np.nan),
        planning_time_s=arrays.scalar(f"planning_time_{i}", np.nan),
        clearance_m=arrays.scalar(f"clearance_{i}", np.nan),
    )


def places(arrays: Arrays, name: str, widths: Sequence[int]) -> FloatArray:
    """(N, W) points or poses on the map, of one of some widths; of the last one and empty where missing.

    Raises
    ------
    ValueError
        Where the array has another shape, or a number in it lies beyond ``FARTHEST_M``.
    """
    if name not in arrays:
        return np.empty((0, widths[-1]))
    for width in widths[:-1]:
        try:
            found = arrays.floats(name, -1, width)
            break
        except ValueError:
            continue
    else:
        found = arrays.floats(name, -1, widths[-1])
    if bool((np.abs(found) > FARTHEST_M).any()):
        raise ValueError(f"{name}: expected places within {FARTHEST_M:g} m")
    return found
