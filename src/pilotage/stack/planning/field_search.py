"""Searches over cells for robots on a distance field: its nodes are the cells."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

import numpy as np

from pilotage.core.angles import wrap_to_pi
from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.maps.distance_field import DistanceField
from pilotage.maps.segment_map import SegmentMap
from pilotage.stack.planning.driving_space import (
    STATE_SPACING_M,
    blocked_end,
    clearance_of,
    failure,
    space_for,
    spaced_waypoints,
)
from pilotage.stack.planning.grid_space import Cell, GridPath, GridSpace
from pilotage.stack.planning.narrow_gaps import line_through_gaps
from pilotage.stack.planning.node_search import NodeSearch, line_length_m, line_states
from pilotage.stack.planning.plan_status import PlanStatus
from pilotage.stack.planning.planner import Path, PlanRequest, PlanResult

FINE_SHARE, MOST_FINE_NODES = 0.5, 1_000_000
"""Of the clearance are nodes apart for robots that are small beside the field's own; of a large map more."""


def plan_over_nodes(
    request: PlanRequest,
    find: Callable[[GridSpace, Cell, Cell], GridPath | None],
    own_clearance_m: float,
    waypoint_spacing_m: float,
    any_angle: bool = False,
) -> PlanResult:
    """Answer a planning query by a search over the nodes of its distance field.

    Nodes are free where lines between them keep the clearance everywhere. Gaps that are too narrow for that
    are looked at on finer nodes where one would save a longer path (``line_through_gaps``). Where nothing
    is found for a robot that is small beside the nodes' spacing, everything is.

    The path turns on the spot where it bends.

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
    ends = np.array([(request.start.x_m, request.start.y_m), (request.goal.x_m, request.goal.y_m)])
    search = NodeSearch(space, clearance_m, find, any_angle)
    line, expansions, why = search.line(request.field, search.free(request.field), ends)
    closer = line_through_gaps(search, request.field, ends, line)
    line = line if closer is None else closer
    if line is None and (finer := _finer_field(request.field, clearance_m)) is not None:
        line, expansions, why = search.line(finer, search.free(finer), ends)
    if line is None:
        return failure(PlanStatus.NO_PATH, why, time.perf_counter() - began)
    path = path_of_line(line, request, waypoint_spacing_m)
    took = time.perf_counter() - began
    reason = f"{path.length_m:.2f} m after {expansions} expansions"
    return PlanResult(PlanStatus.FOUND, reason, path, took, took, expansions)


def _finer_field(field: DistanceField, clearance_m: float) -> DistanceField | None:
    """With nodes as near as a small robot's clearance asks for and memory allows; None where they are so."""
    xmin, ymin, xmax, ymax = field.bounds_m
    least_m = math.sqrt((xmax - xmin) * (ymax - ymin) / MOST_FINE_NODES)
    spacing_m = max(FINE_SHARE * clearance_m, least_m)
    known = len(field.segments_m) + len(field.circles_m)
    if not known or clearance_m > field.resolution_m or not 0.0 < spacing_m < field.resolution_m:
        return None
    return DistanceField.from_map(SegmentMap(field.segments_m, field.circles_m, field.bounds_m), spacing_m)


def path_of_line(line: FloatArray, request: PlanRequest, waypoint_spacing_m: float) -> Path:
    """A polyline (N, 2) as a path that turns on the spot."""
    states = line_states(line, STATE_SPACING_M)
    if len(line) == 1:
        states[0, 2] = wrap_to_pi(request.start.theta_rad)
    if request.goal.theta_rad is not None:
        states[-1, 2] = wrap_to_pi(request.goal.theta_rad)
    return Path(states, spaced_waypoints(states, waypoint_spacing_m), line_length_m(line), 0.0)
