"""The night-watch report's reactive control by three ultrasonic sensors (its 4.2 and 4.3)."""

from __future__ import annotations

import math

from pydantic import Field

from pilotage.core.config import Config
from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray, Pose2
from pilotage.maps.near_walls import NearWalls
from pilotage.sensors.readings import Readings
from pilotage.sensors.sensor import NonNegative, Positive
from pilotage.sensors.ultrasonic import UltrasonicConfig
from pilotage.stack.control.reactive import REACTIVES, Reaction, ReactionKind
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.perception.sonar import SonarRing, SonarView


class UltrasonicReactionConfig(Config):
    """Thresholds and gains; the defaults are the report's where it gives them.

    ``ignore_mapped`` false avoids everything in front, as the report's robot did, mapped walls included.
    """

    lateral_gain_rad_s_per_m: NonNegative = 0.4
    lateral_below_m: Positive = 1.0
    frontal_below_m: Positive = 1.0
    release_above_m: Positive = 1.2
    avoidance_turn_rad_s: Positive = 0.5
    avoidance_speed_m_s: NonNegative = 0.15
    creep_below_m: Positive = 0.45
    """Nearer than this the robot turns on the spot."""
    trapped_after_rad: Positive = Field(default=2.4, le=4 * math.pi)
    """Turned this far without a way out: trapped."""
    hall_width_m: NonNegative = 1.8
    """Two walls no farther apart than this are a hall; the robot takes its middle. 0 switches it off."""
    hall_gain_rad_s_per_m: Positive = 1.5
    hall_turn_limit_rad_s: Positive = 0.5
    hall_exit_m: NonNegative = 1.3
    """The cones look about this far ahead: their view of the hall ends that much before the hall does."""
    ignore_mapped: bool = True
    mapped_tolerance_m: Positive = 0.3
    mapped_widening_rad: NonNegative = 0.06


@REACTIVES.add("ultrasonic", UltrasonicReactionConfig)
class UltrasonicReaction:
    """Lateral repulsion, hall centring and the frontal avoidance turn.

    Fails in concave traps deeper than its reach: it says ``TRAPPED`` then, and an escape takes over.
    Obstacles thinner than the gap between the cones are seen late or not at all.
    """

    def __init__(self, config: UltrasonicReactionConfig, robot: RobotKnowledge) -> None:
        sensors = robot.sensors_of(UltrasonicConfig)
        if not sensors:
            raise InputError(
                "reactive 'ultrasonic': expected ultrasonic sensors among robot.sensors, found none"
            )
        if config.release_above_m < config.frontal_below_m:
            raise InputError(
                "stack.reactive.release_above_m: expected at least frontal_below_m "
                f"({config.frontal_below_m:g}), found {config.release_above_m:g}"
            )
        self._config = config
        self._ring = SonarRing(sensors, config.mapped_tolerance_m, config.mapped_widening_rad)
        self._dt_s = robot.dt_s
        self._side = 0.0
        self._turned_rad = 0.0
        self._hall_seen_at: Pose2 | None = None

    def reset(self) -> None:
        """End an avoidance turn."""
        self._side = 0.0
        self._turned_rad = 0.0

    def step(
        self, readings: Readings, pose: Pose2, walls: NearWalls, circles_m: FloatArray, straight: bool
    ) -> Reaction:
        """Frontal objects first, then halls, then lateral objects."""
        config = self._config
        watch = max(config.frontal_below_m, config.release_above_m)
        view = self._ring.look(readings, pose, walls, circles_m, watch)
        front = view.front_unexpected_m if config.ignore_mapped else view.front_m
        threshold = config.release_above_m if self._side else config.frontal_below_m
        if front < threshold:
            return self._avoid(view, front)
        self.reset()
        if straight and view.left_beside_m + view.right_beside_m <= config.hall_width_m:
            self._hall_seen_at = pose
            return self._centre(view)
        if straight and self._still_inside_hall(pose):
            return Reaction(ReactionKind.HALL, 0.0, math.inf, view.front_m)
        self._hall_seen_at = None
        return self._repel(view)

    def _still_inside_hall(self, pose: Pose2) -> bool:
        """Whether the robot has not yet driven as far as the cones looked when they last saw the hall."""
        seen = self._hall_seen_at
        if seen is None:
            return False
        return math.hypot(pose.x_m - seen.x_m, pose.y_m - seen.y_m) < self._config.hall_exit_m

    def _avoid(self, view: SonarView, front_m: float) -> Reaction:
        """Turn towards the side whose objects are farther, and keep to that side until it is free."""
        config = self._config
        if self._side == 0.0:
            self._side = 1.0 if view.left_m >= view.right_m else -1.0
        self._turned_rad += config.avoidance_turn_rad_s * self._dt_s
        trapped = self._turned_rad > config.trapped_after_rad
        speed = config.avoidance_speed_m_s if front_m > config.creep_below_m else 0.0
        kind = ReactionKind.TRAPPED if trapped else ReactionKind.AVOID
        return Reaction(kind, self._side * config.avoidance_turn_rad_s, speed, front_m)

    def _centre(self, view: SonarView) -> Reaction:
        """Steer to the middle: the cones look ahead, which gives the damping."""
        config = self._config
        offset = 0.5 * (view.left_beside_m - view.right_beside_m)
        w = config.hall_gain_rad_s_per_m * offset
        limit = config.hall_turn_limit_rad_s
        return Reaction(ReactionKind.HALL, min(max(w, -limit), limit), math.inf, view.front_m)

    def _repel(self, view: SonarView) -> Reaction:
        """Turn away from near lateral objects, in proportion to how near they are."""
        config = self._config
        left = max(config.lateral_below_m - view.left_m, 0.0)
        right = max(config.lateral_below_m - view.right_m, 0.0)
        if left == 0.0 and right == 0.0:
            return Reaction(ReactionKind.NONE, 0.0, math.inf, view.front_m)
        w = config.lateral_gain_rad_s_per_m * (right - left)
        return Reaction(ReactionKind.LATERAL, w, math.inf, view.front_m)
