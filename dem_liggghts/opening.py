"""The scene as a user states it, and the partition that computes it."""
from dataclasses import dataclass, replace
from typing import Any, Optional

from mpi4py import MPI

from .common.checks import check_start
from .contact.critical_step import warn_if_too_long
from .contact.rule import ContactRule, contact_rule, depth_at_wall
from .protocol import DEM
from .scene.materials import WALL
from .scene.scene import SceneData
from .settling import settle


@dataclass(frozen=True)
class Scene(SceneData):
    """Everything a DEM back end needs to start. Lengths in m, gravity [m/s^2], (dim,).

    spheres and clusters: what moves, either may be missing. wall: the interface that is moved from outside;
    walls: further ones at rest (a floor). Materials have names: ``material`` is "spheres", ``wall_material``
    is "wall", ``materials`` holds others. ``interactions``: (name, name) → Interaction in either order;
    ``between`` is that of "spheres" with themselves, ``at_wall`` that of "spheres" with "wall". domain: lower
    and upper corner [m], (dim,) each; outflow: what happens to that which leaves it, "stop", "hold" or
    "remove" for all sides, or by side, such as {"+x": "remove"}, whose other sides stop; without a domain
    nothing ever leaves. structures: as ``mpm_fenicsx.Structure``, rigid surfaces, at rest or moving; where
    ``materials`` and ``interactions`` do not name their material (their name, if they have none), it is that
    of the particles, and ``friction`` that of the structure, with a restitution of 1. base: acceleration of
    the ground [m/s^2], shape (dim,), a function or table of time [s]: all is told in its frame; in each
    window its mean acts. contacts: what touches what at the start and how deep, as `settled` finds it;
    without them nothing may overlap. Raises ValueError for what does not fit.

    >>> sphere = Spheres(x=[[0.0, 0.0201]], v=[[0.0, -0.1]], radius=0.02, rho=7800.0)
    >>> floor = Wall(nodes=[[-1.0, 0.0], [1.0, 0.0]], elements=[[0, 1]])
    >>> steel = Material(E=1e8, nu=0.3)
    >>> scene = Scene(sphere, floor, material=steel, wall_material=steel, gravity=(0.0, -9.81))
    >>> scene.dim, scene.names
    (2, ('spheres', 'wall'))
    >>> scene.open("reference", dt=1e-5).time
    0.0
    """

    def open(self, backend: str, dt: float, comm: Any = None) -> DEM:
        """The partition (`protocol.DEM`) that computes this scene with the time step ``dt`` [s].

        backend: "reference" or "liggghts". Raises ValueError for an unknown back end, for spheres that
        overlap or lie inside the body at the start and for a cluster in two pieces; warns when the step is
        too long for the contact. Collective on ``comm`` (default: all ranks).
        """
        return open_scene(self, backend, dt, comm)

    def settled(self, time: Optional[float] = None, speed: Optional[float] = None,
                dem: str = "reference") -> "Scene":
        """The scene that starts with its particles at rest, where they come to lie under gravity on walls,
        structures and each other.

        time: given to come to rest [s], by default that of forty falls through the scene; speed: below which
        a sphere is at rest [m/s], by default 1e-4 sqrt(g R) of the smallest; dem: the back end that does it.
        Walls, structures and ground stay where they are at the start, also those that move later. `settling`
        says how motion is damped. The new scene has the overlaps and the springs of friction of all contacts,
        ``contacts``, with which its own law holds it at rest. The same on every rank, whatever their number;
        one line on standard output says how it went. Raises NotSettledError, a RuntimeError, when particles
        still move after that time, or fall past all walls.

        >>> floor = Wall([[-1.0, 0.0], [1.0, 0.0]], [[0, 1]])
        >>> stone, meet = Material(E=1e7, nu=0.25), Interaction(restitution=0.5, friction=0.5)
        >>> spheres = Spheres([[0.0, 0.05], [0.01, 0.1]], np.zeros((2, 2)), radius=0.02, rho=2600.0)
        >>> scene = Scene(spheres, floor, stone, stone, meet, meet, gravity=(0.0, -9.81))
        >>> scene.settled().spheres.x.round(2)
        2 particles settled in ... s: largest speed left ... m/s, kinetic energy ... J, 2 contacts, ...
        array([[...]])
        """
        return settle(self, lambda scene, dt: open_scene(scene, dem, dt, MPI.COMM_SELF), time, speed)

    def contact_rule(self, scales: Any, speed: float) -> ContactRule:
        """Modulus, window and step for balls in the place of material points, as they meet rocks at ``speed``
        [m/s]; scales: of the points, as `MPM.contact_scales()` gives them. See `contact.rule.contact_rule`.

        >>> from dem_liggghts.contact.rule import Scales
        >>> rock = Spheres([[0.0, 0.0, 0.026]], [[0.0, 0.0, -1.0]], radius=0.02, rho=7850.0)
        >>> stone, soil = Material(E=1e9, nu=0.2), Material(E=1e6, nu=0.2)
        >>> scene = Scene(rock, Wall.discs([[0.0, 0.0, 0.0]], 0.0025), stone, soil, gravity=(0, 0, -9.81))
        >>> scales = Scales(0.005, 7.5e-5, 2.5e-5, 600.0, wave=30.0, height=0.2, speed=1.0)
        >>> print(scene.contact_rule(scales, speed=1.0))  # doctest: +NORMALIZE_WHITESPACE
        contact modulus 1e+06 Pa, where 4.87 N, the most expected on a material point, press it 0.35 of
        its spacing into a rock (6.7e+06 Pa: 0.1)
        """
        return contact_rule(self, scales, speed)

    def fitted(self, scales: Any, speed: float) -> "Scene":
        """The same scene with the modulus that `contact_rule` asks for in the material of its moving wall."""
        name, modulus = self.wall.material, self.contact_rule(scales, speed).modulus
        material = replace(self.materials[name], E=modulus)
        if name == WALL:
            return replace(self, wall_material=material,
                           materials={k: m for k, m in self.materials.items() if k != name})
        return replace(self, materials={**self.materials, name: material})

    def depth_at_wall(self, force: float) -> float:
        """Deepest overlap [m] of a sphere with the moving wall under ``force`` [N]."""
        return depth_at_wall(self, force)


def open_scene(scene: SceneData, backend: str, dt: float, comm: Any = None) -> DEM:
    """See `Scene.open`."""
    if backend not in ("reference", "liggghts"):
        raise ValueError(f"dem is {backend!r}: the back ends are reference and liggghts, give one of them")
    warn_if_too_long(scene, dt)
    check_start(scene)
    if backend == "liggghts":  # imported here: who does not ask for LIGGGHTS never loads it
        from .liggghts import LiggghtsDEM
        return LiggghtsDEM(scene, dt, comm)
    from .reference import ReferenceDEM
    return ReferenceDEM(scene, dt, comm)
