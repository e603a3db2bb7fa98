"""The MPM: advances the points of a scene, one implicit step at a time."""
from dataclasses import replace
from typing import Any, Callable, Dict, Optional, Sequence, Union

import numpy as np
from mpi4py import MPI

import mpm_dem_checks as check

from .collective import somewhere
from .grid.given import as_grid
from .output.states import check_state, while_open
from .points.ball_surface import BallChange, BallSurface, read_particles
from .points.boundary_particles import near_mass
from .points.outline import OutlineChange
from .readings import Readings
from .scene.balls import Balls
from .scene.bodies import Body, Grid
from .scene.conditions import GridWall, Load, Penalty
from .scene.interface import Interface
from .scene.mesh import Mesh
from .scene.numerics import Numerics
from .scene.openings import Inflow, Outflow
from .scene.solid import SolidScene
from .scene.structures import Structure
from .scene.supports import Support
from .solve.clock import PHASES
from .solve.options import Doubt
from .solve.problem import Problem
from .terms.ghost import Facets


class MPM(Readings):
    """One body, or a list of several, on a background grid: a ``Grid``, a ``Mesh`` or a dolfinx.mesh.Mesh,
    see ``from_dolfinx``.

    supports: ``Support`` records; interface: ``Interface`` of boundary particles that carry the forces given
    to ``advance`` and follow the motion, or ``Balls``, the points themselves; gravity: [m/s^2], shape (dim,);
    inertia: "consistent" (eq. 11), "lumped" or "ghost", see ``ghost``; loads: ``Load`` records; penalties:
    ``Penalty`` and ``GridWall`` records; body_force: force per mass [m/s^2] besides gravity, a function of
    the points' positions at rest [m], shape (n, dim), and time [s], with values of shape (n, dim); outflow:
    what happens to material that leaves the grid, "stop" (the run ends), "hold" (at the edge, at rest) or
    "remove", or a dict by side, such as {"+x": "remove"}, whose other sides stop, see ``outflow`` and
    ``removed``; bonded: whether bodies stick where they share grid nodes (layers of one soil), True, or
    groups of the numbers of those that do, such as [(0, 1)]; others push, rub and part, see
    ``terms.body_contact``; numerics: see ``Numerics``; structures: ``Structure`` records, which the soil
    meets; openings: ``Inflow``, ``Outflow``; base: acceleration of the ground [m/s^2], shape (dim,), a
    function or table of time [s]: all is told in its frame; basis: in place of that of ``numerics``.

    ``bodies`` are the bodies with their points, numbered through, see ``bodies.BodyTerm``; ``phases`` sums
    the seconds spent per phase, ``iterations`` is the number of Newton iterations of the last ``advance``,
    ``ghost_since`` the time [s] from which ghost inertia has been needed, or None, see ``ladder``,
    ``count`` the number of material points, ``rebalances`` lists the new distributions over the ranks: (step,
    imbalance before, after).

    A step stands on three things, and each is renewed with all that stands on it:

        distribution over the ranks  ``_rebalance``     points have gathered on few ranks
        step on the active cells     ``_renew_step``    a point is in an inactive cell; inertia is another
        work arrays for the points   ``_renew_arrays``  points have come to another rank

    >>> from mpm_fenicsx import Body, Box, Grid, linear
    >>> block = Body(Box((0.0, 1.0), (1.0, 2.0)), (4, 4), 2, linear(E=1e6, nu=0.3), rho=1000.0)
    >>> solid = MPM(Grid(Box((-1.0, 0.0), (2.0, 3.0)), (6, 6)), block, gravity=(0.0, -10.0))
    >>> for _ in range(10):
    ...     x, v = solid.advance(0.01)
    >>> solid.momentum().round(6)  # falls freely for 0.1 s
    array([    0., -1000.])

    It goes on from a file, on any number of ranks:

    >>> import tempfile
    >>> other = solid.anew()
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     solid.save(folder + "/block.h5")
    ...     other.load(folder + "/block.h5")
    >>> round(other.time, 6), bool((other.points.x == solid.points.x).all())
    (0.1, True)
    >>> solid.close()
    >>> other.close()

    Everything is collective. Raises ValueError for a scene that cannot be run, MPMError and MPMDivergedError
    when a step fails.
    """

    rebalance_every = 50  # steps between two looks at the imbalance

    def __init__(self, grid: Union[Grid, Mesh, Any],  # noqa: PLR0913 - its arguments state a scene
                 body: Union[Body, Sequence[Body]], supports: Sequence[Support] = (),
                 interface: Union[Interface, Balls, None] = None, *,
                 gravity: Optional[Sequence[float]] = None, inertia: str = "consistent",
                 loads: Sequence[Load] = (),
                 penalties: Sequence[Union[Penalty, GridWall]] = (), body_force: Optional[Callable] = None,
                 outflow: Union[str, Dict[str, str]] = "stop", base: Any = None,
                 bonded: Union[bool, Sequence[Sequence[int]]] = False, numerics: Numerics = Numerics(),
                 structures: Sequence[Structure] = (), openings: Sequence[Union[Inflow, Outflow]] = (),
                 basis: Optional[str] = None, comm: MPI.Comm = MPI.COMM_WORLD):
        if basis is not None:
            numerics = replace(check.record("numerics", numerics, Numerics), basis=basis)
        super().__init__(SolidScene(as_grid(grid), body, supports, interface, gravity, inertia, loads,
                                    penalties, body_force, outflow, bonded, numerics, structures, openings,
                                    base), comm)
        self.iterations, self.rebalances, self.closed = 0, [], False
        self.phases, self._doubt = dict.fromkeys(PHASES, 0.0), Doubt()
        self._located, self.step, self._facets = False, None, None  # located: points are in their cells
        self._locate()
        if numerics.settle:
            self.settle(numerics.settle)

    def anew(self) -> "MPM":
        """Another MPM of the same scene, at its start."""
        return type(self)(**vars(self.scene), comm=self.comm)

    # ---------------------------------------------------------------- between steps

    @while_open
    def resample(self) -> Optional[OutlineChange]:
        """Between steps, renew the particles of an interface with a ``Resampling``; None: they stay."""
        if not self._surface.resampled:
            return None
        changed = self._surface.stay_inside(self._framed.grid.box)
        self._locate()
        has_mass = near_mass(self.background, self.step.active_cells, self._surface.of(self._bodies),
                             self.kernels)
        change = self._surface.renew(has_mass, self.time, changed)
        if change is None:
            return None
        self.background.keep_mine(self.boundary, ["the interface"] * len(self.boundary))
        self._renew_arrays()
        return change._replace(x=self._frame.leave(change.x))

    @while_open
    def select(self, particles: np.ndarray, dt: float) -> Optional[BallChange]:
        """Between steps, choose which ``Balls`` take part in the coming one: those that ``particles``, a
        structured array with x, v [m, m/s], shape (n, 2 or 3), and radius [m], the same on every rank, may
        touch in a window of ``dt`` [s], and those that carry a force. The choice has a skin, so that it lasts
        for many windows. None: it stays, as do interfaces of other kinds."""
        if not isinstance(self._surface, BallSurface):
            return None
        self._locate()
        change = self._surface.select(read_particles(particles, self.origin, self.dim), dt)
        return change and change._replace(x=self._frame.leave(change.x),
                                          x_before=self._frame.leave(change.x_before))

    # ---------------------------------------------------------------- what a step stands on

    def _locate(self, fed=False):
        """Phase I, once in a step: points go to their ranks and cells, and what a step stands on follows
        them. fed: some have just come."""
        if self._located and not fed:
            return
        if self.step is not None and not self._hold_blocks():
            return
        row = np.full(len(self.background.cells), -1, np.int32)  # no cell is active before the first step
        if self.step is not None:
            row = self.step.active_cells.point_row
        travelled, inactive = self._sets.locate(self.background.search, row, self._router, self.time)
        self._located = True
        if inactive:
            self._renew_step(self._sets.filled())
        elif travelled or fed:
            self._renew_arrays()

    def _rebalance(self):
        """A new distribution of the grid when the points have gathered on few ranks; they move with all they
        carry. It costs a new mesh, so it is looked at only every ``rebalance_every`` steps."""
        before = self.imbalance()
        if before <= self.numerics.rebalance:
            return
        self._spread_anew()
        self.rebalances.append((self.steps, before, self.imbalance()))

    def _hold_blocks(self):
        """Whether the blocks of a large grid hold what the points need; else others have been made, and the
        points are in their cells."""
        blocks = self.background.blocks
        if blocks is None or not somewhere(self.comm, not self._sets.all_in(blocks.hold))[0]:
            return True
        self._spread_anew()
        return False

    def _spread_anew(self):
        """Another distribution of the grid, for the points as they are."""
        self.step.destroy()
        self._router.free()
        self.step = self._facets = None
        self._distribute(self._sets.places())
        self._sets.relocate(self.background.search, self._router, self.time)
        self._located = True
        self._renew_step(self._sets.filled())

    def _renew_step(self, filled):
        """The step on the cells that are active around the ``filled`` ones of this rank."""
        if self.step is not None:
            self.step.destroy()
        kind, ghost = self._kind_of_step(self._ladder.needs_facets)
        if ghost and self._facets is None:
            self._facets = Facets(self.background, self.kernels.shapes)
        problem = Problem(self._bodies, self._forces, self.loads, (*self.penalties, *self._contacts),
                          self.supports, self.gravity, self.scene.base and self.scene.frame_pull,
                          self.scene.inertia != "lumped", self._ladder.light_since is not None,
                          self.numerics.solver, self._transfer.rule, self._losses, self._impulses,
                          self._works, self._on_bodies)
        self.step = kind(self.background, self.kernels, filled, problem, self.phases, self._doubt,
                         self._facets if ghost else None)
        self._renew_arrays()

    def _renew_arrays(self):
        """Work arrays for the points now here, and the order in which their surface is put together."""
        self.step.attach()
        self._surface.attach()

    # ---------------------------------------------------------------- state

    @while_open
    def get_state(self) -> dict:
        """Everything that decides the future of this rank's points, as name → array copy."""
        return {**self._sets.get_state(), **self._surface.get_state(), **self._outflow.get_state(),
                **self.step.get_state(), **self._losses.get_state(), **self._impulses.get_state(),
                **self._works.get_state(), **self._feeds.get_state(), **self._ladder.get_state(),
                **self._outlets.get_state(), **self._on_bodies.get_state(), "scene": self._fingerprint.copy(),
                "time": np.array([self.time, self.steps, self.background.checksum])}

    @while_open
    def set_state(self, state: dict) -> None:
        """Go back to ``state``; the run continues bit for bit, but over a new distribution of the grid to
        round-off. ValueError for a state of another scene."""
        check_state(state, self._fingerprint)
        for part in (self._sets, self._surface, self._outflow, self._losses, self._impulses, self._works,
                     self._feeds, self._outlets, self._on_bodies):
            part.set_state(state)
        self._located, other = False, self._ladder.set_state(state)
        self.time, self.steps = float(state["time"][0]), int(state["time"][1])
        self.move_walls()
        if state["time"][2] != self.background.checksum:
            if not self._hold_blocks():
                return
            self._sets.relocate(self.background.search, self._router, self.time)
            self._renew_step(self._sets.filled())
            return
        same = not other and np.array_equal(self.step.filled, state["filled"])
        if not self.comm.allreduce(int(same), MPI.MIN):
            self._renew_step(state["filled"].copy())
        self._renew_arrays()
        self.step.set_state(state)

    def close(self) -> None:
        """Free matrix and solver. Afterwards it can still be asked what it has computed."""
        if not self.closed:
            self.step.destroy()
        self.closed = True
