"""What stands where the laser does not look: known from before, but for what the belief drifted since."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.angles import TWO_PI, is_in_view
from pilotage.core.types import Pose2
from pilotage.kernels.control.footprint import polygon_distance
from pilotage.stack.control.local.role import LocalView
from pilotage.stack.control.local.rolling import Scene


def blind_rad(view: LocalView) -> float:
    """Width of the sector that no beam looks into, if it holds what is straight behind; else 0."""
    first, last = float(view.beam_angles_rad[0]), float(view.beam_angles_rad[-1])
    step = (last - first) / max(len(view.beam_angles_rad) - 1, 1)
    behind = math.pi - view.mount.theta_rad
    return 0.0 if is_in_view(behind, first, last, step) else TWO_PI - (last - first)


def blind_clearance_m(view: LocalView, scene: Scene, enough_m: float) -> float:
    """How far the footprint is from what was seen and is in no beam's way now; at most ``enough_m``."""
    ground, body = scene.ground, scene.body
    pose = Pose2.from_array(scene.pose)
    reach_m = body.outer_m + enough_m
    row = max(0, math.floor((pose.y_m - reach_m - ground.y0_m) * ground.per_cell))
    column = max(0, math.floor((pose.x_m - reach_m - ground.x0_m) * ground.per_cell))
    cells = math.ceil(2.0 * reach_m * ground.per_cell) + 1
    rows, columns = np.nonzero(ground.hits[row : row + cells, column : column + cells])
    in_base = pose.seen(ground.mean[(rows + row) * ground.hits.shape[1] + columns + column])
    mount, angles = view.mount, view.beam_angles_rad
    bearing = np.arctan2(in_base[:, 1] - mount.y_m, in_base[:, 0] - mount.x_m) - mount.theta_rad
    past_first = (bearing - float(angles[0])) % (2.0 * math.pi)
    blind = in_base[past_first > float(angles[-1] - angles[0])]
    return min((float(polygon_distance(px, py, body.polygon)) for px, py in blind), default=enough_m)
