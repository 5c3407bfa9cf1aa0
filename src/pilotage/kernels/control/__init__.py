"""Local control among obstacles that only the laser tells of: map, clearance, sampling, search."""
