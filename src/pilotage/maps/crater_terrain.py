"""Seeded terrain like the floor of a large crater: a mound, a rim, small craters, fractal roughness.

The course's images of Gale are not public; this stands in for them. Heights are the sum of

- a plain that is rough at random, self-affine with Hurst exponent H (power spectrum k^-(2 + 2 H), Turcotte
  1997), rougher on mound and rim,
- a mound, steepest half-way, with gullies, and a rim far from it (the wall of the large crater),
- scarps along the contours of a smooth random field, which peter out here and there and leave ramps,
- small craters whose number above a diameter D falls as D^-b (b about 2 where a surface is saturated, 3
  for fresh ones; Melosh 1989), depth 0.2 D when fresh and filled to a random part of that, a raised rim of
  a fifth of the depth, and ejecta that thin out with the third power of the distance.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray
from pydantic import Field

from pilotage.core.config import Config
from pilotage.core.errors import InputError
from pilotage.core.limits import DATA_BYTES, limit, too_large
from pilotage.core.random import RandomStreams
from pilotage.core.types import FloatArray, IntArray, Pose2
from pilotage.maps.elevation import ElevationModel
from pilotage.maps.landmarks import Landmarks
from pilotage.maps.memory import require_memory
from pilotage.maps.occupancy_grid import OccupancyGrid

HeightArray = NDArray[np.float32]

EJECTA_RADII = 3.0
"""Beyond this many radii a crater leaves no trace."""


COARSE = 8

CELL_BYTES, MOST_BYTES = 28, 2 * DATA_BYTES
"""What a cell takes while the terrain is made, and all of them at most: what files may be, worked on."""
MOST_CRATERS, MOST_TIMES_OVER = 200_000, 5.0
"""How many craters are dug, and how often they may cover the ground with what they throw out: long before
that the younger ones have erased the older ones, and digging takes minutes."""
MOST_SPACING_CELLS = 20_000
"""Between scarps; a smooth field's filter is half as long."""


class CraterTerrainConfig(Config):
    """Size and make-up of the terrain; lengths in metres, places as x, y in the map frame.

    The default seed is chosen so that the rover report's tasks make sense on it: P0, P1 and P2 on free,
    connected ground, a first trajectory that passes within 40 m of hazards and clear of them, a blocked
    straight line from P1 to P2, and on both ways at least three stretches of over 1 km where no landmark
    lies within 500 m.
    """

    seed: int = Field(51, ge=0)
    columns: int = Field(4500, ge=16, le=100_000)
    rows: int = Field(3000, ge=16, le=100_000)
    resolution_m: float = Field(10.0, gt=0.0)
    origin_m: tuple[float, float] = (0.0, -10.0)
    slope_limit_deg: float = Field(15.0, gt=0.0, lt=90.0)
    hurst: float = Field(0.85, gt=0.0, lt=1.0)
    plain_slope_deg: float = Field(1.6, ge=0.0, lt=45.0)
    rough_slope_deg: float = Field(9.0, ge=0.0, lt=45.0)
    mound_m: tuple[float, float] = (20_000.0, 13_000.0)
    mound_radius_m: float = Field(12_000.0, ge=1e-3)
    mound_height_m: float = Field(3_200.0, ge=0.0)
    rim_radius_m: float = Field(27_500.0, ge=1e-3)
    rim_height_m: float = Field(1_200.0, ge=0.0)
    scarp_height_m: float = Field(90.0, ge=0.0)
    scarp_width_m: float = Field(160.0, gt=0.0)
    scarp_spacing_m: float = Field(7_000.0, gt=0.0)
    craters_per_km2: float = Field(1.5, ge=0.0, le=1000.0)
    least_crater_m: float = Field(80.0, gt=0.0)
    greatest_crater_m: float = Field(2_500.0, gt=0.0)
    crater_exponent: float = Field(2.0, gt=0.0, le=5.0)
    landmarks_per_km2: float = Field(0.66, ge=0.0, le=1000.0)


