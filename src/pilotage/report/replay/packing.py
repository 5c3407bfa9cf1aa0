"""A scene as one string: a JSON header and its arrays, deflated, in base64.

Layout before deflating: uint32 length of the header (little endian), the header padded with spaces to a
multiple of 8, then the arrays, each aligned to 8. An array in the header is ``{"$": type, "at": offset,
"n": length}``. Floats are stored in single precision (4 mm at 45 km), ranges as multiples of their step.
"""

from __future__ import annotations

import base64
import dataclasses
import json
import math
import zlib
from typing import Any

import numpy as np

_LEVEL = 6
NO_RANGE = 65535


def pack(scene: object) -> str:
    """Return a scene, or any other dataclass of arrays, for the page's script, in base64."""
    body = bytearray()
    header = json.dumps(_plain(scene, body), allow_nan=False, separators=(",", ":")).encode()
    header += b" " * (-(len(header) + 4) % 8)
    raw = len(header).to_bytes(4, "little") + header + bytes(body)
    return base64.b64encode(zlib.compress(raw, _LEVEL)).decode("ascii")


def _plain(value: Any, body: bytearray) -> Any:
    """Turn values into JSON; arrays go to the body."""
    if isinstance(value, np.ndarray):
        return _stored(value, body)
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        fields = {f.name: getattr(value, f.name) for f in dataclasses.fields(value)}
        if "ranges_m" in fields:  # ranges take half the room as whole numbers
            fields |= _quantised(fields["ranges_m"])
            del fields["ranges_m"]
        if "cells" in fields:
            fields |= {"rows": fields["cells"].shape[0], "columns": fields["cells"].shape[1]}
        return {name: _plain(inner, body) for name, inner in fields.items()}
    if isinstance(value, tuple | list):
        return [_plain(inner, body) for inner in value]
    if isinstance(value, float | np.floating):
        return float(value) if math.isfinite(value) else None
    return value


def _quantised(ranges_m: np.ndarray[Any, Any]) -> dict[str, Any]:
    finite = np.isfinite(ranges_m)
    top = float(ranges_m[finite].max()) if bool(finite.any()) else 1.0
    step_m = max(top, 1e-6) / (NO_RANGE - 1)
    levels = np.where(finite, np.rint(np.where(finite, ranges_m, 0.0) / step_m), NO_RANGE)
    return {"ranges": levels.astype(np.uint16), "step_m": step_m}


def _stored(array: np.ndarray[Any, Any], body: bytearray) -> dict[str, Any]:
    flat = np.ascontiguousarray(array).reshape(-1)
    if flat.dtype.kind == "f":
        flat, name = flat.astype("<f4"), "f4"
    elif flat.dtype == np.uint16:
        flat, name = flat.astype("<u2"), "u2"
    elif flat.size and (flat.min() >= 0) and (flat.max() < 256):
        flat, name = flat.astype(np.uint8), "u1"
    else:
        flat, name = flat.astype("<i4"), "i4"
    body += b"\0" * (-len(body) % 8)
    at = len(body)
    body += flat.tobytes()
    return {"$": name, "at": at, "n": int(flat.size)}
