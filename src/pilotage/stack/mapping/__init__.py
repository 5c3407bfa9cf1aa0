"""What the robot adds to its map while it drives."""
