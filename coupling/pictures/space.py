"""Scenes in space: from where they are seen, and what of them is drawn."""
from typing import Any, Iterator, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from .canvases import AnyCanvas, new_canvas
from .clip import inside_box
from .hiding import PIXELS, from_outside, hiding
from .perspective import Camera, level_axes
from .sights import Sight

FLIERS = 0.9995  # part of the points that the picture is made for: fliers would shrink the rest
STONE, STEEL = np.array([0.72, 0.62, 0.5]), np.array([0.62, 0.66, 0.74])
CONCRETE = np.array([0.93, 0.92, 0.9])
COLOURS = {"spheres": STONE, "rocks": STONE, "structures": STEEL, "walls": CONCRETE}
FROM_BEHIND = 0.15  # opacity of structures and walls whose inside is seen
BEFORE_SOIL = 0.35  # that of structures that hide the soil
REACH = 0.5  # of the flow's diagonal, up to which structures are shown, and the camera stands back for them
VIEW = -104.0, 26.0  # [degrees] azimuth of the eye from the flow's direction, so at its right; elevation


class View(NamedTuple):
    """The box that is seen, corners ``low`` and ``high`` [m], shape (3,), the axis that points ``up``, and
    ``azimuth`` and ``elevation`` of the eye [degrees]; ``clear``: mask of the triangles of the structures
    that hide the soil, shape (m,)."""

    low: np.ndarray
    high: np.ndarray
    up: int
    azimuth: float
    elevation: float
    clear: np.ndarray = np.zeros(0, bool)

    def camera(self, width: int) -> Camera:
        """Of a picture ``width`` pixels wide."""
        return Camera(self.low, self.high, width, self.elevation, self.azimuth, up=self.up)


def gravity_of(solid: Any, grains: Any) -> np.ndarray:
    """Of the scene [m/s^2], shape (3,); zero where there is none."""
    for side in (solid, grains):
        gravity = getattr(getattr(side, "scene", None), "gravity", None)
        if gravity is not None and np.shape(gravity) == (3,) and np.any(gravity):
            return np.asarray(gravity, float)
    return np.zeros(3)


def view_of(points: Sequence[np.ndarray], sights: Sequence[Sight], gravity: np.ndarray,
            angles: Optional[Tuple[float, float]] = None) -> View:
    """Along the flow and from above, so that all points, spheres and rocks are seen, and structures near
    them, in all pictures.

    points: shape (n, 3) each, in their order in time; angles: azimuth from the flow's direction and elevation
    [degrees], None for ``VIEW``. The flow goes down the slope, that is along gravity but for its largest
    component, whose axis is upright; on level ground as the middle of the points goes.
    """
    up = int(np.argmax(np.abs(gravity))) if gravity.any() else 1
    ahead, left, _ = level_axes(up)
    flow = gravity * (np.arange(3) != up)
    if np.linalg.norm(flow) < 0.02 * np.linalg.norm(gravity) or not gravity.any():
        flow = np.median(points[-1], axis=0) - np.median(points[0], axis=0)
    turn, size = np.arctan2(flow @ left, flow @ ahead), np.hypot(flow @ left, flow @ ahead)
    low, high = _box(points, sights)
    if size < 1e-3 * np.linalg.norm(high - low) and not gravity[[k for k in range(3) if k != up]].any():
        turn = 0.0  # it goes nowhere
    azimuth, elevation = VIEW if angles is None else angles
    view = View(*_with_structures(low, high, sights), up, np.degrees(turn) + azimuth, elevation)
    return view._replace(clear=hiding((view.low, view.high), view.camera(PIXELS), points, sights))


def _box(points: Sequence[np.ndarray], sights: Sequence[Sight]) -> Tuple[np.ndarray, np.ndarray]:
    """Around what moves."""
    lows = [np.quantile(x, 1.0 - FLIERS, axis=0) for x in points]
    highs = [np.quantile(x, FLIERS, axis=0) for x in points]
    for one in sights:
        x, radii = one.get("spheres", (np.zeros((0, 3)), np.zeros(0)))
        lows += [(x - radii[:, None]).min(axis=0)] if len(x) else []
        highs += [(x + radii[:, None]).max(axis=0)] if len(x) else []
        lows += [one["rocks"][0].min(axis=0)] if "rocks" in one else []
        highs += [one["rocks"][0].max(axis=0)] if "rocks" in one else []
    return np.min(lows, axis=0), np.max(highs, axis=0)


def _with_structures(low: np.ndarray, high: np.ndarray,
                     sights: Sequence[Sight]) -> Tuple[np.ndarray, np.ndarray]:
    """The box, with the structures as far as they are near."""
    reach = REACH * np.linalg.norm(high - low)
    first, last = low - reach, high + reach
    for one in sights:
        if "structures" in one:
            x = np.clip(one["structures"][0], first, last)
            low, high = np.minimum(low, x.min(axis=0)), np.maximum(high, x.max(axis=0))
    room = 0.01 * np.linalg.norm(high - low)
    return low - room, high + room


def paint(view: View, width: int, points: Tuple[np.ndarray, float, np.ndarray], things: Sight) -> np.ndarray:
    """Picture of shape (height, width, 3). points: places [m], shape (n, 3), radius [m], colours (n, 3)."""
    canvas = new_canvas(view.camera(width))
    draw_on(canvas, view, points, things)
    return np.clip(canvas.picture(), 0.0, 1.0)


def draw_on(canvas: AnyCanvas, view: View, points: Tuple[np.ndarray, float, np.ndarray],
            things: Sight) -> None:
    """The same on a canvas with a camera of the ``view``."""
    canvas.spheres(*points)
    if "spheres" in things:
        canvas.spheres(*things["spheres"], COLOURS["spheres"])
    if "rocks" in things:
        x, elements = things["rocks"]
        canvas.triangles(x, elements[from_outside(canvas.camera, x, elements)], COLOURS["rocks"])
    last = []
    for x, elements, colour, opacity in _surfaces(view, things):
        x, elements = inside_box(x, elements, view.low, view.high)
        front = from_outside(canvas.camera, x, elements)
        if opacity < 1.0:
            last.append((x, elements[front], colour, opacity))
        else:
            canvas.triangles(x, elements[front], colour)
        last.append((x, elements[~front], colour, FROM_BEHIND))
    for one in last:
        canvas.triangles(*one)


def _surfaces(view: View, things: Sight) -> Iterator[tuple]:
    """Places, triangles, colour and opacity, seen from outside, of structures and walls."""
    if "structures" in things:
        (x, elements), clear = things["structures"], view.clear
        yield x, elements[~clear], COLOURS["structures"], 1.0
        yield x, elements[clear], COLOURS["structures"], BEFORE_SOIL
    if "walls" in things:
        yield *things["walls"], COLOURS["walls"], 1.0
