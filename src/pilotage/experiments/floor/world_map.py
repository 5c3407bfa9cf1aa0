"""Finding a mission's map: a shipped name, a file, or the map itself."""

from __future__ import annotations

from importlib import resources
from pathlib import Path

from pilotage.core.errors import InputError, unknown_name
from pilotage.experiments.values import parse_yaml, read_text
from pilotage.maps.map_file import LandmarkMap, MapFile, build_map, parse_map

SHIPPED = resources.files("pilotage.missions") / "maps"


def shipped_maps() -> list[str]:
    """Names of the maps that come with pilotage."""
    return sorted(
        entry.name.removesuffix(".yaml") for entry in SHIPPED.iterdir() if entry.name.endswith(".yaml")
    )


def load_map(source: str | MapFile) -> LandmarkMap:
    """Load a map.

    Raises
    ------
    InputError
        Where no such map is shipped, the file is missing, or what it holds is no map.
    """
    if isinstance(source, MapFile):
        return build_map(source, "world.map")
    path = Path(source)
    if path.suffix in {".yaml", ".yml"} or "/" in source:
        if not path.is_file():
            raise InputError(f"map '{source}': expected a map file, found none there")
        return parse_map(parse_yaml(read_text(path), str(path)), str(path))
    if source not in shipped_maps():
        raise unknown_name("map", source, shipped_maps())
    return parse_map(parse_yaml((SHIPPED / f"{source}.yaml").read_text(), source), source)
