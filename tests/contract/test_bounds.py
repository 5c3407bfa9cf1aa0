"""Numbers at the ends of what each config takes: a result or one line, quickly and without a warning.

Each component works in a mission of a few steps, one of its numbers changed at a time to its least and its
largest. ``fuzz.ends`` drives every number to all its ends and for longer, each in a process of its own.
"""

from __future__ import annotations

from typing import Any

import pytest

from contract.examples import EXAMPLES
from pilotage.core.errors import InputError
from pilotage.core.registry import Entry, Registry
from pilotage.experiments.roles import ROLES
from support.bounds import PARAMETERS, changed, numbers_of
from support.component_missions import mission_with, short
from support.outcome import MEMORY_MB, forget_peak, limited, peak_mb
from support.told import ill_told

STEPS = 3
SEEN: set[str] = set()
CASES = [
    pytest.param(role, registry, entry, id=f"{role}:{entry.name}")
    for role, registry in ROLES.items()
    for entry in registry
]


@pytest.mark.parametrize(("role", "registry", "entry"), CASES)
def test_numbers_at_their_ends(role: str, registry: Registry[Any], entry: Entry[Any]) -> None:
    """No error but the one of bad input, nothing infinite, no warning, no hang, little memory.

    What several components of a role inherit, or have as a part, is driven in the first of them.
    """
    parameters = {**EXAMPLES[role, entry.name].parameters, **PARAMETERS.get((role, entry.name), {})}
    values = registry.configure(entry.name, parameters, role).model_dump(mode="json")
    assert ill_told(short(mission_with(role, entry.name, parameters), STEPS)) == []
    forget_peak()
    held_mb = peak_mb()
    for place, whose, ends in numbers_of(registry.configure(entry.name, parameters, role)):
        if f"{role} {whose}" in SEEN:
            continue
        SEEN.add(f"{role} {whose}")
        for end in (ends[0], ends[-1]):
            told = f"{'.'.join(map(str, place))} = {end!r}"
            mission = short(mission_with(role, entry.name, changed(values, place, end)), STEPS)
            try:
                with limited():
                    assert ill_told(mission) == [], told
            except InputError:
                pass  # one line, as its message always is
            except Exception as error:
                raise AssertionError(f"{told}: {type(error).__name__}: {error}") from error
            assert peak_mb() - held_mb < MEMORY_MB, told
