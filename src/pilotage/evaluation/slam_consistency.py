"""Whether a mapped recording knows how far it is from the benchmark's relations."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.files.arrays import read_npz
from pilotage.evaluation.relations import RelationErrors, relation_nees
from pilotage.models.pose_graph import PoseGraph
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
    file = read_npz(path, "covariances of 'pilotage slam'")
    try:
        graph = PoseGraph(
            file["graph_poses"],
            file["graph_i"],
            file["graph_j"],
            file["graph_measurements"],
            file["graph_information"],
        )
        return ScanCovariances(graph, file["graph_weights"], file["owner"], file["poses"])
    except (ValueError, KeyError) as error:
        raise InputError(f"{path}: expected covariances of 'pilotage slam', found {error}") from None
