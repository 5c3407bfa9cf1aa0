"""What can be set about the patrol navigator, and the modes that its trace records."""

from __future__ import annotations

from enum import IntEnum

from pydantic import Field

from pilotage.core.config import Config
from pilotage.sensors.sensor import NonNegative, Positive
from pilotage.stack.control.wander import WanderConfig
from pilotage.stack.patrol.watch import WatchConfig


class Mode(IntEnum):
    """What the robot is doing, as the trace records it."""

    DRIVE = 0
    WAIT = 1
    YIELD = 2
    LOST = 3
    CHARGE = 4
    HOLD = 5


class WindowConfig(Config):
    """The dynamic window: its grid and what its arcs cost."""

    speeds: int = Field(default=6, ge=2, le=101)
    turns: int = Field(default=15, ge=3, le=201)
    horizon_s: Positive | None = None
    """None: 0.6 s, or 0.9 s for who takes longer to stop: long arcs end in the walls of small rooms."""
    heading_s_per_rad: NonNegative = 0.3
    near_cost_s: NonNegative = 0.5
    soft_m: Positive = 0.25


class PatrolNavigatorConfig(Config):
    """What it keeps from walls and from others, when it gives way, how often it talks."""

    spacing_m: Positive | None = None
    """Of the nodes that the time to go is worked out on. None: 0.15 m, or more where a map is large."""
    plan_margin_m: NonNegative = 0.08
    """Beyond the body, of the places that it plans through."""
    margin_m: NonNegative = 0.06
    """Beyond the body, of where its braking ends."""
    gap_m: NonNegative = 0.10
    """What two that may move leave between them."""
    lane_m: NonNegative = 0.35
    """To the right of the middle, where the floor is wide enough for two."""
    tolerance_m: Positive = 0.2
    """Returns farther from everything on the map are of something that may move."""
    watch_m: Positive = 3.0
    """It goes around what may move within this distance."""
    look_m: Positive = 8.0
    """So far it looks for somebody in a passage that has room for one."""
    hold_s: Positive = 25.0
    """So long it lets somebody come out of such a passage, or back out of it, before it goes elsewhere."""
    patience_s: Positive = 3.0
    """Without progress for so long, and up to twice as long by a draw, it gives way."""
    yield_s: Positive = 8.0
    precede_s: Positive = 20.0
    """Who came no nearer to its next place for so long goes first, and others make room as it tells them."""
    message_period_s: Positive = 1.0
    ask_s: Positive = 1.0
    """While it waits its strategy is asked so often."""
    window: WindowConfig = WindowConfig()
    wander: WanderConfig = WanderConfig()
    watch: WatchConfig = WatchConfig()
