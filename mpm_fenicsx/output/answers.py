"""What others ask the MPM: positions are in the user's coordinates, see ``frame``."""
import numpy as np
from mpi4py import MPI

from ..collective import total
from ..scene.frame import Seen, seen_points
from ..solve import options
from ..terms.scene_penalties import reaction
from . import snapshots as output
from .resolution import resolution
from .states import while_open


class Answers:
    """The part of ``MPM`` that computes nothing new. Everything is collective but ``parts``, ``points``, ``held``,
    ``removed``, ``origin`` and ``cauchy_stress``."""

    @property
    def origin(self):
        """Of the frame in which it computes and in which its state is [m], shape (dim,), see ``frame``."""
        return self._frame.origin

    @property
    def parts(self):
        """The bodies with their points on this rank, see ``parts.Part``; far from zero positions can be read, not
        changed."""
        if not self._frame.moved:
            return self._parts
        return [Seen(part, points=seen_points(part.points, self._frame)) for part in self._parts]

    @property
    def points(self):
        """Material points of the only body on this rank; ValueError when there are several."""
        if len(self._parts) > 1:
            raise ValueError(f"there are {len(self._parts)} bodies: take the points of each from parts[n].points")
        return self.parts[0].points

    @property
    def interface(self):
        """The ``Interface`` of now, or None."""
        return self._frame.leave(self._surface.interface)

    @property
    def count(self):
        """Material points that take part, on all ranks."""
        return self._count - self.removed["count"]

    @property
    def removed(self):
        """What has left the grid, held or removed by ``outflow``, since the start: "count", "mass" [kg], "momentum"
        [kg m/s], shape (dim,), and "energy" [J] (kinetic, strain and potential), the same on every rank."""
        return self._outflow.removed

    def held(self):
        """Points of each body that ``outflow`` holds at the edge on this rank."""
        return [seen_points(points, self._frame) for points in self._outflow.held]

    def surface(self):
        """Boundary particles: positions [m] and velocities [m/s], shape (n, dim) each, in the order of the interface,
        the same on every rank."""
        x, v = self._surface.whole("x", "v")
        return self._frame.leave(x), v

    def displacement(self):
        """Of the boundary particles since the start [m], shape (n, dim): not less exact far from zero."""
        return self._surface.whole("x")[0] - self._surface.interface.x

    @property
    def applied(self):
        """Sum of the interface forces that reached the nodes in the last step [N], shape (dim,)."""
        return self.step.applied

    @property
    def driven(self):
        """Whether motions, loads or body forces do work on the bodies, besides gravity and the interface's forces."""
        moved = (held for condition in self.penalties for held in condition.penalties)
        return bool(self.loads or self._parts[0].pushed or any(s.motion is not None for s in self._support_scene)
                    or any(held.motion is not None for held in moved))

    @property
    def springs(self):
        """Whether there are any, which store energy that ``energy`` does not count."""
        return bool(self.penalties)

    def window_mass(self):
        """See ``Carriers.window_mass``, of all boundary particles, the same on every rank."""
        return self._surface.everywhere(self.step.carriers.window_mass())

    def reaction(self, name):
        """Force of the penalties of that name on the body over the last step [N], shape (dim,)."""
        return total(self.comm, reaction(self.penalties, name))

    def behind(self):
        """Material points that have gone through walls and not come back, as name of the wall → number."""
        counts = {} if self._behind is None else zip(self._behind.names, self._behind.counts().tolist())
        return {name: count for name, count in sorted(counts)} if counts else {}

    def columns(self):
        """What else the history should have, as name → (unit, meaning, function without arguments)."""
        if self._behind is None:
            return {}
        return {"behind": ("1", "material points that have gone through a wall", lambda: sum(self.behind().values()))}

    def energy(self):
        """``kinetic``, ``strain`` and ``potential`` (in gravity, zero at ``origin``) energy of the points [J]."""
        parts = np.sum([part.energies(self.gravity) for part in self._parts], axis=0)
        return dict(zip(("kinetic", "strain", "potential"), total(self.comm, parts).tolist()))

    def momentum(self):
        """Momentum of the points [kg m/s], shape (dim,)."""
        return total(self.comm, sum(part.points.mass @ part.points.v for part in self._parts))

    def cauchy_stress(self):
        """Cauchy stress of this rank's points [Pa], shape (n, dim, dim), body after body."""
        return np.concatenate([part.cauchy_stress() for part in self._parts])

    def imbalance(self):
        """Most material points on one rank over the mean."""
        return self.comm.allreduce(sum(len(part.points) for part in self._parts), MPI.MAX) * self.comm.size / self.count

    def snapshot(self):
        """This rank's piece of what ParaView shows, see ``output``."""
        return output.snapshot(self)

    @while_open
    def describe(self):
        """Solver and imbalance, for the report: see ``output``."""
        return output.describe(self)

    @while_open
    def resolution(self):
        """Sizes of the cells, points in them and explicit limit, see ``resolution``."""
        return resolution(self)

    def options(self):
        """PETSc's options that a user gave and that somebody asked for, as they are typed, name → text."""
        return options.used()

    def unused_options(self):
        """Dash options that neither PETSc nor anybody else asked for."""
        return options.unused()
