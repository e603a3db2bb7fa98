"""The bodies of a scene at its start."""
import warnings

import numpy as np
from mpi4py import MPI

import mpm_dem_store as store

from ..collective import Part, together, total
from ..points.points import numbers

LEVEL = 1e-9  # of a distance: two that differ by less are one
LAST = np.iinfo(np.int64).max


class Start:
    """The bodies at the start as functions of places x [m], shape (n, D), as of boundary particles, alike on
    every rank: a place belongs to the body with the nearest material point, of bodies as near to the first.
    thickness: of a plane scene [m], 1 in space. To be made of ``bodies``, terms that have all their points
    among the ranks of ``comm``. Collective."""

    def __init__(self, bodies, gravity, body_force, comm):
        self._bodies, self._gravity, self._body_force, self._comm = bodies, gravity, body_force, comm
        self.thickness = bodies[0].thickness
        if len(bodies) > 1:
            from scipy.spatial import cKDTree  # takes time to import, and few scenes need it

            self._trees = [cKDTree(term.points.x) for term in bodies]

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
        return [self] if len(apart) == 1 else [self._with(terms) for terms in apart]

    def of(self, term):
        """The same of one body alone, for places that may differ from rank to rank."""
        return self._with([term])

    def _with(self, terms):
        return Start(terms, self._gravity, self._body_force, self._comm)

    @property
    def only_field(self):
        """Number of the field in which all of them are."""
        return self._bodies[0].field

    def body(self, x):
        """Number of the body of each place, shape (n,)."""
        if len(self._bodies) == 1 or not len(x):
            return np.zeros(len(x), int)
        distance = np.array([tree.query(x)[0] for tree in self._trees])
        if self._comm.size > 1:
            self._comm.Allreduce(MPI.IN_PLACE, distance, MPI.MIN)
        return np.argmax(distance <= (1.0 + LEVEL) * distance.min(axis=0), axis=0)

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


def start_from_checkpoints(bodies, origin, comm):
    """Give the points of ``bodies``, terms at the start, the state that their ``start`` names, see
    ``FromCheckpoint``; origin: of their coordinates [m]. Collective. ValueError for one that does not fit."""
    for number, term in enumerate(bodies):
        start = term.body.start
        if start is not None:
            _take_state(term, *_read_points(start, f"body {number}", comm), origin, comm)


def _read_points(start, who, comm):
    """Fields of some of the points of a body in a checkpoint, name → array, the origin of their coordinates
    [m], and a name for it."""
    if store.read_head(start.file, comm).get("kind") not in ("MPM", "run"):
        raise ValueError(f"{who} starts from {start.file}, which is of something else: give a checkpoint of "
                         "an MPM or of a run")
    tree = store.read(start.file, comm)
    tree = tree.get("solid", tree)
    found = {name for name in tree["points"] if name.startswith("points")}
    name = f"points{start.body or ''}"
    if name not in found:
        raise ValueError(f"{who} starts with body {start.body} of {start.file}, which has {len(found)}: give "
                         f"a number from 0 to {len(found) - 1}")
    if "origin" not in tree:
        raise ValueError(f"{start.file} is a checkpoint of an older version: write it anew")
    what = f"{who} starts with body {start.body} of {start.file}"
    return tree["points"][name].fields, tree["origin"], what


def _take_state(term, found, there, what, origin, comm):
    """Fields of ``found``, with the origin ``there``, become those of the points of ``term``."""
    p, law, start = term.points, term.body.law, term.body.start
    found = _in_order(term, found, what, comm)
    together(comm, lambda: _check_fits(term, found, what))
    if start.places:
        p.x[:] = found["x"] + (there - origin)
    p.F[:], p.F33[:], p.a[:] = found["F"], found["F33"], 0.0
    for part in law.state.names:
        p.state[part] = found[f"state.{part}"]
    if start.velocities:
        for name in {"v", "a", "C"} & set(p.names) & set(found):
            getattr(p, name)[:] = found[name]
        term.velocity_at = _nearest(p.x.copy(), p.v.copy(), comm)


def _in_order(term, found, what, comm):
    """The fields of the points that ``term`` has on this rank, in their order, from those of all ranks."""
    dim, count = found["x"].shape[1], int(total(comm, len(found["gid"])))
    if dim != term.body.dim:
        raise ValueError(f"{what}, which has {dim} dimensions, and has {term.body.dim}: give a checkpoint of "
                         "as many")
    first = comm.allreduce(int(found["gid"].min(initial=LAST)), MPI.MIN)
    last = comm.allreduce(int(found["gid"].max(initial=-1)), MPI.MAX)
    if count != term.total or last - first + 1 != count:
        raise ValueError(f"{what}, which has {count} points, and has {term.total}: state the body as it was "
                         "stated there; points that have left or come in cannot be taken over")
    number, ends = found["gid"] - first, [numbers(term.body, Part(rank, comm.size))[1].stop
                                          for rank in range(comm.size)]
    rank = np.searchsorted(ends, number, side="right")
    parts = comm.alltoall([{name: values[rank == r] for name, values in found.items()}
                           for r in range(comm.size)])
    mine = {name: np.concatenate([part[name] for part in parts]) for name in sorted(found)}
    order = np.argsort(mine["gid"])
    return {name: values[order] for name, values in mine.items()}


def _nearest(x, v, comm):
    """The function from places, alike on all ranks, to the velocities v [m/s] of the nearest of all points x
    [m], of which each rank has some. Collective."""
    from scipy.spatial import cKDTree

    tree = cKDTree(x)

    def velocity(at):
        if not len(at):
            return np.zeros(np.shape(at))
        distance, number = tree.query(at)
        if comm.size == 1:
            return v[number]
        everybody = np.array(comm.allgather(distance))
        mine = np.argmin(everybody, axis=0) == comm.rank
        found = np.zeros(np.shape(at))
        found[mine] = v[number[mine]]
        return total(comm, found)

    return velocity


def _check_fits(term, found, what):
    """ValueError where the points of ``term`` do not go with the ``found`` ones."""
    p, law = term.points, term.body.law
    same = np.isclose(found["V0"], p.V0, rtol=1e-9, atol=0.0)
    if not same.all():
        n = int(np.argmin(same))
        raise ValueError(f"{what}, where point {p.gid[n] - term.first} has a volume of "
                         f"{found['V0'][n]:.6g} m^3, here {p.V0[n]:.6g}: state the body as it was stated "
                         "there")
    kept = {name[6:] for name in found if name.startswith("state.")}
    if kept != set(law.state.names) or any(
            found[f"state.{name}"].shape[1:] != law.state[name].shape for name in law.state.names):
        raise ValueError(f"{what}, whose points remember {', '.join(sorted(kept))}, but its law {law.name} "
                         f"remembers {', '.join(law.state.names)}: give it a law like that of the checkpoint")
