"""The metrics of a run on a sheet; their definitions stand in docs/exploration.md."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from pilotage.core.types import BoolArray, FloatArray
from pilotage.evaluation.cell_map_score import CellMapScore, score_cell_map
from pilotage.evaluation.consistency import nees, nees_metrics
from pilotage.evaluation.driving import covariances, poses
from pilotage.evaluation.pose_errors import pose_errors
from pilotage.evaluation.sheet_visits import reachable_cells
from pilotage.maps.cell_map import CellMap
from pilotage.maps.true_cells import SheetFile, true_map

DONE_SHARE = 0.95


def sheet_metrics(
    sheet: SheetFile,
    body_radius_m: float,
    trace: Mapping[str, FloatArray],
    visited: BoolArray,
    first_visit_s: FloatArray,
    cells: CellMap,
    own_visited: BoolArray,
) -> dict[str, object]:
    """Coverage, mapping accuracy and pose errors.

    Parameters
    ----------
    visited, first_visit_s
        (rows, columns) truly visited cells and when first.
    cells, own_visited
        The robot's map and its own visited layer.
    """
    truth = true_map(sheet)
    reachable = reachable_cells(sheet, body_radius_m)
    score = score_cell_map(cells, truth, visited)
    count = int(reachable.sum())
    covered = int((visited & reachable).sum())
    both = int((visited & own_visited).sum())
    metrics: dict[str, object] = {
        "coverage_visited": float(visited.mean()),
        "coverage_reachable": covered / count if count else math.nan,
        "visited_cells": int(visited.sum()),
        "reachable_cells": count,
        "visited_accuracy": both / int(visited.sum()) if visited.any() else math.nan,
        **_shares(score),
        "time_to_95_s": _time_to(first_visit_s[reachable & visited], count),
        "covered_width_m": _extent(np.asarray(visited.any(axis=0)), sheet.size_m[0] / sheet.cells[0]),
        "covered_height_m": _extent(np.asarray(visited.any(axis=1)), sheet.size_m[1] / sheet.cells[1]),
    }
    return metrics | _errors(trace)


def _shares(score: CellMapScore) -> dict[str, object]:
    return {
        "feature_precision": score.features.ratio,
        "feature_precision_neutral": score.features_neutral.ratio,
        "feature_recall": score.observable.ratio,
        "feature_recall_all": score.all_features.ratio,
        "feature_cells": score.features.of,
        "free_accuracy": score.free.ratio,
        "free_cells": score.free.of,
        "explored_accuracy": score.explored.ratio,
    }


def _time_to(first_s: FloatArray, count: int) -> float:
    """When 95 % of the reachable cells had been visited; nan where they never were."""
    wanted = math.ceil(DONE_SHARE * count)
    times: Sequence[float] = sorted(first_s[np.isfinite(first_s)].tolist())
    return times[wanted - 1] if 0 < wanted <= len(times) else math.nan


def _extent(touched: BoolArray, cell_m: float) -> float:
    where = np.flatnonzero(touched)
    return float(where[-1] - where[0] + 1) * cell_m if where.size else 0.0


def _errors(trace: Mapping[str, FloatArray]) -> dict[str, object]:
    """Errors of the pose over the run, and their consistency with the covariance."""
    if trace["t_s"].size == 0:
        return {}
    truth, estimate = poses(trace, "true"), poses(trace, "est")
    metrics = pose_errors(truth, estimate).metrics() | {
        "min_clearance_m": float(trace["clearance_m"].min()),
        "overhang_max_m": float(trace["overhang_m"].max()),
    }
    cov = covariances(trace)
    known = np.linalg.eigvalsh(cov)[:, 0] > 0.0
    if known.sum() > 1:
        metrics |= nees_metrics(nees(truth[known], estimate[known], cov[known]))
    return metrics
