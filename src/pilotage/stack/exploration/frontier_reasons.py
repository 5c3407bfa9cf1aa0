"""Why a cell was left: each one that the explorer did not visit has a reason."""

from __future__ import annotations

from enum import StrEnum

import numpy as np

from pilotage.core.types import BoolArray, FloatArray
from pilotage.stack.exploration.explorer import LeftCell
from pilotage.stack.planning.sheet_room import SheetRoom


class LeftReason(StrEnum):
    """Why the robot was not in a cell."""

    BLOCKED = "blocked"
    """A box stands in it."""
    OFF_SHEET = "too near the edge"
    """The body would not stand on the sheet."""
    NARROW = "too narrow"
    """The body finds no room there between what stands around."""
    UNREACHABLE = "unreachable"
    """There is room, but no path there."""
    FAILED = "not reached"
    """There seems to be a path, but it was tried often enough."""


def reasons(
    left: BoolArray, obstacles: BoolArray, given_up: BoolArray, room: SheetRoom, cost: FloatArray
) -> tuple[LeftCell, ...]:
    """Give the reason of each cell in ``left``.

    Parameters
    ----------
    left, obstacles, given_up
        (rows, columns) cells not visited, cells that boxes stand in, cells that were tried often enough.
    cost
        From ``SheetRoom.costs``.
    """
    on_sheet = SheetRoom(room.shape, room.body_m, room.room_m, room.wide_m).stands(left, 0.0, 0.0)
    stands = room.stands(left, 0.0, 0.0)
    result = []
    for row, column in np.argwhere(left):
        x, y, _, free = stands[row, column]
        if not np.isfinite(on_sheet[row, column, 3]):
            reason = LeftReason.OFF_SHEET
        elif free < room.room_m:
            reason = LeftReason.BLOCKED if obstacles[row, column] else LeftReason.NARROW
        elif room.entry(cost, float(x), float(y)) < 0:
            reason = LeftReason.BLOCKED if obstacles[row, column] else LeftReason.UNREACHABLE
        else:
            reason = LeftReason.FAILED if given_up[row, column] else LeftReason.UNREACHABLE
        result.append(LeftCell(int(row), int(column), str(reason)))
    return tuple(result)


def summary(left: tuple[LeftCell, ...]) -> str:
    """How many cells were left for each reason."""
    counts = {reason: sum(cell.reason == reason for cell in left) for reason in LeftReason}
    return ", ".join(f"{count} {reason}" for reason, count in counts.items() if count) or "none"
