"""What can be set about the navigator that explores a floor."""

from __future__ import annotations

from pydantic import Field

from pilotage.core.config import Config
from pilotage.sensors.sensor import NonNegative, Positive


class FloorExplorerConfig(Config):
    """What is worth going to, when to close a loop, and when it is done."""

    clearance_m: NonNegative = 0.06
    """Beside the robot's radius, of the paths that it plans."""
    squeeze_m: NonNegative = 0.03
    """The same through gaps to rooms that are left behind them: no narrower ones."""
    least_frontier_m: Positive = 0.4
    look_m: Positive = 0.35
    """A frontier is looked at from this near to where it is best seen."""
    cross_m: Positive = 0.1
    """So near it comes to a place on a frontier that it drives to because looking did not do."""
    replan_s: Positive = 1.0
    switch_m: NonNegative = 2.0
    """Another frontier must be nearer by this before it is gone to instead."""
    turn_cost_m_per_rad: NonNegative = 0.4
    length_gain: NonNegative = 0.3
    """A metre of frontier is worth so many metres of path."""
    sight_share: Positive = 0.8
    """A frontier farther from all walls than this share of the scanner's reach has none in sight,"""
    open_cost_m: NonNegative = 50.0
    """and is worth so many metres of path to others."""
    unsure_m: Positive = 1.0
    """Standard deviation of its position from which it goes back to close a loop first."""
    stall_s: Positive = 15.0
    arrival_m: Positive = 0.04
    """How near to the start it has to believe to be in the end."""
    resolution_m: float = Field(default=0.05, ge=0.005, le=10.0)
    """Side of a cell of the map that it drives by, where the localizer makes none,"""
    map_resolution_m: float | None = Field(default=None, ge=0.005, le=10.0)
    """and of the map that it leaves, drawn anew from the same scans: walls are known to half a cell."""
    keyframe_m: Positive = 0.25
    keyframe_rad: Positive = 0.2
    """How far apart the scans of its map are, where the localizer makes none."""
    reverse_m_s: NonNegative = 0.3
