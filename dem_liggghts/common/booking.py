"""Where the walls of a scene are in a window, and which impulses they and gravity have given to the
particles; for both back ends."""
from typing import Any, Callable, Dict, List, NamedTuple, Tuple

import numpy as np

from ..scene.arrays import in_space
from ..scene.scene import SceneData

GRAVITY, BASE, ARMS, INTERFACE = "gravity", "base", "arms", "interface"


def moments(x: np.ndarray, f: np.ndarray) -> np.ndarray:
    """Forces f with their moments x × f about the origin, shape (n, 6); x, f: (n, 3)."""
    (x, y, z), (a, b, c) = x.T, f.T
    return np.column_stack([f, y * c - z * b, z * a - x * c, x * b - y * a])


class Hits(NamedTuple):
    """What particles have given to the walls in a window: of the nodes of a terrain few are hit."""

    node: np.ndarray  # numbers of those, rising, the interface's last, (n,)
    middle: np.ndarray  # their places in the middle of the window [m], (n, 3)
    impulse: np.ndarray  # [N s], (n, 3)
    # angular impulse of all walls on the particles [N m s] and mass times place of these, summed over the
    # steps [kg m s], both about the origin of the frame, (2, 3)
    whole: np.ndarray


class WallBooks:
    """Books of the walls of a scene, name → linear [N s] and angular impulse about zero [N m s]: of each
    force cell of its structures, of other fixed walls by their material, of the interface and of gravity.

    The impulse of a wall is that of velocity Verlet's own half kicks, its moment that about its nodes in the
    middle of a window. What is left of the moment of all walls is "arms", without a linear impulse: friction
    acts on the rim of a ball, a material point's, that does not spin and takes the force at its centre, and
    walls move in a window. Sums are exact, also of gravity's moment, from the places of the particles in all
    steps; where a cluster is not free to move it follows from those at both ends of a window.
    """

    def __init__(self, scene: SceneData) -> None:
        self._scene, self._dim = scene, scene.dim
        cells = [name for one in scene.structures for name in one.cells]
        shaken = [BASE] if scene.base else []
        self.names = [GRAVITY, *shaken, *dict.fromkeys([*(wall.material for wall in scene.walls), *cells]),
                      ARMS, INTERFACE]
        row = {name: number for number, name in enumerate(self.names)}
        of_nodes: List[np.ndarray] = [np.full(len(wall.nodes), row[wall.material]) for wall in scene.walls]
        for one, wall in zip(scene.structures, scene.surfaces):
            of_nodes.append(np.repeat([row[one.cells[k]] for k in one.cell], one.dim) if len(one.cells) > 1
                            else np.full(len(wall.nodes), row[one.name]))
        self._row = np.concatenate([np.zeros(0, int), *of_nodes]).astype(int)
        self.fixed = len(self._row)  # nodes in front of those of the interface
        ends = np.cumsum([0, *(len(wall.nodes) for wall in scene.fixed)])[len(scene.walls):]
        moving = [(one, wall.nodes, np.arange(first, end)) for one, wall, first, end
                  in zip(scene.structures, scene.surfaces, ends, ends[1:]) if one.motion is not None]
        # numbers of the nodes of structures that move
        self.moving = np.concatenate([np.zeros(0, int), *(nodes for _, _, nodes in moving)])
        self._start = in_space(np.concatenate([np.zeros((0, self._dim)), *(x for _, x, _ in moving)]))
        ends = np.cumsum([0, *(len(nodes) for _, _, nodes in moving)])
        self._movers = [(one, slice(*rows)) for (one, _, _), *rows in zip(moving, ends, ends[1:])]
        self._sums = np.zeros((len(self.names), 6))
        self._gravity, self._base = in_space([scene.gravity, scene.frame_pull(0.0, 0.0)])
        self._pulled = bool(self._gravity.any()) or scene.base is not None
        self._mass = np.zeros((3, 7))  # now, see ``_weigh``
        self._whole = all(cluster.flags[:self._dim].all() for cluster in scene.clusters)
        self.base_work = 0.0

    # ---------------------------------------------------------------- where walls are

    def places(self, time: float, origin: np.ndarray) -> np.ndarray:
        """The nodes ``moving``, of structures that move, at ``time`` [s] in the frame of ``origin`` [m],
        shape (n, 3)."""
        x = self._start - origin
        for one, own in self._movers:
            x[own, :self._dim] += _displacement(one, time)
        return x

    def motion(self, time: float, span: float, origin: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
        """The ``places`` [m] at ``time`` [s] and velocities [m/s] that take them to those ``span`` [s] later,
        (n, 3) each."""
        x = self.places(time, origin)
        return x, (self.places(time + span, origin) - x) / span

    # ---------------------------------------------------------------- gravity and the base

    @property
    def pull(self) -> np.ndarray:
        """Of gravity and the base in the last window, at the start in its first moment [m/s^2], (3,)."""
        return self._gravity + self._base

    def shake(self, time: float, steps: int, dt: float) -> np.ndarray:
        """The ``pull`` in a window of ``steps`` of ``dt`` [s] from ``time`` [s] on. In its first half kick
        the last one acts."""
        before, self._base = self._base, in_space([self._scene.frame_pull(time, steps * dt)])[0]
        self._mean = self._base + (before - self._base) / (2.0 * steps)
        return self.pull

    # ---------------------------------------------------------------- impulses

    def begin(self, particles: np.ndarray, bodies: np.ndarray) -> None:
        """Particles and bodies are those that there are now: at the start, and when some have left."""
        self._mass = self._weigh(particles, bodies)

    def add(self, hits: Hits, span: float, particles: Callable, bodies: Callable,
            origin: np.ndarray) -> None:
        """After a window of ``span`` [s]: ``hits`` in the frame with this ``origin`` [m]; functions that give
        ``particles`` and ``bodies`` of now, where something pulls them."""
        hit, (turned, places), before = hits.node, hits.whole, self._mass
        given, first = -moments(hits.middle + origin, hits.impulse), np.searchsorted(hit, self.fixed)
        for k in range(6 if first else 0):
            self._sums[:, k] += np.bincount(self._row[hit[:first]], given[:first, k], len(self.names))
        self._sums[-1] += given[first:].sum(axis=0)
        whole = given.sum(axis=0)
        self._sums[-2, 3:] += turned + moments(origin[None], whole[None, :3])[0, 3:] - whole[3:]
        if not self._pulled:
            return
        self._mass = self._weigh(particles(), bodies())
        both = 0.5 * span * (before + self._mass)[:, :6]
        if self._whole:  # else only the places of those that are free would count
            both[:, 3:] = np.cross(places + both[0, 0] * origin, np.eye(3))
        self._sums[0] += self._gravity @ both
        if self._scene.base:
            self._sums[1] += self._mean @ both
            self.base_work += float(self._mean @ (self._mass - before)[:, 6])

    def _weigh(self, particles: np.ndarray, bodies: np.ndarray) -> np.ndarray:
        """Force and moment about zero of 1 m/s^2 along each axis, and mass times place along it, shape (3,
        7); nothing moves what is held."""
        found = np.zeros((3, 7))
        if not self._pulled:
            return found
        single = particles[particles["body"] == 0]
        parts = [(single["mass"], single["x"], np.ones((len(single), 3)))]
        if len(bodies):
            free = np.array([self._scene.clusters[k - 1].flags[:3] for k in bodies["id"]], float)
            parts.append((bodies["mass"], bodies["x"], free))
        for mass, x, free in parts:
            for k, axis in enumerate(np.eye(3)):
                own = mass * free[:, k]
                found[k, :6] += moments(x, own[:, None] * axis).sum(axis=0)
                found[k, 6] += own @ x[:, k]
        return found

    def sums(self) -> Dict[str, np.ndarray]:
        """Name → the components that the scene has: linear, then angular."""
        chosen = [0, 1, 5] if self._dim == 2 else slice(None)
        return dict(zip(self.names, self._sums[:, chosen].copy()))

    def get_state(self) -> Dict[str, np.ndarray]:
        """As name → array copy."""
        more = np.array([*self._base, self.base_work, 0.0, 0.0])
        rows = np.vstack([self._sums, self._mass[:, :6], more])
        return {"impulses": rows, "placed": self._mass[:, 6].copy()}

    def set_state(self, state: Dict[str, Any]) -> None:
        """Go back to what ``get_state`` gave."""
        rows = np.array(state["impulses"])
        self._sums, self._base, self.base_work = rows[:-4], rows[-1, :3], float(rows[-1, 3])
        self._mass = np.column_stack([rows[-4:-1], state["placed"]])


def _displacement(one: Any, time: float) -> np.ndarray:
    """Of the nodes of the wall of a structure at ``time`` [s], shape (dim,) or (n, dim) [m]."""
    w = np.asarray(one.motion(time), float)
    return w if w.ndim == 1 or len(one.cells) == 1 else w[one.elements.ravel()]
