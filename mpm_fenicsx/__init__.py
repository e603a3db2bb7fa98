"""Implicit material point method on dolfinx background meshes; PETSc SNES solves, material points are the quadrature."""
import sys

import petsc4py

petsc4py.init(sys.argv)  # before dolfinx is imported: afterwards PETSc no longer listens to the command line

from .errors import MPMDiverged, MPMError  # noqa: E402
from .laws import LAWS, drucker_prager, linear, mohr_coulomb, neo_hooke, von_mises  # noqa: E402
from .mpm import MPM  # noqa: E402
from .mesh import Box, Mesh, read_mesh  # noqa: E402
from .scene import Body, Cloud, Grid, Interface, Support  # noqa: E402

__all__ = ["Body", "Box", "Cloud", "Grid", "Interface", "LAWS", "MPM", "MPMDiverged", "MPMError", "Mesh", "Support",
           "drucker_prager", "linear", "mohr_coulomb", "neo_hooke", "read_mesh", "von_mises"]
