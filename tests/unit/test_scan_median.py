"""The median of a scan's ranges, as numpy's, of those that are numbers."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pilotage.kernels.scans.median import median_of_known

RANGE_M = st.one_of(st.just(np.nan), st.just(np.inf), st.floats(0.0, 40.0), st.sampled_from([1.0, 20.0]))


@given(st.lists(RANGE_M, max_size=60))
def test_it_is_numpys_of_the_ranges_that_are_known(values: list[float]) -> None:
    ranges = np.array(values, dtype=np.float64)
    before = ranges.copy()
    known = ranges[~np.isnan(ranges)]
    assert median_of_known(ranges) == (np.median(known) if len(known) else 0.0)
    np.testing.assert_array_equal(ranges, before)


@pytest.mark.parametrize("count", [0, 3])
def test_where_nothing_is_known_it_is_zero(count: int) -> None:
    assert median_of_known(np.full(count, np.nan)) == 0.0
