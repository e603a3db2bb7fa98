"""What leaves the domain of a scene: it ends the run, stays at the edge at rest, or goes; what goes or stays is booked.

A single sphere leaves with its centre, a cluster with its centre of mass; looked for at the end of every window. Held
or removed it takes part no more: nothing touches it, and the books have its mass, momentum and energy, so that what is
left plus what has left is what was there. The words are those of the MPM's outflow.
"""
import numpy as np

import mpm_dem_checks as check

from .protocol import BODY, PARTICLE

WAYS = ("stop", "hold", "remove")


class LeftDomain(RuntimeError):
    """A particle has left the domain where that is not allowed."""


def sides_of(dim):
    return [sign + axis for axis in "xyz"[:dim] for sign in "-+"]


def read_domain(domain, dim):
    """Lower and upper corner [m], shape (2, dim), of a pair of them. Raises ValueError."""
    lower, upper = check.array("domain", domain, (2, dim), unit="m")
    if not (lower < upper).all():
        raise ValueError(f"domain is {lower} to {upper} m: give its lower and upper corner")
    return np.array([lower, upper])


def read_ways(outflow, dim):
    """Ways in the order of ``sides_of``, of a word for all sides or a dict by side, such as {"+x": "remove"}, whose
    other sides stop. Raises ValueError for another word or side."""
    sides = sides_of(dim)
    given = outflow if isinstance(outflow, dict) else dict.fromkeys(sides, outflow)
    for side, way in given.items():
        if side not in sides:
            raise ValueError(f"outflow has a side {side!r}: choose from {', '.join(sides)}")
        check.choice(f"outflow at {side}" if given is outflow else "outflow", way, WAYS)
    return [given.get(side, "stop") for side in sides]


