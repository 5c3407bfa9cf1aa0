"""Straight lines in scans and their association with walls."""
