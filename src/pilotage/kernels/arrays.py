"""The array types that every kernel and every room speaks of."""

from __future__ import annotations

from typing import Any, TypeAlias, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

FloatArray: TypeAlias = NDArray[np.float64]
IntArray: TypeAlias = NDArray[np.int64]
ComplexArray: TypeAlias = NDArray[np.complex128]
BoolArray: TypeAlias = NDArray[np.bool_]
ByteArray: TypeAlias = NDArray[np.uint8]
ShortArray: TypeAlias = NDArray[np.int16]
SpanArray: TypeAlias = NDArray[np.int32]
UintArray: TypeAlias = NDArray[np.uint32]
WordArray: TypeAlias = NDArray[np.uint64]


Named = TypeVar("Named", bound=tuple[Any, ...])


def unnamed(value: Named) -> Named:
    """The same values without their names, for a kernel that is called at every scan and names them itself.

    numba looks at a plain tuple in a tenth of the time that a ``NamedTuple`` takes it at each call, 1 us.
    """
    return cast(Named, tuple(value))


def read_only(array: FloatArray) -> FloatArray:
    """The same numbers in one piece, which nobody writes to through it: a view where that is possible.

    Kernels are compiled apart for arrays that may be written to; walls and bodies are handed over like this.
    """
    view = np.ascontiguousarray(array, np.float64).view()
    view.flags.writeable = False
    return view
