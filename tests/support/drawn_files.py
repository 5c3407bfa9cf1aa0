"""Recordings, graphs, worlds and maps drawn from their formats: well-formed, with values at the edges.

Each draws one set of files into a folder and returns the words of the command that reads them.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.io import savemat

from pilotage.logs.odometry_csv import COLUMNS
from support.drawn_exports import exported
from support.fuzz_targets.maps import write_walls
from support.fuzz_targets.missions import STRAIGHT
from support.laser_bags import Drive, Scan, write_ros1, write_ros2
from support.laser_drives import laser_drive

Words = tuple[str, ...]
Draw = Callable[[Path, random.Random], Words]
SIZES = (0.0, -0.0, 1e-30, 1e-12, 1e-6, 1e-3, 1.0, 10.0, 1e3, 1e6, 1e9, 1e12, 1e15, 1e30)
STEPS = ("even", "even", "even", "same", "back", "gap", "tiny", "jitter", "far")
WALKS = ("walk", "walk", "walk", "still", "line", "jump", "spin", "huge", "tiny")


def times(rng: random.Random, n: int, dt_s: float = 0.1) -> list[float]:
    """Moments that a clock may tell: even, standing, going back, with gaps of years, in microseconds."""
    kind, t_s, out = rng.choice(STEPS), rng.choice((0.0, 100.0, 1.7e9, -50.0)), []
    for k in range(n):
        out.append(t_s)
        step = {"same": 0.0, "tiny": 1e-7, "jitter": dt_s * rng.uniform(-0.5, 2.0), "far": 1e7}.get(
            kind, dt_s
        )
        if kind in ("back", "gap") and k == n // 2:
            step = -3.0 if kind == "back" else 1e6
        t_s += step
    return out


def walk(rng: random.Random, n: int) -> np.ndarray:
    """(n, 3) poses: a drive, standing, along a line, with a jump, turning only, kilometres, nanometres."""
    kind = rng.choice(WALKS)
    draws = np.random.default_rng(rng.getrandbits(32))
    steps = draws.normal((0.05, 0.0, 0.02), (0.01, 0.002, 0.03), (n, 3))
    poses = np.cumsum(steps, axis=0)
    if kind == "still":
        poses[:] = poses[0]
    elif kind == "line":
        poses[:, 1:] = 0.0
    elif kind == "jump":
        poses[n // 2 :] += rng.choice(SIZES)
    elif kind == "spin":
        poses[:, :2] = 0.0
        poses[:, 2] *= 100.0
    elif kind in ("huge", "tiny"):
        poses *= rng.choice((1e3, 1e6)) if kind == "huge" else rng.choice((1e-9, 1e-6, 1e-3))
    return poses


def number(rng: random.Random, usual: float, odd: float = 0.1) -> float:
    """The usual value, or one of another size."""
    return usual if rng.random() >= odd else rng.choice(SIZES) * rng.choice((1.0, -1.0))


def carmen(folder: Path, rng: random.Random) -> Words:
    """A log of both kinds of scans."""
    n, beams = rng.choice((1, 2, 3, 12, 25)), rng.choice((2, 3, 60, 180, 181, 361))
    t_s, poses = times(rng, n, rng.choice((0.1, 0.2, 1.0))), walk(rng, n)
    kind = rng.choice(("room", "room", "room", "far", "nothing", "near", "mixed", "same"))
    lines = []
    for k in range(n):
        angle = np.linspace(-1.5, 1.5, beams)
        room = np.minimum(
            3.0 / np.maximum(np.cos(angle), 1e-3), 2.0 / np.maximum(np.abs(np.sin(angle)), 1e-3)
        )
        ranges = {
            "far": np.full(beams, 1e6),
            "nothing": np.full(beams, rng.choice((81.83, math.inf, math.nan))),
            "near": np.full(beams, rng.choice((0.0, 1e-9, -1.0))),
            "same": np.full(beams, 5.0),
        }.get(kind, room + 0.01 * np.random.default_rng(k).normal(size=beams))
        if kind == "mixed":
            ranges = np.where(np.arange(beams) % 7 == 0, rng.choice(SIZES), ranges)
        if rng.random() < 0.02:
            ranges = ranges[: rng.choice((0, 1, 2, beams // 2))]
        said = " ".join(f"{r:.6g}" for r in ranges)
        pose = " ".join(f"{v:.6g}" for v in poses[k])
        tail = f"{t_s[k]:.6f} host {t_s[k]:.6f}"
        if rng.random() < 0.8:
            lines.append(f"FLASER {len(ranges)} {said} {pose} {pose} {tail}")
        else:
            first, step, reach = number(rng, -1.5), number(rng, 3.0 / beams), number(rng, 30.0)
            lines.append(
                f"ROBOTLASER1 0 {first:.6g} {number(rng, 3.0):.6g} {step:.6g} {reach:.6g} 0.01 0 "
                f"{len(ranges)} {said} 0 {pose} {pose} 0 0 0 0 0 {tail}"
            )
        if rng.random() < 0.5:
            lines.append(f"ODOM {pose} {number(rng, 0.5):.6g} 0 0 {tail}")
    (folder / "a.log").write_text("\n".join(lines) + "\n")
    return ("slam", "a.log", "--out", "out", "--quiet")


def laser_bag(folder: Path, rng: random.Random) -> Words:
    """A bag with scans, odometry and a mount; localized or mapped."""
    n, beams = rng.choice((1, 2, 12, 20)), rng.choice((0, 1, 2, 21, 90))
    t_s, poses = [max(t, 0.0) for t in times(rng, n)], walk(rng, 2 * n + 2)
    step = number(rng, 2.0 / max(beams - 1, 1))
    scans = tuple(
        Scan(
            min(t, 4e9),
            np.full(beams, number(rng, 4.0, 0.05)) + 0.01 * np.arange(beams),
            number(rng, -1.0),
            step,
            number(rng, 0.1),
            number(rng, 30.0),
        )
        for t in t_s
    )
    odometry = tuple(
        (min(max(t_s[0] + 0.05 * k, 0.0), 4e9), float(x), float(y), float(theta))
        for k, (x, y, theta) in enumerate(poses)
    )
    turn = rng.choice(
        ((0.0, 0.0, 0.0, 1.0),) * 6 + ((0.0, 0.0, 0.0, 0.0), (0.7, 0.0, 0.0, 0.7), (2.0, 0.0, 0.0, 2.0))
    )
    drive = Drive(
        scans,
        odometry if rng.random() < 0.9 else (),
        (number(rng, 0.2), 0.1, number(rng, 0.3)),
        turn,
        without_mount=rng.random() < 0.1,
    )
    if rng.random() < 0.5:
        write_ros1(folder / "a.bag", drive)
        name = "a.bag"
    else:
        write_ros2(folder / "bag", drive)
        name = "bag"
    if rng.random() < 0.5:
        return ("slam", name, "--out", "out", "--quiet")
    return ("localize", name, "--map", "museum", "--start", "1,1,0", "--out", "out")


def trajectories(folder: Path, rng: random.Random) -> Words:
    """Two TUM or KITTI files."""
    n = rng.choice((1, 2, 3, 10, 40))
    kitti = rng.random() < 0.3
    t_s = times(rng, n)
    for name in ("a.txt", "b.txt"):
        poses = walk(rng, n)
        rows = []
        for t, (x, y, theta) in zip(t_s, poses, strict=True):
            c, s = math.cos(theta), math.sin(theta)
            z, scale = number(rng, 0.0, 0.02), number(rng, 1.0, 0.02)
            rows.append(
                f"{c:.9g} {-s:.9g} 0 {x:.9g} {s:.9g} {c:.9g} 0 {y:.9g} 0 0 {scale:.9g} {z:.9g}"
                if kitti
                else f"{t:.9g} {x:.9g} {y:.9g} {z:.9g} 0 0 {scale * math.sin(theta / 2):.9g} "
                f"{scale * math.cos(theta / 2):.9g}"
            )
        (folder / name).write_text("\n".join(rows) + "\n")
    more = [word for word in ("--align", "--scale", "--json") if rng.random() < 0.5]
    return ("evaluate", "a.txt", "b.txt", *more)


def relations(folder: Path, rng: random.Random) -> Words:
    """A trajectory and what is true between some of its poses."""
    n = rng.choice((2, 3, 30))
    t_s, poses = times(rng, n, 0.5), walk(rng, n)
    rows = [f"{t:.6f} {x:.9g} {y:.9g} 0 0 0 0 1" for t, (x, y, _) in zip(t_s, poses, strict=True)]
    (folder / "a.tum").write_text("\n".join(rows) + "\n")
    pairs = []
    for _ in range(rng.choice((1, 2, 20))):
        i, j = rng.randrange(n), rng.randrange(n)
        six = " ".join(f"{number(rng, v):.9g}" for v in (0.5, 0.0, 0.0, 0.0, 0.0, 0.1))
        pairs.append(f"{t_s[i]:.6f} {t_s[j]:.6f} {six}")
    (folder / "a.relations").write_text("\n".join(pairs) + "\n")
    return ("evaluate", "a.tum", "a.relations", "--relations", "--json")


def calibrations(folder: Path, rng: random.Random) -> Words:
    """Logs of an odometry, of sensors at rest, of a gyroscope and a compass, of wheels against truth."""
    n = rng.choice((2, 10, 12, 60, 400))
    draws = np.random.default_rng(rng.getrandbits(32))
    noise = draws.normal(size=(n, 6)) * rng.choice((0.0, 1e-12, 1e-3, 1e-3, 1.0, 1e6))
    noise[:, rng.randrange(6)] *= rng.choice((0.0, 1.0, 1.0, 1e6))
    t_s = times(rng, n)
    kind = rng.choice(("odometry", "range", "heading", "mat"))
    if kind == "odometry":
        truth, told = walk(rng, n), walk(rng, n) if rng.random() < 0.3 else None
        told = truth + noise[:, :3] if told is None else told
        rows = [",".join(f"{v:.9g}" for v in (t, *a, *b)) for t, a, b in zip(t_s, told, truth, strict=True)]
        (folder / "a.csv").write_text(",".join(COLUMNS) + "\n" + "\n".join(rows) + "\n")
        more = ("--wheel-base", rng.choice(("0.4", "1e-9", "1e9"))) if rng.random() < 0.3 else ()
        return ("calibrate", "odometry", "a.csv", "--out", "out", *more)
    if kind == "range":
        names = ["t_s", "range_m", "bearing_rad", "x_m"][: rng.choice((2, 3, 4))]
        rows = [
            ",".join(f"{v:.9g}" for v in (t, *(noise[k, : len(names) - 1] + number(rng, 2.0, 0.01))))
            for k, t in enumerate(t_s)
        ]
        (folder / "a.csv").write_text(",".join(names) + "\n" + "\n".join(rows) + "\n")
        return ("calibrate", "range", "a.csv", "--out", "out")
    if kind == "heading":
        n = rng.choice((2, 10, 400, 900))
        angle = np.linspace(0.0, rng.choice((0.0, 1e-6, 12.0, 1e4)), n)
        field = np.column_stack([np.cos(angle), np.sin(angle), 0.3 + 0.0 * angle]) * rng.choice(
            (0.0, 1e-9, 0.4, 1e6)
        )
        field += draws.normal(size=(n, 3)) * rng.choice((0.0, 1e-3))
        turns = draws.normal(size=(n, 3)) * rng.choice((0.0, 1e-9, 0.1, 1e5)) + rng.choice((0.0, 1.0))
        for name, values in (("gyro.csv", turns), ("compass.csv", field)):
            rows = [
                ",".join(f"{v:.9g}" for v in (t, *row))
                for t, row in zip(times(rng, n, 0.02), values, strict=True)
            ]
            (folder / name).write_text("t,x,y,z\n" + "\n".join(rows) + "\n")
        logs = rng.choice(("gyro.csv", "compass.csv", "gyro.csv compass.csv"))
        return ("calibrate", "heading", *logs.split(), "--out", "out", "--axis", rng.choice("xyz"))
    t, poses = np.array(t_s), walk(rng, n)
    steps = np.column_stack([t[1:], np.hypot(*np.diff(poses[:, :2], axis=0).T), np.diff(poses[:, 2])])
    savemat(
        folder / "a.mat",
        {"GT": np.column_stack([t, poses]), "DR": steps * (1.0, number(rng, 1.0), number(rng, 1.0))},
    )
    return ("calibrate", "heading", "a.mat", "--out", "out")


def stops(folder: Path, rng: random.Random) -> Words:
    """A rover's stops."""
    n = rng.choice((100, 120))
    poses = walk(rng, n) * rng.choice((1.0, 100.0))
    rows = []
    for k, (x, y, theta) in enumerate(poses):
        rows.append(
            f"{k // rng.choice((1, 2, 200))},{4.6e6 + x:.6f},{y:.6f},{theta:.6g},{number(rng, 1.0, 0.03):.6g}"
        )
    rows.sort(key=lambda row: int(row.split(",")[0]))
    (folder / "a.csv").write_text("sol,easting_m,northing_m,yaw_rad,mobtrav_id\n" + "\n".join(rows) + "\n")
    return ("localize", "a.csv", "--format", "stops", "--out", "out")


