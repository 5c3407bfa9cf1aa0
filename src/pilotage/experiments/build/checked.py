"""What localizers from outside the package believe, looked at before anything is steered by it."""

from __future__ import annotations

import numpy as np

from pilotage.core.errors import InputError
from pilotage.sensors.readings import Readings
from pilotage.stack.interface import Belief
from pilotage.stack.localization.localizer import Localizer, WrappedLocalizer


class CheckedLocalizer(WrappedLocalizer):
    """A localizer whose beliefs are looked at: one of NaN would drive about until the time limit.

    Parameters
    ----------
    name
        As it was registered, for messages.
    """

    def __init__(self, localizer: Localizer, name: str) -> None:
        super().__init__(localizer)
        self._name = name

    def step(self, readings: Readings) -> Belief:
        """Take in one step's readings.

        Raises
        ------
        InputError
            Where what comes back is no belief.
        """
        belief = super().step(readings)
        wrong = _wrong(belief)
        if wrong:
            raise InputError(
                f"localizer '{self._name}': expected a Belief of finite pose and finite covariance (3, 3), "
                f"no variance of it negative, found {wrong} at {readings.t_s:g} s"
            )
        return belief


def _wrong(belief: object) -> str:
    """What is wrong with it; nothing where all is well."""
    if not isinstance(belief, Belief):
        return type(belief).__name__
    for what, found, shape in (("pose", belief.pose.as_array(), (3,)), ("covariance", belief.cov, (3, 3))):
        if np.shape(found) != shape or np.asarray(found).dtype.kind != "f":
            return f"a {what} of {np.asarray(found).dtype} {np.shape(found)}"
        if not np.isfinite(found).all():
            return f"a {what} of {np.asarray(found).tolist()}"
    low = float(np.diag(belief.cov).min())
    return f"a variance of {low:g}" if low < 0.0 else ""
