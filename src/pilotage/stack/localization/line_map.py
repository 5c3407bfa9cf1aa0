"""The straight landmarks of a sheet: walls of boxes, tapes, and the sheet's own edges.

Beams make walls, crossings make tapes. An observation joins a landmark only where it fits closely; what fits
none makes a landmark of its own once there is enough of it; and a landmark that proves to be an old one seen
again, from a pose that had drifted, is merged with it as a whole. Points one by one would be drawn to
whatever is nearest; a line has a direction and a place to be compared.
"""

from __future__ import annotations

import math
from enum import IntEnum
from typing import TypeAlias

import numpy as np
from pydantic import Field

from pilotage.core.config import Config
from pilotage.core.types import FloatArray, IntArray
from pilotage.kernels.lines import landmarks as line_landmarks
from pilotage.stack.localization.observations import Observations

SavedLines: TypeAlias = tuple[FloatArray, FloatArray, IntArray, int]

MERGE_GAP_M = 0.05
ROOM = 256
"""Landmarks at most."""


class Kind(IntEnum):
    """What a landmark is."""

    WALL = 0
    TAPE = 1
    EDGE = 2


class LineMapConfig(Config):
    """When points make a line and when two lines are one."""

    gate_std: float = Field(default=3.5, gt=0.0)
    """Standard deviations that an observation may lie off its landmark."""
    merge_std: float = Field(default=3.0, gt=0.0)
    merge_angle_rad: float = Field(default=0.05, gt=0.0)
    wall_points: int = Field(default=12, ge=3)
    wall_length_m: float = Field(default=0.05, gt=0.0)
    wall_gap_m: float = Field(default=0.02, gt=0.0)
    """Beams glide along a wall; two spots that they rest on make none, for they may lie on two faces."""
    tape_points: int = Field(default=4, ge=3)
    tape_length_m: float = Field(default=0.03, gt=0.0)
    tape_gap_m: float = Field(default=0.125, gt=0.0)
    draws: int = Field(default=150, ge=10, le=10_000)
    """Pairs of points tried for each new line."""


class _Maker:
    """How lines of one kind are found among the observations that made them."""

    def __init__(
        self,
        kind: Kind,
        owners: tuple[Kind, ...],
        beyond_m: float,
        off_m: float,
        length_m: float,
        gap_m: float,
        points: int,
        most_pose_std_m: float,
    ) -> None:
        self.kind, self.owners, self.beyond_m, self.off_m = kind, owners, beyond_m, off_m
        self.length_m, self.gap_m, self.points = length_m, gap_m, points
        self.most_pose_std_m = most_pose_std_m


