"""What ``MPM`` is given: checked before anything is built."""
import mpm_dem_checks as check

from .scene.bodies import Body, Grid, Support
from .scene.conditions import GridWall, Load, Penalty
from .scene.interface import Interface
from .scene.mesh import Mesh
from .scene.numerics import Numerics
from .terms.ghost import INERTIA


def check_arguments(grid, bodies, supports, interface, gravity, inertia, loads, penalties, body_force, numerics):
    """ValueError for the first argument of ``MPM`` that is none; bodies: a list."""
    check.record("grid", grid, Grid, Mesh)
    check.records("bodies", bodies, Body)
    check.records("supports", supports, Support)
    check.records("loads", loads, Load)
    check.records("penalties", penalties, Penalty, GridWall)
    check.choice("inertia", inertia, INERTIA)
    check.record("numerics", numerics, Numerics)
    if interface is not None:
        check.record("interface", interface, Interface)
    if gravity is not None:
        check.numbers("gravity", gravity, grid.dim, "m/s^2")
    if body_force is not None:
        check.function("body_force", body_force)
