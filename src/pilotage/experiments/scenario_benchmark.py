"""Every problem of a MovingAI scenario file, solved and held against the file's optimal lengths."""

from __future__ import annotations

import math
import time
from pathlib import Path
from typing import Any

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.limits import limit, too_large
from pilotage.maps.moving_ai import GROUND, WATER, MovingAiMap, Scenario, read_moving_ai_map, read_scenario
from pilotage.stack.planning.grid_space import Cell, GridSpace

MOST_CELLS = 1 << 26
"""Cells of all sizes together that a scenario's lines may stretch its map to."""
SHOWN = 5
"""Problems that miss their length and are told one by one."""


def run_scenario(map_path: Path, scenario_path: Path) -> dict[str, Any]:
    """Solve the problems by A* without cutting corners.

    A problem for a map of another size is posed on the map stretched to it. One that starts on water
    moves on water. Where the file prints a negative length, 0 between different places, or infinity, it
    says that there is no path, and finding none is right.

    Returns
    -------
    map, scenario, problems, optimal (lengths within 0.01 of the file's, or within half of its last digit
    where it rounds to six), unreachable (no path found), worst_error (in cells; nan where a path is on one
    side only), worst_problem (its number, from 1), expansions, search_time_s, queries_per_s, success, and
    failures (the first few that miss, each with its reason).

    Raises
    ------
    InputError
        Where a file cannot be used, or a start or goal lies outside the map or on blocked ground.
    """
    terrain = read_moving_ai_map(map_path)
    scenario = read_scenario(scenario_path)
    spaces = _Spaces(terrain)
    lengths = np.empty(len(scenario))
    expansions, elapsed_s = 0, 0.0
    for i in range(len(scenario)):
        start, goal = _cell(scenario.starts[i]), _cell(scenario.goals[i])
        space = spaces.of(scenario, i, start, goal, scenario_path)
        began = time.perf_counter()
        path = space.shortest(start, goal)
        elapsed_s += time.perf_counter() - began
        lengths[i] = math.inf if path is None else path.length_cells
        expansions += 0 if path is None else path.expansions
    errors = _errors(scenario, lengths)
    good = errors <= scenario.tolerances
    worst = int(np.argmax(errors))
    failures = [
        {
            "problem": int(i) + 1,
            "start_row_column": scenario.starts[i].tolist(),
            "goal_row_column": scenario.goals[i].tolist(),
            "printed": float(scenario.lengths[i]),
            "found": float(lengths[i]),
            "reason": _reason(scenario, int(i), float(lengths[i])),
        }
        for i in np.flatnonzero(~good)[:SHOWN]
    ]
    return {
        "map": map_path.name,
        "scenario": scenario_path.name,
        "problems": len(scenario),
        "optimal": int(np.count_nonzero(good)),
        "unreachable": int(np.count_nonzero(np.isinf(lengths))),
        "worst_error": float(errors[worst]),
        "worst_problem": worst + 1,
        "expansions": expansions,
        "search_time_s": elapsed_s,
        "queries_per_s": len(scenario) / max(elapsed_s, 1e-9),
        "success": bool(good.all()),
        "failures": failures,
    }


class _Spaces:
    """The search spaces that a scenario needs, by the map's size and by ground or water."""

    def __init__(self, terrain: MovingAiMap) -> None:
        self._terrain = terrain
        self._cells = 0
        self._scaled: dict[tuple[int, int], MovingAiMap] = {}
        self._made: dict[tuple[int, int, bytes], GridSpace] = {}

    def of(self, scenario: Scenario, i: int, start: Cell, goal: Cell, path: Path) -> GridSpace:
        rows, columns = _cell(scenario.sizes[i])
        if rows <= 0 or columns <= 0:
            rows, columns = self._terrain.terrain.shape
        size = rows, columns
        if size not in self._scaled:
            # A line of a few digits may ask for any size, and every line for another one.
            self._cells += rows * columns
            if self._cells > limit(MOST_CELLS):
                raise too_large(
                    f"{path}: problem {i + 1}: maps in all", limit(MOST_CELLS), self._cells, "cells"
                )
            self._scaled[size] = self._terrain.scaled(*size)
        letters = self._scaled[size].terrain
        for name, (row, column) in (("start", start), ("goal", goal)):
            if not (0 <= row < rows and 0 <= column < columns):
                raise InputError(
                    f"{path}: problem {i + 1}: expected a {name} on the map of {columns} x {rows} cells, "
                    f"found x {column}, y {row}"
                )
        passable = WATER if letters[start] in WATER else GROUND
        key = (*size, passable)
        if key not in self._made:
            space = GridSpace(self._scaled[size].blocked(passable))
            # Compiling and labelling belong to the map, not to its first query.
            _warm(space, start, goal)
            self._made[key] = space
        for name, cell in (("start", start), ("goal", goal)):
            if not self._made[key].is_free(cell) and not scenario.without_path[i]:
                raise InputError(
                    f"{path}: problem {i + 1}: expected a {name} on free ground, found terrain "
                    f"'{chr(letters[cell])}' at x {cell[1]}, y {cell[0]}; is this the scenario's map?"
                )
        return self._made[key]


def _warm(space: GridSpace, start: Cell, goal: Cell) -> None:
    if space.is_free(start) and space.is_free(goal):
        space.shortest(start, goal)
    else:
        space.connected(start, start)


def _errors(scenario: Scenario, lengths: np.ndarray[Any, np.dtype[np.float64]]) -> Any:
    """How far each found length is from the printed one; infinite where only one of them is a path."""
    printed, none_printed = scenario.lengths, scenario.without_path
    none_found = np.isinf(lengths)
    both = ~none_printed & ~none_found
    errors = np.full(len(lengths), math.inf)
    errors[both] = np.abs(lengths[both] - printed[both])
    errors[none_printed & none_found] = 0.0
    return errors


def _reason(scenario: Scenario, i: int, found: float) -> str:
    """Why a problem counts as missed, in words: JSON has no infinity to show."""
    printed = float(scenario.lengths[i])
    says = f"the file says {printed:g}"
    if scenario.without_path[i]:
        says = f"the file says that there is no path (length {printed:g})"
    if math.isinf(found):
        return f"{says}, found no path"
    return f"{says}, found a path of {found:.8g}"


def _cell(pair: Any) -> Cell:
    return int(pair[0]), int(pair[1])
