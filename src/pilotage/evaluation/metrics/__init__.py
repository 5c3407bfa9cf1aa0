"""Every metric's only home: one table of what runs give, open to what plugins add."""

from pilotage.evaluation.metrics.registry import Metrics
from pilotage.evaluation.metrics.table import DECISIVE, shipped_metrics

__all__ = ["METRICS", "costs_of"]

METRICS = Metrics(shipped_metrics(), DECISIVE)
"""The metrics there are, in the order in which tables show them."""

costs_of = METRICS.costs_of
