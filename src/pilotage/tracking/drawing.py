"""Pictures of a track: the map from above with the path on it, and the film with the robot marked."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pilotage.tracking.film import Image
from pilotage.tracking.opencv import opencv
from pilotage.tracking.robot_finder import Sighting
from pilotage.tracking.scene import Scene
from pilotage.tracking.sheet import Sheet, project
from pilotage.tracking.track import Track

Floats = NDArray[np.float64]
Colour = tuple[int, int, int]

# BGR; told apart by lightness as well as hue.
_GRID: Colour = (190, 170, 150)
_PATH: Colour = (200, 60, 20)
_DISC: Colour = (60, 220, 255)
_SHEET: Colour = (90, 200, 60)
_TAPE: Colour = (180, 0, 180)
_BOX: Colour = (0, 160, 255)
_SIDE_PX = 1000


def top_view(track: Track) -> Image:
    """The empty map from above, y up, with grid, visited cells, edges and path; 1000 x 1000 pixels."""
    cv2 = opencv()
    scene = track.scene
    side, size_m, grid = _SIDE_PX, scene.options.size_m, scene.options.grid
    region = scene.background.region
    reduced_corners = (scene.sheet.corners_px - 0.5 * (scene.film.reduction - 1)) / scene.film.reduction
    H = Sheet(reduced_corners - region.offset, 1.0, 0.0).to_top_view(side)
    picture: Image = cv2.warpPerspective(scene.background.image, H, (side, side), flags=cv2.INTER_CUBIC)
    tint = picture.copy()
    edges = np.linspace(0, side, grid + 1).round().astype(int)
    for row, column in zip(*np.nonzero(track.visited), strict=True):
        top, left = grid - 1 - row, column
        tint[edges[top] : edges[top + 1], edges[left] : edges[left + 1]] = _PATH
    picture = cv2.addWeighted(tint, 0.25, picture, 0.75, 0.0)
    for edge in edges:
        cv2.line(picture, (int(edge), 0), (int(edge), side), _GRID, 1)
        cv2.line(picture, (0, int(edge)), (side, int(edge)), _GRID, 1)

    def pixels(points_m: Floats) -> NDArray[np.int32]:
        scaled = points_m * (side - 1) / size_m
        return np.rint(np.column_stack([scaled[:, 0], side - 1 - scaled[:, 1]])).astype(np.int32)

    for segment, tape in zip(scene.marks.edges_m, scene.marks.is_tape, strict=True):
        cv2.polylines(
            picture, [pixels(segment.reshape(2, 2))], False, _TAPE if tape else _BOX, 2, cv2.LINE_AA
        )
    if len(track.path.frames):
        points = pixels(track.path.points_m)
        cv2.polylines(picture, [points], False, _PATH, 2, cv2.LINE_AA)
        cv2.circle(picture, tuple(int(v) for v in points[-1]), 6, _PATH, -1, cv2.LINE_AA)
    return picture


class Annotator:
    """Draws sheet, grid, path so far and the robot's disc into the frames of a film, one after the other."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._shape = scene.film.samples[0].shape
        # What stays from frame to frame is drawn once and laid over: the path grows, the work does not.
        self._overlay: Image = np.zeros(self._shape, np.uint8)
        self._mask: Image = np.zeros(self._shape[:2], np.uint8)
        self._last: NDArray[np.int32] | None = None
        self._frame = 0
        self._radius_m = 0.0 if scene.look is None else scene.look.radius_m
        size_m, grid = scene.options.size_m, scene.options.grid
        for k in range(grid + 1):
            at = size_m * k / grid
            colour = _SHEET if k in (0, grid) else _GRID
            self._stroke(np.array([[at, 0.0], [at, size_m]]), colour)
            self._stroke(np.array([[0.0, at], [size_m, at]]), colour)

    def draw(self, reduced_frame: Image, sighting: Sighting | None) -> Image:
        """Return the frame with everything drawn in."""
        cv2 = opencv()
        picture: Image = reduced_frame.copy()
        if sighting is not None:
            here = self._pixels(sighting.centre_m[None])
            if self._last is not None:
                self._stroke_pixels(np.concatenate([self._last, here]), _PATH, 2)
            self._last = here
        else:
            self._last = None
        cv2.copyTo(self._overlay, self._mask, picture)
        if sighting is not None:
            angle = np.linspace(0.0, 2.0 * np.pi, 37)
            rim = sighting.centre_m + self._radius_m * np.column_stack([np.cos(angle), np.sin(angle)])
            cv2.polylines(picture, [self._pixels(rim)], True, _DISC, 2, cv2.LINE_AA)
        found = "" if sighting is not None else "  robot not found"
        label = f"frame {self._frame}{found}"
        cv2.putText(picture, label, (8, 20), cv2.FONT_HERSHEY_SIMPLEX, 0.5, (0, 0, 0), 3, cv2.LINE_AA)
        cv2.putText(picture, label, (8, 20), cv2.FONT_HERSHEY_SIMPLEX, 0.5, (255, 255, 255), 1, cv2.LINE_AA)
        self._frame += 1
        return picture

    def _pixels(self, points_m: Floats) -> NDArray[np.int32]:
        full = project(self._scene.sheet.to_image, points_m)
        by = self._scene.film.reduction
        return np.rint((full - 0.5 * (by - 1)) / by).astype(np.int32)

    def _stroke(self, points_m: Floats, colour: Colour) -> None:
        self._stroke_pixels(self._pixels(points_m), colour, 1)

    def _stroke_pixels(self, points: NDArray[np.int32], colour: Colour, width: int) -> None:
        cv2 = opencv()
        cv2.polylines(self._overlay, [points], False, colour, width)
        cv2.polylines(self._mask, [points], False, 255, width)
