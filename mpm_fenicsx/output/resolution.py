"""How fine a scene is: what a user looks at before he trusts a run, or waits for it."""
import numpy as np
from mpi4py import MPI


def resolution(mpm):
    """``cell_size``: mean size of the background cells along each axis [m]; ``points_per_cell``: least, mean
    and most of the cells that have any; ``explicit_limit``: the smallest size over the fastest elastic wave
    [s], beyond which an explicit method would be unstable; None for a law without Lamé parameters.
    Collective."""
    cells = np.concatenate([body.points.cell for body in mpm._bodies])
    counts = np.unique(cells, return_counts=True)[1]
    least, most = counts.min(initial=np.iinfo(np.int64).max), counts.max(initial=0)
    comm, size = mpm.comm, mpm.background.h
    filled = comm.allreduce(len(counts))
    per_cell = [comm.allreduce(int(least), MPI.MIN), mpm.count / filled, comm.allreduce(int(most), MPI.MAX)]
    speeds = [wave_speed(body.body) for body in mpm._bodies]
    limit = None if None in speeds else float(size.min() / max(speeds))
    return {"cell_size": size.tolist(), "points_per_cell": per_cell, "explicit_limit": limit}


def wave_speed(body):
    """Of compression waves in a body that has not yielded [m/s]."""
    p = body.law.params
    return np.sqrt((p.lam + 2.0 * p.mu) / body.rho) if hasattr(p, "lam") and hasattr(p, "mu") else None
