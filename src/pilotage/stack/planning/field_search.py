"""Searches over cells for robots on a distance field: its nodes are the cells."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator

import numpy as np

from pilotage.core.angles import wrap_to_pi
from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.kernels.rrt.clearance import Space
from pilotage.stack.planning.driving_space import (
    CHECK_SPACING_M,
    STATE_SPACING_M,
    blocked_end,
    clearance_of,
    failure,
    is_valid,
    space_for,
    spaced_waypoints,
)
from pilotage.stack.planning.grid_space import Cell, GridPath, GridSpace
from pilotage.stack.planning.planner import Path, PlanRequest, PlanResult, PlanStatus

REACH = 3
"""Start and goal are joined to a node at most this many nodes away in x and y."""

MARGIN_M = 1e-9
"""What rounding may take from a clearance."""


def plan_over_nodes(
    request: PlanRequest,
    find: Callable[[GridSpace, Cell, Cell], GridPath | None],
    own_clearance_m: float,
    waypoint_spacing_m: float,
    any_angle: bool = False,
) -> PlanResult:
    """Answer a planning query by a search over the nodes of its distance field.

    A point of an edge of length e is at least sqrt(d^2 - (e/2)^2) from any obstacle if both its ends are
    d away; nodes are free where d leaves the clearance so, and the path keeps it everywhere. A line at
    any angle stays within half a cell's diagonal of free nodes, and these keep that much more.

    The path turns on the spot where it bends. Paths that are narrower than the nodes' margin are missed.

    Raises
    ------
    InputError
        Where the request's clearance or poses are not finite.
    """
    began = time.perf_counter()
    clearance_m = clearance_of(request, own_clearance_m)
    if not math.isfinite(request.start.theta_rad):
        raise InputError(f"plan: expected a finite start heading, found {request.start.theta_rad}")
    space = space_for(request.field, clearance_m)
    blocked = blocked_end(request, space, clearance_m)
    if blocked is not None:
        return failure(*blocked, time.perf_counter() - began)
    half_diagonal_m = request.field.resolution_m * math.sqrt(0.5)
    least_m = clearance_m + half_diagonal_m if any_angle else math.hypot(clearance_m, half_diagonal_m)
    nodes = GridSpace(~(request.field.distance_m >= least_m + MARGIN_M))
    ends = [(request.start.x_m, request.start.y_m), (request.goal.x_m, request.goal.y_m)]
    joined = [next(_joints(*end, request, nodes, space, clearance_m), None) for end in ends]
    for name, cell in zip(("start", "goal"), joined, strict=True):
        if cell is None:
            reason = f"no node of the grid near the {name} keeps {clearance_m:g} m and can be driven to"
            return failure(PlanStatus.NO_PATH, reason, time.perf_counter() - began)
    start, goal = joined
    found = None if start is None or goal is None else find(nodes, start, goal)
    if found is None:
        reason = f"no path over the grid's nodes keeps {clearance_m:g} m from the obstacles"
        return failure(PlanStatus.NO_PATH, reason, time.perf_counter() - began)
    x0, y0 = request.field.origin_xy_m
    middle = np.array([x0, y0]) + found.cells[:, ::-1] * request.field.resolution_m
    line = np.concatenate([ends[:1], middle, ends[1:]])
    line = line[np.concatenate([[True], np.any(np.diff(line, axis=0) != 0.0, axis=1)])]
    path = path_of_line(line, request, waypoint_spacing_m)
    took = time.perf_counter() - began
    reason = f"{path.length_m:.2f} m after {found.expansions} expansions"
    return PlanResult(PlanStatus.FOUND, reason, path, took, took, found.expansions)


def _joints(
    x_m: float, y_m: float, request: PlanRequest, nodes: GridSpace, space: Space, clearance_m: float
) -> Iterator[Cell]:
    """Free nodes near a point that are reached in a straight line, the nearest first."""
    x0, y0 = request.field.origin_xy_m
    spacing_m = request.field.resolution_m
    column, row = (x_m - x0) / spacing_m, (y_m - y0) / spacing_m
    near = [
        (math.hypot(r - row, c - column), r, c)
        for r in range(round(row) - REACH, round(row) + REACH + 1)
        for c in range(round(column) - REACH, round(column) + REACH + 1)
    ]
    for _, r, c in sorted(near):
        if nodes.is_free((r, c)):
            leg = np.array([[x_m, y_m], [x0 + c * spacing_m, y0 + r * spacing_m]])
            if is_valid(_states(leg, CHECK_SPACING_M), space, clearance_m):
                yield r, c


def path_of_line(line: FloatArray, request: PlanRequest, waypoint_spacing_m: float) -> Path:
    """A polyline (N, 2) as a path that turns on the spot."""
    states = _states(line, STATE_SPACING_M)
    if len(line) == 1:
        states[0, 2] = wrap_to_pi(request.start.theta_rad)
    if request.goal.theta_rad is not None:
        states[-1, 2] = wrap_to_pi(request.goal.theta_rad)
    length_m = math.fsum(np.hypot(*np.diff(line, axis=0).T).tolist())
    return Path(states, spaced_waypoints(states, waypoint_spacing_m), length_m, 0.0)


def _states(line: FloatArray, spacing_m: float) -> FloatArray:
    """States (M, 3) along a polyline (N, 2), at most so far apart, headed along the leg ahead."""
    if len(line) == 1:
        return np.array([[line[0, 0], line[0, 1], 0.0]])
    legs = np.diff(line, axis=0)
    counts = np.maximum(1, np.ceil(np.hypot(*legs.T) / spacing_m - 1e-9)).astype(np.int64)
    of_leg = np.repeat(np.arange(len(legs)), counts)
    part = (np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)) / counts[of_leg]
    headings = np.arctan2(legs[:, 1], legs[:, 0])
    headings[headings >= math.pi] = -math.pi
    points = line[of_leg] + part[:, None] * legs[of_leg]
    return np.concatenate(
        [np.column_stack([points, headings[of_leg]]), [[line[-1, 0], line[-1, 1], headings[-1]]]]
    )
