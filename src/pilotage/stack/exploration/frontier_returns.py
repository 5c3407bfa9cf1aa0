"""Returning to a known landmark: from where to look at it, and which one is worth the path."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.stack.localization.line_map import Kind, LineMap
from pilotage.stack.planning.sheet_room import Point, SheetRoom

KNOWN_M = 0.003
"""Position left unknown across a landmark after a look at it."""
LOOK_COST_M = 0.25
"""What a look costs besides the way there."""
FACE_FROM_M, FACE_TO_M = 0.11, 0.07
"""How far the body begins and ends from a wall that it faces."""
BEFORE_M, BEHIND_M = 0.05, 0.03
"""How far before and behind a line its sensors begin and end."""


@dataclass(frozen=True, slots=True)
class Look:
    """A drive that sees a landmark: from ``begin`` straight to ``end``, and back where ``back``."""

    kind: Kind
    begin: Point
    end: Point
    node: int
    back: bool


def best_look(
    landmarks: LineMap,
    cov: FloatArray,
    room: SheetRoom,
    cost: FloatArray,
    here: Point,
    sensors_ahead_m: float,
) -> Look | None:
    """The look with the least path for each millimetre of position gained; None where none gains 2 mm.

    Parameters
    ----------
    cov
        (2, 2) of the position.
    cost
        From ``SheetRoom.costs``.
    sensors_ahead_m
        How far before the robot's centre the line sensors look at the floor.
    """
    best, chosen = math.inf, None
    for j in range(landmarks.count):
        angle = float(landmarks.lines[j, 0])
        normal = np.array([math.cos(angle), math.sin(angle)])
        gain = math.sqrt(max(float(normal @ cov @ normal), 0.0)) - KNOWN_M
        if gain < 0.002:
            continue
        low, high = landmarks.extents[j]
        places = np.linspace(low + 0.03, high - 0.03, 9) if high - low > 0.1 else [0.5 * (low + high)]
        for along in places:
            foot = landmarks.segment(j, float(along), float(along))[0]
            kind = Kind(int(landmarks.kinds[j]))
            begin, end = _drive(kind, foot, normal, here, room.body_m, sensors_ahead_m)
            width, height = room.shape.size_m
            if min(begin[0], width - begin[0], begin[1], height - begin[1]) < room.body_m:
                continue
            node = room.entry(cost, *begin)
            if node < 0 or room.clear(begin, end) < 0.015:
                continue
            value = (float(cost[node]) + LOOK_COST_M) / gain
            if value < best:
                best, chosen = value, Look(kind, begin, end, node, kind is Kind.EDGE)
    return chosen


def _drive(
    kind: Kind, foot: FloatArray, normal: FloatArray, here: Point, body_m: float, ahead_m: float
) -> tuple[Point, Point]:
    """Where to begin and end: facing a wall, across a tape from the nearer side, to the edge."""
    if kind is Kind.WALL:
        begin, end = foot + (body_m + FACE_FROM_M) * normal, foot + (body_m + FACE_TO_M) * normal
    elif kind is Kind.EDGE:
        begin, end = foot + (body_m + 0.006) * normal, foot + (ahead_m - 0.02) * normal
    else:
        side = 1.0 if float((np.array(here) - foot) @ normal) > 0.0 else -1.0
        begin = foot + side * (ahead_m + BEFORE_M) * normal
        end = foot + side * (ahead_m - BEHIND_M) * normal
    return (float(begin[0]), float(begin[1])), (float(end[0]), float(end[1]))
