"""``pilotage missions``: what can be run."""

from __future__ import annotations

from pilotage.cli.options import Json
from pilotage.cli.output import print_columns, print_json


def missions(json: Json = False) -> None:
    """List the missions that are shipped."""
    from pilotage.experiments.catalogue import missions as shipped

    rows = shipped()
    if json:
        print_json(dict(rows))
    else:
        print_columns(rows)
