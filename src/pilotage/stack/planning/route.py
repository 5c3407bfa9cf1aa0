"""A given route as a path: straight legs, corners rounded by arcs, no search."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from pilotage.core.angles import wrap_array_to_pi, wrap_to_pi
from pilotage.core.config import Config
from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray, Goal, Pose2
from pilotage.kernels.rrt import dubins
from pilotage.kernels.rrt.clearance import first_blocked
from pilotage.maps.distance_field import DistanceField
from pilotage.stack.planning.driving_space import (
    CHECK_SPACING_M,
    STATE_SPACING_M,
    blocked_end,
    clearance_of,
    failure,
    space_for,
    spaced_waypoints,
)
from pilotage.stack.planning.plan_status import PlanStatus
from pilotage.stack.planning.planner import PLANNERS, ConfiguredPlanner, Path, PlanRequest, PlanResult

MOST_STATES = 5_000_000
"""Of which a route is checked, ``CHECK_SPACING_M`` apart: 50 km. A typing error is no road to the moon."""


class RouteConfig(Config):
    """The points of the route and how its corners are rounded.

    Arcs have ``turning_radius_m`` where the legs are long enough for it, and less where they are not, but
    never less than ``least_radius_m``. A start or goal within ``end_tolerance_m`` of the route's first or
    last point takes its place; from a start elsewhere the route is joined at its nearest leg.
    """

    points_m: Annotated[list[tuple[float, float]], Field(min_length=2, max_length=100_000)]
    turning_radius_m: float = Field(0.5, gt=0.0, le=100.0)
    least_radius_m: float = Field(0.05, gt=0.0, le=100.0)
    clearance_m: float = Field(0.46, ge=0.0, le=100.0)
    waypoint_spacing_m: float = Field(1.5, gt=0.0, le=1000.0)
    end_tolerance_m: float = Field(1.0, ge=0.0, le=100.0)


@dataclass(frozen=True, slots=True)
class _Piece:
    """An arc (turn 1 left, -1 right) or a straight (0) of some length."""

    turn: int
    radius_m: float
    length_m: float


class _DoesNotFitError(Exception):
    """No rounded line through these points."""


@PLANNERS.add("route", RouteConfig)
class RoutePlanner(ConfiguredPlanner[RouteConfig]):
    """Follows a programmed route; says where it does not keep its clearance instead of avoiding it.

    Raises
    ------
    InputError
        From the constructor where the corners cannot be rounded or the route is too long to be checked; from
        ``plan`` where the goal is not the route's end.
    """

    def __init__(self, config: RouteConfig) -> None:
        super().__init__(config)
        self._points = np.array(config.points_m, dtype=np.float64)
        length_m = float(np.hypot(*np.diff(self._points, axis=0).T).sum())
        most_m = MOST_STATES * CHECK_SPACING_M
        if length_m > most_m:
            raise InputError(
                f"route: expected a route of at most {most_m:g} m, found {length_m:g} m; "
                "look for a number in points_m that is too large"
            )
        try:
            _rounded(self._points, None, None, config)
        except _DoesNotFitError as error:
            raise InputError(f"route: {error}") from None

    def plan(self, request: PlanRequest) -> PlanResult:
        """Round the route's corners from the request's start to its goal and check the clearance."""
        began = time.perf_counter()
        config = self._config
        clearance_m = clearance_of(request, config.clearance_m)
        if not math.isfinite(request.start.theta_rad):
            raise InputError(f"plan: expected a finite start heading, found {request.start.theta_rad}")
        points = self._points_between(request.start, request.goal)
        space = space_for(request.field, clearance_m)
        blocked = blocked_end(request, space, clearance_m)
        if blocked is not None:
            return failure(*blocked, time.perf_counter() - began)
        try:
            pieces = _rounded(points, request.start.theta_rad, request.goal.theta_rad, config)
        except _DoesNotFitError as error:
            return failure(PlanStatus.NO_PATH, f"route: {error}", time.perf_counter() - began)
        start = np.array([points[0, 0], points[0, 1], wrap_to_pi(request.start.theta_rad)])
        fine = _states(start, pieces, CHECK_SPACING_M)
        bad = int(first_blocked(fine, space, clearance_m))
        if bad >= 0:
            reason = _too_near(request.field, fine[bad], clearance_m)
            return failure(PlanStatus.NO_PATH, reason, time.perf_counter() - began)
        states = _states(start, pieces, STATE_SPACING_M)
        states[-1, :2] = request.goal.x_m, request.goal.y_m
        length_m = math.fsum(piece.length_m for piece in pieces)
        arcs = [piece.radius_m for piece in pieces if piece.turn != 0]
        path = Path(
            states,
            spaced_waypoints(states, config.waypoint_spacing_m),
            length_m,
            min(arcs, default=config.turning_radius_m),
        )
        took = time.perf_counter() - began
        return PlanResult(
            PlanStatus.FOUND, f"{length_m:.2f} m of programmed route", path, took, took, given=True
        )

    def _points_between(self, start: Pose2, goal: Goal) -> FloatArray:
        """The route's points with the start in place of those passed and the goal in place of the last."""
        points, tolerance_m = self._points, self._config.end_tolerance_m
        off_m = math.hypot(goal.x_m - points[-1, 0], goal.y_m - points[-1, 1])
        if not off_m <= max(tolerance_m, 1e-9):
            raise InputError(
                f"route: expected a goal within {tolerance_m:g} m of the route's last point "
                f"({points[-1, 0]:g}, {points[-1, 1]:g}), found ({goal.x_m:g}, {goal.y_m:g}); "
                "end points_m at the goal; to goals one after the other, as a task's points, another planner "
                "leads, such as theta-star"
            )
        here = np.array([start.x_m, start.y_m])
        passed = 0
        if math.hypot(*(here - points[0])) > tolerance_m:
            legs = np.diff(points, axis=0)
            along = np.sum((here - points[:-1]) * legs, axis=1) / np.maximum(np.sum(legs**2, axis=1), 1e-300)
            feet = points[:-1] + np.clip(along, 0.0, 1.0)[:, None] * legs
            passed = int(np.argmin(np.hypot(*(feet - here).T)))
        return np.concatenate([here[None], points[passed + 1 : -1], [[goal.x_m, goal.y_m]]])


