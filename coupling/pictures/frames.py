"""Pictures of a flow at several times, side by side, made by matplotlib, which is loaded only then."""
from pathlib import Path
from typing import Sequence, Tuple

import numpy as np

from .canvases import new_canvas
from .figure import pyplot, ramp
from .perspective import GREY, Camera, edges_of, radius_of_points

FLIERS = 0.9995  # part of the points that the picture is made for: fliers would shrink the rest
FLOOR = np.array([0.93, 0.92, 0.9])


def draw(path: Path, frames: Sequence[tuple], label: str, shapes: Sequence[np.ndarray] = (),
         walls: Sequence[str] = ()) -> None:
    """Save the pictures at one scale, of a plane scene seen along z, in space in perspective; y points
    upward.

    frames: (title, x, values) each, with positions x of material points [m], shape (n, 2 or 3), in the
    colours of ``values``, shape (n,), called ``label``; shapes: for each frame the polygons in it [m], shape
    (m, corners, 2); walls: in space, sides of the box around all that are drawn as walls, such as "-y" for a
    floor.
    """
    if frames[0][1].shape[1] == 3:
        return _in_space(path, frames, label, walls)
    plt = pyplot()
    from matplotlib.collections import PolyCollection

    low = np.min([x[:, :2].min(axis=0) for _, x, _ in frames], axis=0)
    high = np.max([np.quantile(x[:, :2], FLIERS, axis=0) for _, x, _ in frames], axis=0)
    for corners in shapes:
        low, high = np.minimum(low, corners.min(axis=(0, 1))), np.maximum(high, corners.max(axis=(0, 1)))
    span = 1.05 * (high - low)
    columns = 1 if len(frames) < 4 or span[0] > 6 * span[1] else 2
    rows, width = -(-len(frames) // columns), 9.0 / columns
    height = np.clip(0.85 * width * span[1] / span[0], 0.6, 12.0)
    figure, axes = plt.subplots(rows, columns, sharex=True, sharey=True, squeeze=False, layout="constrained",
                                figsize=(10.0, rows * (height + 0.1) + 0.5))
    most = max(values.max() for _, _, values in frames) or 1.0
    for number, (axis, (title, x, values)) in enumerate(zip(axes.ravel(), frames)):
        if len(shapes):
            axis.add_collection(PolyCollection(100 * shapes[number], facecolor="burlywood",
                                               edgecolor="saddlebrown"))
        dots = axis.scatter(100 * x[:, 0], 100 * x[:, 1], c=values, s=2, cmap="viridis", vmin=0, vmax=most,
                            linewidth=0)
        axis.set(xlim=(100 * low[0], 100 * (low[0] + span[0])), ylim=(100 * low[1], 100 * (low[1] + span[1])),
                 aspect="equal")
        axis.set_title(title, loc="right", fontsize="medium", y=0.8, x=0.98)
    for axis in axes.ravel()[len(frames):]:
        axis.set_axis_off()
    figure.supxlabel("x [cm]")
    figure.supylabel("y [cm]")
    figure.colorbar(dots, ax=axes, label=label, shrink=min(1.0, 2.0 / rows), pad=0.02)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def _in_space(path: Path, frames: Sequence[tuple], label: str, walls: Sequence[str]) -> None:
    """Points as shaded spheres, each picture from the same place."""
    plt = pyplot()
    radius = radius_of_points(frames[0][1])
    low = np.min([x.min(axis=0) for _, x, _ in frames], axis=0) - radius
    high = np.max([np.quantile(x, FLIERS, axis=0) for _, x, _ in frames], axis=0) + radius
    columns, camera = 1 if len(frames) < 3 else 2, Camera(low, high, 1000)
    rows, colours = -(-len(frames) // columns), ramp("viridis", max(values.max() for _, _, values in frames)
                                                     or 1.0)
    width = 10.0 / columns
    figure, axes = plt.subplots(rows, columns, squeeze=False, layout="constrained",
                                figsize=(11.0, rows * (width * camera.height / camera.width + 0.3) + 0.3))
    for axis, (title, x, values) in zip(axes.ravel(), frames):
        canvas = new_canvas(camera)
        canvas.spheres(x, radius, colours.to_rgba(values)[:, :3])
        canvas.lines(*edges_of(low, high), GREY)
        for side in walls:
            canvas.triangles(*_side(low, high, side), FLOOR)
        axis.imshow(canvas.picture(), interpolation="none")
        axis.set_title(title, fontsize="medium")
    for axis in axes.ravel():
        axis.set_axis_off()
    size = " x ".join(f"{100 * length:.3g}" for length in high - low)
    figure.supxlabel(f"box around the points: {size} cm (x, y, z)", fontsize="small")
    figure.colorbar(colours, ax=axes, label=label, shrink=min(1.0, 2.0 / rows), pad=0.02)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def _side(low: np.ndarray, high: np.ndarray, side: str) -> Tuple[np.ndarray, np.ndarray]:
    """Corners and triangles of one side of a box, such as "-y"."""
    axis, level = "xyz".index(side[1]), (low, high)[side[0] == "+"]
    corner = np.repeat(level[None], 4, axis=0)
    for d, ends in zip([d for d in range(3) if d != axis], ([0, 1, 1, 0], [0, 0, 1, 1])):
        corner[:, d] = np.where(ends, high[d], low[d])
    return corner, np.array([[0, 1, 2], [0, 2, 3]])
