"""Patrol: what is seen from where, and how few places see everything."""