def aer1513(folder: Path, rng: random.Random) -> Words:
    """A MATLAB recording with numbers of other sizes."""
    values = laser_drive(rows=rng.choice((2, 3, 60)))
    for name in rng.sample(sorted(values), rng.choice((0, 1, 1, 2))):
        if isinstance(values[name], np.ndarray | float | int) and np.size(values[name]):
            array = np.array(values[name], dtype=np.float64)
            how = rng.choice(("scale", "zero", "one", "nan", "all"))
            if how == "scale":
                array = array * rng.choice(SIZES)
            elif how == "zero":
                array = array * 0.0
            elif how == "all":
                array = array * 0.0 + rng.choice(SIZES)
            else:
                array.flat[rng.randrange(array.size)] = math.nan if how == "nan" else rng.choice(SIZES)
            values[name] = array
    savemat(folder / "a.mat", values)
    return ("localize", "a.mat", "--format", "aer1513", "--out", "out")


def walkers(folder: Path, rng: random.Random) -> Words:
    """Tracks of people on a floor of walls."""
    write_walls(folder)
    rows = []
    for person in range(rng.choice((1, 2, 40))):
        frame, x, y = rng.choice((0, 10, 10**6, -5)), rng.uniform(0.0, 10.0), rng.uniform(0.0, 8.0)
        for _ in range(rng.choice((2, 3, 12))):
            rows.append(
                f"{frame} {person * rng.choice((1, 1, -1))} "
                f"{number(rng, x, 0.03):.9g} {number(rng, y, 0.03):.9g}"
            )
            frame += rng.choice((1, 10, 10, 10**5))
            x, y = x + rng.gauss(0.0, 0.3), y + rng.gauss(0.0, 0.3)
    (folder / "a.txt").write_text("\n".join(rows) + "\n")
    if rng.random() < 0.5:
        sets = ("world.people=[{name: track, file: a.txt}]", "run.time_limit_s=2", "world.map=walls.yaml")
        start = (
            "world.start={x_m: 1, y_m: 1, theta_rad: 0}",
            "world.goal={x_m: 2, y_m: 6}",
            "world.obstacles=[]",
        )
        return ("run", "museum-1", "--out", "out", *(w for s in (*sets, *start) for w in ("--set", s)))
    one = ("--trials", "1", "--workers", "1", "--replays", "0", "--courses", "1", "--controller", "dwa")
    return ("bench", "controllers", "a.txt", *one, "--out", "out", "--set", "run.time_limit_s=1")


