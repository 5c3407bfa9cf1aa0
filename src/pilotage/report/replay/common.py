"""What the replays of a floor and of terrain show alike: events, and the position error with its ellipse."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from pilotage.core.chi_square import chi_square_quantile
from pilotage.core.types import FloatArray
from pilotage.records.run_data import RunData
from pilotage.report.event_kinds import event_kind
from pilotage.report.replay.scene import SceneEvent, Series
from pilotage.report.style import BLUE

Column = Callable[[str], FloatArray]
"""A trace's column at the frames that are shown."""


def scene_events(run: RunData) -> tuple[SceneEvent, ...]:
    """The run's events that have a time."""
    return tuple(
        SceneEvent(e.t_s, event_kind(e.kind).name, e.text, event_kind(e.kind).colour)
        for e in run.events
        if math.isfinite(e.t_s)
    )


def position_error(column: Column) -> Series:
    """The position's error, and the long half axis of its 95 % ellipse; without a truth that alone."""
    error = np.hypot(column("est_x_m") - column("true_x_m"), column("est_y_m") - column("true_y_m"))
    xx, xy, yy = column("cov_xx_m2"), column("cov_xy_m2"), column("cov_yy_m2")
    # Larger eigenvalue of the position's covariance: the long half axis of the ellipse on the map.
    largest = 0.5 * (xx + yy) + np.sqrt(0.25 * (xx - yy) ** 2 + xy**2)
    half_axis = np.sqrt(np.maximum(largest, 0.0) * chi_square_quantile(0.95, 2))
    if not np.isfinite(error).any():
        return Series("95 % half axis of position", "m", half_axis, BLUE)
    return Series("position error", "m", error, BLUE, band=half_axis, band_name="95 % half axis")
