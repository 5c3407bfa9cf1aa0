"""Turns in several moves, in dead ends hardly wider than what a turn on the spot takes."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest

from pilotage.core.types import FloatArray
from pilotage.experiments.mission import mission_of, read_mission
from pilotage.experiments.run import run_mission
from pilotage.kernels.control.ground import Ground, exact_clearance
from pilotage.kernels.control.multi_point_turn import OFF_RAD, multi_point_turn
from pilotage.kernels.geometry.motion import wrap
from pilotage.stack.control.local.body import make_body
from support.seen_ground import JACKAL, ground_of

BODY = make_body(JACKAL)
BEHIND = -1.0, 0.0
MARGIN_M, BEHIND_M = 0.01, 0.02


def _dead_end(width_m: float) -> FloatArray:
    """Walls of a pocket about the x axis that is closed at x = 0.45."""
    half, x = 0.5 * width_m, np.arange(-2.0, 0.46, 0.02)
    y = np.arange(-half, half, 0.02)
    sides = [np.column_stack([x, np.full_like(x, side * half)]) for side in (-1.0, 1.0)]
    return np.vstack([*sides, np.column_stack([np.full_like(y, 0.45), y])])


def _clearance_m(pose: FloatArray, ground: Ground) -> float:
    x, y, c, s = pose[0], pose[1], math.cos(pose[2]), math.sin(pose[2])
    clear: float = exact_clearance(
        x, y, c, s, BODY.polygon, BODY.outer_m, ground.hits, ground.mean, ground.x0_m, ground.y0_m,
        ground.cell_m, 0.5,
    )  # fmt: skip
    return clear


def test_it_turns_where_a_turn_on_the_spot_would_touch() -> None:
    """Every pose keeps the margin, two of them where it backed; it ends headed for the point behind it."""
    ground = ground_of(_dead_end(0.71))
    start = np.array([0.0, 0.028, 0.08])
    spot = [[start[0], start[1], start[2] + turn] for turn in np.linspace(0.0, 2.0 * math.pi, 72)]
    assert min(_clearance_m(np.array(pose), ground) for pose in spot) < 0.0
    poses = multi_point_turn(start, *BEHIND, BODY, ground, MARGIN_M, BEHIND_M)
    assert (poses[0] == start).all()
    x, y, theta = poses[-1]
    assert abs(wrap(math.atan2(BEHIND[1] - y, BEHIND[0] - x) - theta)) < OFF_RAD
    for before, after in itertools.pairwise(poses):
        step = after - before
        along = step[0] * math.cos(after[2]) + step[1] * math.sin(after[2])
        assert math.hypot(step[0], step[1]) == pytest.approx(abs(along), abs=1e-9)  # never sideways
        assert (along == 0.0) != (step[2] == 0.0)
        assert _clearance_m(after, ground) >= (BEHIND_M if along < -1e-9 else MARGIN_M) - 1e-9


def test_nothing_is_found_where_the_body_does_not_fit_across() -> None:
    ground = ground_of(_dead_end(0.66))
    assert not len(multi_point_turn(np.array([0.0, 0.0, 0.0]), *BEHIND, BODY, ground, MARGIN_M, BEHIND_M))


def test_no_turn_leads_over_ground_that_nobody_saw() -> None:
    ground = ground_of(_dead_end(0.9))
    start = np.array([0.0, 0.0, 0.0])
    assert len(multi_point_turn(start, *BEHIND, BODY, ground, MARGIN_M, BEHIND_M)) > 1
    unseen = ground._replace(unseen_m=np.zeros_like(ground.unseen_m))
    assert not len(multi_point_turn(start, *BEHIND, BODY, unseen, MARGIN_M, BEHIND_M))


def test_a_jackal_gets_out_of_a_dead_end_that_it_began_askew_in() -> None:
    """0.70 m wide, 2 cm off its axis: it stood there to the end."""
    half = 0.35
    outline = [
        (-1.8, half), (0.4, half), (0.4, -half), (-1.8, -half), (-1.8, -3.0), (-4.8, -3.0), (-4.8, 3.0),
        (-1.8, 3.0), (-1.8, half),
    ]  # fmt: skip
    values: dict[str, Any] = {
        "world.map": {
            "map": "dead end",
            "bounds_m": [-5.0, -3.2, 0.6, 3.2],
            "walls_m": [[*a, *b] for a, b in itertools.pairwise(outline)],
        },
        "world.start": {"x_m": 0.0, "y_m": 0.022, "theta_rad": 0.1},
        "world.goal": {"x_m": -3.8, "y_m": 0.5, "tolerance_m": 1.0},
        "run.time_limit_s": 40.0,
    }
    metrics: dict[str, Any] = dict(
        run_mission(mission_of(read_mission("barn-course"), (), 4, values), save=False).metrics
    )
    assert metrics["success"], metrics["reason"]
    assert metrics["collisions"] == 0
