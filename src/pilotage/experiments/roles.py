"""Every role that a mission can fill, and the registry of those who fill it."""

from __future__ import annotations

from typing import Any

from pilotage.core.registry import Registry
from pilotage.evaluation.tasks.task import TASKS
from pilotage.models.motion.motion import MOTIONS
from pilotage.sensors.sensor import SENSORS
from pilotage.sim.faults.fault import FAULTS
from pilotage.sim.people.people import PEOPLE
from pilotage.stack.control.controller import CONTROLLERS
from pilotage.stack.control.escape import ESCAPES
from pilotage.stack.control.local.role import LOCAL_CONTROLLERS
from pilotage.stack.control.reactive import REACTIVES
from pilotage.stack.interface import NAVIGATORS
from pilotage.stack.localization.heading_filter import HEADING_FILTERS
from pilotage.stack.localization.localizer import LOCALIZERS
from pilotage.stack.mapping.mapper import MAPPERS
from pilotage.stack.patrol.strategy import STRATEGIES
from pilotage.stack.planning.local_planner import LOCAL_PLANNERS
from pilotage.stack.planning.planner import PLANNERS, SMOOTHERS

ROLES: dict[str, Registry[Any]] = {
    "task": TASKS,
    "motion": MOTIONS,
    "sensor": SENSORS,
    "fault": FAULTS,
    "people": PEOPLE,
    "navigator": NAVIGATORS,
    "localizer": LOCALIZERS,
    "heading": HEADING_FILTERS,
    "planner": PLANNERS,
    "smoother": SMOOTHERS,
    "local_planner": LOCAL_PLANNERS,
    "controller": CONTROLLERS,
    "local_controller": LOCAL_CONTROLLERS,
    "reactive": REACTIVES,
    "mapper": MAPPERS,
    "escape": ESCAPES,
    "strategy": STRATEGIES,
}
"""Roles by their key under ``stack``; task, motion, sensors, faults, people stand elsewhere in a mission."""
