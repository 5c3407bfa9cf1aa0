"""What would run on the robot: navigator over exploration, planning, control, localization, mapping, perception."""
