"""What both DEM back ends offer. It is matched by structure: there is no base class to inherit from."""
from typing import Any, Dict, Protocol

import numpy as np

from .scene.contacts import Contacts
from .scene.scene import SceneData
from .scene.walls import Wall

PARTICLE = np.dtype([("id", np.int64), ("body", np.int64), ("x", float, 3), ("v", float, 3),
                     ("omega", float, 3), ("radius", float), ("mass", float)])

BODY = np.dtype([("id", np.int64), ("x", float, 3), ("quaternion", float, 4), ("v", float, 3),
                 ("omega", float, 3), ("mass", float)])


class DEM(Protocol):
    """One discrete element partition. All arrays are the same on every rank; every method is collective.

    >>> wall = Wall([[-1.0, 0.0], [1.0, 0.0]], [[0, 1]])
    >>> sphere = Spheres(x=[[0.0, 0.1]], v=[[0.0, -0.1]], radius=0.01, rho=7800.0)
    >>> scene = Scene(sphere, wall, material=Material(1e7, 0.3), wall_material=Material(1e7, 0.3))
    >>> dem: DEM = open_dem("reference", scene, dt=1e-5)
    >>> force = dem.advance(100, wall.nodes, np.zeros((2, 2)))
    >>> dem.particles()["x"][0].round(6), f"{dem.energy()['kinetic']:.4g} J"
    (array([0.    , 0.0999, 0.    ]), '0.0001634 J')

    It goes on from a file:

    >>> import tempfile
    >>> other = open_dem("reference", scene, dt=1e-5)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     dem.save(folder + "/sphere.h5")
    ...     other.load(folder + "/sphere.h5")
    >>> f"{other.time:.6g} s", bool((other.particles() == dem.particles()).all())
    ('0.001 s', True)
    """

    scene: SceneData  # its wall is the one of now
    dt: float  # DEM time step [s]
    origin: np.ndarray  # of the frame it computes in [m], shape (3,), see `frame`: else zero

    def advance(self, steps: int, x: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Advance ``steps`` DEM steps while wall node i moves along x_i + v_i t, t from 0 to steps * dt.

        x, v: wall nodes at the start of the window [m], [m/s], shape (n, dim). Returns the mean force on the
        wall nodes over the window [N], shape (n, dim): impulse / (steps dt), where the impulse is the sum of
        velocity Verlet's own half kicks, so that it is minus the change of the particles' momentum to
        round-off.
        """

    def replace_wall(self, wall: Wall, was: Any = None) -> None:
        """Go on with ``wall`` in the place of the moving one, at the time of now: it may have other nodes and
        elements. What is remembered of a contact goes to the element closest to where it was, the force of
        the last step, half of which acts in the next one, from each node to the closest place of the new
        wall. was: for discs, the number that each of them had in the wall before, -1 for a new one, shape
        (n,): what is remembered of a disc, and its force, stay with it."""

    @property
    def time(self) -> float:
        """[s]"""

    @property
    def removed(self) -> Dict[str, Any]:
        """What has left the domain, held or removed by ``Scene.outflow``, since the start: "count", "mass"
        [kg], "momentum" [kg m/s], shape (dim,), "energy" [J] by which that of what is left has fallen; the
        same on every rank."""

    def particles(self) -> np.ndarray:
        """Copy of the spheres sorted by id, dtype ``PARTICLE``, shape (n,): SI units, three components
        always. body: id of the cluster it belongs to, 0 for a single sphere. A sphere of a cluster has its
        share, by volume, of the cluster's mass. What has left the domain keeps its row, at rest and with a
        mass of 0: where it left, with a radius of 0, when it was removed, at the edge when it is held."""

    def bodies(self) -> np.ndarray:
        """Copy of the clusters sorted by id, which counts from 1 in the order of the scene; dtype ``BODY``.
        x, v: of the centre of mass; quaternion (w, x, y, z): from the cluster's own frame to space
        (`quaternion.angle` in a plane). What has left the domain: as in ``particles``."""

    def impulses(self) -> Dict[str, np.ndarray]:
        """Impulse that has been given to the particles since the start, by name: of gravity, of each force
        cell of the structures, of other fixed walls by their material, and of the moving wall, "interface":
        linear [N s] and angular about zero [N m s], shape (3,) in a plane, (6,) in space. Walls count with
        moments about their nodes; "arms" is the rest of these, see `common.booking`."""

    @property
    def base_work(self) -> float:
        """Work that the motion of the base has done on the particles since the start [J], in its frame."""

    def contact_points(self) -> np.ndarray:
        """Where particles touch now, dtype ``common.contact_points.CONTACT_POINT``: place, normal force on
        the first one of spring and adhesion, without damper and friction, ids of both or number of the wall,
        overlap."""

    def contact_at_wall(self, force: float) -> np.ndarray:
        """Tangent stiffness [N/m], damping [kg/s] and mass [kg] in the contact of each sphere with the moving
        wall under ``force`` [N], shape (3, n), whether it touches it or not."""

    def contacts(self) -> Contacts:
        """What touches what now, with the springs of friction: what a `Scene` that is to start from here
        needs besides places."""

    def halt(self) -> None:
        """Stop all particles where they are; what is not free along an axis as well. Contacts stay."""

    def energy(self) -> Dict[str, float]:
        """``kinetic`` (translation and spin), ``contact`` (potential energy of normal forces and adhesion),
        ``potential`` (in gravity, zero at ``origin``) [J]."""

    def get_state(self) -> Dict[str, np.ndarray]:
        """Everything that decides the future (positions, orientations, velocities, forces, tangential
        history, time, wall), as name → array copies. Its positions are those in the frame whose ``origin``
        [m] is in it."""

    def set_state(self, state: Dict[str, Any]) -> None:
        """Go back to ``state``: the run continues bit for bit as it did from there, on another number of
        ranks to round-off."""

    def save(self, path: Any) -> None:
        """Write ``get_state`` into the file ``path``, see ``load``."""

    def load(self, path: Any) -> None:
        """Go on from the file ``path`` of the same scene and back end, or of a coupled run with them.
        ValueError for a file of something else."""

    def close(self) -> None:
        """Free what the back end holds."""
