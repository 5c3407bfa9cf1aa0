"""Straight lines in a laser scan, each with the covariance of its fit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from pydantic import Field

from pilotage.core.config import Config
from pilotage.core.types import FloatArray, IntArray
from pilotage.kernels.arrays import unnamed
from pilotage.kernels.lines import clustering
from pilotage.kernels.lines.extraction import LineRules
from pilotage.kernels.lines.scan_lines import lines_of_scan
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.sensor import NonNegative, Positive

MAX_LINES = 48
UNIFORMS = 512
"""Random numbers drawn for a scan, used round and round."""


class LineExtractionConfig(Config):
    """From a scan to lines.

    A reading over ``max_range_m`` is no wall (None: over what the scanner surely reaches), and a cluster of
    fewer than ``cluster_points`` is dropped, as in the night-watch report.
    """

    max_range_m: Positive | None = None
    cutoff_m: Positive = 0.5
    """Points no farther apart belong to one cluster."""
    cluster_points: int = Field(default=10, ge=2)
    line_points: int = Field(default=8, ge=3)
    line_length_m: Positive = 0.2
    inlier_sigmas: Positive = 4.0
    """A point this many standard deviations of the range from a line is none of its own."""
    gap_m: Positive = 0.5
    """A line ends where the next of its points is farther than this along it."""
    end_margin_m: NonNegative = 0.05
    """Points this near the ends of a line are not fitted: at a corner they may be the next wall's. At least
    as much as an inlier may lie off the line, because so far into it does the next wall pass for its own."""
    straight: float = Field(default=0.9999, gt=0.5, lt=1.0)
    """Share of true walls whose residuals pass for straight."""
    iterations: int = Field(default=60, ge=1, le=10_000)


@dataclass(frozen=True, slots=True)
class DetectedLines:
    """Lines of one scan, in the sensor's frame.

    Attributes
    ----------
    rho_alpha
        (L, 2) distance >= 0 in m and angle of the normal in rad: x cos(alpha) + y sin(alpha) = rho.
    covs
        (L, 2, 2) covariance of rho and alpha.
    ends_m
        (L, 4) x0, y0, x1, y1 of the fitted extent, in beam order.
    points_m, clusters, members
        (N, 2) the scan's points, and per point its cluster and its line, -1 for none.
    """

    rho_alpha: FloatArray
    covs: FloatArray
    ends_m: FloatArray
    points_m: FloatArray
    clusters: IntArray
    members: IntArray

    def __len__(self) -> int:
        return int(self.rho_alpha.shape[0])


class LineExtractor:
    """Clusters a scan and takes the lines out of each cluster.

    Parameters
    ----------
    range_var_m2
        Variance of a range that the lines' covariances come from; above 0.
    rng
        Stream of the samples that RANSAC tries.

    Fails on curved walls (cut into short chords or rejected as not straight), and on walls seen so
    obliquely that neighbouring points are farther apart than the cutoff.
    """

    def __init__(
        self,
        config: LineExtractionConfig,
        lidar: LidarConfig,
        range_var_m2: float,
        rng: np.random.Generator,
    ) -> None:
        self._config = config
        threshold_m = config.inlier_sigmas * float(np.sqrt(range_var_m2))
        rules = LineRules(
            range_var_m2,
            threshold_m,
            config.gap_m,
            max(config.end_margin_m, threshold_m),
            config.line_points,
            config.line_length_m,
            float(scipy.special.ndtri(config.straight)),
            config.iterations,
        )
        self._rules = unnamed(rules)
        self._max_range = min(config.max_range_m or lidar.sure_range_m, np.nextafter(lidar.max_range_m, 0.0))
        self._step = lidar.beam_step_rad
        self._directions = clustering.beam_directions(
            float(lidar.beam_angles_rad()[0]), lidar.beam_step_rad, lidar.beams
        )
        self._rng = rng

    def extract(self, ranges_m: FloatArray) -> DetectedLines:
        """Find the lines of one scan (N,)."""
        config = self._config
        return DetectedLines(
            *lines_of_scan(
                ranges_m,
                self._directions,
                self._step,
                self._max_range,
                config.cutoff_m,
                config.cluster_points,
                self._rules,
                self._rng.random(UNIFORMS),
                MAX_LINES,
            )
        )
