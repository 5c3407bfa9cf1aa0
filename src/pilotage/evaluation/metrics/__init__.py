"""Every metric's only home: one table of what runs give, open to what plugins add."""

from collections.abc import Mapping

from pilotage.core.types import FloatArray
from pilotage.evaluation.metric import Aspect, Direction, Metric
from pilotage.evaluation.metrics.registry import Metrics
from pilotage.evaluation.metrics.table import DECISIVE, shipped_metrics

__all__ = ["METRICS", "costs_of"]

METRICS = Metrics(shipped_metrics(), DECISIVE)
"""The metrics there are, in the order in which tables show them."""

costs_of = METRICS.costs_of


@METRICS.computed_by(
    Metric(
        key="collided",
        name="run with a collision",
        unit="share",
        meaning="Whether the body touched anything at all; over trials, the share that did.",
        direction=Direction.LESS,
        aspect=Aspect.SAFETY,
        needs=frozenset({"driven"}),
        group="",
    )
)
def collided(trace: Mapping[str, FloatArray], metrics: Mapping[str, object]) -> float | None:
    """One for a run with a contact or more, so that trials are counted and not contacts."""
    del trace
    contacts = metrics.get("collisions")
    return float(contacts > 0) if isinstance(contacts, int | float) else None
