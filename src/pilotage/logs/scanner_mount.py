"""Where the scanner sits on the robot, from the transforms (tf) of a recording.

A transform ``parent <- child`` is the pose of the child's frame in the parent's. The chain from the robot's
frame to the scanner's is composed in space and then laid on the floor: position and heading remain, and
whether the scanner hangs upside down.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from pilotage.core.angles import wrap_to_pi
from pilotage.core.types import FloatArray, Pose2

LARGEST = 1e9
"""No robot was farther away or faster, in any unit: what is beyond it was damaged."""
LARGEST_TILT_RAD = math.radians(5.0)
"""A scanner tilted by more does not scan a floor plan."""
MOVED_M_OR_RAD = 0.01


@dataclass(frozen=True, slots=True)
class Mount:
    """Pose of the scanner on the robot, whether it is upside down, and what is doubtful about it."""

    pose: Pose2
    upside_down: bool
    warnings: tuple[str, ...] = ()


@dataclass(slots=True)
class TransformTree:
    """The first transform of each child's frame, and which frames moved since."""

    parents: dict[str, tuple[str, FloatArray]] = field(default_factory=dict)
    moved: set[str] = field(default_factory=set)

    def add(self, transform: Any) -> None:
        """Take a ``geometry_msgs/TransformStamped``; what is damaged is passed over."""
        child, parent = frame_name(transform.child_frame_id), frame_name(transform.header.frame_id)
        known = self.parents.get(child)
        if known is not None and (child in self.moved or known[0] != parent):
            return
        shift, turn = transform.transform.translation, transform.transform.rotation
        numbers = np.array([shift.x, shift.y, shift.z, turn.x, turn.y, turn.z, turn.w], dtype=np.float64)
        if not (np.abs(numbers) <= LARGEST).all() or np.linalg.norm(numbers[3:]) < 1e-6:
            return
        matrix = transform_matrix(numbers[:3], numbers[3:])
        if known is None:
            self.parents[child] = parent, matrix
        elif np.abs(matrix - known[1]).max() > MOVED_M_OR_RAD:
            self.moved.add(child)

    def chain(self, root: str, leaf: str) -> tuple[FloatArray, bool] | None:
        """Return (4, 4) the pose of ``leaf`` in ``root``'s frame and whether a joint moved, or None."""
        up, down = self._to_top(root), self._to_top(leaf)
        common = next((frame for frame in down if frame in up), None)
        if common is None:
            return None
        root_pose, root_moved = up[common]
        leaf_pose, leaf_moved = down[common]
        return np.asarray(np.linalg.solve(root_pose, leaf_pose), dtype=np.float64), root_moved or leaf_moved

    def _to_top(self, frame: str) -> dict[str, tuple[FloatArray, bool]]:
        """Pose of ``frame`` in the frame of each of its ancestors, itself included, in this order."""
        pose, moved = np.eye(4), False
        found = {frame: (pose, moved)}
        while frame in self.parents:
            parent, matrix = self.parents[frame]
            if parent in found:  # a loop in damaged transforms
                break
            pose, moved = matrix @ pose, moved or frame in self.moved
            frame = parent
            found[frame] = (pose, moved)
        return found


def frame_name(frame: str) -> str:
    """Name a frame without the leading slash that ROS 1 allowed."""
    return frame.lstrip("/")


def transform_matrix(shift: FloatArray, quaternion: FloatArray) -> FloatArray:
    """Return (4, 4) from a translation and a quaternion x, y, z, w of any length but 0."""
    x, y, z, w = quaternion / np.linalg.norm(quaternion)
    out = np.eye(4)
    out[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    out[:3, 3] = shift
    return out


def mount_of(tree: TransformTree, base: str, scanner: str) -> Mount:
    """Return the scanner's mount; in the robot's origin with a warning where no transforms lead there."""
    base, scanner = frame_name(base), frame_name(scanner)
    if base == scanner:
        return Mount(Pose2(0.0, 0.0, 0.0), False)
    found = tree.chain(base, scanner)
    if found is None:
        return Mount(
            Pose2(0.0, 0.0, 0.0),
            False,
            (
                f"no transforms from '{base}' to the scanner's frame '{scanner}': "
                "it is taken to sit in the robot's origin and to look ahead",
            ),
        )
    matrix, moved = found
    said = []
    if moved:
        said.append(f"the scanner's mount '{base}' to '{scanner}' moves: its first pose is used throughout")
    tilt = math.acos(min(1.0, abs(float(matrix[2, 2]))))
    if tilt > LARGEST_TILT_RAD:
        said.append(f"the scanner is tilted by {math.degrees(tilt):.0f} deg: walls may appear out of place")
    pose = Pose2(float(matrix[0, 3]), float(matrix[1, 3]), wrap_to_pi(math.atan2(matrix[1, 0], matrix[0, 0])))
    return Mount(pose, bool(matrix[2, 2] < 0.0), tuple(said))
