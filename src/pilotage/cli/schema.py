"""``pilotage schema``: the JSON schema of a mission file."""

from __future__ import annotations

import json


def schema() -> None:
    """Print the JSON schema of a mission file (for editors that check while one types)."""
    from pilotage.experiments.catalogue import mission_schema

    print(json.dumps(mission_schema(), indent=2))
