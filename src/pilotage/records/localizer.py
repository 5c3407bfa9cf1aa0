"""``localizer.yaml``: which recording was localized, by which localizer with which parameters."""

from __future__ import annotations

from pathlib import Path

from pilotage.records.reading import text_of

LOCALIZER_FILE = "localizer.yaml"


def write_localizer(folder: Path, text: str) -> None:
    """Write the settings' YAML text, which ``--set @FILE`` reads again."""
    (folder / LOCALIZER_FILE).write_text(text, encoding="utf-8", errors="replace")


def read_localizer(folder: Path) -> str:
    """Read the text; empty where the run was no recording's."""
    return text_of(folder / LOCALIZER_FILE, "a localizer's settings")
