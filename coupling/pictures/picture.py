"""Picture of a scene in the plane or in space, made without a display: in the plane by matplotlib, in
space on a canvas."""
from pathlib import Path
from typing import Any, Tuple

import numpy as np

from .canvases import new_canvas
from .figure import pyplot, ramp
from .flat import draw_things
from .perspective import GREY, edges_of, radius_of_points
from .sights import Sight
from .space import draw_on, view_of

COLOURED = 0.99  # part of the points in space with colours of their own, as few have by far the most
Pair = Tuple[np.ndarray, np.ndarray]  # places and what is there: cells, elements or radii


def draw(path: Path, solid: np.ndarray, grid: Pair, wall: Pair, things: Sight, values: np.ndarray,
         texts: Tuple[str, str], look: tuple = (np.zeros(3), None)) -> None:
    """Save a picture; y points upward, in space what gravity says.

    solid: positions of material points [m], shape (n, dim), in the colours of ``values``, shape (n,); grid:
    vertices [m], shape (m, dim), and cells with their corners around them, shape (k, corners); wall: nodes
    [m], shape (w, dim), and elements; things: see ``sights.sight``; texts: title, and what the values are;
    look: gravity [m/s^2], shape (3,), and angles of the eye, see ``space.view_of``.
    """
    plt = pyplot()
    figure, axes = plt.subplots(figsize=(10, 4), layout="constrained" if solid.shape[1] == 3 else None)
    extend = "neither"
    if solid.shape[1] == 3:
        extend, points = "both", _space(axes, solid, grid, wall, things, (values, look))
    else:
        points = _plane(axes, 100 * solid, (100 * grid[0], grid[1]), (100 * wall[0], wall[1]), things, values)
    axes.set_title(texts[0], loc="right", fontsize="medium")
    figure.colorbar(points, ax=axes, label=texts[1], shrink=0.7, pad=0.02, extend=extend)
    figure.savefig(path, dpi=150, bbox_inches="tight")
    plt.close(figure)


def _plane(axes: Any, solid: np.ndarray, grid: Pair, wall: Pair, things: Sight, values: np.ndarray) -> Any:
    from matplotlib.collections import LineCollection, PolyCollection

    axes.add_collection(PolyCollection(grid[0][grid[1]], facecolor="none", edgecolor="0.85", linewidth=0.4))
    limit = np.abs(values).max() or 1.0
    points = axes.scatter(*solid.T, c=values, s=2, cmap="coolwarm", vmin=-limit, vmax=limit, linewidth=0)
    if wall[1].shape[1] == 2:
        axes.add_collection(LineCollection(wall[0][wall[1]], color="black", linewidth=1))
    draw_things(axes, things, 100.0)
    centre, radius = things.get("spheres", (np.zeros((0, 2)), np.zeros(0)))
    everything = np.concatenate([grid[0], *(100 * (centre + side * radius[:, None]) for side in (-1, 1))])
    axes.set(xlim=(everything[:, 0].min(), everything[:, 0].max()), aspect="equal", xlabel="x [cm]",
             ylabel="y [cm]", ylim=(everything[:, 1].min(), everything[:, 1].max()))
    return points


def _space(axes: Any, solid: np.ndarray, grid: Pair, wall: Pair, things: Sight, seen: tuple) -> Any:
    """The same in perspective; returns what the colour bar is for."""
    values, look = seen
    limit = np.quantile(np.abs(values), COLOURED) or 1.0
    view, colours = view_of([solid], [things], *look), ramp("coolwarm", limit, limit)
    canvas = new_canvas(view.camera(1400))
    draw_on(canvas, view, (solid, radius_of_points(solid), colours.to_rgba(values)[:, :3]), things)
    canvas.lines(*edges_of(view.low, view.high), GREY)
    if wall[1].shape[1] == 3:
        sides = np.concatenate([wall[1][:, [0, 1]], wall[1][:, [1, 2]], wall[1][:, [2, 0]]])
        canvas.lines(wall[0][sides[:, 0]], wall[0][sides[:, 1]], np.zeros(3), 0.25)
    axes.imshow(np.clip(canvas.picture(), 0.0, 1.0), interpolation="none")
    axes.set_axis_off()
    return colours
