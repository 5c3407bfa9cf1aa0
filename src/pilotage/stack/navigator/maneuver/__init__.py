"""The maneuver navigator: a state machine of planning, following exactly, backing out and being lost."""

from pilotage.stack.navigator.maneuver.config import ManeuverConfig
from pilotage.stack.navigator.maneuver.navigator import ManeuverNavigator

__all__ = ["ManeuverConfig", "ManeuverNavigator"]
