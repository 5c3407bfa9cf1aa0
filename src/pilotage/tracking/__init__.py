"""Video to the path of the robot: ground truth by camera."""
