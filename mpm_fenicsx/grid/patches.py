"""Patches of simplices over which F-bar averages the volume change.

The basis on a simplex is linear, so its volume change is one number already and the mean must go over several
cells: the F-bar-Patch method (de Souza Neto, Andrade Pires & Owen 2005, doi 10.1002/nme.1187; its mesh falls
into patches that do not overlap). A patch here is what lies around one inner edge: two triangles or, in
space, the ring of tetrahedra. That leaves about one volume change per node, as quadrilaterals and hexahedra
with F-bar have. Edges are taken from the longest to the shortest where all their cells are free, then each
cell left over joins the smallest patch next to it. On a lattice these are the squares and the cubes, since
their diagonals are longest.
"""
from itertools import combinations

import numpy as np

from ..compiled import compiled
from ..scene.bodies import Grid
from ..scene.lattice import cell_count

FREE = -1


def patches(grid, vertices, cells):
    """Number of the patch of each cell of the whole grid, shape (m,); None for quadrilaterals and hexahedra,
    each its own patch. The same on every rank. grid: ``Grid`` or ``Mesh``; vertices [m], shape (n, D); cells,
    shape (m, D + 1)."""
    D = vertices.shape[1]
    if cells.shape[1] != D + 1:
        return None
    if isinstance(grid, Grid):  # the simplices of a box cell are numbered one after the other
        return np.arange(len(cells)) // cell_count((1,) * D, grid.cell)
    facet, behind = _neighbours(cells)
    first, of_edge = _rings(vertices, cells, facet[behind < 0])
    patch = np.full(len(cells), FREE)
    _take_rings(first, of_edge, patch)
    _join(behind.reshape(len(cells), -1), patch)
    return patch


def _alike(rows):
    """Numbers that equal rows (their entries in any order) share, shape (n,)."""
    return np.unique(np.sort(rows, axis=1), axis=0, return_inverse=True)[1].ravel()


def _neighbours(cells):
    """Vertices of the facets of all cells, shape (m (D + 1), D), and the cell behind each or FREE."""
    K = cells.shape[1]
    facets = cells[:, list(combinations(range(K), K - 1))].reshape(-1, K - 1)
    number = _alike(facets)
    order = np.argsort(number, kind="stable")
    same = np.flatnonzero(number[order[1:]] == number[order[:-1]])
    behind = np.full(len(facets), FREE)
    behind[order[same]], behind[order[same + 1]] = order[same + 1] // K, order[same] // K
    return facets, behind


def _rings(vertices, cells, boundary):
    """Cells around each inner edge, longest edge first: where each ring begins and ends, shape (rings + 1,),
    and the cells of all. boundary: vertices of the facets on the boundary, shape (k, D)."""
    pairs = list(combinations(range(cells.shape[1]), 2))
    outer = boundary[:, list(combinations(range(boundary.shape[1]), 2))].reshape(-1, 2)
    edges = cells[:, pairs].reshape(-1, 2)
    number = _alike(np.concatenate([edges, outer]))
    inner = np.setdiff1d(number[:len(edges)], number[len(edges):])
    length = np.zeros(number.max() + 1)
    length[number[:len(edges)]] = np.linalg.norm(np.subtract(*vertices[edges].swapaxes(0, 1)), axis=1)
    rank = np.full(len(length), len(length))
    rank[inner[np.lexsort((inner, -np.round(length[inner] / length.max(), 9)))]] = np.arange(len(inner))
    order = np.argsort(rank[number[:len(edges)]], kind="stable")
    first = np.searchsorted(rank[number[:len(edges)]][order], np.arange(len(inner) + 1))
    return first, order // len(pairs)


@compiled
def _take_rings(first, of_edge, patch):
    """A patch from every ring of cells that are all free; fills ``patch``."""
    count = 0
    for e in range(len(first) - 1):
        free = True
        for k in range(first[e], first[e + 1]):
            free = free and patch[of_edge[k]] == FREE
        if free:
            for k in range(first[e], first[e + 1]):
                patch[of_edge[k]] = count
            count += 1


@compiled
def _join(behind, patch):
    """Every free cell joins the smallest patch behind one of its facets, or becomes one where there is none.
    behind: cell behind each facet, shape (m, D + 1)."""
    size = np.zeros(len(patch) + 1, np.int64)
    for c in range(len(patch)):
        size[patch[c]] += 1  # the free ones count in the last place, which is nobody's
    count = patch.max() + 1
    left = np.flatnonzero(patch == FREE)
    while len(left):
        for c in left:
            best = FREE
            for b in behind[c]:
                if b >= 0 and patch[b] != FREE and (best == FREE or size[patch[b]] < size[best]):
                    best = patch[b]
            if best != FREE:
                patch[c] = best
                size[best] += 1
        still = left[patch[left] == FREE]
        if len(still) == len(left):
            patch[still[0]] = count
            size[count] = 1
            count += 1
        left = still
