"""What a stranger's config asks for is what a mission's file can hold: looked at when it registers."""

from __future__ import annotations

import re
import warnings
from typing import Any

from pydantic import TypeAdapter, ValidationError
from pydantic.errors import PydanticUndefinedAnnotation, PydanticUserError
from pydantic.json_schema import PydanticJsonSchemaWarning

from pilotage.core.config import Config, describe

HOLDS = "parameters that a file can hold (numbers, texts, true or false, lists, mappings, other configs)"


def schema_of(config: type[Config]) -> dict[str, Any]:
    """The JSON schema of a config; nothing is said of a default that JSON does not know, such as NumPy's."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PydanticJsonSchemaWarning)
        return config.model_json_schema()


def unfit_parameters(config: type[Config], *, complete: bool) -> str:
    """What is expected of a config's parameters, and what was found instead; empty: they will do.

    Parameters
    ----------
    complete
        Whether all that its annotations name is there by now; a plugin may define it below the config.
    """
    for name, field in config.model_fields.items():
        if field.alias is not None:
            return f"parameters named in files as in the class, found '{name}' with the alias '{field.alias}'"
    try:
        schema_of(config)
    except (PydanticUserError, PydanticUndefinedAnnotation) as error:
        if _lacks_a_name(error):
            missing = re.search(r"define [`']([^`']+)|name '([^']+)", str(error))
            name = next(filter(None, missing.groups())) if missing else "one of them"
            return f"types that are defined in its file, found '{name}', which is not" if complete else ""
        return f"{HOLDS}, found {_which(config)}"
    if any(field.is_required() for field in config.model_fields.values()):
        return ""
    try:
        config()
    except ValidationError as error:
        return f"defaults that it takes itself: {describe(error, config, '')}"
    return ""


def _lacks_a_name(error: Exception) -> bool:
    return isinstance(error, PydanticUndefinedAnnotation) or (
        getattr(error, "code", None) in ("class-not-fully-defined", "undefined-annotation")
    )


def _which(config: type[Config]) -> str:
    """The parameter that no file can hold, with its type."""
    for name, field in config.model_fields.items():
        kind: Any = field.annotation
        try:
            TypeAdapter(kind).json_schema()
        except PydanticUserError:
            told = kind.__name__ if isinstance(kind, type) else str(kind)
            return f"'{name}', which is of {told}"
    return "others"
