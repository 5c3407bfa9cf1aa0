"""Following the plan: local paths from waypoint to waypoint, one reference point a control step."""

from __future__ import annotations

import math

from pilotage.core.angles import wrap_to_pi
from pilotage.core.types import STOP, FloatArray, Pose2, Twist
from pilotage.kernels.geometry import plane
from pilotage.maps.near_walls import NearWalls
from pilotage.stack.control.controller import Control, Controller
from pilotage.stack.planning.local_planner import LocalPath, LocalPlanner, RouteAhead

NO_CONTROL = Control(STOP, 0.0, 0.0, 0.0)


class WaypointFollower:
    """Feeds the controller with the local path's points and their feed-forward speeds."""

    def __init__(self, local_planner: LocalPlanner, controller: Controller, dt_s: float) -> None:
        self._local_planner = local_planner
        self._controller = controller
        self._dt_s = dt_s
        self._local: LocalPath | None = None
        self._points: list[list[float]] = []
        self._index, self._behind = 0, 0.0
        self.control = NO_CONTROL
        self.feedforward = STOP
        self.reference: Pose2 | None = None

    @property
    def active(self) -> bool:
        """Whether a local path is being followed and has points left."""
        return self._local is not None and self._index + 1 < len(self._points)

    def drop(self) -> None:
        """Forget the local path: the robot was moved by something else."""
        self._local = None
        self._controller.reset()

    def rest(self) -> None:
        """Command nothing this step."""
        self.control = NO_CONTROL
        self.feedforward = STOP

    def hold(self, share: float = 1.0) -> None:
        """That share of the last command was not driven: once it makes a step the reference stays for one."""
        self._behind += share
        if self._behind >= 1.0:
            self._behind -= 1.0
            self._index = max(0, self._index - 1)

    def replan(self, pose: Pose2, route: RouteAhead, walls: NearWalls, circles_m: FloatArray) -> bool:
        """Plan from the estimate to the next reachable waypoint; False where there is none."""
        self._local = self._local_planner.plan(pose, route, walls, circles_m)
        self._points = [] if self._local is None else self._local.states.tolist()
        self._index, self._behind = 0, 0.0
        return self._local is not None

    def clearance_ahead_m(self, reach_m: float, circles_m: FloatArray) -> float:
        """Least distance of the local path's next ``reach_m`` from the centres' discs ``circles_m``."""
        local = self._local
        if local is None or circles_m.shape[0] == 0:
            return math.inf
        count = max(2, math.ceil(reach_m / (local.speed_m_s * self._dt_s)))
        points = local.states[self._index : self._index + count, :2]
        if points.shape[0] == 0:
            return math.inf
        return float(plane.least_distance(points, plane.NO_SEGMENTS, circles_m))

    def step(self, pose: Pose2) -> Twist:
        """Advance the reference by one point and give the command for it."""
        local = self._local
        assert local is not None
        here, ahead = self._points[self._index], self._points[self._index + 1]
        self._index += 1
        self.reference = Pose2(*ahead)
        distance = math.hypot(ahead[0] - here[0], ahead[1] - here[1])
        turn = wrap_to_pi(ahead[2] - here[2])
        # The last piece may be shorter than a step; its speeds are those of the piece.
        self.feedforward = Twist(min(distance / self._dt_s, local.speed_m_s), turn / self._dt_s)
        self.control = self._controller.step(pose, self.reference, self.feedforward)
        return self.control.twist
