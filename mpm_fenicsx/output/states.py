"""Which scene a state belongs to, and what may be asked after the end."""
import zlib
from functools import wraps

import numpy as np

from ..errors import MPMError
from ..grid.background import whole_mesh

WHAT = ("number of ranks", "rank", "dimension", "number of material points", "grid", "material points", "laws", "supports",
        "interface, loads and walls", "kind of inertia", "outflow", "origin")
SHOWN = 4  # of the first so many the values say more than that they differ


def fingerprint(mpm, supports, conditions, inertia):
    """Numbers of ``WHAT``, float: checksums where there are many values. Functions are not among them, nor is
    gravity. To be taken while every rank still has all material points. supports: ``Support`` records;
    conditions: sets of particles with their names."""
    points, bodies = [part.points for part in mpm.parts], [part.body for part in mpm.parts]
    laws = [(b.law.name, tuple(map(float, b.law.params)), b.rho, b.thickness, b.stress_state, b.f_bar) for b in bodies]
    return np.array([
        mpm.comm.size, mpm.comm.rank, mpm.dim, sum(map(len, points)), _sum(*whole_mesh(mpm.grid)),
        _sum(*(array for p in points for array in (p.x, p.V0))), _said(laws), _said([(s.fix, s.name) for s in supports]),
        _said(conditions), _said(inertia), _said(sorted(mpm.outflow.items()) if isinstance(mpm.outflow, dict)
                                                 else mpm.outflow), _sum(mpm.origin)], float)


def _sum(*arrays):
    return zlib.crc32(b"".join(np.ascontiguousarray(array).tobytes() for array in arrays))


def _said(values):
    return zlib.crc32(repr(values).encode())


def check_state(state, own):
    """Raise ValueError unless ``state`` belongs to the scene with the fingerprint ``own``."""
    if "scene" not in state:
        raise ValueError("this is no state of an MPM: give what get_state() has returned")
    for k, (what, theirs, ours) in enumerate(zip(WHAT, np.asarray(state["scene"]), own)):
        if theirs != ours:
            differs = f"{what} is {theirs:g}, here it is {ours:g}" if k < SHOWN else f"{what} differ from those here"
            raise ValueError(f"the state belongs to another scene: its {differs}; give a state of this scene")


def while_open(method):
    """A method that needs the solver: a sentence after ``close()``."""
    @wraps(method)
    def checked(self, *args, **kwargs):
        if self.closed:
            raise MPMError(f"{method.__name__}() was called after close(): the solver is gone, make a new MPM or close this "
                           "one later")
        return method(self, *args, **kwargs)
    return checked
