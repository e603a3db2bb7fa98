"""Which scene a state belongs to, and what may be asked after the end."""
import zlib
from functools import wraps

import numpy as np

from ..collective import checksum
from ..errors import MPMError
from ..grid.background import whole_mesh
from ..laws.energy import formulas
from ..scene.column_grid import Columns

WHAT = ("number of ranks", "rank", "dimension", "number of material points", "grid", "material points",
        "laws", "supports", "interface, loads and walls", "kind of inertia", "basis", "outflow", "origin",
        "transfer")
OF_RANKS = 2  # the first so many are about the ranks, and no part of a checkpoint's
SHOWN = 4  # of the first so many the values say more than that they differ


def fingerprint(model, conditions):
    """Numbers of ``WHAT``, float: checksums where there are many values. Functions are not among them, nor is
    gravity. To be taken while the ranks have their parts of the material points in order. conditions: sets of
    particles with their names. Collective."""
    scene, points = model.scene, [body.points for body in model.bodies]
    laws = [(b.law.name, tuple(map(float, b.law.params)), b.rho, b.thickness, b.stress_state, b.f_bar,
             *formulas(b.law)) for b in scene.bodies]
    outflow = sorted(scene.outflow.items()) if isinstance(scene.outflow, dict) else scene.outflow
    if scene.openings:
        outflow = outflow, [(one.name, one.at.tolist(), str(one.normal)) for one in scene.openings]
    texts = (laws, [(s.fix, s.name) for s in scene.supports], conditions, scene.inertia, scene.numerics.basis,
             outflow)
    of_points = checksum(model.comm, (array for p in points for array in (p.x, p.V0)))
    return np.array([model.comm.size, model.comm.rank, model.dim, sum(body.total for body in model.bodies),
                     _of_grid(scene.grid) + max(scene.fields), of_points, *map(_of_text, texts),
                     _of_arrays(model.origin), _of_text(scene.numerics.transfer)], float)


def _of_grid(grid):
    """Checksum of its vertices and cells, of a large one of what they are made from."""
    if isinstance(grid, Columns) and grid.large:
        return _of_arrays(*grid.lines, grid.z, grid.down, grid.up, np.array(grid.h))
    if getattr(grid, "large", False):
        return _of_text((grid.box, grid.cells, grid.cell))
    return _of_arrays(*whole_mesh(grid))


def _of_arrays(*arrays):
    """Checksum of arrays."""
    return zlib.crc32(b"".join(np.ascontiguousarray(array).tobytes() for array in arrays))


def _of_text(values):
    """Checksum of what values print as."""
    return zlib.crc32(repr(values).encode())


def check_state(state, own):
    """Raise ValueError unless ``state`` belongs to the scene with the fingerprint ``own``."""
    if "scene" not in state:
        raise ValueError("this is no state of an MPM: give what get_state() has returned")
    _compare(state["scene"], own, 0, "state")


def check_checkpoint(tree, own):
    """The same for a checkpoint, whose number of ranks may be another one."""
    if "scene" not in tree or "step" not in tree:
        raise ValueError("this is no checkpoint of an MPM: give what get_checkpoint() has returned")
    _compare(tree["scene"], own[OF_RANKS:], OF_RANKS, "checkpoint")


def _compare(scene, own, first, kind):
    for k, (what, theirs, ours) in enumerate(zip(WHAT[first:], np.asarray(scene), own), first):
        if theirs != ours:
            differs = f"{what} differ from those here"
            if k < SHOWN:
                differs = f"{what} is {theirs:g}, here it is {ours:g}"
            raise ValueError(f"the {kind} belongs to another scene: its {differs}; give a {kind} of this "
                             "scene")


def while_open(method):
    """A method that needs the solver: a sentence after ``close()``."""
    @wraps(method)
    def checked(self, *args, **kwargs):
        if self.closed:
            raise MPMError(f"{method.__name__}() was called after close(): the solver is gone, make a new "
                           "MPM or close this one later")
        return method(self, *args, **kwargs)
    return checked
