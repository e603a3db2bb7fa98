"""What the coupling needs of its two partitions, the solid and the grains: arrays, shapes and units.

Both are matched by structure, so that neither solver package is imported here. n: interface points of the
solid, m: wall nodes of the grains, p: particles, dim: 2 or 3. All arrays are the same on every rank, every
method is collective.
"""
from typing import Any, Callable, Dict, List, Optional, Protocol, Tuple

import numpy as np

State = Dict[str, Any]  # of a partition: everything that decides its future


class Solid(Protocol):
    """The continuum as the loop sees it: takes forces, answers with motion (eq. 26).

    Where ``advance`` fails with an ArithmeticError, on all ranks alike, it leaves the solid as it was. These
    may be there besides:

    ``attempt(dt, force)``: ``advance`` without what the solid itself does where a step fails, such as
        shorter steps: the loop asks for these after that
    ``fall_back()``: after such a failure, changes something so that the step may succeed now, and returns a
        text of what that is, "" when nothing remains
    ``resample()``: between two steps, renews the points of the interface; returns an ``InterfaceChange`` or
        None, see ``resampling``
    ``select(particles, dt)``: the same, by the particles that are near, for windows of dt [s];
    ``ball_radius`` [m]: of the points of such an interface, else None
    ``get_checkpoint()``, ``set_checkpoint(tree)``: a state that does not depend on the ranks, as a tree for
        ``mpm_dem_store``; without them that of ``get_state`` goes into checkpoints
    ``window_mass()``: of each interface point, the mass [kg] of a free body that a force would have moved
        as far over the last step, shape (n,); with it and with that of the grains the loop checks the
        length of weak windows
    ``energy()``, ``count`` and the truth values ``driven`` and ``springs``: it is watched for energy out of
        nothing, see ``energy_watch``
    """

    time: float  # [s]

    def surface(self) -> Tuple[np.ndarray, np.ndarray]:
        """Positions [m] and velocities [m/s] of the interface, shape (n, dim) each."""

    def advance(self, dt: float, force: Optional[np.ndarray] = None) -> Tuple[np.ndarray, np.ndarray]:
        """Advance by dt [s] under ``force`` [N], shape (n, dim), constant meanwhile, or none; returns
        ``surface()``."""

    def get_state(self) -> State:
        """Everything that decides the future, name → array copies."""

    def set_state(self, state: State) -> None:
        """Go back to ``state``: the run continues bit for bit as it did from there."""


