"""Figures of a run on a sheet."""
