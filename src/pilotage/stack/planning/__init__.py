"""Global planners, path smoothers and the local planner between waypoints."""