@dataclass(frozen=True, slots=True, eq=False)
class CraterTerrain:
    """What the generator gives: heights, the hazards of its slope limit, and landmarks."""

    elevation: ElevationModel
    hazards: OccupancyGrid
    landmarks: Landmarks


@dataclass(frozen=True, slots=True, eq=False)
class _Craters:
    """In cells: middles (N, 2) row and column, radii (N,), the first and end (N, 2) of what each changes."""

    middles: FloatArray
    radii: FloatArray
    depths_m: FloatArray
    first: IntArray
    end: IntArray


def crater_terrain(config: CraterTerrainConfig) -> CraterTerrain:
    """Make the terrain; the same config gives the same one, bit for bit on one machine.

    Raises
    ------
    InputError
        Where it does not fit into memory, or its craters or the space between scarps are beyond what is dug.
    """
    size = CELL_BYTES * config.rows * config.columns
    what = f"crater terrain of {config.columns} x {config.rows} cells"
    if size > limit(MOST_BYTES):
        raise too_large(what, limit(MOST_BYTES), size)
    require_memory(size, what)
    if config.scarp_spacing_m > MOST_SPACING_CELLS * config.resolution_m:
        raise InputError(
            f"crater terrain: expected a scarp_spacing_m of at most {MOST_SPACING_CELLS} cells, "
            f"found {config.scarp_spacing_m / config.resolution_m:.3g}"
        )
    streams = RandomStreams(config.seed)
    craters = _craters(config, streams.stream("craters"))
    heights, rough = _mound_and_rim(config, streams.stream("gullies"))
    heights += _roughness(config, rough, streams.stream("roughness"))
    heights += _scarps(config, streams.stream("scarps"))
    _dig(heights, craters)
    origin = Pose2(*config.origin_m, 0.0)
    heights.flags.writeable = False
    elevation = ElevationModel(heights, config.resolution_m, origin)
    hazards = elevation.hazards(config.slope_limit_deg)
    return CraterTerrain(elevation, hazards, _landmarks(config, streams.stream("boulders")))


def _axes(config: CraterTerrainConfig) -> tuple[HeightArray, HeightArray]:
    """x (1, columns) and y (rows, 1) of the cells' centres."""
    x = config.origin_m[0] + (np.arange(config.columns) + 0.5) * config.resolution_m
    y = config.origin_m[1] + (config.rows - 0.5 - np.arange(config.rows)) * config.resolution_m
    return x.astype(np.float32)[None, :], y.astype(np.float32)[:, None]


def _mound_and_rim(config: CraterTerrainConfig, rng: np.random.Generator) -> tuple[HeightArray, HeightArray]:
    """Heights of mound and rim, and how rough the ground is, 0 on the plain to 1 on steep flanks."""
    x, y = _axes(config)
    x, y = x - np.float32(config.mound_m[0]), y - np.float32(config.mound_m[1])
    away = np.hypot(x, y)
    angle = np.arctan2(y, x)
    # Lobes and gullies: the mound's outline swings with the direction.
    outline = np.ones_like(away)
    for lobes in (2, 3, 5, 9, 17):
        phase, swing = rng.uniform(0.0, 2.0 * math.pi), 0.1 / math.sqrt(lobes) * rng.uniform(0.5, 1.5)
        outline += np.float32(swing) * np.cos(np.float32(lobes) * angle + np.float32(phase))
    up: HeightArray = np.clip(1.0 - away / (np.float32(config.mound_radius_m) * outline), 0.0, 1.0)
    del angle, outline
    beyond = (away - np.float32(config.rim_radius_m)) / np.float32(0.1 * config.rim_radius_m)
    out: HeightArray = np.clip(beyond, 0.0, 1.0)
    del away, beyond
    heights = np.float32(config.mound_height_m) * _smooth(up)
    heights += np.float32(config.rim_height_m) * _smooth(out)
    # Steepest half-way up; the top and the plain are smooth.
    rough = 4.0 * up * (1.0 - up) + 4.0 * out * (1.0 - out)
    return heights, np.asarray(np.clip(rough, 0.0, 1.0), dtype=np.float32)


