"""Where those who stand on the path of one who goes first are to go."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from pilotage.core.types import BoolArray, FloatArray
from pilotage.kernels.control import eikonal
from pilotage.kernels.geometry.near_paths import away_from_path
from pilotage.stack.patrol.roadmap import STEP_M, Roadmap

AROUND_M = 8.0
"""Beyond the path nobody is sent farther than this."""
DEEPEST = 6
"""So many push each other at most."""
MOST_PATHS = 48
"""So many are looked for at most; where there are places for all, a few do."""
OFF_M = (0.25, 0.1)
"""Beyond the sum of two bodies, to keep from the path; less where there is no such place."""


class Sizes(NamedTuple):
    """How large the bodies of a team are, and what they keep.

    Attributes
    ----------
    radii_m
        By number.
    gap_m, margin_m
        What two that stand beside each other leave between them, and what each plans to leave to walls.
    """

    radii_m: Sequence[float]
    gap_m: float
    margin_m: float

    def apart_m(self, one: int, other: int) -> float:
        """Between the middles of two that stand beside each other."""
        return self.radii_m[one] + self.radii_m[other] + self.gap_m


class Line(NamedTuple):
    """(K, 2) a path, and the number of the robot that goes there."""

    xy_m: FloatArray
    robot: int


class Evacuation:
    """A search for places off a path, one robot after the other, as pebbles on a graph are moved.

    Each goes to the nearest place that it can reach past the others where they are or were told to go. Where
    there is none it pushes those who stand between, who then have to leave its path as well, the one who
    goes first included: as in PIBT (Okumura et al. 2022) priority is inherited, and handed back where that
    leads nowhere. Fails where the floor around has no place left, or where ``MOST_PATHS`` lead to none: who
    pushes may be pushed back, and in a corridor full of robots there is no end of ways to try.

    Parameters
    ----------
    line_xy_m
        (K, 2) the path, from the robot that goes first on.
    first
        Number of that robot.
    places
        Where each robot is, by number; that one's too.
    sent
        Where some of them were told to go already.
    given
        Those of them who were told by others, and cannot be told otherwise.
    fixed_xy_m
        (F, 2) bodies that nobody can tell to go; they are taken for as large as the one who goes first.
    sizes
        Who is larger has fewer places, and leaves the path by more.

    Attributes
    ----------
    sent
        The orders, with those that were added.
    """

    def __init__(
        self,
        roadmap: Roadmap,
        line_xy_m: FloatArray,
        first: int,
        places: Mapping[int, tuple[float, float]],
        sent: Mapping[int, tuple[float, float]],
        given: Collection[int],
        fixed_xy_m: FloatArray,
        sizes: Sizes,
    ) -> None:
        self._first, self._places, self._sizes = first, places, sizes
        self._line, self._fixed = Line(line_xy_m, first), fixed_xy_m
        self.sent = dict(sent)
        self._given = given
        self._paths_left, self._from_lines = MOST_PATHS, dict[bytes, FloatArray]()
        x0, y0 = roadmap.origin_xy_m
        step = roadmap.spacing_m
        low = np.floor((line_xy_m.min(axis=0) - AROUND_M - (x0, y0)) / step).astype(np.int64)
        high = np.ceil((line_xy_m.max(axis=0) + AROUND_M - (x0, y0)) / step).astype(np.int64)
        column, row = np.maximum(low, 0).tolist()
        self._roadmap, self._window = roadmap, np.s_[row : high[1] + 1, column : high[0] + 1]
        self._step_m, self._x0, self._y0 = step, x0 + column * step, y0 + row * step
        rows, columns = roadmap.slowness[self._window].shape
        self._xs, self._ys = self._x0 + step * np.arange(columns), self._y0 + step * np.arange(rows)
        self._nodes: FloatArray = np.stack(np.meshgrid(self._xs, self._ys), axis=-1)

    def clear(self) -> bool:
        """Send everybody off the path who is on it and was not sent; whether there were places for all."""
        on = [
            n for n in self._places if n != self._first and n not in self.sent and self._is_on(n, self._line)
        ]
        # Those at its far end make room for those before them.
        along = {n: int(np.argmin(np.hypot(*(self._line.xy_m - self._places[n]).T))) for n in on}
        found = [self._leave(n, [self._line], 0) for n in sorted(on, key=lambda n: -along[n])]
        return all(found)

    def _is_on(self, number: int, line: Line) -> bool:
        """Whether a robot stands on a path, or will when it is where it was told to go."""
        place, apart_m = self.sent.get(number, self._places[number]), self._sizes.apart_m(number, line.robot)
        return bool(np.hypot(*(line.xy_m - place).T).min() < apart_m + OFF_M[-1])

    def _leave(self, number: int, lines: Sequence[Line], depth: int) -> bool:
        """Find a place off some paths for one robot, and for those whom it has to push."""
        others = {n: self.sent.get(n, place) for n, place in self._places.items() if n != number}
        fixed = {n: place for n, place in others.items() if n in self._given}
        # Past everybody; pushing all but the one who goes first, who comes back to its own path; it as well.
        for stays in (others, fixed | {n: others[n] for n in others if n == self._first}, fixed):
            for off_m in OFF_M:
                way = self._path_off(number, lines, stays, off_m)
                if way is None:
                    continue
                before, path = dict(self.sent), Line(way, number)
                pushed = [n for n in others if n not in stays and self._is_on(n, path)]
                x, y = way[-1].tolist()
                self.sent[number] = x, y
                if not pushed:
                    return True
                if depth < DEEPEST and all(
                    self._leave(n, [path] if n == self._first else [*lines, path], depth + 1) for n in pushed
                ):
                    return True
                self.sent = before
                break
        return False

    def _path_off(
        self,
        number: int,
        lines: Sequence[Line],
        stays: Mapping[int, tuple[float, float]],
        off_m: float,
    ) -> FloatArray | None:
        """(N, 2) from a robot to the nearest place off some paths, around who stands; None without one."""
        if self._paths_left == 0:
            return None
        self._paths_left -= 1
        here, sizes = np.array(self._places[number]), self._sizes
        clearance_m = sizes.radii_m[number] + sizes.margin_m
        slow = self._roadmap.slowness_for(clearance_m)[self._window].copy()
        taken = np.zeros(slow.shape, dtype=np.bool_)
        bodies = [(body, self._first) for body in self._fixed]
        for body, other in [*bodies, *((np.array(place), n) for n, place in stays.items())]:
            taken |= self._near(body, here, slow, sizes.apart_m(number, other))
        time = np.full(slow.shape, np.inf)
        row, column = round((here[1] - self._y0) / self._step_m), round((here[0] - self._x0) / self._step_m)
        if not (0 <= row < slow.shape[0] and 0 <= column < slow.shape[1]):
            return None
        near = slice(max(0, row - 1), row + 2), slice(max(0, column - 1), column + 2)
        time[near][np.isfinite(slow[near])] = 0.0
        eikonal.sweep_down(time, slow, self._step_m)
        when = np.where(taken, np.inf, time)
        for line in lines:
            when[self._away_m(line.xy_m) < sizes.apart_m(number, line.robot) + off_m] = np.inf
        best = np.unravel_index(int(np.argmin(when)), when.shape)
        if not math.isfinite(when[best]):
            return None
        # Down the field of times from the robot: backwards.
        x, y = self._nodes[best].tolist()
        steps = math.ceil(4.0 * AROUND_M / STEP_M)
        back = eikonal.way_down(x, y, (time, self._x0, self._y0, self._step_m), time, STEP_M, steps)
        return np.concatenate([here[None], back[::-1, :2]])

    def _away_m(self, line_xy_m: FloatArray) -> FloatArray:
        """(rows, columns) how far nodes are from a path, worked out once for it."""
        key = line_xy_m.tobytes()
        if key not in self._from_lines:
            self._from_lines[key] = away_from_path(self._xs, self._ys, np.ascontiguousarray(line_xy_m))
        return self._from_lines[key]

    def _near(self, body: FloatArray, here: FloatArray, slow: FloatArray, apart_m: float) -> BoolArray:
        """Nodes that a body keeps; no path leads there, but for one that it stands close to already."""
        away = np.hypot(*(self._nodes - body).transpose(2, 0, 1))
        slow[away < min(apart_m, float(np.hypot(*(body - here))) - 1.5 * self._step_m)] = np.inf
        return np.asarray(away < apart_m)
