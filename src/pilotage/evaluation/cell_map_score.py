"""How good a robot's cell map is, in the metrics of the exploration report and in fairer ones.

Definitions, all over cells. A *feature* is OBSTACLE or LINE; it is correct only with the same letter as the
truth. *Free* is VISITED, EXPLORED or BORDER; it is correct where the truth has no feature.

feature_precision
    Correct features over all features on the robot's map (the report's "% feature cells").
feature_precision_neutral
    The same with true feature cells touched by less than 8 % left out, whatever the robot says of them: the
    truth itself is known to 3 mm, which is 4 % of a cell's side.
feature_recall, feature_recall_all
    Correct features over the true features that a robot can observe (line cells, and box cells with a
    box-free neighbour to the north, south, east or west), and over all true features.
free_accuracy
    Correct free cells over all free cells on the robot's map.
explored_accuracy
    Correct features and correct free cells over all features and free cells on the robot's map.
visited_accuracy
    Truly visited cells that the robot holds as visited, over all truly visited ones.
coverage_visited
    Truly visited cells over all cells.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pilotage.core.errors import InputError
from pilotage.maps.cell_map import FEATURES, FREE, CellMap, CellState, TrueCellMap

Mask = NDArray[np.bool_]

NEUTRAL_BELOW = 0.08
"""Cells touched by less than this share are left out of the fair precision."""

SHIFTS = {"north": (1, 0), "south": (-1, 0), "east": (0, 1), "west": (0, -1)}
"""Rows and columns by which the robot's map is moved."""


@dataclass(frozen=True, slots=True)
class Share:
    """Correct cells out of those that count; the ratio is NaN where none counts."""

    correct: int
    of: int

    @property
    def ratio(self) -> float:
        """Correct over counted."""
        return self.correct / self.of if self.of else float("nan")


@dataclass(frozen=True, slots=True)
class CellMapScore:
    """The shares that the module's docstring defines; ``visited`` is None without a true path."""

    features: Share
    features_neutral: Share
    observable: Share
    all_features: Share
    free: Share
    explored: Share
    visited: Share | None
    coverage: Share | None

    def as_dict(self) -> dict[str, Any]:
        """The score as one flat mapping of ratios and the counts behind them."""
        named = {
            "feature_precision": self.features,
            "feature_precision_neutral": self.features_neutral,
            "feature_recall": self.observable,
            "feature_recall_all": self.all_features,
            "free_accuracy": self.free,
            "explored_accuracy": self.explored,
            "visited_accuracy": self.visited,
            "coverage_visited": self.coverage,
        }
        result: dict[str, Any] = {}
        for name, share in named.items():
            if share is not None:
                result[name] = share.ratio
                result[f"{name}_cells"] = [share.correct, share.of]
        return result


def score_cell_map(printed: CellMap, truth: TrueCellMap, visited: Mask | None = None) -> CellMapScore:
    """Score a robot's map.

    Parameters
    ----------
    printed
        The robot's map.
    truth
        What is really there; same shape.
    visited
        Truly visited cells, shape (rows, columns), or None where the true path is not known.

    Raises
    ------
    InputError
        If the shapes differ.
    """
    for name, shape in (("true map", truth.cells.shape), ("visited cells", getattr(visited, "shape", None))):
        if shape is not None and tuple(shape) != printed.shape:
            raise InputError(
                f"{name}: expected {_size(printed.shape)} cells like the robot's map, found {_size(shape)}"
            )
    mapped, real = printed.holds(*FEATURES), truth.cells.holds(*FEATURES)
    right = mapped & (printed.states == truth.cells.states)
    counted = ~truth.neutral(NEUTRAL_BELOW)
    free = printed.holds(*FREE)
    right_free = free & ~real
    on_visited = printed.holds(CellState.VISITED)
    return CellMapScore(
        features=_share(right, mapped),
        features_neutral=_share(right & counted, mapped & counted),
        observable=_share(right & truth.observable(), truth.observable()),
        all_features=_share(right, real),
        free=_share(right_free, free),
        explored=_share(right | right_free, mapped | free),
        visited=None if visited is None else _share(visited & on_visited, visited),
        coverage=None if visited is None else _share(visited, np.ones_like(visited)),
    )


def shift_changes(
    printed: CellMap, truth: TrueCellMap, visited: Mask | None = None
) -> dict[str, dict[str, float]]:
    """How much each ratio would change were the robot's map one cell further north, south, east or west.

    A large gain in one direction says that the pose was off, rather than what the sensors saw.
    """
    base = score_cell_map(printed, truth, visited).as_dict()
    ratios = [name for name in base if not name.endswith("_cells") and name != "coverage_visited"]
    changes = {}
    for direction, (rows, columns) in SHIFTS.items():
        moved = score_cell_map(printed.shifted(rows, columns), truth, visited).as_dict()
        changes[direction] = {name: moved[name] - base[name] for name in ratios}
    return changes


def _share(correct: Mask, of: Mask) -> Share:
    return Share(int(np.count_nonzero(correct)), int(np.count_nonzero(of)))


def _size(shape: tuple[int, ...]) -> str:
    return " x ".join(str(side) for side in shape)
