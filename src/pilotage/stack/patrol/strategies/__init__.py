"""Strategies of patrol, registered by name."""