def _smooth(t: HeightArray) -> HeightArray:
    """From 0 to 1 with a level start and end."""
    return np.asarray(t * t * (3.0 - 2.0 * t), dtype=np.float32)


def _roughness(config: CraterTerrainConfig, rough: HeightArray, rng: np.random.Generator) -> HeightArray:
    """Fractal heights whose root-mean-square slope is the plain's, more where the ground is rough."""
    from scipy import fft  # loads what most runs never need

    rows, columns = config.rows, config.columns
    rows_fast, columns_fast = fft.next_fast_len(rows), fft.next_fast_len(columns, real=True)
    k = np.hypot(fft.fftfreq(rows_fast)[:, None], fft.rfftfreq(columns_fast)[None, :]).astype(np.float32)
    # Longer waves than a quarter of the map belong to mound and rim.
    longest = np.float32(4.0 / max(rows, columns))
    spectrum = np.maximum(k, longest) ** np.float32(-1.0 - config.hurst)
    spectrum[0, 0] = 0.0
    waves = np.empty(k.shape, np.complex64)
    waves.real = rng.standard_normal(k.shape, dtype=np.float32) * spectrum
    waves.imag = rng.standard_normal(k.shape, dtype=np.float32) * spectrum
    heights = np.asarray(fft.irfft2(waves, s=(rows_fast, columns_fast))[:rows, :columns], dtype=np.float32)
    del waves, spectrum, k
    down, right = np.diff(heights[::4, ::4], axis=0), np.diff(heights[::4, ::4], axis=1)
    slope = math.sqrt(float(np.mean(down**2) + np.mean(right**2))) / (4.0 * config.resolution_m)
    plain, steep = (math.tan(math.radians(s)) for s in (config.plain_slope_deg, config.rough_slope_deg))
    scale = np.float32(plain / slope) + np.float32((steep - plain) / slope) * rough
    heights *= scale
    return heights


def _scarps(config: CraterTerrainConfig, rng: np.random.Generator) -> HeightArray:
    """Steps up across the zero contour of one smooth field, as high as another one allows.

    Both are made on every eighth cell and stretched: they do not change within that.
    """
    shape = math.ceil(config.rows / COARSE) + 1, math.ceil(config.columns / COARSE) + 1
    cell_m = COARSE * config.resolution_m
    fields = []
    for scale in (0.25, 0.12):
        sigma = scale * config.scarp_spacing_m / cell_m
        smooth = scipy.ndimage.gaussian_filter(rng.standard_normal(shape), sigma, mode="wrap")
        fields.append(smooth / max(float(smooth.std()), 1e-12))
    down, right = np.gradient(fields[0], cell_m)
    # Distance from the contour, to first order.
    aside = fields[0] / np.maximum(np.hypot(down, right), 1e-12)
    step = np.clip(0.5 + aside / config.scarp_width_m, -4.0, 5.0).astype(np.float32)
    height = (config.scarp_height_m * np.clip(0.7 + 0.9 * fields[1], 0.0, 1.0)).astype(np.float32)
    rise = _smooth(np.clip(_stretched(step, config), np.float32(0.0), np.float32(1.0)))
    rise *= _stretched(height, config)
    return rise


def _stretched(coarse: HeightArray, config: CraterTerrainConfig) -> HeightArray:
    """Bilinear interpolation from every eighth cell to all."""
    rows, columns = np.arange(config.rows), np.arange(config.columns)
    row, column = rows // COARSE, columns // COARSE
    part = (columns % COARSE / COARSE).astype(np.float32)
    wide = coarse[:, column] * (1.0 - part) + coarse[:, column + 1] * part
    part = (rows % COARSE / COARSE).astype(np.float32)[:, None]
    return np.asarray(wide[row] * (1.0 - part) + wide[row + 1] * part, dtype=np.float32)


