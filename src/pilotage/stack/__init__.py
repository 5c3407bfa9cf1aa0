"""What would run on the robot.

Navigator over exploration over planning and control over localization and mapping over perception.
"""
