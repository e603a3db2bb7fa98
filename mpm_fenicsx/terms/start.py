"""The bodies of a scene at its start."""
import warnings

import numpy as np

import mpm_dem_store as store


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


def start_from_checkpoints(bodies, origin, comm):
    """Give the points of ``bodies``, terms that still have all their points, the state that their ``start``
    names, see ``FromCheckpoint``; origin: of their coordinates [m]. Collective. ValueError for one that does
    not fit."""
    for number, term in enumerate(bodies):
        start = term.body.start
        if start is not None:
            _take_state(term, start, *_read_points(start, f"body {number}", comm), origin)


def _read_points(start, who, comm):
    """Fields of all points of a body in a checkpoint in the order of their numbers, name → array, and the
    origin of their coordinates [m]."""
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
    rows = tree["points"][name].fields
    return {key: np.concatenate(comm.allgather(rows[key])) for key in sorted(rows)}, tree["origin"], who


def _take_state(term, start, found, there, who, origin):
    """Fields of ``found``, with the origin ``there``, become those of the points of ``term``."""
    p, law = term.points, term.body.law
    _check_fits(p, law, found, f"{who} starts with body {start.body} of {start.file}")
    order = np.argsort(found["gid"])
    if start.places:
        p.x[:] = found["x"][order] + (there - origin)
    p.F[:], p.F33[:], p.a[:] = found["F"][order], found["F33"][order], 0.0
    for part in law.state.names:
        p.state[part] = found[f"state.{part}"][order]
    if start.velocities:
        for name in {"v", "a", "C"} & set(p.names) & set(found):
            getattr(p, name)[:] = found[name][order]
        term.velocity_at = _nearest(p.x.copy(), p.v.copy())


def _nearest(x, v):
    """The function from places to the velocities v [m/s] of the nearest of the points x [m]."""
    from scipy.spatial import cKDTree

    tree = cKDTree(x)
    return lambda at: v[tree.query(at)[1]] if len(at) else np.zeros(np.shape(at))


def _check_fits(p, law, found, what):
    """ValueError where the points p do not go with the ``found`` ones."""
    if found["x"].shape[1] != p.x.shape[1]:
        raise ValueError(f"{what}, which has {found['x'].shape[1]} dimensions, and has {p.x.shape[1]}: give "
                         "a checkpoint of as many")
    if len(found["gid"]) != len(p):
        raise ValueError(f"{what}, which has {len(found['gid'])} points, and has {len(p)}: state the body as "
                         "it was stated there; points that have left or come in cannot be taken over")
    volume = found["V0"][np.argsort(found["gid"])]
    same = np.isclose(volume, p.V0, rtol=1e-9, atol=0.0)
    if not same.all():
        n = int(np.argmin(same))
        raise ValueError(f"{what}, where point {n} has a volume of {volume[n]:.6g} m^3, here {p.V0[n]:.6g}: "
                         "state the body as it was stated there")
    kept = {name[6:] for name in found if name.startswith("state.")}
    if kept != set(law.state.names) or any(
            found[f"state.{name}"].shape[1:] != law.state[name].shape for name in law.state.names):
        raise ValueError(f"{what}, whose points remember {', '.join(sorted(kept))}, but its law {law.name} "
                         f"remembers {', '.join(law.state.names)}: give it a law like that of the checkpoint")