def patrol_graph(folder: Path, rng: random.Random) -> Words:
    """Vertices on a floor, joined in a tree and by some more edges, for a team."""
    write_walls(folder)
    n, cell = rng.choice((1, 2, 3, 8)), rng.choice((0.1, 0.1, 0.1, 1e-6, 1e3))
    places = [(round(rng.uniform(0.5, 3.0) / 0.1), round(rng.uniform(0.5, 6.0) / 0.1)) for _ in range(n)]
    joined: dict[int, set[int]] = {k: set() for k in range(n)}
    for k in range(1, n):
        other = rng.randrange(k)
        joined[k].add(other)
        joined[other].add(k)
    lines = [f"{n} {rng.choice((100, 1, 10**9))} 100 {cell:g} {number(rng, 0.0, 0.05):g} 0.0"]
    for k, (x, y) in enumerate(places):
        edges = " ".join(f"{o} {rng.choice('NESW')} {number(rng, 15.0, 0.1):g}" for o in sorted(joined[k]))
        lines.append(f"{k} {x * rng.choice((1, 1, 1, -1))} {y} {len(joined[k])} {edges}")
    (folder / "a.graph").write_text("\n".join(lines) + "\n")
    size, strategy = rng.choice((1, 2, 5)), rng.choice(("adaptive-rounds", "cyclic", "msp", "cbls", "random"))
    sets = (
        "world.map=walls.yaml",
        "task={name: patrol, graph: a.graph, duration_s: 1.0}",
        f"team.size={size}",
    )
    more = (f"team.strategy={strategy}", "run.time_limit_s=1", "world.obstacles=[]")
    return ("run", "museum-patrol", "--out", "out", *(w for s in (*sets, *more) for w in ("--set", s)))


