"""pilotage: the open navigation lab for mobile robots."""

__version__ = "0.1.0"
