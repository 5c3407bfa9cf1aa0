"""Where the position errors are made: under reactive control or not, on narrow ground or open."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from pilotage.core.types import BoolArray, FloatArray
from pilotage.evaluation.pose_errors import rms
from pilotage.stack.navigator.goal_config import Mode

NARROW_M = 0.5
"""Ground is narrow where anything solid is nearer to the body's edge than this."""
REACTIVE = (Mode.LATERAL, Mode.AVOID, Mode.ESCAPE)
"""Modes in which something other than the path follower drives."""


def split_errors(
    trace: Mapping[str, FloatArray], distance_m: FloatArray, counted: BoolArray
) -> dict[str, object]:
    """Position RMSE by what drives the robot and by the room around it (night-watch report 5.1).

    Parameters
    ----------
    distance_m
        (N,) distance of the estimate from the truth at each step.
    counted
        (N,) which steps count.

    Returns
    -------
    ``position_rmse_narrow_m``, ``position_rmse_open_m`` and, where the navigator tells what it does,
    ``position_rmse_reactive_m``, ``position_rmse_following_m``; each only where a step counts for it.
    """
    narrow = trace["clearance_m"] < NARROW_M
    parts = {"narrow": narrow, "open": ~narrow}
    if "mode" in trace:
        reactive = np.isin(trace["mode"], [float(mode) for mode in REACTIVE])
        parts |= {"reactive": reactive, "following": trace["mode"] == float(Mode.FOLLOW)}
    out: dict[str, object] = {}
    for name, part in parts.items():
        chosen = distance_m[counted & part]
        if chosen.size:
            out[f"position_rmse_{name}_m"] = rms(chosen)
    return out