def _too_near(field: DistanceField, state: FloatArray, clearance_m: float) -> str:
    """Say where a route comes too near to an obstacle."""
    distance_m = float(field.at(state[None, :2])[0])
    return (
        f"the route comes too near to an obstacle at ({state[0]:.2f}, {state[1]:.2f}): "
        f"about {distance_m:.2f} m, {clearance_m:g} m are asked for"
    )


def _rounded(
    points: FloatArray, start_heading: float | None, goal_heading: float | None, config: RouteConfig
) -> list[_Piece]:
    """Arcs and straights through points (N, 2), with turns at both ends where headings are given.

    Raises
    ------
    _DoesNotFitError
        Where a corner would need an arc tighter than the least radius.
    """
    points = points[np.concatenate([[True], np.any(np.diff(points, axis=0) != 0.0, axis=1)])]
    if len(points) < 2:
        raise _DoesNotFitError("expected at least two different points")
    radius_m = config.turning_radius_m
    if len(points) == 2 and start_heading is not None:
        return _single_leg(points, start_heading, goal_heading, radius_m)
    points = points.copy()
    lead_in, lead_out = None, None
    if start_heading is not None:
        lead_in, points[0] = _turn_toward(points[0], start_heading, points[1], radius_m)
    if goal_heading is not None:
        # The last turn is the first one of the way back.
        turn, points[-1] = _turn_toward(points[-1], goal_heading + math.pi, points[-2], radius_m)
        lead_out = _Piece(-turn.turn, turn.radius_m, turn.length_m)
    legs = np.diff(points, axis=0)
    lengths = np.hypot(legs[:, 0], legs[:, 1])
    headings = np.arctan2(legs[:, 1], legs[:, 0])
    bends = wrap_array_to_pi(np.diff(headings))
    for sharp in np.flatnonzero(np.abs(bends) > math.pi - 1e-6):
        x, y = points[sharp + 1]
        raise _DoesNotFitError(f"the route turns back at ({x:g}, {y:g}); lead it around instead")
    slope = np.tan(np.abs(bends) / 2.0)
    cuts = np.concatenate([[0.0], radius_m * slope, [0.0]])
    # A leg too short for both its corners is shared in proportion.
    share = np.minimum(1.0, lengths / np.maximum(cuts[:-1] + cuts[1:], 1e-300))
    cuts[1:-1] *= np.minimum(share[:-1], share[1:])
    radii = np.divide(cuts[1:-1], slope, out=np.full(len(slope), radius_m), where=slope > 1e-12)
    for tight in np.flatnonzero(radii < min(config.least_radius_m, radius_m) * (1.0 - 1e-9)):
        x, y = points[tight + 1]
        raise _DoesNotFitError(
            f"the legs at ({x:g}, {y:g}) leave room for an arc of {radii[tight]:.3f} m only, "
            f"{config.least_radius_m:g} m is the least; move the points apart"
        )
    pieces = [] if lead_in is None else [lead_in]
    for k, length_m in enumerate(lengths):
        pieces.append(_Piece(0, 0.0, max(0.0, float(length_m - cuts[k] - cuts[k + 1]))))
        if k < len(bends):
            turn_sign = 1 if bends[k] > 0.0 else -1
            pieces.append(_Piece(turn_sign, float(radii[k]), float(radii[k] * abs(bends[k]))))
    if lead_out is not None:
        pieces.append(lead_out)
    return [piece for piece in pieces if piece.length_m > 1e-12]


