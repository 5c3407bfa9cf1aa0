"""Differential drive commanded by twists."""

from __future__ import annotations

from pilotage.models.motion.motion import MOTIONS, LimitedMotionConfig


@MOTIONS.add_config("differential-drive")
class DifferentialDriveConfig(LimitedMotionConfig):
    """Turns on the spot; speed and turn rate follow the command within limits of acceleration."""
