"""What can be set about the goal navigator, and the modes that its trace records."""

from __future__ import annotations

from enum import IntEnum

from pydantic import Field

from pilotage.core.config import Config
from pilotage.sensors.sensor import NonNegative, Positive
from pilotage.stack.control.give_way import GiveWayConfig
from pilotage.stack.control.guard import GuardConfig
from pilotage.stack.control.make_room import MakeRoomConfig
from pilotage.stack.control.wander import WanderConfig
from pilotage.stack.perception.moving_bodies import MovingBodiesConfig


class Mode(IntEnum):
    """What the robot is doing, as the trace records it."""

    FOLLOW = 0
    LATERAL = 1
    AVOID = 2
    ESCAPE = 3
    REPLAN = 4
    ARRIVED = 5
    WANDER = 6
    WAIT = 7


class GoalNavigatorConfig(Config):
    """When to watch, when to give up a plan, and when it is done."""

    arrival_m: Positive = 0.15
    """How near it has to believe to be; never farther than half the goal's tolerance."""
    watch_ahead_m: NonNegative = 0.9
    """Where this much of the local path ahead comes too near a mapped obstacle: stop and replan; 0: never."""
    watch_margin_m: NonNegative = 0.03
    """Too near: below the body's radius plus this."""
    watch_plan_s: NonNegative | None = None
    """Where something new stands anywhere on the plan ahead it plans anew, no two plans in less time.

    None: it drives up to it and reacts, as the night-watch report's robot does.
    """
    stall_s: Positive = 20.0
    stall_progress_m: Positive = 0.5
    waypoint_ahead_m: Positive = 0.4
    straight_ahead_m: Positive = 1.2
    straight_below_rad: Positive = 0.35
    """A plan that turns less than this over the next stretch goes straight on: a hall may be centred."""
    fallback_margins_m: tuple[Positive, ...] = (0.10, 0.06)
    """Replans that fail at the planner's clearance try the body's radius plus these."""
    look_around_s: NonNegative = 1.0
    """How long it stands still first where its start pose seems too near an obstacle to plan from."""
    cruise_speed_m_s: Positive = 0.5
    max_replans: int = Field(default=30, ge=0)
    """On the way to each goal, but for those among people, before it gives up."""
    guard: GuardConfig = GuardConfig()
    wander: WanderConfig = WanderConfig()
    moving_bodies: MovingBodiesConfig = MovingBodiesConfig()
    give_way: GiveWayConfig = GiveWayConfig()
    make_room: MakeRoomConfig = MakeRoomConfig()
