"""Plane geometry: distances, fields of distance, motion of a pose."""
