"""Patrol: which vertex of a graph a robot of a team visits next, on what it knows and was told."""
