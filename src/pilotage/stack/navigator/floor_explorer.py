"""The navigator that explores a floor: from frontier to frontier, and back to where it began."""

from __future__ import annotations

import math
from enum import StrEnum
from typing import ClassVar

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.types import STOP, FloatArray, Pose2, Twist
from pilotage.maps.occupancy_grid import OccupancyGrid
from pilotage.maps.world_map import WorldMap
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.readings import LidarScan, Readings
from pilotage.stack.control.last_word import LastWord
from pilotage.stack.control.local.drive import LocalDrive
from pilotage.stack.exploration.floor_frontiers import SeenFloor
from pilotage.stack.interface import NAVIGATORS, Belief, BeliefStatus, StackStatus
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge, TaskKnowledge
from pilotage.stack.localization.localizer import Abilities
from pilotage.stack.mapping.scan_grid import ScanGrid, echoes
from pilotage.stack.navigator.floor_explorer_config import FloorExplorerConfig
from pilotage.stack.navigator.frontier_targets import SAME_M, UNSURE_M, Target, Targets
from pilotage.stack.navigator.getting_on import STALL_M, GettingOn
from pilotage.stack.navigator.navigator import LocalizingNavigator, Parts, localizer_of
from pilotage.stack.navigator.progress import patience_s

HOME_STALLS = 6
"""So many times its patience ends on its way back before it gives up: there is no other place to go to, and a
local controller tries three times for 25 s to get through a gap."""
AHEAD_M = 2.5
"""The local controller is led by a point so far ahead on the path."""
SHY_SHARE = 1.0 / 3.0
"""Where it got no farther for this share of its patience it is led along the path itself: by a point that a
line with room leads to, not by one around a corner, straight to which a gap may be too narrow for it."""
ROOM_M = 1.0
"""A frontier this long is the edge of a room, not a shadow: worth a gap that its body alone takes."""
COUNTS = ("frontiers_seen", "frontiers_left", "frontiers_given_up", "loops_sought")
LOST_TRIES = 4
"""Places that it knew well it goes back to where it is lost; then it goes by what it believes."""
RETURNS = 4
"""How often it checks, with loops closed anew, that it truly stands where it began."""


class Doing(StrEnum):
    """What it is about."""

    EXPLORE = "explore"
    CLOSE = "close"
    RETURN = "return"
    DONE = "done"


