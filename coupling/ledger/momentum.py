"""Linear and angular momentum of the grains and of what the interface gives the solid, all components."""
from typing import Any, Iterator, Tuple

import numpy as np

from .departures import left

AXES = "xyz"
CHANGING = "time", "without", "mass_left", "torque", "turned"  # from window to window


def turning(x: np.ndarray, f: np.ndarray) -> np.ndarray:
    """Sum of the moments x × f about the origin; x, f: shape (n, 2 or 3). Shape (1,) in a plane, about z,
    else (3,)."""
    if x.shape[1] == 2:
        return np.array([x[:, 0] @ f[:, 1] - x[:, 1] @ f[:, 0]])
    (x, y, z), (a, b, c) = x.T, f.T
    return np.array([y @ c - z @ b, z @ a - x @ c, x @ b - y @ a])


class Momentum:
    """Momentum of grains less what gravity and the motion of the base gave them since the start.

    gravity [m/s^2], shape (dim,); it does not pull clusters that are held up. Linear momentum is exact and
    counts what has left at the end of a window. Of the angular momentum about ``about`` [m] gravity's share
    is what grains that keep books say, exact, and else follows from the trapezoidal rule over each window.
    """

    def __init__(self, grains: Any, gravity: np.ndarray, time: float, about: Any = 0.0) -> None:
        self._grains, self._gravity, self._time, self._about = grains, gravity, time, about
        self._seen: Any = None  # particles whose momentum is known
        self._without = np.zeros(len(gravity))  # impulse that gravity would have given to what has left
        self._mass_left = left(grains, "mass")
        particles, scene = grains.particles(), getattr(grains, "scene", None)
        self._clusters = getattr(scene, "clusters", ())
        self._single = particles["body"] == 0 if self._clusters else slice(None)
        self._free = np.array([c.flags[:len(gravity)] for c in self._clusters]).reshape(-1, len(gravity))
        self._inertia = np.array([c.inertia for c in self._clusters]).reshape(-1, 3, 3)
        self._books = hasattr(grains, "impulses")
        self._start, self._torque = self.now(particles), self._torque_of_gravity(particles)
        self._weight = gravity * (particles["mass"][self._single].sum()
                                  + np.array([c.mass for c in self._clusters]) @ self._free)
        self._begin, self._turned = time, 0.0 * self._torque
        self._shaken = self._of_base()

    def gained(self, particles: np.ndarray, time: float) -> Tuple[np.ndarray, np.ndarray]:
        """Linear [N s], (dim,), and angular impulse [N m s], (1,) or (3,), that was not gravity's, until
        ``time`` [s]."""
        torque, window, before = self._torque_of_gravity(particles), time - self._time, self._torque
        self._without = self._without + window * self._mass_left * self._gravity
        self._mass_left = left(self._grains, "mass")
        self._turned = self._turned + (torque - before if self._books else 0.5 * window * (before + torque))
        self._torque, self._time = torque, time
        linear, angular = (now - start for now, start in zip(self.now(particles), self._start))
        linear += left(self._grains, "momentum") + self._without
        shaken, turned = self._of_base()
        return (linear - self._weight * (time - self._begin) - shaken + self._shaken[0],
                angular - self._turned - turned + self._shaken[1])

    def _of_base(self) -> Tuple[Any, Any]:
        """Linear and angular impulse of the motion of the base since its start."""
        if not getattr(getattr(self._grains, "scene", None), "base", None):
            return 0.0, 0.0
        row, dim = self._grains.impulses()["base"], len(self._gravity)
        about = np.broadcast_to(np.asarray(self._about, float), (dim,))
        return row[:dim], row[dim:] - turning(about[None], row[None, :dim])

    def now(self, particles: np.ndarray) -> Tuple[Any, Any]:
        """Linear momentum [kg m/s] and angular momentum [kg m^2/s] of ``particles``, which are those of this
        moment. A cluster counts with its mass at its centre of mass: the shares of its spheres have the same
        sum only where their own centre is there, too."""
        if particles is not self._seen:
            self._seen, self._found = particles, self._sum(particles)
        return self._found

    def about_zero(self, particles: np.ndarray) -> np.ndarray:
        """Both in one array, the angular momentum about zero."""
        linear, angular = self.now(particles)
        if np.any(self._about):
            angular = angular + turning(np.asarray(self._about)[None], linear[None])
        return np.concatenate([linear, angular])

    def _sum(self, particles: np.ndarray) -> Tuple[Any, Any]:
        linear: Any = 0.0
        angular: Any = 0.0
        for mass, x, v in self._parts(particles):
            linear, angular = linear + mass @ v, angular + turning(x, mass[:, None] * v)
        return linear, angular + self._spin(particles)[-len(angular):]

    def get_state(self) -> dict:
        """As name → numbers."""
        return {name: getattr(self, f"_{name}") for name in CHANGING}

    def set_state(self, state: dict) -> None:
        """The counterpart."""
        for name in CHANGING:
            setattr(self, f"_{name}", state[name])

    def _parts(self, particles: np.ndarray) -> Iterator[tuple]:
        """Single spheres and clusters, components as in the scene: mass, x and v of each."""
        dim = len(self._gravity)
        single = particles[self._single]
        yield single["mass"], single["x"][:, :dim] - self._about, single["v"][:, :dim]
        if self._clusters:
            bodies = self._grains.bodies()
            yield bodies["mass"], bodies["x"][:, :dim] - self._about, bodies["v"][:, :dim]

    def _spin(self, particles: np.ndarray) -> np.ndarray:
        """Angular momentum about the centres of mass [kg m^2/s], shape (3,)."""
        if "omega" not in particles.dtype.names:
            return np.zeros(3)
        single = particles[self._single]
        spin = (0.4 * single["mass"] * single["radius"]**2) @ single["omega"]
        if self._clusters:
            bodies = self._grains.bodies()
            turn = rotation(bodies["quaternion"].T)
            inner = np.einsum("nij,kjn,nk->ni", self._inertia, turn, bodies["omega"])
            spin = spin + np.einsum("ijn,nj->i", turn, inner)
        return spin

    def _torque_of_gravity(self, particles: np.ndarray) -> Any:
        """About ``about`` [N m]; of grains that keep books what it has given since the start [N m s]."""
        if self._books:
            dim, row = len(self._gravity), self._grains.impulses()["gravity"]
            about = np.broadcast_to(self._about, (1, dim))
            return row[dim:] - turning(about, row[None, :dim])
        if not self._gravity.any():
            return np.zeros(1 if len(self._gravity) == 2 else 3)
        shares = [1.0, self._free][:1 + bool(self._clusters)]
        return sum(turning(x, mass[:, None] * self._gravity * free)
                   for (mass, x, _), free in zip(self._parts(particles), shares))


def rotation(q: np.ndarray) -> np.ndarray:
    """Matrix of the unit quaternion (w, x, y, z), shape (3, 3), or matrices, (3, 3, n), of (4, n)."""
    w, (x, y, z) = q[0], q[1:]
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])
