"""Coverage of a floor by laser: how long ago each cell of it was last seen."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy

from pilotage.core.types import FloatArray, Pose2
from pilotage.kernels.scans.rays import Fan
from pilotage.kernels.scans.seen_cells import mark_seen
from pilotage.maps.world_map import WorldMap
from pilotage.sensors.lidar import LidarConfig
from pilotage.sim.bodies.body import Body
from pilotage.sim.worlds.world import fan_of

MOST_CELLS = 40_000
SPANS_S = (10.0, 30.0, 60.0)
"""What the floor that was seen within is told of."""


@dataclass(frozen=True, slots=True)
class Eye:
    """A robot's scanner, made ready for looking again and again.

    Attributes
    ----------
    mount
        Where it sits on the body.
    fan, step_rad
        Its beams without noise, and the angle between them, above 0.
    """

    mount: Pose2
    fan: Fan
    step_rad: float

    @staticmethod
    def of(lidar: LidarConfig) -> Eye:
        """Of its data sheet."""
        mount = lidar.mount.pose
        fan = fan_of(lidar.beam_angles_rad(), lidar.max_range_m)
        return Eye(mount, fan, max(lidar.beam_step_rad, 1e-9))


class FloorAges:
    """Cells of the floor that is connected to a place, and when each was last in some robot's view.

    Attributes
    ----------
    cells_xy_m, cell_m
        (K, 2) their middles, and the length of their sides.
    seen_s
        (K,) when each was last seen; 0 for one that never was.
    """

    def __init__(self, chart: WorldMap, place_xy_m: FloatArray, cell_m: float) -> None:
        xmin, ymin, xmax, ymax = chart.bounds_m
        cell_m = max(cell_m, math.sqrt((xmax - xmin) * (ymax - ymin) / MOST_CELLS))
        xs = np.arange(xmin + 0.5 * cell_m, xmax, cell_m)
        ys = np.arange(ymin + 0.5 * cell_m, ymax, cell_m)
        grid = np.stack(np.meshgrid(xs, ys), axis=-1)
        # A cell that a wall runs through is no floor of one side of it.
        open_floor = chart.field.at(grid.reshape(-1, 2)).reshape(grid.shape[:2]) > 0.5 * cell_m
        regions, _ = scipy.ndimage.label(open_floor)
        free = grid[regions > 0]
        nearest = int(np.argmin(np.hypot(*(free - place_xy_m).T))) if len(free) else 0
        home = regions[regions > 0][nearest] if len(free) else 1
        self.cells_xy_m: FloatArray = np.ascontiguousarray(grid[regions == home])
        self.cell_m = cell_m
        self.seen_s: FloatArray = np.zeros(len(self.cells_xy_m))
        self._ages: list[tuple[float, float, float]] = []
        self._within: list[list[float]] = []
        self._sum_s = np.zeros(len(self.cells_xy_m))

    def look(self, t_s: float, body: Body, eye: Eye) -> None:
        """What one robot sees now."""
        pose = body.pose.compose(eye.mount)
        place = np.array([[pose.x_m, pose.y_m, pose.theta_rad]])
        first_rad, *_, reach_m = eye.fan
        mark_seen(
            self.seen_s,
            self.cells_xy_m,
            pose.x_m,
            pose.y_m,
            pose.theta_rad + first_rad,
            eye.step_rad,
            body.world.scan_along(place, eye.fan, body.own[None, :])[0],
            reach_m,
            self.cell_m * math.sqrt(0.5),
            t_s,
        )

    def sample(self, t_s: float, window_s: float) -> None:
        """Count the ages of this moment."""
        age = t_s - self.seen_s
        self._sum_s += age
        self._within.append([float((age <= span_s).mean()) for span_s in SPANS_S])
        self._ages.append((float((age <= window_s).mean()), float(age.mean()), float(age.max())))

    def series(self) -> FloatArray:
        """(S, 3) of every sample: share seen within the window, mean and largest age."""
        return np.array(self._ages, dtype=np.float64).reshape(-1, 3)

    def mean_s(self) -> FloatArray:
        """(K,) mean age of each cell."""
        return self._sum_s / max(len(self._ages), 1)

    def metrics(self, first_sample: int) -> dict[str, object]:
        """Over the samples from one on: means, the largest age, and the least share seen within each span."""
        table = self.series()[first_sample:]
        if not len(table):
            return {}
        least = np.min(self._within[first_sample:], axis=0)
        return {
            **{f"seen_within_{span:g}_s": float(share) for span, share in zip(SPANS_S, least, strict=True)},
            "coverage_fraction": float(table[:, 0].mean()),
            "coverage_age_mean_s": float(table[:, 1].mean()),
            "coverage_age_worst_s": float(table[:, 2].max()),
        }
