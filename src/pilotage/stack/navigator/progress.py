"""How far along its path the robot is, and whether it still gets on."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.types import FloatArray, Pose2
from pilotage.kernels.geometry import chain
from pilotage.stack.planning.local_planner import RouteAhead

WINDOW_BACK_M = 1.0
WINDOW_AHEAD_M = 4.0

DETOURS = 10.0
"""So many times as far as the progress asked for a robot has time to drive."""


class PathProgress:
    """Projects the estimate on a path; the projection moves within a window, so crossings do not jump.

    Parameters
    ----------
    states
        (N, 3) dense states of the path.
    waypoints
        (W, 3) sparse states on the path, in order.
    clearance_m
        What the path keeps from obstacles.
    """

    def __init__(self, states: FloatArray, waypoints: FloatArray, clearance_m: float) -> None:
        self.clearance_m = clearance_m
        self._states = np.ascontiguousarray(states)
        self._waypoints = waypoints
        self._points = states[:, :2]
        steps = np.hypot(*np.diff(self._points, axis=0).T)
        self._along_m = np.concatenate([[0.0], np.cumsum(steps)])
        self.length_m = float(self._along_m[-1])
        self.at_m = 0.0
        self.waypoint_along_m = self._locate(waypoints)

    def _locate(self, waypoints: FloatArray) -> FloatArray:
        """Distance along the path of every waypoint: the nearest state not before the last one's."""
        along = np.empty(waypoints.shape[0])
        start = 0
        for i, waypoint in enumerate(waypoints):
            # Look ahead only as far as twice the straight path, so that a later crossing is not taken.
            here = self._along_m[start]
            gap = np.hypot(*(waypoint[:2] - self._points[start]))
            stop = int(np.searchsorted(self._along_m, here + 3.0 * gap + 0.2)) + 1
            window = self._points[start:stop]
            start += int(np.argmin(np.hypot(window[:, 0] - waypoint[0], window[:, 1] - waypoint[1])))
            along[i] = self._along_m[start]
        along[-1] = self.length_m
        return along

    def update(self, pose: Pose2) -> float:
        """Project the estimate; returns the distance left to go."""
        self.at_m = chain.nearest_along(
            self._states,
            self._along_m,
            pose.x_m,
            pose.y_m,
            self.at_m - WINDOW_BACK_M,
            self.at_m + WINDOW_AHEAD_M,
        )
        return self.length_m - self.at_m

    def index(self, ahead_m: float) -> int:
        """Of the first state at least so far ahead of the robot (the last one at the end)."""
        index = int(np.searchsorted(self._along_m, self.at_m + ahead_m))
        return min(index, len(self._along_m) - 1)

    @property
    def heading_rad(self) -> float:
        """Of the path where the robot is."""
        return float(self._states[int(np.searchsorted(self._along_m, self.at_m)), 2])

    def next_waypoint(self, ahead_m: float) -> int:
        """Index of the first waypoint at least ``ahead_m`` farther along (the last one at the end)."""
        index = int(np.searchsorted(self.waypoint_along_m, self.at_m + ahead_m))
        return min(index, int(self.waypoint_along_m.shape[0]) - 1)

    def route_ahead(self, skip_m: float) -> RouteAhead:
        """What lies ahead: the waypoints at least ``skip_m`` farther along, and the plan's own states."""
        first = self.next_waypoint(skip_m)
        here = int(np.searchsorted(self._along_m, self.at_m))
        return RouteAhead(
            self._waypoints[first:],
            np.maximum(self.waypoint_along_m[first:] - self.at_m, 0.0),
            self._states[here:],
            self.clearance_m,
        )

    def turn_ahead_rad(self, reach_m: float) -> float:
        """Largest change of heading along the next ``reach_m`` of the path."""
        low = int(np.searchsorted(self._along_m, self.at_m))
        high = int(np.searchsorted(self._along_m, self.at_m + reach_m)) + 1
        headings = self._states[low:high, 2]
        if headings.shape[0] < 2:
            return 0.0
        turns = np.mod(headings - headings[0] + np.pi, 2.0 * np.pi) - np.pi
        return float(np.max(np.abs(turns)))


def patience_s(stall_s: float, progress_m: float, top_speed_m_s: float) -> float:
    """How long a robot may take for so much progress: ``stall_s``, and longer where it is slow.

    It may have to drive several times as far for it, around a curve's beginning or an obstacle.
    """
    return max(stall_s, DETOURS * progress_m / top_speed_m_s)


class StallWatch:
    """Says when the distance to go has not shrunk by ``progress_m`` for longer than ``patience_s``."""

    def __init__(self, progress_m: float, patience_s: float) -> None:
        self._progress_m, self.patience_s = progress_m, patience_s
        self._best_m, self._best_t_s = math.inf, 0.0

    def restart(self, t_s: float) -> None:
        """A new plan: any distance is progress."""
        self._best_m, self._best_t_s = math.inf, t_s

    def stalled(self, to_go_m: float, t_s: float) -> bool:
        """Whether it has stalled; having said so it waits as long again."""
        if to_go_m < self._best_m - self._progress_m:
            self._best_m, self._best_t_s = to_go_m, t_s
        stalled = t_s - self._best_t_s > self.patience_s
        if stalled:
            self._best_t_s = t_s
        return stalled
