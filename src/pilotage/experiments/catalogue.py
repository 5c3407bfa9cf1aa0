"""What can be named in a mission or study file: missions, components, their parameters, the schema."""

from __future__ import annotations

import json
from typing import Any

from pydantic_core import PydanticUndefined, to_jsonable_python

from pilotage.core.config import Config
from pilotage.core.errors import InputError, nearest
from pilotage.core.parameters import schema_of
from pilotage.evaluation.metric import Direction
from pilotage.evaluation.metrics import METRICS
from pilotage.experiments.mission import read_mission, shipped_missions
from pilotage.experiments.roles import ROLES
from pilotage.missions.mission import Mission

TEMPLATE = "#/$defs/{model}"
METRIC = "metric"


def missions() -> list[tuple[str, str]]:
    """Name and description of every shipped mission."""
    return [(name, str(read_mission(name).get("description", ""))) for name in shipped_missions()]


def roles() -> list[str]:
    """What a component can be to a mission."""
    return [*ROLES, METRIC]


def components(name: str | None = None) -> list[tuple[str, str, str]]:
    """Role, name and first line of every component and metric; or parameter, default and type of one of them.

    Parameters
    ----------
    name
        Of a component or metric; or of a role, for all that can take it.

    Raises
    ------
    InputError
        If there is neither of that name.
    """
    entries = [(role, entry) for role, registry in ROLES.items() for entry in registry]
    if name is None or name in roles():
        listed = [(role, entry.name, _first_line(entry.factory.__doc__)) for role, entry in entries]
        listed += [(METRIC, metric.key, metric.meaning) for metric in METRICS]
        return [row for row in listed if name in (None, row[0])]
    if name in METRICS:
        metric = METRICS.find(name)
        tasks = ", ".join(sorted(metric.tasks)) or "every task"
        better = "" if metric.direction is Direction.NONE else f"{metric.direction} is better"
        return [(f"metric '{name}'", metric.unit, metric.meaning), ("given by", tasks, better)]
    found = [(role, entry) for role, entry in entries if entry.name == name]
    if not found:
        names = [entry.name for _, entry in entries] + [metric.key for metric in METRICS] + roles()
        close = nearest(name, names)
        hint = f"did you mean '{close}'?" if close else "known roles: " + ", ".join(roles())
        raise InputError(f"unknown component '{name}'; {hint}")
    rows: list[tuple[str, str, str]] = []
    for role, entry in found:
        rows.append((f"{role} '{name}'", "", _first_line(entry.factory.__doc__)))
        rows += _parameters(entry.config)
    return rows


def _parameters(config: type[Config]) -> list[tuple[str, str, str]]:
    """Parameter, default, and what values it takes."""
    schema = schema_of(config)
    rows = []
    for name, field in config.model_fields.items():
        if field.is_required():
            default = "required"
        elif field.default is PydanticUndefined or isinstance(field.default, Config):
            default = "see schema"
        else:
            default = _as_in_a_file(field.default)
        rows.append((name, default, _values(schema["properties"][name], schema.get("$defs", {}))))
    return rows


def _as_in_a_file(value: Any) -> str:
    """A default as a mission says it, so that it can be set again as it stands."""
    plain = to_jsonable_python(value, fallback=str)
    return plain if isinstance(plain, str) else json.dumps(plain)


def _values(schema: dict[str, Any], definitions: dict[str, Any]) -> str:
    """The values that a JSON schema allows, in a few words."""
    if "anyOf" in schema:
        return " or ".join(_values(part, definitions) for part in schema["anyOf"])
    if "enum" in schema:
        return " | ".join(map(_as_in_a_file, schema["enum"]))
    if "const" in schema:
        return _as_in_a_file(schema["const"])
    if "$ref" in schema:
        name = str(schema["$ref"].rsplit("/", 1)[-1])
        meant = definitions.get(name, {})
        return _values(meant, definitions) if "enum" in meant or "const" in meant else name
    words = [str(schema.get("type", "value"))]
    bounds = (("minimum", ">="), ("exclusiveMinimum", ">"), ("maximum", "<="), ("exclusiveMaximum", "<"))
    words += [f"{sign} {schema[key]:g}" for key, sign in bounds if key in schema]
    return " ".join(words)


def mission_schema() -> dict[str, Any]:
    """JSON schema of a mission file, with the parameters of every component that a role can take."""
    schema = Mission.model_json_schema(ref_template=TEMPLATE)
    definitions = schema["$defs"]
    choices: dict[str, dict[str, Any]] = {}
    for role, registry in ROLES.items():
        options = []
        for entry in registry:
            parameters = entry.config.model_json_schema(ref_template=TEMPLATE)
            definitions |= parameters.pop("$defs", {})
            parameters["properties"] = {"name": {"const": entry.name}, **parameters.get("properties", {})}
            parameters["required"] = ["name", *parameters.get("required", [])]
            parameters["title"] = entry.name
            options.append(parameters)
        definitions[f"role-{role}"] = {"oneOf": options}
        choices[role] = {"$ref": f"#/$defs/role-{role}"}
    stack = definitions["StackConfig"]["properties"]
    for role, choice in choices.items():
        if role in stack:
            stack[role] = choice if "default" not in stack[role] else {"anyOf": [choice, {"type": "null"}]}
    robot = definitions["RobotConfig"]["properties"]
    robot["sensors"]["additionalProperties"] = choices["sensor"]
    robot["motion"] = choices["motion"]
    robot["faults"]["items"] = choices["fault"]
    definitions["WorldConfig"]["properties"]["people"]["items"] = {
        "anyOf": [choices["people"], {"type": "string"}]
    }
    schema["properties"]["task"] = {"anyOf": [choices["task"], {"type": "string"}]}
    schema["properties"]["extends"] = {
        "type": "string",
        "description": "a shipped mission or a mission's file to start from",
    }
    return schema


def _first_line(text: str | None) -> str:
    return (text or "").strip().split("\n", 1)[0]
