"""The explorer that finishes: it goes on until no reachable cell is left, and says why the others were."""

from __future__ import annotations

import math
from enum import StrEnum
from typing import ClassVar

from pilotage.core.types import STANDSTILL, BoolArray, FloatArray, IntArray, WheelSpeeds
from pilotage.maps.cell_map import CellMap, CellState
from pilotage.maps.world_map import WorldMap
from pilotage.sensors.readings import Readings
from pilotage.stack.control.waypoint_drive import WaypointDrive
from pilotage.stack.control.wheel_pursuit import wheel_speeds
from pilotage.stack.exploration.explorer import LeftCell, offer
from pilotage.stack.exploration.frontier_config import FrontierConfig
from pilotage.stack.exploration.frontier_goals import DEEP_M, Cell, Goals
from pilotage.stack.exploration.frontier_ground import Ground
from pilotage.stack.exploration.frontier_inspections import Inspections
from pilotage.stack.exploration.frontier_reasons import reasons, summary
from pilotage.stack.exploration.frontier_retreat import is_walled_in, trail_back
from pilotage.stack.exploration.frontier_returns import Look, best_look
from pilotage.stack.exploration.frontier_senses import Senses
from pilotage.stack.exploration.sheet_features import cell_map, line_cells, obstacle_cells, tape_ends
from pilotage.stack.interface import NAVIGATORS, Belief, StackStatus
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge, SheetKnowledge, TaskKnowledge
from pilotage.stack.planning.sheet_room import Point, SheetRoom

BACK_SPEED_M_S, BACK_S, BACK_ROOM_M = 0.035, 0.5, 0.006
RETREATS = 5
"""How often, at most, it leaves a place that its map has closed."""


class Doing(StrEnum):
    """What it is about."""

    REST = "rest"
    GO = "go"
    LOOK = "look"
    BACK = "back"
    DONE = "done"