class Grains(Protocol):
    """The discrete elements as the loop sees them: take motion, answer with forces (eq. 25).

    These may be there besides:

    ``remember()``: a function that sets them back to where they are now, to round-off; it costs less than a
        state and holds until the next call of either
    ``contact_at_wall(force)``: tangent stiffness [N/m] and damping [kg/s] of the contact of each particle
        with the moving wall under ``force`` [N], and its mass [kg], shape (p,) each
    ``scene.wall`` with ``elements``, and ``replace_wall(wall)``: they can follow a solid that renews its
        interface; ``replace_wall(wall, was)`` one that chooses points, see ``InterfaceChange``
    """

    dt: float  # inner step [s]

    def advance(self, steps: int, x: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Advance ``steps`` inner steps while wall node i moves along x_i + v_i t [m], shape (m, dim);
        returns the mean force on the wall nodes [N], shape (m, dim): impulse / (steps dt)."""

    def particles(self) -> np.ndarray:
        """Structured array with at least ``x`` [m] and ``v`` [m/s], shape (p, dim or 3), and ``mass`` [kg],
        (p,)."""

    def get_state(self) -> State:
        """Everything that decides the future, name → array copies."""

    def set_state(self, state: State) -> None:
        """Go back to ``state``: the run continues bit for bit as it did from there."""


class InterfaceChange(Protocol):
    """From an interface of k points to one of n, renewed between two windows.

    x: places [m], shape (n, dim); elements: their numbers in each segment or triangle; keeps_numbers: whether
    every point is the one that it was. It may have ``was``: the number that each point had, -1 of those that
    are new, shape (n,), and then ``new_velocity`` [m/s], shape (n, dim): of these, zero of others.
    """

    x: np.ndarray
    elements: np.ndarray
    keeps_numbers: bool

    def interpolate(self, values: np.ndarray) -> np.ndarray:
        """Values at the new points, shape (n, …), from those at the old ones, shape (k, …) (consistent)."""

    def redistribute(self, loads: np.ndarray) -> np.ndarray:
        """Loads on the new points, shape (n, …), from those on the old ones, shape (k, …): the sum stays
        (conservative)."""


class RecordedSolid(Solid, Protocol):
    """What the ledger and the record of a case ask besides. It may have a method ``columns()`` with what else
    belongs into the history: name → (unit, meaning, function without arguments); ``origin`` [m], shape
    (dim,): about which moments are taken; and ``impulses_on_bodies()``, since the start: name of a force cell
    of a body → "bodies" and "interface", as far as they act on bodies → linear [N s] and angular impulse
    about zero [N m s], shape (3,) in a plane, else (6,)."""

    applied: np.ndarray  # sum of the interface forces that arrived in the last step [N], shape (dim,)
    iterations: int  # of Newton's method in the last step
    phases: Dict[str, float]  # name of a phase of the step → seconds spent in it so far
    count: int  # material points in all

    def energy(self) -> Dict[str, float]:
        """Kinds of energy now [J], name → number."""

    def snapshot(self) -> Dict[str, tuple]:
        """For ParaView, this rank's piece: name → (positions, {cell type: connectivity}, data); "interface"
        is among them on rank 0. The one method whose answer differs from rank to rank."""

    def describe(self) -> Dict[str, Any]:
        """Entries of report.json that only the solid knows."""

    def resolution(self) -> Dict[str, Any]:
        """``cell_size`` along each axis [m], ``points_per_cell`` (least, mean, most), ``explicit_limit`` [s]
        or None."""

    def options(self) -> Dict[str, str]:
        """Options of the user that changed the run, name → text. Not collective."""

    def unused_options(self) -> List[str]:
        """Options that nobody asked for."""


class Matter(Protocol):
    """The material points of one body on this rank, for maps of a flow and to see that no particle starts in
    them: a solid with either has a method ``matter()`` that gives one for each body. With maps it has the
    entry "volume" [m^3], material volume at rest, in ``removed`` where something may leave it, and in
    ``entered`` where something comes in."""

    x: np.ndarray  # places [m], shape (n, dim)
    v: np.ndarray  # velocities [m/s], shape (n, dim)
    mass: np.ndarray  # [kg], shape (n,)
    volume: np.ndarray  # now [m^3], shape (n,)
    rest: np.ndarray  # at rest [m^3], shape (n,)
    thickness: float  # of a plane body [m], 1 in space
    ball: float  # radius of its points as balls that particles meet [m], 0 without


class Terrain(Protocol):
    """The ground of a flow; its last axis points upward. It may have ``x`` [m], shape (n, dim), and
    ``elements``, segments or triangles, shape (m, dim): its surface."""

    lower: Any  # horizontal extent [m], one or two numbers
    upper: Any

    def height(self, xy: np.ndarray) -> np.ndarray:
        """At horizontal places [m], shape (n, dim - 1), inside the extent: [m], shape (n,)."""


class RecordedGrains(Grains, Protocol):
    """What the ledger and the record of a case ask besides. ``scene.wall`` has ``nodes`` [m], shape (m, dim),
    and ``elements``, shape (k, dim). With ``scene.clusters`` (``mass`` [kg], ``flags``: free along each axis)
    there is a method ``bodies()``, with their ``mass`` and ``v`` [m/s], and particles have ``body``: 0 for
    single spheres."""

    scene: Any

    def energy(self) -> Dict[str, float]:
        """Kinds of energy now [J], name → number."""


Observer = Callable[[Any], object]  # of a run: is called with each ``Window``
