"""Films rendered for tests: a sheet with a box and a tape on a rough floor, a robot that drives on it."""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Colour = tuple[int, int, int]

SIZE_M = 1.8
TILTED = ((120.0, 330.0), (560.0, 318.0), (450.0, 60.0), (190.0, 52.0))
"""Lower left, lower right, upper right, upper left in a picture of 640 x 360."""
FROM_ABOVE = ((160.0, 340.0), (480.0, 340.0), (480.0, 20.0), (160.0, 20.0))
FROM_THE_SIDE = ((60.0, 250.0), (400.0, 345.0), (600.0, 120.0), (270.0, 40.0))


@dataclass(frozen=True)
class FilmScript:
    """What is filmed."""

    corners_px: tuple[tuple[float, float], ...] = TILTED
    robot: Colour = (200, 60, 20)
    """BGR of the disc."""
    radius_m: float = 0.09
    frames: int = 60
    light: float = 0.0
    """How much the exposure swings, as a share."""
    noise: float = 3.0
    resting: int = 0
    """Frames at the end in which the robot stands still."""
    passer_by: bool = False
    """Something of the robot's own colour reaches in over the sheet's edge."""


def true_path_m(script: FilmScript) -> Floats:
    """Centre of the disc on the floor in each frame, shape (frames, 2)."""
    moving = script.frames - script.resting
    share = (
        np.minimum(np.arange(script.frames) / (moving - 1), 1.0) if moving > 1 else np.zeros(script.frames)
    )
    angle = 2.0 * np.pi * 0.8 * share
    return np.column_stack([0.9 + 0.45 * np.cos(angle), 0.95 + 0.3 * np.sin(angle)])


def true_path_px(script: FilmScript) -> Floats:
    """Where the camera sees the centre of the disc, shape (frames, 2)."""
    return _project(_to_image(script), true_path_m(script))


def render_film(path: Path, script: FilmScript, codec: str = "MJPG") -> None:
    """Write the film."""
    cv2 = importlib.import_module("cv2")
    rng = np.random.default_rng(7)
    floor = rng.integers(40, 90, (360, 640, 1)).astype(np.uint8).repeat(3, axis=2)
    scale = 2
    # A few pictures of noise, shifted from frame to frame: drawing them anew would take most of the time.
    grain = rng.normal(0.0, script.noise, (3, 360, 640, 3)).astype(np.float32)
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*codec), 30.0, (640, 360))
    assert writer.isOpened()
    side = 900
    H = _to_image(script) @ np.diag([SIZE_M / side, -SIZE_M / side, 1.0])
    H = H @ np.array([[1.0, 0.0, 0.0], [0.0, 1.0, -float(side)], [0.0, 0.0, 1.0]])
    zoom = np.array([[scale, 0.0, (scale - 1) / 2], [0.0, scale, (scale - 1) / 2], [0.0, 0.0, 1.0]])

    def seen(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """From the camera; drawn large and made small, so that edges are smooth."""
        big = cv2.warpPerspective(image, zoom @ H, (640 * scale, 360 * scale), flags=cv2.INTER_AREA)
        return np.asarray(cv2.resize(big, (640, 360), interpolation=cv2.INTER_AREA))

    bare = np.full((side, side, 3), (205, 210, 212), np.uint8)
    _fill(cv2, bare, (0.2, 0.25, 0.7, 0.4), (30, 40, 200))
    _fill(cv2, bare, (1.3, 1.5, 1.65, 1.62), (30, 40, 200))
    tape = _pixels(np.array([[0.2, 1.3], [0.5, 1.5], [0.9, 1.5]]), side)
    cv2.polylines(bare, [tape], False, (20, 20, 20), round(0.02 * side / SIZE_M))
    on_sheet = seen(np.full((side, side), 255, np.uint8))[..., None] > 127
    still = np.zeros(0, np.uint8)
    for number, (x, y) in enumerate(true_path_m(script)):
        # Where the robot rests only light and noise change.
        if number <= script.frames - script.resting or not len(still):
            sheet = bare.copy()
            centre = _pixels(np.array([[x, y]]), side)[0]
            radius_px = round(script.radius_m * side / SIZE_M)
            cv2.circle(sheet, tuple(map(int, centre)), radius_px, script.robot, -1)
            # A board that hides a part of the disc beside its middle, and turns as the robot drives.
            turn = 0.1 * min(number, script.frames - script.resting)
            across, along = np.array([np.cos(turn), np.sin(turn)]), np.array([-np.sin(turn), np.cos(turn)])
            r = script.radius_m
            board = [a * across + b * along for a, b in ((0.1, -0.6), (0.8, -0.6), (0.8, 0.6), (0.1, 0.6))]
            cv2.fillConvexPoly(sheet, _pixels(np.array([[x, y]]) + r * np.array(board), side), (25, 30, 25))
            still = np.where(on_sheet, seen(sheet), floor)
        picture = still.copy()
        if script.passer_by and number % 20 < 8:
            x0, y0 = (int(value) for value in script.corners_px[3])
            cv2.circle(picture, (x0 + 25, y0 + 5), 28, script.robot, -1)
        gain = 1.0 + script.light * np.sin(2.0 * np.pi * number / 25.0)
        noisy = picture * np.float32(gain) + np.roll(grain[number % 3], 37 * number, axis=1)
        writer.write(np.clip(noisy, 0, 255).astype(np.uint8))
    writer.release()


def _to_image(script: FilmScript) -> Floats:
    cv2 = importlib.import_module("cv2")
    square = SIZE_M * np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32)
    H: Floats = cv2.getPerspectiveTransform(square, np.array(script.corners_px, np.float32))
    return H


def _project(H: Floats, points: Floats) -> Floats:
    mapped = np.column_stack([points, np.ones(len(points))]) @ H.T
    return np.asarray(mapped[:, :2] / mapped[:, 2:])


def _pixels(points_m: Floats, side: int) -> NDArray[np.int32]:
    scaled = points_m * side / SIZE_M
    return np.rint(np.column_stack([scaled[:, 0], side - scaled[:, 1]])).astype(np.int32)


def _fill(cv2: Any, sheet: NDArray[np.uint8], box: tuple[float, ...], colour: Colour) -> None:
    corners = _pixels(np.array([[box[0], box[1]], [box[2], box[3]]]), sheet.shape[0])
    cv2.rectangle(sheet, tuple(map(int, corners[0])), tuple(map(int, corners[1])), colour, -1)
