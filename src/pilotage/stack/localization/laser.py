"""Localization by laser on whatever map there is."""

from __future__ import annotations

from typing import ClassVar

from pilotage.core.config import Config
from pilotage.maps.world_map import WorldMap
from pilotage.stack.interface import Belief
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.localization.ekf_walls import EkfWallsConfig, EkfWallsLocalizer
from pilotage.stack.localization.localizer import LOCALIZERS, Localizer, WrappedLocalizer
from pilotage.stack.localization.particle_filter import MclConfig, ParticleFilterLocalizer


class LaserConfig(Config):
    """Of both filters."""

    walls: EkfWallsConfig = EkfWallsConfig()
    cells: MclConfig = MclConfig()


@LOCALIZERS.add("laser", LaserConfig)
class LaserLocalizer(WrappedLocalizer):
    """What suits the map: `ekf-walls` where walls are given as lines, `particle-filter` among cells or discs.

    The outlines of cells that a robot has mapped are a thousand short steps, which no line of a scan is: the
    wall filter would be lost or too sure of itself among them; where walls are lines it is the sharper of
    both, at a third of the time. Fails where the filter that it takes does.
    """

    BY_COMMANDS: ClassVar[bool] = True

    def __init__(
        self,
        config: LaserConfig,
        robot: RobotKnowledge,
        chart: WorldMap,
        initial: Belief,
        journal: Journal,
    ) -> None:
        chosen: Localizer
        if chart.geometry is not None and len(chart.reflectors.segments_m):
            chosen = EkfWallsLocalizer(config.walls, robot, chart, initial, journal)
        else:  # mates tell it nothing yet
            chosen = ParticleFilterLocalizer(config.cells, robot, chart, initial, journal)
        super().__init__(chosen)
