"""Meshes of dolfinx as grids and bodies, and nodal fields as its functions for UFL and XDMF, on any ranks."""
import shutil
import sysconfig
from pathlib import Path

import h5py
import meshio
import numpy as np
import pytest
from mpi4py import MPI

from mpm_fenicsx import MPM, Body, Box, Grid, Interface, Mesh, MPMError, Support, from_dolfinx, linear
from mpm_fenicsx.grid.domain import node_shares
from mpm_fenicsx.points.points import seed
from mpm_fenicsx.points.surface import normal_areas

POINTS = {"quadrilateral": 2, "triangle": 3, "hexahedron": 2, "tetrahedron": 4}
A = np.array([[0.1, 0.2, -0.3], [0.4, -0.2, 0.1], [0.1, 0.5, 0.6]])  # velocity gradient [1/s]
COMPILER = (sysconfig.get_config_var("CC") or "cc").split()[0]
needs_compiler = pytest.mark.skipif(shutil.which(COMPILER) is None,
                                    reason="dolfinx compiles spaces and forms: it needs a C compiler")

TAKEN = """
import sys
import numpy as np
from mpi4py import MPI
from mpm_fenicsx import from_dolfinx
from mpm_fenicsx.grid import compat
from mpm_fenicsx.grid.distribution import ghosts
from dolfinx.mesh import (CellType, GhostMode, create_box, create_rectangle, locate_entities,
                          locate_entities_boundary, meshtags)
_, cell, given, path = sys.argv
given, comm = np.load(given), MPI.COMM_WORLD
vertices, cells = given["vertices"], given["cells"]
D, lots = vertices.shape[1], np.arange(comm.size + 1)
mine, part = (slice(*(lots[comm.rank:comm.rank + 2] * n // comm.size)) for n in (len(cells), len(vertices)))
owner = np.arange(len(cells)) * 7 % comm.size  # far from where they are given
owners = ghosts(cells, len(vertices), owner, comm.size, mine)
domain = compat.create_mesh(comm, cells[mine].astype(np.int64), vertices[part], cell, owners)
domain.topology.create_connectivity(D - 1, D)

def tags(dim, lots):
    found = np.concatenate(lots).astype(np.int32)
    values = np.repeat(np.array([3, 8], np.int32), [len(lot) for lot in lots])
    order = np.argsort(found)
    return meshtags(domain, dim, found[order], values[order])

soft = locate_entities(domain, D, lambda x: x[0] <= 1.0)
left, top = (locate_entities_boundary(domain, D - 1, lambda x: np.isclose(x[d], at))
             for d, at in ((0, 0), (1, 1.5)))
mesh = from_dolfinx(domain, tags(D, [soft]), tags(D - 1, [left, top]), {"soft": (D, 3), "top": (D - 1, 8)})
create = create_rectangle if D == 2 else create_box
made = [from_dolfinx(create(comm, [np.zeros(D), np.arange(1.0, D + 1)], [4, 3, 2][:D],
                            cell_type=getattr(CellType, cell), ghost_mode=mode))
        for mode in (GhostMode.none, GhostMode.shared_facet)]
if comm.rank == comm.size - 1:
    made = [(len(m.vertices), len(m.cells), len(m.boundary())) for m in made]
    np.savez(path, made=made,
             vertices=mesh.vertices, cells=mesh.cells, soft=mesh.groups["soft"],
             top=mesh.surfaces["top"], left=mesh.surfaces["3"])
"""

