"""YAML as it was meant: a key that is given twice is a mistake, not the last one's victory."""

from __future__ import annotations

from typing import Any

import yaml

from pilotage.core.errors import InputError


def load_yaml(text: str, where: str) -> Any:
    """Parse YAML text.

    Parameters
    ----------
    where
        What the text is, such as a file's name; the error begins with it.

    Raises
    ------
    InputError
        One line with the line number, where it is no YAML or a mapping has a key twice.
    """
    try:
        return yaml.load(text, Loader=_StrictLoader)
    except (yaml.YAMLError, ValueError) as error:  # a date that is none is a ValueError
        mark = getattr(error, "problem_mark", None)
        line = f" line {mark.line + 1}" if mark is not None else ""
        problem = getattr(error, "problem", None) or str(error) or "not YAML"
        raise InputError(f"{where}{line}: expected YAML, found: {problem}") from None


class _StrictLoader(yaml.SafeLoader):
    """Plain values only, and every key once."""

    def compose_mapping_node(self, anchor: Any) -> yaml.MappingNode:
        """Look at the keys as they are written, before `<<` lays other mappings under them."""
        node = super().compose_mapping_node(anchor)
        seen: set[tuple[str, Any]] = set()
        for key, _ in node.value:
            if isinstance(key, yaml.ScalarNode) and key.tag != "tag:yaml.org,2002:merge":
                if (key.tag, key.value) in seen:
                    raise yaml.constructor.ConstructorError(
                        None, None, f"the key '{key.value}' twice in one mapping", key.start_mark
                    )
                seen.add((key.tag, key.value))
        return node
