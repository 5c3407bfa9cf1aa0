"""Every role that a mission can fill, and the registry of those who fill it."""

from __future__ import annotations

from typing import Any

from pilotage.core.registry import Registry
from pilotage.sensors.sensor import SENSORS
from pilotage.stack.control.controller import CONTROLLERS
from pilotage.stack.control.escape import ESCAPES
from pilotage.stack.control.polar_pose import POSE_CONTROLLERS
from pilotage.stack.control.reactive import REACTIVES
from pilotage.stack.exploration.explorer import EXPLORERS
from pilotage.stack.localization.heading_filter import HEADING_FILTERS
from pilotage.stack.localization.localizer import LOCALIZERS
from pilotage.stack.localization.rover_estimators import ESTIMATORS
from pilotage.stack.mapping.mapper import MAPPERS
from pilotage.stack.navigator.navigator import NAVIGATORS
from pilotage.stack.planning.local_planner import LOCAL_PLANNERS
from pilotage.stack.planning.planner import PLANNERS, SMOOTHERS

REGISTRIES: dict[str, Registry[Any]] = {
    "sensor": SENSORS,
    "navigator": NAVIGATORS,
    "localizer": LOCALIZERS,
    "heading_filter": HEADING_FILTERS,
    "planner": PLANNERS,
    "smoother": SMOOTHERS,
    "local_planner": LOCAL_PLANNERS,
    "controller": CONTROLLERS,
    "reactive": REACTIVES,
    "mapper": MAPPERS,
    "escape": ESCAPES,
    "explorer": EXPLORERS,
    "estimator": ESTIMATORS,
    "pose_controller": POSE_CONTROLLERS,
}
"""Roles by their key under ``stack`` (sensors: under ``robot.sensors``)."""
