"""Localization by laser on whatever map there is."""

from __future__ import annotations

from pilotage.core.config import Config
from pilotage.core.types import FloatArray
from pilotage.maps.world_map import WorldMap
from pilotage.sensors.readings import Readings
from pilotage.stack.interface import Belief
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.localization.ekf_walls import EkfWallsConfig, EkfWallsLocalizer
from pilotage.stack.localization.localizer import LOCALIZERS, Localizer
from pilotage.stack.localization.particle_filter import MclConfig, ParticleFilterLocalizer


class LaserConfig(Config):
    """Of both filters."""

    walls: EkfWallsConfig = EkfWallsConfig()
    cells: MclConfig = MclConfig()


@LOCALIZERS.add("laser", LaserConfig)
class LaserLocalizer:
    """What suits the map: `ekf-walls` where walls are given as lines, `particle-filter` where as cells.

    The outlines of cells that a robot has mapped are a thousand short steps, which no line of a scan is: the
    wall filter would be lost or too sure of itself among them; where walls are lines it is the sharper of
    both, at a third of the time. Fails where the filter that it takes does.
    """

    def __init__(
        self,
        config: LaserConfig,
        robot: RobotKnowledge,
        chart: WorldMap,
        initial: Belief,
        journal: Journal,
    ) -> None:
        self._chosen: Localizer
        if chart.geometry is not None:
            walls = EkfWallsLocalizer(config.walls, robot, chart, initial, journal)
            self._chosen, self._look, self._tell = walls, walls.look_bearing_rad, walls.tell_mates
        else:
            self._chosen = ParticleFilterLocalizer(config.cells, robot, chart, initial, journal)
            self._look, self._tell = _anywhere, _nobody

    @property
    def belief(self) -> Belief:
        """That of the filter chosen."""
        return self._chosen.belief

    def step(self, readings: Readings) -> Belief:
        """Take in one step's readings."""
        return self._chosen.step(readings)

    def look_bearing_rad(self) -> float | None:
        """Where to look while lost, in the robot's frame; None where any direction is as good."""
        return self._look()

    def tell_mates(self, mates: FloatArray) -> None:
        """Where mates (K, 4) say that they are, as of ``ScanFit.mates_in_sight``.

        On a map of cells they tell nothing yet.
        """
        self._tell(mates)


def _nobody(mates: FloatArray) -> None:
    del mates


def _anywhere() -> float | None:
    return None
