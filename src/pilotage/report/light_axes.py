"""Axes without ticks of the second rank until somebody asks for them."""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes
from matplotlib.axis import Axis, XAxis, YAxis


class LightAxes(Axes):
    """As matplotlib's, which makes such a tick for each axis only to clip it."""

    def _init_axis(self) -> None:
        x, y = _LightXAxis(self, clear=False), _LightYAxis(self, clear=False)
        vars(self).update(xaxis=x, yaxis=y)
        for side, axis in {"bottom": x, "top": x, "left": y, "right": y}.items():
            self.spines[side].register_axis(axis)


class _Light(Axis):
    def set_clip_path(self, path: Any, transform: Any = None) -> None:
        """Clip what there is."""
        vars(self).setdefault("minorTicks", [])
        super().set_clip_path(path, transform)

    def _get_ticks_position(self) -> Any:
        """Asked for by a title over large numbers: it looks at the first tick of either rank."""
        if not self.minorTicks:
            del vars(self)["minorTicks"]  # then matplotlib makes one
        return super()._get_ticks_position()  # type: ignore[misc]


class _LightXAxis(_Light, XAxis):
    pass


class _LightYAxis(_Light, YAxis):
    pass
