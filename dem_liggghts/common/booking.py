"""Where the walls of a scene are in a window, and which impulses they and gravity have given to the
particles; for both back ends."""
from typing import Any, Dict, List, Tuple

import numpy as np

from ..scene.arrays import in_space
from ..scene.scene import SceneData

GRAVITY, INTERFACE = "gravity", "interface"


def moments(x: np.ndarray, f: np.ndarray) -> np.ndarray:
    """Forces f with their moments x × f about the origin, shape (n, 6); x, f: (n, 3)."""
    (x, y, z), (a, b, c) = x.T, f.T
    return np.column_stack([f, y * c - z * b, z * a - x * c, x * b - y * a])


class WallBooks:
    """Books of the walls of a scene, name → linear [N s] and angular impulse about zero [N m s]: of each
    force cell of its structures, of other fixed walls by their material, of the interface and of gravity.

    The impulse of a wall is that of velocity Verlet's own half kicks, at the middle of a window: where walls
    stand still the sums are exact. That of gravity is exact, but for its moment, which follows from the
    places of the particles at both ends of a window.
    """

    def __init__(self, scene: SceneData) -> None:
        self._scene, self._dim = scene, scene.dim
        cells = [name for one in scene.structures for name in one.cells]
        self.names = [GRAVITY, *dict.fromkeys([*(wall.material for wall in scene.walls), *cells]), INTERFACE]
        row = {name: number for number, name in enumerate(self.names)}
        of_nodes: List[np.ndarray] = [np.full(len(wall.nodes), row[wall.material]) for wall in scene.walls]
        for one, wall in zip(scene.structures, scene.surfaces):
            of_nodes.append(np.repeat([row[one.cells[k]] for k in one.cell], one.dim) if len(one.cells) > 1
                            else np.full(len(wall.nodes), row[one.name]))
        self._row = np.concatenate([np.zeros(0, int), *of_nodes]).astype(int)
        self.fixed = len(self._row)  # nodes in front of those of the interface
        self._start = in_space(np.concatenate([np.zeros((0, self._dim)), *(w.nodes for w in scene.fixed)]))
        ends = np.cumsum([0, *(len(wall.nodes) for wall in scene.fixed)])[len(scene.walls):]
        self._moving = [(one, slice(first, end)) for one, first, end in zip(scene.structures, ends, ends[1:])
                        if one.motion is not None]
        self._sums = np.zeros((len(self.names), 6))
        self._pull = in_space([scene.gravity])[0]
        self._weight = np.zeros(6)  # now: force and moment

    # ---------------------------------------------------------------- where walls are

    def places(self, time: float, origin: np.ndarray) -> np.ndarray:
        """Nodes of all walls but the interface at ``time`` [s], in the frame of ``origin`` [m], shape (n,
        3)."""
        x = self._start - origin
        for one, own in self._moving:
            x[own, :self._dim] += _displacement(one, time)
        return x

    def motion(self, time: float, span: float, origin: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
        """Places [m] at ``time`` [s] and velocities [m/s] that take them to those ``span`` [s] later, (n, 3)
        each."""
        x = self.places(time, origin)
        if not self._moving:
            return x, np.zeros_like(x)
        return x, (self.places(time + span, origin) - x) / span

    # ---------------------------------------------------------------- impulses

    def begin(self, particles: np.ndarray, bodies: np.ndarray) -> None:
        """Particles and bodies are those that there are now: at the start, and when some have left."""
        self._weight = self._weigh(particles, bodies)

    def add(self, x: np.ndarray, impulse: np.ndarray, span: float, particles: np.ndarray,
            bodies: np.ndarray) -> None:
        """After a window of ``span`` [s]: ``impulse`` [N s] on all wall nodes, which were at x [m] in its
        middle, those of the interface last, (n, 3) each; ``particles`` and ``bodies`` now."""
        # Of the nodes of a terrain few are hit, and moments of all of them would cost more than the contacts.
        hit, before = np.flatnonzero((impulse != 0.0).any(axis=1)), self._weight
        given, first = -moments(x[hit], impulse[hit]), np.searchsorted(hit, self.fixed)
        for k in range(6 if first else 0):
            self._sums[:, k] += np.bincount(self._row[hit[:first]], given[:first, k], len(self.names))
        self._sums[-1] += given[first:].sum(axis=0)
        self._weight = self._weigh(particles, bodies)
        self._sums[0] += 0.5 * span * (before + self._weight)

    def _weigh(self, particles: np.ndarray, bodies: np.ndarray) -> np.ndarray:
        """Force and moment about zero of gravity; it does not move what is held."""
        if not self._pull.any():
            return np.zeros(6)
        single = particles[particles["body"] == 0]
        found = moments(single["x"], single["mass"][:, None] * self._pull).sum(axis=0)
        if len(bodies):
            free = np.array([self._scene.clusters[k - 1].flags[:3] for k in bodies["id"]])
            found = found + moments(bodies["x"], bodies["mass"][:, None] * self._pull * free).sum(axis=0)
        return found

    def sums(self) -> Dict[str, np.ndarray]:
        """Name → the components that the scene has: linear, then angular."""
        chosen = [0, 1, 5] if self._dim == 2 else slice(None)
        return {name: row[chosen].copy() for name, row in zip(self.names, self._sums)}

    def get_state(self) -> Dict[str, np.ndarray]:
        """As name → array copy."""
        return {"impulses": np.vstack([self._sums, self._weight])}

    def set_state(self, state: Dict[str, Any]) -> None:
        """Go back to what ``get_state`` gave."""
        rows = np.array(state["impulses"])
        self._sums, self._weight = rows[:-1], rows[-1]


def _displacement(one: Any, time: float) -> np.ndarray:
    """Of the nodes of the wall of a structure at ``time`` [s], shape (dim,) or (n, dim) [m]."""
    w = np.asarray(one.motion(time), float)
    return w if w.ndim == 1 or len(one.cells) == 1 else w[one.elements.ravel()]
