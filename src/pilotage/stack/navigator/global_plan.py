"""The global plan: asked for, smoothed, adopted, and measured progress on."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray, Goal, Pose2
from pilotage.kernels.geometry import plane
from pilotage.kernels.rrt import hybrid
from pilotage.maps.distance_field import DistanceField
from pilotage.maps.ground_distance import with_circles
from pilotage.maps.world_map import WorldMap
from pilotage.models.footprint import Footprint
from pilotage.stack.interface import PlannedPath
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.navigator.detours import AS_FAR_AS_IT_TAKES, Detours
from pilotage.stack.navigator.doubtful_gap import doubtful_gap, is_tight
from pilotage.stack.navigator.progress import PathProgress
from pilotage.stack.planning.outline import car_of, ground_of
from pilotage.stack.planning.plan_status import PlanStatus
from pilotage.stack.planning.planner import (
    Path,
    Planner,
    PlanRequest,
    PlanResult,
    Smoother,
    outline_clearance_m,
)

HEADINGS, TRIED = 16, 4
"""Headings to turn to before setting out, and how many of them are tried, the freest first."""

WATCH_M = 20.0
"""What is newly mapped is looked for so far ahead on the plan."""
SLACK_M = 0.005
"""Between what a plan keeps and what is checked while driving it."""

FAR_M = 3.0
"""Free ground farther ahead makes a heading no better."""

INSTEAD = " (stack.planner: hybrid-astar plans for outline and arcs)"
"""What does where a path for the centre does not."""
AROUND = ", as the disc around the robot has it (navigator maneuver with hybrid-astar drives its outline)"
"""Where a polygon might fit that its disc does not."""
BESIDE_M = 0.05
"""An outline that is driven along a path keeps this from walls, or what the path keeps where that is less."""


class _Found(NamedTuple):
    """A path, what the planner said of it, and the clearance at which it was found."""

    result: PlanResult
    path: Path
    clearance_m: float


class GlobalPlan:
    """Holds the current path; every plan adopted goes into the journal.

    A robot that can turn on the spot, and that no curve leads on from as it stands, plans from other headings
    of the same place: ``turns_first`` says that the path begins with such a turn.

    ``as_planned`` says that the very path is driven: then its corners are no tighter than the robot can turn,
    and its outline fits all along it, though the planner may know neither. A smoothed path that is not so
    gives way to the planner's own; one that was prescribed is not smoothed. ``too_tight`` says that the last
    path had corners that the robot cannot drive, ``hopeless`` that no other clearance can help.
    """

    def __init__(
        self,
        planner: Planner,
        smoother: Smoother | None,
        chart: WorldMap,
        rng: np.random.Generator,
        journal: Journal,
        least_clearance_m: float = 0.0,
        robot: RobotKnowledge | None = None,
        can_turn_first: bool = False,
        as_planned: bool = False,
    ) -> None:
        self._robot = robot
        self._as_planned = as_planned
        self.too_tight, self.hopeless = False, False
        self._can_turn_first = can_turn_first
        self.turns_first = False
        self._least_clearance_m = least_clearance_m
        self._planner = planner
        self.takes_long = getattr(planner, "TAKES_LONG", False)
        self.turns_on_the_spot = as_planned and getattr(planner, "TURNS_ON_THE_SPOT", False)
        least_m = 0.0 if robot is None else robot.motion.least_turning_radius_m
        if self.turns_on_the_spot and least_m > 0.0:
            raise InputError(
                "planner: expected a motion that turns on the spot, as the planned path does at its "
                f"corners, found one that turns in {least_m:.2f} m at least; take robot.motion.name: "
                "differential-drive"
            )
        outline = None if robot is None else robot.footprint
        self._beside_m = outline_clearance_m(planner, outline, as_planned)
        self._smoother = smoother
        self._chart = chart
        self._journal = journal
        self._rng = rng
        self.path: Path | None = None
        self.progress: PathProgress | None = None
        self.circles_m: FloatArray = chart.barriers.circles_m
        self._looked_at: FloatArray | None = None
        self._trail: FloatArray | None = None
        self._unsure_m = 0.0

    @property
    def clearance_m(self) -> float:
        """What the planner keeps of its own accord; from the centre at least what the body needs."""
        if self._beside_m is not None:
            return self._beside_m
        turning_m = self._robot.radius_m if self.turns_on_the_spot and self._robot is not None else 0.0
        return max(self._planner.clearance_m, self._least_clearance_m, turning_m)

    @property
    def beside_outline(self) -> bool:
        """Whether that is kept beside the robot's outline, and not from its centre."""
        return self._beside_m is not None

    @property
    def disc_radius_m(self) -> float:
        """Of the disc around the centre that keeps the clearance: an outline's inner disc, or a point."""
        if self._robot is None or not self.beside_outline:
            return 0.0
        return self._robot.footprint.inner_radius_m

    def make(
        self,
        t_s: float,
        start: Pose2,
        goal: Goal,
        mapped_m: FloatArray,
        clearances_m: Sequence[float],
        detours: Detours = AS_FAR_AS_IT_TAKES,
        trail: FloatArray | None = None,
        rest: bool = False,
        unsure_m: float = 0.0,
    ) -> PlanResult:
        """Plan on the map with what was found on it, at the first clearance that gives a path; adopt it.

        ``trail`` (N, 3) is what was driven of a path that covers something; where a ``rest`` of that is asked
        for and there is none, the path before stays. One of the later clearances is taken where it saves more
        than the ``detours`` to which it leads. ``unsure_m`` is how well the start is known. Returns the last
        result; its path is None where no clearance gave one.
        """
        begin = time.perf_counter()
        self._looked_at, self._trail, self._unsure_m = mapped_m, trail, unsure_m
        field = with_circles(self._chart.field, mapped_m)
        result, found = self._search(start, goal, field, mapped_m, clearances_m, detours)
        self.turns_first = False
        if result.status is PlanStatus.NO_PATH and result.iterations and self._can_turn_first:
            for heading_rad in _free_headings(field, start, clearances_m[-1]):
                turned = Pose2(start.x_m, start.y_m, heading_rad)
                _, found = self._search(turned, goal, field, mapped_m, clearances_m, detours)
                if found is not None:
                    self.turns_first = True
                    break
        if found is not None and detours.hidden_m > 0.0 and len(mapped_m):
            found = self._rather_around(found, start, goal, mapped_m, clearances_m, detours)
        if found is not None:
            result = found.result
        if found is not None and (result.covers or not rest):
            self._adopt(t_s, found, time.perf_counter() - begin, field.circles_m)
        self._journal.planning_time_s += time.perf_counter() - begin
        return result

    def is_blocked(self, mapped_m: FloatArray, least_m: float) -> bool:
        """Whether what was mapped since the last look comes nearer to the path ahead than ``least_m``.

        Nor nearer than the plan itself keeps. ``mapped_m``: discs (N, 3), a new array where they changed.
        """
        looked = self._looked_at
        if mapped_m is looked or not len(mapped_m) or self.path is None or self.progress is None:
            return False
        self._looked_at = new = mapped_m
        if looked is not None and np.array_equal(mapped_m[: len(looked)], looked):
            new = mapped_m[len(looked) :]
        ahead = self.path.states[self.progress.index(0.0) : self.progress.index(WATCH_M), :2]
        least_m = min(least_m, self.progress.clearance_m - SLACK_M)
        return bool(plane.least_distance(ahead, plane.NO_SEGMENTS, new) < least_m)

    def _search(
        self,
        start: Pose2,
        goal: Goal,
        field: DistanceField,
        mapped_m: FloatArray,
        clearances_m: Sequence[float],
        detours: Detours,
    ) -> tuple[PlanResult, _Found | None]:
        """Plan at the first clearance that gives a path, or at one that saves a detour.

        No path is shorter than at the last clearance: what is that short already needs no other.
        """
        last: tuple[PlanResult, Path | None] | None = None
        enough_m = math.inf
        if detours.wider_m < math.inf and len(clearances_m) > 1:
            last = self._at(start, goal, field, clearances_m[-1])
            if last[1] is None:
                return last[0], None
            enough_m = last[1].length_m + detours.wider_m
        found: _Found | None = None
        no_better_m = -math.inf
        for clearance_m in clearances_m:
            if clearance_m <= no_better_m:
                continue
            at_last = last if clearance_m == clearances_m[-1] else None
            result, path = at_last or self._at(start, goal, field, clearance_m)
            if path is None:
                if self.hopeless:
                    no_better_m = clearance_m
                continue
            if found is None or self._is_worth(path, found.path, mapped_m, detours):
                found = _Found(result, path, clearance_m)
            if found.path.length_m <= enough_m:
                break
        return result, found

    def _is_worth(self, path: Path, wider: Path, mapped_m: FloatArray, detours: Detours) -> bool:
        """Whether a path that keeps less is so much shorter than one that keeps more."""
        saves_m = wider.length_m - path.length_m
        if not detours.wider_m < saves_m <= detours.wider_m + detours.squeezing_m:
            return saves_m > detours.wider_m
        known, points = self._chart.field, path.states[:, :2]
        return not is_tight(points, mapped_m, known, self._least_clearance_m, detours.tight_m)

    def _rather_around(
        self,
        found: _Found,
        start: Pose2,
        goal: Goal,
        mapped_m: FloatArray,
        clearances_m: Sequence[float],
        detours: Detours,
    ) -> _Found:
        """The path found, or the way around a gap on it that may prove closed, whichever is likely shorter.

        If the gap is closed the robot finds out before it, and goes around from there. Ways around are those
        that stay open however far what is hidden reaches.
        """
        known, points = self._chart.field, found.path.states[:, :2]
        gap = doubtful_gap(points, mapped_m, known, self._least_clearance_m, detours.hidden_m)
        if gap is None or gap.before_m < detours.look_m:
            return found
        thicker_m = mapped_m + np.array([0.0, 0.0, detours.hidden_m])
        field = with_circles(known, thicker_m)
        _, around = self._search(start, goal, field, thicker_m, clearances_m, detours)
        if around is None or around.path.length_m <= found.path.length_m:
            return found
        there = Pose2.from_array(found.path.states[gap.before])
        _, back = self._search(there, goal, field, thicker_m, clearances_m, detours)
        if back is None:
            return found
        if_closed_m = gap.before_m + back.path.length_m
        likely_m = gap.closed * if_closed_m + (1.0 - gap.closed) * found.path.length_m
        return around if around.path.length_m < likely_m else found

    def _at(
        self, start: Pose2, goal: Goal, field: DistanceField, clearance_m: float
    ) -> tuple[PlanResult, Path | None]:
        """Plan and smooth at one clearance."""
        request = PlanRequest(
            start,
            goal,
            field,
            self._rng,
            clearance_m,
            *self._shape(),
            trail=self._trail,
            beside_outline=self.beside_outline,
            unsure_m=self._unsure_m,
        )
        result = self._planner.plan(request)
        self.too_tight, self.hopeless = False, False
        if result.path is None:
            blocked = result.status in (PlanStatus.START_BLOCKED, PlanStatus.GOAL_BLOCKED)
            if blocked and self._is_taken_for_its_disc(clearance_m):
                result = replace(result, reason=result.reason + AROUND)
            return result, None
        paths = [result.path]
        if self._smoother is not None and not result.given:
            smoothed = self._smoother.smooth(result.path, request, clearance_m)
            if smoothed is not result.path:
                paths.insert(0, smoothed)
        for path in paths:
            why = self._cannot_drive(path, request, clearance_m)
            if not why:
                return result, path
        # Nearer to walls an outline fits no better; curves in place of corners may find more room there.
        self.hopeless = not (self.too_tight and len(paths) > 1)
        return replace(result, status=PlanStatus.NO_PATH, reason=why, path=None), None

    def _is_taken_for_its_disc(self, clearance_m: float) -> bool:
        """Whether the robot is a polygon, and all of the disc around it has to be clear."""
        robot = self._robot
        if robot is None or robot.footprint.is_disc or self.beside_outline:
            return False
        return clearance_m >= robot.radius_m

    def _cannot_drive(self, path: Path, request: PlanRequest, clearance_m: float) -> str:
        """Why the robot cannot drive the very path; nothing where it can, or need not."""
        robot = self._robot
        if not self._as_planned or robot is None:
            return ""
        least_m = robot.motion.least_turning_radius_m
        self.too_tight = path.turning_radius_m < least_m * (1.0 - 1e-9)
        if self.too_tight:
            return f"the path's corners are too tight, the robot turns in {least_m:.2f} m at least{INSTEAD}"
        outline = robot.footprint
        if not self.beside_outline and clearance_m >= outline.radius_m:
            return ""
        # Who plans for outlines vouches for its clearance, but for what may come nearer between two looks.
        beside_m = 0.0 if self.beside_outline else min(BESIDE_M, clearance_m)
        car = car_of(outline, beside_m, 1.0)
        states = np.vstack([request.start.as_array(), path.states])
        if hybrid.path_fits(states, path.turning_radius_m == 0.0, car, ground_of(request.field, car)):
            return ""
        instead = " beside it: it takes more room than there is" if self.beside_outline else INSTEAD
        return f"the robot's outline does not fit along the path, which keeps {clearance_m:.2f} m{instead}"

    def _shape(self) -> tuple[Footprint | None, float]:
        """Outline and tightest arc, where the robot is known."""
        if self._robot is None:
            return None, 0.0
        return self._robot.footprint, self._robot.motion.least_turning_radius_m

    def _adopt(self, t_s: float, found: _Found, planning_s: float, circles_m: FloatArray) -> None:
        path, result, clearance_m = found.path, found.result, found.clearance_m
        self.path = path
        self.progress = PathProgress(path.states, path.waypoints, clearance_m)
        self.circles_m = circles_m
        first = result.first_solution_s if math.isfinite(result.first_solution_s) else planning_s
        self._journal.plans.append(
            PlannedPath(
                t_s,
                path.states,
                path.waypoints,
                result.tree_edges_m,
                path.length_m,
                clearance_m,
                result.given,
                planning_s,
                first,
                None if result.first is None else result.first.waypoints,
                math.nan if result.first is None else result.first.length_m,
                self.disc_radius_m,
            )
        )


def _free_headings(field: DistanceField, start: Pose2, clearance_m: float) -> list[float]:
    """Headings with the most free ground straight ahead, those that differ least from the present first."""
    headings = start.theta_rad + np.linspace(-math.pi, math.pi, HEADINGS, endpoint=False)
    ahead_m = np.arange(0.0, FAR_M, 0.5 * max(field.resolution_m, 0.05))
    free_m = []
    for heading in headings:
        points = np.column_stack(
            [start.x_m + ahead_m * math.cos(heading), start.y_m + ahead_m * math.sin(heading)]
        )
        blocked = np.flatnonzero(field.at(points) < clearance_m)
        free_m.append(float(ahead_m[blocked[0]]) if len(blocked) else FAR_M)
    turn = np.abs(headings - start.theta_rad)
    return [float(headings[k]) for k in np.lexsort((turn, -np.array(free_m)))[:TRIED]]
