"""A ROS 2 node (extra ``ros2``): topics opened, messages filled from plain values, time spent listening."""

from __future__ import annotations

import importlib
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from pilotage.bridges.ros.messages import TRANSFORMS
from pilotage.bridges.ros.transforms import TransformTopic
from pilotage.core.extras import missing

DEPTH = 1000
"""Messages that wait for a slow listener before the oldest is lost."""
FLUSH_S = 1.0
"""How long a node stays after its last message, so that reliable topics can deliver it."""


class Node:
    """Publishers and subscriptions by topic; reliable, so that nothing is lost on the way.

    Attributes
    ----------
    sent, received
        Messages by topic.
    """

    def __init__(self, rclpy: Any, node: Any) -> None:
        self._rclpy, self._node = rclpy, node
        self._publishers: dict[str, Callable[[Mapping[str, Any]], None]] = {}
        self.sent: dict[str, int] = {}
        self.received: dict[str, int] = {}

    def publishes(self, topic: str, msgtype: str) -> bool:
        """Open a topic; False where neither its type nor DDS to speak it without is installed."""
        try:
            kind = _type(msgtype)
        except ImportError:
            if msgtype != TRANSFORMS:
                return False
            try:
                self._publishers[topic] = TransformTopic(topic, DEPTH).send
            except ImportError:
                return False
        else:
            publisher = self._node.create_publisher(kind, topic, DEPTH)
            self._publishers[topic] = lambda fields: publisher.publish(filled(kind(), fields))
        self.sent[topic] = 0
        return True

    def publish(self, topic: str, fields: Mapping[str, Any]) -> None:
        """Send a message, where the topic could be opened."""
        if topic in self._publishers:
            self._publishers[topic](fields)
            self.sent[topic] += 1

    def listens(self, topic: str, msgtype: str, hear: Callable[[Any], None]) -> None:
        """Hand every message of a topic to ``hear``."""
        self.received[topic] = 0

        def heard(message: Any) -> None:
            self.received[topic] += 1
            hear(message)

        self._node.create_subscription(_type(msgtype), topic, heard, DEPTH)

    def spin_until(self, due_s: float) -> None:
        """Listen until that time of ``time.perf_counter``; at least look once."""
        self._rclpy.spin_once(self._node, timeout_sec=0.0)
        while (left_s := due_s - time.perf_counter()) > 0.0:
            self._rclpy.spin_once(self._node, timeout_sec=left_s)


@contextmanager
def ros_node(name: str) -> Iterator[Node]:
    """A node of that name.

    Raises
    ------
    InputError
        Where ROS 2 is not installed, with the remedy.
    """
    try:
        rclpy: Any = importlib.import_module("rclpy")
        for msgtype in ("sensor_msgs/msg/LaserScan", "nav_msgs/msg/Odometry", "geometry_msgs/msg/Twist"):
            _type(msgtype)
    except ImportError:
        raise missing(
            "live topics need rclpy and the usual messages of ROS 2, which are not installed", "ros2"
        ) from None
    rclpy.init(args=[], signal_handler_options=rclpy.signals.SignalHandlerOptions.NO)
    node = rclpy.create_node(name)
    try:
        yield Node(rclpy, node)
    finally:
        node.destroy_node()
        rclpy.shutdown()


def _type(msgtype: str) -> type[Any]:
    package, _, name = msgtype.split("/")
    found: type[Any] = getattr(importlib.import_module(f"{package}.msg"), name)
    return found


def filled(message: Any, fields: Mapping[str, Any]) -> Any:
    """Fill a message of ROS from nested values; lists of messages take their type from the declaration."""
    for name, value in fields.items():
        if isinstance(value, Mapping):
            filled(getattr(message, name), value)
        elif isinstance(value, list) and value and isinstance(value[0], Mapping):
            declared = message.get_fields_and_field_types()[name].removeprefix("sequence<").split(">")[0]
            kind = _type(declared.replace("/", "/msg/"))
            setattr(message, name, [filled(kind(), item) for item in value])
        else:
            setattr(message, name, value.tolist() if hasattr(value, "tolist") else value)
    return message
