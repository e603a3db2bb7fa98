"""Animated GIF of a flow, made by matplotlib and Pillow, which are loaded only then."""
from pathlib import Path
from typing import Sequence

import numpy as np

from .figure import pyplot

COLOURS = 64  # of the palette: half the file of 256


def save(path: Path, frames: Sequence[tuple], label: str, seconds: float = 0.08, width: int = 640) -> None:
    """Save a GIF seen along z, ``width`` pixels wide, each picture shown for ``seconds``; y points upward.

    frames: (title, x, values, shapes) each, with positions x of material points [m], shape (n, 2), in the
    colours of ``values``, shape (n,), called ``label``, and polygons [m], shape (m, corners, 2).
    """
    plt = pyplot()
    from matplotlib.collections import PolyCollection
    from PIL import Image

    high = 100 * np.max([np.quantile(x, 0.9995, axis=0) for _, x, *_ in frames]
                        + [shapes.max(axis=(0, 1)) for *_, shapes in frames if len(shapes)], axis=0)
    figure, axis = plt.subplots(figsize=(width / 100, (0.8 * width * high[1] / high[0] + 80) / 100), dpi=100,
                                layout="constrained")
    most = max(np.quantile(values, 0.999) for _, _, values, _ in frames) or 1.0
    dots = axis.scatter([], [], c=[], s=1.5, cmap="viridis", vmin=0, vmax=most, linewidth=0)
    blocks = axis.add_collection(PolyCollection([], facecolor="burlywood", edgecolor="saddlebrown"))
    axis.set(xlim=(0, 1.02 * high[0]), ylim=(0, 1.05 * high[1]), aspect="equal", xlabel="x [cm]",
             ylabel="y [cm]")
    figure.colorbar(dots, ax=axis, label=label, pad=0.02)
    pictures = []
    for title, x, values, shapes in frames:
        dots.set_offsets(100 * x)
        dots.set_array(values)
        blocks.set_verts(100 * shapes)
        axis.set_title(title, loc="right", fontsize="medium")
        figure.canvas.draw()
        picture = Image.frombuffer("RGBA", figure.canvas.get_width_height(), figure.canvas.buffer_rgba())
        pictures.append(picture.convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE))
    plt.close(figure)
    pictures[0].save(path, save_all=True, append_images=pictures[1:], duration=round(1000 * seconds), loop=0,
                     optimize=True)