READ = """
import sys
import numpy as np
from mpm_fenicsx import MPM, Body, Mesh, Numerics, linear
import ufl
from dolfinx import fem
from dolfinx.io import XDMFFile
_, cell, points, given, path, far = sys.argv
given, far = np.load(given), float(far)
A, vertices = given["A"], given["vertices"] + far
D = len(A)
mesh = Mesh(vertices, given["cells"], cell)
body = Body(mesh, None, int(points), linear(1e3, 0.3), 2.0, velocity=lambda x: (x - far) @ A.T)
solid = MPM(mesh, body, numerics=Numerics(transfer="tpic"), outflow="hold")
mass, momentum = solid.comm.allreduce(solid.points.mass.sum()), solid.momentum()
solid.advance(1e-5)
fields = {name: solid.function(name) for name in ("mass", "density", "momentum", "velocity", "displacement",
                                                  "acceleration")}
dx = ufl.dx(degree=4)
total = lambda form: solid.comm.allreduce(fem.assemble_scalar(fem.form(form * dx)))
density, gradient = fields["density"], ufl.grad(fields["velocity"])
off = gradient - ufl.as_matrix(A.tolist())
found = [total(density), *(total(fields["momentum"][i]) for i in range(D))]
with XDMFFile(solid.comm, path + ".xdmf", "w") as file:
    file.write_mesh(density.function_space.mesh)
    for name in ("velocity", "mass"):
        file.write_function(fields[name], solid.time)
error, size = total(ufl.inner(off, off)), total(ufl.inner(gradient, gradient))
owned = fields["mass"].function_space.dofmap.index_map.size_local
nodal = solid.comm.allreduce(fields["mass"].x.array[:owned].sum())
beyond = fields["displacement"].x.array - 1e-5 * fields["velocity"].x.array
late = np.abs(beyond - 0.5e-10 * fields["acceleration"].x.array).max()
if solid.comm.rank == 0:
    np.savez(path, found=found, given=[mass, *momentum], error=error, size=size, nodal=nodal, late=late)
solid.close()
"""


@pytest.fixture
def mesh_file(tmp_path, any_cell, distorted):
    """A distorted mesh, and a file of it for other processes."""
    mesh = distorted(any_cell)
    np.savez(tmp_path / "given.npz", vertices=mesh.vertices, cells=mesh.cells, A=A[:mesh.dim, :mesh.dim])
    return mesh, tmp_path / "given.npz"


@pytest.mark.parametrize("ranks", [1, 2, 3])
def test_a_mesh_comes_back_as_it_was_made(tmp_path, mesh_file, on_ranks, ranks):
    """Vertices and cells in the order given on every rank, tags as groups and surfaces."""
    mesh, given = mesh_file
    done = on_ranks(ranks, TAKEN, mesh.cell, given, tmp_path / "taken.npz")
    assert done.returncode == 0, done.stderr
    got = np.load(tmp_path / "taken.npz")
    np.testing.assert_array_equal(got["vertices"], mesh.vertices)
    np.testing.assert_array_equal(got["cells"], mesh.cells)
    soft = (mesh.vertices[mesh.cells][..., 0] <= 1.0).all(axis=1)
    np.testing.assert_array_equal(np.sort(got["soft"]), np.flatnonzero(soft))
    boundary = mesh.boundary()
    assert (got["made"] == (len(mesh.vertices), len(mesh.cells), len(boundary))).all()
    for name, d, at in (("left", 0, 0.0), ("top", 1, 1.5)):
        expected = boundary[np.isclose(mesh.vertices[boundary][:, :, d], at).all(axis=1)]
        assert sorted(map(sorted, got[name].tolist())) == sorted(map(sorted, expected.tolist()))
    parts = Mesh(got["vertices"], got["cells"], mesh.cell, surfaces={"top": got["top"]})
    wall = Interface.of_mesh(parts, "top")
    assert normal_areas(wall.x, wall.elements).sum(axis=0)[1] == pytest.approx(2.0, rel=1e-14)


