"""What a short run tells: that its numbers are numbers."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from pilotage.experiments.build.build import build
from pilotage.experiments.loop import run_loop
from pilotage.experiments.mission import mission_of

POSES = ("true_", "est_", "cov_", "v_", "w_")
"""Columns of a trace that have a number at every step: poses, covariances, commands, speeds."""
UNBOUNDED = {"min_clearance_m"}
"""Where nothing stands there is no end of room."""


def ill_told(values: dict[str, Any]) -> list[str]:
    """Run a mission of these values; which of its metrics are infinite, and which columns hold no numbers.

    Raises
    ------
    InputError
        Where it cannot be built.
    """
    experiment = build(mission_of(values))
    finished = run_loop(experiment).finished
    metrics = experiment.task.judge(finished).metrics
    wrong = [
        name
        for name, value in metrics.items()
        if isinstance(value, float) and math.isinf(value) and name not in UNBOUNDED
    ]
    for robot in finished.robots:
        for name, column in robot.trace.items():
            if name.startswith(POSES) and not np.isfinite(column).all():
                wrong.append(name)
    return wrong
