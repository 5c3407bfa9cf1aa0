"""``pilotage components``: what can be named in a mission file or a study."""

from __future__ import annotations

from typing import Annotated

import typer

from pilotage.cli.options import Json, Plugins
from pilotage.cli.output import print_columns, print_json


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
    if json:
        print_json({"components" if name is None or name in roles() else "parameters": rows})
    else:
        print_columns(rows)
