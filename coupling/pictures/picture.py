"""Picture of a scene in the plane or in space, made without a display: in the plane by matplotlib, in
space by ``perspective``."""
from pathlib import Path
from typing import Any, Tuple

import numpy as np

from .figure import pyplot, ramp
from .perspective import GREY, Camera, Canvas, edges_of, radius_of_points

Pair = Tuple[np.ndarray, np.ndarray]  # places and what is there: cells, elements or radii


def draw(path: Path, solid: np.ndarray, grid: Pair, wall: Pair, spheres: Pair, values: np.ndarray,
         label: str) -> None:
    """Save a picture; y points upward.

    solid: positions of material points [m], shape (n, dim), in the colours of ``values``, shape (n,), called
    ``label``; grid: vertices [m], shape (m, dim), and cells with their corners around them, shape (k,
    corners); wall: nodes [m], shape (w, dim), and elements; spheres: centres [m], shape (s, dim), and radii
    [m], shape (s,).
    """
    plt = pyplot()
    figure, axes = plt.subplots(figsize=(10, 4), layout="constrained" if solid.shape[1] == 3 else None)
    if solid.shape[1] == 3:
        points = _space(axes, solid, grid, wall, spheres, values)
    else:
        points = _plane(axes, 100 * solid, (100 * grid[0], grid[1]), (100 * wall[0], wall[1]),
                        (100 * spheres[0], 100 * spheres[1]), values)
    figure.colorbar(points, ax=axes, label=label, shrink=0.7, pad=0.02)
    figure.savefig(path, dpi=150, bbox_inches="tight")
    plt.close(figure)


def _plane(axes: Any, solid: np.ndarray, grid: Pair, wall: Pair, spheres: Pair, values: np.ndarray) -> Any:
    from matplotlib.collections import EllipseCollection, LineCollection, PolyCollection

    axes.add_collection(PolyCollection(grid[0][grid[1]], facecolor="none", edgecolor="0.85", linewidth=0.4))
    limit = np.abs(values).max() or 1.0
    points = axes.scatter(*solid.T, c=values, s=2, cmap="coolwarm", vmin=-limit, vmax=limit, linewidth=0)
    axes.add_collection(LineCollection(wall[0][wall[1]], color="black", linewidth=1))
    width = 2 * spheres[1]
    axes.add_collection(EllipseCollection(width, width, np.zeros_like(width), units="xy", offsets=spheres[0],
                                          offset_transform=axes.transData, facecolor="0.8", edgecolor="0.3"))
    everything = np.concatenate([grid[0], spheres[0] - spheres[1][:, None], spheres[0] + spheres[1][:, None]])
    axes.set(xlim=(everything[:, 0].min(), everything[:, 0].max()), aspect="equal", xlabel="x [cm]",
             ylabel="y [cm]", ylim=(everything[:, 1].min(), everything[:, 1].max()))
    return points


def _space(axes: Any, solid: np.ndarray, grid: Pair, wall: Pair, spheres: Pair, values: np.ndarray) -> Any:
    """The same in perspective; returns what the colour bar is for."""
    low, high = grid[0].min(axis=0), grid[0].max(axis=0)
    for centre, radius in zip(*spheres):
        low, high = np.minimum(low, centre - radius), np.maximum(high, centre + radius)
    canvas, colours = Canvas(Camera(low, high, 1400)), ramp("coolwarm", *[np.abs(values).max() or 1.0] * 2)
    canvas.spheres(solid, radius_of_points(solid), colours.to_rgba(values)[:, :3])
    canvas.spheres(spheres[0], spheres[1], np.array([0.72, 0.74, 0.78]))
    canvas.lines(*edges_of(grid[0].min(axis=0), grid[0].max(axis=0)), GREY)
    sides = np.concatenate([wall[1][:, [0, 1]], wall[1][:, [1, 2]], wall[1][:, [2, 0]]])
    canvas.lines(wall[0][sides[:, 0]], wall[0][sides[:, 1]], np.zeros(3), 0.25)
    axes.imshow(canvas.picture(), interpolation="none")
    axes.set_axis_off()
    return colours
