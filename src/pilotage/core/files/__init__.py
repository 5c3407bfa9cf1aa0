"""The one door for every file that comes from outside.

Readers give it a path and get plain values back, or an ``InputError`` of one line. It looks at kind and size
first (a pipe, a device or a folder is no file), unpacks up to a limit, and decodes with bounds::

    from pilotage.core.files import read_bytes, read_json, read_text, read_yaml

    text = read_text(path, "a trajectory")     # UTF-8, gzipped or not: file and line of what is none
    text, cut = read_cut_text(path)            # the same of what a gzipped log has left before a cut
    values = read_yaml(path, "a mission")      # bounded nesting, aliases counted as written out, keys once
    entry = read_json(path, "a run's metrics")  # bounded nesting, finite numbers, whole surrogate pairs
    events = read_json_lines(path)             # one object a line
    size = require_file(path, "a film")        # before a library opens a path by itself

    from pilotage.core.files.arrays import map_npy, read_npz, require_numbers
    from pilotage.core.files.images import opened_image
    from pilotage.core.files.parquet import read_parquet

``what`` completes "expected ..., found none there". A reader still checks that numbers lie in their column's
range (``require_numbers`` for arrays) and says so with its file and row. The limits stand in ``core.limits``;
the environment variable ``PILOTAGE_LIMITS=N`` makes all of them N times as large, and every refusal says so.
What is shown to people goes through ``core.shown`` (an ``InputError`` does so by itself).
"""

from pilotage.core.files.plain import (
    decoded,
    opened,
    read_bytes,
    read_cut_text,
    read_text,
    require_file,
    unpacked,
)
from pilotage.core.files.values import read_json, read_json_lines, read_values_text, read_yaml

__all__ = [
    "decoded",
    "opened",
    "read_bytes",
    "read_cut_text",
    "read_json",
    "read_json_lines",
    "read_text",
    "read_values_text",
    "read_yaml",
    "require_file",
    "unpacked",
]