def _craters(config: CraterTerrainConfig, rng: np.random.Generator) -> _Craters:
    """Draw the craters, oldest first.

    Raises
    ------
    InputError
        Where they are more than anybody could tell apart.
    """
    rows, columns = config.rows, config.columns
    area_km2 = rows * columns * (config.resolution_m / 1000.0) ** 2
    if config.craters_per_km2 * area_km2 > MOST_CRATERS:
        raise InputError(
            f"crater terrain: expected at most {MOST_CRATERS} craters, "
            f"found {config.craters_per_km2:g} per km2 on {area_km2:.3g} km2"
        )
    count = int(rng.poisson(config.craters_per_km2 * area_km2))
    least, greatest = config.least_crater_m, max(config.least_crater_m, config.greatest_crater_m)
    # The inverse of a power law cut off at both ends.
    part = rng.random(count) * (1.0 - (greatest / least) ** -config.crater_exponent)
    radii = 0.5 * least * (1.0 - part) ** (-1.0 / config.crater_exponent) / config.resolution_m
    middles = rng.random((count, 2)) * (rows, columns)
    depths = 0.4 * radii * config.resolution_m * rng.uniform(0.15, 1.0, count)
    reach = EJECTA_RADII * radii[:, None]
    first = np.maximum(0.0, np.floor(middles - reach))
    end = np.minimum([rows, columns], np.ceil(middles + reach) + 1.0)
    times_over = float(np.prod(end - first, axis=1).sum()) / (rows * columns)
    if times_over > MOST_TIMES_OVER:
        raise InputError(
            f"crater terrain: expected craters that cover the ground at most {MOST_TIMES_OVER:g} times over, "
            f"found {times_over:.3g}; take fewer per km2, or smaller ones"
        )
    return _Craters(middles, radii, depths, first.astype(np.int64), end.astype(np.int64))


def _dig(heights: HeightArray, craters: _Craters) -> None:
    """Dig craters into ``heights``."""
    for (row, column), radius, depth, (top, left), (bottom, right) in zip(
        craters.middles,
        craters.radii,
        craters.depths_m,
        craters.first.tolist(),
        craters.end.tolist(),
        strict=True,
    ):
        y = (np.arange(top, bottom) + 0.5 - row) / radius
        x = (np.arange(left, right) + 0.5 - column) / radius
        away = np.hypot(y[:, None], x[None, :]).astype(np.float32)
        heights[top:bottom, left:right] += _crater(away) * np.float32(depth)


def _crater(away: HeightArray) -> HeightArray:
    """Height of a crater of depth 1, by the distance from its middle in radii."""
    rim = np.float32(0.2)
    bowl = away * away * (1.0 + rim) - 1.0
    fade = (np.float32(EJECTA_RADII) - away) / np.float32(EJECTA_RADII - 1.0)
    ejecta = rim * np.maximum(away, np.float32(1.0)) ** -3 * np.clip(fade, 0.0, 1.0)
    return np.asarray(np.where(away < 1.0, bowl, ejecta), dtype=np.float32)


def _landmarks(config: CraterTerrainConfig, rng: np.random.Generator) -> Landmarks:
    """One point somewhere in each square of a coarse grid: sparse, with gaps, but nowhere very wide ones."""
    if config.landmarks_per_km2 == 0.0:
        return Landmarks(np.zeros(0, np.int64), np.zeros((0, 2)))
    side_m = 1000.0 / math.sqrt(config.landmarks_per_km2)
    size_m = np.array([config.columns, config.rows]) * config.resolution_m
    across, up = (math.ceil(length / side_m) for length in size_m.tolist())
    squares = np.stack(np.meshgrid(np.arange(across), np.arange(up)), axis=-1).reshape(-1, 2)
    points: FloatArray = (squares + rng.random(squares.shape)) * side_m
    points = points[(points < size_m).all(axis=1)] + config.origin_m
    return Landmarks(np.arange(len(points)), points)
