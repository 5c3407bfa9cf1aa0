"""``pilotage missions``, ``components`` and ``schema``: what can be run, and named in a mission file."""

from __future__ import annotations

import json
from typing import Annotated

import typer

from pilotage.cli.options import Json, Plugins
from pilotage.cli.output import print_answer


def components(
    name: Annotated[
        str | None, typer.Argument(metavar="NAME|ROLE", help="One: its parameters. A role: all that take it.")
    ] = None,
    json: Json = False,
    plugin: Plugins = None,  # noqa: ARG001 - loaded while the options are read
) -> None:
    """List the components and metrics, those of one role, or what there is to know of one of them."""
    from pilotage.experiments.catalogue import components as registered
    from pilotage.experiments.catalogue import roles

    rows = registered(name)
    what = "components" if name is None or name in roles() else "parameters"
    print_answer({what: rows}, rows, as_json=json)


def schema(plugin: Plugins = None) -> None:  # noqa: ARG001 - loaded while the options are read
    """Print the JSON schema of a mission file (for editors that check while one types)."""
    from pilotage.experiments.catalogue import mission_schema

    print(json.dumps(mission_schema(), indent=2))


def missions(json: Json = False) -> None:
    """List the missions that are shipped."""
    from pilotage.experiments.catalogue import missions as shipped

    rows = shipped()
    print_answer(dict(rows), rows, as_json=json)
