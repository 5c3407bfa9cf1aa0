"""Where the robot is: filters from readings to a belief."""
