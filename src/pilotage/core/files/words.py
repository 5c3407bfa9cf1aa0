"""What libraries say of damaged files, in words that do not presume Python."""

from __future__ import annotations

import re

_BYTES = re.compile(r"\bb'((?:[^'\\]|\\.)*)'")
_NO_INTEGER = re.compile(r"invalid literal for int\(\) with base 10: ")
_ZLIB = re.compile(r"Error -?\d+ while decompressing data(?:: .*)?")


def in_words(error: BaseException) -> str:
    """The message of an error: no number of the system's, no notation for bytes, no function's name."""
    if isinstance(error, OSError) and error.strerror:
        return error.strerror
    whole = _BYTES.fullmatch(str(error))
    text = _NO_INTEGER.sub("expected a whole number, found ", whole[1] if whole else str(error))
    text = _ZLIB.sub("what is packed is damaged", text)
    return _BYTES.sub(r"'\1'", text) or "damaged data"
