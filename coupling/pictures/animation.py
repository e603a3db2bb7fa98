"""Animated GIF of a flow, made by matplotlib and Pillow, which are loaded only then."""
from pathlib import Path
from typing import Any, List, Sequence, Tuple

import numpy as np

from .figure import pyplot, ramp
from .flat import draw_things
from .perspective import radius_of_points
from .sights import Sight
from .space import FLIERS, paint, view_of

COLOURS = {2: 64, 3: 256}  # of the palette, in the plane and in space; 64 take half the file of 256
COLOURED = 0.99  # part of the points with colours of their own: a few fast ones would darken the rest
SECONDS = 0.08  # that each picture is shown
WIDTH = 640  # [pixels]


def save(path: Path, frames: Sequence[tuple], label: str, look: tuple = (np.zeros(3), None)) -> None:
    """Save a GIF, in the plane seen along z with y upward, in space in perspective.

    frames: (title, x, values, things) each, with positions x of material points [m], shape (n, 2 or 3), in
    the colours of ``values``, shape (n,), called ``label``, and ``sights.sight``, which may have "shapes",
    polygons [m], shape (m, corners, 2); look: gravity [m/s^2], shape (3,), and angles of the eye, see
    ``space.view_of``.
    """
    most = max(np.quantile(values, COLOURED) for _, _, values, _ in frames) or 1.0
    dim = frames[0][1].shape[1]
    images = (_in_space if dim == 3 else _in_the_plane)(frames, label, most, look)
    pictures = [image.quantize(COLOURS[dim], dither=0) for image in images]
    pictures[0].save(path, save_all=True, append_images=pictures[1:], duration=round(1000 * SECONDS), loop=0,
                     optimize=True)


def _in_the_plane(frames: Sequence[tuple], label: str, most: float, look: tuple) -> List[Any]:
    plt = pyplot()
    low, high = (100 * corner for corner in _corners(frames))
    span = high - low
    figure, axis = plt.subplots(figsize=(WIDTH / 100, (0.8 * WIDTH * span[1] / span[0] + 80) / 100), dpi=100,
                                layout="constrained")
    dots = axis.scatter([], [], c=[], s=1.5, cmap="viridis", vmin=0, vmax=most, linewidth=0)
    axis.set(xlim=(low[0], low[0] + 1.02 * span[0]), ylim=(low[1], low[1] + 1.05 * span[1]), aspect="equal",
             xlabel="x [cm]", ylabel="y [cm]")
    figure.colorbar(dots, ax=axis, label=label, pad=0.02, extend="max")
    pictures = []
    for title, x, values, things in frames:
        dots.set_offsets(100 * x)
        dots.set_array(values)
        added = draw_things(axis, things, 100.0)
        axis.set_title(title, loc="right", fontsize="medium")
        pictures.append(_picture(figure))
        for one in added:
            one.remove()
    plt.close(figure)
    return pictures


def _corners(frames: Sequence[tuple]) -> Tuple[np.ndarray, np.ndarray]:
    """Of the box around what is to be seen [m]; it begins at zero where that is near."""
    lows, highs = [], []
    for _, x, _, things in frames:
        some = [np.quantile(x, (1.0 - FLIERS, FLIERS), axis=0), *_places(things)]
        lows += [places.min(axis=0) for places in some]
        highs += [places.max(axis=0) for places in some]
    low, high = np.min(lows, axis=0), np.max(highs, axis=0)
    return np.where((low > 0.0) & (low < 0.5 * high), 0.0, low), high


def _places(things: Sight) -> List[np.ndarray]:
    """Outermost places of shapes, spheres and structures [m], shape (k, 2) each."""
    found = [np.reshape(things[name][0], (-1, 2)) for name in ("shapes", "structures") if name in things]
    if "spheres" in things:
        x, radius = things["spheres"]
        found += [x - radius[:, None], x + radius[:, None]]
    return [places for places in found if len(places)]


def _in_space(frames: Sequence[tuple], label: str, most: float, look: tuple) -> List[Any]:
    plt = pyplot()
    view = view_of([x for _, x, *_ in frames], [things for *_, things in frames], *look)
    radius, colours, camera = radius_of_points(frames[0][1]), ramp("viridis", most), view.camera(WIDTH - 80)
    figure, axis = plt.subplots(figsize=(WIDTH / 100, (camera.picture_height + 40) / 100), dpi=100,
                                layout="constrained")
    axis.set_axis_off()
    image = axis.imshow(np.ones((camera.picture_height, WIDTH - 80, 3)), interpolation="none")
    figure.colorbar(colours, ax=axis, label=label, pad=0.02, shrink=0.8, extend="max")
    pictures = []
    for title, x, values, things in frames:
        image.set_data(paint(view, WIDTH - 80, (x, radius, colours.to_rgba(values)[:, :3]), things))
        axis.set_title(title, loc="right", fontsize="medium")
        pictures.append(_picture(figure))
    plt.close(figure)
    return pictures


def _picture(figure: Any) -> Any:
    from PIL import Image

    figure.canvas.draw()
    picture = Image.frombuffer("RGBA", figure.canvas.get_width_height(), figure.canvas.buffer_rgba())
    return picture.convert("RGB")
