"""Particles that fall under gravity until they are at rest, and the scene that starts with them there.

They move by the law of the scene but for its damping, which is no part of an equilibrium: contacts return at
most `RESTITUTION` of the speed, and each time the kinetic energy has passed a peak all are stopped. That is
kinetic damping (Cundall, Explicit finite difference methods in geomechanics, Blacksburg 1976; Barnes, Comput.
Struct. 30 (1988) 685-695); it also ends rolling, which no contact damps. Overlaps and springs of friction,
which carry the weight at rest, go into the new scene as its ``contacts``.
"""
import copy
from dataclasses import replace
from typing import Any, Callable, NamedTuple, Optional, TypeVar

import numpy as np
from mpi4py import MPI

import mpm_dem_checks as check

from . import quaternion
from .contact.critical_step import critical_step
from .protocol import DEM
from .scene.clusters import Cluster
from .scene.scene import SceneData
from .scene.tables import sphere_table

RESTITUTION = 0.1
LOOK = 0.05  # time between two looks at the kinetic energy, in sqrt(R / g) of the smallest sphere
QUIET = 3.0  # time from a stop on, in sqrt(R / g) of the largest sphere, in which what is at rest stays slow
SLOW = 1e-4  # speed that counts as rest if none is given, in sqrt(g R) of the smallest sphere
FALLS = 40.0  # time to settle if none is given, in that of a fall through the scene

AnyScene = TypeVar("AnyScene", bound=SceneData)
Open = Callable[[SceneData, float], DEM]  # a partition for a scene and a time step [s]


class NotSettledError(RuntimeError):
    """Particles are not at rest in the time given, or have nothing to rest on."""


class Plan(NamedTuple):
    """How a scene is brought to rest."""

    dt: float  # time step [s]
    look: int  # steps between two looks
    quiet: int  # looks from a stop on that must be slow
    time: float  # given to settle [s]
    speed: float  # below which all is slow [m/s]
    bottom: float  # of the walls along gravity [m]


def settle(scene: AnyScene, open_dem: Open, time: Optional[float], speed: Optional[float]) -> AnyScene:
    """See `Scene.settled`."""
    plan = _plan(scene, time, speed)
    dem = open_dem(_damped(scene), plan.dt)
    try:
        fastest = _come_to_rest(dem, plan)
        energy, elapsed = dem.energy()["kinetic"], dem.time
        dem.halt()
        particles, bodies, contacts = dem.particles(), dem.bodies(), dem.contacts()
    finally:
        dem.close()
    if MPI.COMM_WORLD.rank == 0:
        print(f"{len(scene.spheres.x) + len(scene.clusters)} particles settled in {elapsed:.3g} s: largest "
              f"speed left {fastest:.2g} m/s, kinetic energy {energy:.2g} J, {contacts.total} contacts, at "
              f"most {contacts.deepest(particles['radius']):.2g} of a radius deep")
    x = particles["x"][:len(scene.spheres.x), :scene.dim]
    spheres = replace(scene.spheres, x=x, v=np.zeros_like(x), omega=None)
    clusters = tuple(map(_placed, scene.clusters, bodies))
    return replace(scene, spheres=spheres, clusters=clusters, contacts=contacts)


def _placed(cluster: Cluster, body: Any) -> Cluster:
    """``cluster`` where ``body``, a row of `DEM.bodies`, is: at rest but along what is not free."""
    held, q = ~cluster.flags, body["quaternion"]
    turn = dict(angle=quaternion.angle(q)) if cluster.dim == 2 else dict(quaternion=q)
    return cluster.changed(x=body["x"][:cluster.dim], v=cluster.v * held[:cluster.dim],
                           omega=cluster.omega * held[3:], **turn)


def _damped(scene: SceneData) -> SceneData:
    """``scene`` with damped contacts, in which nothing is moved from outside."""
    met = {pair: replace(one, restitution=min(one.restitution, RESTITUTION))
           for pair, one in scene.interactions.items()}
    clusters = tuple(c.changed(v=c.v * c.flags[:c.dim], omega=c.omega * c.flags[3:]) for c in scene.clusters)
    return replace(scene, clusters=clusters, interactions=met, outflow="stop", base=None,
                   structures=tuple(map(_still, scene.structures)))


