"""Libraries that pilotage does without until something asks for them: how one gets them."""

from __future__ import annotations

from pilotage.core.errors import InputError


def missing(what: str, extra: str) -> InputError:
    """Build the error for a library that is not installed.

    The remedy works in a clone, editable as ``make core`` leaves it: no package index is asked for
    ``pilotage``, where the name may be somebody else's.

    Parameters
    ----------
    what
        A sentence that ends before the colon: ``bags need the library rosbags, which is not installed``.
    extra
        Its name in ``pyproject.toml``.
    """
    return InputError(f"{what}: in the folder of pilotage, .venv/bin/pip install -e '.[{extra}]'")
