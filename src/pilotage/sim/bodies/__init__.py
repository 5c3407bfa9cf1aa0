"""What moves in the true world: one body for every robot, and a file for each motion."""
