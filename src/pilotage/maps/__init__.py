"""What the world is made of: segments, landmarks, grids, distance fields; and their file formats."""
