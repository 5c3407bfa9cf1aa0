"""The numbers of the explorer that finishes."""

from __future__ import annotations

from pydantic import Field

from pilotage.missions.explorer import ExplorerConfig
from pilotage.stack.localization.sheet_smoother import SmootherConfig


class FrontierConfig(ExplorerConfig):
    """How it drives, chooses, returns to what it knows, and when it gives a cell up."""

    pose: SmootherConfig = SmootherConfig()
    resolution_m: float = Field(default=0.018, gt=0.001)
    """Of the evidence grid and of the lattice that ways are planned on."""
    room_m: float = Field(default=0.008, gt=0.0)
    """Least room between body and boxes."""
    wide_m: float = Field(default=0.025, gt=0.0)
    """Room that ways seek where they can."""
    speed_share: float = Field(default=0.92, gt=0.0, le=1.0)
    """Of the wheels' greatest speed, when driving straight: the rest is for steering."""
    turn_rate_rad_s: float = Field(default=1.2, gt=0.0)
    first_rest_s: float = Field(default=4.0, ge=0.0)
    rest_every_s: float = Field(default=18.0, gt=0.0)
    rest_s: float = Field(default=1.0, ge=0.0)
    """Rests show the gyroscope's bias."""
    solve_every_s: float = Field(default=4.0, gt=0.0)
    gather_every_solves: int = Field(default=8, ge=1)
    turn_cost_m_rad: float = Field(default=0.09, ge=0.0)
    hug_m: float = Field(default=0.012, ge=0.0)
    """Drawn to cells beside which nothing is left to do, by this much a side."""
    gain_m: float = Field(default=0.01, ge=0.0)
    """What a cell that no beam has seen is worth."""
    depth_m: float = Field(default=0.002, ge=0.0)
    depth_std: float = Field(default=1.5, ge=0.0)
    """A visit counts this deep inside a cell, plus so many standard deviations of the position."""
    return_std_m: float = Field(default=0.009, gt=0.0)
    """Less sure of its position than this, it returns to a landmark."""
    return_pause_s: float = Field(default=15.0, ge=0.0)
    tries: int = Field(default=3, ge=1)
    stuck_s: float = Field(default=6.0, gt=0.0)
    reviews: int = Field(default=4, ge=0)
    """How often it looks again, with the whole run smoothed, for cells that it missed."""
    tape_end_m: float = Field(default=0.03, gt=0.0)
    """The ends of tapes are looked for until they are known this well."""
    inspections: int = Field(default=40, ge=0)
    """How often, at most."""
