"""The bodies of a scene at its start."""
import warnings

import numpy as np


class Start:
    """The bodies at the start as functions of places x [m], shape (n, D), as of boundary particles: a place
    belongs to the body with the nearest material point. thickness: of a plane scene [m], 1 in space. To be
    made of ``bodies``, terms that still have all their points."""

    def __init__(self, bodies, gravity, body_force):
        self._bodies, self._gravity, self._body_force = bodies, gravity, body_force
        self.thickness = bodies[0].thickness
        if len(bodies) > 1:
            from scipy.spatial import cKDTree  # takes time to import, and few scenes need it

            self._tree = cKDTree(np.concatenate([term.points.x for term in bodies]))
            self._owner = np.repeat(np.arange(len(bodies)), [len(term.points) for term in bodies])

    @property
    def pull(self):
        """Size of gravity [m/s^2]."""
        return float(np.linalg.norm(self._gravity))

    def field(self, x):
        """What points at places x have besides, where there are several fields: the ``field`` of each."""
        fields = np.array([term.field for term in self._bodies])
        return {"field": fields[self.body(x)]} if fields.any() else {}

    def by_field(self):
        """The bodies of each field apart, a list."""
        apart = [[term for term in self._bodies if term.field == n]
                 for n in range(max(term.field for term in self._bodies) + 1)]
        if len(apart) == 1:
            return [self]
        return [Start(terms, self._gravity, self._body_force) for terms in apart]

    @property
    def only_field(self):
        """Number of the field in which all of them are."""
        return self._bodies[0].field

    def body(self, x):
        """Number of the body of each place, shape (n,)."""
        if len(self._bodies) == 1 or not len(x):
            return np.zeros(len(x), int)
        return self._owner[self._tree.query(x)[1]]

    def velocity(self, x):
        """[m/s], shape (n, D)."""
        v, body = np.zeros(x.shape), self.body(x)
        for number, term in enumerate(self._bodies):
            v[body == number] = term.velocity_at(x[body == number])
        return v

    def acceleration(self, x):
        """Of an unstressed body [m/s^2], shape (n, D)."""
        return self._gravity + (np.zeros(x.shape) if self._body_force is None else self._body_force(x, 0.0))

    def modulus(self, x, of_law):
        """``of_law(law, dim)`` of the law at each place, shape (n,)."""
        values = np.array([of_law(term.body.law, term.body.dim) for term in self._bodies])
        return values[self.body(x)]


def warn_if_in_pieces(bodies, background):
    """One warning for each body whose points are too far apart for the grid to hold it together.
    Collective."""
    for n, term in enumerate(bodies):
        groups = background.groups(np.unique(term.points.cell))
        if groups > 1:
            warnings.warn(f"the material points of body {n + 1} lie in {groups} groups of cells without "
                          "common nodes, and nothing holds these together: seed more points, or take a "
                          "coarser grid", stacklevel=3)
