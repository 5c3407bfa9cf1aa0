"""One correction of a pose by the lines of a scan: matched, then updated."""

from __future__ import annotations

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.kernels.lines import joint_association
from pilotage.stack.localization.wall_matching import Matches, WallMatcher
from pilotage.stack.perception.lines import DetectedLines


def correct(
    pose: FloatArray, cov: FloatArray, mount: FloatArray, lines: DetectedLines, matcher: WallMatcher
) -> tuple[Matches, float]:
    """Update ``pose`` (3,) and ``cov`` (3, 3) in place by every line that is matched.

    Returns the matches and the joint squared Mahalanobis distance of the update.
    """
    matches = matcher.match(pose, cov, lines)
    total = joint_association.update_walls(
        pose,
        cov,
        mount,
        lines.rho_alpha,
        lines.covs,
        matcher.walls.normals,
        matches.walls,
        np.empty(len(lines)),
    )
    return matches, total
