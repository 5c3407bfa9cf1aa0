"""What numba compiles with less processor time: steps left out whose outcome does not depend on them.

``dispatchers`` asks for it before the first kernel is compiled. It reaches into numba's compiler, for the
whole process: each part stands by itself and does nothing where a version of numba has not got what it
changes.
"""

from __future__ import annotations

import gc
from collections.abc import Callable
from typing import Any

from numba.core import event

__all__ = ["FewCollections", "lighten"]


class FewCollections(event.Listener):
    """Lets garbage pile up while functions are compiled: looking for it all the time took a sixth of that."""

    _THRESHOLD = 50_000, 20, 20
    _depth, _before = 0, (700, 10, 10)

    def on_start(self, _: object) -> None:
        """Within numba's lock, so one thread at a time; a function may need others compiled first."""
        if self._depth == 0:
            self._before = gc.get_threshold()
            gc.set_threshold(*self._THRESHOLD)
        self._depth += 1

    def on_end(self, _: object) -> None:
        """Also where it could not be compiled."""
        self._depth -= 1
        if self._depth == 0:
            gc.set_threshold(*self._before)


def lighten(target: Any) -> None:
    """Let numba compile with less for ``target``, the target context of a dispatcher; twice is as once."""
    _optimize_modules_only(target.codegen())
    _remember_what_does_not_apply()
    _say_less_of_shapes()


def _optimize_modules_only(codegen: Any) -> None:
    """Without LLVM's passes over each function by itself: those over the linked module do the same again.

    For every function and every declaration numba made a pass manager, half the work of all module passes.
    """
    library: Any = getattr(codegen, "_library_class", None)
    if not hasattr(library, "_optimize_functions") or getattr(library, "is_light", False):
        return

    def only_layout(self: Any, module: Any) -> None:
        """What is left of the original; the passes of ``_optimize_final_module`` follow in any case."""
        module.data_layout = self._codegen._data_layout

    codegen._library_class = type(
        library.__name__, (library,), {"_optimize_functions": only_layout, "is_light": True}
    )


def _remember_what_does_not_apply() -> None:
    """An overload that did not take some types will not later: for each ``+`` numba asks dozens of them.

    numba remembers as well, by a key that reads all compiler flags for each question.
    """
    from numba.core.typing import templates

    template: Any = getattr(templates, "_OverloadFunctionTemplate", None)
    if template is None or getattr(template.generic, "remembers", False):
        return
    ask: Callable[..., Any] = template.generic
    refused: set[object] = set()

    def generic(self: Any, args: Any, kws: Any) -> Any:
        key = type(self), self.context, tuple(args), tuple(dict(kws).items())
        if key in refused:
            return None
        signature = ask(self, args, kws)
        if signature is None:
            refused.add(key)
        return signature

    generic.remembers = True  # type: ignore[attr-defined]
    template.generic = generic


def _say_less_of_shapes() -> None:
    """A slice assigned from an array of another shape raises without the two shapes in its words.

    To format them numba compiled some forty functions on text in every process, and their code went into
    every kernel with such an assignment.
    """
    from numba.core.typing.templates import builtin_registry
    from numba.np import arrayobj

    stub = getattr(arrayobj, "raise_with_shape_context", None)
    short = getattr(arrayobj, "ol_raise_with_shape_context_generic", None)
    if stub is None or short is None:
        return
    for value, function in builtin_registry.globals:
        if value is stub:
            for template in function.templates:
                if template.metadata.get("target") == "CPU":
                    template._overload_func = staticmethod(short)
