"""Some of the spheres and clusters of a scene, when others have left it; neighbour lists among them."""
import numpy as np

from ..scene.tables import ClusterTable, SphereTable
from ..search.neighbours import NeighbourList


def select_spheres(table: SphereTable, stay: np.ndarray, stay_clusters: np.ndarray) -> SphereTable:
    """The rows that ``stay``, (n,) bool, for the spheres and for the clusters, which are numbered anew."""
    some = SphereTable(*(array[stay] for array in table))
    number = np.append(np.cumsum(stay_clusters) - 1, -1)  # the last for -1, no cluster
    return some._replace(cluster=number[some.cluster])


def select_clusters(table: ClusterTable, stay: np.ndarray, stay_clusters: np.ndarray) -> ClusterTable:
    """The same of clusters."""
    before = np.concatenate([[0], np.cumsum(stay)])
    singles, sizes = before[table.first[0]], np.diff(table.first)[stay_clusters]
    first = singles + np.cumsum(np.append(0, sizes))
    return ClusterTable(*(array[stay_clusters] for array in table[:-1]), first=first)


def select_neighbours(near: NeighbourList, stay: np.ndarray, among_spheres: bool) -> NeighbourList:
    """The list of the spheres that ``stay``, whose partners are spheres or not."""
    rows = np.repeat(np.arange(len(stay)), np.diff(near.start))
    keep = stay[rows] & (stay[near.partner] if among_spheres else True)
    partner = (np.cumsum(stay) - 1)[near.partner[keep]] if among_spheres else near.partner[keep]
    count = np.bincount(rows[keep], minlength=len(stay))[stay]
    history = keep if len(near.shear) else slice(0, 0)
    return NeighbourList(np.append(0, np.cumsum(count)), partner, near.active[history], near.shear[history])