@NAVIGATORS.add("floor-frontier", FloorExplorerConfig)
class FloorExplorer(LocalizingNavigator):
    """Explores a floor with a laser scanner until no frontier is left that it can look at.

    Goes to the nearest frontier (Yamauchi, 1997), long ones a little sooner; paths are planned over seen free
    floor, and driven by the local controller, which sees what is near by itself. Where its position becomes
    unsure it goes back to the place that it knows best, for the localizer to close a loop there (active
    loop closing: Stachniss, Haehnel and Burgard, 2004). In the end it returns to its start.

    The map is the localizer's where that makes one (``slam``), else it is drawn from scans at the poses that
    the localizer tells; with the oracle ``localizer`` that is exploration with a perfect pose.

    A frontier is looked at from near it first. One that stays (the edge of a shadow, beside a door post) and
    that the robot fits through is driven to, and given up only where it stood on it, or got no nearer. One
    that is too narrow is given up when it was looked at. What is given up is said, with the reason.

    Frontiers with walls in sight come first, and rooms that are seen through gaps without room for its
    clearance last, by paths that its body takes.
    """

    CHOOSES_PLACES: ClassVar[bool] = True

    def __init__(
        self,
        config: FloorExplorerConfig,
        robot: RobotKnowledge,
        chart: WorldMap,
        task: TaskKnowledge,
        parts: Parts,
        journal: Journal,
    ) -> None:
        del chart  # it knows nothing of the floor
        if parts.local_controller is None:
            raise InputError("navigator 'floor-frontier': expected stack.local_controller, found none")
        super().__init__(localizer_of(parts, "floor-frontier"), journal)
        self._config = config
        self._lidar, self._scanner = robot.one_sensor(LidarConfig, "navigator 'floor-frontier'")
        self._drive = LocalDrive(
            parts.local_controller,
            robot,
            task.initial.pose,
            reverse_m_s=config.reverse_m_s,
            needed_by="navigator 'floor-frontier'",
        )
        self._last_word = LastWord(robot)
        self._stall_s = patience_s(config.stall_s, STALL_M, robot.motion.top_speed_m_s)
        self._radius_m, self._clearance_m = robot.radius_m, robot.radius_m + config.clearance_m
        self._squeeze_m = min(config.squeeze_m, config.clearance_m)
        # A frontier no longer than the robot is wide is one that a small robot fits through.
        self._least_m = min(config.least_frontier_m, 2.0 * self._clearance_m)
        self._able = Abilities.of(self._localizer)
        own = self._able.scan_grid
        self._draws = own is None
        self._grid: ScanGrid = ScanGrid(self._scanner, config.resolution_m) if own is None else own
        mount = self._scanner.mount
        self._mount = mount.pose
        start = task.initial.pose
        self._start = np.array([start.x_m, start.y_m])
        self._doing, self._target = Doing.EXPLORE, None
        self._targets = Targets(config, self._scanner.max_range_m)
        self._sure_m, self._checked, self._searched = 0.0, 0, 0
        self._planned_s = -math.inf
        self._getting_on = GettingOn(self._start, robot.motion.top_speed_m_s)
        self._stalled_at: FloatArray | None = None
        self._floor: SeenFloor | None = None
        self._frontiers, self._squeezing = 0, False
        journal.result("grid", self._left)
        journal.counts |= dict.fromkeys(COUNTS, 0)
        self._channel = journal.channel(
            {"goal_x_m": "m", "goal_y_m": "m", "frontiers": "1", "position_std_m": "m"}, first=True
        )

    _target: Target | None

    def _left(self) -> OccupancyGrid:
        side_m = self._config.map_resolution_m
        return self._grid.grid() if side_m is None else self._grid.drawn(side_m)

    def step(self, readings: Readings) -> Twist:
        """Localize, look whether there is something better to do, and drive."""
        belief = self._localizer.step(readings)
        self._drive.move(readings)
        self._last_word.take_in(readings)
        if self._draws:
            self._draw(readings, belief.pose)
        return self._last_word.leaving(self._command(readings, belief))

    def _command(self, readings: Readings, belief: Belief) -> Twist:
        if self._status is not StackStatus.RUNNING or not len(self._grid.poses):
            return STOP
        here = np.array([belief.pose.x_m, belief.pose.y_m])
        if readings.t_s - self._planned_s >= self._config.replan_s or self._there(here):
            self._planned_s = readings.t_s
            self._decide(readings.t_s, belief, here)
        target = self._target
        goal = (math.nan, math.nan) if target is None else (float(target.xy_m[0]), float(target.xy_m[1]))
        self._channel.tell(*goal, float(self._frontiers), belief.std_m)
        if target is None:
            return STOP
        tolerance_m = 0.5 * self._arrival_m()
        command = self._drive.toward(self._led_to(target.path, here), belief, readings, tolerance_m)
        return command if self._last_word.allows(command) else STOP

    def _draw(self, readings: Readings, pose: Pose2) -> None:
        """Put a scan on the own map where the robot has moved since the last one."""
        scan = readings.by_sensor.get(self._lidar)
        if not isinstance(scan, LidarScan):
            return
        at = pose.compose(self._mount).as_array()
        if len(self._grid.poses):
            off = at - self._grid.poses[-1]
            turn = abs((off[2] + math.pi) % (2.0 * math.pi) - math.pi)
            if np.hypot(off[0], off[1]) < self._config.keyframe_m and turn < self._config.keyframe_rad:
                return
        self._grid.add(echoes(scan.ranges_m, self._scanner), at)

    # --- deciding -----------------------------------------------------------------------------------

    def _arrival_m(self) -> float:
        if self._doing is Doing.RETURN:
            return self._config.arrival_m
        crossing = self._target is not None and self._target.crossing
        return self._config.cross_m if crossing else self._config.look_m

    def _there(self, here: FloatArray) -> bool:
        target = self._target
        return target is not None and float(np.hypot(*(target.xy_m - here))) < self._arrival_m()

    def _decide(self, t_s: float, belief: Belief, here: FloatArray) -> None:
        """Choose what to do, and where to go for it."""
        squeezing, self._squeezing = self._squeezing, False
        self._floor = floor = self._seen(here)
        self._watch(t_s, here)
        if self._doing is Doing.RETURN:
            self._come_back(t_s, floor, here)
            return
        lost = self._is_lost(belief)
        if self._target is not None and self._doing is Doing.EXPLORE and self._there(here):
            self._met(self._target)
        found, widest = self._targets.worth_it(floor, belief.pose, here, self._least_m), floor
        if not found:
            # Rooms may be left behind gaps that only its body fits through.
            widest = self._floor_at(self._radius_m + self._squeeze_m, here, self._grid.wall_points())
            # What it looks at from before the gap shrinks, and may be short then.
            least_m = self._least_m if squeezing else max(ROOM_M, self._least_m)
            found = self._targets.worth_it(widest, belief.pose, here, least_m)
            self._floor = floor = widest if found else floor
            self._squeezing = bool(found)
        self._frontiers = len(found)
        if self._doing is Doing.CLOSE and self._still_unsure(belief, here):
            self._go(floor, self._target)
        elif (lost or self._is_unsure(belief)) and self._go_closing(t_s, floor, here):
            self._searched += int(lost)
            self._journal.count("loops_sought")
        elif found:
            self._go_exploring(floor, found, here)
        else:
            self._set_out_home(t_s, floor, widest, here)

    def _seen(self, here: FloatArray) -> SeenFloor:
        """What it has seen; where it came too near to walls to be led back, by what the body alone takes.

        A wall on the map may be a cell off: that much less is the last try.
        """
        first = self._floor_at(self._clearance_m, here)
        if math.isfinite(first.cost_to(self._start)):
            return first
        body_m, walls_m = self._radius_m, self._grid.wall_points()
        # Where it squeezed in it can squeeze out again.
        for clearance_m in (body_m + self._squeeze_m, body_m, body_m - self._grid.resolution_m):
            floor = self._floor_at(clearance_m, here, walls_m)
            if math.isfinite(floor.cost_to(self._start)):
                return floor
        return first

    def _floor_at(self, clearance_m: float, here: FloatArray, walls_m: FloatArray | None = None) -> SeenFloor:
        """What it has seen, for paths that keep a clearance; from points of walls where a gap is narrow."""
        grid = self._grid
        return SeenFloor(grid.states, grid.corner_xy_m, grid.resolution_m, clearance_m, here, walls_m)

    def _met(self, target: Target) -> None:
        """It stands where it was to go."""
        self._targets.met(target)
        if not target.crossing:
            self._journal.count("frontiers_seen")

    def _failed_to_reach(self, target: Target) -> None:
        """It cannot get to a target."""
        if self._doing is Doing.EXPLORE:
            self._targets.failed(target)

    def _go_exploring(self, floor: SeenFloor, found: list[Target], here: FloatArray) -> None:
        """To the best frontier, or on to the one it is under way to while that is about as good."""
        best, now = found[0], self._target
        if now is not None and self._doing is Doing.EXPLORE and not self._there(here):
            away = [float(np.hypot(*(other.frontier_xy_m - now.frontier_xy_m))) for other in found]
            same = found[int(np.argmin(away))]
            if min(away) < 2.0 * SAME_M and same.score < best.score + self._config.switch_m:
                best = same
        self._doing = Doing.EXPLORE
        self._go(floor, best)

    def _go(self, floor: SeenFloor, target: Target | None) -> None:
        """Take the path to a target; without one the target is given up."""
        self._target = target
        if target is None:
            return
        target.path = floor.path_to(target.xy_m)
        if len(target.path) == 0:
            self._failed_to_reach(target)
            self._target = None

    # --- closing loops ------------------------------------------------------------------------------

    def _is_unsure(self, belief: Belief) -> bool:
        return belief.std_m > self._config.unsure_m + self._sure_m

    def _is_lost(self, belief: Belief) -> bool:
        """Whether its scans fit nowhere, and places are left to find its way again from.

        It gives up where it was going: with nothing in sight that it knows it maps nothing there. Who stands
        still sees nothing else, and stays lost.
        """
        if belief.status is not BeliefStatus.LOST:
            self._searched = 0
            return False
        if self._target is not None and self._doing is Doing.EXPLORE:
            self._targets.failed(self._target, UNSURE_M)
            self._target = None
        return self._searched < LOST_TRIES

    def _still_unsure(self, belief: Belief, here: FloatArray) -> bool:
        """Whether to go on to where a loop may close."""
        sure = belief.std_m < 0.5 * (self._config.unsure_m + self._sure_m)
        if self._target is None or (sure and belief.status is not BeliefStatus.LOST):
            return False
        if not self._there(here):
            return True
        # It is there: what it is unsure by now cannot be helped.
        self._sure_m = belief.std_m
        return False

    def _go_closing(self, t_s: float, floor: SeenFloor, here: FloatArray) -> bool:
        """Set out for the place of an early scan; False where none is within reach."""
        poses = self._grid.poses
        early = poses[: max(1, len(poses) // 2), :2]
        costs = np.array([floor.cost_to(place) for place in early])
        far = np.hypot(*(early - here).T) > 1.0
        if not (np.isfinite(costs) & far).any():
            return False
        place = early[int(np.where(far, costs, np.inf).argmin())]
        if self._target is not None and self._doing is Doing.EXPLORE:
            self._targets.unsure(self._target)
        self._doing = Doing.CLOSE
        self._go(floor, Target(place, place, 0.0, False))
        self._journal.say(
            t_s, "close", f"unsure of its place: back to ({place[0]:.1f}, {place[1]:.1f}) for a loop"
        )
        return self._target is not None

    def _watch(self, t_s: float, here: FloatArray) -> None:
        """Give up a target that it gets no nearer to."""
        if self._stalled_at is not None and float(np.hypot(*(here - self._stalled_at))) > AHEAD_M:
            self._stalled_at = None
        target = self._target
        path, xy_m = (np.zeros((0, 2)), None) if target is None else (target.path, target.xy_m)
        stalled_s = self._getting_on.stalled_s(t_s, here, xy_m, path)
        if stalled_s > SHY_SHARE * self._stall_s:
            self._stalled_at = here
        if stalled_s > self._stall_s:
            self._getting_on.stall(t_s)
            if self._target is not None and self._doing is not Doing.RETURN:
                what = "a frontier" if self._doing is Doing.EXPLORE else "the place of a loop"
                x_m, y_m = self._target.xy_m
                self._journal.say(
                    t_s, "stall", f"it gets no nearer to {what}: ({x_m:.1f}, {y_m:.1f}) is given up"
                )
                self._failed_to_reach(self._target)
                self._target = None
            elif self._doing is Doing.RETURN and self._getting_on.stalls >= HOME_STALLS:
                self._fail(t_s, "stuck on its way back to the start")

    # --- coming back --------------------------------------------------------------------------------

    def _set_out_home(self, t_s: float, floor: SeenFloor, widest: SeenFloor, here: FloatArray) -> None:
        """Say what is left, by the gaps that it fits through, and come back."""
        left = widest.frontiers(self._least_m)
        unreached = sum(1 for frontier in left if frontier.view < 0 and not frontier.crossings.size)
        wide = sum(1 for frontier in left if frontier.crossings.size)
        self._journal.counts |= {"frontiers_left": len(left), "frontiers_given_up": wide}
        self._journal.say(
            t_s,
            "explored",
            f"no frontier is left to look at; of those that stay {unreached} are out of reach, "
            f"{len(left) - unreached - wide} too narrow and looked at, {wide} wide enough and given up",
        )
        self._doing = Doing.RETURN
        self._come_back(t_s, floor, here)

    def _come_back(self, t_s: float, floor: SeenFloor, here: FloatArray) -> None:
        """Drive to the start; there, look for loops once more before believing it."""
        off_m = float(np.hypot(*(self._start - here)))
        if off_m >= self._config.arrival_m:
            path = floor.path_to(self._start)
            if len(path) == 0 and off_m > 1.0:
                self._fail(t_s, "no path over the floor that it has seen leads back to the start")
                return
            path = np.concatenate([path[:-1], self._start[None]])
            self._target = Target(self._start, self._start, 0.0, False, path)
            return
        if not self._draws and self._checked < RETURNS:
            self._checked += 1
            self._able.close_loops()
            pose = self._localizer.belief.pose
            if math.hypot(pose.x_m - self._start[0], pose.y_m - self._start[1]) >= self._config.arrival_m:
                return
        self._able.refine()
        left, wide = (self._journal.counts[key] for key in ("frontiers_left", "frontiers_given_up"))
        told = f"explored, {left} frontiers left, {wide} of them wide enough, back at the start"
        self._end(t_s, StackStatus.ARRIVED, told)

    def _fail(self, t_s: float, why: str) -> None:
        self._end(t_s, StackStatus.FAILED, why)

    def _end(self, t_s: float, status: StackStatus, why: str) -> None:
        self._doing, self._target = Doing.DONE, None
        super()._end(t_s, status, why)

    # --- driving ------------------------------------------------------------------------------------

    def _led_to(self, path: FloatArray, here: FloatArray) -> tuple[float, float]:
        """A point on the path some metres ahead of where the robot is nearest to it."""
        nearest = int(np.hypot(*(path - here).T).argmin())
        steps = np.hypot(*np.diff(path[nearest:], axis=0).T)
        k = nearest + int(np.searchsorted(np.cumsum(steps), AHEAD_M))
        k = min(k, len(path) - 1)
        if self._stalled_at is not None and self._floor is not None:
            while k > nearest + 1 and not self._floor.has_room(here, path[k]):
                k -= 1
        point = path[k]
        return float(point[0]), float(point[1])
