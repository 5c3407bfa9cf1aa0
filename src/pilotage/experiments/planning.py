"""One planning query on a map, for a point or an outline."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from pilotage.core.angles import wrap_to_pi
from pilotage.core.errors import InputError
from pilotage.core.random import RandomStreams
from pilotage.core.types import Goal, Pose2
from pilotage.evaluation.shortest_path import shortest_path
from pilotage.experiments.build.charts import load_chart
from pilotage.experiments.rehearsal import rehearsed
from pilotage.experiments.values import parse_override
from pilotage.maps.world_map import WorldMap
from pilotage.models.footprint import Footprint
from pilotage.models.motion.differential_drive import DifferentialDriveConfig
from pilotage.stack.interface import PlannedPath
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.navigator.global_plan import GlobalPlan
from pilotage.stack.planning.planner import PLANNERS, SMOOTHERS, PlanResult

SMOOTHER = "shortcut"


def plan_on_map(
    map_name_or_path: str,
    start: Sequence[float],
    goal: Sequence[float],
    planner: str,
    overrides: Sequence[str] = (),
    seed: int = 0,
    clearance_m: float | None = None,
    footprint: Footprint | None = None,
) -> dict[str, Any]:
    """Plan from ``start`` to ``goal`` (x, y in m and, where given, theta in rad).

    Parameters
    ----------
    overrides
        ``parameter=value`` for the planner, ``smoother.parameter=value`` for the smoother, or
        ``smoother=none`` for the planner's path as it is.
    clearance_m
        Distance to keep from obstacles; None: the planner's own.
    footprint
        The outline that is to fit along the path; None: a point. Planners for outlines keep the clearance
        beside it, others from the centre and no less than its inner radius.

    Returns
    -------
    success, reason, planned_length_m, shortest_length_m (exact, at the same clearance, of a point or of the
    disc inside an outline that keeps it; None of a sweep),
    planning_time_s, first_solution_s, path_nodes and path, a list of [x, y, theta].

    Raises
    ------
    InputError
        Where the map, the planner, a parameter or a place is not what it should be.
    """
    floor = load_chart(map_name_or_path)
    _check_on_map("--start", start, floor)
    _check_on_map("--goal", goal, floor)
    own, smoothing = split_overrides(overrides, "smoother")
    # ``smoother=none`` says its name alone.
    smoother_name = str(own.pop("smoother", smoothing.pop("name", SMOOTHER)))
    config = PLANNERS.configure(planner, own, f"planner '{planner}'")
    smoother_config = SMOOTHERS.configure(smoother_name, smoothing, f"smoother '{smoother_name}'")
    to = Goal(goal[0], goal[1], wrap_to_pi(goal[2]) if len(goal) > 2 else None)
    pose = Pose2(start[0], start[1], wrap_to_pi(start[2]) if len(start) > 2 else 0.0)

    # Its arcs are the planner's own matter: they follow from no motion.
    least_m = 0.0 if footprint is None else footprint.inner_radius_m
    robot = (
        None
        if footprint is None
        else RobotKnowledge(footprint, DifferentialDriveConfig(), {}, 0.1, RandomStreams(seed))
    )

    def ask() -> tuple[GlobalPlan, Journal, float, PlanResult]:
        journal = Journal()
        plan = GlobalPlan(
            PLANNERS.entry(planner).factory(config),
            SMOOTHERS.entry(smoother_name).factory(smoother_config),
            floor,
            RandomStreams(seed).stream("planner"),
            journal,
            least_m,
            robot,
            as_planned=True,
        )
        kept_m = plan.clearance_m if clearance_m is None else clearance_m
        if not plan.beside_outline:
            kept_m = max(kept_m, least_m)
        return plan, journal, kept_m, plan.make(0.0, pose, to, floor.walls.circles_m[:0], (kept_m,))

    plan, journal, kept_m, result = rehearsed((planner, smoother_name), ask)
    answer: dict[str, Any] = {
        "success": result.path is not None,
        "reason": _reason(result, journal.plans[-1] if journal.plans else None),
        "planner": planner,
        "seed": seed,
        "clearance_m": kept_m,
        "iterations": result.iterations,
    }
    if plan.path is None:
        return answer
    adopted = journal.plans[-1]
    shortest = None
    if not result.given:
        ends = (start[0], start[1]), (goal[0], goal[1])
        shortest = shortest_path(floor.walls, *ends, kept_m + plan.disc_radius_m)
    answer |= {
        "planned_length_m": adopted.length_m,
        "shortest_length_m": None if shortest is None else shortest.length_m,
        "planning_time_s": adopted.planning_time_s,
        "first_solution_s": adopted.first_solution_s,
        "path_nodes": int(adopted.waypoints.shape[0]),
        "path": adopted.states.tolist(),
    }
    return answer


def _reason(result: PlanResult, planned: PlannedPath | None) -> str:
    """How it ended; of a path its length as it is handed out, and what it was before smoothing."""
    if planned is None or result.path is None or result.given:
        return str(result.status) if not result.reason else f"{result.status}: {result.reason}"
    length = f"{planned.length_m:.2f} m"
    before = f"{result.path.length_m:.2f} m"
    smoothed = "" if length == before else f", smoothed from {before}"
    return f"{result.status}: {length} after {result.iterations} iterations{smoothed}"


def split_overrides(overrides: Sequence[str], other: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """Sort overrides into the planner's parameters, which may be told alone, and those of ``other``."""
    own: dict[str, Any] = {}
    others: dict[str, Any] = {}
    for override in overrides:
        parts, value = parse_override(override)
        if parts[:2] in (["stack", "planner"], ["stack", "smoother"]):
            parts = parts[1:]
        if parts[0] == other and len(parts) == 2:
            others[parts[1]] = value
        elif parts[0] == "planner" and len(parts) == 2:
            own[parts[1]] = value
        elif len(parts) == 1:
            own[parts[0]] = value
        else:
            raise InputError(f"--set '{override}': expected a parameter of the planner, or {other}.PARAMETER")
    return own, others


def _check_on_map(option: str, place: Sequence[float], floor: WorldMap) -> None:
    if not floor.contains(place[0], place[1]):
        xmin, ymin, xmax, ymax = floor.bounds_m
        raise InputError(
            f"{option}: expected a place on the map '{floor.name}' ({xmin:g} to {xmax:g}, "
            f"{ymin:g} to {ymax:g} m), found ({place[0]:g}, {place[1]:g})"
        )
