"""Contacts that a scene starts with: frozen data, as `Scene.settled` leaves them."""
from typing import NamedTuple

import numpy as np


class ContactTable(NamedTuple):
    """Contacts of one kind, one row each; spheres and elements are numbered as in `tables`, from 0."""

    partners: np.ndarray  # two spheres, the smaller number first, or a sphere and an element, (n, 2)
    overlap: np.ndarray  # [m], (n,)
    springs: np.ndarray  # displacements of the first one: of friction, of rolling friction [m], (n, 6)


class Contacts(NamedTuple):
    """What touches what, how deep, and how far the springs of friction are displaced."""

    spheres: ContactTable  # with each other
    walls: ContactTable  # spheres with elements of the walls, those at rest first

    @property
    def total(self) -> int:
        """How many there are."""
        return len(self.spheres.overlap) + len(self.walls.overlap)

    def deepest(self, radius: np.ndarray) -> float:
        """Largest overlap, in radii of the (smaller) sphere; radius: of all spheres [m], (n,)."""
        between = self.spheres.overlap / radius[self.spheres.partners].min(axis=1)
        at_walls = self.walls.overlap / radius[self.walls.partners[:, 0]]
        return float(np.concatenate([between, at_walls]).max(initial=0.0))

    def renumbered(self, number: np.ndarray) -> "Contacts":
        """With the ``number``, (n,), of each sphere in the place of its own."""
        spheres, walls = self.spheres.partners, self.walls.partners
        return Contacts(self.spheres._replace(partners=number[spheres]), self.walls._replace(
            partners=np.column_stack([number[walls[:, 0]], walls[:, 1]])))


def contact_table(partners: np.ndarray, overlap: np.ndarray, springs: np.ndarray) -> ContactTable:
    """With three, six or no numbers in ``springs``, (n, …), of each contact; the others are zero."""
    all_springs = np.zeros((len(partners), 6))
    all_springs[:len(springs), :springs.shape[1]] = springs
    arrays = np.array(partners, np.int64).reshape(-1, 2), np.array(overlap, float), all_springs
    for array in arrays:
        array.flags.writeable = False
    return ContactTable(*arrays)
