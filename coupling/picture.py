"""Picture of a scene in the plane or in space, made without a display by matplotlib, which is loaded only then."""
from itertools import product

import numpy as np

from .figure import pyplot


def draw(path, solid, grid, wall, spheres, values, label):
    """Save a picture; y points upward.

    solid: positions of material points [m], shape (n, dim), in the colours of ``values``, shape (n,), called ``label``;
    grid: vertices [m], shape (m, dim), and cells with their corners around them, shape (k, corners); wall: nodes [m],
    shape (w, dim), and elements; spheres: centres [m], shape (s, dim), and radii [m], shape (s,).
    """
    plt = pyplot()

    figure = plt.figure(figsize=(10, 4))
    make = _plane if solid.shape[1] == 2 else _space
    axes, points = make(figure, 100 * solid, (100 * grid[0], grid[1]), (100 * wall[0], wall[1]),
                        (100 * spheres[0], 100 * spheres[1]), values)
    beside = None if make is _plane else figure.add_axes([0.91, 0.3, 0.015, 0.4])
    figure.colorbar(points, ax=axes, cax=beside, label=label, shrink=0.7, pad=0.02)
    figure.savefig(path, dpi=150, bbox_inches="tight" if beside is None else None)
    plt.close(figure)


def _plane(figure, solid, grid, wall, spheres, values):
    from matplotlib.collections import EllipseCollection, LineCollection, PolyCollection

    axes = figure.add_subplot()
    axes.add_collection(PolyCollection(grid[0][grid[1]], facecolor="none", edgecolor="0.85", linewidth=0.4))
    limit = np.abs(values).max() or 1.0
    points = axes.scatter(*solid.T, c=values, s=2, cmap="coolwarm", vmin=-limit, vmax=limit, linewidth=0)
    axes.add_collection(LineCollection(wall[0][wall[1]], color="black", linewidth=1))
    width = 2 * spheres[1]
    axes.add_collection(EllipseCollection(width, width, np.zeros_like(width), units="xy", offsets=spheres[0],
                                          offset_transform=axes.transData, facecolor="0.8", edgecolor="0.3"))
    everything = np.concatenate([grid[0], spheres[0] - spheres[1][:, None], spheres[0] + spheres[1][:, None]])
    axes.set(xlim=(everything[:, 0].min(), everything[:, 0].max()), aspect="equal", xlabel="x [cm]", ylabel="y [cm]",
             ylim=(everything[:, 1].min(), everything[:, 1].max()))
    return axes, points


def _space(figure, solid, grid, wall, spheres, values):
    axes = figure.add_axes([-0.05, -0.7, 0.96, 2.4], projection="3d", computed_zorder=False)
    order = [0, 2, 1]  # matplotlib's third axis points upward; its axes are a square, here one larger than the figure
    low, high = grid[0].min(axis=0), grid[0].max(axis=0)
    for a, b in product(product((0, 1), repeat=3), repeat=2):
        if a < b and np.abs(np.subtract(a, b)).sum() == 1:
            axes.plot(*np.where([a, b], high, low)[:, order].T, color="0.75", linewidth=0.7, zorder=0)
    limit = np.abs(values).max() or 1.0
    points = axes.scatter(*solid[:, order].T, c=values, s=5, cmap="coolwarm", vmin=-limit, vmax=limit, linewidth=0,
                          depthshade=False, zorder=1)
    axes.plot_trisurf(*wall[0][:, order[:2]].T, wall[0][:, 1], triangles=wall[1], color=(0, 0, 0, 0.0),
                      edgecolor=(0, 0, 0, 0.25), linewidth=0.15, zorder=2)
    angle, height = np.meshgrid(np.linspace(0, 2 * np.pi, 41), np.linspace(0, np.pi, 21))
    ball = np.stack([np.cos(angle) * np.sin(height), np.cos(height), np.sin(angle) * np.sin(height)])
    for centre, radius in zip(*spheres):
        axes.plot_surface(*(centre[:, None, None] + radius * ball)[order], color="0.8", linewidth=0, zorder=3)
        high = np.maximum(high, centre + radius)
    axes.set(xlim=(low[0], high[0]), ylim=(low[2], high[2]), zlim=(low[1], high[1]))
    axes.set_axis_off()
    axes.set_box_aspect((high - low)[order], zoom=0.9)
    axes.view_init(elev=22, azim=-70)
    return axes, points
