"""Some of the spheres and clusters of a scene, when others have left it; lists of near partners among them."""
import numpy as np

from .near import Near
from .parts import Grains, Rigid


def of_grains(grains, stay, stay_bodies):
    """`parts.Grains` of the spheres and clusters that ``stay``, (n,) bool each; the clusters are numbered anew."""
    some = Grains(*(array[stay] for array in grains))
    number = np.append(np.cumsum(stay_bodies) - 1, -1)  # the last for -1, no cluster
    return some._replace(body=number[some.body])


def of_rigid(rigid, stay, stay_bodies):
    """`parts.Rigid` of the same."""
    some = Rigid(*(array[stay_bodies] for array in rigid[:-1]), first=None)
    before = np.concatenate([[0], np.cumsum(stay)])
    singles, sizes = before[rigid.first[0]], np.diff(rigid.first)[stay_bodies]
    return some._replace(first=singles + np.cumsum(np.append(0, sizes)))


def of_near(near, stay, among_spheres):
    """The lists `near.Near` of the spheres that ``stay``, whose partners are spheres or not."""
    rows = np.repeat(np.arange(len(stay)), np.diff(near.start))
    keep = stay[rows] & (stay[near.partner] if among_spheres else True)
    partner = (np.cumsum(stay) - 1)[near.partner[keep]] if among_spheres else near.partner[keep]
    count = np.bincount(rows[keep], minlength=len(stay))[stay]
    history = keep if len(near.shear) else slice(0, 0)
    return Near(np.append(0, np.cumsum(count)), partner, near.active[history], near.shear[history])
