"""The maneuver navigator's parameters."""

from __future__ import annotations

from pydantic import Field

from pilotage.core.config import Config
from pilotage.sensors.sensor import Positive
from pilotage.stack.control.give_way import GiveWayConfig
from pilotage.stack.control.kanayama import KanayamaConfig
from pilotage.stack.control.own_half import OwnHalfConfig
from pilotage.stack.control.wander import WanderConfig
from pilotage.stack.navigator.yielding import YieldingConfig
from pilotage.stack.perception.moving_bodies import MovingBodiesConfig


class ManeuverConfig(Config):
    """How fast, and when a maneuver has gone wrong."""

    speed_m_s: Positive = 0.5
    acceleration_share: float = Field(default=0.4, gt=0.0, le=1.0)
    """Of the motion's braking, in the speed profile."""
    turn_share: float = Field(default=0.5, gt=0.0, le=1.0)
    """Of the top turn rate, for turns on the spot at a path's corners."""
    pause_s: float = Field(default=0.8, ge=0.0)
    """At each change of direction: the wheels turn meanwhile."""
    astray_m: Positive = 0.25
    """Farther from its reference than this it stops and plans anew."""
    tracking: KanayamaConfig | None = None
    """Of the tracking law, where the stack names no controller; None: along 1.0 / s within 0.45 m, and on
    lines with turns on the spot at their corners along 3.0 / s within 0.2 m."""
    own_half: OwnHalfConfig = OwnHalfConfig()
    """How near it comes to what its laser sees and its map does not explain."""
    yielding: YieldingConfig = YieldingConfig()
    """What it does where that stays in its way."""
    moving_bodies: MovingBodiesConfig = MovingBodiesConfig()
    wander: WanderConfig = WanderConfig()
    """How it drives about while it is lost."""
    give_way: GiveWayConfig = GiveWayConfig()
    """Alone on its floor it gives way to who walks; mates each stop in their own half."""
