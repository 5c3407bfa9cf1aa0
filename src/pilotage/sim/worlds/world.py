"""The world as it is: it answers physical questions and does not say which of its layers knew."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.types import BoolArray, FloatArray, IntArray, Pose2
from pilotage.kernels.bodies import clearances, drive
from pilotage.kernels.geometry.motion import turned_part
from pilotage.kernels.geometry.plane import NO_CIRCLES, NO_SEGMENTS
from pilotage.kernels.geometry.solids import Fixed
from pilotage.kernels.scans import mounted, rays, sight
from pilotage.maps.landmarks import Landmarks
from pilotage.maps.world_map import WorldMap
from pilotage.models.footprint import Footprint
from pilotage.sim.worlds.floor import FloorLayer
from pilotage.sim.worlds.grid import GridLayer
from pilotage.sim.worlds.ground import GroundLayer
from pilotage.sim.worlds.traffic import NOBODY, Traffic


@dataclass(frozen=True, slots=True, eq=False)
class World:
    """Layers of a map, the obstacles that nobody told the robot of, and who moves about.

    Attributes
    ----------
    chart
        What is on the map.
    obstacle_segments_m, obstacle_circles_m
        (K, 4) and (K, 3): what is there besides.
    segments_m, circles_m
        Walls and discs of both.
    grid
        Occupied cells as solids; none where walls are given exactly or the grid is one of hazards.
    floor, ground
        Markings and terrain; None where there are none.
    traffic
        Robots and people.
    """

    chart: WorldMap
    obstacle_segments_m: FloatArray
    obstacle_circles_m: FloatArray
    segments_m: FloatArray
    circles_m: FloatArray
    grid: GridLayer
    floor: FloorLayer | None
    ground: GroundLayer | None
    traffic: Traffic

    @staticmethod
    def of(
        chart: WorldMap,
        obstacle_segments_m: FloatArray = NO_SEGMENTS,
        obstacle_circles_m: FloatArray = NO_CIRCLES,
    ) -> World:
        """Build from a map and what stands there besides."""
        extra = np.array(obstacle_segments_m, dtype=np.float64).reshape(-1, 4)
        extra_circles = np.array(obstacle_circles_m, dtype=np.float64).reshape(-1, 3)
        # As those of a map of walls: kernels are compiled once for all worlds.
        extra.flags.writeable = extra_circles.flags.writeable = False
        segments, circles = extra, extra_circles
        if chart.geometry is not None:
            both = chart.geometry.with_obstacles(extra, extra_circles)
            segments, circles = both.segments_m, both.circles_m
        hazards = chart.open_ground
        solid = chart.grid is not None and chart.geometry is None and not hazards
        ground = None
        if chart.elevation is not None or (hazards and chart.grid is not None):
            ground = GroundLayer(chart.grid if hazards else None, chart.elevation)
        return World(
            chart,
            extra,
            extra_circles,
            segments,
            circles,
            GridLayer.of(chart.grid) if solid and chart.grid is not None else GridLayer.none(),
            None if chart.markings is None else FloorLayer(chart.markings),
            ground,
            Traffic.none(),
        )

    def with_traffic(self, traffic: Traffic) -> World:
        """The same world with other moving bodies; the layers are shared."""
        return replace(self, traffic=traffic)

    @property
    def fixed(self) -> Fixed:
        """What does not move, as the kernels take it."""
        return self.segments_m, self.circles_m, self.grid.tiles

    @property
    def landmarks(self) -> Landmarks:
        """Points with identities."""
        return self.chart.landmarks

    @property
    def has_solids(self) -> bool:
        """Whether it has a layer that beams end at: on bare terrain that may be who else is about."""
        return (
            self.chart.geometry is not None
            or (self.chart.grid is not None and not self._open_ground)
            or len(self.segments_m) + len(self.circles_m) > 0
            or self.traffic.is_anybody
        )

    @property
    def _open_ground(self) -> bool:
        """Whether what its grid blocks is a hazard that stops neither body nor beam."""
        return self.ground is not None and self.ground.hazards is not None

    def check_solids(self, where: str, what: str) -> None:
        """Refuse ``what`` in a world that no beam can end in.

        Raises
        ------
        InputError
            Where there are neither walls nor a grid of solid cells, and nobody else is about.
        """
        if not self.has_solids:
            raise InputError(
                f"{where}: {what} needs a world with walls or a grid, or others about, "
                f"found {self._layers()}; take the sensor off or choose another map"
            )

    def check_markings(self, where: str, what: str) -> FloorLayer:
        """The markings; refuse ``what`` where nothing is marked on the floor.

        Raises
        ------
        InputError
            Where there are no markings.
        """
        if self.floor is None:
            raise InputError(
                f"{where}: {what} needs a world with floor markings, found {self._layers()}; "
                f"take the sensor off or choose another map"
            )
        return self.floor

    def check_place(self, where: str, footprint: Footprint, pose: Pose2) -> None:
        """Refuse a place that leaves no room for a footprint.

        Raises
        ------
        InputError
            Off the map, or where the footprint overlaps something.
        """
        xmin, ymin, xmax, ymax = self.chart.bounds_m
        if not self.chart.contains(pose.x_m, pose.y_m):
            raise InputError(
                f"{where}: expected a place on the map '{self.chart.name}' ({xmin:g} to {xmax:g}, "
                f"{ymin:g} to {ymax:g} m), found ({pose.x_m:g}, {pose.y_m:g})"
            )
        clear = float(self.clearance_m(footprint, pose.as_array()[None, :])[0])
        if clear < 0.0:
            raise InputError(
                f"{where}: expected room for the robot's footprint, found it {-clear:.3f} m inside an "
                f"obstacle at ({pose.x_m:g}, {pose.y_m:g}); move it or make the footprint smaller"
            )

    def _layers(self) -> str:
        chart = self.chart
        names = {
            "walls": chart.geometry,
            "hazards on open ground" if self._open_ground else "a grid": chart.grid,
            "heights": chart.elevation,
            "floor markings": chart.markings,
        }
        return ", ".join(name for name, layer in names.items() if layer is not None) or "an empty map"

    def scan(
        self, poses: FloatArray, angles_rad: FloatArray, max_range_m: float, own: IntArray | None = None
    ) -> FloatArray:
        """Ranges (N, B) along fans of evenly spaced beams from poses (N, 3), counter-clockwise.

        Parameters
        ----------
        angles_rad
            (B,) directions of the beams in the sensor's frame, at equal steps, over a full turn at most.
        own
            (N, 3) rows of ``traffic`` that each pose does not see.

        Returns
        -------
        ``max_range_m`` where nothing is hit.
        """
        places = np.ascontiguousarray(poses, dtype=np.float64).reshape(-1, 3)
        nobody = np.tile(NOBODY, (len(places), 1)) if own is None else own
        return self.scan_along(places, fan_of(angles_rad, max_range_m), nobody)

    def scan_along(self, places: FloatArray, fan: rays.Fan, own: IntArray) -> FloatArray:
        """The same from poses (N, 3) of who scans again and again along one fan."""
        return mounted.fans(places, own, np.zeros(3), fan, self.fixed, self.traffic.others)

    def beam(self, poses: FloatArray, max_range_m: float, own: IntArray = NOBODY) -> FloatArray:
        """Ranges (N,) of single beams along the headings of poses (N, 3); inf where nothing is hit.

        Readings are finite: a sensor takes the least of it and its reach.
        """
        places = np.ascontiguousarray(poses, dtype=np.float64).reshape(-1, 3)
        return np.array(
            [
                mounted.beam_at(
                    place,
                    np.zeros(3),
                    max_range_m,
                    self.fixed,
                    self.traffic.others,
                    own,
                )
                for place in places
            ]
        )

    def cone(
        self, poses: FloatArray, width_rad: float, max_range_m: float, own: IntArray = NOBODY
    ) -> FloatArray:
        """Distance (N,) to the nearest return in cones around the headings of poses (N, 3); inf for none.

        A cone is less than half a turn wide; returns beyond ``max_range_m`` may be left out.
        """
        places = np.ascontiguousarray(poses, dtype=np.float64).reshape(-1, 3)
        count = len(places)
        out = np.empty(count)
        mounted.cones(
            places,
            np.arange(count),
            np.tile(own, (count, 1)),
            np.tile([0.0, 0.0, 0.0, 0.5 * width_rad, max_range_m], (count, 1)),
            self.fixed,
            self.traffic.others,
            out,
        )
        return out

    def clearance_m(self, footprint: Footprint, poses: FloatArray, own: IntArray = NOBODY) -> FloatArray:
        """Exact distance (N,) of a footprint's edge at poses (N, 3) from everything solid; inf without any.

        Negative where they overlap.
        """
        return clearances.at_poses(
            np.ascontiguousarray(poses, dtype=np.float64).reshape(-1, 3),
            footprint.outline,
            self.fixed,
            self.traffic.others,
            own,
        )

    def advance(
        self, footprint: Footprint, pose: Pose2, move: tuple[float, float, float], own: IntArray = NOBODY
    ) -> tuple[Pose2, float]:
        """Move a footprint at constant twist until it touches something.

        Parameters
        ----------
        move
            Distance forward, to the left, and angle turned.

        Returns
        -------
        Where it stands and the part of the move that it did: 1 without a contact.
        """
        clear = float(self.clearance_m(footprint, pose.as_array()[None, :], own)[0])
        part = drive.first_contact(
            pose.x_m,
            pose.y_m,
            pose.theta_rad,
            *move,
            clear,
            footprint.outline,
            self.fixed,
            self.traffic.others,
            own,
        )
        return Pose2(*turned_part(pose.x_m, pose.y_m, pose.theta_rad, *move, part)), float(part)

    def landmarks_in_sight(
        self, pose: Pose2, max_range_m: float, field_of_view_rad: float, own: IntArray = NOBODY
    ) -> tuple[IntArray, FloatArray, FloatArray]:
        """Ids, true ranges and bearings of the landmarks in view; what is solid hides those behind it."""
        marks = self.landmarks
        count, nothing = len(marks), np.zeros((2, len(self.landmarks)))
        ids, ranges, bearings = np.zeros(count, dtype=np.int64), np.zeros(count), np.zeros(count)
        seen = sight.sightings(
            pose.as_array(),
            nothing,
            np.zeros(3),
            marks.points_xy_m,
            marks.ids,
            (0.5 * field_of_view_rad, max_range_m, 0.0, 0.0, 0.0),
            self.fixed,
            self.traffic.others,
            own,
            ids,
            ranges,
            bearings,
        )
        return ids[:seen], ranges[:seen], bearings[:seen]

    def is_dark(self, points_xy_m: FloatArray) -> BoolArray:
        """(K,) whether the floor is dark at points (K, 2); nowhere without markings."""
        if self.floor is None:
            return np.zeros(len(points_xy_m), dtype=np.bool_)
        return np.array([self.floor.is_dark(float(x), float(y)) for x, y in points_xy_m], dtype=np.bool_)

    def on_hazard(self, points_xy_m: FloatArray) -> BoolArray:
        """(K,) whether points (K, 2) lie on a hazard of open ground; nowhere without such."""
        if self.ground is None:
            return np.zeros(len(points_xy_m), dtype=np.bool_)
        return self.ground.on_hazards(points_xy_m)

    def heights_m(self, points_xy_m: FloatArray) -> FloatArray:
        """Heights (K,) of the ground at points (K, 2): 0 where nobody says, NaN off an elevation model."""
        return np.zeros(len(points_xy_m)) if self.ground is None else self.ground.heights_m(points_xy_m)

    def slopes_rad(self, points_xy_m: FloatArray) -> FloatArray:
        """Steepest slopes (K,) of the ground at points (K, 2), as ``heights_m``."""
        return np.zeros(len(points_xy_m)) if self.ground is None else self.ground.slopes_rad(points_xy_m)


def fan_of(angles_rad: FloatArray, max_range_m: float) -> rays.Fan:
    """Beams at equal steps (B,), and how far they reach, as the kernels take them."""
    step = float(angles_rad[1] - angles_rad[0]) if len(angles_rad) > 1 else 0.0
    from_first = angles_rad - angles_rad[0]
    return float(angles_rad[0]), step, np.cos(from_first), np.sin(from_first), max_range_m
