"""Sampling-based planning of drivable curves, and exact shortest paths."""
