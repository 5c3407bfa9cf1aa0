"""What a robot is to do: each task knows when it is done and which metrics judge it."""
