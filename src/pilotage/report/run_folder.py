"""The door to run folders by its old name; see ``pilotage.records.run_data``."""

from __future__ import annotations

from pilotage.records.run_data import read_run

__all__ = ["read_run"]
