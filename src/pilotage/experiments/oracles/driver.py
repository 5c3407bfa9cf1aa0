"""A driver who knows the path: the robot drives on its true pose while its localizer is only watched.

With it every filter is judged on the same path, to its end, and one that is lost does not end its own trial:
the programmed route of the night watch's filter experiments (report figures 15-19 and 21-23).
"""

from __future__ import annotations

from pilotage.sensors.readings import Readings
from pilotage.stack.interface import Belief, Stack, WrappedStack
from pilotage.stack.localization.localizer import Localizer


class WatchedLocalizer:
    """Runs a localizer, and tells the rest of the stack the truth.

    Parameters
    ----------
    watched
        The mission's localizer; it hears every reading.
    driver
        Knows where the robot is.
    """

    def __init__(self, watched: Localizer, driver: Localizer) -> None:
        self.watched = watched
        self._driver = driver

    @property
    def belief(self) -> Belief:
        """The driver's."""
        return self._driver.belief

    def step(self, readings: Readings) -> Belief:
        """Both hear the readings; the driver's belief drives."""
        self.watched.step(readings)
        return self._driver.step(readings)


class WatchedStack(WrappedStack):
    """A stack that drives on its driver's belief and tells that of the localizer which is watched."""

    def __init__(self, stack: Stack, watched: Localizer) -> None:
        super().__init__(stack)
        self._watched = watched

    @property
    def belief(self) -> Belief:
        """What the watched localizer believes."""
        return self._watched.belief
