"""The navigator of a robot on patrol: from vertex to vertex among others that do the same."""

from pilotage.stack.navigator.patrol.navigator import PatrolNavigator

__all__ = ["PatrolNavigator"]
