"""The canvas of pictures in space: PyVista's where that can draw, else that of ``perspective``."""
import os
import subprocess
import sys
import warnings
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import Union

from mpm_dem_mpi import outside_mpi

from . import by_pyvista, perspective

WINDOW = "VTK_DEFAULT_OPENGL_WINDOW"  # what VTK 9.4 and later asks for the class of windows
WINDOWS = "vtkEGLRenderWindow", "vtkOSOpenGLRenderWindow"  # without a display: by EGL, by Mesa alone
PATIENCE = 120.0  # [s] for one trial; on a busy file system it takes long to load VTK
TRIAL = "import sys; sys.path.append(sys.argv[1]); from pictures import by_pyvista; by_pyvista.trial()"
AnyCanvas = Union[by_pyvista.Canvas, perspective.Canvas]


def new_canvas(camera: perspective.Camera) -> AnyCanvas:
    """For what the ``camera`` sees."""
    return (by_pyvista if pyvista_draws() else perspective).Canvas(camera)


@lru_cache(maxsize=None)
def pyvista_draws() -> bool:
    """Whether PyVista is installed and draws without a display. Tried once, in a process of its own, as a
    graphics driver that is missing or broken may end the process; where it does not, a warning says so."""
    if find_spec("pyvista") is None:
        return False
    for window in (os.environ[WINDOW],) if WINDOW in os.environ else WINDOWS:
        if not (problem := _trial(window)):
            os.environ[WINDOW] = window
            return True
    warnings.warn(f"PyVista is installed but cannot draw here ({problem}): pictures in space are drawn "
                  "without it", stacklevel=2)
    return False


def _trial(window: str) -> str:
    """What is wrong with windows of this class, "" for nothing."""
    try:
        done = subprocess.run([sys.executable, "-c", TRIAL, str(Path(__file__).parents[1])], timeout=PATIENCE,
                              env={**outside_mpi(), WINDOW: window}, capture_output=True, text=True,
                              errors="replace")
    except subprocess.TimeoutExpired:
        return f"{window}: no answer within {PATIENCE:.0f} s"
    except OSError as error:
        return str(error)
    if done.returncode == 0:
        return ""
    said = done.stderr.strip().splitlines() if done.returncode > 0 else []
    return f"{window}: {said[-1] if said else f'ended by signal {-done.returncode}'}"
