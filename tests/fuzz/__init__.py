"""Damaged inputs: a short run as a test, long ones by ``make fuzz``."""