def _still(structure: Any) -> Any:
    """The same where it is."""
    other = copy.copy(structure)
    object.__setattr__(other, "motion", None)
    return other


def _plan(scene: SceneData, time: Optional[float], speed: Optional[float]) -> Plan:
    g, spheres = float(np.linalg.norm(scene.gravity)), sphere_table(scene)
    if not g > 0.0:
        raise ValueError("gravity is 0 m/s^2: give the scene one, without it nothing settles")
    nodes = [wall.nodes for wall in (*scene.fixed, scene.wall) if len(wall.elements)]
    if not nodes or not len(spheres.x):
        raise ValueError(f"the scene has {len(spheres.x)} spheres and {len(nodes)} walls: give it particles "
                         "and something to settle on")
    along = np.array(scene.gravity) / g
    bottom = float((np.concatenate(nodes) @ along).max())
    height = max(bottom - float((spheres.x[:, :scene.dim] @ along).min()), spheres.radius.max())
    fall = float(np.sqrt(2.0 * g * height))
    v = np.tile(np.sqrt(fall**2 + (spheres.v**2).sum(axis=1).max()) * along, (len(scene.spheres.x), 1))
    dt = min(critical_step(replace(scene, spheres=replace(scene.spheres, v=v), clusters=tuple(
        c.changed(v=np.sqrt(fall**2 + c.v @ c.v) * along) for c in scene.clusters))))
    small, large = spheres.radius.min(), spheres.radius.max()
    look = max(1, int(LOOK * np.sqrt(small / g) / dt))
    time = FALLS * fall / g if time is None else check.positive("time to settle", time, "s")
    speed = SLOW * np.sqrt(g * small) if speed is None else check.positive("speed", speed, "m/s")
    return Plan(dt, look, int(np.ceil(QUIET * np.sqrt(large / g) / (look * dt))), time, float(speed), bottom)


def _come_to_rest(dem: DEM, plan: Plan) -> float:
    """Largest speed [m/s] since the last stop, slow for as long as the ``plan`` wants it."""
    nodes = np.array(dem.scene.wall.nodes)
    still, energy, fastest, quiet = np.zeros_like(nodes), 0.0, 0.0, 0
    while quiet < plan.quiet:
        dem.advance(plan.look, nodes, still)
        particles = dem.particles()
        speed = np.sqrt((particles["v"]**2).sum(axis=1))
        before, energy, quiet = energy, float(particles["mass"] @ speed**2), quiet + 1
        if speed.max() > fastest:
            fastest, name = speed.max(), _name(particles[speed.argmax()])
        _check_below(dem, particles, plan)
        if fastest <= plan.speed:
            continue
        if dem.time >= plan.time:
            raise NotSettledError(f"{name} still moves with {fastest:.3g} m/s after {dem.time:.3g} s of "
                                  f"settling, at rest it is below {plan.speed:.3g} m/s: give more time, a "
                                  "larger speed=, or friction and walls that can hold it")
        quiet = 0
        if energy < before:
            dem.halt()
            energy, fastest = 0.0, 0.0
    return fastest


def _check_below(dem: DEM, particles: np.ndarray, plan: Plan) -> None:
    """NotSettledError when something has fallen past all walls."""
    along = np.array(dem.scene.gravity) / np.linalg.norm(dem.scene.gravity)
    below = particles["x"][:, :dem.scene.dim] @ along - plan.bottom
    if (below > 2.0 * particles["radius"]).any():
        raise NotSettledError(f"{_name(particles[below.argmax()])} has fallen past all walls at t = "
                              f"{dem.time:.3g} s: give the scene a wider floor, or walls around it")


def _name(row: Any) -> str:
    return f"cluster {row['body']}" if row["body"] else f"sphere {row['id']}"
