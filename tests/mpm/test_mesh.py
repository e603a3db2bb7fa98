"""Meshes: boundaries, parts, files with named groups, and what is refused in one sentence with value and
remedy."""
import meshio
import numpy as np
import pytest

from mpm_fenicsx import MPM, Body, Box, Cloud, Grid, Interface, Mesh, Support, linear, read_cloud, read_mesh
from mpm_fenicsx.points.points import seed
from mpm_fenicsx.points.surface import normal_areas
from mpm_fenicsx.scene.lattice import lattice

LAW = linear(1e3, 0.3)
MESHIO = {"quadrilateral": "quad", "triangle": "triangle", "hexahedron": "hexahedron", "tetrahedron": "tetra"}
FACET = {"quadrilateral": "line", "triangle": "line", "hexahedron": "quad", "tetrahedron": "triangle"}
AROUND = {"quadrilateral": [0, 1, 3, 2], "hexahedron": [0, 1, 3, 2, 4, 5, 7, 6]}
POINTS = {"quadrilateral": 2, "triangle": 3, "hexahedron": 2, "tetrahedron": 4}


def write(path, mesh, groups, surfaces):
    """A Gmsh file of ``mesh``: ``groups`` name → mask of cells, ``surfaces`` name → facets."""
    D, blocks, tags, names = mesh.dim, [], [], {}
    cells = mesh.cells[:, AROUND.get(mesh.cell, slice(None))]
    for number, (name, mask) in enumerate(groups.items(), 1):
        blocks.append((MESHIO[mesh.cell], cells[mask]))
        names[name] = np.array([number, D])
    # numbers of Gmsh's groups are per dimension
    for number, (name, facets) in enumerate(surfaces.items(), 1):
        blocks.append((FACET[mesh.cell], facets))
        names[name] = np.array([number, D - 1])
    tags = [np.full(len(data), n)
            for n, (_, data) in zip([*range(1, len(groups) + 1), *range(1, len(surfaces) + 1)], blocks)]
    x = np.column_stack([mesh.vertices, np.zeros((len(mesh.vertices), 3 - D))])
    meshio.write(path, meshio.Mesh(x, blocks, field_data=names, cell_data={"gmsh:physical": tags,
                                                                           "gmsh:geometrical": tags}),
                 "gmsh22", binary=False)
    return path


@pytest.fixture
def file(tmp_path, any_cell, distorted):
    """A mesh and its file: groups soft (x < 1 m) and hard, surfaces left and top."""
    mesh = distorted(any_cell)
    soft = mesh.vertices[mesh.cells].mean(axis=1)[:, 0] < 1.0
    boundary = mesh.boundary()
    left, top = ((mesh.vertices[boundary][:, :, d] == value).all(axis=1) for d, value in ((0, 0.0), (1, 1.5)))
    path = write(tmp_path / "body.msh", mesh, {"soft": soft, "hard": ~soft},
                 {"left": boundary[left], "top": boundary[top]})
    return mesh, path, soft


# ---------------------------------------------------------------- boundaries


def test_boundary_is_closed_with_the_outside_outside(any_cell, distorted):
    """Normal areas add up to nothing, and by the divergence theorem sum x . n A / D is the volume of the box.
    It is exact, as the vertices of the boundary stay on the box."""
    mesh = distorted(any_cell)
    interface = Interface.of_mesh(mesh)
    area = normal_areas(interface.x, interface.elements)
    middle = interface.x[interface.elements].mean(axis=1)
    np.testing.assert_allclose(area.sum(axis=0), 0.0, atol=1e-14)
    assert np.sum(area * middle) / mesh.dim == pytest.approx(np.prod(mesh.box.size), rel=1e-14)
    unit = area / np.linalg.norm(area, axis=1)[:, None]
    inside = middle - 1e-3 * unit
    assert ((inside > mesh.box.lower) & (inside < mesh.box.upper)).all()
    assert len(interface.x) == len(np.unique(mesh.boundary()))


