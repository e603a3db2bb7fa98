"""What can be wrong with a scene before the first step, and with its numbers after one; for both back
ends."""
from typing import Dict, List, Tuple, Union

import numpy as np

import mpm_dem_checks as check

from ..scene.clusters import Cluster
from ..scene.frame import find_origin, translated
from ..scene.scene import SceneData
from ..scene.tables import JOINT, RIM, SphereTable, sphere_table, wall_table
from ..scene.walls import Wall
from ..search.elements import at_rest, distance_and_side
from ..search.neighbours import near_spheres, no_neighbours

TOUCHING = 1e-9  # overlap at the start, as a fraction of the radius, that still counts as touching
GONE = ("is going through the wall: Hertz's law does not stop it before its centre is there; take a stiffer "
        "contact (E), a smaller speed, more substeps, or a wall with a depth, which pushes outwards on both "
        "sides")  # also in wall.h
CHANGED = "settle it anew after a change, or give contacts=None and places apart"
CONNECTED = 1e-6  # gap, as a fraction of the radius, over which the spheres of a cluster still hang together


def check_start(scene: SceneData) -> None:
    """Raise ValueError unless every sphere starts outside the body and free of overlap, touching is fine, and
    every cluster is in one piece. Where the scene has ``contacts``, as after `Scene.settled`, these overlap
    as they say, and no other.

    >>> from dem_liggghts import Material, Scene, Spheres
    >>> close = Spheres(x=[[0.0, 0.0], [0.015, 0.0]], v=[[0.0, 0.0]] * 2, radius=0.01, rho=7800.0)
    >>> check_start(Scene(close, material=Material(2.1e11, 0.3)))
    Traceback (most recent call last):
    ValueError: spheres 1 and 2 overlap by 0.005 m at the start: move them apart by at least that much
    """
    origin = find_origin(scene)
    scene = translated(scene, -origin)
    slack = 4.0 * np.spacing(np.abs(origin).max())  # what was lost in far coordinates
    spheres = sphere_table(scene)
    if scene.dim == 2 and spheres.omega[:, :2].any():
        bad = int(np.flatnonzero(spheres.omega[:, :2].any(axis=1))[0])
        raise ValueError(f"sphere {bad + 1} of a plane scene has spin {spheres.omega[bad]} rad/s: only the "
                         "third component may differ from zero")
    _check_inside_domain(scene, origin)
    for number, cluster in enumerate(scene.clusters):
        _check_one_piece(cluster, number)
    between, at_walls = _overlaps_of(scene, len(spheres.x))
    # where walls meet only one of them has the contact: the others may be as deep in the sphere
    deepest = at_walls.max(axis=1, initial=0.0)
    _check_apart(spheres, slack, between)
    names = [f"fixed wall {number + 1}" for number in range(len(scene.walls))]
    names += [structure.name for structure in scene.structures]
    for name, wall, own in zip((*names, "the wall"), (*scene.fixed, scene.wall), at_walls.T):
        if len(wall.elements):
            _check_adhesion(scene, spheres, wall)
            _check_outside(scene, spheres, (wall, name), (own, deepest), (slack, origin))


def _check_inside_domain(scene: SceneData, origin: np.ndarray) -> None:
    if scene.domain is None:
        return
    lower, upper = scene.domain
    for what, places in (("sphere", scene.spheres.x), ("cluster", [c.x for c in scene.clusters])):
        for k, x in enumerate(places):
            x = x + origin[:scene.dim]
            if not ((lower <= x) & (x <= upper)).all():
                raise ValueError(f"{what} {k + 1} at {x} m starts outside the domain, {lower} to {upper} m: "
                                 "move it inside or enlarge the domain")


def _name(spheres: SphereTable, i: int) -> str:
    """A sphere as its user knows it."""
    cluster = int(spheres.cluster[i])
    if cluster < 0:
        return f"sphere {i + 1}"
    return f"cluster {cluster + 1} (its sphere {i - int(np.argmax(spheres.cluster == cluster)) + 1})"


def _check_one_piece(cluster: Cluster, number: int) -> None:
    x, n = cluster.arms(), len(cluster.radii)
    gap = CONNECTED * cluster.radii.min()
    near = near_spheres(x, np.array(cluster.radii), np.full(n, -1), gap, no_neighbours(n), 0)
    reached, follow = {0}, [0]
    neighbours: Dict[int, List[int]] = {i: [] for i in range(n)}
    for i in range(n):
        for j in near.partner[near.start[i]:near.start[i + 1]].tolist():
            neighbours[i].append(j)
            neighbours[j].append(i)
    while follow:
        for j in neighbours[follow.pop()]:
            if j not in reached:
                reached.add(j)
                follow.append(j)
    if len(reached) < n:
        apart = min(set(range(n)) - reached)
        raise ValueError(f"cluster {number + 1} is in two pieces: its sphere {apart + 1} at "
                         f"{cluster.centres[apart]} m does not hang together with its sphere 1 over touching "
                         "spheres: use larger or more spheres")


