"""Searches and distances on grids."""
