"""Recorded logs to noise and bias parameters, with intervals."""
