"""A mission's world on live ROS 2 topics: somebody's own node drives our robot."""

from __future__ import annotations

import math
import time
from typing import Any

from pilotage.bridges.ros import messages as ros
from pilotage.bridges.ros.node import FLUSH_S, ros_node
from pilotage.core.errors import InputError
from pilotage.core.interruptions import answered
from pilotage.core.misfit import unfit_number
from pilotage.core.types import STOP, Pose2, Twist
from pilotage.experiments.build.robots import sensors_of
from pilotage.face.stepping import make
from pilotage.missions.mission import Mission
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.readings import LidarScan, OdometryIncrement, Readings

HELD_S = 0.5
"""A command that is older than this, in simulated time, is no command any more: the robot stops."""
LATE_S = 0.05
"""Behind its time by more than this a step counts as late."""


def serve(mission: Mission, speed: float = 1.0, duration_s: float | None = None) -> dict[str, Any]:
    """Step a mission's world in time and speak ``/clock``, ``/scan``, ``/odom``, ``/tf``; hear ``/cmd_vel``.

    Parameters
    ----------
    speed
        Simulated seconds a second.
    duration_s
        Simulated; None: until it is interrupted.

    Returns
    -------
    Steps, messages sent and received by topic, late steps, collisions, and where the robot truly ended.
    ``/tf`` is ``silent`` where neither ``tf2_msgs`` nor ``cyclonedds`` is installed; ``/odom`` carries the
    same transform.

    Raises
    ------
    InputError
        Where ROS 2 is not installed, the mission has several robots, or the speed is none.
    """
    if mission.robots:
        raise InputError(f"serve: expected a mission with one robot, found {len(mission.robots)}")
    if not (math.isfinite(speed) and speed > 0.0):
        raise InputError(f"--speed: expected a number above 0, found {speed:g}")
    sheets = sensors_of(mission.members[0], "robot")
    lidar, sheet = next(((n, s) for n, s in sheets.items() if isinstance(s, LidarConfig)), ("", None))
    sim, dt_s = make(mission), mission.run.dt_s
    heard: list[tuple[float, Twist]] = [(-math.inf, STOP)]
    late = steps = refused = 0
    with ros_node("pilotage") as node:
        topics = {"/clock": ros.CLOCK, "/odom": ros.ODOMETRY, "/tf": ros.TRANSFORMS}
        if sheet is not None:
            topics["/scan"] = ros.SCAN
        silent = [topic for topic, msgtype in topics.items() if not node.publishes(topic, msgtype)]

        def hear(message: Any) -> None:
            nonlocal refused
            asked = message.linear.x, message.angular.z, message.linear.y
            fits = not any(map(unfit_number, asked))
            refused += not fits
            heard[0] = steps * dt_s, Twist(*asked) if fits else STOP

        node.listens("/cmd_vel", ros.TWIST, hear)
        readings, reckoned = sim.reset(), Pose2(0.0, 0.0, 0.0)
        sim.step(STOP)  # compiles
        readings = sim.reset()
        due_s = time.perf_counter()
        try:
            while True:
                steps += 1
                reckoned, speeds = _odometry(readings, reckoned, dt_s)
                t_s = readings.t_s
                node.publish("/clock", {"clock": ros.stamp(t_s)})
                scan = readings.by_sensor.get(lidar)
                if sheet is not None and isinstance(scan, LidarScan):
                    angles = sheet.beam_angles_rad()
                    node.publish(
                        "/scan", ros.laser_scan(t_s, "laser", angles, scan.ranges_m, sheet.max_range_m)
                    )
                node.publish("/odom", ros.odometry(t_s, "odom", "base_link", reckoned, speeds))
                frames = [ros.transform(t_s, "odom", "base_link", reckoned)]
                if sheet is not None:
                    frames.append(ros.transform(t_s, "base_link", "laser", sheet.mount.pose))
                node.publish("/tf", {"transforms": frames})
                if duration_s is not None and t_s >= duration_s - 1e-9:
                    break
                due_s += dt_s / speed
                node.spin_until(due_s)
                late += time.perf_counter() - due_s > LATE_S
                at_s, command = heard[0]
                readings = sim.step(command if t_s - at_s <= HELD_S else STOP)
            node.spin_until(time.perf_counter() + FLUSH_S)
        except KeyboardInterrupt:
            answered()  # how a server without a duration ends: it tells what it did
        return {
            "mission": mission.mission,
            "speed": speed,
            "steps": steps,
            "duration_s": readings.t_s,
            "late_steps": late,
            "sent": node.sent,
            "silent": {topic: f"{topics[topic].split('/')[0]} is not installed" for topic in silent},
            "received": node.received,
            "refused": {"/cmd_vel": refused},
            "collisions": sim.collisions[0],
            "end": {"x_m": sim.poses[0].x_m, "y_m": sim.poses[0].y_m, "theta_rad": sim.poses[0].theta_rad},
        }


def _odometry(readings: Readings, before: Pose2, dt_s: float) -> tuple[Pose2, ros.Fields]:
    """The pose that the wheels add up to, and their speeds."""
    for reading in readings.by_sensor.values():
        if isinstance(reading, OdometryIncrement):
            return before.compose(moved(reading)), ros.twist(
                reading.distance_m / dt_s, reading.angle_rad / dt_s, reading.lateral_m / dt_s
            )
    return before, ros.twist(0.0, 0.0)


def moved(reading: OdometryIncrement) -> Pose2:
    """Where an increment leads, along its arc (Thrun et al. 2005, section 5.4)."""
    half = 0.5 * reading.angle_rad
    share = math.sin(half) / half if abs(half) > 1e-9 else 1.0
    c, s = share * math.cos(half), share * math.sin(half)
    return Pose2(
        c * reading.distance_m - s * reading.lateral_m,
        s * reading.distance_m + c * reading.lateral_m,
        reading.angle_rad,
    )
