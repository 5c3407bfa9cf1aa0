"""``pilotage schema``: the JSON schema of a mission file."""

from __future__ import annotations

import json

from pilotage.cli.options import Plugins


def schema(plugin: Plugins = None) -> None:  # noqa: ARG001 - loaded while the options are read
    """Print the JSON schema of a mission file (for editors that check while one types)."""
    from pilotage.experiments.catalogue import mission_schema

    print(json.dumps(mission_schema(), indent=2))