class LineMap:
    """Landmarks and what belongs to each.

    Attributes
    ----------
    lines, extents
        (L, 4) and (L, 2), see ``kernels.line_landmarks``; rows from ``count`` on are not in use.
    kinds
        (L,) of ``Kind``.
    """

    def __init__(
        self,
        config: LineMapConfig,
        size_m: tuple[float, float],
        edges_seen: bool,
        rng: np.random.Generator,
    ) -> None:
        self._config, self._size, self._rng = config, size_m, rng
        self.lines: FloatArray = np.zeros((ROOM, 4))
        self.extents: FloatArray = np.zeros((ROOM, 2))
        self.kinds: IntArray = np.zeros(ROOM, np.int64)
        self.count = 0
        if edges_seen:
            self._add_edges()
        self.edges = self.count
        c = config
        self._walls = _Maker(
            Kind.WALL, (Kind.WALL,), 0.06, 0.003, c.wall_length_m, c.wall_gap_m, c.wall_points, 0.008
        )
        self._tapes = _Maker(
            Kind.TAPE,
            (Kind.TAPE, Kind.EDGE),
            0.13,
            0.007,
            c.tape_length_m,
            c.tape_gap_m,
            c.tape_points,
            0.015,
        )

    def _add_edges(self) -> None:
        width, height = self._size
        for angle, x, y, half in (
            (0.0, 0.0, 0.5 * height, 0.5 * height),
            (0.5 * math.pi, 0.5 * width, 0.0, 0.5 * width),
            (math.pi, width, 0.5 * height, 0.5 * height),
            (-0.5 * math.pi, 0.5 * width, height, 0.5 * width),
        ):
            self.lines[self.count] = angle, 0.0, x, y
            self.extents[self.count] = -half, half
            self.kinds[self.count] = Kind.EDGE
            self.count += 1

    def of_kind(self, *kinds: Kind) -> list[int]:
        """Indices of the landmarks of some kinds."""
        return [j for j in range(self.count) if self.kinds[j] in kinds]

    def segment(self, j: int, low_m: float | None = None, high_m: float | None = None) -> FloatArray:
        """(2, 2) ends of a landmark, or of the part of it between two places along it."""
        angle, offset, x, y = self.lines[j]
        nx, ny = math.cos(angle), math.sin(angle)
        low, high = self.extents[j]
        ends = np.array([low if low_m is None else low_m, high if high_m is None else high_m])
        return np.column_stack([x + offset * nx - ends * ny, y + offset * ny + ends * nx])

    def update(
        self, poses: FloatArray, beams: Observations, crossings: Observations, merge: bool = True
    ) -> bool:
        """Associate everything anew, find new landmarks, merge; True where some were merged."""
        merged = False
        for seen, maker in ((beams, self._walls), (crossings, self._tapes)):
            is_beam = maker.kind is Kind.WALL
            line_landmarks.observed_points(poses, seen.frame, seen.values, seen.count, is_beam, seen.points)
            self._associate(seen, maker)
            self._measure(seen)
            self._discover(seen, maker)
        self._drop_thin(beams, crossings)
        for seen in (beams, crossings):
            self._measure(seen)
        for seen, maker in ((beams, self._walls), (crossings, self._tapes)):
            merged |= merge and self._merge(seen, maker, beams, crossings)
        if merged:
            for seen in (beams, crossings):
                self._measure(seen)
        return merged

    def _pose_std(self, seen: Observations, maker: _Maker) -> FloatArray:
        return np.clip(seen.pose_std[: seen.count], 0.003, maker.most_pose_std_m)

    def _associate(self, seen: Observations, maker: _Maker) -> None:
        eligible = np.isin(self.kinds[: self.count], maker.owners)
        line_landmarks.associate(
            seen.points,
            seen.spread,
            seen.count,
            self.lines,
            self.extents,
            eligible,
            self._pose_std(seen, maker),
            self._config.gate_std,
            maker.beyond_m,
            seen.landmark,
        )

    def _measure(self, seen: Observations) -> None:
        edges = self.extents[: self.edges].copy()
        line_landmarks.measure_extents(
            seen.points, seen.landmark, seen.count, self.lines, self.count, self.extents
        )
        self.extents[: self.edges] = edges
        line_landmarks.recentre(self.lines, self.extents, self.edges, self.count)

    def _discover(self, seen: Observations, maker: _Maker) -> None:
        free = np.flatnonzero(seen.owner < 0)
        if maker.kind is Kind.WALL:
            free = free[seen.spread[free] < 0.008][-600:]
        elif self.edges:
            width, height = self._size
            x, y = seen.points[free, 0], seen.points[free, 1]
            inside = np.minimum(np.minimum(x, width - x), np.minimum(y, height - y))
            free = free[inside > 0.04]
        while free.shape[0] >= maker.points and self.count < ROOM:
            j = self.count
            found = line_landmarks.find_line(
                seen.points,
                seen.spread,
                free,
                self._rng.random((self._config.draws, 2)),
                maker.off_m,
                maker.length_m,
                maker.gap_m,
                maker.points,
                self.lines[j],
                self.extents[j],
            )
            if found == 0:
                break
            own = np.full(seen.count, -1, np.int64)
            only = np.zeros(j + 1, np.bool_)
            only[j] = True
            line_landmarks.associate(
                seen.points,
                seen.spread,
                seen.count,
                self.lines,
                self.extents,
                only,
                self._pose_std(seen, maker),
                self._config.gate_std,
                0.05,
                own,
            )
            joins = (own >= 0) & (seen.owner < 0)
            if np.count_nonzero(joins) < maker.points // 2:
                break
            self.kinds[j] = maker.kind
            self.count += 1
            seen.owner[joins] = j
            free = free[~joins[free]]

    def _drop_thin(self, beams: Observations, crossings: Observations) -> None:
        """Forget landmarks that hardly anything belongs to any more."""
        held = np.zeros(self.count, np.int64)
        for seen in (beams, crossings):
            np.add.at(held, seen.owner[seen.owner >= 0], 1)
        for j in range(self.count - 1, self.edges - 1, -1):
            if held[j] < (8 if self.kinds[j] == Kind.WALL else 3):
                for seen in (beams, crossings):
                    seen.owner[seen.owner == j] = -1
                self._remove(j, beams, crossings)

    def _remove(self, j: int, beams: Observations, crossings: Observations) -> None:
        last = self.count
        for rows in (self.lines, self.extents, self.kinds):
            rows[j : last - 1] = rows[j + 1 : last].copy()
        for seen in (beams, crossings):
            seen.owner[seen.owner > j] -= 1
        self.count -= 1

    def _merge(self, seen: Observations, maker: _Maker, beams: Observations, crossings: Observations) -> bool:
        merged = False
        for j in range(self.count - 1, self.edges - 1, -1):
            if self.kinds[j] != maker.kind:
                continue
            mine = seen.owner == j
            spread = float(seen.pose_std[: seen.count][mine].mean()) if mine.any() else 0.01
            older = self._same_as(j, maker, math.hypot(min(max(spread, 0.004), 0.02), 0.003))
            if older >= 0:
                seen.owner[mine] = older
                self._remove(j, beams, crossings)
                merged = True
        return merged

    def _same_as(self, j: int, maker: _Maker, std_m: float) -> int:
        """An older landmark that landmark j could be, or -1."""
        angle, offset, x, y = self.lines[j]
        low, high = self.extents[j]
        half, middle = 0.5 * (high - low), 0.5 * (low + high)
        px = x + offset * math.cos(angle) - middle * math.sin(angle)
        py = y + offset * math.sin(angle) + middle * math.cos(angle)
        period = 2.0 * math.pi if maker.kind is Kind.WALL else math.pi
        turned = min(self._config.merge_angle_rad + 0.004 / max(2.0 * half, 0.03), 0.12)
        nearest, best = self._config.merge_std * std_m, -1
        for i in range(self.edges, j):
            if self.kinds[i] != maker.kind:
                continue
            if abs(math.remainder(angle - float(self.lines[i, 0]), period)) > turned:
                continue
            nx, ny = math.cos(self.lines[i, 0]), math.sin(self.lines[i, 0])
            dx, dy = px - self.lines[i, 2], py - self.lines[i, 3]
            along = nx * dy - ny * dx
            apart = max(self.extents[i, 0] - (along + half), along - half - self.extents[i, 1])
            off = abs(nx * dx + ny * dy - self.lines[i, 1])
            if apart <= max(maker.gap_m, MERGE_GAP_M) and off < nearest:
                nearest, best = off, i
        return best

    def saved(self) -> SavedLines:
        """What ``restore`` takes."""
        return self.lines.copy(), self.extents.copy(), self.kinds.copy(), self.count

    def restore(self, saved: SavedLines) -> None:
        """Go back to what was saved."""
        lines, extents, kinds, self.count = saved
        self.lines[:], self.extents[:], self.kinds[:] = lines, extents, kinds

    def walls(self) -> FloatArray:
        """(S, 4) ends of all walls."""
        own = self.of_kind(Kind.WALL)
        return np.array([self.segment(j).ravel() for j in own]).reshape(-1, 4)
