"""The pictures of ground and hazards by their old name; see ``pilotage.records.terrain``."""

from __future__ import annotations

from pilotage.records.terrain import Picture, TerrainPictures
from pilotage.records.terrain import read_terrain as read_pictures

__all__ = ["Picture", "TerrainPictures", "read_pictures"]
