"""Local controllers that find their way by the laser alone: one interface, chosen by name."""
