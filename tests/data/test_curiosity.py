"""The Curiosity rover's own log: does dead reckoning know what it does not know?"""

from __future__ import annotations

from pathlib import Path

import pytest

from pilotage.experiments.recordings.stops import localize_stops

LOG = Path(__file__).resolve().parents[3] / "shared" / "data" / "curiosity" / "waypoints.csv"

pytestmark = pytest.mark.skipif(not LOG.is_file(), reason="the rover's stops are not on this machine")


def test_its_ellipses_hold_its_stops(tmp_path: Path) -> None:
    """95 % lies within the interval of the coverage over stretches, and the covariance is not just wide."""
    metrics, folder = localize_stops(LOG, tmp_path)
    assert metrics["stops"] == 548
    assert float(str(metrics["ellipse_coverage"])) > 0.90
    assert float(str(metrics["ellipse_coverage_low"])) < 0.95 < float(str(metrics["ellipse_coverage_high"]))
    assert 1.0 < float(str(metrics["position_nees_mean"])) < 3.0
    assert 0.85 < float(str(metrics["odometer_share"])) < 0.97
    assert float(str(metrics["textbook_ellipse_coverage"])) < 0.05
    assert (folder / "trace.parquet").is_file()