def _overlaps_of(scene: SceneData, spheres: int) -> Tuple[Dict[Tuple[int, int], float], np.ndarray]:
    """Overlaps [m] that the contacts of the scene say: of pairs of spheres, and of each of so many spheres
    with each wall, (spheres, walls), minus infinity without a contact."""
    walls = (*scene.fixed, scene.wall)
    at = np.full((spheres, len(walls)), -np.inf)
    if scene.contacts is None:
        return {}, at
    between, at_walls = scene.contacts
    group = np.repeat(np.arange(len(walls)), [len(wall.elements) for wall in walls])
    sphere, element = at_walls.partners.T
    named = 1 + max(between.partners.max(initial=-1), sphere.max(initial=-1))
    if named > spheres or element.max(initial=-1) >= len(group):
        raise ValueError(f"the contacts of the scene name sphere {named} of {spheres}, and element "
                         f"{1 + element.max(initial=-1)} of {len(group)} of its walls: {CHANGED}")
    np.maximum.at(at, (sphere, group[element]), at_walls.overlap)
    return dict(zip(map(tuple, between.partners.tolist()), between.overlap.tolist())), at


def _check_apart(spheres: SphereTable, slack: float, between: Dict[Tuple[int, int], float]) -> None:
    near = near_spheres(spheres.x, spheres.radius, spheres.cluster, 0.0, no_neighbours(len(spheres.x)), 0)
    first = np.repeat(np.arange(len(spheres.x)), np.diff(near.start))
    found = set(zip(first.tolist(), near.partner.tolist()))
    for i, j in sorted(found | set(between)):
        distance = np.sqrt(((spheres.x[j] - spheres.x[i]) ** 2).sum())
        overlap, stated = spheres.radius[i] + spheres.radius[j] - distance, between.get((i, j), 0.0)
        if abs(overlap - stated) > TOUCHING * spheres.radius[i] + slack:
            single = max(spheres.cluster[i], spheres.cluster[j]) < 0
            both = f"spheres {i + 1} and {j + 1}" if single else \
                f"{_name(spheres, i)} and {_name(spheres, j)}"
            remedy = f"not by {stated:.3g} m as its contacts say: {CHANGED}" if stated else \
                "move them apart by at least that much"
            raise ValueError(f"{both} overlap by {overlap:.3g} m at the start: {remedy}")


def _check_adhesion(scene: SceneData, spheres: SphereTable, wall: Wall) -> None:
    smallest = spheres.radius.min(initial=np.inf)
    sticky = [a for a, b in scene.wall_pairs() if b == wall.material and scene.interaction(a, b).adhesion > 0]
    if wall.depth is not None and wall.depth > smallest and sticky:
        raise ValueError(f"the wall of material {wall.material!r} has adhesion and a depth of {wall.depth} "
                         f"m: with adhesion give at most the smallest radius, {smallest:.3g} m, where the "
                         "area of contact ends")


def _check_outside(scene: SceneData, spheres: SphereTable, named: Tuple[Wall, str],
                   overlaps: Tuple[np.ndarray, np.ndarray], frame: Tuple[float, np.ndarray]) -> None:
    """overlaps: the least and the largest one that each sphere may have, (n,) each [m]."""
    (wall, what), (slack, origin) = named, frame
    table = wall_table(SceneData(wall=wall, materials=scene.materials))  # of this wall alone
    surface = at_rest(table, table.x)
    for i, radius in enumerate(spheres.radius):
        tolerance = TOUCHING * radius + slack
        distance, outside, e, weight = distance_and_side(spheres.x[i], surface, 1e-9 * radius + slack)
        distance -= wall.radius or 0.0
        at_rim = surface.traits[e, RIM:JOINT] * (weight == (1.0 if scene.dim == 2 else 0.0))
        if outside < -slack and not at_rim.any():
            place = (spheres.x[i] + origin)[:scene.dim]
            inside, remedy = ("the body", ", or reverse the wall elements (outside is left of a segment)") \
                if what.startswith(("the wall", "fixed wall")) else (what, "")
            raise ValueError(f"{_name(spheres, i)} at {place} m lies inside {inside}, {distance:.3g} m "
                             f"below its surface: move it out{remedy}")
        overlap, least, most = radius - distance, overlaps[0][i], overlaps[1][i]
        if not least - tolerance <= overlap <= most + tolerance:
            remedy = f"not by {most:.3g} m as the contacts of the scene say: {CHANGED}" if most else \
                "move it away from the wall by at least that much"
            raise ValueError(f"{_name(spheres, i)} overlaps {what} by {overlap:.3g} m at the start: {remedy}")


def check_window(steps: int, x: np.ndarray, v: np.ndarray, scene: SceneData) -> int:
    """``steps`` as int; ValueError unless the arguments of `protocol.DEM.advance` make sense."""
    shape = scene.wall.nodes.shape
    if not all(isinstance(a, np.ndarray) and a.shape == shape for a in (x, v)):
        for name, value in (("x", x), ("v", v)):
            check.shaped(f"{name} of the wall nodes", value, shape)
    return check.count("steps", steps, rule="a window has at least one DEM step, give a whole number of them")


def check_finite(x: np.ndarray, time: float, origin: Union[float, np.ndarray] = 0.0) -> None:
    """Raise FloatingPointError, naming the particle and the time [s], unless all positions x [m] from
    ``origin`` [m] are finite."""
    if not np.isfinite(x.sum()):
        bad = int(np.flatnonzero(~np.isfinite(x).all(axis=1))[0])
        raise FloatingPointError(f"particle {bad + 1} is at {x[bad] + origin} m at t = {time:.6g} s: its "
                                 "contact is too stiff for the DEM time step, or the wall passed through it; "
                                 "use more substeps per window")


class PerforatedError(RuntimeError):
    """A sphere goes through the wall."""


def through_the_wall(name: str, time: float) -> str:
    """What is said of the sphere ``name`` in the window that starts at ``time`` [s]."""
    return f"{name} {GONE} (in the window from t = {time:.6g} s)"