def test_orientation_of_cells_does_not_matter(any_cell, distorted):
    """A mesh of mirrored cells (clockwise, left-handed) has the same boundary."""
    mesh = distorted(any_cell)
    swap = {"triangle": [1, 0, 2], "tetrahedron": [1, 0, 2, 3], "quadrilateral": [1, 0, 3, 2],
            "hexahedron": [1, 0, 3, 2, 5, 4, 7, 6]}[any_cell]
    turned = Mesh(mesh.vertices, mesh.cells[:, swap], any_cell)
    areas = [normal_areas(i.x, i.elements) for i in map(Interface.of_mesh, (mesh, turned))]
    for area in areas:
        assert area[:, 0][area[:, 0] > 0].sum() == pytest.approx(np.prod(mesh.box.size[1:]), rel=1e-14)
    assert Interface.of_mesh(turned).x.shape == Interface.of_mesh(mesh).x.shape


# ---------------------------------------------------------------- files


def test_groups_and_surfaces_survive_the_file(tmp_path, any_cell, distorted):
    mesh = distorted(any_cell)
    every = np.ones(len(mesh.cells), bool)
    boundary = mesh.boundary()
    top = boundary[(mesh.vertices[boundary][:, :, 1] == 1.5).all(axis=1)]
    got = read_mesh(write(tmp_path / "m.msh", mesh, {"all": every}, {"top": top}), mesh.dim)
    np.testing.assert_allclose(got.vertices, mesh.vertices, rtol=1e-15)
    np.testing.assert_array_equal(got.cells, mesh.cells)
    assert got.cell == any_cell and len(got.groups["all"]) == len(mesh.cells)
    np.testing.assert_array_equal(got.surfaces["top"], top)


FORMAT_41 = """$MeshFormat
4.1 0 8
$EndMeshFormat
$PhysicalNames
2
1 7 "floor"
2 7 "plate"
$EndPhysicalNames
$Entities
0 1 1 0
1 0 0 0 1 0 0 1 7 0
1 0 0 0 1 1 0 1 7 1 1
$EndEntities
$Nodes
1 4 1 4
2 1 0 4
1
2
3
4
0 0 0
1 0 0
1 1 0
0 1 0
$EndNodes
$Elements
2 2 1 2
1 1 1 1
1 1 2
2 1 3 1
2 1 2 3 4
$EndElements
"""


def test_gmsh_format_4_1(tmp_path):
    (tmp_path / "m.msh").write_text(FORMAT_41)
    mesh = read_mesh(tmp_path / "m.msh", 2)
    np.testing.assert_array_equal(mesh.cells, [[0, 1, 3, 2]])
    np.testing.assert_array_equal(mesh.groups["plate"], [0])
    np.testing.assert_array_equal(mesh.surfaces["floor"], [[0, 1]])


def test_a_named_surface_is_a_wall_and_a_support(file):
    mesh, path, _ = file
    got = read_mesh(path, mesh.dim)
    wall = Interface.of_mesh(got, "top")
    area = normal_areas(wall.x, wall.elements)
    assert (wall.x[:, 1] == 1.5).all()
    np.testing.assert_allclose(area.sum(axis=0)[:2], [0.0, np.prod(np.delete(mesh.box.size, 1))], atol=1e-14)
    np.testing.assert_array_equal(got.on_surface("left")(got.vertices), got.vertices[:, 0] == 0.0)


def test_a_group_is_a_body_of_its_own(file):
    """Volume, box and surfaces are those of the part."""
    mesh, path, soft = file
    got = read_mesh(path, mesh.dim)
    parts = [got.part(name) for name in ("soft", "hard")]
    volumes = [seed(Body(part, None, POINTS[mesh.cell], LAW, 1.0))[1].sum() for part in parts]
    assert sum(volumes) == pytest.approx(np.prod(mesh.box.size), rel=1e-14)
    assert [len(part.cells) for part in parts] == [soft.sum(), (~soft).sum()]
    assert parts[0].box.lower[0] == 0.0 and parts[0].box.upper[0] < 1.3 and parts[1].box.lower[0] > 0.7
    assert "left" in parts[0].surfaces and "left" not in parts[1].surfaces
    assert (parts[0].vertices[parts[0].surfaces["left"]][..., 0] == 0.0).all()


