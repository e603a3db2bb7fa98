"""Pictures in perspective by PyVista, off screen, with the camera and the lamp of ``perspective``.

Spheres are computed pixel by pixel by the graphics driver (``vtkOpenGLSphereMapper``), without triangles,
which take many times as long where there is no card. PyVista is loaded only when something is drawn.
"""
import warnings
from functools import lru_cache
from typing import Any, List, Tuple, Union

import numpy as np

from . import perspective
from .perspective import FINE, LIGHT, Camera

SURFACE = dict(ambient=0.35, diffuse=0.75, specular=0.2, specular_power=30.0)
LAMPS = (LIGHT, 0.8), (np.array([0.8, 0.1, 1.0]), 0.5)  # towards them as the eye sees it, intensity
LINE = 2.0  # [pixels of the buffer] width


class Canvas:
    """What the ``camera`` sees, with the methods of ``perspective.Canvas``: things may be drawn in any order.

    x: places, shape (n, 3); colours are red, green and blue from 0 to 1, shape (n, 3) or (3,).
    """

    def __init__(self, camera: Camera) -> None:
        self.camera = camera
        self._things: List[Tuple[str, tuple]] = []  # name of the method, its arguments

    def spheres(self, x: np.ndarray, radius: Union[float, np.ndarray], colour: np.ndarray) -> None:
        """Shaded spheres, radius: shape (n,)."""
        self._things.append(("spheres", (x, radius, colour)))

    def triangles(self, x: np.ndarray, elements: np.ndarray, colour: np.ndarray,
                  opacity: float = 1.0) -> None:
        """Shaded on both sides; elements: shape (m, 3)."""
        self._things.append(("triangles", (x, elements, colour, opacity)))

    def lines(self, starts: np.ndarray, ends: np.ndarray, colour: np.ndarray, opacity: float = 1.0) -> None:
        """Straight ways from starts to ends, shape (n, 3) both."""
        self._things.append(("lines", (starts, ends, colour, opacity)))

    def picture(self) -> np.ndarray:
        """Array of shape (height, width, 3); by ``perspective`` where PyVista fails, of which a warning
        tells."""
        try:
            return self.by_pyvista()
        except Exception as problem:  # of many kinds: they come from PyVista, VTK and the driver
            warnings.warn(f"PyVista could not draw a picture, which is drawn without it ({problem})",
                          stacklevel=2)
        other = perspective.Canvas(self.camera)
        for name, arguments in self._things:
            getattr(other, name)(*arguments)
        return other.picture()

    def by_pyvista(self) -> np.ndarray:
        """The same, with whatever PyVista raises."""
        plotter, clear = _plotter(self.camera.width, self.camera.height), []
        for name, arguments in self._things:
            if name == "spheres":
                _add_spheres(plotter, *arguments)
            elif name == "lines":
                _add_lines(plotter, *arguments)
            else:
                x, elements, colour, opacity = arguments
                faces = x[elements], np.column_stack([np.broadcast_to(colour, (len(elements), 3)),
                                                      np.full(len(elements), opacity)])
                if opacity < 1.0:
                    clear.append(faces)
                else:
                    _add_triangles(plotter, *faces)
        if clear:  # the farthest first, as each is mixed with what has been drawn
            corners, paint = (np.concatenate(parts) for parts in zip(*clear))
            order = np.argsort(-self.camera(corners.mean(axis=1))[1])
            _add_triangles(plotter, corners[order], paint[order])
        return self._taken(plotter)

    def _taken(self, plotter: Any) -> np.ndarray:
        _look(plotter, self.camera)
        plotter.render()
        image = plotter.screenshot(return_img=True)
        plotter.clear_actors()
        plotter.remove_all_lights()
        height, width = self.camera.height // FINE, self.camera.width // FINE
        whole = image[:height * FINE, :width * FINE].reshape(height, FINE, width, FINE, 3)
        return whole.mean(axis=(1, 3)) / 255.0


