"""``pilotage map-score``: a robot's printed map against the true one."""

from __future__ import annotations

import math
from typing import Annotated, Any

import typer

from pilotage.cli.options import Json
from pilotage.cli.output import print_answer


def map_score(
    printed: Annotated[str, typer.Argument(metavar="PRINTED", help="The map as the robot printed it.")],
    truth: Annotated[
        str, typer.Argument(metavar="TRUTH", help="A YAML file of boxes and tapes, or a text of L, O and #.")
    ],
    visited: Annotated[
        str | None, typer.Option(metavar="TRACK.json", help="True path, from 'pilotage track --out'.")
    ] = None,
    json: Json = False,
) -> None:
    """Score a robot's printed map against the true one, and how much a shift of one cell would change."""
    from pilotage.evaluation.cell_map_score import score_cell_map, shift_changes
    from pilotage.evaluation.true_visits import read_visits
    from pilotage.maps.cell_map_text import read_cell_map
    from pilotage.maps.true_cells import read_true_map

    true = read_true_map(truth)
    robots = read_cell_map(printed, true.cells.shape[0])
    visits = None if visited is None else read_visits(visited, robots.shape)
    score = score_cell_map(robots, true, visits).as_dict()
    changes = shift_changes(robots, true, visits)
    print_answer(score | {"shift_changes": changes}, _rows(score, changes), as_json=json)


def _rows(score: dict[str, Any], changes: dict[str, dict[str, float]]) -> list[tuple[str, ...]]:
    rows = [("metric", "cells", "share", *(f"1 {direction}" for direction in changes))]
    for name in [name for name in score if not name.endswith("_cells")]:
        correct, of = score[f"{name}_cells"]
        moved = [_percent(change[name], "+") if name in change else "" for change in changes.values()]
        rows.append((name, f"{correct}/{of}", _percent(score[name]), *moved))
    return rows


def _percent(value: float, sign: str = "") -> str:
    return f"{100.0 * value:{sign}.1f} %" if math.isfinite(value) else "-"
