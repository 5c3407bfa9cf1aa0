"""The navigator that explores a floor: a state machine of exploring, closing loops and coming back."""

from pilotage.stack.navigator.floor_explorer.navigator import FloorExplorer

__all__ = ["FloorExplorer"]
