"""The few parameters of the mapper; one set serves every building."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from pilotage.core.config import Config


class SlamConfig(Config):
    """Parameters of ``pilotage slam``."""

    max_range_m: float = Field(25.0, gt=1.0, le=200.0)
    """Hits farther away are not matched; the map has them."""
    use_odometry: bool = True
    calibrate_beam_spacing: bool = True
    keyframe_distance_m: float = Field(0.25, gt=0.02, le=2.0)
    keyframe_turn_rad: float = Field(0.2, gt=0.02, le=1.0)
    local_keyframes: int = Field(15, ge=3, le=100)
    submap_length_m: float = Field(4.0, gt=0.5, le=50.0)
    """Path a submap covers, a turn of one radian counting as 0.3 m; submaps overlap by half."""
    search_windows_m: tuple[float, ...] = (1.0, 1.0, 2.0, 2.0, 4.0, 4.0, 8.0, 8.0, 8.0)
    """Half a search window's side at most, round by round: what is nearly certain is closed first."""
    search_cell_m: float = Field(0.1, gt=0.01, le=0.5)
    least_score: float = Field(0.45, ge=0.0, le=1.0)
    """Mean score a point from which a candidate is looked at further."""
    least_agreement: float = Field(0.75, ge=0.0, le=1.0)
    """Share of each submap's points that must fall on the other's walls, of those that fall where it saw."""
    least_overlap: float = Field(0.3, ge=0.0, le=1.0)
    most_ambiguity: float = Field(0.85, gt=0.0, le=1.0)
    """Score of the second-best place in the window over that of the best."""
    gate_probability: float = Field(0.9999, gt=0.5, lt=1.0)
    """Of the chi-square with the graph, and of two closures given each other."""
    least_support: int = Field(2, ge=1, le=20)
    """How many closures of a round must agree before any of them counts."""
    resolution_m: float = Field(0.05, gt=0.005, le=0.5)
    """Side of a cell of the map."""
    trajectory: Literal["scanner", "base"] = "scanner"
    """Whose poses ``trajectory.tum`` holds: the scanner's, or the robot's by the log's mount."""