def _single_leg(
    points: FloatArray, start_heading: float, goal_heading: float | None, radius_m: float
) -> list[_Piece]:
    """The shortest Dubins curve where nothing lies between start and goal."""
    (ax, ay), (bx, by) = points
    heading, free = (0.0, True) if goal_heading is None else (goal_heading, False)
    *_, word, l0, l1, l2 = dubins.connect(ax, ay, start_heading, bx, by, heading, free, radius_m)
    lengths = l0, l1, l2
    pieces = [
        _Piece(int(turn), radius_m, length) for turn, length in zip(dubins.TURNS[word], lengths, strict=True)
    ]
    return [piece for piece in pieces if piece.length_m > 1e-12]


def _turn_toward(
    point: FloatArray, heading: float, target: FloatArray, radius_m: float
) -> tuple[_Piece, FloatArray]:
    """The arc from a pose until it looks at the target, and where that arc ends."""
    *_, word, arc, straight, _ = dubins.shortest_to_point(
        point[0], point[1], heading, target[0], target[1], radius_m
    )
    if word in (dubins.LRL, dubins.RLR) or straight <= 0.0:
        raise _DoesNotFitError(
            f"({target[0]:g}, {target[1]:g}) is too near to ({point[0]:g}, {point[1]:g}) "
            f"to turn to it with a radius of {radius_m:g} m"
        )
    turn = int(dubins.TURNS[word, 0])
    x, y, _ = dubins.advance(point[0], point[1], heading, turn, radius_m, arc)
    return _Piece(turn, radius_m, arc), np.array([x, y])


def _states(start: FloatArray, pieces: list[_Piece], spacing_m: float) -> FloatArray:
    """States (N, 3) along pieces, all joints included."""
    out = [start[None]]
    for piece in pieces:
        x, y, th = out[-1][-1]
        word = dubins.RSR if piece.turn < 0 else dubins.LSL
        lengths = (0.0, piece.length_m, 0.0) if piece.turn == 0 else (piece.length_m, 0.0, 0.0)
        radius_m = piece.radius_m if piece.turn != 0 else 1.0
        out.append(dubins.sample(dubins.Curve(x, y, th, radius_m, word, *lengths), spacing_m)[1:])
    return np.concatenate(out)
