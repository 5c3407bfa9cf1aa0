"""What the rolling ground is told: its grids, the matching, and with which speed the time to go reckons."""

from __future__ import annotations

from pydantic import Field

from pilotage.core.config import Config
from pilotage.sensors.sensor import NonNegative, Positive
from pilotage.stack.perception.movers import MoversConfig


class RollingMoversConfig(MoversConfig):
    """Tracks as fast robots need them: of who turns within half a second, whatever the laser's rate."""

    # A class of its own: as mere values of a default, whoever set another key of the part would lose them.
    acceleration_lasts_s: NonNegative = 0.2
    likeliest: bool = True


class RollingConfig(Config):
    """The grids, the matching, and with which speed the time to go reckons."""

    width_m: float = Field(default=10.0, ge=4.0, le=40.0)
    cell_m: float = Field(default=0.05, ge=0.02, le=0.2)
    reach_m: Positive = 5.0
    """Farther than this the laser does not add to the grid."""
    replan_steps: int = Field(default=4, ge=1, le=100)
    """The time to go is worked out anew every so many steps, and when the grid rolls."""
    match: bool = True
    match_reach_m: Positive = 0.2
    match_points: int = Field(default=180, ge=20, le=5000)
    point_std_m: Positive = 0.06
    drift_m: Positive = 0.04
    drift_rad: Positive = 0.05
    """Odometry's error after one metre, or one metre or radian, driven; it grows with their square root."""
    easy_m: Positive = 0.62
    """From this distance between base and obstacle on, full speed is reckoned with."""
    slow_m_s: Positive = 0.5
    """From where the footprint may turn on, less than a cell's doubt."""
    crawl_m_s: Positive = 0.08
    """Where it fits only straight: stopping, backing off and turning are part of the way through."""
    unseen_share: Positive = 0.7
    edge_m: float = Field(default=-0.01, ge=-0.1, le=1.0)
    """Kept beside the footprint's inner disc where the time to go looks for a way; below 0 for gaps whose
    middle no cell hits: what then proves too narrow has to be found out by trying."""
    movers: RollingMoversConfig = RollingMoversConfig()
    fade_hits: int = Field(default=3, ge=0, le=60)
    """Hits that a cell loses where the laser sees past it; 0 for a world in which nothing moves."""


PEOPLE_FADE_HITS = 60
"""Where people walk about, what a beam goes through is gone at once."""
