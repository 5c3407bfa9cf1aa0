"""Recursive estimation: prediction, measurement models, updates."""
