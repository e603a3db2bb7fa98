"""Which scene a state belongs to, and files of states."""
import platform
import zlib
from typing import Any, Dict, Sequence

import numpy as np
from mpi4py import MPI

import mpm_dem_store as store

from ..scene.domain import read_ways
from ..scene.scene import SceneData
from ..scene.tables import cluster_table, sphere_table

WHAT = ("dimension", "time step", "number of spheres", "number of clusters", "radii", "masses", "materials",
        "clusters", "fixed walls", "springs of friction", "domain and outflow")
SHOWN = 4  # of the first so many the values say more than that they differ


def fingerprint(scene: SceneData, dt: float) -> np.ndarray:
    """Numbers of ``WHAT``, float: checksums where there are many values. The moving wall is not among them,
    since it may be replaced, nor is what a state itself holds."""
    spheres, clusters = sphere_table(scene), cluster_table(scene)
    fixed = [array for wall in scene.fixed for array in (wall.nodes, wall.elements)]
    springs = [max((scene.interaction(*pair).springs for pair in pairs), default=0)
               for pairs in (scene.pairs(), scene.wall_pairs())]
    domain = np.zeros(0) if scene.domain is None else scene.domain
    ways = np.array(read_ways(scene.outflow, scene.dim)), domain
    return np.array([scene.dim, dt, len(spheres.x), len(clusters.mass), _checksum(spheres.radius),
                     _checksum(spheres.mass, clusters.mass), _checksum(spheres.material),
                     _checksum(spheres.cluster, spheres.arm, clusters.inertia, clusters.turn, clusters.free),
                     _checksum(*fixed), _checksum(np.array(springs, np.int8)), _checksum(*ways)], float)


def _checksum(*arrays: Any) -> int:
    return zlib.crc32(b"".join(np.ascontiguousarray(array).tobytes() for array in arrays))


def check_state(state: Dict[str, Any], names: Sequence[str], own: np.ndarray) -> None:
    """Raise ValueError unless ``state`` has the ``names`` and is one of the scene with the fingerprint
    ``own``."""
    missing = [name for name in ("scene", *names) if name not in state]
    if missing:
        raise ValueError(f"the state has no {missing[0]!r}: give one that this back end has made")
    for k, (what, theirs, ours) in enumerate(zip(WHAT, np.asarray(state["scene"]), own)):
        if theirs != ours:
            differs = f"is {theirs:g}, here it is {ours:g}" if k < SHOWN else "differ from those here"
            raise ValueError(f"the state belongs to another scene: its {what} {differs}; give a state of "
                             "this scene")


PROJECT = "mpm-dem"
RUN = "run"  # kind of the files of a coupled run, which have the state of its DEM as "grains"


class Kept:
    """Files of the states of a back end, which has ``comm``, ``time``, ``get_state`` and ``set_state``;
    kind: of these files."""

    kind, comm = "", None

    def save(self, path: Any) -> None:
        """See `protocol.DEM.save`."""
        from importlib.metadata import distributions  # takes time to import

        own = next((one.version for one in distributions(name=PROJECT)), "not installed")
        head = {"kind": self.kind, "time": self.time, "versions": {
            PROJECT: own, "python": platform.python_version(), "numpy": np.__version__}}
        store.write(path, self.get_state(), head, self._ranks())

    def load(self, path: Any) -> None:
        """See `protocol.DEM.load`."""
        kind = store.read_head(path, self._ranks())["kind"]
        if kind not in (self.kind, RUN):
            raise ValueError(f"{path} is a checkpoint of kind {kind!r}: give one of {self.kind!r}, or of a "
                             "run")
        tree = store.read(path, self._ranks())
        self.set_state(tree["grains"] if kind == RUN else tree)

    def _ranks(self) -> Any:
        return self.comm or MPI.COMM_WORLD