def test_a_mesh_of_dolfinx_is_grid_and_body():
    """A scene from one mesh and its tags: what it gives is what the same mesh as arrays gives."""
    from dolfinx.mesh import CellType, create_rectangle, locate_entities, locate_entities_boundary, meshtags

    domain = create_rectangle(MPI.COMM_SELF, [np.zeros(2), np.array([2.0, 1.0])], [8, 4],
                              CellType.quadrilateral)
    lower = locate_entities(domain, 2, lambda x: x[1] <= 0.5)
    floor = locate_entities_boundary(domain, 1, lambda x: x[1] == 0.0)
    mesh = from_dolfinx(domain, meshtags(domain, 2, np.sort(lower), 1),
                        meshtags(domain, 1, np.sort(floor), 5))
    assert mesh.box == Box((0.0, 0.0), (2.0, 1.0)) and len(mesh.part("1").cells) == 16
    ends = []
    for grid in (domain, mesh, Grid(mesh.box, (8, 4))):
        solid = MPM(grid, Body(mesh.part("1"), None, 2, linear(1e3, 0.3), 2.0),
                    [Support(mesh.on_surface("5"), "xy")], gravity=(0.0, -10.0))
        for _ in range(5):
            solid.advance(0.01)
        ends.append(solid.points.x[np.argsort(solid.points.gid)])
        solid.close()
    assert 1e-3 < np.abs(ends[0] - seed(Body(mesh.part("1"), None, 2, linear(1e3, 0.3), 2.0))[0]).max() < 0.1
    np.testing.assert_array_equal(ends[0], ends[1])
    np.testing.assert_allclose(ends[0], ends[2], atol=1e-9)


@needs_compiler
@pytest.mark.parametrize("ranks, far", [(1, 0.0), (2, 0.0), (2, 1e6)])
def test_fields_are_functions(tmp_path, mesh_file, on_ranks, ranks, far):
    """The integrals of density and momentum are those of the points, as the basis functions add up to one; a
    linear velocity has its gradient exactly; all of it is in the file, also far from zero."""
    mesh, given = mesh_file
    path, D = tmp_path / "fields", mesh.dim
    done = on_ranks(ranks, READ, mesh.cell, POINTS[mesh.cell], given, path, far)
    assert done.returncode == 0, done.stderr
    got, exact = np.load(f"{path}.npz"), 1e-12 if far == 0.0 else 1e-7
    scale = got["given"][0] * np.abs(A).max()
    np.testing.assert_allclose(got["found"], got["given"], rtol=exact, atol=exact * scale)
    assert got["nodal"] == pytest.approx(got["given"][0], rel=1e-13)
    assert got["late"] <= 1e-13 * 1e-5  # as the rule of the middle of the step has it
    assert got["error"] < exact**2 * got["size"] and got["size"] > 0.1
    with h5py.File(f"{path}.h5") as file:
        x, cells = file["Mesh/mesh/geometry"][:], file["Mesh/mesh/topology"][:]
        velocity, = file["Function/velocity"].values()
        place = np.lexsort(np.round((x[:, :D] - far).T, 6))
        expected = np.lexsort(np.round(mesh.vertices.T, 6))
        np.testing.assert_allclose(x[place, :D] - far, mesh.vertices[expected], atol=1e-9)
        np.testing.assert_allclose(velocity[:][place, :D], mesh.vertices[expected] @ A[:D, :D].T,
                                   atol=1e-12 if far == 0.0 else 1e-8)
        assert len(cells) == len(mesh.cells)
    with meshio.xdmf.TimeSeriesReader(f"{path}.xdmf") as reader:
        points, blocks = reader.read_points_cells()
        _, data, _ = reader.read_data(0)
    assert len(points) == len(mesh.vertices) and sum(len(block.data) for block in blocks) == len(mesh.cells)
    assert set(data) <= {"velocity", "mass"} and data


def test_shares_of_nodes_fill_the_cells(any_cell, distorted):
    """They add up to the volume, and with the places of the nodes to the first moment of the whole box."""
    mesh = distorted(any_cell)
    corner = mesh.vertices[mesh.cells]
    share = node_shares(corner)
    assert share.min() > 0 and share.sum() == pytest.approx(np.prod(mesh.box.size), rel=1e-14)
    moment = np.einsum("ma,mai->i", share, corner)
    np.testing.assert_allclose(moment, np.prod(mesh.box.size) * mesh.box.size / 2, rtol=1e-13)


