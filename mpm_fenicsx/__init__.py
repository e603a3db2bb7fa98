"""Implicit material point method on dolfinx background meshes; PETSc SNES solves, material points are the
quadrature."""
import sys

import petsc4py
from mpi4py import MPI  # noqa: F401 - first: where MPI is a wheel, PETSc finds it through mpi4py

import mpm_dem_checks as check

from .command_line import PETSC_DEFAULTS, words

for option, value in zip(words(), words()[1:]):
    if option == "-options_file":  # PETSc would end in lines that name neither the option nor the file
        try:
            check.file(option, value)
        except ValueError as error:
            sys.exit(f"error: {error}")
petsc4py.init(words())  # before dolfinx is imported: afterwards PETSc no longer listens to the command line

from petsc4py import PETSc  # noqa: E402

for option, value in PETSC_DEFAULTS.items():
    if not PETSc.Options().hasName(option):
        PETSc.Options()[option] = value

import mpm_dem_cache  # noqa: E402, F401 - before anything is compiled
import mpm_dem_loading  # noqa: E402, F401 - the same

from .errors import MPMDivergedError, MPMError  # noqa: E402
from .grid.given import from_dolfinx  # noqa: E402
from .laws import (  # noqa: E402
    LAWS,
    Law,
    cam_clay,
    check_law,
    drucker_prager,
    from_energy,
    herschel_bulkley,
    linear,
    mohr_coulomb,
    mu_i,
    neo_hooke,
    softened,
    von_mises,
)
from .laws.driver import drive  # noqa: E402
from .laws.paths import PATHS, Stage  # noqa: E402
from .laws.soil import Soil  # noqa: E402
from .mpm import MPM  # noqa: E402
from .output.gauges import FlowGauges  # noqa: E402
from .points.points import of_points, seed  # noqa: E402
from .scene.balls import Balls  # noqa: E402
from .scene.beam import SimplySupportedBeam  # noqa: E402
from .scene.bodies import Body, Cloud, Grid  # noqa: E402
from .scene.conditions import GridWall, Load, Penalty  # noqa: E402
from .scene.flow import fall_room, flow_grid, level_floor  # noqa: E402
from .scene.from_checkpoint import FromCheckpoint  # noqa: E402
from .scene.geostatic import at_rest  # noqa: E402
from .scene.ground import Ground, Layer  # noqa: E402
from .scene.initial import InitialGround, InitialState  # noqa: E402
from .scene.interface import Interface, Resampling  # noqa: E402
from .scene.mesh import Box, Mesh  # noqa: E402
from .scene.meshfile import read_cloud, read_mesh  # noqa: E402
from .scene.numerics import SOLVERS, Numerics  # noqa: E402
from .scene.openings import Inflow, Outflow  # noqa: E402
from .scene.raster import Raster  # noqa: E402
from .scene.structures import Structure  # noqa: E402
from .scene.supports import Support  # noqa: E402
from .scene.terrain import Terrain  # noqa: E402
from .settling import Settled  # noqa: E402

__all__ = [  # a scene; how it is computed; laws; points; what is read off; errors
    "Balls", "Body", "Box", "Cloud", "FromCheckpoint", "Grid", "GridWall", "Ground", "Inflow",
    "InitialGround", "InitialState", "Interface", "Layer", "Load", "Mesh", "Outflow", "Penalty", "Raster",
    "Resampling", "SimplySupportedBeam", "Structure", "Support", "Terrain", "at_rest", "fall_room",
    "flow_grid", "from_dolfinx", "level_floor", "read_cloud", "read_mesh",
    "MPM", "Numerics", "SOLVERS", "Settled",
    "LAWS", "Law", "PATHS", "Soil", "Stage", "cam_clay", "check_law", "drive", "drucker_prager",
    "from_energy", "herschel_bulkley", "linear", "mohr_coulomb", "mu_i", "neo_hooke", "softened", "von_mises",
    "of_points", "seed",
    "FlowGauges",
    "MPMDivergedError", "MPMError"]
