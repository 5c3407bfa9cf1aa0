"""A stranger's node: follows waypoints by ``/odom`` and ``/cmd_vel`` alone, and counts what it hears.

Knows rclpy and nothing of pilotage. Arguments: waypoints as JSON, pose of the odometry's frame as JSON.
Prints a line when it listens, and a JSON object when nothing has come for three seconds.
"""

from __future__ import annotations

import json
import math
import sys
import time
from typing import Any

import rclpy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import LaserScan

LOOKS_AROUND = 50
"""Messages of odometry after which it asks which topics there are."""
BUSY_S = 600.0
"""Until the first message: a busy machine compiles the simulator for minutes."""


def main() -> None:
    """Drive until the robot falls silent."""
    points = json.loads(sys.argv[1])
    x0, y0, th0 = json.loads(sys.argv[2])
    rclpy.init()
    node = rclpy.create_node("stranger")
    publisher = node.create_publisher(Twist, "/cmd_vel", 1000)
    stamps: dict[str, list[float]] = {"/odom": [], "/scan": [], "/clock": []}
    state: dict[str, Any] = {"next": 1, "sent": 0, "seen": {}, "heard": time.monotonic()}

    def hear(topic: str, stamp: Any) -> None:
        stamps[topic].append(stamp.sec + 1e-9 * stamp.nanosec)
        state["heard"] = time.monotonic()

    def odometry(message: Any) -> None:
        hear("/odom", message.header.stamp)
        if len(stamps["/odom"]) == LOOKS_AROUND:
            state["seen"] = dict(node.get_topic_names_and_types())
        at, turn = message.pose.pose.position, message.pose.pose.orientation
        x = x0 + math.cos(th0) * at.x - math.sin(th0) * at.y
        y = y0 + math.sin(th0) * at.x + math.cos(th0) * at.y
        theta = th0 + 2.0 * math.atan2(turn.z, turn.w)
        while state["next"] < len(points) and math.dist(points[state["next"]], (x, y)) < 0.15:
            state["next"] += 1
        command = Twist()
        if state["next"] < len(points):
            gx, gy = points[state["next"]]
            off = math.remainder(math.atan2(gy - y, gx - x) - theta, math.tau)
            command.angular.z = max(-0.6, min(0.6, off))  # gently: at five times the speed it hears late
            command.linear.x = 0.5 if abs(off) < 0.1 else 0.0
        publisher.publish(command)
        state["sent"] += 1

    node.create_subscription(Odometry, "/odom", odometry, 1000)
    node.create_subscription(LaserScan, "/scan", lambda message: hear("/scan", message.header.stamp), 1000)
    node.create_subscription(Clock, "/clock", lambda message: hear("/clock", message.clock), 1000)
    sys.stdout.write("listens\n")
    sys.stdout.flush()
    begun = time.monotonic()
    while time.monotonic() - max(state["heard"], begun + BUSY_S * (not stamps["/odom"])) < 3.0:
        rclpy.spin_once(node, timeout_sec=0.1)
    told = {topic: [len(times), *(times[:1] + times[-1:])] for topic, times in stamps.items()}
    answer = {"topics": told, "seen": state["seen"], "sent": state["sent"], "passed": state["next"]}
    sys.stdout.write(json.dumps(answer) + "\n")
    node.destroy_node()
    rclpy.shutdown()


if __name__ == "__main__":
    main()
