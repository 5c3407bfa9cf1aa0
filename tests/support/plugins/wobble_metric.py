"""A plugin: how much the robot wobbled."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.evaluation.metric import Aspect, Direction, Metric
from pilotage.evaluation.metrics import METRICS

WOBBLE = Metric("wobble_rad", "wobble", "rad", "Sum of all turns.", Direction.LESS, Aspect.EFFORT)


@METRICS.computed_by(WOBBLE)
def wobble(trace: Mapping[str, FloatArray], metrics: Mapping[str, object]) -> float:
    """Total turn along the run."""
    del metrics
    return float(np.abs(np.diff(np.unwrap(trace["true_theta_rad"]))).sum())
