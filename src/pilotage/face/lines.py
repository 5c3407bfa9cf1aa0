"""Straight lines in one's own laser scans."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from pilotage.core import given
from pilotage.core.config import SMALLEST, validate
from pilotage.core.errors import InputError
from pilotage.sensors.lidar import LidarConfig
from pilotage.stack.perception.lines import DetectedLines, LineExtractionConfig, LineExtractor

__all__ = ["extract"]


def extract(
    ranges_m: ArrayLike,
    *,
    field_of_view_rad: float = math.radians(270.0),
    max_range_m: float = 20.0,
    range_var_m2: float = 1e-4,
    seed: int = 0,
    set: Mapping[str, Any] | None = None,  # noqa: A002 - as the command line calls it
) -> DetectedLines:
    """Find the straight lines of one scan, each with the covariance of its fit.

    Parameters
    ----------
    ranges_m
        (N,) counter-clockwise, spread evenly over the field of view, whose middle is straight ahead.
    max_range_m
        What reads this or more hit nothing.
    range_var_m2
        Variance of a range, which the lines' covariances come from.
    seed
        Of the samples that are tried.
    set
        Parameters of the extraction by name (``pilotage components ekf-walls`` lists them under ``lines``).

    Returns
    -------
    DetectedLines
        ``rho_alpha`` (L, 2), ``covs`` (L, 2, 2), ``ends_m`` (L, 4), in the sensor's frame.

    Raises
    ------
    InputError
        Where ranges or parameters are not what they should be.

    Examples
    --------
    >>> import numpy as np, pilotage as pl
    >>> angles = np.radians(np.linspace(-45, 45, 181))
    >>> found = pl.lines.extract(2.0 / np.cos(angles), field_of_view_rad=np.pi / 2)
    >>> len(found), float(np.round(found.rho_alpha[0, 0], 3))
    (1, 2.0)
    """
    ranges = given.array("ranges_m", ranges_m, None, finite=False)
    if ranges.size < 2:
        raise InputError(f"ranges_m: expected (N,) of two readings or more, found {ranges.shape}")
    if (ranges < 0.0).any():
        raise InputError(f"ranges_m: expected ranges of 0 or more, found {ranges.min():g}")
    limit_m = given.number("max_range_m", max_range_m, above=0.0)
    variance_m2 = given.number("range_var_m2", range_var_m2, SMALLEST)
    ranges[~(ranges <= limit_m)] = limit_m
    view_rad = given.number("field_of_view_rad", field_of_view_rad)
    values = {"beams": int(ranges.size), "field_of_view_rad": view_rad, "max_range_m": limit_m}
    lidar = validate(LidarConfig, values, "lidar")
    config = validate(LineExtractionConfig, {"max_range_m": limit_m, **given.settings("set", set)}, "lines")
    rng = np.random.default_rng(given.whole("seed", seed))
    return LineExtractor(config, lidar, variance_m2, rng).extract(ranges)