def barn(folder: Path, rng: random.Random) -> Words:
    """A course, its path and what others published of it."""
    posts = [(x, 0.2 * k) for x in (-4.2, -0.3) for k in range(5, 50)]
    posts += [(number(rng, -2.25), number(rng, rng.uniform(2.0, 12.0))) for _ in range(rng.choice((0, 1, 5)))]
    world = rng.choice((0, 0, 7, 10**6))
    (folder / "cylinders.csv").write_text(
        "world,x_m,y_m\n" + "".join(f"{world},{x:.9g},{y:.9g}\n" for x, y in posts)
    )
    path = [
        (-2.25, 3.0),
        *((number(rng, -2.25, 0.02), number(rng, y, 0.02)) for y in rng.choice(((), (5.0, 8.0)))),
        (-2.25, 13.0),
    ]
    (folder / "paths.csv").write_text(
        "world,k,x_m,y_m\n" + "".join(f"{world},{k},{x:.9g},{y:.9g}\n" for k, (x, y) in enumerate(path))
    )
    length, best = number(rng, 10.0), number(rng, 5.0)
    (folder / "worlds.csv").write_text(
        f"world,cylinders,path_length_m,optimal_time_s\n{world},{len(posts)},{length:.9g},{best:.9g}\n"
    )
    if rng.random() < 0.4:
        row = f"{world},{rng.choice((0, 1, 2, -1))},{rng.choice((0, 1))},0,{number(rng, 9.0, 0.3):.9g}"
        (folder / "published_x.csv").write_text(f"world,succeeded,collided,timed_out,time_s\n{row}\n")
    return (
        "bench",
        "barn",
        ".",
        "--trials",
        "1",
        "--workers",
        "1",
        "--replays",
        "1",
        "--out",
        "out",
        "--set",
        STRAIGHT,
    )


