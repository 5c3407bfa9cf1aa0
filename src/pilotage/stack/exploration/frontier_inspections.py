"""Looking after tapes: rows driven beside one never cross it, its ends are not seen, or hardly any of it."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.stack.exploration.frontier_returns import BEFORE_M, BEHIND_M, Look
from pilotage.stack.exploration.sheet_features import TapeEnd
from pilotage.stack.localization.line_map import Kind, LineMap
from pilotage.stack.planning.sheet_room import Point, SheetRoom

STEP_M = 0.05
"""A tape is followed in steps of this, and where it ends the step is halved."""
SAME_M = 0.012
"""Two looks nearer to each other than this are one."""
PAIR_M = (0.015, 0.07)
"""How far apart two sensors cross one tape at once."""


class Inspections:
    """Chooses crossings beyond the seen ends of tapes, until each end is known to within ``known_m``."""

    def __init__(self, known_m: float, most: int) -> None:
        self._known, self._most = known_m, most
        self._looked: list[Point] = []

    def next_look(
        self,
        landmarks: LineMap,
        ends: list[TapeEnd],
        loose: FloatArray,
        room: SheetRoom,
        cost: FloatArray,
        sensors_ahead_m: float,
    ) -> Look | None:
        """The cheapest crossing that tells more of a tape; None where there is none.

        Parameters
        ----------
        loose
            (K, 2) points where something was crossed that is no landmark yet.
        """
        if len(self._looked) >= self._most:
            return None
        best, chosen, foot_of = math.inf, None, (0.0, 0.0)
        for foot, normal in (*self._beyond_ends(landmarks, ends), *_beside_loose(loose)):
            if any(math.hypot(foot[0] - x, foot[1] - y) < SAME_M for x, y in self._looked):
                continue
            for side in (-1.0, 1.0):
                look = _crossing(foot, side * normal, sensors_ahead_m)
                node = room.entry(cost, *look[0])
                if node < 0 or not _on_sheet(look, room) or room.clear(*look) < room.room_m + 0.002:
                    continue
                if cost[node] < best:
                    best, foot_of = float(cost[node]), (float(foot[0]), float(foot[1]))
                    chosen = Look(Kind.TAPE, look[0], look[1], node, back=False)
        if chosen is not None:
            self._looked.append(foot_of)
        return chosen

    def _beyond_ends(
        self, landmarks: LineMap, ends: list[TapeEnd]
    ) -> Iterator[tuple[FloatArray, FloatArray]]:
        """Points a little beyond ends that are not known well, and the tapes' normals."""
        for end in ends:
            gap = abs(end.bright_m - end.at_m)
            if end.joined or gap < self._known:
                continue
            along = end.at_m + end.sign * min(STEP_M, 0.5 * gap)
            angle = float(landmarks.lines[end.landmark, 0])
            yield (
                landmarks.segment(end.landmark, along, along)[0],
                np.array([math.cos(angle), math.sin(angle)]),
            )


def _beside_loose(loose: FloatArray) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Points a little farther along what two sensors crossed side by side, and its normal."""
    for i in range(loose.shape[0]):
        for j in range(loose.shape[0]):
            apart = loose[i] - loose[j]
            length = math.hypot(apart[0], apart[1])
            if PAIR_M[0] < length < PAIR_M[1]:
                yield loose[i] + STEP_M * apart / length, np.array([-apart[1], apart[0]]) / length


def _crossing(foot: FloatArray, normal: FloatArray, ahead_m: float) -> tuple[Point, Point]:
    begin, end = foot + (ahead_m + BEFORE_M) * normal, foot + (ahead_m - BEHIND_M) * normal
    return (float(begin[0]), float(begin[1])), (float(end[0]), float(end[1]))


def _on_sheet(look: tuple[Point, Point], room: SheetRoom) -> bool:
    width, height = room.shape.size_m
    return all(min(x, width - x, y, height - y) >= room.body_m for x, y in look)
