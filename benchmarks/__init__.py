"""Measurements against peers and at a scale that tests do not have; not part of the package."""
