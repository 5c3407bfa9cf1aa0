"""Finding a mission's sheet: a shipped name, a file, or the sheet itself."""

from __future__ import annotations

from importlib import resources
from pathlib import Path

from pilotage.core.config import validate
from pilotage.core.errors import InputError, unknown_name
from pilotage.experiments.values import parse_yaml, read_text
from pilotage.maps.true_cells import SheetFile

SHIPPED = resources.files("pilotage.missions") / "sheets"


def shipped_sheets() -> list[str]:
    """Names of the sheets that come with pilotage."""
    return sorted(
        entry.name.removesuffix(".yaml") for entry in SHIPPED.iterdir() if entry.name.endswith(".yaml")
    )


def load_sheet(source: str | SheetFile) -> SheetFile:
    """Load a sheet.

    Raises
    ------
    InputError
        Where no such sheet is shipped, the file is missing, or what it holds is no sheet.
    """
    if isinstance(source, SheetFile):
        return source
    path = Path(source)
    if path.suffix in {".yaml", ".yml"} or "/" in source:
        if not path.is_file():
            raise InputError(f"sheet '{source}': expected a YAML file, found none there")
        return validate(SheetFile, parse_yaml(read_text(path), str(path)), str(path))
    if source not in shipped_sheets():
        raise unknown_name("sheet", source, shipped_sheets())
    return validate(SheetFile, parse_yaml((SHIPPED / f"{source}.yaml").read_text(), source), source)
