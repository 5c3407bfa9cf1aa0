"""The time to go over the rolling ground, worked out anew every few steps."""

from __future__ import annotations

import numpy as np

from pilotage.core.types import BoolArray, FloatArray
from pilotage.kernels.control import togo
from pilotage.kernels.control.footprint import Body
from pilotage.kernels.control.motion_limits import Drive
from pilotage.kernels.grids.distance import CellIndex
from pilotage.stack.control.local.rolling_config import RollingConfig

BEYOND_S = 6.0
"""The time to go is worked out so far past the robot: no plan goes back farther."""
AT_ONCE = 10**6
"""More steps than any plan is kept."""
OTHER_GOAL_M = 2.0
"""A goal this far from where it was is another one: what was closed on the way to the first may be the only
way to it."""
SLOW_SHARE, CRAWL_SHARE = 0.5, 0.16
"""Of the robot's own speed, at most, near obstacles and between them: to whom all places are as fast, the way
leads along the walls, no farther from them than its inner disc."""


class TimeToGo:
    """The field (m, m) of one robot's rolling ground, and the discs that no way shall lead through."""

    def __init__(self, config: RollingConfig) -> None:
        self._config, self._coarse_m = config, 2.0 * config.cell_m
        self._closed: list[tuple[float, float, float]] = []
        self._closed_for: list[FloatArray] = []
        self._eased_m = 0.0
        self._since = AT_ONCE

    @property
    def is_due(self) -> bool:
        """Whether the next update works it out anew in any case."""
        return self._since + 1 >= self._config.replan_steps

    def update(
        self,
        nearest: CellIndex,
        mean: FloatArray,
        seen: BoolArray,
        corner_m: tuple[float, float],
        goal: FloatArray,
        pose: FloatArray,
        body: Body,
        drive: Drive,
        rolled: bool,
        avoid: FloatArray | None,
    ) -> FloatArray:
        """Give the field, anew where that is due or the ground has ``rolled``.

        Parameters
        ----------
        nearest, mean, seen
            Of the grids: the nearest obstacle of each cell, where the points in cells lie, seen coarse cells.
        corner_m
            The grids' lower left corner.
        goal, pose
            (2,) and (3,) in the map frame.
        avoid
            (N, 3) discs x, y, radius to lead around.
        """
        self._seen, self._corner_m, self._goal, self._pose = seen, corner_m, goal, pose
        self._since += 1
        self._reopen()
        if rolled or self._since >= self._config.replan_steps:
            self._since = 0
            self._clearance = togo.coarse_clearance(
                nearest, mean, seen.shape[0], *corner_m, self._coarse_m, self._widths_m(body)[2]
            )
            self._field = self.beside(avoid, body, drive)
        return self._field

    def close(self, x_m: float, y_m: float, radius_m: float) -> None:
        """Lead no way to this goal through a disc of the map frame any more."""
        self._closed.append((x_m, y_m, radius_m))
        self._closed_for.append(self._goal.copy())
        self._eased_m = 0.0
        self._since = AT_ONCE

    def open_all(self) -> None:
        """Forget what was closed; where nothing was, a gap whose middle lies between cells is no longer shut.

        The middle of a gap is off that of the nearest fine cell by half of one at most.
        """
        if not self._closed:
            self._eased_m = 0.5 * self._config.cell_m
        self._closed.clear()
        self._closed_for.clear()
        self._since = AT_ONCE

    def _reopen(self) -> None:
        """Forget what was closed on the way to another goal."""
        kept = [k for k, goal in enumerate(self._closed_for) if is_same_goal(goal, self._goal)]
        if len(kept) < len(self._closed):
            self._closed = [self._closed[k] for k in kept]
            self._closed_for = [self._closed_for[k] for k in kept]
            self._since = AT_ONCE

    def beside(self, discs: FloatArray | None, body: Body, drive: Drive) -> FloatArray:
        """Time to go (m, m) on the ground as it is where discs (N, 3) are closed as well."""
        config = self._config
        x0, y0 = self._corner_m
        clearance = self._clearance
        if self._closed:
            clearance = _beside(clearance, np.array(self._closed), x0, y0, self._coarse_m)
        if discs is not None and discs.shape[0]:
            clearance = _beside(clearance, discs, x0, y0, self._coarse_m)
        speed = togo.travel_speed(
            clearance,
            self._seen,
            *self._widths_m(body),
            self._crawl_m_s(drive),
            min(config.slow_m_s, SLOW_SHARE * drive.speed),
            drive.speed,
            config.unseen_share,
        )
        # The robot is where it is: what was seen there, as somebody who brushed past, shall not shut it in.
        row, column = (int((self._pose[1] - y0) / self._coarse_m), int((self._pose[0] - x0) / self._coarse_m))
        speed[row, column] = max(speed[row, column], self._crawl_m_s(drive))
        field: FloatArray = togo.time_to_go(
            speed,
            x0,
            y0,
            self._coarse_m,
            self._goal[0],
            self._goal[1],
            drive.speed,
            self._pose[0],
            self._pose[1],
            BEYOND_S,
        )
        return field

    def _crawl_m_s(self, drive: Drive) -> float:
        return min(self._config.crawl_m_s, CRAWL_SHARE * drive.speed)

    def _widths_m(self, body: Body) -> tuple[float, float, float]:
        """Clearances from where on the footprint fits straight, may turn, and nothing slows it any more."""
        blocked_m = body.inner_m + self._config.edge_m - self._eased_m
        tight_m = max(blocked_m, body.outer_m - self._config.cell_m)
        return blocked_m, tight_m, max(self._config.easy_m, tight_m + 0.05)


def is_same_goal(one_xy_m: FloatArray, other_xy_m: FloatArray) -> bool:
    """Whether what was learnt on the way to one goal (2,) holds for the way to another."""
    return bool(np.hypot(*(one_xy_m - other_xy_m)) <= OTHER_GOAL_M)


def _beside(clearance: FloatArray, discs: FloatArray, x0: float, y0: float, coarse: float) -> FloatArray:
    """Clearance (m, m) with discs (N, 3) as further obstacles."""
    m = clearance.shape[0]
    centres = (np.arange(m) + 0.5) * coarse
    out = clearance
    for x, y, radius in discs:
        away = np.hypot(x0 + centres[None, :] - x, y0 + centres[:, None] - y) - radius
        out = np.minimum(out, np.maximum(away, 0.0))
    return out
