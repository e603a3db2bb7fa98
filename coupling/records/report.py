"""report.json: what was run, how long it took and how far it is from the reference."""
import json
import platform
import resource
import sys
from pathlib import Path
from time import perf_counter, process_time
from typing import Any, Dict, Iterable, List, Optional, Sequence, Tuple, Union

import numpy as np

from ..loop.window import Window
from ..protocols import RecordedSolid
from ..started import IMPORTED
from .rows import Rows
from .writing import replace_text

MODULES = ("numpy", "scipy", "numba", "mpi4py", "petsc4py", "dolfinx")


class Timing:
    """Seconds per window and phase. Make it before the first window, call it at the end of each. folder: of
    the rows on disk, see ``rows``; began: moment at which the run began."""

    def __init__(self, solid: RecordedSolid, folder: Optional[Path] = None, began: float = IMPORTED) -> None:
        self._solid, self._last, self._folder, self.began = solid, perf_counter(), folder, began
        self._before = dict(solid.phases)
        self.startup, self._cpu, self.cpu = self._last - self.began, process_time(), 0.0
        self.spent = 0.0
        self.earlier: Dict[str, float] = {}  # seconds of the run before it was restarted
        self.names: Tuple[str, ...] = ()  # of the phases
        self.rows: Optional[Rows] = None  # of window and phases

    def __call__(self, window: Window) -> None:
        """A window has ended."""
        phases = {name: total - self._before[name] for name, total in self._solid.phases.items()}
        phases |= {name: seconds for name, seconds in window.seconds.items() if name != "MPM"}
        phases["rest"] = window.seconds["MPM"] - sum(phases[name] for name in self._before)
        now, self.cpu = perf_counter(), process_time() - self._cpu
        phases["output"] = now - self._last - sum(window.seconds.values())
        if self.rows is None:
            self.names, self.rows = tuple(phases), Rows(1 + len(phases), self._folder)
        self.rows.add([now - self._last, *(phases[name] for name in self.names)])
        self.spent += now - self._last
        self._before, self._last = dict(self._solid.phases), now

    def total(self) -> float:
        """Seconds of this run so far."""
        return perf_counter() - self.began

    def sums(self) -> Dict[str, float]:
        """Seconds of the whole run, with those before it was restarted."""
        now = {"wall_s": self.total(), "startup_s": self.startup, "window_s": self.spent,
               "window_cpu_s": self.cpu}
        return {name: seconds + self.earlier.get(name, 0.0) for name, seconds in now.items()}

    def figures(self) -> Dict[str, Any]:
        """The entries of report.json that are times; of windows those since the last start."""
        times: Dict[str, Any] = {name: round(seconds, 4 if name.startswith("window") else 3)
                                 for name, seconds in self.sums().items()}
        times.update(window_ms=None, phases_ms={})
        if self.rows:
            ms = 1e3 * self.rows.column(0)
            times["window_ms"] = {"median": round(float(np.median(ms)), 4),
                                  "p90": round(float(np.quantile(ms, 0.9)), 4)}
            times["phases_ms"] = {name: round(1e3 * float(np.median(self.rows.column(k))), 4)
                                  for k, name in enumerate(self.names, 1)}
        return times


def resolution(cell_size: Sequence[float], points_per_cell: Sequence[float],
               explicit_limit: Optional[float]) -> str:
    """One line of how fine a scene is, see ``protocols.RecordedSolid``."""
    least, mean, most = points_per_cell
    limit = "" if explicit_limit is None else f", explicit limit of the time step {explicit_limit:.3g} s"
    return (f"cells of {' x '.join(f'{size:.4g}' for size in cell_size)} m, {mean:.3g} points per filled "
            f"cell ({least} to {most}){limit}")


def summary(entries: dict, energy: Optional[float]) -> List[str]:
    """Lines for the terminal of the ``entries`` of a report; energy: what its balance does not explain at the
    end, None for a solid alone."""
    pace, coupled = "steps", ""
    if energy is not None:
        pace = f"windows of {entries['substeps']} DEM steps"
        coupled = f", {entries['coupling_mean']:.2f} of the coupling, energy {energy:+.2e}"
    phases = ", ".join(f"{name} {ms:.2f}" for name, ms in entries["phases_ms"].items() if ms >= 0.005)
    errors = ", ".join(f"{name} {value:.3g}" for name, value in entries["errors"].items())
    median = f"{entries['window_ms']['median']:.2f} ms (median): {phases}" if phases else "none since then"
    return [f"{entries['case']}: {entries['points']} points, {entries['windows']} {pace}, "
            f"{entries['ranks']} rank(s): {entries['window_s']:.2f} s "
            f"(and {entries['startup_s']:.2f} s to start)",
            f"window {median}",
            f"errors: {errors or 'nothing to compare with'}",
            f"per window {entries['newton_mean']:.2f} Newton iterations{coupled}, memory "
            f"{max(entries['peak_mb']):.0f} MB"]


def versions() -> Dict[str, str]:
    """Versions of what the run stands on, of the modules that are loaded."""
    loaded = {name: sys.modules[name].__version__ for name in MODULES if name in sys.modules}
    return {"python": platform.python_version(), **loaded}


def peak_mb() -> float:
    """Largest memory of this process so far [MB]."""
    return round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024, 1)


def text(entries: dict) -> str:
    """Of report.json; numbers of numpy become plain ones."""
    return json.dumps(entries, indent=1, default=lambda value: getattr(value, "tolist",
                                                                       value.__str__)()) + "\n"


def write(path: Union[str, Path], entries: dict) -> None:
    """Write report.json, whole or not at all."""
    replace_text(Path(path), text(entries))


def table_row(cells: Iterable) -> str:
    """One line of a table in Markdown."""
    return "| " + " | ".join(str(cell).replace("|", "/") for cell in cells) + " |"


def relative_l2(values: np.ndarray, reference: np.ndarray, windows: Union[float, np.ndarray] = 1.0) -> float:
    """Relative L2 difference of two curves on the same times, ``windows`` [s] apart (one number, or one for
    each time); the difference itself where the reference is zero throughout."""
    weight = np.sqrt(windows / np.max(windows))
    return float(np.linalg.norm(weight * (np.asarray(values) - reference))
                 / (np.linalg.norm(weight * reference) or 1.0))
