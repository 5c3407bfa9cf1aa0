"""The goal navigator: a state machine of localizing, planning, following, reacting and escaping."""

from pilotage.stack.navigator.goal.navigator import GoalNavigator

__all__ = ["GoalNavigator"]