class Outflow:
    """For a ``scene``, with or without a domain; both back ends have one, as ``_outflow``.

    body: number of the cluster of each sphere, -1 for none. out, out_bodies: which spheres, shape (n,), and clusters
    have been held or removed; the others, so many spheres as ``present`` says, are in the calculation.
    """

    def __init__(self, scene, body):
        self.active, self._dim = scene.domain is not None, scene.dim
        self._ways = read_ways(scene.outflow, scene.dim)
        self._domain, self.present = scene.domain, len(body)
        # of those that are out, as they are shown
        self._particles, self._bodies = np.zeros(len(body), PARTICLE), np.zeros(len(scene.clusters), BODY)
        for table in (self._particles, self._bodies):
            table["id"] = 1 + np.arange(len(table))
        self._particles["body"] = body + 1
        self.out, self.out_bodies = np.zeros(len(body), np.bool_), np.zeros(len(scene.clusters), np.bool_)
        self._sums = np.zeros(3 + scene.dim)  # count, mass, energy, momentum

    @property
    def removed(self):
        """See `protocol.DEM.removed`."""
        count, mass, energy = self._sums[:3].tolist()
        return {"count": int(count), "mass": mass, "momentum": self._sums[3:].copy(), "energy": energy}

    def all_particles(self, present):
        """Rows of all spheres from those of the present ones."""
        return _filled(present, self._particles, self.out)

    def all_bodies(self, present):
        return _filled(present, self._bodies, self.out_bodies)

    def after_window(self, dem):
        """Let go what has left; ``dem._take_out()`` makes the back end forget what is out. Raises LeftDomain."""
        particles, bodies = dem.particles(), dem.bodies()
        leaving, ways = self._leaving(particles, (particles["body"] == 0) & ~self.out)
        leaving_bodies, body_ways = self._leaving(bodies, ~self.out_bodies)
        if not (len(leaving) or len(leaving_bodies)):
            return
        self._stop(particles, leaving, ways, "sphere", dem.time)
        self._stop(bodies, leaving_bodies, body_ways, "cluster", dem.time)
        energy = sum(dem.energy().values())
        for table, rows in ((particles, leaving), (bodies, leaving_bodies)):
            self._book(table[rows])
        self._show(particles, leaving, ways)
        for body, way in zip(leaving_bodies, body_ways):
            self._show_body(particles, bodies, body, way)
        self.out[leaving] = True
        self.out_bodies[leaving_bodies] = True
        self.present = int(np.count_nonzero(~self.out))
        dem._take_out()
        self._sums[2] += energy - sum(dem.energy().values())

    def _leaving(self, table, present):
        """Numbers of the rows that are outside, and what happens to each, by the side beyond which it is farthest."""
        x, (lower, upper) = table["x"][:, :self._dim], self._domain
        beyond = np.stack([lower - x, x - upper], axis=2).reshape(len(x), 2 * self._dim)
        rows = np.flatnonzero(present & (beyond > 0.0).any(axis=1))
        return rows, [self._ways[side] for side in beyond[rows].argmax(axis=1)]

    def _stop(self, table, rows, ways, what, time):
        for row, way in zip(rows, ways):
            if way == "stop":
                lower, upper = self._domain
                raise LeftDomain(f"{what} {row + 1} has left the domain, {lower} to {upper} m, and is at "
                                 f"{table['x'][row, :self._dim]} m at t = {time:.6g} s: enlarge the domain, or let go "
                                 "what leaves with outflow=hold or outflow=remove")

    def _book(self, rows):
        self._sums[0] += len(rows)
        self._sums[1] += rows["mass"].sum()
        self._sums[3:] += rows["mass"] @ rows["v"][:, :self._dim]

    def _show(self, particles, rows, ways):
        shown = particles[rows]
        _at_rest(shown)
        shown["radius"] *= [way == "hold" for way in ways]
        for row, way in zip(shown, ways):
            if way == "hold":
                row["x"][:self._dim] = np.clip(row["x"][:self._dim], *self._domain)
        self._particles[rows] = shown

    def _show_body(self, particles, bodies, body, way):
        rows = np.flatnonzero(particles["body"] == body + 1)
        shown, place = particles[rows], bodies["x"][body].copy()
        if way == "hold":
            place[:self._dim] = np.clip(place[:self._dim], *self._domain)
        shown["x"] += place - bodies["x"][body]
        _at_rest(shown)
        if way == "remove":
            shown["radius"] = 0.0
        self._particles[rows], self.out[rows] = shown, True
        self._bodies[body] = bodies[body]
        self._bodies["x"][body] = place
        _at_rest(self._bodies[body:body + 1])

    def get_state(self):
        """As name → array copy; nothing without a domain."""
        if not self.active:
            return {}
        return dict(removed=self._sums.copy(), out=self.out.copy(), out_bodies=self.out_bodies.copy(),
                    out_x=self._particles["x"].copy(), out_radius=self._particles["radius"].copy(),
                    out_body_x=self._bodies["x"].copy(), out_body_quaternion=self._bodies["quaternion"].copy())

    def set_state(self, state):
        if not self.active:
            return
        self._sums, self.out, self.out_bodies = (np.array(state[name]) for name in ("removed", "out", "out_bodies"))
        self.present = int(np.count_nonzero(~self.out))
        self._particles["x"], self._particles["radius"] = state["out_x"], state["out_radius"]
        self._bodies["x"], self._bodies["quaternion"] = state["out_body_x"], state["out_body_quaternion"]
        for table in (self._particles, self._bodies):
            _at_rest(table)

    @property
    def names(self):
        """Of what ``get_state`` gives."""
        return tuple(self.get_state())


def _at_rest(rows):
    rows["v"] = rows["omega"] = 0.0
    rows["mass"] = 0.0


def _filled(present, shown, out):
    if not out.any():
        return present
    rows = shown.copy()
    rows[~out] = present
    return rows


def check_inside(scene, places):
    """Raise ValueError unless all that is in ``places``, (name, position [m]) each, is in the domain at the start."""
    if scene.domain is None:
        return
    lower, upper = scene.domain
    for name, x in places:
        if not ((lower <= x) & (x <= upper)).all():
            raise ValueError(f"{name} at {x} m starts outside the domain, {lower} to {upper} m: move it inside or "
                             "enlarge the domain")
