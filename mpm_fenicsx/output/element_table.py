"""The table of a single point on its path, see ``laws.driver``, as a file and as a figure."""
from pathlib import Path
from typing import Dict, List, Sequence

import numpy as np

from ..laws.driver import UNITS
from ..laws.paths import COMPONENTS

Table = Dict[str, np.ndarray]


def write_table(path: Path, table: Table, notes: Sequence[str] = ()) -> None:
    """A CSV file: ``notes`` and the units as comments, a line of names, a row for each step."""
    units = ", ".join(f"{name} [{UNITS.get(name, '-')}]" for name in table)
    lines = [*(f"# {' '.join(note.split())}" for note in (*notes, units)), ",".join(table)]
    rows = zip(*(values.tolist() for values in table.values()))
    path.write_text("\n".join([*lines, *(",".join(map(repr, row)) for row in rows)]) + "\n", encoding="utf-8")


def driven(table: Table) -> str:
    """Name of the strain that changes most in the last stage."""
    last = table["stage"] == table["stage"][-1]
    return max(_of("e", table), key=lambda name: float(np.ptp(table[name][last])))


def _of(kind: str, table: Table) -> List[str]:
    """Columns of the strains, "e", or of the stresses, "s"; in the plane there are four."""
    return [name for name in (f"{kind}_{each}" for each in COMPONENTS) if name in table]


def draw_table(path: Path, table: Table, title: str) -> None:
    """A picture: the stresses and the change of volume over the strain that is driven, and q over p."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure, name = Figure(figsize=(11, 3.6)), driven(table)
    FigureCanvasAgg(figure)
    left, middle, right = figure.subplots(1, 3)
    for label in ("q", "p"):
        left.plot(table[name], table[label], label=label)
    shown = _of("s", table)
    largest = max(float(abs(table[each]).max()) for each in shown)
    for each in shown:
        if abs(table[each]).max() > 1e-6 * largest:
            left.plot(table[name], table[each], label=each, linewidth=0.8, linestyle="--")
    left.legend(frameon=False, fontsize="small")
    middle.plot(table[name], table["volume"])
    right.plot(table["p"], table["q"])
    for axis, across, up in ((left, f"{name} [-]", "stress [Pa]"), (middle, f"{name} [-]", "ln J [-]"),
                             (right, "p [Pa]", "q [Pa]")):
        axis.set_xlabel(across)
        axis.set_ylabel(up)
        axis.grid(alpha=0.3)
    figure.suptitle(title, fontsize="medium")
    figure.tight_layout()
    figure.savefig(path, dpi=120)