def test_a_scene_from_one_file(file):
    """Grid, two bodies and support from one file: under gravity the support carries the weight, in the
    end."""
    mesh, path, _ = file
    got, D = read_mesh(path, mesh.dim), mesh.dim
    bodies = [Body(got.part(name), None, POINTS[mesh.cell], linear(E, 0.2), 1.0)
              for name, E in (("soft", 1e3), ("hard", 1e5))]
    solid = MPM(got, bodies, [Support(got.on_surface("left"), "xyz"[:D])], gravity=(0.0, -1.0, 0.0)[:D])
    for _ in range(3):
        solid.advance(0.01)
    assert solid.momentum()[1] < 0 and solid.count == sum(len(part.points) for part in solid.bodies)
    left = solid.step.active_cells.fixed[:, 0]
    assert left.sum() == (got.vertices[:, 0] == 0.0).sum()
    solid.close()


def test_points_from_a_file(tmp_path):
    x, volume = np.random.default_rng(0).uniform(0.2, 0.8, (20, 3)), np.linspace(1.0, 2.0, 20)
    path = tmp_path / "points.vtk"
    meshio.write(path, meshio.Mesh(x, [("vertex", np.arange(20)[:, None])], point_data={"volume": volume}))
    cloud = read_cloud(path, 3)
    np.testing.assert_array_equal(cloud.x, x)
    np.testing.assert_array_equal(cloud.volume, volume)
    solid = MPM(Grid(Box((0, 0, 0), (1, 1, 1)), (2, 2, 2)), Body(cloud, None, None, LAW, 3.0,
                                                                 velocity=(0.0, 0.0, 1.0)))
    solid.advance(0.01)
    np.testing.assert_allclose(solid.momentum(), [0.0, 0.0, 3.0 * volume.sum()], rtol=1e-13, atol=1e-12)
    solid.close()


# ---------------------------------------------------------------- what is refused


def plain(path, blocks, x=None):
    x = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]],
                 float) if x is None else x
    meshio.write(path, meshio.Mesh(x, [(kind, np.array(data)) for kind, data in blocks]), "gmsh22",
                 binary=False)
    return path


QUAD, TRIANGLE, TETRA = ("quad", [[0, 1, 2, 3]]), ("triangle", [[0, 1, 2]]), ("tetra", [[0, 1, 2, 4]])


@pytest.mark.parametrize("dim, blocks, words",
                         [(3, [TRIANGLE], "holds triangle: for a 3D scene give a 3D " "mesh"),
                          (2, [TETRA, TRIANGLE], "holds tetra: for a 2D scene give a 2D mesh"),
                          (2, [("triangle", [[0, 1, 6]])], "is not plane, z goes from 0.0 to 1.0 m: for a 2D "
                           "scene"), (2, [QUAD, TRIANGLE], "holds cells of kind quad, triangle: a 2D mesh "
                                      "has one kind, quad or triangle"),
                          (3, [TETRA, ("wedge", [[0, 1, 2, 4, 5, 6]])], "cells of kind tetra, wedge: a 3D "
                           "mesh has one kind, hexahedron or tetra"), (3, [("pyramid", [[0, 1, 2, 3, 4]])],
                                                                       "holds cells of kind pyramid"),
                          (2, [("line", [[0, 1]])], "holds line: for a 2D scene give a 2D mesh"),
                          (3, [("tetra", [[0, 1, 2, 3]])],
                           r"cell 0 of the mesh at \[.*\] m is flat or inside out: repair"),])
def test_files_that_do_not_fit(tmp_path, dim, blocks, words):
    with pytest.raises(ValueError, match=words):
        read_mesh(plain(tmp_path / "m.msh", blocks), dim)


