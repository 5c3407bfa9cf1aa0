"""The sheet's geometry: pixels of the film to metres on the floor and back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pilotage.core.errors import InputError
from pilotage.tracking.opencv import opencv

Floats = NDArray[np.float64]
MOST_PX = 1e6
"""Farther than any picture is wide."""


@dataclass(frozen=True, slots=True)
class Sheet:
    """A square sheet on the floor as the camera sees it.

    Attributes
    ----------
    corners_px
        Lower left (the origin), lower right, upper right, upper left of the map, shape (4, 2).
    size_m
        Side of the square.
    corner_std_px
        How well the corners are known.
    """

    corners_px: Floats
    size_m: float
    corner_std_px: float

    @property
    def to_floor(self) -> Floats:
        """Homography from pixels to metres, shape (3, 3)."""
        return _homography(self.corners_px, self._corners_m)

    @property
    def to_image(self) -> Floats:
        """Homography from metres to pixels, shape (3, 3)."""
        return _homography(self._corners_m, self.corners_px)

    @property
    def _corners_m(self) -> Floats:
        return self.size_m * np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])

    def to_top_view(self, side_px: int) -> Floats:
        """Homography from pixels of the film to a top view with y up, shape (3, 3)."""
        top = (side_px - 1) * np.array([[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]])
        return _homography(self.corners_px, top)

    def metres_per_px(self, point_px: Floats) -> Floats:
        """Jacobian of the floor point against the pixel, shape (2, 2)."""
        H = self.to_floor
        x, y, w = H @ np.array([point_px[0], point_px[1], 1.0])
        return np.asarray((H[:2, :2] - np.outer([x / w, y / w], H[2, :2])) / w)

    def camera_m(self, image_shape: tuple[int, int]) -> Floats | None:
        """Where the camera is over the floor, from how a square looks through it.

        Assumes square pixels and the optical axis through the middle of the picture. Zhang, "A flexible new
        technique for camera calibration", 2000, for one view.

        Returns
        -------
        Floats | None
            x, y, z in metres; None where the view is so straight from above that it does not tell.
        """
        centred = np.array(
            [[1.0, 0.0, -image_shape[1] / 2.0], [0.0, 1.0, -image_shape[0] / 2.0], [0.0, 0.0, 1.0]]
        )
        H = centred @ self.to_image
        first, second, third = (H / np.linalg.norm(H[:, :2])).T
        # The floor's axes are at right angles and equally long: either condition gives the focal length.
        across = first[2] * second[2]
        unequal = first[2] ** 2 - second[2] ** 2
        weight = np.array([across, unequal])
        value = -np.array(
            [first[:2] @ second[:2], first[:2] @ first[:2] - second[:2] @ second[:2]],
        )
        bend = float(weight @ weight)
        focal_squared = float(weight @ value) / bend if bend > 0.0 else -1.0
        if not (0.1 * max(image_shape)) ** 2 < focal_squared < (20.0 * max(image_shape)) ** 2:
            return None
        unproject = np.diag([focal_squared**-0.5, focal_squared**-0.5, 1.0])
        axis_x, axis_y, origin = unproject @ first, unproject @ second, unproject @ third
        scale = 2.0 / (np.linalg.norm(axis_x) + np.linalg.norm(axis_y))
        axis_x, axis_y, origin = axis_x * scale, axis_y * scale, origin * scale
        rotation = np.column_stack([axis_x, axis_y, np.cross(axis_x, axis_y)])
        camera = -np.linalg.solve(rotation, origin)
        # Image y points down, floor y up: the third axis may point into the floor.
        return np.array([camera[0], camera[1], abs(camera[2])])


def project(H: Floats, points: Floats) -> Floats:
    """Send points, shape (N, 2), through a homography."""
    mapped = np.column_stack([points, np.ones(len(points))]) @ H.T
    return np.asarray(mapped[:, :2] / mapped[:, 2:])


def parse_corners(text: str) -> Floats:
    """Read the corners that a user gives.

    Counter-clockwise as seen in the picture, the map's origin first; or clockwise from its upper left corner.

    Returns
    -------
    Floats
        Lower left, lower right, upper right, upper left, shape (4, 2).

    Raises
    ------
    InputError
        If these are not eight numbers or not the corners of a convex quadrilateral.
    """
    try:
        values = [float(part) for part in text.split(",")]
    except ValueError:
        values = []
    if len(values) != 8 or not all(abs(value) <= MOST_PX for value in values):
        raise InputError(f"--corners: expected eight numbers x,y,x,y,x,y,x,y in pixels, found '{text}'")
    corners = np.array(values).reshape(4, 2)
    turns = turning(corners)
    if not (np.all(turns > 0.0) or np.all(turns < 0.0)):
        raise InputError("--corners: expected a convex quadrilateral, its corners in order around it")
    # Image y points down: a negative turn is counter-clockwise to the eye.
    return corners if turns[0] < 0.0 else corners[::-1].copy()


def in_map_order(corners: Floats) -> Floats:
    """Return the corners of a convex quadrilateral with the lowest side of the picture as the map's lower."""
    if turning(corners)[0] > 0.0:
        corners = corners[::-1]
    heights = [corners[i, 1] + corners[(i + 1) % 4, 1] for i in range(4)]
    return np.roll(corners, -int(np.argmax(heights)), axis=0)


def turning(corners: Floats | Sequence[Sequence[float]]) -> Floats:
    """Cross product of the sides that meet in each corner: one sign for all where it is convex."""
    points = np.asarray(corners, dtype=np.float64)
    side = np.roll(points, -1, axis=0) - points
    before = np.roll(side, 1, axis=0)
    return np.asarray(before[:, 0] * side[:, 1] - before[:, 1] * side[:, 0])


def _homography(source: Floats, target: Floats) -> Floats:
    cv2 = opencv()
    return np.asarray(
        cv2.getPerspectiveTransform(source.astype(np.float32), target.astype(np.float32)), dtype=np.float64
    )
