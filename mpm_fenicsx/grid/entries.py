"""Which entries the matrix of the active cells has, and where those of an element lie among them.

Nodes couple with all that share an element with them, in all directions, or thinly: each direction with
itself alone, as across the facets of the ghost penalty. Rows are those of one node after the other, each of
its directions; rows and columns of supported directions stay out, as their displacement is known.
"""
from typing import NamedTuple

import numpy as np

from ..compiled import called, compiled, inlined, prefetch


class Rows(NamedTuple):
    """This rank's share in the matrix, for kernels: ``values`` [N/m], row by row; ``first`` (nodes, D), where
    in them the row of a node and direction begins, -1: it stays out; ``within`` (nodes, D), place of a
    direction among those of a node with columns, -1: it stays out; ``block`` (elements, K, K), how far from
    the beginning of the row of an element's node the columns of another one begin."""

    values: np.ndarray
    first: np.ndarray
    within: np.ndarray
    block: np.ndarray


class Neighbours(NamedTuple):
    """Of each node those it couples with: of node e ``count[e]`` of the ``key``, sorted, from ``start[e]``
    on: 2 b for node b in all directions, 2 b + 1 for it thinly. ``ahead``: columns of the row before its
    own."""

    start: np.ndarray
    count: np.ndarray
    key: np.ndarray
    ahead: np.ndarray


class Group(NamedTuple):
    """m matrices that couple nodes ``rows`` (m, R) with nodes ``columns`` (m, C), -1: none, thinly or not."""

    rows: np.ndarray
    columns: np.ndarray
    thin: bool = False


@compiled
def make_room(rows, columns, most):
    """Add to ``most`` (nodes,) how many neighbours a group may bring."""
    for m in range(len(rows)):
        for e in range(rows.shape[1]):
            if rows[m, e] >= 0:
                most[rows[m, e]] += columns.shape[1]


@inlined
def insert(key, first, count, new):
    """Insert ``new`` among the ``count`` sorted ones from ``first`` on; returns how many there are then."""
    place = first + count
    while place > first and key[place - 1] > new:
        place -= 1
    if place > first and key[place - 1] == new:
        return count
    for k in range(first + count, place, -1):
        key[k] = key[k - 1]
    key[place] = new
    return count + 1


@compiled
def collect(rows, columns, thin, neighbours: Neighbours):
    """Add the pairs of a group to the neighbours."""
    start, count, key, _ = neighbours
    for m in range(len(rows)):
        for e in range(rows.shape[1]):
            node = rows[m, e]
            if node >= 0:
                for b in range(columns.shape[1]):
                    if columns[m, b] >= 0:
                        new = 2 * columns[m, b] + (1 if thin else 0)
                        count[node] = insert(key, start[node], count[node], new)