@pytest.mark.parametrize("name, text", [("missing.msh", None), ("empty.msh", ""),
                                        ("rubbish.msh", "hello\nworld\n"),
                                        ("cut.msh", "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n7\n1 0 0"),
                                        ("mesh.unknown", "1 2 3"), ("noise.vtk", "noise\n")])
def test_files_that_cannot_be_read(tmp_path, name, text, capfd):
    """In one sentence: what the reader prints is part of it, or nowhere."""
    if text is not None:
        (tmp_path / name).write_text(text)
    with pytest.raises(ValueError, match=f"{name} (cannot be read as a mesh|holds no cells).*give a|{name}: "
                       "this file does not exist"):
        read_mesh(tmp_path / name, 2)
    assert capfd.readouterr() == ("", "")


def test_groups_that_are_missing_are_named_with_those_that_exist(file):
    mesh, path, _ = file
    got = read_mesh(path, mesh.dim)
    with pytest.raises(ValueError, match="no group of cells 'sof'; it has hard, soft"):
        got.part("sof")
    for call in (got.on_surface, lambda name: Interface.of_mesh(got, name)):
        with pytest.raises(ValueError, match="no surface 'Top'; it has left, top"):
            call("Top")
    with pytest.raises(ValueError, match="no group of cells 'soft'; it has none"):
        mesh.part("soft")


def test_a_surface_inside_the_mesh_is_no_wall(any_cell):
    """The facets between the two halves belong to the boundary of each half alone."""
    D = 2 if any_cell in ("quadrilateral", "triangle") else 3
    vertices, cells = lattice(Box((0.0,) * D, (1.0,) * D), (2,) * D, any_cell)
    lower = vertices[cells].mean(axis=1)[:, -1] < 0.5
    half = Mesh(vertices, cells[lower], any_cell)
    between = half.boundary()
    between = between[(vertices[between][:, :, -1] == 0.5).all(axis=1)]
    mesh = Mesh(vertices, cells, any_cell, {"lower": np.flatnonzero(lower)}, {"middle": between})
    with pytest.raises(ValueError, match=f"{len(between)} of {len(between)} facets of the surface 'middle' "
                       "are not on the"):
        Interface.of_mesh(mesh, "middle")
    wall = Interface.of_mesh(mesh.part("lower"), "middle")
    assert normal_areas(wall.x, wall.elements).sum(axis=0)[-1] == pytest.approx(1.0, rel=1e-14)


SQUARE = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]


@pytest.mark.parametrize("vertices, cells, cell, words",
                         [(SQUARE, np.zeros((0, 4)), "quadrilateral", "the mesh has no cells: give at least "
                           "one"), (np.zeros((0, 2)), np.zeros((0, 4)), "quadrilateral",
                                    "the mesh has no cells"), (SQUARE, [[0, 1, 2, 4]], "quadrilateral",
                                                               "the quadrilateral cells of the mesh name "
                                                               "vertices 0..4, there are 4"),
                          (SQUARE, [[0, 1, 2]], "quadrilateral",
                           r"the quadrilateral cells of the mesh is .*: give numbers of shape \(n, 4\)"),
                          (SQUARE, [[0, 1, 3, 2]], "quadrilateral",
                           r"cell 0 of the mesh at \[0.5 0.5\] m is flat or inside out"),
                          ([*SQUARE[:3], [0.0, np.nan]], [[0, 1, 2, 3]], "quadrilateral",
                           r"vertices of the mesh \(entry 3, 1\) is nan m: give finite"),
                          (SQUARE, [[0, 1, 2]], "tetrahedron", "cell of the mesh is 'tetrahedron': choose "
                           "one of quadrilateral, triangle"), ([[0.0, 0.0], [1.0, 0.0], [0.5, 1e-15]],
                                                               [[0, 1, 2]], "triangle", "flat or inside out"),
                          ([*SQUARE, [0.7, 0.2]], [[0, 1, 2], [1, 2, 4]], "triangle",
                           "cell 0 of the mesh .* and cell 1 lie on the same side"),
                          ([*SQUARE, [0.7, 0.2]], [[0, 1, 2], [1, 2, 4], [1, 2, 3]], "triangle",
                           "not a manifold: 3 cells share the facet at"), (SQUARE, [[0, 1, 2], [2, 1, 0]],
                                                                           "triangle",
                                                                           "lie on the same side of their "
                                                                           "common facet: .* there twice"),])
