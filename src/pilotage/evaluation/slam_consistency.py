"""Whether a mapped recording knows how far it is from the benchmark's relations."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pilotage.core.errors import InputError
from pilotage.evaluation.relations import RelationErrors, relation_nees
from pilotage.models.pose_graph import PoseGraph
from pilotage.records.arrays import read_arrays
from pilotage.stack.mapping.slam.scan_covariances import ScanCovariances

COVARIANCES_FILE = "covariances.npz"


def nees_summary(errors: RelationErrors, trajectory: Path) -> dict[str, float]:
    """Mean and median NEES of relations (3 is ideal) where covariances lie beside the trajectory.

    Raises
    ------
    InputError
        Where the covariances are those of another trajectory, or damaged.
    """
    path = trajectory.parent / COVARIANCES_FILE
    if trajectory.name != "trajectory.tum" or not path.is_file():
        return {}
    known = read_scan_covariances(path)
    if errors.first.size and max(errors.first.max(), errors.second.max()) >= known.owner.size:
        raise InputError(f"{path}: expected the covariances of '{trajectory}', found those of fewer poses")
    nees = relation_nees(errors, known.relative(errors.first, errors.second))
    return {"nees_mean": float(nees.mean()), "nees_median": float(np.median(nees))}


def read_scan_covariances(path: Path) -> ScanCovariances:
    """Read what ``pilotage slam`` wrote of how sure its poses are.

    Raises
    ------
    InputError
        Where the file is damaged or lacks something.
    """
    file = read_arrays(path)
    if file is None:
        raise InputError(f"{path}: expected covariances of 'pilotage slam', found none there")
    try:
        graph = PoseGraph(
            file.floats("graph_poses", -1, 3),
            file.ints("graph_i", -1),
            file.ints("graph_j", -1),
            file.floats("graph_measurements", -1, 3),
            file.floats("graph_information", -1, 3, 3),
        )
        owner = file.ints("owner", -1)
        if owner.size and not (owner.min() >= 0 and owner.max() < len(graph)):
            raise ValueError(f"owner: expected keyframes 0 to {len(graph) - 1}")
        weights, poses = file.floats("graph_weights", graph.i.size), file.floats("poses", owner.size, 3)
        own = file.floats("own", owner.size, 3, 3)
        mount_m, residual_m = (float(file.floats(name, 1)[0]) for name in ("mount_m", "residual_m"))
        return ScanCovariances(graph, weights, owner, poses, own, mount_m, residual_m)
    except (ValueError, InputError) as error:
        raise InputError(f"{path}: expected covariances of 'pilotage slam', found {error}") from None
