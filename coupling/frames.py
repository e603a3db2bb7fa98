"""Pictures of a flow at several times, side by side, made by matplotlib, which is loaded only then."""
import numpy as np

from .figure import pyplot


def draw(path, frames, label, shapes=()):
    """Save the pictures seen along z, at one scale; y points upward.

    frames: (title, x, values) each, with positions x of material points [m], shape (n, 2 or 3), in the colours of
    ``values``, shape (n,), called ``label``; shapes: for each frame the polygons in it [m], shape (m, corners, 2).
    """
    plt = pyplot()
    from matplotlib.collections import PolyCollection

    low = np.min([x[:, :2].min(axis=0) for _, x, _ in frames], axis=0)
    high = np.max([np.quantile(x[:, :2], 0.9995, axis=0) for _, x, _ in frames], axis=0)  # fliers would shrink the rest
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
            axis.add_collection(PolyCollection(100 * shapes[number], facecolor="burlywood", edgecolor="saddlebrown"))
        dots = axis.scatter(100 * x[:, 0], 100 * x[:, 1], c=values, s=2, cmap="viridis", vmin=0, vmax=most, linewidth=0)
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