def moving_ai(folder: Path, rng: random.Random) -> Words:
    """A map of all letters and its problems."""
    rows, columns = rng.choice(((1, 1), (1, 40), (40, 1), (12, 16), (3, 3)))
    letters = rng.choice((".", "@", ".@", "....@", ".GSW@OT"))
    cells = ["".join(rng.choice(letters) for _ in range(columns)) for _ in range(rows)]
    (folder / "a.map").write_text(
        f"type octile\nheight {rows}\nwidth {columns}\nmap\n" + "\n".join(cells) + "\n"
    )
    if rng.random() < 0.6:
        lines = []
        for _ in range(rng.choice((0, 1, 5))):
            wide, high = rng.choice(((columns, rows),) * 5 + ((512, 512), (1, 1), (2**31, 2**31)))
            place = [rng.choice((0, 0, size - 1, rng.randrange(size))) for size in (columns, rows) * 2]
            lines.append(
                f"{rng.choice((0, 0, 10**9))}\ta.map\t{wide}\t{high}\t"
                + "\t".join(map(str, place))
                + f"\t{number(rng, 4.0, 0.3):.9g}"
            )
        (folder / "a.scen").write_text("version 1\n" + "".join(f"{line}\n" for line in lines))
        return ("bench-scen", "a.map", "a.scen", "--json")
    return rng.choice(
        (
            ("draw", "a.map", "--out", "a.png"),
            ("draw", "a.map", "--out", "a.png", "--resolution", rng.choice(("1e-9", "1e9", "0.05"))),
            (
                "vectorize",
                "a.map",
                "--out",
                "b.yaml",
                "--tolerance",
                rng.choice(("0", "0.5", "1e9", "1e-12")),
            ),
            ("plan", "a.map", "--start", "0.5,0.5", "--goal", f"{columns - 0.5},{rows - 0.5}", "--json"),
        )
    )


DRAWS: dict[str, Draw] = {
    draw.__name__: draw
    for draw in (
        carmen,
        laser_bag,
        trajectories,
        relations,
        calibrations,
        stops,
        aer1513,
        walkers,
        patrol_graph,
        barn,
        moving_ai,
        exported,
    )
}