def trial() -> None:
    """Draw one thing of each kind and look at it. Raises RuntimeError if it is not there."""
    low, high, red, blue = np.zeros(3), np.ones(3), np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
    camera = Camera(low, high, 100)
    canvas, floor = Canvas(camera), np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 0.0, 1.0]])
    canvas.spheres(0.5 * (low + high)[None], 0.3, red)
    for opacity in (1.0, 0.5):
        canvas.triangles(floor + 1.0 - opacity, np.array([[0, 2, 1]]), blue, opacity)
    canvas.lines(low[None], high[None], blue)
    image = canvas.by_pyvista()
    row, column = np.rint(camera(0.5 * (low + high)[None])[0][0][::-1] / FINE).astype(int)
    red_inside = image[row, column, 0] > image[row, column, 2] + 0.2
    if not red_inside or not (image[..., 2] > image[..., 0] + 0.2).any():
        raise RuntimeError("a red sphere on a blue floor is not seen")


@lru_cache(maxsize=1)
def _plotter(width: int, height: int) -> Any:
    """A window off screen, kept for the next picture, as to open one takes longer than to draw."""
    import pyvista

    plotter: Any = pyvista.Plotter(off_screen=True, window_size=[width, height], lighting="none")
    plotter.background_color = "white"
    return plotter


def _look(plotter: Any, camera: Camera) -> None:
    """Let the plotter see with the eye of the ``camera``, to the pixel, in the light of the lamps."""
    import pyvista

    _, up, back = camera.axes
    eye = plotter.camera
    eye.position, eye.focal_point, eye.up = camera.eye, camera.eye - back, up
    eye.view_angle = 2.0 * np.degrees(np.arctan(0.5 * camera.height / camera.scale))
    eye.SetWindowCenter(1.0 - 2.0 * camera.shift[0] / camera.width,
                        2.0 * camera.shift[1] / camera.height - 1.0)
    plotter.renderer.ResetCameraClippingRange()
    for towards, intensity in LAMPS:
        lamp = pyvista.Light(position=camera.eye + towards @ camera.axes, focal_point=camera.eye,
                             light_type="scene light", intensity=intensity)
        lamp.positional = False
        plotter.add_light(lamp)


def _add_spheres(plotter: Any, x: np.ndarray, radius: Union[float, np.ndarray], colour: np.ndarray) -> None:
    import pyvista
    from vtkmodules.vtkRenderingOpenGL2 import vtkOpenGLSphereMapper

    if not len(x):
        return
    data = pyvista.PolyData(np.ascontiguousarray(x, np.float32))
    data["radius"] = np.broadcast_to(radius, len(x)).astype(np.float32)  # another type crashes the mapper
    data["colour"] = np.rint(255.0 * np.broadcast_to(colour, x.shape)).astype(np.uint8)
    mapper = vtkOpenGLSphereMapper()
    mapper.SetInputData(data)
    mapper.SetScaleArray("radius")
    mapper.SetScalarModeToUsePointFieldData()
    mapper.SelectColorArray("colour")
    mapper.SetColorModeToDirectScalars()
    actor = pyvista.Actor()
    actor.SetMapper(mapper)
    for name, value in SURFACE.items():
        setattr(actor.prop, name, value)
    plotter.add_actor(actor, reset_camera=False, render=False)


def _add_lines(plotter: Any, starts: np.ndarray, ends: np.ndarray, colour: np.ndarray,
               opacity: float) -> None:
    import pyvista

    if not len(starts):
        return
    pairs = np.column_stack([np.full(len(starts), 2), np.arange(2 * len(starts)).reshape(-1, 2)])
    mesh = pyvista.PolyData(np.stack([starts, ends], axis=1).reshape(-1, 3), lines=pairs.ravel())
    plotter.add_mesh(mesh, color=tuple(colour), opacity=opacity, line_width=LINE, lighting=False,
                     reset_camera=False, render=False)


def _add_triangles(plotter: Any, corners: np.ndarray, paint: np.ndarray) -> None:
    """corners: shape (m, 3, 3); paint: colour and opacity, shape (m, 4). None shares its corners with
    another: each has the shade of its own normal."""
    import pyvista

    if not len(corners):
        return
    faces = np.column_stack([np.full(len(corners), 3), np.arange(3 * len(corners)).reshape(-1, 3)])
    mesh = pyvista.PolyData(corners.reshape(-1, 3), faces.ravel())
    paint = np.rint(255.0 * paint).astype(np.uint8)
    mesh.cell_data["paint"] = paint if (paint[:, 3] < 255).any() else paint[:, :3]
    plotter.add_mesh(mesh, scalars="paint", rgb=True, lighting=True, reset_camera=False, render=False,
                     **SURFACE)
