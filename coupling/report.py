"""report.json: what was run, how long it took and how far it is from the reference."""
import json
import platform
import resource
from time import perf_counter

import numpy as np

from . import STARTED


class Timing:
    """Seconds per window and phase. Call it at the end of each window."""

    def __init__(self, solid):
        self._solid, self._last = solid, perf_counter()
        self.startup = self._last - STARTED
        self._before = dict(solid.phases)
        self.windows, self.phases = [], []

    def __call__(self, window):
        now = perf_counter()
        phases = {name: total - self._before[name] for name, total in self._solid.phases.items()}
        phases |= {"DEM": window.seconds["DEM"], "mapping": window.seconds["mapping"]}
        phases["output"] = now - self._last - sum(window.seconds.values())
        phases["rest"] = window.seconds["MPM"] - sum(phases[name] for name in self._before)
        self.phases.append(phases)
        self.windows.append(now - self._last)
        self._before, self._last = dict(self._solid.phases), now

    def figures(self):
        """The entries of report.json that are times."""
        if not self.windows:
            return {"window_ms": None, "phases_ms": {}}
        ms = 1e3 * np.array(self.windows)
        return {"window_ms": {"median": round(float(np.median(ms)), 4), "p90": round(float(np.quantile(ms, 0.9)), 4)},
                "phases_ms": {name: round(1e3 * float(np.median([p[name] for p in self.phases])), 4)
                              for name in self.phases[0]}}


def versions():
    """Versions of what the run stands on."""
    import dolfinx
    import numba
    from mpi4py import MPI
    from petsc4py import PETSc

    return {"python": platform.python_version(), "numpy": np.__version__, "numba": numba.__version__,
            "dolfinx": dolfinx.__version__, "petsc": ".".join(map(str, PETSc.Sys.getVersion())),
            "mpi": MPI.Get_library_version().split(",")[0].strip("\x00 \n")}


def peak_mb():
    """Largest memory of this process so far [MB]."""
    return round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024, 1)


def write(path, entries):
    """Write report.json; numbers of numpy become plain ones."""
    with open(path, "w", encoding="utf-8") as file:
        json.dump(entries, file, indent=1, default=lambda value: value.tolist() if hasattr(value, "tolist") else str(value))
        file.write("\n")


def relative_l2(values, reference):
    """Relative L2 difference of two curves on the same, evenly spaced times."""
    return float(np.linalg.norm(np.asarray(values) - reference) / np.linalg.norm(reference))
