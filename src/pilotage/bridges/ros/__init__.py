"""ROS: messages as plain values, bags of them, and live topics."""
