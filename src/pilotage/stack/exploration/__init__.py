"""Explorers: where to go next when the map is not known."""
