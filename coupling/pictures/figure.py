"""Figures over time, and of error against run time, by matplotlib, which is loaded only when one is asked
for."""
from pathlib import Path
from typing import Any, Dict, List, Mapping, Sequence

import numpy as np

STYLES: Dict[str, dict] = {"run": dict(linewidth=2), "under": dict(linewidth=6, alpha=0.35),
          "thin": dict(linewidth=0.7, alpha=0.45),
          "reference": dict(color="black", linewidth=1, linestyle=(0, (4, 3)), zorder=3)}
MATRIX = {"right": ("tab:green", "o"), "inaccurate": ("tab:orange", "D"), "stopped": ("tab:blue", "s"),
          "wrong": ("tab:red", "X")}


def draw(path: Path, xlabel: str, panels: Mapping[str, Sequence[tuple]]) -> None:
    """Save a picture with one panel above the other.

    panels: label of the vertical axis → curves (x, y, label, style), arrays of shape (n,). Styles: "run";
    "under", a broad pale line that stays visible below another run, in the same colours; "thin", a pale one
    for what is rugged, in the same colours, too; "reference", thin and black. A label "" is not shown.
    """
    plt = pyplot()
    figure, axes = plt.subplots(len(panels), 1, sharex=True, figsize=(7, 3 * len(panels)), squeeze=False)
    for axis, (ylabel, curves) in zip(axes[:, 0], panels.items()):
        drawn = dict.fromkeys(STYLES, 0)
        for x, y, label, style in curves:
            axis.plot(x, y, label=label or None, **{"color": f"C{drawn[style]}", **STYLES[style]})
            drawn[style] += 1
        axis.set_ylabel(ylabel)
        axis.grid(alpha=0.3)
        axis.legend(frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncol=3, fontsize="small")
    axes[-1, 0].set_xlabel(xlabel)
    figure.tight_layout()
    figure.savefig(path, dpi=120)
    plt.close(figure)


def draw_work(path: Path, xlabel: str, panels: Mapping[str, Sequence[tuple]]) -> None:
    """Save a picture of error against run time, both axes logarithmic, one panel beside the other.

    panels: label of the vertical axis → series (label, times [s], errors, notes); times and errors of shape
    (n,), notes: texts at the points, "" for none. A line joins the points of a series that none beats in
    both.
    """
    plt = pyplot()
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    figure, axes = plt.subplots(1, len(panels), figsize=(6 * len(panels), 5), squeeze=False)
    for axis, (ylabel, series) in zip(axes[0], panels.items()):
        for number, (label, times, errors, notes) in enumerate(series):
            style, best = {"color": f"C{number}", "marker": "osD^v"[number % 5]}, front(times, errors)
            axis.loglog(times, errors, linestyle="", alpha=0.35, markersize=5, **style)
            axis.loglog([times[i] for i in best], [errors[i] for i in best], label=label, markersize=5,
                        **style)
            for i in best:
                axis.annotate(notes[i], (times[i], errors[i]), textcoords="offset points", xytext=(0, 5),
                              fontsize=6, horizontalalignment="center", clip_on=True)
        axis.set_xlabel(xlabel)
        axis.set_ylabel(ylabel)
        axis.margins(0.15)
        for ticks in (axis.xaxis, axis.yaxis):
            ticks.set_major_locator(LogLocator(subs=(1, 2, 5)))
            ticks.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
            ticks.set_minor_formatter(NullFormatter())
        axis.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{100 * value:g} %"))
        axis.grid(alpha=0.3, which="both")
        axis.legend(frameon=False, fontsize="small")
    figure.tight_layout()
    figure.savefig(path, dpi=120)
    plt.close(figure)


def draw_matrix(path: Path, rows: Sequence[tuple]) -> None:
    """Save a picture of the error of many runs over the bound of each. rows: (group, name, class, error over
    bound), the class one of MATRIX; without an error (NaN) a run stands at the right."""
    plt = pyplot()
    figure, axis = plt.subplots(figsize=(9, 1.2 + 0.17 * len(rows)))
    known = [ratio for *_, ratio in rows if ratio > 0]
    least, most = min([0.1, *known]) / 2, max([10.0, *known]) * 4
    for number, (_, _, found, ratio) in enumerate(rows):
        colour, marker = MATRIX[found]
        axis.plot(ratio if ratio > 0 else least if ratio == 0 else most / 2, number, marker, color=colour,
                  markersize=5)
    starts = [i for i in range(len(rows)) if not i or rows[i][0] != rows[i - 1][0]]
    for i, end in zip(starts, [*starts[1:], len(rows)]):
        axis.axhspan(i - 0.5, end - 0.5, color="black", alpha=0.04 * (starts.index(i) % 2), linewidth=0)
        axis.text(most, (i + end - 1) / 2, f" {rows[i][0]}", fontsize=7, verticalalignment="center")
    for found, (colour, marker) in MATRIX.items():
        if count := sum(row[2] == found for row in rows):
            axis.plot([], [], marker, color=colour, label=f"{found}: {count}")
    axis.axvline(1.0, color="black", linewidth=1)
    axis.set(xscale="log", xlim=(least, most), ylim=(len(rows) - 0.5, -0.5),
             xlabel="error over its bound; without a number: stopped, at the right")
    axis.set_yticks(range(len(rows)), [name for _, name, *_ in rows], fontsize=6)
    axis.grid(alpha=0.3, axis="x")
    axis.legend(frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncol=4, fontsize="small")
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    plt.close(figure)


def mean_over(time: np.ndarray, window: np.ndarray, force: np.ndarray, span: float,
              centred: bool = False) -> np.ndarray:
    """Mean over the last ``span`` [s], or ``centred`` over half of it before and half after, of a force that
    is constant in each window and zero before the first and after the last.

    time: ends of the windows [s], window: their lengths [s], force: any unit, shape (n,) all; so is what
    comes back.

    >>> mean_over(np.array([1.0, 2.0, 3.0]), np.ones(3), np.array([4.0, 6.0, 0.0]), 2.0).tolist()
    [2.0, 5.0, 3.0]
    """
    ends, impulse = np.append(time[0] - window[0], time), np.append(0.0, np.cumsum(force * window))
    until = time + 0.5 * span if centred else time
    return (np.interp(until, ends, impulse) - np.interp(until - span, ends, impulse)) / span


def front(times: Sequence[float], errors: Sequence[float]) -> List[int]:
    """Pareto front: numbers of the points that no other one beats in run time and error, by rising time."""
    best: List[int] = []
    for i in sorted(range(len(times)), key=lambda i: (times[i], errors[i])):
        if not best or errors[i] < errors[best[-1]]:
            best.append(i)
    return best


def pyplot() -> Any:
    """matplotlib.pyplot, drawing without a display."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    return plt


def ramp(name: str, most: float, below: float = 0.0) -> Any:
    """Colours of the map ``name`` from -``below`` to ``most``, which a colour bar can show:
    ``to_rgba(values)``."""
    pyplot()
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    return ScalarMappable(Normalize(-below, most), name)
