"""Distances of nodes from a path, to the bit those that numpy works out point by point."""

import numpy as np
import pytest

from pilotage.core.types import FloatArray
from pilotage.kernels.geometry.near_paths import away_from_path


@pytest.mark.parametrize("seed", range(5))
def test_to_the_bit_what_hypot_says_of_each_point(seed: int) -> None:
    """Orders to make room compare them with sums of radii: rounded otherwise they send robots elsewhere."""
    rng = np.random.default_rng(seed)
    xs: FloatArray = np.linspace(-3.2, 2.65, 40)
    ys: FloatArray = np.linspace(1.1, 4.7, 25)
    path = np.cumsum(0.25 * rng.normal(size=(30, 2)), axis=0)
    path[7:9] = path[3]
    nodes = np.stack(np.meshgrid(xs, ys), axis=-1)
    expected = np.min([np.hypot(*(nodes - place).transpose(2, 0, 1)) for place in path], axis=0)
    np.testing.assert_array_equal(away_from_path(xs, ys, path), expected)