@needs_compiler
def test_fields_of_bodies_that_push_are_put_together():
    """Two bodies with nodes of their own: mass of both, velocity by mass, nothing in empty cells."""
    bodies = [Body(Box((low, 0.0), (low + 1.0, 1.0)), (4, 4), 2, linear(1e3, 0.3), rho, velocity=(v, 0.0))
              for low, rho, v in ((1.0, 1.0, -0.1), (2.0, 3.0, 0.1))]
    solid = MPM(Grid(Box((0.0, -1.0), (4.0, 2.0)), (16, 12)), bodies)
    with pytest.raises(MPMError, match="no step has left a velocity on the grid: call advance first"):
        solid.function("velocity")
    solid.advance(1e-4)
    mass, velocity = solid.function("mass"), solid.function("velocity")
    x, vertices = mass.function_space.tabulate_dof_coordinates(), solid.background.whole[0]
    assert len(x) == len(vertices) and mass.x.array.sum() == pytest.approx(4.0, rel=1e-14)
    values = velocity.x.array.reshape(-1, 2)
    middle = np.isclose(x[:, 0], 2.0) & (x[:, 1] > -0.1) & (x[:, 1] < 1.1)
    np.testing.assert_allclose(values[middle, 0], 0.5 * 0.1, rtol=1e-9)  # (3 - 1) / (3 + 1) of it
    far = (x[:, 0] < 0.9) | (x[:, 1] > 1.1)
    assert (mass.x.array[far] == 0.0).all() and (values[far] == 0.0).all()
    with pytest.raises(ValueError, match="name of the field is 'speed': choose one of mass, density"):
        solid.function("speed")
    solid.close()


def test_what_is_no_mesh_for_the_scene_is_refused():
    from dolfinx.mesh import create_interval, create_unit_square, meshtags

    with pytest.raises(ValueError, match="the mesh is 3: give a dolfinx.mesh.Mesh"):
        from_dolfinx(3)
    with pytest.raises(ValueError, match="cells of kind interval and degree 1: give one with"):
        from_dolfinx(create_interval(MPI.COMM_SELF, 2, [0.0, 1.0]))
    square, one = create_unit_square(MPI.COMM_SELF, 2, 2), np.zeros(1, np.int32)
    with pytest.raises(ValueError, match="facet_tags is .*: give MeshTags of dimension 1"):
        from_dolfinx(square, facet_tags=meshtags(square, 2, one, one))
    with pytest.raises(ValueError, match="name 'soil' stands for the value 4 in cell_tags; they have 0"):
        from_dolfinx(square, meshtags(square, 2, one, one), names={"soil": (2, 4), "floor": (1, 2)})
    with pytest.raises(ValueError, match="give one; from_dolfinx makes a Mesh of dolfinx's"):
        Body(square, law=linear(E=1e6, nu=0.3), rho=1600.0, cells=None, points=1)


@needs_compiler
@pytest.mark.parametrize("ranks", [1, 2])
def test_the_example_of_the_docs_runs(tmp_path, monkeypatch, run_ranks, ranks):
    page = (Path(__file__).parents[2] / "docs/fenicsx.md").read_text(encoding="utf-8")
    code = page.split("```python\n")[1].split("```")[0]
    monkeypatch.chdir(tmp_path)
    step = "    solid.advance(0.001)"
    assert step in code
    code = code.replace(step, f"    before = solid.energy()['kinetic']\n{step}")
    code += "\nif solid.comm.rank == 0:\n    print(mass, energy / before)"
    done = run_ranks(ranks, "-c", code)
    assert done.returncode == 0, done.stderr
    total, ratio = map(float, done.stdout.split())
    assert total == pytest.approx(1500.0, rel=1e-13)
    assert 0.8 < ratio < 1.0  # averages over points and between nodes, in cells at the edge, lose some
    with h5py.File(tmp_path / "velocity.h5") as file:
        assert file["Mesh/mesh/geometry"].shape == (17 * 9, 2)
