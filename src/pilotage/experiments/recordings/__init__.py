"""Recorded logs through the robot's plug: a log becomes readings, a localizer its beliefs."""