@compiled
def look_ahead(neighbours: Neighbours, width, length):
    """Drop thin neighbours that are whole ones as well; fill ``ahead`` and the ``length`` of the rows of each
    node, (nodes,). width (nodes,): columns of a node."""
    start, count, key, ahead = neighbours
    for node in range(len(start)):
        kept = 0
        length[node] = 0
        for k in range(start[node], start[node] + count[node]):
            last = start[node] + kept - 1
            if not (kept > 0 and key[k] == key[last] + 1 and key[k] % 2 == 1):
                key[last + 1] = key[k]
                ahead[last + 1] = length[node]
                length[node] += 1 if key[k] % 2 == 1 else width[key[k] // 2]
                kept += 1
        count[node] = kept


@compiled
def fill_columns(neighbours: Neighbours, first, within, unknown, columns):
    """Fill ``columns``, of all entries, by ``unknown`` (nodes, D), the number of a node and direction."""
    start, count, key, _ = neighbours
    D = first.shape[1]
    for node in range(len(first)):
        for i in range(D):
            at = first[node, i]
            if at < 0:
                continue
            for k in range(start[node], start[node] + count[node]):
                other = key[k] // 2
                if key[k] % 2 == 1:
                    columns[at] = unknown[other, i]
                    at += 1
                else:
                    for j in range(D):
                        if within[other, j] >= 0:
                            columns[at] = unknown[other, j]
                            at += 1


@inlined
def find(neighbours, node, other):
    """Place of the neighbour ``other`` of a node, thin or not."""
    start, count, key, _ = neighbours
    low, high = start[node], start[node] + count[node]
    while low < high:
        middle = (low + high) // 2
        if key[middle] < 2 * other:
            low = middle + 1
        else:
            high = middle
    return low


@compiled
def find_blocks(rows, columns, neighbours: Neighbours, block):
    """Fill ``block`` (m, R, C) of a group, see ``Rows``."""
    for m in range(len(rows)):
        for e in range(rows.shape[1]):
            for b in range(columns.shape[1]):
                block[m, e, b] = 0
                if rows[m, e] >= 0 and columns[m, b] >= 0:
                    block[m, e, b] = neighbours.ahead[find(neighbours, rows[m, e], columns[m, b])]


@compiled
def find_thin(nodes, neighbours: Neighbours, first, within, places):
    """Fill ``places`` (m, D, M, M) of thin matrices, by direction, node and node; -1: it stays out."""
    for m in range(len(nodes)):
        for e in range(nodes.shape[1]):
            for b in range(nodes.shape[1]):
                node, other = nodes[m, e], nodes[m, b]
                at = find(neighbours, node, other)
                for i in range(first.shape[1]):
                    there = first[node, i] >= 0 and within[other, i] >= 0
                    aside = within[other, i] if neighbours.key[at] % 2 == 0 else 0
                    places[m, i, e, b] = first[node, i] + neighbours.ahead[at] + aside if there else -1


@inlined
def fetch_element(m, nodes, rows, block, K, D):
    """Have the entries of an element come from memory, to which its matrix is added later; see
    ``add_element``."""
    values, first, _, _ = rows
    for e in range(K):
        node = nodes[m, e]
        for i in range(D):
            if node >= 0 and first[node, i] >= 0:
                for b in range(K):
                    prefetch(values, first[node, i] + block[e, b])


@called
def add_element(E, m, nodes, rows, block, K, D):
    """Add the element matrix E (K, D, D, K), see ``weakform.tangent``, with the nodes of row m of ``nodes``
    (…, K) to ``rows``; block (K, K): of the element, see ``Rows``."""
    values, first, within, _ = rows
    flat, whole = E.reshape(K * D * D * K), True
    for e in range(K):
        node = nodes[m, e]
        for i in range(D):
            whole &= node >= 0 and within[node, i] == i
    if whole:  # nothing stays out: no questions, and indices without a sign, which cannot count from the end
        for e in range(K):
            for i in range(D):
                start, entry = np.uint64(first[nodes[m, e], i]), np.uint64(i * K + e)
                for b in range(K):
                    at = start + np.uint64(block[e, b])
                    for k in range(D):
                        values[at + np.uint64(k)] += flat[entry + np.uint64((b * D + k) * D * K)]
        return
    for e in range(K):
        node = nodes[m, e]
        for i in range(D):
            if node >= 0 and first[node, i] >= 0:
                for b in range(K):
                    other, at = nodes[m, b], first[node, i] + block[e, b]
                    for k in range(D):
                        if other >= 0 and within[other, k] >= 0:
                            values[at + within[other, k]] += E[b, k, i, e]


@compiled
def add_elements(matrices, nodes, rows: Rows):
    """Add the ``matrices`` (m, K, D, D, K) of elements with ``nodes`` (m, K) to the ``rows``, whose
    ``block`` is theirs."""
    for m in range(len(matrices)):
        add_element(matrices[m], m, nodes, rows, rows.block[m], nodes.shape[1], rows.first.shape[1])


@compiled
def add_stencils(stencils, around, rows: Rows):
    """Add to the ``rows``, whose ``block`` is theirs, what the rows of nodes have as blocks (n, 5^D, D, D) of
    the nodes ``around`` (n, 5^D), see ``active_cells``."""
    values, first, within, block = rows
    D = first.shape[1]
    for node in range(len(around)):
        for b in range(around.shape[1]):
            other = around[node, b]
            for i in range(D):
                for k in range(D):
                    if other >= 0 and first[node, i] >= 0 and within[other, k] >= 0:
                        at = first[node, i] + block[node, 0, b] + within[other, k]
                        values[at] += stencils[node, b, i, k]


@compiled
def add_at(places, added, values):
    """Add numbers at their ``places``, (n,) both, where there is one."""
    for n in range(len(places)):
        if places[n] >= 0:
            values[places[n]] += added[n]