def test_meshes_that_are_refused(vertices, cells, cell, words):
    with pytest.raises(ValueError, match=words):
        Mesh(vertices, cells, cell)


@pytest.mark.parametrize("cell", ["hexahedron", "quadrilateral"])
def test_cells_that_touch_in_an_edge_have_no_surface(cell):
    D = 2 if cell == "quadrilateral" else 3
    vertices, cells = lattice(Box((0.0,) * D, (1.0,) * D), (2,) * D, cell)
    mesh = Mesh(vertices, cells[[0, 3]], cell)  # across the diagonal
    with pytest.raises(ValueError, match="surface of the mesh is not a manifold: 4 facets meet at .* repair "
                       "the mesh"):
        mesh.boundary()


@pytest.mark.parametrize("call, words",
                         [(lambda: Cloud(np.zeros((0, 2)), np.zeros(0)), "the cloud has no points"),
                          (lambda: Cloud([[0.0, np.nan]], [1.0]),
                           r"positions of the cloud \(entry 0, 1\) is nan m: give finite"),
                          (lambda: Cloud([[0.0, 0.0]], [np.inf]),
                           r"volumes of the cloud \(entry 0\) is inf m\^3: give finite"),
                          (lambda: Cloud([[0.0, 0.0]], [1.0, 2.0]),
                           r"volumes of the cloud is .*: give numbers of shape \(1,\)"),
                          (lambda: Mesh(SQUARE, [[0, 1, 2, 3]], "quadrilateral", {"a": [1]}),
                           "group of cells 'a' of the mesh name cells 1..1, there are 1"),
                          (lambda: Mesh(SQUARE, [[0, 1, 2, 3]], "quadrilateral", {}, {"s": [[0, 9]]}),
                           "surface 's' of the mesh name vertices 0..9, there are 4"),])
def test_nonsense_is_refused(call, words):
    with pytest.raises(ValueError, match=words):
        call()


def block(D):
    return Body(Box((0.2,) * D, (0.8,) * D), (2,) * D, 2, LAW, 1.0)


@pytest.mark.parametrize("grid, body, more, words", [
    (3, 2, {}, "body 0 has 2 dimensions, the grid 3: give both the same"),
    (2, 3, {}, "body 0 has 3 dimensions, the grid 2"),
    (3, 3, dict(gravity=(0.0, -1.0)), r"gravity is \(0.0, -1.0\) m/s\^2: give 3 numbers"),
    (3, 3, dict(interface=Interface.line((0.3, 0.3), (0.5, 0.3), 2)), "the interface has 2 dimensions, the "
     "grid 3"),
    (2, 2, dict(supports=[Support(lambda x: x[:, 0] < 0, "z")]), "support fixes 'z', the scene has 2 "
     "dimensions"),
])
def test_two_and_three_dimensions_do_not_mix(grid, body, more, words):
    with pytest.raises(ValueError, match=words):
        MPM(Grid(Box((0.0,) * grid, (1.0,) * grid), (4,) * grid), block(body), **more)


def test_a_body_outside_a_mesh_but_inside_its_box():
    vertices, cells = lattice(Box((0.0, 0.0), (1.0, 1.0)), (4, 4), "triangle")
    mesh = Mesh(vertices, cells[vertices[cells].mean(axis=1).sum(axis=1) < 1.0], "triangle")
    with pytest.raises(ValueError, match=r"particle \d+ of the body lies at .* enlarge the grid"):
        MPM(mesh, block(2))
