"""The world as it is, in layers: walls, a grid, the ground, what is painted on it, and what moves about."""
