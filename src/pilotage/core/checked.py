"""What components from outside the package give, looked at where they give it.

A number that is none goes through a whole run unseen, or comes to light far from where it was made.
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

from pilotage.core.errors import InputError
from pilotage.core.plugins import giver, is_from_outside

C = TypeVar("C", bound=type)


@dataclass(frozen=True, slots=True)
class Gives:
    """What one method of a role gives.

    Attributes
    ----------
    method
        Its name; ``__init__``: what the component keeps from when it is built.
    expected
        What it should give, in words.
    wrong
        From what it gave, the component, and what it was called with: what is wrong with it, in words; empty
        where nothing is.
    optional
        Whether a component may be without the method.
    before
        What of the component is looked at before the method is called, and handed to ``wrong`` after the
        component: for what a call must not change.
    """

    method: str
    expected: str
    wrong: Callable[..., str]
    optional: bool = False
    before: Callable[[Any], Any] | None = None


def keeps(expected: str, wrong: Callable[[Any], str]) -> Gives:
    """What a component keeps from when it is built, looked at then."""
    return Gives("__init__", expected, lambda _, component, *__: wrong(component))


def there(method: str) -> Gives:
    """A method that a component has to have, whatever it gives."""
    return Gives(method, "that it is there", lambda *_: "")


_ANYTHING = keeps("anything", lambda _: "")


def checked(cls: C, whose: str, *roles: Gives) -> C:
    """A class whose methods are looked at, if it comes from outside; one of our own as it is.

    Parameters
    ----------
    whose
        Role and name, for messages.

    Raises
    ------
    InputError
        Where it has no such method. The methods raise it for what they should not give, the class where it
        cannot be built from what its role is built from.
    """
    if not roles or not is_from_outside(cls.__module__):
        return cls
    whose = f"{whose} of {giver(cls.__module__)}"
    looks = {gives.method: gives for gives in (_ANYTHING, *roles)}
    methods = {
        method: _looked_at(cls, whose, gives)
        for method, gives in looks.items()
        if not gives.optional or hasattr(cls, method)
    }
    return type(cls)(cls.__name__, (cls,), {"__module__": cls.__module__, "__doc__": cls.__doc__, **methods})


def _looked_at(cls: type, whose: str, gives: Gives) -> Callable[..., Any]:
    its_own = getattr(cls, gives.method, None)
    if not callable(its_own):
        raise InputError(f"{whose}: expected a class with a method '{gives.method}', found none")
    built = gives.method == "__init__"
    where = whose if built else f"{whose}: {gives.method}"

    @functools.wraps(its_own)
    def look(self: Any, *args: Any, **kwargs: Any) -> Any:
        before = () if gives.before is None else (gives.before(self),)
        # A class without a constructor of its own takes nothing.
        its = _takes_nothing if its_own is object.__init__ else its_own
        try:
            given = its(self, *args, **kwargs)
        except TypeError:
            require_taken(its, where, "be built from" if built else "take", args, kwargs, itself=(self,))
            raise
        found = gives.wrong(given, self, *before, *args, *kwargs.values())
        if found:
            raise InputError(f"{where}: expected {gives.expected}, found {found}")
        return given

    return look


def _takes_nothing(self: object) -> None:
    """The constructor of a class that has none."""


def require_taken(
    function: Callable[..., Any],
    whose: str,
    role: str,
    args: tuple[Any, ...],
    kwargs: Mapping[str, Any],
    itself: tuple[Any, ...] = (),
) -> None:
    """Refuse a function that does not take what it is called with; ``itself``: what a method gets first."""
    signature = inspect.signature(function)
    try:
        signature.bind(*itself, *args, **kwargs)
    except TypeError as error:
        name = "__init__" if function is _takes_nothing else function.__name__
        count = len(args) + len(kwargs)
        bare = [parameter.replace(annotation=parameter.empty) for parameter in signature.parameters.values()]
        shown = signature.replace(parameters=bare, return_annotation=signature.empty)
        raise InputError(
            f"{whose}: expected to {role} {count} argument{'s' * (count != 1)} as its role says, "
            f"found {name}{shown}: {error}"
        ) from None