@NAVIGATORS.add("frontier", FrontierConfig)
class FrontierExplorer:
    """Visits every cell it can, nearest and most telling first, on a map and a pose that correct each other.

    Goals are unvisited cells at the frontier of what was visited, chosen by travel cost and information
    gain (Yamauchi 1997; Burgard and others 2005); paths are planned on the map as it grows, unknown floor
    being taken for free. When the position becomes unsure it returns to a landmark. The pose comes from
    ``SheetSmoother``; at the end the whole run is smoothed once more, cells whose visit then proves
    doubtful are visited again, and only when none is left is it done.
    Ignores the firmware switches: it counts encoders itself. With a floor plan its ways are planned on that,
    and it looks for no tape's end.
    """

    CHOOSES_PLACES: ClassVar[bool] = True
    TAKES: ClassVar = frozenset({"pose", "plan"})

    def __init__(
        self,
        config: FrontierConfig,
        robot: RobotKnowledge,
        chart: WorldMap,
        task: TaskKnowledge,
        parts: object,
        journal: Journal,
    ) -> None:
        del parts  # it brings its own
        knowledge = SheetKnowledge.of(robot, chart, task, config, "frontier")
        self._journal = journal
        offer(journal, self)
        self._channel = journal.channel(
            {"goal_x_m": "m", "goal_y_m": "m", "position_std_m": "m", "landmarks": "1"}
        )
        self._config, self._avoidance = config, knowledge.avoidance
        self._hardware = knowledge.drive
        self._tape_width_m, self._plan = knowledge.tape_width_m, knowledge.given.plan
        self._senses = Senses(config, knowledge)
        self._smoother, self._grid = self._senses.smoother, self._senses.grid
        shape = self._grid.shape
        room = SheetRoom(shape, knowledge.body_radius_m, config.room_m, config.wide_m)
        self._ground = Ground(self._senses, room)
        self._goals = Goals(config, self._grid, self._ground)
        self._driver = WaypointDrive(
            knowledge.drive, config.speed_share, config.turn_rate_rad_s, config.stuck_s
        )
        self._doing, self._until_s = Doing.REST, config.first_rest_s
        self._rested_s = self._looked_s = 0.0
        self._goal: Cell | None = None
        self._reviews = self._retreats = 0
        self._inspections = Inspections(config.tape_end_m, config.inspections)
        self._left: tuple[LeftCell, ...] = ()
        self._status, self._reason = StackStatus.RUNNING, ""

    # --- what others ask ----------------------------------------------------------------------------

    @property
    def belief(self) -> Belief:
        """Pose by the smoother."""
        return self._smoother.belief

    @property
    def status(self) -> tuple[StackStatus, str]:
        """Arrived once no reachable cell is left."""
        return self._status, self._reason

    @property
    def cells(self) -> CellMap:
        """The map as it would be printed now."""
        shape, landmarks = self._grid.shape, self._smoother.map
        if self._plan is not None:
            features = self._plan.features
            return cell_map(self._grid, features.holds(CellState.OBSTACLE), features.holds(CellState.LINE))
        lines = line_cells(landmarks, self._senses.floor_samples(), self._tape_width_m, shape)
        return cell_map(self._grid, obstacle_cells(landmarks, shape), lines)

    @property
    def visited(self) -> BoolArray:
        """Cells that the smoothed path leads through."""
        return self._grid.visited

    @property
    def left(self) -> tuple[LeftCell, ...]:
        """Cells not visited, with reasons, once it is done."""
        return self._left

    # --- one control period -------------------------------------------------------------------------

    def step(self, readings: Readings) -> WheelSpeeds:
        """Sense, decide where nothing is under way, drive."""
        command = self._step(readings)
        # How sure of the position, where it is going, and what it has put on the map.
        x, y = self._driver.waypoints[-1] if self._driver.waypoints else (math.nan, math.nan)
        self._channel.tell(x, y, self._smoother.position_std_m, float(self._smoother.map.count))
        return command

    def _step(self, readings: Readings) -> WheelSpeeds:
        if self._doing is Doing.DONE:
            return STANDSTILL
        t_s = readings.t_s
        if self._senses.step(readings):
            self._keep_up(t_s)
        if self._doing is Doing.REST:
            if t_s < self._until_s:
                return STANDSTILL
            self._solve()
            self._decide(t_s)
        elif self._doing is Doing.BACK:
            if t_s < self._until_s:
                return wheel_speeds(-BACK_SPEED_M_S, 0.0, self._hardware)
            self._decide(t_s)
        if self._doing not in (Doing.GO, Doing.LOOK):
            return STANDSTILL
        command = self._driver.step(self._smoother.keyframes.pose, t_s)
        if not self._driver.waypoints:
            self._arrive(t_s)
            return STANDSTILL if not self._driver.waypoints else command
        if self._driver.is_stuck(t_s):
            self._fail(t_s, "stuck", "no nearer to the next waypoint")
            self._back_off(t_s)
            return STANDSTILL
        return command

    def _keep_up(self, t_s: float) -> None:
        """After beams and line sensors spoke: solve in time, look whether the path is still free."""
        if self._driver.moves_ahead and self._senses.is_over_edge():
            self._back_from_edge(t_s)
            return
        if self._goal is not None and self._grid.depth_m[self._goal] >= DEEP_M:
            self._decide(t_s)
        age_s = self._smoother.keyframes.t_s - self._smoother.solved_s
        if age_s > self._config.solve_every_s and (self._smoother.has_news or age_s > 10.0):
            self._solve()
            if self._driver.waypoints and not self._way_is_free():
                self._decide(t_s)
        if self._avoidance and self._driver.moves_ahead and self._in_the_way():
            self._solve()
            self._ground.refresh()
            self._fail(t_s, "stopped", "something stands in the way")
            self._decide(t_s)

    def _back_from_edge(self, t_s: float) -> None:
        """Both line sensors are over the sheet's edge: turn back, whatever the pose says."""
        if self._doing is not Doing.LOOK:
            self._fail(t_s, "edge", "the sheet's edge came sooner than expected")
        self._driver.stop()
        self._solve()
        self._looked_s = t_s
        self._back_off(t_s)

    def _back_off(self, t_s: float) -> None:
        """Drive back a little, where there is room behind."""
        self._ground.refresh()
        x, y, theta = self._smoother.keyframes.pose
        back_m = BACK_SPEED_M_S * BACK_S
        behind = x - back_m * math.cos(theta), y - back_m * math.sin(theta)
        self._doing = Doing.BACK
        self._until_s = t_s + (BACK_S if self._ground.room.clear((x, y), behind) > BACK_ROOM_M else 0.0)

    def _solve(self, steps: int = 1, anew: bool = False) -> None:
        """Smooth, and bring the map up to date."""
        before = self._smoother.keyframes.pose
        self._smoother.solve(steps)
        after = self._smoother.keyframes.pose
        self._senses.recent.shift(after[0] - before[0], after[1] - before[1])
        poses = self._smoother.keyframes.poses[: self._smoother.keyframes.count]
        if anew or self._smoother.solves % self._config.gather_every_solves == 0:
            self._grid.gather_anew(poses)
        else:
            self._grid.gather(poses)
        self._ground.age()

    def _way_is_free(self) -> bool:
        """Whether the next pieces of the path keep their room, by the map as it is now."""
        self._ground.refresh()
        x, y, _ = self._smoother.keyframes.pose
        return self._ground.way_is_free((x, y), self._driver.waypoints)

    def _in_the_way(self) -> bool:
        """Whether something stands close before the body; where little room is left it drives carefully."""
        x, y, _ = self._smoother.keyframes.pose
        in_the_way, self._driver.is_careful = self._ground.look_ahead((x, y), self._driver.waypoints[0])
        return in_the_way

    # --- deciding -----------------------------------------------------------------------------------

    def _decide(self, t_s: float) -> None:
        """Rest, return to a landmark, visit a cell, or end."""
        self._driver.stop()
        self._goal = None
        c = self._config
        if t_s - self._rested_s > c.rest_every_s and c.rest_s > 0.0:
            self._doing, self._until_s, self._rested_s = Doing.REST, t_s + c.rest_s, t_s
            return
        self._ground.refresh()
        x, y, _ = pose = self._smoother.keyframes.pose
        cost, parent = self._ground.room.costs(x, y)
        unsure = self._smoother.position_std_m > c.return_std_m
        if unsure and t_s - self._looked_s > c.return_pause_s:
            self._looked_s = t_s
            look = best_look(
                self._smoother.map,
                self._smoother.cov[:2, :2],
                self._ground.room,
                cost,
                (x, y),
                self._senses.sensors_ahead_m,
            )
            if look is not None:
                self._look(look, (x, y), parent, t_s)
                return
        if not self._choose(pose, cost, parent, t_s) and not self._inspect((x, y), cost, parent, t_s):
            self._review(t_s)

    def _look(self, look: Look, here: Point, parent: IntArray, t_s: float) -> None:
        """Set out to see a landmark."""
        path = [*self._ground.room.path(parent, look.node, here, look.begin), look.end]
        if look.back:
            path.append(look.begin)
        self._doing = Doing.LOOK
        self._driver.follow(path, t_s, slow_at_end=True, back=look.back)

    def _inspect(self, here: Point, cost: FloatArray, parent: IntArray, t_s: float) -> bool:
        """Set out to see where a tape ends; False where that is known of all."""
        if self._plan is not None:
            return False
        self._solve()
        ends = tape_ends(self._smoother.map, self._senses.floor_samples(), self._tape_width_m)
        look = self._inspections.next_look(
            self._smoother.map,
            ends,
            self._senses.loose_crossings(),
            self._ground.room,
            cost,
            self._senses.sensors_ahead_m,
        )
        if look is None:
            return False
        self._look(look, here, parent, t_s)
        return True

    def _choose(
        self, pose: tuple[float, float, float], cost: FloatArray, parent: IntArray, t_s: float
    ) -> bool:
        """Set out for the best goal; False where none can be reached."""
        goal = self._goals.choose(pose, cost, parent, self._smoother.position_std_m)
        if goal is None:
            return False
        self._goal = goal.cell
        self._doing = Doing.GO
        self._driver.follow(goal.path, t_s, slow_at_end=goal.is_shallow)
        return True

    def _arrive(self, t_s: float) -> None:
        """At the last waypoint."""
        if self._doing is Doing.LOOK:
            self._looked_s = t_s
            self._solve()
        elif self._goal is not None and not self._goals.settled(self._smoother.position_std_m)[self._goal]:
            self._goals.tries[self._goal] += 1
        self._decide(t_s)

    def _fail(self, t_s: float, kind: str, text: str) -> None:
        """Note that the way to the goal did not work out."""
        if self._goal is not None:
            self._goals.tries[self._goal] += 1
            text = f"{text}, on the way to column {self._goal[1]}, row {self._goal[0]}"
        self._journal.say(t_s, kind, text)
        self._driver.stop()

    def _review(self, t_s: float) -> None:
        """Nothing is left by what is known: smooth the whole run, look again, or end."""
        self._solve(steps=3, anew=True)
        self._ground.refresh()
        self._reviews += 1
        self._goals.is_review = True
        x, y, _ = pose = self._smoother.keyframes.pose
        cost, parent = self._ground.room.costs(x, y)
        found = self._reviews <= self._config.reviews and self._choose(pose, cost, parent, t_s)
        if not found and not self._senses.doubts_strays:
            # Strays beside a wall must not close a gap for good.
            self._senses.doubts_strays = True
            self._ground.age()
            self._ground.refresh()
            cost, parent = self._ground.room.costs(x, y)
            found = self._choose(pose, cost, parent, t_s)
        if not found and self._retreat(cost, t_s):
            return
        if found:
            missed = self._goals.missed(self._smoother.position_std_m)
            self._journal.say(t_s, "review", f"the whole run smoothed; {missed} cells to see again")
            return
        self._left = reasons(
            ~self.visited,
            self.cells.holds(CellState.OBSTACLE),
            self._goals.given_up(),
            self._ground.room,
            cost,
        )
        self._doing, self._status = Doing.DONE, StackStatus.ARRIVED
        self._driver.stop()
        count = int(self.visited.sum())
        self._reason = f"done: {count} cells visited, {len(self._left)} left ({summary(self._left)})"
        self._journal.say(t_s, "arrived", self._reason)

    def _retreat(self, cost: FloatArray, t_s: float) -> bool:
        """Set out back along the trail where the map closes the robot in; False where it does not."""
        path = trail_back(self._smoother.keyframes.poses[: self._smoother.keyframes.count])
        if self._retreats >= RETREATS or not path or not is_walled_in(self._ground.room, cost, self.visited):
            return False
        self._retreats += 1
        self._journal.say(t_s, "retreat", "the map leaves no way out: back along its own trail")
        self._doing = Doing.LOOK
        self._driver.follow(path, t_s, slow_at_end=True)
        # Nothing was looked at again: that review is still to come.
        self._reviews -= 1
        self._goals.is_review = self._reviews > 0
        return True
