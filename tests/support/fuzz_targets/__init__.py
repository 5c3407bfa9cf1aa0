"""Every command with every reader behind it: healthy inputs, small, and the words that use them."""

from support.fuzz_targets import bags, folders, maps, missions, recordings
from support.fuzz_targets.recordings import FILM_TARGETS
from support.fuzz_targets.target import QUICK, Target
from support.fuzz_targets.words import OPTIONS

TARGETS: tuple[Target, ...] = (
    *maps.TARGETS,
    *missions.TARGETS,
    *recordings.TARGETS,
    *bags.TARGETS,
    *folders.TARGETS,
)
BY_NAME = {target.name: target for target in (*TARGETS, *FILM_TARGETS)}

__all__ = ["BY_NAME", "FILM_TARGETS", "OPTIONS", "QUICK", "TARGETS", "Target"]
