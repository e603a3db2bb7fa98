"""Patches of simplices for F-bar: squares and cubes of a lattice, rings around edges elsewhere, and never
cut."""
import numpy as np
import pytest

from mpm_fenicsx import Box, Grid, Mesh
from mpm_fenicsx.grid.distribution import bisect
from mpm_fenicsx.grid.patches import patches
from mpm_fenicsx.scene.lattice import lattice

SIMPLICES = {"triangle": (4, 3), "tetrahedron": (4, 3, 2)}


def groups(patch):
    """The sets of cells of the patches."""
    return {tuple(np.flatnonzero(patch == number)) for number in np.unique(patch)}


@pytest.mark.parametrize("cell", sorted(SIMPLICES))
def test_a_lattice_falls_into_its_boxes_by_both_rules(cell):
    counts = SIMPLICES[cell]
    box = Box((0.0,) * len(counts), (2.0, 1.0, 0.9)[:len(counts)])
    vertices, cells = lattice(box, counts, cell)
    by_number = patches(Grid(box, counts, cell), vertices, cells)
    by_edges = patches(Mesh(vertices, cells, cell), vertices, cells)
    assert len(groups(by_number)) == np.prod(counts) and groups(by_number) == groups(by_edges)


@pytest.mark.parametrize("cell", sorted(SIMPLICES))
def test_patches_of_a_mesh_hang_together_and_are_of_like_size(cell, distorted):
    """Around an edge lie two triangles, or about five tetrahedra; cells left over join."""
    mesh = distorted(cell, tuple(2 * n for n in SIMPLICES[cell]), by=0.3)
    patch = patches(mesh, mesh.vertices, mesh.cells)
    size = np.bincount(patch)
    assert size.min() >= 2 and size.max() <= (4 if cell == "triangle"
                                              else 14) and size.sum() == len(mesh.cells)
    for members in groups(patch):
        joined, rest = {members[0]}, set(members[1:])
        while rest:
            beside = {c for c in rest if any(len(np.intersect1d(mesh.cells[c], mesh.cells[d]))
                                             == mesh.cells.shape[1] - 1 for d in joined)}
            assert beside
            joined, rest = joined | beside, rest - beside


def test_cells_without_inner_edge_are_one_patch():
    mesh = Mesh(np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]), np.array([[0, 1, 2]]), "triangle")
    assert patches(mesh, mesh.vertices, mesh.cells).tolist() == [0]


def test_quadrilaterals_need_no_patches():
    grid = Grid(Box((0.0, 0.0), (1.0, 1.0)), (2, 2))
    assert patches(grid, *lattice(grid.box, grid.cells, "quadrilateral")) is None


@pytest.mark.parametrize("ranks", [2, 3, 5])
def test_no_patch_is_cut(ranks, distorted):
    mesh = distorted("triangle", (9, 7))
    patch, centres = patches(mesh, mesh.vertices, mesh.cells), mesh.vertices[mesh.cells].mean(axis=1)
    weights = np.random.default_rng(0).uniform(0.1, 1.0, len(centres))
    owner = bisect(centres, weights, ranks, patch)
    assert all(len(np.unique(owner[list(members)])) == 1 for members in groups(patch))
    share = np.bincount(owner, weights, minlength=ranks) / weights.sum()
    assert share.max() < 1.3 / ranks
